"""What a type checker and an editor see of the package."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest
from parsed import parsed

import asympk as ap

ROOT = Path(ap.__file__).parent.parent
FILES = sorted((ROOT / "asympk").rglob("*.py"))
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


@pytest.mark.further
def test_a_type_checker_refuses_what_is_no_scene_and_names_that_do_not_exist(complaints):
    assert len(complaints) == len(WRONG)
    for line, said in zip(complaints, WRONG.values(), strict=True):
        assert said in line


def test_completion_shows_public_names_alone():
    for module in (ap, ap.systems):
        assert {name for name in dir(module) if not name.startswith("__")} == set(module.__all__)


@pytest.mark.slow
def test_a_type_checker_sees_every_public_name():
    text = Path(ap.__file__).read_text(encoding="utf-8")
    for name in ap.__all__:
        assert f"{name} as {name}" in text


def bare(function, method):
    """Return the arguments of a function, "return" for what it returns, that have no annotation."""
    given = function.args
    found = [*given.posonlyargs, *given.args, *given.kwonlyargs, *filter(None, (given.vararg, given.kwarg))]
    static = any(getattr(mark, "id", "") == "staticmethod" for mark in function.decorator_list)
    missing = [one.arg for one in found[method and not static :] if one.annotation is None]
    return missing + ["return"] * (function.returns is None and function.name != "__init__")


def public(body, method=False):
    """Yield (function, whether it is a method) for all that others may call: dunder methods too."""
    for node in body:
        if isinstance(node, ast.FunctionDef) and (not node.name.startswith("_") or node.name.endswith("__")):
            yield node, method
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from public(node.body, method=True)


def without_types(source):
    """Return the public functions and methods of a module that lack an annotation."""
    found = ((function.name, bare(function, method)) for function, method in public(parsed(source).body))
    return {name: missing for name, missing in found if missing}


def test_every_public_function_says_what_it_takes_and_returns():
    found = {str(file.relative_to(ROOT)): without_types(file.read_text(encoding="utf-8")) for file in FILES}
    assert {file: missing for file, missing in found.items() if missing} == {}


def test_help_says_that_a_picture_is_a_figure_before_matplotlib_is_loaded():
    assert inspect.signature(ap.phase).return_annotation.__name__ == "Figure"


def test_a_function_that_does_not_say_so_is_found():
    source = "def f(x: int, *, y) -> int: ...\nclass C:\n    def g(self, a: int): ...\n    def _h(self, b): ...\n"
    assert without_types(source) == {"f": ["y"], "g": ["return"]}
