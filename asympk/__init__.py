"""asympk: verified asymptotics for mechanical systems with dry friction.

    System -> manifolds, stability, regions, jump map -> callables -> Path -> Row -> table

Each arrow is a module that imports only from its left; nothing is loaded until it is used.

>>> import asympk as ap
>>> path = ap.solve(ap.Scene(sigma=1, mu="1e-6", start=(0, "0.2", -1), until=5))
>>> path.modes
('slip_opposite', 'stick', 'slip_same')

One motion      Scene, read_scene (TOML, or a scene that ships), solve (method=, digits=), Path, Event
Many motions    solve_many (method=) for arrays; asympk.sweep for more than memory holds
Proofs          asympk.certify encloses the exact flow in balls; claims() is the ledger of the paper's claims
The system      systems.painleve_klein.system(), or System.smooth, System.with_friction and System.with_frictions
Mechanisms      Mechanism and Contact: rigid motions, the paradox, the elastic contact as a System, the jump law
Its geometry    slow_manifolds, slow_manifold, eigenvalues, stick_regions, jump_map
Its numbers     lower turns expressions into NumPy, math, mpmath or C

Quantities are nondimensional: time in h l, x = rho the elastic reaction, y its rate, z = v the velocity of the rough
mass. A string such as "0.2" is the decimal it spells. Every error is an AsympkError and says what to do. The command
line has the same parts: asympk --help.
"""

from importlib import import_module

__version__ = "0.1.0"

_HOME = {
    "System": "symbolic.system",
    "Mode": "symbolic.system",
    "Friction": "symbolic.system",
    "slow_manifold": "symbolic.manifold",
    "slow_manifolds": "symbolic.manifold",
    "critical_manifolds": "symbolic.critical",
    "reduced_flow": "symbolic.manifold",
    "integral_curves": "symbolic.manifold",
    "rest_state": "symbolic.manifold",
    "eigenvalues": "symbolic.stability",
    "stick_regions": "symbolic.stick",
    "lower": "symbolic.lowering",
    "Mechanism": "mechanics.mechanism",
    "Contact": "mechanics.mechanism",
    "Scene": "scene",
    "read_scene": "scenes.scenefile",
    "Path": "path",
    "Event": "path",
    "solve": "methods",
    "solve_many": "methods",
    "least_model": "studies.least",
    "atlas": "studies.least",
    "claims": "ledger",
    "jump_map": "asymptotics.jump",
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
    found = globals()[name] = getattr(module, name) if home else module
    return found


def __dir__():
    return sorted({*globals(), *__all__})
