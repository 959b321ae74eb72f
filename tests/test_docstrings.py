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


def test_every_module_says_what_it_is_and_its_examples_print_what_they_say():
    modules = [importlib.import_module(name) for name in MODULES]
    assert [module.__name__ for module in modules if not module.__doc__ or doctest.testmod(module).failed] == []
