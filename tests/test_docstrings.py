"""The examples in docstrings run."""

import doctest
import importlib
import pkgutil

import pytest

import asympk

MODULES = sorted(
    info.name
    for info in pkgutil.walk_packages(asympk.__path__, "asympk.")
    if "__main__" not in info.name and "integrators" not in info.name
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_print_what_they_say(name):
    module = importlib.import_module(name)
    assert module.__doc__
    assert doctest.testmod(module).failed == 0
