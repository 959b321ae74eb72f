"""What a type checker and an editor see of the package."""

import subprocess
import sys
from pathlib import Path

import pytest

import asympk as ap

ROOT = Path(ap.__file__).parent.parent
WRONG = {
    "ap.solve(42)": 'incompatible type "int"; expected "Scene"',
    "ap.jmp_map()": 'has no attribute "jmp_map"',
    "ap.solve(ap.Scene(1, 1, (0, 0, 1), 1)).plt()": 'has no attribute "plt"',
}


@pytest.fixture(scope="module")
def complaints(tmp_path_factory):
    file = tmp_path_factory.mktemp("types") / "wrong.py"
    file.write_text("import asympk as ap\n" + "\n".join(WRONG) + "\nap.solve(ap.read_scene('forward')).final\n")
    command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), str(file)]
    found = subprocess.run(command, capture_output=True, text=True, cwd=ROOT).stdout
    return [line for line in found.splitlines() if "wrong.py" in line]


def test_a_type_checker_refuses_what_is_no_scene_and_names_that_do_not_exist(complaints):
    assert len(complaints) == len(WRONG)
    for line, said in zip(complaints, WRONG.values(), strict=True):
        assert said in line


def test_completion_shows_public_names_alone():
    assert {name for name in dir(ap) if not name.startswith("__")} == set(ap.__all__)


def test_a_type_checker_sees_every_public_name():
    text = Path(ap.__file__).read_text(encoding="utf-8")
    for name in ap.__all__:
        assert f"{name} as {name}" in text
