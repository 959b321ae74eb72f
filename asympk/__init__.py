"""asympk: verified asymptotics for mechanical systems with dry friction.

    Mechanism -> System -> manifolds, stability, regions, jump map
                   |
                   +-> Automaton -> flow -> Path -> Row -> table

Imports go one way along the arrows; nothing is loaded until it is used.

>>> import asympk as ap
>>> path = ap.solve(ap.Scene(sigma=1, mu="1e-6", start=(0, "0.2", -1), until=5))
>>> path.modes
('slip_opposite', 'stick', 'slip_same')

Mechanisms      Mechanism and Contact: rigid motions, the paradox, the elastic contact as a System, the jump law
Systems         System.smooth, System.with_friction, System.with_frictions with Friction; the catalogue is systems
One motion      Scene(system=, values=, start=, until=), or of the rod as above; read_scene (TOML, or one that ships)
                solve (method=, digits=) returns a Path with its Events; least_model says which model will do
Many motions    solve_many for arrays; asympk.sweep for more than memory holds
Proofs          asympk.certify encloses the exact flow in balls; claims() is the ledger of the paper's claims
Its geometry    slow_manifolds, slow_manifold, eigenvalues, stick_regions, jump_map
Its numbers     lower turns expressions into NumPy, math, mpmath or C

The rod's quantities are nondimensional: time in h l, x = rho the elastic reaction, y its rate, z = v the velocity of
the rough mass. A string such as "0.2" is the decimal it spells. Every error is an AsympkError and says what to do, or
an OSError of a file. The command line has the same parts: asympk --help. Which module decides or computes what:
docs/architecture.md.
"""

from importlib import import_module

TYPE_CHECKING = False  # stands for typing.TYPE_CHECKING: to import typing would take longer than all the rest here
if TYPE_CHECKING:  # what a type checker and an editor see; at run time a name is loaded when it is asked for
    from typing import Any

    from asympk import errors as errors
    from asympk import systems as systems
    from asympk.asymptotics.jump import jump_map as jump_map
    from asympk.errors import AsympkError as AsympkError
    from asympk.ledger import claims as claims
    from asympk.mechanics.mechanism import Contact as Contact
    from asympk.mechanics.mechanism import Mechanism as Mechanism
    from asympk.methods import solve as solve
    from asympk.methods import solve_many as solve_many
    from asympk.path import Event as Event
    from asympk.path import Path as Path
    from asympk.pictures.phase import phase as phase
    from asympk.scene import Scene as Scene
    from asympk.scenes.scenefile import read_scene as read_scene
    from asympk.studies.least import atlas as atlas
    from asympk.studies.least import least_model as least_model
    from asympk.symbolic.critical import critical_manifolds as critical_manifolds
    from asympk.symbolic.lowering import lower as lower
    from asympk.symbolic.manifold import integral_curves as integral_curves
    from asympk.symbolic.manifold import reduced_flow as reduced_flow
    from asympk.symbolic.manifold import rest_state as rest_state
    from asympk.symbolic.manifold import slow_manifold as slow_manifold
    from asympk.symbolic.manifold import slow_manifolds as slow_manifolds
    from asympk.symbolic.stability import eigenvalues as eigenvalues
    from asympk.symbolic.stick import stick_regions as stick_regions
    from asympk.symbolic.system import Friction as Friction
    from asympk.symbolic.system import Mode as Mode
    from asympk.symbolic.system import System as System

__version__ = "0.1.0"

_NAMES = {  # module of asympk -> its names that are public here
    "errors": ("AsympkError",),
    "symbolic.system": ("System", "Mode", "Friction"),
    "symbolic.manifold": ("slow_manifold", "slow_manifolds", "reduced_flow", "integral_curves", "rest_state"),
    "symbolic.critical": ("critical_manifolds",),
    "symbolic.stability": ("eigenvalues",),
    "symbolic.stick": ("stick_regions",),
    "symbolic.lowering": ("lower",),
    "mechanics.mechanism": ("Mechanism", "Contact"),
    "scene": ("Scene",),
    "scenes.scenefile": ("read_scene",),
    "path": ("Path", "Event"),
    "methods": ("solve", "solve_many"),
    "studies.least": ("least_model", "atlas"),
    "ledger": ("claims",),
    "pictures.phase": ("phase",),
    "asymptotics.jump": ("jump_map",),
}
_HOME = {name: module for module, names in _NAMES.items() for name in names} | {"systems": None, "errors": None}

__all__ = [*_HOME]


def _load(name: str) -> "Any":
    if name not in _HOME:
        raise AttributeError(f"module 'asympk' has no attribute {name!r}")
    home = _HOME[name]
    module = import_module(f"asympk.{home or name}")
    found = globals()[name] = getattr(module, name) if home else module
    return found


if not TYPE_CHECKING:  # so that a name that does not exist is an error to a type checker
    __getattr__ = _load


def __dir__() -> list[str]:
    return sorted([*__all__, "__doc__", "__version__"])
