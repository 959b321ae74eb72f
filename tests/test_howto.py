"""The how-to pages of the site: their files are read, their sessions print what they say, their commands run."""

import doctest
import re
import shlex
from pathlib import Path

import pytest

from asympk.__main__ import main
from asympk.output.terminal import NEXT

DOCS = Path(__file__).parents[1] / "docs"
PAGES = {name: (DOCS / f"{name}.md").read_text(encoding="utf-8") for name in ("howto", "own", "limits")}
INLINE = ("sweep fan.toml --out fan", "export --target c --out build")


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A directory with the files that the pages show, under the names in their first lines."""
    monkeypatch.chdir(tmp_path)
    for text in re.findall(r"```toml\n(.*?)```", "".join(PAGES.values()), re.DOTALL):
        (tmp_path / re.match(r"# (\w+\.toml)", text)[1]).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(("name", "least"), [("howto", 10), ("own", 10), ("limits", 9)])
@pytest.mark.few(1)
def test_the_sessions_of_a_page_print_what_it_says(name, least, desk):
    session = "\n".join(re.findall(r"```pycon\n(.*?)```", PAGES[name], re.DOTALL))
    test = doctest.DocTestParser().get_doctest(session, {}, name, f"{name}.md", 0)
    told = []
    runner = doctest.DocTestRunner()
    runner.run(test, out=told.append)
    assert runner.tries >= least
    assert runner.failures == 0, "".join(told)


@pytest.mark.slow
def test_the_commands_of_the_pages_run(desk, capsys):
    lines = "\n".join(re.findall(r"```sh\n(.*?)```", "".join(PAGES.values()), re.DOTALL)).splitlines()
    commands = [shlex.split(line, comments=True) for line in lines if line]
    for inline in INLINE:
        assert f"`asympk {inline}`" in PAGES["howto"]
        commands.append(inline.split())
    for command in commands:
        assert main(command[1:] if command[0] == "asympk" else command) == 0, command
    written = {"my.png", "my.csv", "fan", "build"}
    assert written <= {path.name for path in desk.iterdir()}
    assert "6,000 trajectories" in capsys.readouterr().out


@pytest.mark.parametrize("line", NEXT)
@pytest.mark.few(1)
def test_what_the_main_job_says_to_try_next_runs(line, desk):
    command = line.partition("  ")[0].split()
    assert command[0] == "asympk"
    assert main(command[1:]) == 0
