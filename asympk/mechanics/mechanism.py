r"""``Mechanism`` and ``Contact``: the description of a mechanism with one frictional contact or constraint.

    M(q) q'' = Q(q, q', t) + W_N R + W_T F

The methods of ``Mechanism`` call the other modules of ``asympk.mechanics``, which compute with ``Mechanism.plain``, the
same mechanism in plain symbols. Results are in the coordinates and velocities with which the ``Mechanism`` was made:
plain symbols, or dynamicsymbols and their Derivatives.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import sympy as sp

from asympk.automaton.automaton import Automaton
from asympk.errors import InputError, NotDerivable, OutOfRange
from asympk.formulas import NOT_FINITE
from asympk.mechanics import elastic, jump_law, paradox, rigid, rigid_system
from asympk.mechanics.checks import check_bounds, check_mechanism, is_met, require_closed, require_positive_mass
from asympk.mechanics.evaluation import evaluate_ahead, exactly_at
from asympk.mechanics.jump_law import JumpLaw
from asympk.mechanics.kinetics import Kinetics
from asympk.mechanics.lagrangian import equations_of
from asympk.mechanics.names import keyed, plain_name, plainly
from asympk.mechanics.paradox import LeastFriction
from asympk.mechanics.paradoxset import ParadoxSet, paradox_set
from asympk.mechanics.rigid import Motion, MotionMap
from asympk.numbers import flag, raw_entries, short
from asympk.shown import Card, ShownAsFormulas
from asympk.symbolic.long import atoms, replaced, symbols_in
from asympk.symbolic.reading import entries_of, exact_constant, expression
from asympk.symbolic.system import System, require_system

CONTACTS = "a sequence of ap.Contact"


@dataclass(frozen=True, repr=False)
class Contact(ShownAsFormulas):
    r"""One contact with dry friction: its gap, its direction of sliding and its coefficients of friction.

    ``gap`` g(q, t) is a position expression, positive where the contact is open. ``slip`` is a position expression
    whose rate is the sliding velocity gamma, or gamma itself. The reaction R acts along the gradient of g by q, and
    friction along that of gamma by the rates: g is a distance, at least near the contact, and gamma is the velocity of
    the point that touches, also beside the contact. Friction obeys |F| = friction load |R| in slip and
    |F| <= static load |R| in stick. ``static`` is ``friction`` by default. ``load`` is the factor by which |R| is
    multiplied to give the load of friction. A ``unilateral`` contact only pushes, R >= 0; any other is bilateral.
    With ``friction`` 0 a contact neither slips nor sticks in name: its mode is ``closed``.
    """

    gap: Any
    slip: Any
    friction: Any
    static: Any = None
    load: Any = 1
    unilateral: bool = False

    def __post_init__(self) -> None:
        static = self.friction if self.static is None else self.static
        for name, value in (("gap", self.gap), ("slip", self.slip), ("friction", self.friction), ("static", static),
                            ("load", self.load)):
            object.__setattr__(self, name, _finite(f"contact: {name}", value))
        object.__setattr__(self, "unilateral", flag("contact: unilateral", self.unilateral))
        check_bounds(self)

    @property
    def side(self) -> str:
        """The words for what a unilateral or a bilateral contact does."""
        return "only pushes" if self.unilateral else "holds both ways"

    def _card(self) -> Card:
        names = ("gap", "slip", "friction", "static", "load")
        return Card(f"Contact that {self.side}", tuple((name, getattr(self, name)) for name in names))


@dataclass(frozen=True, repr=False)
class Mechanism(ShownAsFormulas):
    """A mechanism with the mass matrix ``mass``, the applied forces ``forces``, one ``contact`` and perhaps ``others``.

    Critical friction, paradox, the map of motions and the jump law are those of ``contact``, while ``others`` that only
    push are open, and those that hold both ways hold. If one of the latter is rough, the map of motions and the jump
    law raise ``NotDerivable``. The ``motions`` at numbers have all closed contacts.
    The systems ``rigid()`` and ``elastic()`` have all contacts, with the forces N and F, N2 and F2, ... in order.
    ``velocities`` are the rates of ``coordinates``, one for each. ``forces`` is the whole right side Q of M q'' = Q,
    including centrifugal and gyroscopic terms, but not R and F. ``time`` is the symbol of time in forces and contact;
    by default it is the argument of the dynamicsymbols, or t. Raises ``InputError`` for a mass matrix that is singular
    or not symmetric, a gap that does not depend on the coordinates, and a slip that is parallel to the gap.

    >>> import sympy as sp
    >>> X, Y, U, V, m, P, f = sp.symbols("X Y U V m P f")
    >>> block = Mechanism((X, Y), (U, V), sp.diag(m, m), (P, -m), Contact(Y, X, f, unilateral=True))
    >>> block.delassus
    Matrix([
    [1/m,   0],
    [  0, 1/m]])
    """

    coordinates: tuple
    velocities: tuple
    mass: sp.ImmutableMatrix = field(repr=False)
    forces: tuple = field(repr=False)
    contact: Contact
    time: Any = None
    others: tuple[Contact, ...] = ()

    def _card(self) -> Card:
        rows: list[tuple[str, Any]] = [("coordinates", sp.Tuple(*self.coordinates)), ("mass", self.mass)]
        rows += [("forces", sp.Tuple(*self.forces)), *self.contact._card().rows]
        for k, other in enumerate(self.others, 2):
            rows += [(f"{name} {k}", part) for name, part in other._card().rows]
        title = f"Mechanism of {len(self.coordinates)} coordinates and a contact that {self.contact.side}"
        return Card(title, tuple(rows))

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("coordinates", "velocities", "forces"):
            given = entries_of(name, getattr(self, name), "a sequence, one entry for each coordinate")
            put(self, name, tuple(_finite(name, value) for value in given))
        put(self, "mass", _matrix(self.mass))
        if len(self.velocities) != len(self.coordinates):
            raise InputError(f"{len(self.velocities)} velocities for {len(self.coordinates)} coordinates")
        put(self, "others", entries_of("others", self.others, CONTACTS))
        named = {"contact": self.contact} | {f"others[{k}]": other for k, other in enumerate(self.others)}
        for name, contact in named.items():
            if not isinstance(contact, Contact):
                raise InputError(f"{name} = {short(contact)}: it must be an ap.Contact; further ones are others=")
        put(self, "time", _time(self.coordinates) if self.time is None else expression("time", self.time))
        check_mechanism(self.equations, (self.contact, *self.others))

    @classmethod
    def from_lagrangian(
        cls, lagrangian: Any, coordinates: Any = None, *, contact: Contact, forces: Any = None, others: Any = ()
    ) -> "Mechanism":
        """Return the mechanism of a Lagrangian in dynamicsymbols, or of a ``LagrangesMethod`` or ``KanesMethod``.

        ``others`` are further contacts, and ``forces`` are the generalised forces that are not in the Lagrangian, as
        ``{coordinate: force}`` or one for each coordinate. A ``LagrangesMethod`` or ``KanesMethod`` has its own
        coordinates and forces; with a ``KanesMethod`` the slip may be given in its generalised speeds. Raises
        ``InputError`` for any other ``lagrangian``, and for a method with constraints of its own.
        """
        coordinates, mass, right, speeds = equations_of(lagrangian, coordinates, forces)
        time = _time(coordinates)
        contact, *others = (
            replace(c, slip=c.slip.subs(speeds)) if speeds and isinstance(c, Contact) else c
            for c in (contact, *entries_of("others", others, CONTACTS))
        )
        return cls(coordinates, tuple(q.diff(time) for q in coordinates), mass, tuple(right), contact, time, others)

    @cached_property
    def plain(self) -> Kinetics:
        """The same mechanism in plain symbols, a ``Kinetics``, with which the package computes."""
        return self.equations[0]

    @cached_property
    def equations(self) -> tuple[Kinetics, ...]:
        """The equations of the mechanism for each of its contacts."""
        names = self._names
        coordinates, velocities = (tuple(names[own] for own in part) for part in (self.coordinates, self.velocities))
        translate = lambda expr: plainly(expr, names, self.time)  # noqa: E731
        mass, forces = self.mass.applyfunc(translate), sp.ImmutableMatrix([*map(translate, self.forces)])
        found = []
        for contact in (self.contact, *self.others):
            slip = translate(contact.slip)
            kinetics = Kinetics(
                coordinates, velocities, mass, forces, translate(contact.gap), slip, translate(contact.friction),
                translate(contact.static), translate(contact.load), contact.unilateral, self.time,
            )
            found.append(kinetics if slip.free_symbols & {*velocities} else replace(kinetics, slip=kinetics.rate(slip)))
        return tuple(found)

    @cached_property
    def held(self) -> Kinetics:
        """The equations of the first contact while the ``others`` that hold both ways do, and the unilateral are open.

        Raises ``NotDerivable`` if joints leave gap and slip no motions of their own, or depend on each other.
        """
        others = [contact for contact in self.equations[1:] if not contact.unilateral]
        rough = tuple(contact for contact in others if contact.friction != 0 or contact.static != 0)
        found = replace(self.plain, joints=tuple(other for other in others if other not in rough), rough=rough)
        found.require_motion(found.joints)
        return found

    def _smooth(self, what: str) -> Kinetics:
        """Return ``held``; raises ``NotDerivable`` for ``what`` beside rough others."""
        if self.held.rough:
            k = next(k for k, contact in enumerate(self.equations[1:]) if contact in self.held.rough)
            raise NotDerivable(f"others[{k}] holds both ways, is rough, and {what}: take motions() at numbers, "
                               "rigid() or elastic()")
        return self.held

    @property
    def parameters(self) -> tuple[sp.Symbol, ...]:
        """Every parameter of the mechanism and of all its contacts as a plain symbol, sorted by name."""
        return tuple(sorted({s for kinetics in self.equations for s in kinetics.parameters}, key=str))

    @property
    def delassus(self) -> sp.ImmutableMatrix:
        """The Delassus matrix [[G_NN, G_NT], [G_NT, G_TT]] = W' M^-1 W of the directions (W_N, W_T).

        Joints, the ``others`` that hold both ways without friction, are held meanwhile.
        """
        return self.own(self.held.delassus)

    @property
    def free(self) -> tuple[sp.Expr, sp.Expr]:
        """The free accelerations (a_N, a_T): g'' and gamma' without reaction and friction, while joints are held."""
        return tuple(map(self.own, self.held.free))

    @property
    def sliding_velocity(self) -> sp.Expr:
        """The sliding velocity gamma in coordinates and velocities."""
        return self.own(self.plain.slip)

    @property
    def critical_friction(self) -> sp.Expr:
        """The coefficient of friction G_NN / (load |G_NT|) above which there is a paradox, or oo if G_NT is 0.

        Beside rough others that hold both ways it is the least such quotient for all signs of their friction, and below
        0 where they have a paradox whatever the friction of the contact.
        """
        return self.own(paradox.critical_friction(self.held))

    @property
    def paradox(self) -> sp.Basic:
        """The condition friction load |G_NT| > G_NN, under which sliding has no motion or more than one.

        A unilateral contact has a paradox only if gamma G_NT > 0; if gamma G_NT < 0, sliding has one motion. Beside
        rough others that hold both ways, some forces leave no motion or several in sliding of some directions.
        """
        return self.own(paradox.condition(self.held))

    def evaluate(self, expr: Any, values: dict[Any, Any]) -> Any:
        """Return an expression or condition in the mechanism's own symbols at numbers or arrays of numbers.

        The expression may hold other symbols, too, such as the damping time h of a jump law. The time is 0 unless it is
        given. An equation in a condition holds if rounding its symbols to six digits could make it hold.
        An expression that jumps at this place or time has its value just afterwards, if ``values`` contain the rates.
        """
        plain = plainly(_exact("expr", expr), self._names, self.time)
        given = {self.plain.time: 0} | self.keyed(values, plain.free_symbols)
        try:
            return evaluate_ahead(self.plain, (plain,), given)[0]
        except OutOfRange:
            require_positive_mass(self.plain, given)  # without it the inverse may have no value
            raise

    def motions(self, values: dict[Any, Any]) -> tuple[Motion, ...]:
        """Return the rigid motions at numbers: one, or where there is a paradox none or several.

        Each is a pair (name, reaction) with the name ``"slip"``, ``"stick"`` or ``"lift_off"``; the contact counts as
        closed. If some of ``others`` are closed here, the contact is closed only where its gap is 0, and the name is
        that of a mode of ``rigid()``, with the reactions of all contacts; nan is one that is not determined, as of a
        ladder at rest, while the motion is. The time is 0 unless it is given. Raises ``InputError`` for missing values,
        ``NoMotion`` where a contact is hit, ``Undecided`` or ``UnboundedReaction`` where a motion is not determined.
        """
        given = self._single(values)
        if not any(is_met(contact, given) for contact in self.equations[1:]):
            return rigid.motions(self.plain, given)
        return rigid_system.motions_of_all(*self._beginning(values))

    def has_paradox(self, values: dict[Any, Any]) -> bool:
        """Tell whether some forces leave the contacts that are closed at numbers no motion or several.

        The applied forces do not matter, and of the rates only the directions in which contacts slide: with other
        forces ``motions`` are none or several (Lemma 21). A contact at rest counts with stick and with slip of both
        directions; if its static friction exceeds the kinetic one, False is no proof. Raises as ``motions`` does, and
        ``UnboundedReaction`` where forces that some choice of stick, slip and open contacts does not determine leave it
        open, as those of a body at rest on two contacts.

        >>> x, y, u, v, k = sp.symbols("x y u v k")
        >>> body = Mechanism((x, y), (u, v), [[2, 1], [1, 1]], (0, 0), Contact(y, x, k, unilateral=True))
        >>> [body.has_paradox({"x": 0, "y": 0, "u": -1, "v": 0, "k": friction}) for friction in (1, 3)]
        [False, True]
        """
        automaton, t, start = self._beginning(values)
        return automaton.has_paradox(t, start)

    def _single(self, values: dict[Any, Any]) -> dict[sp.Symbol, Any]:
        """Return numbers by plain symbols, with the time; raises ``InputError`` for arrays."""
        given = {self.plain.time: 0} | self.keyed(values)
        if shaped := [key for key, value in given.items() if raw_entries(str(key), value).ndim]:
            raise InputError(f"{shaped[0]} is an array; motion_map counts the motions on arrays")
        return given

    def _beginning(self, values: dict[Any, Any]) -> tuple[Automaton, Any, tuple]:
        """Return the automaton of the rigid system, the time and the state; states that do not matter are 0."""
        system, given = self.rigid(), self._single(values)
        idle = self._idle(system) - given.keys()
        automaton, state = rigid_system.automaton_at(system, given, self.start(system, dict.fromkeys(idle, 0) | values))
        return automaton, given[self.plain.time], state

    def _idle(self, system: System) -> set[sp.Symbol]:
        """Return the states that neither a contact nor the rate of a velocity contains, whose numbers do not matter."""
        parts = (part for friction in system.frictions for part in friction.parts.values())
        return {*system.states} - symbols_in(sp.Tuple(*parts, *(system.rates[u] for u in self.plain.velocities)))

    def motion_map(self, values: dict[Any, Any]) -> MotionMap:
        """Return the map of rigid motions on arrays that broadcast: ``.count``, ``.count_of("slip")``."""
        return rigid.motion_map(self._smooth("slips and sticks, too"), self.keyed(values))

    def paradox_set(self, over: dict[Any, Any], values: dict[Any, Any] | None = None) -> ParadoxSet:
        """Return the set with a paradox over one or two coordinates or parameters, ``over = {name: (low, high)}``.

        Its ``.intervals`` are stretches of the first one, from ``.start`` to ``.end``. ``values`` gives all others; the
        time is 0 unless it is given.
        """
        given = {self.plain.time: 0} | self.keyed({} if values is None else values)
        return paradox_set(self.held, self.keyed(over), given)

    def least_critical_friction(self, coordinate: Any, values: dict[Any, Any] | None = None) -> LeastFriction:
        """Return the least critical friction over ``coordinate``, ``.friction``, at the place given by ``.where``.

        Raises ``NotDerivable`` if the critical friction is not rational in the sine and cosine of ``coordinate``.
        """
        if not isinstance(coordinate, str | sp.Basic):
            raise InputError(f"coordinate = {short(coordinate)}: give one coordinate, by its name or its symbol")
        (name,) = self.keyed({coordinate: 0})
        return paradox.least(self.held, name, self.keyed({} if values is None else values), self.own)

    def jump_law(self, ratio: Any = None, damping: Any = None) -> JumpLaw:
        """Return the jump through the paradox: ``.impulses`` (P_N, P_T), ``.velocities`` after it, ``.condition``.

        ``damping`` is the damping time, by default a symbol h, and ``.reaction`` is the gain of the elastic reaction x.
        The law is that of a closed contact, not of a collision: its condition contains g' = 0 before the jump.
        With a ``ratio`` h/sqrt(c), a unilateral contact opens with the rate ``.gap_rate``, if joints are rigid, which
        those of ``elastic()`` are not. The law has errors of order c log(1/c) in the compliance c, or with a ratio of
        order sqrt(c) log(1/c). Friction by the sliding velocity may fall below the critical one: the condition then
        tells where the contact stops all the same. Raises ``NotDerivable`` for friction by other velocities, and for
        damping by velocities that change meanwhile.
        """
        ratio, damping = (
            value if value is None else plainly(_exact(name, value), self._names, self.time)
            for name, value in (("ratio", ratio), ("damping", damping))
        )
        kinetics = self._smooth("may stop, or turn its load, within the jump")
        return jump_law.jump_law(kinetics, self.own, ratio, damping)

    def rigid(self) -> System:
        """Return the rigid mechanism as a ``System`` in all coordinates and velocities; start it at g = g' = 0.

        A run of this system raises ``NoMotion`` or ``TwoMotions`` at a state from which no motion or several continue.
        With static friction above kinetic friction a contact that stops may rest or slide back. The rigid contact then
        rests; the elastic one may slide back, as its reaction is still that of the slip before. A contact at rest that
        may stay or lift off stays, as a jam does that is pressed; the elastic one that starts unpressed lifts off.
        """
        return rigid_system.rigid_system(self.equations)

    def elastic(self, compliance: Any = None, damping: Any = None) -> System:
        """Return the mechanism with an elastic, damped contact as a slow-fast ``System``.

        ``compliance`` is a Symbol c with ``damping`` a time h, or ``eps**2`` with ``damping`` a multiple of eps, 0
        included. The damping may depend on coordinates, rates and time. The states are the coordinates, the reaction x,
        its rate y, the sliding velocity z, and the rates of the last coordinates that complete g' and z to a basis of
        the velocities at all places. If none do, these are all rates, from which y and z follow. The ``others`` have
        reactions x2, x3, ... of the same compliance and damping; with others the rates complete all g', and no sliding
        velocity is a state. A gap rate that depends on those before, as at a third support of a beam, adds no y.
        With a damping time h, R = max(0, x + h y): a contact that has opened and returns pushes already at the gap
        h |g'|. So motions with flights need ``eps**2``. Raises ``InputError`` for other scalings, ``NotDerivable``.
        """
        if compliance is None or damping is None:
            raise InputError("an elastic contact needs compliance= and damping=: a Symbol c and a time h, or eps**2 "
                             "and a multiple of eps, 0 included")
        damping = plainly(_finite("damping", damping), self._names, self.time)
        return elastic.elastic(self.equations, compliance, damping)

    def start(self, system: System, values: dict[Any, Any]) -> dict[str, Any]:
        """Return a start of the elastic or rigid ``system`` of this mechanism, from ``values`` by name or symbol.

        ``values`` are coordinates, rates and parameters. If g = g' = 0, the elastic contact starts without reaction,
        x = y = 0; otherwise x and y follow from the gap and the gap rate, and ``values`` must contain the compliance.
        z is the sliding velocity. From exact values x, y and z are exact, too. Raises ``InputError`` for missing
        values, a system of another mechanism, and a bilateral rigid contact where g = g' = 0 does not hold.
        """
        require_system(system, "start")
        if other := [str(q) for q in self.plain.coordinates if q not in system.states]:
            raise InputError(f"start: {other[0]} is no state of the system; give the mechanism's elastic() or rigid()")
        given = {self.plain.time: 0} | self.keyed(values, system.parameters)
        for symbol, value in given.items():
            exact_constant(str(symbol), value)  # refuses what is no single number
        for k, (contact, friction) in enumerate(zip(self.equations, system.frictions, strict=False)):
            if friction.gap_rate is not None:
                require_closed(contact, given, f"others[{k - 1}]: " if k else "")
        require_positive_mass(self.plain, given)
        moving = {*self.plain.coordinates, *self.plain.velocities}
        fixed = {s: 0 for s in system.states if s not in moving}
        sliding = [f.velocity for f in system.frictions if f.velocity in fixed]
        fixed |= {z: exactly_at(self.plain.slip, given) for z in sliding}
        if system.small in system.parameters:
            fixed |= elastic.pressed(self.equations, system, {**fixed, **given}, given.get(system.small))
        if missing := [str(s) for s in system.states if s in moving and s not in given]:
            raise InputError(f"no value for {', '.join(missing)}; give the coordinates and rates to start from")
        return {s.name: {**given, **fixed}[s] for s in system.states}

    def behind_start(self, values: dict[str, Any]) -> set[str]:
        """Return the names beside those of ``values`` on which gaps, gap rates and the velocity z of a start depend."""
        sliding = () if self.others else (self.plain.slip,)  # with others no sliding velocity is a state
        formulas = sp.Tuple(*sliding, *(part for k in self.equations for part in (k.gap, k.gap_rate)))
        known = {s: exact_constant(str(s), values[s.name]) for s in symbols_in(formulas) if s.name in values}
        return {*map(str, symbols_in(replaced(formulas, known)))}

    @cached_property
    def _names(self):
        return {own: plain_name(own) for own in (*self.coordinates, *self.velocities)}

    def own(self, thing: Any) -> Any:
        """Return an expression or matrix in plain symbols, translated to the mechanism's coordinates and velocities."""
        if not isinstance(thing, sp.Basic | sp.MatrixBase):
            raise InputError(f"{short(thing)} is neither an expression nor a matrix in plain symbols")
        thing = thing.as_immutable() if isinstance(thing, sp.MatrixBase) else thing
        return replaced(thing, {plain: own for own, plain in self._names.items()})

    def keyed(self, values: dict[Any, Any], others: Iterable[sp.Symbol] = ()) -> dict[sp.Symbol, Any]:
        """Return ``values`` with plain symbols as keys; the given keys are names, symbols or dynamicsymbols.

        ``others`` are symbols that are known besides those of the mechanism.
        """
        others = entries_of("others", others, "a sequence of Symbols")
        return keyed(values, self.plain, self._names, (*self.parameters, *others))


def _time(coordinates):
    """Return the time of the first coordinate that is a function, or the symbol t."""
    functions = [q for q in coordinates if isinstance(q, sp.core.function.AppliedUndef)]
    return functions[0].args[0] if functions else sp.Symbol("t")


def _finite(name, value):
    """Return an expression with every float as the rational number of the same value; raises ``InputError``."""
    found = _exact(name, value)
    if not isinstance(found, sp.Expr):
        raise InputError(f"{name} = {short(value)}: it must be an expression in symbols")
    if atoms(found, sp.Basic) & {*NOT_FINITE, sp.I}:
        raise InputError(f"{name} = {found!s:.60}: it must be finite and real")
    return found


def _exact(name, value):
    """Return an expression with rational numbers for decimals."""
    found = expression(name, value)
    return replaced(found, {number: sp.Rational(number) for number in atoms(found, sp.Float)})


def _matrix(mass):
    rows = mass.tolist() if hasattr(mass, "tolist") else mass
    if not rows or not isinstance(rows, list | tuple) or not all(isinstance(row, list | tuple) for row in rows):
        raise InputError(f"mass = {short(mass)}: it must be a square matrix, a list of rows")
    if len({len(row) for row in rows}) != 1:
        raise InputError(f"mass = {short(mass)}: its rows differ in length")
    return sp.ImmutableMatrix([[_finite("mass", entry) for entry in row] for row in rows])
