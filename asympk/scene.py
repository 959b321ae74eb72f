"""``Scene``: the parameters, start and horizon of one trajectory, kept exactly as they were given."""

import math
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from asympk.doors import through
from asympk.errors import InputError, NoManifold
from asympk.numbers import Number, number, short
from asympk.shown import ROWS, Card, ShownAsTable, number_as_text, shortened_rows
from asympk.systems.painleve_klein.modes import coefficients

# number of a rod -> (condition on it, words for the condition), beyond being finite
LIMITS: dict[str, tuple] = {
    "sigma": (lambda v: v > -2, "greater than -2"), "mu": (lambda v: v > 0, "positive"),
    "until": (lambda v: v >= 0, "zero or positive"),
}
# manifold -> (mode that holds it, sign of s z in that mode)
MANIFOLDS = {"Pi1": ("slip_same", 1), "Pi2": ("slip_opposite", -1)}


@dataclass(frozen=True, repr=False)
class Scene(ShownAsTable):
    """One trajectory to follow: parameters, start and horizon.

    Without ``system`` the scene is one of the Painlevé-Klein rod in nondimensional quantities: ``start`` is (x, y, z) =
    (rho, rho', v), and ``sigma0 >= sigma`` is the static friction, by default ``sigma``. With a ``System``, ``values``
    maps its parameters and ``start`` its states, by symbol or by name, to numbers; both are stored as tuples in the
    order of ``system.parameters`` and ``system.states``. At the start a sliding velocity that is a sum of states is 0
    if their rounding to doubles could have made it nonzero, so that a run goes on from ``path.final`` of another.
    A number is an int, float, Fraction, Decimal, str ("0.2" means 1/5), mpf, or a SymPy constant such as sqrt(2). It is
    stored without rounding: an int or a float as it is, all others as a Fraction, of an irrational number right to more
    digits than a run may have. Only ``Scene.near`` sets ``near_to``, and only ``Scene.physical`` sets
    ``rod``, the physical quantities. ``origin`` is set where a start is derived from coordinates and rates of a
    mechanism: (mechanism, values, state, start). Each becomes None if another number replaces its own, as in
    ``dataclasses.replace``. Raises ``InputError``.
    """

    sigma: Any = None
    mu: Any = None
    start: Any = None
    until: Any = None
    sigma0: Any = None
    name: str = ""
    near_to: tuple | None = None
    system: Any = None
    values: Any = None
    rod: Any = None
    origin: Any = field(default=None, compare=False)

    def __post_init__(self) -> None:
        put = object.__setattr__
        if not isinstance(self.name, str):
            raise InputError(f"name = {short(self.name)}: it must be a string")
        _require_made(self)
        if self.system is not None:
            self._place()
            return
        if self.values is not None:
            raise InputError("values are those of a system; give system=, or sigma, mu, start and until of the rod")
        if hasattr(self.sigma, "placed"):
            raise InputError("sigma is a System: name it, Scene(system=system, values=values, start=start, until=2)")
        for name, limit in LIMITS.items():
            put(self, name, number(name, getattr(self, name), *limit))
        static = self.sigma if self.sigma0 is None else self.sigma0
        least = f"at least sigma = {short(self.sigma)}"
        put(self, "sigma0", number("sigma0", static, lambda v: v >= self.sigma, least))
        values = triple(self.start, "(x, y, z)")
        put(self, "start", tuple(number(f"start {axis}", value) for axis, value in zip("xyz", values, strict=True)))
        if self.rod is not None and self.rod.numbers != (self.sigma, self.mu, self.sigma0, *self.start, self.until):
            put(self, "rod", None)
        if self.near_to is not None and not _is_near(self, *self.near_to):
            put(self, "near_to", None)

    def _place(self) -> None:
        put = object.__setattr__
        if not hasattr(self.system, "placed"):
            raise InputError(f"system = {short(self.system)}: it must be a System; build one with ap.System, or take "
                             "the rigid() or elastic() one of a mechanism")
        if not (self.sigma is None and self.mu is None and self.sigma0 is None):
            raise InputError("sigma, mu and sigma0 belong to the rod; give the parameters of a system in values=")
        values, start = self.system.placed({} if self.values is None else self.values, self.start)
        put(self, "values", values)
        put(self, "start", start)
        put(self, "until", number("until", self.until, *LIMITS["until"]))
        if self.origin is not None:
            origin = (*self.origin, start)[:4]
            put(self, "origin", origin if origin[3] == start else None)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the states, in the order of ``start``."""
        return ("x", "y", "z") if self.system is None else tuple(s.name for s in self.system.states)

    @property
    def numbers(self) -> dict[str, Any]:
        """The values of the parameters by name."""
        if self.system is None:
            return {"sigma": self.sigma, "mu": self.mu, "sigma0": self.sigma0}
        return {s.name: value for s, value in zip(self.system.parameters, self.values, strict=True)}

    @property
    def combinations(self) -> tuple[tuple[str, tuple], ...]:
        """Linear combinations of the states shown beside them, as (name, coefficients): for the rod, its load."""
        return (("s", (1, 1, 0)),) if self.system is None else ()

    @property
    def units(self) -> dict[str, str]:
        """The units of time and states by name; empty, since a scene is nondimensional."""
        return {}

    @classmethod
    def physical(
        cls, *, m: Any, P: Any, f: Any, alpha: Any, l: Any, k: Any, h: Any, start: Any, until: Any, f0: Any = None,
        name: str = "", units: Any = ("kg", "N", "m", "s"),
    ) -> "Scene":
        r"""Return the scene of a rod given in physical quantities; ``path.physical()`` converts its path back to them.

        Mass m (kg), force P (N), friction coefficients f and f0 (static, by default f), angle alpha (rad, or
        "60 deg"), length l (m), stiffness k (N) and damping h (s/m); ``start`` is (R_1, R_1', u) in N, N/s and m/s,
        ``until`` in s. In other consistent units, ``units`` names those of mass, force, length and time, for the
        labels. Raises ``InputError``.
        """
        given = {"m": m, "P": P, "f": f, "f0": f if f0 is None else f0, "alpha": alpha, "l": l, "k": k, "h": h}
        return through("Scene.physical", given, start, until, name, units)

    @classmethod
    def near(
        cls, manifold: str, *, x: Any, offset: Any, z: Any, sigma: Any, mu: Any, until: Any, sigma0: Any = None,
        name: str = "",
    ) -> "Scene":
        r"""Return a scene that starts at ``s = s_slow(x) + offset`` near the exact slow line of ``"Pi1"`` or ``"Pi2"``.

        The slow line of a mode ``mu y' = 1 - b s`` is ``y = lambda (x - 1/b)`` with the slow root ``lambda`` of
        ``mu lambda^2 + b lambda + b = 0``; b = sigma + 4 on Pi1, b = -sigma on Pi2. The offset is stored exactly: with
        the offset 0 the motion stays on the line, and even after the offset 1e-300 it leaves the line at the right
        time. ``start`` shows the nearest doubles. Raises ``NoManifold`` if the mode has no slow line, and
        ``InputError`` if the start is not in the mode of the line.
        """
        x, offset, z = number("x", x), number("offset", offset), number("z", z)
        y = _slow_y(manifold, number("sigma", sigma), number("mu", mu), x) + float(offset)
        scene = cls(sigma, mu, (x, y, z), until, sigma0, name, (manifold, offset))
        if scene.near_to is None:
            mode, sign = MANIFOLDS[manifold]
            side = "positive" if (x + y) * sign > 0 else "negative"
            where = f"{manifold} lies in the mode {mode}; with x + y = {x + y:.6g} here"
            raise InputError(f"z = {short(z)}: {where}, z must be {side}")
        return scene

    def _card(self) -> Card:
        kind = "of the Painlevé-Klein rod" if self.system is None else "of a System"
        if self.rod is not None:
            return Card(f"Scene {self.name or kind} in physical quantities", self.rod.rows)
        start = ", ".join(map("{} = {}".format, self.names, map(number_as_text, self.start)))
        rows = [(name, number_as_text(value)) for name, value in self.numbers.items()]
        rows = [*shortened_rows(rows, ROWS - 2), ("start", start), ("until", number_as_text(self.until))]
        return Card(f"Scene {self.name + ' ' if self.name else ''}{kind}", tuple(rows))


def _require_made(scene: Scene) -> None:
    """Raise ``InputError`` for a value that only a function makes, where it is not one of that function."""
    made = {
        "near_to": ("Scene.near", isinstance(scene.near_to, tuple) and len(scene.near_to) == 2),
        "rod": ("Scene.physical", hasattr(scene.rod, "numbers")),
        "origin": ("read_scene", isinstance(scene.origin, tuple) and len(scene.origin) in (3, 4)),
    }
    for name, (maker, fits) in made.items():
        if getattr(scene, name) is not None and not fits:
            raise InputError(f"{name} = {short(getattr(scene, name))}: only ap.{maker} sets it; leave it out")


def _is_near(scene: Scene, manifold: str, offset: Any) -> bool:
    """Tell whether a scene starts at this offset from the slow line, in the mode of the line."""
    x, y, z = scene.start
    with suppress(NoManifold):
        on_line = y == _slow_y(manifold, scene.sigma, scene.mu, x) + float(number("offset", offset))
        return on_line and (x + y) * z * MANIFOLDS[manifold][1] > 0
    return False


def _slow_y(manifold: str, sigma: Any, mu: Any, x: Any) -> float:
    if not isinstance(manifold, str) or manifold not in MANIFOLDS:
        raise InputError(f"manifold = {short(manifold)}: it must be one of {', '.join(MANIFOLDS)}")
    _, b = coefficients(MANIFOLDS[manifold][0], sigma)
    where = f"{manifold} has no slow line at sigma = {short(sigma)}, mu = {short(mu)}"
    if b == 0 or 0 < b <= 4 * mu:
        raise NoManifold(f"{where}: with b = {short(b)} it needs 4 mu < b, or b < 0")
    try:
        slow_root = -2 / (1 + math.sqrt(abs(b - 4 * mu)) / math.sqrt(abs(b)))
        return slow_root * float(x - 1 / Fraction(b))
    except (OverflowError, ZeroDivisionError):
        raise NoManifold(f"{where} in doubles: its load 1/b, b = {short(b)}, is beyond them") from None


def in_doubles(sigma: Number, sigma0: Number, mu: Number) -> tuple[float, float, float]:
    """Return parameters of the rod as doubles; raises ``InputError`` where one rounds to a value out of its range."""
    numbers = float(sigma), float(sigma0), float(mu)
    if numbers[0] == -2 or numbers[2] == 0:
        raise InputError(f"sigma and mu: as doubles they are {numbers[0]} and {numbers[2]}, out of range; ask for more "
                         "digits")
    return numbers


def triple(start: Any, names: str) -> tuple:
    """Return a start of the rod as three values that are not read yet; raises ``InputError``, worded with ``names``."""
    try:
        values = () if isinstance(start, (str, bytes, dict, set, frozenset)) else tuple(start)
    except TypeError:
        values = ()
    if len(values) != 3:
        raise InputError(f"start = {short(start)}: it must be three numbers {names}")
    return values


def require_scene(scene: Any, verb: str) -> None:
    """Raise ``InputError`` unless ``scene`` is a ``Scene``; the message says how to give one to ``verb``."""
    if isinstance(scene, Scene):
        return
    if isinstance(scene, str):
        raise InputError(f"{verb} takes a Scene, not the name {short(scene)}; read it first with ap.read_scene")
    systems = {"System": "system=", "Mechanism": "system=mechanism.rigid()"}
    system = systems.get(type(scene).__name__)
    numbers = f"{system}, values={{...}}, start={{...}}" if system else "sigma=, mu=, start="
    raise InputError(f"{verb} takes a Scene, not {type(scene).__name__}; build one: ap.Scene({numbers}, until=)")
