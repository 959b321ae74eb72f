"""The README's example runs and prints what the README says."""

import contextlib
import io
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_example_prints_what_the_readme_shows():
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    (shown,) = re.findall(r"prints\n\n```text\n(.*?)```", README, re.DOTALL)
    screen = io.StringIO()
    with contextlib.redirect_stdout(screen):
        exec(compile(code, "README.md", "exec"), {})
    assert screen.getvalue() == shown


def test_ci_runs_the_two_commands_of_the_readme():
    install, test = re.findall(r"```sh\n(.*?)```", README, re.DOTALL)[0].strip().splitlines()
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "README.md" in script
    assert install.startswith("python3 -m venv --without-pip .venv")
    assert test == ".venv/bin/python -m pytest"


def test_ci_installs_the_peers_before_it_runs_the_tests():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert 0 < script.index("install -qe '.[peers]'") < script.index("${commands[1]}")
