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
    assert test == '.venv/bin/python -m pytest -n auto -m "not slow"'


def test_ci_runs_the_slow_tests_that_the_readme_leaves_out():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert script.endswith('\n.venv/bin/python -m pytest -n auto -m "slow and not further"\n')


def test_ci_installs_the_peers_before_it_runs_the_tests():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert 0 < script.index("install -qe '.[peers]'") < script.index("${commands[1]}")


def test_the_session_of_the_readme_is_that_of_the_site():
    (session,) = re.findall(r"```pycon\n(.*?)```", README, re.DOTALL)
    assert session in (ROOT / "docs" / "own.md").read_text(encoding="utf-8")


def test_the_readme_is_short_and_begins_with_the_mechanism_before_the_paper():
    assert README.count("\n") < 250
    assert 0 < README.index("## You have a mechanism") < README.index("## You have the paper")


def test_what_the_readme_links_to_is_there():
    for link in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / link).exists(), link
