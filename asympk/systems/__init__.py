"""Mechanical systems that asympk derives from first principles, one module each."""

from importlib import import_module
from types import ModuleType

MECHANISMS = (
    "painleve_klein", "unequal_masses", "held_rod", "butenin", "painleve_rod", "bead_rod", "brake_shoe", "crank_slider",
    "arm",
)
__all__ = ["nonlinear_rod", *MECHANISMS]


def __getattr__(name: str) -> ModuleType:
    if name not in __all__:
        raise AttributeError(f"module 'asympk.systems' has no attribute {name!r}")
    return import_module(f"asympk.systems.{name}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__doc__"])
