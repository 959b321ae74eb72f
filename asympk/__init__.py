"""asympk: verified asymptotics for mechanical systems with dry friction.

    System -> manifolds, stability, regions, jump map -> callables -> Path -> Row -> table

Each arrow is a module that imports only from its left; nothing is loaded until it is used.
"""

from importlib import import_module

__version__ = "0.1.0"

_HOME = {
    "System": "system",
    "Mode": "system",
    "slow_manifold": "manifold",
    "slow_manifolds": "manifold",
    "critical_manifolds": "critical",
    "reduced_flow": "manifold",
    "integral_curves": "manifold",
    "rest_state": "manifold",
    "eigenvalues": "stability",
    "stick_regions": "stick",
    "lower": "lowering",
    "Scene": "scene",
    "read_scene": "scenefile",
    "Path": "path",
    "Event": "path",
    "solve": "methods",
    "solve_many": "ensemble",
    "least_model": "least",
    "atlas": "least",
    "claims": "ledger",
    "jump_map": "jump",
    "systems": None,
    "errors": None,
}

__all__ = ["AsympkError", *_HOME]


def __getattr__(name):
    if name == "AsympkError":
        from asympk.errors import AsympkError

        return AsympkError
    if name not in _HOME:
        raise AttributeError(f"module 'asympk' has no attribute {name!r}")
    home = _HOME[name]
    module = import_module(f"asympk.{home or name}")
    return getattr(module, name) if home else module


def __dir__():
    return sorted({*globals(), *__all__})
