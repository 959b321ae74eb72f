r"""Certificates: the exact flow enclosed in balls, with a proof of its sequence of modes, or a refusal by name.

Every number of the scene becomes a ball that contains it; an interval of a box becomes a wider ball. ``certify`` raises
the precision until the result is sharp, ``_follow`` goes through the modes of the rod, ``affine.enclose`` through those
of an affine system, and ``cover`` cuts a box into pieces that can be proven.

Each mode is followed in closed form in balls (``enclosure``). At an event the vanishing quantity is set to its exact
value, and the next mode is decided by inequalities that hold at every point of the balls. An inequality that is not
certain is an obstacle to the proof: ``grazing`` (a guard may or may not vanish), ``edge`` (z = 0 met on an edge of the
static cone, or no certain next mode), ``simultaneous`` (two events), ``horizon`` (an event that may be at the end),
``unstable plane`` (the balls contain a point of Pi2), ``start``, ``too many`` (events), ``candidates`` (too many next
modes), ``undecided`` (the allowed work is spent), and the obstacles of ``rows`` and ``spectrum``. The modes of the rod,
their coefficients and their succession are written here independently of the flow: a proof must not rest on the code
that it checks.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from heapq import heappop, heappush
from itertools import count, product
from typing import Any, NamedTuple

from asympk.affine.run import obstacle
from asympk.certify import affine
from asympk.certify.balls import Refused, ball, ball_of, certain_sign, common, flint, hull, precision
from asympk.certify.enclosure import Budget, LevelGuard, RodBalls, first_event, segment
from asympk.errors import InputError
from asympk.numbers import LARGEST, number, require_callback, short, sign_of, whole
from asympk.path import Event
from asympk.scene import MANIFOLDS, Scene, require_scene
from asympk.shown import Card, ShownAsTable, ball_as_text
from asympk.symbolic.placing import with_numbers_inside
from asympk.systems.catalogue import is_off_contact

COORDINATES = ("sigma", "mu", "sigma0", "x", "y", "z", "until")
MOST_DIGITS, MOST_PIECES = 300, 100_000
_BITS = (96, 192, 384, 768, 1536, 3072)
WORK = 200_000  # pieces of time that one certificate may examine, a box a tenth of them: about ten seconds


@dataclass(frozen=True, repr=False)
class Certificate(ShownAsTable):
    """A proof of the sequence of modes of ``scene``, or the reason why there is none.

    A ``proven`` certificate has ``modes``, ``events`` (Events whose time and state are balls) and ``final``, a ball for
    every state that contains its exact value at ``until`` for every point of ``box``. Any other certificate has
    ``reason``, which begins with the name of the obstacle. ``bits`` is the working precision.
    """

    scene: Any
    proven: bool
    modes: tuple = ()
    events: tuple = field(default=(), hash=False)  # balls have no hash
    final: tuple = field(default=(), hash=False)
    reason: str = ""
    bits: int = 0
    box: dict = field(default_factory=dict, hash=False)

    def _card(self) -> Card:
        box = [(name, f"{_end(low)} .. {_end(high)}") for name, (low, high) in self.box.items()]
        if not self.proven:
            return Card("Certificate: undecided", (("reason", self.reason), *box))
        events = [(f"t = {ball_as_text(event.t, 6)}", event.kind) for event in self.events]
        final = [(name, ball_as_text(value, 17)) for name, value in zip(self.scene.names, self.final, strict=True)]
        return Card(f"Certificate: proven with {self.bits} bits: {' -> '.join(self.modes)}", (*box, *events, *final))

    @property
    def obstacle(self) -> str:
        """The name of the obstacle to a proof, such as ``grazing``; empty for a proven certificate."""
        return self.reason.partition(":")[0]


def _end(value):
    """Return an end of a box in words: an integer or a ratio, but a double that is no integer by its decimal."""
    return str(float(value)) if value % 1 and abs(value) < LARGEST and float(value) == value else short(value)


class SceneBalls(NamedTuple):
    """The numbers of a scene of the rod in balls.

    ``s`` is x + y. ``exact`` are the Fractions (sigma0, x, y, z, ends of mu), or None where one of the first four
    ranges and for physical quantities. ``near`` is (manifold, offset) of a start beside a slow line, else None.
    """

    sigma: Any
    mu: Any
    sigma0: Any
    x: Any
    y: Any
    z: Any
    until: Any
    s: Any
    exact: tuple | None
    near: tuple | None


def certify(scene: Scene, box: Mapping[str, tuple] | None = None, digits: int = 15) -> Certificate:
    """Return the ``Certificate`` of a ``Scene``, on a ``box`` {coordinate: (low, high)} if given.

    Coordinates are sigma, mu, sigma0, x, y, z and until of the rod, or in their place the physical quantities that its
    scene is given in, and states and parameters of an affine system, without those from which a start in coordinates of
    a mechanism derives its reaction or sliding velocity.

    Unless a side of the box has a length, the precision is raised until the radii of the final state are below
    10^-digits times the largest of 1, |x|, |z| (of an affine system: of 1 and all states). Where the allowed work is
    spent, what was found with fewer bits stands, and ``undecided`` is the obstacle if nothing was. Raises
    ``InputError`` for an invalid box.
    """
    require_scene(scene, "certify")
    digits = whole("digits", digits, 1, MOST_DIGITS)
    sides = _sides(scene, {} if box is None else box)
    wide = _ranging(sides)
    budget, last = Budget(WORK // 10 if wide else WORK, bool(wide)), None
    for bits in _BITS[1:2] if wide else _BITS:
        with precision(bits):
            found = _attempt(scene, sides, bits, budget)
            if found.proven and (wide or _sharp(scene, found.final, digits)):
                return found
        if found.obstacle == "too many":  # each of them is proven, with more bits, too
            return found
        if found.obstacle == "undecided":
            return last or found
        last = found
    return found


def cover(
    scene: Scene, box: Mapping[str, tuple], pieces: int = 64, progress: Callable[[int, int], None] | None = None
) -> tuple[Certificate, ...]:
    """Return certificates of pieces that make up ``box``; pieces without a proof are halved, to ``pieces`` in all.

    A side of a piece is undecided if there is no proof with all other sides shrunk to their midpoints. The largest
    piece is halved next, across its longest undecided side; each undecided side counts as a quarter of the size.
    ``progress(proven, cut)`` is called with the number of pieces proven and of all before a piece is halved.
    """
    require_scene(scene, "cover")
    require_callback("progress", progress)
    pieces = whole("pieces", pieces, 1, MOST_PIECES)
    done: list[Certificate] = []
    undecided: list[tuple] = []
    first, order = certify(scene, box), count()
    fresh = [first]
    while fresh:
        for found in fresh:
            if found.proven or all(low == high for low, high in found.box.values()):
                done.append(found)
            else:
                size, side = _undecided(scene, found, first.box)
                heappush(undecided, (-size, next(order), side, found))
        fresh = []
        if undecided and len(done) + len(undecided) < pieces:
            if progress:
                progress(len(done), len(done) + len(undecided))
            *_, side, found = heappop(undecided)
            low, high = found.box[side]
            middle = (low + high) / 2
            fresh = [certify(scene, {**found.box, side: half}) for half in ((low, middle), (middle, high))]
    return (*done, *(found for *_, found in undecided))


def _undecided(scene, found, box):
    """Return (size, side to cut) of a piece without a proof: its part of the box, a quarter per undecided side."""
    lengths = {name: high - low for name, (low, high) in box.items()}
    parts = {name: float((high - low) / lengths[name]) for name, (low, high) in found.box.items() if low < high}
    middle = {name: ((low + high) / 2,) * 2 for name, (low, high) in found.box.items()}
    alone = len(parts) == 1  # then the piece itself is what would be tried
    sides = [name for name in parts if alone or not certify(scene, {**middle, name: found.box[name]}).proven]
    return math.prod(parts.values()) / 4 ** len(sides), max(sides or parts, key=parts.get)


def _attempt(scene, sides, bits, budget):
    try:
        modes, events, final = _followed(scene, sides, budget)
    except Refused as reason:
        return Certificate(scene, False, reason=str(reason), bits=bits, box=sides)
    return Certificate(scene, True, tuple(modes), tuple(events), final, bits=bits, box=sides)


def _sharp(scene, final, digits):
    """Tell whether all radii are below 10^-digits of the largest of 1 and the states, for the rod of 1, |x| and |z|."""
    sizes = final[::2] if scene.system is None else final
    largest = max(1.0, *(abs(float(value.mid())) for value in sizes))
    return all(value.rad() < flint().arb(10) ** -digits * largest for value in final)


def _followed(scene, sides, budget):
    """Return (modes, events, final balls) of the rod or of an affine system; raises ``Refused``."""
    if scene.system is None:
        return _follow(_balls_of(scene, sides), budget)
    turned, corner = _ranging(sides), _corner(sides)
    begun = zip(scene.names, scene.start, strict=True)
    start = [None if name in turned else Fraction(corner.get(name, value)) for name, value in begun]
    return affine.enclose(*_with_fixed_numbers(scene, sides), turned, start, scene.until, budget)


def _with_fixed_numbers(scene, sides):
    """Return the system and the values at a corner, with numbers inside of formulas unless one of them ranges."""
    given = scene.system, _values(scene, _corner(sides))
    placed = with_numbers_inside(*given)
    hidden = {*map(str, scene.system.parameters)} - {*map(str, placed[0].parameters)}
    return given if hidden & _ranging(sides).keys() else placed


def _corner(sides):
    return {name: low for name, (low, _) in sides.items()}


def _ranging(sides):
    """Return the sides of a box that have a length."""
    return {name: ends for name, ends in sides.items() if ends[0] < ends[1]}


def _values(scene, corner):
    """Return the values of the parameters of a scene, with those in ``corner`` {name: value} replaced."""
    pairs = zip(scene.system.parameters, scene.values, strict=True)
    return tuple(corner.get(symbol.name, value) for symbol, value in pairs)


def _sides_of_system(scene, box):
    """Return the sides of a box of an affine system; raises ``InputError`` where a corner of parameters is invalid."""
    known = (*scene.names, *(s.name for s in scene.system.parameters))
    sides = _exact_sides(box, known, "state and no parameter")
    if found := obstacle(_with_fixed_numbers(scene, sides)[0]):
        raise InputError(f"a certificate is for the rod and for systems whose modes are all affine; {found}")
    turned = {name: ends for name, ends in sides.items() if name not in scene.names}
    if behind := _behind_start(scene, sides):
        raise InputError(f"box: the reaction or the sliding velocity of the start follows from {', '.join(behind)}; "
                         "let others range, or give the start in states")
    for corner in product(*turned.values()):
        found = _values(scene, dict(zip(turned, corner, strict=True)))
        values = dict(zip(scene.system.parameters, found, strict=True))
        scene.system.placed(values, dict(zip(scene.names, scene.start, strict=True)))
    return sides


def _behind_start(scene, sides):
    """Return the names of a box from which other states of the start follow, at a start in coordinates and rates."""
    mechanism, values, state, _ = scene.origin or (None, {}, scene.names, None)
    if {*scene.names} <= {*state}:
        return []
    known = {**values, **dict(zip(map(str, scene.system.parameters), scene.values, strict=True)), **state}
    behind = mechanism.behind_start({name: value for name, value in known.items() if name not in sides})
    return sorted(sides.keys() & (behind | ({str(scene.system.small)} if is_off_contact(scene) else set())))


def _exact_sides(box, known, what, physical=()):
    """Return {name: (low, high)} of a box in Fractions; raises ``InputError`` for unknown names and empty intervals."""
    if not isinstance(box, Mapping):
        raise InputError(f"box = {short(box)}: it must be a mapping from names to (low, high)")
    from asympk.systems.painleve_klein.units import in_radians  # ball arithmetic covers that it rounds an angle

    sides = {}
    for name, ends in ((str(key), ends) for key, ends in box.items()):
        if name not in known:
            raise InputError(f"box: {name!r} is no {what}; choose one of {', '.join(known)}")
        if not isinstance(ends, list | tuple) or len(ends) != 2:
            raise InputError(f"box: {name} = {short(ends)}: it must be two numbers (low, high)")
        read = partial(in_radians, name) if name in physical else partial(number, f"box {name}")
        low, high = (Fraction(read(end)) for end in ends)
        if low > high:
            raise InputError(f"box: {name} from {short(low)} to {short(high)} is empty; give the lower end first")
        sides[name] = (low, high)
    return sides


def _sides(scene, box):
    if scene.system is not None:
        return _sides_of_system(scene, box)
    own = dict(scene.rod.quantities) if scene.rod else {}
    sides = _exact_sides(box, dict.fromkeys((*COORDINATES, *own)), "parameter, state or horizon", own)
    if {*sides} - {*own} and (physical := [name for name in sides if name in own and name != "until"]):
        raise InputError(f"box: {physical[0]} is physical and {min({*sides} - {*own})} is not; give one kind only")
    least = {"sigma": -2, "mu": 0, "until": 0}
    for name, bound in least.items():
        if name in sides and not (sides[name][0] > bound or (name == "until" and sides[name][0] == 0)):
            raise InputError(f"box: {name} must be above {bound}; it starts at {short(sides[name][0])}")
    if scene.near_to and sides.keys() & {"x", "y", "z"}:
        raise InputError("box: a scene that starts beside a slow line has no box of starts")
    _require_static(sides, "sigma", "sigma0", {"sigma": scene.sigma, "sigma0": scene.sigma0})
    if own:
        _require_static(sides, "f", "f0", own)
    return sides


def _require_static(sides, kinetic, static, own):
    """Raise ``InputError`` where a box has static friction below kinetic friction, unless the one follows the other."""
    largest = sides.get(kinetic, (0, Fraction(own[kinetic])))[1]
    if own[static] != own[kinetic] or static in sides:
        least = sides.get(static, (Fraction(own[static]),))[0]
        if least < largest:
            raise InputError(f"box: {static} must not be below {kinetic} anywhere; it is {short(least)} where "
                             f"{kinetic} is {short(largest)}")


def _balls_of(scene, sides):
    given = dict(zip(COORDINATES, (scene.sigma, scene.mu, scene.sigma0, *scene.start, scene.until), strict=True))
    values = {name: sides.get(name, (Fraction(value),) * 2) for name, value in given.items()}
    balls, exact, same = {name: hull(*ends) for name, ends in values.items()}, None, scene.sigma0 == scene.sigma
    if scene.rod:
        own = dict(scene.rod.quantities)
        same = own["f"] == own["f0"] and "f0" not in sides
        balls |= {name: value for name, value in _from_rod(own, sides).items() if name in own or name not in sides}
    if same and "sigma0" not in sides:
        balls["sigma0"], values["sigma0"] = balls["sigma"], values["sigma"]
    if not scene.rod and not _ranging(values).keys() & {"sigma0", "x", "y", "z"}:
        exact = (*(values[name][0] for name in ("sigma0", "x", "y", "z")), values["mu"])
    s = balls["x"] + balls["y"] if scene.rod else hull(*map(sum, zip(values["x"], values["y"], strict=True)))
    return SceneBalls(**balls, s=s, exact=exact, near=scene.near_to)


def _from_rod(quantities, sides):
    """Enclose the nondimensional numbers of a physical scene from its exact quantities, or those in ``sides``."""
    from asympk.systems.painleve_klein.units import SYMBOLS, Degrees, formulas

    balls = {
        SYMBOLS[name]: hull(*sides[name]) if name in sides
        else flint().arb.pi() * ball(q.value / 180) if isinstance(q, Degrees) else ball(q)
        for name, q in quantities.items()
    }
    return {name: ball_of(expr, balls) for name, expr in formulas().items()}


def _follow(balls, budget):
    """Return (modes, events, final balls) of a scene of the rod; raises ``Refused``."""
    state, s_sign, z_sign, touching, deviation = _beginning(balls)
    t, modes, events = ball(0), [], []
    while True:
        name = "stick" if not z_sign else "slip_same" if z_sign == s_sign else "slip_opposite"
        modes.append(name)
        a, b = (0, ball(1)) if name == "stick" else (1, _slope(balls, name))
        mode = segment(a, b, balls.mu, state, balls.until, deviation)
        remaining = balls.until - t
        found = first_event(mode, _guards(balls, state, s_sign, z_sign, touching), remaining, budget)
        if found is None:
            end = mode.state(remaining)
            return modes, events, (end.x, end.y, end.z if z_sign else ball(0))
        guard, dt = found
        if not dt < remaining:
            raise Refused(f"horizon: {guard.kind} at the end itself, until = {float(balls.until.mid()):.10g}")
        state, s_sign, z_sign, touching = _after(balls, guard, mode.at(guard, dt), s_sign, z_sign)
        deviation, t = None, t + dt
        events.append(Event(guard.kind, t, (state.x, state.y, state.z)))
        if len(events) > affine.MOST_EVENTS:
            raise Refused(f"too many: more than {affine.MOST_EVENTS} events by t = {float(t.mid()):.6g}")


def _slope(balls, name):
    """Return b of a mode of slip, mu y' = 1 - b s."""
    return balls.sigma + 4 if name == "slip_same" else -balls.sigma


def _guards(balls, state, s_sign, z_sign, touching):
    if z_sign:
        pairs = (("force_zero", "s", s_sign), ("velocity_zero", "z", z_sign))
        return [LevelGuard(kind, axis, side, 0, axis in touching) for kind, axis, side in pairs]
    near, far = _edges(balls, s_sign)
    guards = [LevelGuard("slip_onset", "s", s_sign, near, "near" in touching)]
    return guards if far is None else [*guards, LevelGuard("slip_onset", "s", -1, far, "far" in touching)]


def _edges(balls, s_sign):
    """Return (near edge or None: no cone, far edge or None: unbounded) of the static cone on the side of s."""
    which = certain_sign(balls.sigma0 + 1)
    if not which and not balls.sigma0 == -1:
        raise Refused("edge: the shape of the static cone changes at sigma0 = -1, within the box")
    if s_sign < 0:
        return (-1 / (balls.sigma0 + 1) if which > 0 else None), None
    return 1 / (balls.sigma0 + 3), (-1 / (balls.sigma0 + 1) if which < 0 else None)


def _beginning(balls):
    """Return (state, sign of s, sign of z, guards that vanish, deviation from the slow line) just after the start."""
    if balls.near:
        return _beside_line(balls)
    if balls.exact:
        return _exact_beginning(balls)
    s, s_sign, z_sign = balls.s, certain_sign(balls.s), certain_sign(balls.z)
    touching = {axis for axis, value in (("s", s), ("z", balls.z)) if value == 0}
    if "s" in touching:
        s_sign = certain_sign(1 + balls.mu * balls.y)
    if not s_sign or not (z_sign or "z" in touching):
        raise Refused(f"start: the sign of {'z' if s_sign else 'x + y'} is not the same throughout")
    state = RodBalls(balls.x, balls.y, s, balls.z)
    if not z_sign and not _sticks(balls, s, s_sign):
        z_sign = _direction(s)
    return state, s_sign, z_sign, touching, None


def _exact_beginning(balls):
    """Return the same for an exact start; rates decide where s is 0 or on an edge of the cone."""
    sigma0, x, y, z, mu = balls.exact
    s = x + y
    touching = {axis for axis, value in (("s", s), ("z", z)) if value == 0}
    s_sign = sign_of(s) or _sign_on(mu, 1, y) or 1
    state, z_sign = RodBalls(balls.x, balls.y, ball(s), balls.z), sign_of(z)
    if z_sign:
        return state, s_sign, z_sign, touching, None
    stick_margin = (sigma0 + 2) * abs(s) - abs(1 - s)
    if stick_margin == 0:
        widens = (sigma0 + 2) * s_sign + sign_of(1 - s)
        far = s > 1
        state, touching = state._replace(s=_edges(balls, s_sign)[far]), {"far" if far else "near", "z"}
        stick_margin = widens * (_sign_on(mu, -s, y) or -s)
    return state, s_sign, 0 if stick_margin > 0 else sign_of(1 - s), touching, None


def _sign_on(ends, constant, slope):
    """Return the sign of ``constant + slope mu`` between two ends of mu; raises ``Refused`` where it changes."""
    signs = {sign_of(constant + slope * end) for end in ends}
    if len(signs) > 1:
        raise Refused("start: the rate of x + y does not have one sign throughout")
    return signs.pop()


def _beside_line(balls):
    manifold, offset = balls.near
    b, deviation = _slope(balls, MANIFOLDS[manifold][0]), ball(offset)
    rho = (1 + (1 - 4 * balls.mu / b).sqrt()) / 2
    y = -(balls.x - 1 / b) / rho + deviation
    signs = certain_sign(balls.x + y), certain_sign(balls.z)
    if not all(signs):
        raise Refused("start: the sign of x + y or z is not certain")
    return RodBalls(balls.x, y, balls.x + y, balls.z), *signs, set(), deviation


def _sticks(balls, s, s_sign):
    """Tell whether s lies inside the static cone; raises ``Refused`` where s may lie on an edge."""
    near, far = _edges(balls, s_sign)
    if near is None:
        return False
    inside = [certain_sign(s_sign * (s - near))] + ([] if far is None else [certain_sign(far - s)])
    if 0 in inside:
        raise Refused(f"edge: z = 0 is met at x + y = {s.str(6)}, within the radius of an edge of the static cone")
    return all(side > 0 for side in inside)


def _direction(s):
    way = certain_sign(1 - s)
    if not way:
        raise Refused("edge: the direction in which z = 0 is left is not certain, x + y = 1")
    return way


def _after(balls, guard, state, s_sign, z_sign):
    """Return (state with the vanishing quantity exact, next sign of s, next sign of z, next guards that vanish)."""
    if guard.kind == "force_zero":
        return RodBalls(state.x, -state.x, ball(0), state.z), -s_sign, z_sign, {"s"}
    if guard.kind == "slip_onset":
        s = guard.level
        return RodBalls(state.x, s - state.x, s, ball(0)), s_sign, _direction(s), {"z"}
    s = common(state.s, state.x + state.y)
    state = RodBalls(state.x, common(state.y, s - state.x), s, ball(0))
    return state, s_sign, 0 if _sticks(balls, s, s_sign) else -z_sign, {"z"}
