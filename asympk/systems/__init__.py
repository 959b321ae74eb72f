"""Mechanical systems that asympk derives from first principles, one module each."""

from importlib import import_module

__all__ = ["nonlinear_rod", "painleve_klein"]


def __getattr__(name):
    if name not in __all__:
        raise AttributeError(f"module 'asympk.systems' has no attribute {name!r}")
    return import_module(f"asympk.systems.{name}")
