"""The README's how-to: its files are read, its sessions print what it says, its commands run."""

import doctest
import re
import shlex
from pathlib import Path

import pytest

from asympk.__main__ import main

ROOT = Path(__file__).parents[1]
HOWTO = (ROOT / "README.md").read_text(encoding="utf-8").partition("## How to\n")[2]


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A directory with the files that the how-to shows, under the names in their first lines."""
    monkeypatch.chdir(tmp_path)
    for text in re.findall(r"```toml\n(.*?)```", HOWTO, re.DOTALL):
        (tmp_path / re.match(r"# (\w+\.toml)", text)[1]).write_text(text, encoding="utf-8")
    return tmp_path


def test_the_sessions_of_the_howto_print_what_it_says(desk):
    session = "\n".join(re.findall(r"```pycon\n(.*?)```", HOWTO, re.DOTALL))
    test = doctest.DocTestParser().get_doctest(session, {}, "README.md", "README.md", 0)
    told = []
    runner = doctest.DocTestRunner()
    runner.run(test, out=told.append)
    assert runner.tries >= 15
    assert runner.failures == 0, "".join(told)


def test_the_commands_of_the_howto_run(desk, capsys):
    lines = "\n".join(re.findall(r"```sh\n(.*?)```", HOWTO, re.DOTALL)).splitlines()
    commands = [shlex.split(line, comments=True) for line in lines if line]
    commands.append(re.search(r"`asympk (sweep fan.toml --out fan)`", HOWTO)[1].split())
    commands.append(re.search(r"`asympk (export --target c --out build)`", HOWTO)[1].split())
    for command in commands:
        assert main(command[1:] if command[0] == "asympk" else command) == 0, command
    written = {"my.png", "my.csv", "fan", "build"}
    assert written <= {path.name for path in desk.iterdir()}
    assert "6,000 trajectories" in capsys.readouterr().out
