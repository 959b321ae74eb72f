r"""The one symbolic input of the package: a system, smooth or with dry friction, slow-fast or not.

A smooth mode is

    x' = f(x, y, t, mu),    mu y' = g(x, y, t, mu),

with slow states x, fast states y and the small parameter mu; a system without fast states needs none. Every dry
friction has a sliding velocity v, an expression in the states, and a force F that may enter every rate linearly:

    F = -kinetic |load| sign(v)   (slip, v != 0),      v' = 0 with |F| <= static |load|   (stick, v = 0).

The signs of v and of the load, and of the gap where a contact can open, divide the system into smooth modes.
``System.modes`` gives their fields, which ``asympk.symbolic.guards`` derives.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, wraps
from typing import Any, TypeVar, cast

import sympy as sp
from sympy.logic.boolalg import BooleanAtom, BooleanFunction

from asympk.errors import InputError
from asympk.formulas import NOT_FINITE, WITH_OWN_SYMBOLS
from asympk.numbers import short
from asympk.shown import Card, ShownAsFormulas
from asympk.symbolic import branches, guards
from asympk.symbolic.forces import force_equations
from asympk.symbolic.inverses import with_factors
from asympk.symbolic.long import ROUGH, atoms, generic_place, symbols_in, valued
from asympk.symbolic.penetration import with_penetration
from asympk.symbolic.placing import named_parts, place, require_worked_out
from asympk.symbolic.reading import entries_of, expression, real_expression, require_names


@dataclass(frozen=True, repr=False)
class Mode(ShownAsFormulas):
    """One smooth field ``x' = slow[x]``, ``small y' = fast[y]``, valid on ``where`` (a condition on the states).

    ``signed`` are expressions that keep their sign in the mode, whichever it is, although the name of the mode does not
    give that sign: velocities, and loads of contacts that stick.
    """

    name: str
    slow: sp.Dict
    fast: sp.Dict
    where: sp.Basic = sp.true
    signed: tuple[sp.Expr, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise InputError(f"mode: name = {short(self.name)}: it must be a text")
        for name in ("slow", "fast"):
            if not isinstance(rates := getattr(self, name), sp.Dict):
                object.__setattr__(self, name, sp.Dict(_by_state(f"mode: {name}", rates)))

    def _card(self) -> Card:
        rates = [(f"{s}'", rate) for s, rate in self.slow.items()]
        rates += [(f"small {s}'", rate) for s, rate in self.fast.items()]
        return Card(f"Mode {self.name}", (*rates, ("where", self.where)))


@dataclass(frozen=True, repr=False)
class Friction(ShownAsFormulas):
    r"""Dry friction: ``-kinetic |load| sign(velocity)`` in slip, at most ``static |load|`` in stick.

    Rates contain its ``force`` as one that would raise the velocity if it were positive: v' = F - x for a mass on a
    spring. ``velocity`` is an expression in the states and may contain the time, as on a moving belt; in the states
    that the force moves it is linear, or a polynomial without a square factor, as the distance from a circle.
    ``load``, ``kinetic`` and ``static`` (by default ``kinetic``) are expressions in states, parameters and time. There
    sign(velocity) at rest is 0, but in ``static |load|`` it is the direction of the slip that the force resists; so is
    the branch of a ``Piecewise`` with one for each direction, while a value at the zero of the velocity alone is
    static. A motion is refused where ``kinetic`` falls below 0 on its way, by more than a millionth of 1 or its first
    value. The load may also be linear in forces and normals of frictions: two directions of one contact share its
    reaction. A contact with a ``gap`` is open, without load, while ``gap > 0``; a fractional power of -gap in the load
    is read as a power of the penetration ``Max(0, -gap)``, as in Hertz's contact. ``normal`` is the symbol, if any,
    under which the load enters the rates: ``load`` while the contact is closed and 0 while the contact is open. A
    ``constraint`` makes the contact rigid: an expression, linear in ``normal`` and the forces, that vanishes while the
    contact is closed and so determines the reaction ``normal``, to which ``load`` is linear. With a gap g the
    constraint is g'', and ``normal``, which only pushes, enters it with a positive coefficient. Of a rigid contact that
    holds both ways, without a gap, ``gap_rate`` is g', the integral of the constraint, which a run then keeps at 0 to
    the last digit.
    """

    velocity: sp.Expr
    force: sp.Symbol
    load: sp.Expr
    kinetic: sp.Expr
    static: Any = None
    gap: Any = None
    normal: Any = None
    constraint: Any = None
    gap_rate: Any = None

    @property
    def parts(self) -> dict[str, sp.Expr]:
        """The expressions that make up the friction, by name; those that are None are left out."""
        names = ("velocity", "load", "kinetic", "static", "gap", "constraint", "gap_rate")
        return {name: part for name in names if (part := getattr(self, name)) is not None}

    @property
    def rigid(self) -> bool:
        """Whether a constraint determines the reaction of the contact while it is closed."""
        return self.constraint is not None

    @property
    def permanent(self) -> bool:
        """Whether the contact neither opens nor has a reaction that a constraint determines."""
        return self.gap is None and not self.rigid

    @property
    def unilateral(self) -> bool:
        """Whether the contact is rigid and may open."""
        return self.rigid and self.gap is not None

    def mapped(self, change: Callable[[sp.Expr], sp.Expr]) -> "Friction":
        """Return the friction with every part of it as ``change`` returns it."""
        return replace(self, **{name: change(part) for name, part in self.parts.items()})

    def with_factors(self, pushes: set[sp.Symbol]) -> "Friction":
        """Return the friction with ``pushes``, forces and normals of the system, as factors in load and constraint."""
        parts = {name: self.parts[name] for name in ("load", "constraint") if name in self.parts}
        found = {name: with_factors(part, pushes) for name, part in parts.items()}
        return self if found == parts else replace(self, **found)

    def _card(self) -> Card:
        return Card("Friction", (("force", self.force), *self.parts.items()))

    def __post_init__(self) -> None:
        static = self.kinetic if self.static is None else self.static
        for name in ("velocity", "load", "kinetic", "gap", "constraint", "gap_rate"):
            if getattr(self, name) is None and name in ("velocity", "load", "kinetic"):
                raise InputError(f"friction: {name} = None: a friction needs one, an expression or a number")
            _put(self, name, getattr(self, name))
        _put(self, "static", static)
        for name in ("load", "kinetic", "static"):
            _put(self, name, branches.by_direction(self.velocity, getattr(self, name), name))
        if isinstance(self.gap, sp.Expr) and self.gap.free_symbols and not self.rigid:
            for name in ("load", "kinetic", "static"):
                _put(self, name, with_penetration(getattr(self, name), self.gap))
        for name in ("force", "normal"):
            symbol = getattr(self, name)
            if not (isinstance(symbol, sp.Symbol) or (symbol is None and name == "normal")):
                raise InputError(f"friction: {name} = {short(symbol)} must be a Symbol, as it stands in the rates")
        if self.rigid and self.normal is None:
            raise InputError("friction: a constraint needs normal=, the symbol of the reaction that it determines")
        if not self.rigid and self.normal in self.load.free_symbols:
            raise InputError(f"friction: normal = {self.normal} stands for the load, which contains it; give the "
                             "constraint of a rigid contact, or a load of states")
        if self.gap_rate is not None and (not self.rigid or self.gap is not None):
            raise InputError("friction: gap_rate= is for a constraint without gap=; from a gap the rate follows")


@dataclass(frozen=True, repr=False)
class System(ShownAsFormulas):
    """A system of rates with its frictions: in ``slow`` and ``fast`` the forces stand as the symbols of ``frictions``.

    ``small`` multiplies the rates of the fast states and is None where there are no fast states; ``time`` is the symbol
    of an explicit time, or None. ``assumptions`` are relations that restrict the parameters, joined by And, Or or Not.
    ``dependent`` gives the states that at a start follow from others, and then do on the whole motion, by their values.
    Any mappings and sequences are taken; raises ``InputError`` for others, and for states that are not those of the
    rates.
    """

    slow: sp.Dict
    fast: sp.Dict
    states: tuple[sp.Symbol, ...]
    small: sp.Symbol | None
    frictions: tuple[Friction, ...] = ()
    time: sp.Symbol | None = None
    assumptions: sp.Basic = sp.true
    dependent: sp.Dict = field(default_factory=sp.Dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "frictions", _frictions(self.frictions))
        pushes = {*self.pushes}
        read = {name: sp.Dict(_by_state(name, getattr(self, name))) for name in ("slow", "fast")}
        read = {name: with_factors(rates, pushes) for name, rates in read.items()}  # forces are solved for as factors
        read["states"] = _states(self.states, (*read["slow"], *read["fast"]))
        read["frictions"] = tuple(friction.with_factors(pushes) for friction in self.frictions)
        read["assumptions"] = expression("assumptions", self.assumptions)
        read["dependent"] = sp.Dict(_by_state("dependent", self.dependent, "value"))
        for name, value in read.items():
            object.__setattr__(self, name, value)
        _check(self)

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.slow, self.fast, self.states, self.small, self.frictions, self.time, self.assumptions))

    def __getstate__(self) -> dict:
        return {name: value for name, value in vars(self).items() if name != "_hash"}  # another one in another process

    def _card(self) -> Card:
        kind = f"{len(self.frictions)} friction{'s' * (len(self.frictions) > 1)}" if self.frictions else "smooth"
        rows: list[tuple[str, Any]] = [(f"{s}'", rate) for s, rate in self.slow.items()]
        rows += [(f"{self.small} {s}'", rate) for s, rate in self.fast.items()]
        rows += [(f"|{f.force}| <=", f.static * sp.Abs(f.load)) for f in self.frictions]
        parameters = ", ".join(s.name for s in self.parameters)
        count = f"{len(self.states)} state{'s' * (len(self.states) > 1)}"
        return Card(f"System of {count}, {kind}; parameters: {parameters or 'none'}", tuple(rows))

    @classmethod
    def smooth(
        cls, slow: Mapping[sp.Symbol, Any], fast: Mapping[sp.Symbol, Any], small: sp.Symbol | None,
        assumptions: sp.Basic = sp.true, time: sp.Symbol | None = None,
    ) -> "System":
        """Build a one-mode system ``x' = slow[x]``, ``small y' = fast[y]``.

        >>> import sympy as sp
        >>> x, y, mu = sp.symbols("x y mu")
        >>> System.smooth(slow={x: y}, fast={y: (1 - x**2)*y - x}, small=mu).mode("smooth").fast[y]
        -x + y*(1 - x**2)
        """
        slow, fast = _by_state("slow", slow), _by_state("fast", fast)
        if not fast and small is not None:
            raise InputError(f"there is no fast state; give fast={{y: g}} with {small} y' = g, or small=None")
        return cls(slow, fast, (*slow, *fast), small, (), time, assumptions)

    @classmethod
    def with_friction(
        cls, slow: Mapping[sp.Symbol, Any], fast: Mapping[sp.Symbol, Any], velocity: Mapping[sp.Symbol, Any],
        force: sp.Symbol, load: Any, kinetic: Any, static: Any = None, small: sp.Symbol | None = None,
        assumptions: sp.Basic = sp.true, time: sp.Symbol | None = None, gap: Any = None,
        normal: sp.Symbol | None = None,
    ) -> "System":
        """Build a system with one friction whose sliding velocity is the state of ``velocity = {z: z'}``.

        The rates may contain ``force`` linearly, with any coefficient. The order of the states is slow, fast, z.
        Raises ``InputError`` where the force enters no rate, or a rate nonlinearly.
        """
        velocity = _by_state("velocity", velocity)
        if len(velocity) != 1:
            raise InputError(f"velocity = {velocity}: it must be {{z: z'}}, the sliding velocity and its rate")
        ((z, rate),) = velocity.items()
        slow, fast = _by_state("slow", slow), _by_state("fast", fast)
        if z in slow or z in fast:
            raise InputError(f"the velocity {z} has a rate of its own; leave it out of slow and fast")
        friction = Friction(z, force, load, kinetic, static, gap, normal)
        _require_friction((friction,))
        return cls({**slow, z: rate}, fast, (*slow, *fast, z), small, (friction,), time, assumptions)

    @classmethod
    def with_frictions(
        cls, slow: Mapping[sp.Symbol, Any], fast: Mapping[sp.Symbol, Any], frictions: Iterable[Friction],
        small: sp.Symbol | None = None, time: sp.Symbol | None = None, assumptions: sp.Basic = sp.true,
    ) -> "System":
        """Build a system with any number of frictions; ``slow`` and ``fast`` hold all states, sliding velocities too.

        A block on a spring, with Coulomb friction:

        >>> x, v, F = sp.symbols("x v F", real=True)
        >>> block = System.with_frictions({x: v, v: -x + F}, {}, [Friction(velocity=v, force=F, load=1, kinetic=1)])
        >>> [mode.name for mode in block.modes]
        ['slip_same', 'slip_opposite', 'stick']
        """
        slow, fast, given = _by_state("slow", slow), _by_state("fast", fast), _frictions(frictions)
        _require_friction(given)
        found = cls(slow, fast, (*slow, *fast), small, given, time, assumptions)
        for friction in given:
            _check_constraint(found, friction)
        return found

    @property
    def friction(self) -> Friction | None:
        """The friction of a system that has exactly one, else None."""
        return self.frictions[0] if len(self.frictions) == 1 else None

    @cached_property
    def pushes(self) -> tuple[sp.Symbol, ...]:
        """The symbols of the forces of the frictions, each before that of the normal of its contact, if it has one."""
        return tuple(s for f in self.frictions for s in (f.force, f.normal) if s is not None)

    @cached_property
    def parameters(self) -> tuple[sp.Symbol, ...]:
        """The parameters in the order of their names, including ``small``."""
        used = sp.Tuple(*self.expressions, *self.dependent.values())
        free = symbols_in(used) | ({self.small} - {None}) | self.assumptions.free_symbols
        known = {*self.states, self.time, *self.pushes}
        return tuple(sorted(free - known, key=lambda s: (s.name, str(s.assumptions0))))

    @cached_property
    def rates(self) -> dict[sp.Symbol, sp.Expr]:
        """The rate of every state, with forces as symbols; the rates of fast states are divided by ``small``."""
        return self.divided(self.slow, self.fast)

    def divided(self, slow: Mapping, fast: Mapping) -> dict[sp.Symbol, sp.Expr]:
        """Return the rate of every state from a slow field and a fast one, which is divided by ``small``."""
        return {s: slow[s] if s in slow else fast[s] / self.small for s in self.states}

    @cached_property
    def expressions(self) -> tuple[sp.Expr, ...]:
        """The rates and the parts of the frictions."""
        return (*self.rates.values(), *(part for f in self.frictions for part in f.parts.values()))

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The smooth modes; with several frictions all combinations of modes of each, with names joined by ``+``."""
        return tuple(map(self._mode, guards.named_branches(self)))

    def _mode(self, branch: branches.Branch) -> Mode:
        slow, fast = map(sp.Dict, guards.fields(self, branch))
        name, signed = branches.mode_name(branch), branches.of_either_sign(self, branch)
        return Mode(name, slow, fast, guards.where(self, branch), signed)

    def mode(self, name: str | None) -> Mode:
        """Return the mode called ``name``, or the only mode for None; raises ``InputError`` if there is none."""
        known = ", ".join(m.name for m in self.modes)
        if name is None and len(self.modes) > 1:
            raise InputError(f"this system has several modes; give mode= one of {known}")
        for mode in self.modes:
            if name is None or (isinstance(name, str) and mode.name == name):
                return mode
        raise InputError(f"mode {short(name)} is unknown; this system has {known}")

    def autonomous(self, mode: Mode) -> Mode:
        """Return ``mode`` with the explicit time, if there is one, as a slow state t, t' = 1."""
        return mode if self.time is None else replace(mode, slow=sp.Dict({**mode.slow, self.time: 1}))

    @cached_property
    def drive(self) -> sp.Expr:
        """The rate of the sliding velocity without friction: v' = drive + coupling F. One friction only."""
        return self._sliding[0]

    @cached_property
    def coupling(self) -> sp.Expr:
        """The coefficient of the friction force in the rate of the sliding velocity. One friction only."""
        return self._sliding[1]

    @cached_property
    def _sliding(self) -> tuple[sp.Expr, sp.Expr]:
        if self.friction is None:
            raise InputError(f"this system has {len(self.frictions)} frictions; drive and coupling need exactly one")
        return branches.drive(self, self.friction)

    def placed(self, values: Mapping[Any, Any], start: Any) -> tuple[tuple, tuple]:
        """Return ``values`` and ``start`` as exact numbers in the order of ``parameters`` and ``states``.

        Raises ``InputError`` that names the value which is missing, unknown, no number, or against the assumptions.
        """
        return place(self, values, start)


FUNCTION = TypeVar("FUNCTION", bound=Callable[..., Any])


def of_system(function: FUNCTION) -> FUNCTION:
    """Make a function raise ``InputError`` unless its first argument is a ``System``, before a cache hashes that."""

    @wraps(function)
    def checked(system: Any, *arguments: Any, **options: Any) -> Any:
        require_system(system, function.__name__)
        return function(system, *arguments, **options)

    return cast(FUNCTION, checked)


def require_system(system: Any, verb: str) -> None:
    """Raise ``InputError``, with words on how to give ``verb`` a system, unless ``system`` is a ``System``."""
    if not isinstance(system, System):
        raise InputError(f"{verb} takes a System, not {type(system).__name__}; build one with ap.System, or take the "
                         "rigid() or elastic() one of a mechanism")


def _put(record: Any, name: str, value: Any) -> None:
    if value is not None:
        value = real_expression(f"friction: {name}", value)
    object.__setattr__(record, name, value)


def _by_state(what: str, given: Any, value: str = "rate") -> dict[sp.Symbol, sp.Expr]:
    if not isinstance(given, Mapping | sp.Dict):
        raise InputError(f"{what} = {short(given)}: it must be a mapping from each state to its {value}, "
                         f"{{x: {value} of x}}")
    found = {}
    for state, expr in given.items():
        if not isinstance(state, sp.Symbol):
            raise InputError(f"{what}: the state {short(state)} is not a Symbol")
        found[state] = expression(f"{what}: the {value} of {state}", expr)
    return found


def _states(given: Any, rates: tuple[sp.Symbol, ...]) -> tuple[sp.Symbol, ...]:
    wanted = f"the states that have rates, {', '.join(map(str, rates))}, in any order"
    states = entries_of("states", given, wanted)
    if not all(isinstance(s, sp.Symbol) for s in states) or {*states} != {*rates}:
        raise InputError(f"states = {short(states)}: give {wanted}")
    return states


def _frictions(given: Any) -> tuple[Friction, ...]:
    wanted = "a sequence of ap.Friction(velocity=, force=, load=, kinetic=)"
    found = entries_of("frictions", given, wanted)
    if wrong := [f for f in found if not isinstance(f, Friction)]:
        raise InputError(f"frictions: {short(wrong[0])} is no Friction; give {wanted}")
    return found


def _require_friction(frictions: tuple[Friction, ...]) -> None:
    """Raise ``InputError`` for a load that is written as 0, and for a part without a finite real value.

    On a side of a switch a load may become 0, and a part may have no value; nor need kinetic friction with a value for
    each direction have one at rest.
    """
    for friction in frictions:
        for name, part in friction.parts.items():
            if name == "static" and atoms(friction.kinetic, sp.Piecewise):
                continue
            if atoms(part, sp.Basic) & {*NOT_FINITE, sp.I}:
                example = f", such as 1/(1 + abs({friction.velocity}))" if name in ("load", "kinetic", "static") else ""
                raise InputError(f"friction: {name} = {short(part)}: it must be finite and real{example}")
    if any(friction.load == 0 for friction in frictions):
        raise InputError("friction: the load is 0; without a load there is no friction")


def _check(system: System) -> None:
    states, small = system.states, system.small
    if not states:
        raise InputError("a system needs states; give slow={x: x'}")
    if small is None and system.fast:
        fast = ", ".join(map(str, system.fast))
        raise InputError(f"small is missing: fast states ({fast}) need a small parameter; give its symbol or name")
    if not isinstance(small, sp.Symbol | None):
        raise InputError(f"small = {short(small)}: it must be a Symbol; the number is put in later")
    if not isinstance(system.time, sp.Symbol | None):
        raise InputError(f"time = {short(system.time)}: it must be a Symbol, or None where nothing depends on the time")
    _require_relations(system.assumptions)
    for names in ([s.name for s in order] for order in (states, (*system.slow, *system.fast))):
        if twice := sorted({n for n in names if names.count(n) > 1}):
            raise InputError(f"the state {twice[0]} is given twice")
    if small in states:
        raise InputError(f"{small} is the small parameter and a state; give one of them another name")
    if stray := sorted(map(str, system.assumptions.free_symbols - {*system.parameters})):
        raise InputError(f"assumptions: {stray[0]} is no parameter; assumptions are not enforced along a motion")
    for name, expr in named_parts(system).items():
        require_worked_out(name, expr, WITH_OWN_SYMBOLS)  # their symbols are no parameters
    require_names((*states, *system.parameters))
    _require_one_symbol_each(system)
    for s, rate in system.rates.items():
        parts = atoms(rate, sp.Basic)
        if any(isinstance(part, sp.Float) for part in parts):
            raise InputError(f"the rate of {s} contains a float; symbols are exact, give sp.Rational(1, 5) for 0.2")
        if not isinstance(rate, sp.Expr) or parts & {*NOT_FINITE, sp.I}:
            raise InputError(f"the rate of {s} is {rate}; it must be a finite real expression")
    for number, friction in enumerate(system.frictions, 1):
        branches.check_friction(system, friction, number)
    bounds = sp.Tuple(*(part for f in system.frictions for part in (f.load, f.constraint) if part is not None))
    if symbols_in(bounds) & {*system.pushes}:
        slipping = tuple(branches.one_per_mode(system, k)[0] for k in range(len(system.frictions)))
        force_equations(system, slipping)  # refuses what is not linear


def _check_constraint(system: System, friction: Friction) -> None:
    """Raise ``InputError`` where a constraint is clearly no multiple of the g'' of its gap, by values at a place.

    The ratio of a multiple to g'' does not change with the forces.
    """
    if not friction.rigid or (friction.gap is None and friction.gap_rate is None):
        return
    name, given = ("gap_rate", friction.gap_rate) if friction.gap is None else ("gap", friction.gap)
    rate = given if friction.gap is None else branches.rate_along(system, given)
    both = sp.Tuple(friction.constraint, branches.rate_along(system, rate))
    place = generic_place(both)
    forces = [s for s in system.pushes if s in place]
    pushed = place | {s: factor * place[s] for factor, s in enumerate(forces, 3)}
    values = [valued(e, at, 30) for at in (place, pushed) for e in both]
    if not all(v.is_number and v.is_finite and v.is_real for v in values):
        return
    first, second = values[0] * values[3], values[2] * values[1]
    if abs(first - second) > ROUGH * (abs(first) + abs(second)):
        words = f"the {'second ' * (name == 'gap')}rate of {name} = {short(given)}"
        raise InputError(f"friction: {words} is {short(both[1])}, and the constraint {short(both[0])}; the constraint "
                         "must be this rate")


def _require_relations(assumed: sp.Basic) -> None:
    """Raise ``InputError`` for assumptions that no numbers are found to violate, such as ``Q.positive(a)``."""
    if isinstance(assumed, BooleanFunction):
        for part in assumed.args:
            _require_relations(part)
    elif not isinstance(assumed, sp.core.relational.Relational | BooleanAtom):
        raise InputError(f"assumptions: {short(assumed)} is no relation; give relations between parameters, such as "
                         "kappa > 0, joined by sp.And, sp.Or and sp.Not")


def _require_one_symbol_each(system: System) -> None:
    """Raise ``InputError`` for a force of two frictions, or for a parameter named as a state, a force or the time."""
    names = {s.name for s in (*system.states, system.time, *system.pushes) if s is not None}
    forces = [s.name for s in system.pushes]
    if shared := next((name for name in forces if forces.count(name) > 1), None):
        raise InputError(f"{shared} is the force or reaction of two frictions; give each a Symbol of its own")
    for parameter in system.parameters:
        if parameter.name in names:
            raise InputError(
                f"{parameter} is written with two Symbols of that name, which differ in their assumptions; make one, "
                "such as sp.Symbol(..., real=True), and use it throughout"
            )
