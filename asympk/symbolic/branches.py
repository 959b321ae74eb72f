r"""The branches of the friction law: what every friction of a system does, and the signs that its law takes there.

A branch says of every friction whether it slips, sticks or is open, and which signs its load and velocity have.
``asympk.symbolic.forces`` solves for the forces on a branch, and ``asympk.symbolic.guards`` derives its field and its
guards. A ``Guard`` is positive while the branch holds.
"""

from collections.abc import Collection, Iterable
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import sympy as sp

from asympk.errors import InputError
from asympk.numbers import short
from asympk.symbolic.derivatives import slope_by
from asympk.symbolic.long import LONG, atoms, expanded, expands, heavy, is_longer, replaced, symbols_in
from asympk.symbolic.penetration import without_penetration
from asympk.symbolic.signs import waves_never_negative

if TYPE_CHECKING:
    from asympk.symbolic.system import Friction, System

APART = 0.01  # the least distance of roots that rounding leaves of none that are equal, relative to them


class Phase(NamedTuple):
    """The signs of one friction's load and velocity; velocity 0 is stick, load 0 an open contact.

    With ``either`` both signs may also be the opposite ones: the name of a mode gives only their product. A ``smooth``
    phase has no friction, and its signs say nothing. With ``still`` all that forces move is at rest on sticking
    contacts that have more forces than equations; ``still`` are then the ``standing_rows`` that vanish and determine
    the forces. ``idle`` are the kinds of guards that stay 0 along the motion and are therefore not watched.
    """

    load: int
    velocity: int
    either: bool = False
    still: tuple[int, ...] = ()
    idle: tuple[str, ...] = ()
    smooth: bool = False

    @property
    def is_open(self) -> bool:
        """Whether the contact is open."""
        return self.load == 0

    @property
    def slips(self) -> bool:
        """Whether the contact slips and friction acts on it."""
        return bool(self.velocity) and not self.smooth

    @property
    def mode(self) -> str:
        """Return the name of the mode in which these signs hold."""
        if self.is_open:
            return "open"
        return "closed" if self.smooth else ("slip_opposite", "stick", "slip_same")[1 + self.load * self.velocity]


OPEN, SMOOTH = Phase(0, 0), Phase(1, 1, smooth=True)
Branch = tuple[Phase, ...]


def without_idle(branch: Branch) -> Branch:
    """Return a branch without its record of idle guards: a guard may be idle on one side of a switch only."""
    return tuple(phase._replace(idle=()) for phase in branch)


@lru_cache(maxsize=1024)
def bare(branch: Branch) -> Branch:
    """Return a branch without its records of idle guards and of the rows that determine its forces at rest."""
    return tuple(phase._replace(idle=(), still=()) for phase in branch)


class Guard(NamedTuple):
    """A function that is positive inside a mode; ``kind`` is the event where it vanishes, ``friction`` an index.

    ``upper`` tells the second of the two edges of stick from the first. ``divided`` means that a power of the
    penetration, a positive factor, was cancelled from ``value``. The margin of the contact vanishes with this factor,
    even where ``value`` does not.
    """

    kind: str
    friction: int
    value: sp.Expr
    upper: bool = False
    divided: bool = False

    @property
    def key(self) -> tuple[str, int, bool]:
        """What tells the guard from the others of its mode, the same on all sides."""
        return self.kind, self.friction, self.upper


def mode_name(branch: Branch) -> str:
    """Return the name of the mode: the names for all frictions joined by ``+``, or ``smooth`` without friction."""
    return "+".join(phase.mode for phase in branch) or "smooth"


@lru_cache(maxsize=1024)
def at_rest(branch: Branch) -> frozenset[int]:
    """Return the indices of the frictions that stick."""
    return frozenset(k for k, phase in enumerate(branch) if phase.mode == "stick")


def stands(branch: Branch) -> bool:
    """Tell whether all that forces move is at rest on contacts whose forces are not determined."""
    return any(phase.still for phase in branch)


def still_rows(branch: Branch) -> tuple[int, ...]:
    """Return the ``standing_rows`` that determine the forces of a branch that stands."""
    return next(phase.still for phase in branch if phase.still)


def event_between(before: Branch, after: Branch, kind: str, friction: int, still: Collection[int]) -> tuple[str, int]:
    """Return the kind and the friction of the event between two branches, where a guard of ``friction`` is lost.

    Of velocities that vanish together, the event has the lowest friction number, whichever of them rounding lets vanish
    first; those of ``still`` are 0 on both sides. If a contact has reached the edge of its cone and yet sticks, the
    event is either the ``slip_onset`` of another contact at the same time, or ``force_zero``: the load vanishes at the
    tip of the cone. Where forces at rest are not determined, the edge is of no one contact, and the event has the
    lowest friction number of those that slip, or of those that open.
    """
    if kind == "velocity_zero":
        turned = (k for k, (old, new) in enumerate(zip(before, after, strict=True))
                  if old.velocity and not new.is_open and old.velocity != new.velocity and k not in still)
        return kind, min(turned, default=friction)
    if kind != "slip_onset" or (after[friction].mode != "stick" and not stands(before)):
        return kind, friction
    freed = [k for k in sorted(at_rest(before)) if after[k].slips]
    opened = [k for k in sorted(at_rest(before)) if after[k].is_open]
    return (kind, freed[0]) if freed else ("lift_off", opened[0]) if opened else ("force_zero", friction)


def most_at_rest(branches: Iterable[Branch], among: Iterable[int] | None = None) -> list[Branch]:
    """Leave out every branch whose sticking frictions are a proper subset of another branch's; only ``among`` count."""
    rest = {b: at_rest(b) if among is None else at_rest(b) & {*among} for b in branches}
    return [b for b in rest if not any(rest[b] < other for other in rest.values())]


def one_per_mode(system: "System", k: int, asked: bool = False) -> tuple[Phase, ...]:
    """Return one phase per mode of a contact, ``either`` if signs are ``asked`` and the sign of the load is unknown."""
    if is_smooth(system, k):
        return all_phases(system, k)
    friction, load = system.frictions[k], system.frictions[k].load
    known = -1 if load.is_negative else 1 if load.is_positive or lifts(friction) else 0
    sign = known or 1
    closed = (Phase(sign, velocity, asked and not known) for velocity in (sign, -sign, 0))
    return (*closed, *([OPEN] if friction.gap is not None else []))


def all_phases(system: "System", k: int) -> tuple[Phase, ...]:
    """Return every phase of contact k: all signs of load and velocity, velocity 0, and open if it has a gap."""
    closed = (Phase(load, velocity) for velocity in (1, -1, 0) for load in signs_of_load(system, k))
    return (*([SMOOTH] if is_smooth(system, k) else closed), *([OPEN] if system.frictions[k].gap is not None else []))


def is_joint(friction: "Friction", phase: Phase) -> bool:
    """Tell whether a contact holds both ways without friction, so that its reaction may have either sign."""
    return phase.smooth and friction.gap is None


@lru_cache(maxsize=256)
def is_smooth(system: "System", k: int) -> bool:
    """Tell whether contact k has a reaction and no friction, and no formula asks for the sign of its velocity or load.

    Then it is closed in one phase, ``SMOOTH``, whether it slips or rests.
    """
    friction = system.frictions[k]
    if friction.normal is None or friction.kinetic != 0 or friction.static != 0:
        return False
    asked = {*put_sign(friction.velocity, sp.S.One), *put_sign(friction.load, sp.S.One)}
    return not atoms(sp.Tuple(*system.expressions), sp.Abs, sp.sign) & asked


@lru_cache(maxsize=256)
def is_pushed(system: "System", k: int) -> bool:
    """Tell whether the load of friction k contains forces: it may then have either sign, or none, in several modes."""
    return bool(symbols_in(system.frictions[k].load) & {*system.pushes})


@lru_cache(maxsize=64)
def ambiguous_contacts(system: "System") -> dict[int, set[int]]:
    """Return the contacts that may have two motions, with the frictions whose loads contain the reaction.

    These are rigid contacts that may open or have friction, and frictions whose forces act on their own loads.
    """
    rough = {j for j in range(len(system.frictions)) if not is_smooth(system, j)}
    rubs = {k: {j for j in rough if k in _reactions(system, j)} for k, f in enumerate(system.frictions) if f.rigid}
    forced = {j: {j} for j in rough if _acts_on_itself(system, j) and not any(j in found for found in rubs.values())}
    return {k: found for k, found in rubs.items() if found or system.frictions[k].gap is not None} | forced


def _acts_on_itself(system: "System", k: int) -> bool:
    """Tell whether the load of friction k contains its force, or that of one whose load does, and so on."""
    found, new = set[int](), {k}
    while new:
        forces = set[sp.Symbol]().union(*(symbols_in(system.frictions[j].load) for j in new))
        new = {j for j, f in enumerate(system.frictions) if f.force in forces} - found
        found |= new
    return k in found


def presses_otherwise(system: "System", branch: Branch, other: Branch) -> bool:
    """Tell whether a rough contact that is not at rest in the ``other`` branch has a load of another sign, or none.

    Only loads that contain forces count. The load of one direction of a contact is that of its reaction alone.
    """
    changed = {k for k, (own, now) in enumerate(zip(branch, other, strict=True)) if own.load != now.load}
    moving = {k for k, phase in enumerate(other) if phase.mode != "stick" and not is_smooth(system, k)}
    shared = {k for k in moving if (found := _reactions(system, k)) and found <= changed}
    return any(is_pushed(system, k) for k in (changed & moving) | shared)


@lru_cache(maxsize=256)
def _reactions(system: "System", k: int) -> set[int]:
    """Return the contacts whose reactions the load of friction k contains."""
    return {j for j, f in enumerate(system.frictions) if f.normal in symbols_in(system.frictions[k].load)}


@lru_cache(maxsize=256)
def signs_of_load(system: "System", k: int) -> tuple[int, ...]:
    """Return the signs of the load of contact k while it is closed: 1 alone if it ``lifts`` or is never negative."""
    friction = system.frictions[k]
    return (1,) if lifts(friction) or never_negative(system, friction.load) else (1, -1)


@lru_cache(maxsize=512)  # branches have the same loads
def never_negative(system: "System", expr: sp.Expr) -> bool:
    """Tell whether an expression is negative at no real states: rounding alone would lose an even power, or a wave."""
    real = {s: sp.Dummy(real=True) for s in (*system.states, system.time)}
    found = replaced(with_powers(expr), real)
    return bool(found.is_nonnegative) or waves_never_negative(found)


@lru_cache(maxsize=512)
def with_powers(expr: sp.Expr) -> sp.Expr:
    """Return a polynomial with its multiple factors as powers: written out, they are rounding near their zeros."""
    squares = any(power.exp.is_Integer and power.exp > 1 for power in atoms(expr, sp.Pow))
    if not (expr.is_Add and squares) or is_longer(expr, LONG) or not expr.is_polynomial() or _is_square_free(expr):
        return expr
    factor, found = sp.sqf_list(expr, *sorted(expr.free_symbols, key=str))
    return sp.Mul(factor, *(part**k for part, k in found)) if any(k > 1 for _, k in found) else expr


def _is_square_free(expr):
    """Tell whether a polynomial with irrational numbers has no double roots along a line, or is a number.

    SymPy takes minutes to look for common factors with several such numbers.
    """
    import numpy as np

    names, t = sorted(expr.free_symbols, key=str), sp.Dummy()
    if not names or all(part.free_symbols or part.is_Rational for part in sp.preorder_traversal(expr)):
        return not names
    line = {name: sp.sqrt(k + 2) + t * sp.cbrt(k + 3) for k, name in enumerate(names)}
    roots = np.roots([*map(float, sp.Poly(expr.xreplace(line).evalf(), t).all_coeffs())]).tolist()
    return all(abs(a - b) > APART * abs(a) for a, b in combinations(roots, 2))


@lru_cache(maxsize=256)
def lifts(friction: "Friction") -> bool:
    """Tell whether the contact opens exactly where its load vanishes, so that the load keeps its sign while closed.

    This holds of a load that is a multiple of the reaction of a rigid contact, of the gap or of a power of the
    penetration.
    """
    if friction.gap is None:
        return False
    if friction.rigid:
        return friction.load.subs(friction.normal, 0) == 0
    ratio = without_penetration(friction.load)
    ratio = sp.cancel(friction.load / friction.gap) if ratio == friction.load else ratio
    return not ratio.free_symbols & (friction.load.free_symbols & friction.gap.free_symbols)


def held(system: "System", branch: Branch) -> set[sp.Symbol]:
    """Return the states that are sliding velocities of sticking contacts: their rates are set to 0 exactly."""
    sticking = (f for f, phase in zip(system.frictions, branch, strict=True) if phase.mode == "stick")
    return {f.velocity for f in sticking if f.velocity.is_Symbol}


def of_either_sign(system: "System", branch: Branch) -> tuple[sp.Expr, ...]:
    """Return the quantities of unknown sign that keep it in a mode: velocities in slip, loads in stick."""
    either = ((f, phase) for f, phase in zip(system.frictions, branch, strict=True) if phase.either)
    return tuple(f.velocity if phase.velocity else f.load for f, phase in either)


def with_signs(system: "System", branch: Branch, expr: sp.Expr) -> sp.Expr:
    """Replace the sign and the absolute value of every sliding velocity and load by those that the branch gives.

    Where only the product of both signs is known, sign(load) becomes sign(velocity) or -sign(velocity). The branch says
    nothing of the velocity at an open contact.
    """
    if not atoms(expr, sp.Abs, sp.sign):
        return expr
    known: dict[sp.Basic, sp.Basic] = {}
    for friction, phase in zip(system.frictions, branch, strict=True):
        if phase.smooth:
            continue
        if not phase.either:
            known |= put_sign(friction.velocity, sp.Integer(phase.velocity)) if not phase.is_open else {}
            known |= put_sign(friction.load, sp.Integer(phase.load))
        elif phase.velocity:
            known |= put_sign(friction.load, phase.load * phase.velocity * sp.sign(friction.velocity))
        else:
            known |= put_sign(friction.velocity, sp.S.Zero)
    used = symbols_in(expr)
    known = {key: value for key, value in known.items() if symbols_in(key) <= used}  # each is sought in all parts
    ways = {sp.sign(f.velocity) for f in system.frictions}
    return without_squares(_without_pieces(expr.subs(known), ways), ways)


def _without_pieces(expr: sp.Expr, signs: set[sp.Expr]) -> sp.Expr:
    """Return ((1 + s) a + (1 - s) b)/2 for what chooses by a sign s, and is a where s is 1, and b where s is -1."""
    for s in signs:
        halves = {}
        for law in atoms(expr, sp.Piecewise, sp.Max, sp.Min, sp.Abs):
            deciding = [condition for _, condition in law.args] if law.is_Piecewise else law.args
            if any(part.has(s) for part in deciding):
                forward, backward = law.xreplace({s: sp.S.One}), law.xreplace({s: sp.S.NegativeOne})
                halves[law] = ((1 + s) * forward + (1 - s) * backward) / 2
        expr = expr.xreplace(halves)
    return expr


@lru_cache(maxsize=1024)
def put_sign(quantity: sp.Expr, sign: sp.Expr) -> dict[sp.Basic, sp.Basic]:
    """Return the substitutions of ``sign`` for sign(quantity), and of ``sign * quantity`` for |quantity|.

    None is needed for a quantity such as |x| or 1 + |x|, whose sign SymPy knows: both expressions are then evaluated.
    """
    found = {sp.Abs(quantity): sign * quantity, sp.sign(quantity): sign,
             sp.Abs(-quantity): sign * quantity, sp.sign(-quantity): -sign}
    return {key: value for key, value in found.items() if isinstance(key, sp.Abs | sp.sign) and not quantity.has(key)}


def with_direction(velocity: sp.Expr, expr: sp.Expr, direction: int | sp.Symbol) -> sp.Expr:
    """Return an expression of a contact as where it slips, or at rest is about to slip, in a direction, 1 or -1.

    Another contact may have the same velocity, and rest.
    """
    if not atoms(expr, sp.sign):
        return expr
    signs = put_sign(velocity, sp.sympify(direction, strict=True))
    return expr.subs({key: sign for key, sign in signs.items() if isinstance(key, sp.sign)})


def by_direction(velocity: sp.Expr, expr: sp.Expr, part: str) -> sp.Expr:
    """Return a part of a friction with sign(velocity) for the steps at its zero: signs, ``Heaviside``, ``Piecewise``.

    Whether a step is written with > or >= says nothing of rest. A third value, at the zero alone, does: it is that of
    the part ``static``, and never that of ``kinetic``. Raises ``InputError`` where the place, or the sign of a factor
    of the velocity, decides whether there is a third value.
    """
    sizes = {e: q for e in atoms(expr, sp.sign) if isinstance(q := e.args[0], sp.Abs) or (q.is_Pow and q.exp.is_even)}
    expr = expr.xreplace({e: sp.Abs(sp.sign(size.args[0])) for e, size in sizes.items()})
    sides = {atom: side for atom in atoms(expr, sp.sign, sp.Heaviside, sp.Rel) if (side := _side(atom, velocity))}
    ordered = {atom: sides.pop(atom) for atom in [*sides] if isinstance(atom, sp.Rel)}
    signs = {atom: side * sp.sign(velocity) for atom, side in sides.items()}
    others = (atom for atom in atoms(expr, sp.Rel) if not symbols_in(atom) & symbols_in(velocity))
    places = {atom: atom.func(_sign(atom.lhs - atom.rhs), 0) for atom in others}

    def directed(law: sp.Piecewise) -> sp.Expr:
        named, rest = (law.xreplace({atom: atom.func(side * way, 0) for atom, side in ordered.items()})
                       for way in (sp.sign(velocity), sp.S.Zero))
        if part == "kinetic":
            return named
        ways = [law.xreplace(places | {atom: atom.func(side * way, 0) for atom, side in ordered.items()})
                for way in (sp.S.One, sp.S.NegativeOne)]
        unknown = {s for s in atoms(sp.Tuple(*ways), sp.sign) if not symbols_in(s) & symbols_in(velocity)}
        shared = _shared(sp.Tuple(rest.xreplace(places), *ways), unknown)
        if len(shared) > 1:
            quantities = ", ".join(sorted(short(s.args[0]) for s in unknown))
            raise InputError(f"friction: {part} = {short(law)}: whether it has a value of its own at rest depends on "
                             f"the sign of {quantities}; write sign({velocity}) for the direction")
        return named if shared != {False} else rest if part == "static" else law

    expr = expr.xreplace({law: directed(law) for law in _asking(expr, ordered)})
    return expr.xreplace({atom: (1 + s) / 2 if isinstance(atom, sp.Heaviside) else s for atom, s in signs.items()})


def _asking(expr: sp.Expr, steps: Collection[sp.Basic]) -> list[sp.Piecewise]:
    """Return each ``Piecewise`` that asks for one of ``steps``, in no other such one: both tell the value at rest."""
    found: list[sp.Piecewise] = []
    parts = sp.preorder_traversal(expr)
    for part in parts:
        if isinstance(part, sp.Piecewise) and any(atoms(condition, sp.Rel) & {*steps} for _, condition in part.args):
            found.append(part)
            parts.skip()
    return found


def _shared(values: sp.Tuple, unknown: Collection[sp.Expr]) -> set[bool]:
    """Return whether the first value, at rest, is that of a direction, for all ``unknown`` signs until both answers.

    Where all values are one, that is no answer.
    """
    rest, *ways = values
    if rest in ways:
        return set() if len({*values}) == 1 else {True}
    first = next((e for e in sp.preorder_traversal(values) if e in unknown), None)  # a law asks it before the others
    if first is None:
        return {False}
    found: set[bool] = set()
    for sign in (sp.S.One, sp.S.NegativeOne):
        found |= _shared(values.xreplace({first: sign}), unknown) if len(found) < 2 else set()
    return found


def _side(atom: sp.Basic, velocity: sp.Expr) -> sp.Expr:
    """Return the sign of the factor if an atom steps at the zero of a multiple of a velocity, else 0.

    The factor may be any expression of other quantities, such as a parameter or a place.
    """
    part = atom.lhs - atom.rhs if isinstance(atom, sp.Rel) else atom.args[0]
    ratio = part / velocity if symbols_in(part) & symbols_in(velocity) else sp.S.Zero
    ratio = ratio if ratio.is_number or heavy(ratio) else sp.cancel(ratio)
    if ratio.is_positive or ratio.is_negative or not symbols_in(ratio) & symbols_in(velocity):
        return _sign(ratio)
    return sp.S.Zero


def _sign(expr: sp.Expr) -> sp.Expr:
    return sp.Mul(*(sp.sign(factor) for side in sp.fraction(expr) for factor in sp.Mul.make_args(side)))


def without_squares(expr: sp.Expr, signs: Collection[sp.Expr]) -> sp.Expr:
    """Return ``expr`` with 1 for the square of every one of ``signs``."""
    return expr.replace(lambda e: e.is_Pow and e.exp.is_Integer and e.base in signs, lambda e: e.base ** (e.exp % 2))


def rate_along(system: "System", expr: sp.Expr) -> sp.Expr:
    """Return the rate of an expression in the states along the field, with the forces as symbols.

    A sum that multiplies the rate of a fast state is divided by ``small`` term by term: where it vanishes with
    ``small``, nothing stays divided.
    """
    small, slopes = system.small, {s: slope_by(expr, s) for s in system.rates if s in symbols_in(expr)}
    slopes |= {s: small * sp.Add(*(e / small for e in sum_.args))
               for s, sum_ in slopes.items() if s in system.fast and sum_.is_Add}
    terms = [slope * system.rates[s] for s, slope in slopes.items()]
    return expanded(sp.Add(*terms, slope_by(expr, system.time) if system.time else 0))


def drive(system: "System", friction: "Friction") -> tuple[sp.Expr, sp.Expr]:
    """Return (d, c) in the rate of the sliding velocity, v' = d + c F; a reaction without constraint is the load."""
    rate = rate_along(system, friction.velocity)
    if friction.normal is not None and not friction.rigid:
        rate = replaced(rate, {friction.normal: friction.load})
    rate = sp.expand(rate) if expands(rate) else rate
    return replaced(rate, {friction.force: sp.S.Zero}), slope_by(rate, friction.force)


def check_friction(system: "System", friction: "Friction", number: int) -> None:
    """Raise ``InputError`` where a friction is ill-posed: no state in its velocity, its force in no rate, and so on."""
    which = f"friction {number}" if len(system.frictions) > 1 else "the friction"
    v, states = friction.velocity, system.states
    if not v.free_symbols & {*states}:
        raise InputError(f"{which}: the velocity {short(v)} must depend on the states {', '.join(map(str, states))}")
    if friction.force in (*states, system.small, system.time):
        raise InputError(f"{which}: the force {friction.force} is also a state, the small parameter or the time")
    for name, part in friction.parts.items():
        if name not in ("load", "constraint") and (known := symbols_in(part) & {*system.pushes}):
            raise InputError(f"{which}: {name} = {short(part)} contains the force {min(known, key=str)}; only rates, "
                             "loads and constraints may")
    moved = {s: rate for s, rate in system.rates.items() if friction.force in symbols_in(rate)}
    if not moved:
        raise InputError(f"{which}: the force {friction.force} enters no rate; write it where it acts")
    if found := next((s for s, r in moved.items() if _has_square(system, friction, s, r)), None):
        raise InputError(f"{which}: the force {friction.force} must enter the rates linearly, and not so that of "
                         f"{found}; write it as a sum of multiples of the forces")
    if not _passes_through_0(v, moved):
        raise InputError(f"{which}: the velocity {short(v)} must be linear in what {friction.force} moves, "
                         f"{', '.join(map(str, moved))}, or a polynomial in it without a square factor; give one that "
                         "passes through 0")
    if own_coupling(system, friction).is_negative:
        raise InputError(f"{which}: {pushing_on(friction)}")
    given = (v, friction.load, friction.kinetic, friction.static, friction.gap)
    if any(e is not None and atoms(e, sp.Float) for e in given):
        raise InputError(f"{which} contains a float; symbols are exact, give sp.Rational(1, 5) for 0.2")


def _passes_through_0(velocity: sp.Expr, moved: Collection[sp.Symbol]) -> bool:
    """Tell whether a velocity is known to change its sign at its zeros: as a linear one, or as a simple root."""
    slopes = (slope_by(velocity, s) for s in moved)
    if not any(sp.expand(slope).free_symbols & {*moved} for slope in slopes if slope.has(*moved)):
        return True
    used = [s for s in moved if velocity.has(s)]
    return velocity.is_polynomial(*used) and all(power == 1 for _, power in sp.sqf_list(velocity, *used)[1])


def own_coupling(system: "System", friction: "Friction") -> sp.Expr:
    """Return the slope of the rate of a velocity by its own force; 0 where the load contains forces."""
    if symbols_in(friction.load) & {*system.pushes}:
        return sp.S.Zero
    slopes = (slope_by(friction.velocity, s) * slope_by(rate, friction.force) for s, rate in system.rates.items())
    return sp.Add(*slopes)


def pushing_on(friction: "Friction") -> str:
    """Return the words that refuse a force with a negative ``own_coupling``."""
    return (f"the rate of the velocity {short(friction.velocity)} falls with the force {friction.force}, which "
            f"opposes it: that would push on; write + {friction.force} for - {friction.force}")


def _has_square(system: "System", friction: "Friction", state: sp.Symbol, rate: sp.Expr) -> bool:
    """Tell whether a rate has the square of a force, or in the rate of its velocity a product with another force."""
    others = system.pushes if state in symbols_in(friction.velocity) else (friction.force,)
    slope = slope_by(rate, friction.force)
    return any(slope_by(slope, force) != 0 for force in others)
