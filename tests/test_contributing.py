"""The recipes of CONTRIBUTING are followed to the letter: their code is put where they say, and works."""

import re
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import asympk as ap
from asympk import methods, systems
from asympk.cli import main as cli
from asympk.errors import Unfinished
from asympk.integrators import integrate
from asympk.ledger import remarks
from asympk.output import artefacts, gallery, mechanisms
from asympk.pictures import portraits

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
RECIPES = dict(re.findall(r"### A new (\w+)\n.*?```python\n(.*?)```", TEXT, re.DOTALL))


def as_module(monkeypatch, code):
    """Return the module whose file the first line of a recipe names."""
    name = re.match(r"# (\S+)\.py\n", code)[1].replace("/", ".")
    module = ModuleType(name)
    exec(compile(code, name, "exec"), module.__dict__)
    monkeypatch.setitem(sys.modules, name, module)
    parent, _, own = name.rpartition(".")
    monkeypatch.setattr(sys.modules[parent], own, module, raising=False)
    return module


def test_there_are_five_recipes():
    assert list(RECIPES) == ["system", "integrator", "claim", "figure", "command"]


def test_a_new_system_is_known_to_every_verb(monkeypatch):
    wedge = as_module(monkeypatch, RECIPES["system"])
    monkeypatch.setattr(systems, "MECHANISMS", (*systems.MECHANISMS, "wedge"))
    assert "critical        friction" in mechanisms.mechanism_as_text(mechanisms.load_mechanism("wedge"))
    path = ap.solve(wedge.scenes()[0])
    assert path.modes[0].startswith("slip")
    assert path.end == 1


def test_a_new_integrator_follows_the_automaton(monkeypatch):
    as_module(monkeypatch, RECIPES["integrator"])
    monkeypatch.setitem(integrate.FAMILIES, "heun", "heun")
    monkeypatch.setitem(methods.METHODS, "heun", "integrators.integrate")
    scene = ap.Scene(sigma=1, mu="1/10", start=(0, "1/5", -1), until=3)
    path, exact = ap.solve(scene, method="heun"), ap.solve(scene)
    assert path.modes == exact.modes
    assert np.allclose(path.final, exact.final, atol=1e-4)
    assert np.allclose(path(1.5), exact(1.5), atol=1e-4)
    with pytest.raises(Unfinished, match="left the range of floats"):  # nan loses no guard
        ap.solve(replace(scene, mu="1e-9"), method="heun")


def test_a_new_claim_is_judged(monkeypatch):
    names = dict(vars(remarks))
    exec(RECIPES["claim"], names)
    found = names["smooth_mass"]()
    assert (found.id, found.verdict) == ("C99", "confirmed")


def test_a_new_figure_is_drawn(monkeypatch, tmp_path):
    drawing, choosing, entry = re.split(r"# in asympk/\w+/\w+\.py\n", RECIPES["figure"])[1:]
    for code, module, name in ((drawing, portraits, "slow_line"), (choosing, gallery, "slow_line_picture")):
        names = {"np": np, **vars(module)}
        exec(code, names)
        monkeypatch.setattr(module, name, names[name], raising=False)
    found = artefacts.pictures(tmp_path, [eval(entry, vars(artefacts))])
    assert len(found["slow-line"]().axes[0].lines) == 1


def test_a_new_command_runs_and_refuses_in_one_line(monkeypatch, capsys):
    as_module(monkeypatch, RECIPES["command"])
    monkeypatch.setattr(cli, "COMMANDS", (*cli.COMMANDS, "greet"))
    assert cli.main(["greet", "backward"]) == 0
    assert capsys.readouterr().out == "hello, backward\n"
    assert cli.main(["greet", "backwards"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("file", sorted(set(re.findall(r"`(asympk/[\w/]+\.py)`", TEXT))))
def test_every_file_that_a_recipe_names_is_there(file):
    assert (ROOT / file).is_file()
