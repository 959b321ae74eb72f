r"""The one symbolic input of the package: a slow-fast system, smooth or with dry friction.

A smooth mode is

    x' = f(x, y, mu),    mu y' = g(x, y, mu),

with slow states x, fast states y and the small parameter mu. A system with dry friction has a velocity z and a
friction force F that enters the equations linearly,

    x' = f(x, y),    mu y' = g(x, y) + c F,    z' = d(x, y) + F,
    F = -kinetic * |load| * sign(z)   (slip, z != 0),      |F| <= static * |load|   (stick, z = 0),

so it has three smooth modes, told apart by the signs of z and of the load: ``slip_same``, ``slip_opposite``, ``stick``.
"""

from dataclasses import dataclass

import sympy as sp

from asympk.errors import InputError
from asympk.symbolic.reading import expression


@dataclass(frozen=True)
class Mode:
    """One smooth field ``x' = slow[x]``, ``small y' = fast[y]``, valid on ``where`` (a condition on the states)."""

    name: str
    slow: sp.Dict
    fast: sp.Dict
    where: sp.Basic = sp.true


@dataclass(frozen=True)
class Friction:
    """Dry friction on the plane ``velocity = 0``.

    ``velocity' = drive + F``; slip has F = -kinetic |load| sign(velocity), stick has F = -drive with
    |F| <= static |load|.
    """

    velocity: sp.Symbol
    drive: sp.Expr
    load: sp.Expr
    kinetic: sp.Expr
    static: sp.Expr


@dataclass(frozen=True)
class System:
    """A slow-fast system: its smooth modes, its small parameter, its parameters' range, and its friction, if any."""

    modes: tuple[Mode, ...]
    small: sp.Symbol
    assumptions: sp.Basic = sp.true
    friction: Friction | None = None

    @classmethod
    def smooth(cls, slow, fast, small, assumptions=sp.true):
        """Build a one-mode system ``x' = slow[x]``, ``small y' = fast[y]``.

        >>> import sympy as sp
        >>> x, y, mu = sp.symbols("x y mu")
        >>> System.smooth(slow={x: y}, fast={y: (1 - x**2)*y - x}, small=mu).mode("smooth").fast[y]
        -x + y*(1 - x**2)
        """
        return cls((_mode("smooth", slow, fast, small),), small, assumptions)

    @classmethod
    def with_friction(cls, slow, fast, velocity, force, load, kinetic, static, small, assumptions=sp.true):
        """Derive slip_same, slip_opposite and stick from one field that contains the friction force.

        ``velocity`` is ``{z: z'}``; ``fast`` and ``velocity`` may contain ``force`` (linearly). The kinetic
        bound is ``kinetic * |load|``, the static one ``static * |load|``. Raises ``InputError`` when the force
        cannot be eliminated in stick.
        """
        ((z, rate),) = velocity.items()
        drive = sp.expand(rate.subs(force, 0))
        if sp.expand(rate - drive - force) != 0:
            raise InputError(f"velocity: {z}' = {rate} must be a drive plus the friction force {force}")
        forces = {
            "slip_same": (-kinetic * load, sp.And(z * load > 0)),
            "slip_opposite": (kinetic * load, sp.And(z * load < 0)),
            "stick": (-drive, sp.And(sp.Eq(z, 0), sp.Abs(drive) <= static * sp.Abs(load))),
        }
        modes = tuple(
            _mode(
                name,
                {**slow, z: sp.expand(rate.subs(force, value))},
                {y: sp.expand(g.subs(force, value)) for y, g in fast.items()},
                small,
                where,
            )
            for name, (value, where) in forces.items()
        )
        return cls(modes, small, assumptions, Friction(z, drive, load, kinetic, static))

    def mode(self, name):
        """Return the mode called ``name``; raises ``InputError`` when there is none."""
        for mode in self.modes:
            if mode.name == name:
                return mode
        raise InputError(f"mode {name!r} is unknown; this system has {', '.join(m.name for m in self.modes)}")


def _mode(name, slow, fast, small, where=sp.true):
    slow, fast = (sp.Dict({s: expression(f"{s}'", rate) for s, rate in side.items()}) for side in (slow, fast))
    states = [*slow, *fast]
    if not isinstance(small, sp.Symbol):
        raise InputError(f"small = {small!r}: it must be a Symbol, the parameter to expand in; put a number in later")
    if not fast:
        raise InputError(f"mode {name!r}: there is no fast state; give fast={{y: g}} with {small} y' = g")
    for state in states:
        if not isinstance(state, sp.Symbol):
            raise InputError(f"mode {name!r}: the state {state} is not a Symbol")
    if len(set(states)) < len(states) or small in states:
        raise InputError(f"mode {name!r}: a state is given twice, or is the small parameter {small}")
    return Mode(name, slow, fast, where)
