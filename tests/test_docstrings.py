"""The examples in docstrings run."""

import doctest
import importlib
import pkgutil

import asympk

MODULES = sorted(
    info.name
    for info in pkgutil.walk_packages(asympk.__path__, "asympk.")
    if "__main__" not in info.name and "integrators" not in info.name
)

LENGTH = 15  # lines of a module's docstring: what the module decides, and which equation lives there
FORMATS = {"asympk", "asympk.mechanics.described", "asympk.scenes.scenefile", "asympk.scenes.systemfile"}


def test_a_module_says_in_a_minute_what_it_decides_unless_it_defines_a_file():
    lines = {name: len(importlib.import_module(name).__doc__.splitlines()) for name in {*MODULES, "asympk"} - FORMATS}
    assert {name: count for name, count in lines.items() if count > LENGTH} == {}


def test_every_module_says_what_it_is_and_its_examples_print_what_they_say():
    modules = [importlib.import_module(name) for name in MODULES]
    assert [module.__name__ for module in modules if not module.__doc__ or doctest.testmod(module).failed] == []
