r"""The modes through which a fast layer passes in the limit mu -> 0, found from the load alone.

During the layer x is constant and the load s obeys mu s' = p + q s in each mode. The load tends to its rest point -p/q
where q < 0 and grows without bound where q > 0. A mode ends where s = 0, or at the switching plane z = 0 once s is
unbounded, or, in stick, at an edge of the friction cone. Every decision is the sign of an expression, so the signs that
``itinerary`` asks for define the set of starts and parameters with this itinerary. The hard functions are ``_slip`` and
``_stick``, which decide how a mode ends.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from asympk.asymptotics.layers import ItineraryStep
from asympk.errors import NotDerivable, OutOfRange

LONGEST = 8  # the most modes of a layer
IN_NUMBERS = "solve(scene, method='jump', order=n) follows any slow-fast system in numbers"
UNBOUNDED = "follow it by solve(scene) for a time of order mu log(1/mu)"
EDGES = {"upper": 1, "lower": -1}


@dataclass(frozen=True)
class LoadLine:
    """The equations of a layer in the load s, its coefficients symbols, numbers or arrays.

    For each mode, ``fast`` holds (p, q) of mu s' = p + q s and ``rate`` holds (h0, h1) of z' = h0 + h1 s. ``drive`` is
    (d0, d1): static friction must hold d0 + d1 s, and holds up to ``static`` |s|.
    """

    fast: dict
    rate: dict
    drive: tuple
    static: Any

    def rest(self, mode: str) -> Any:
        """Return the load on the critical manifold of a mode, where the fast motion is at rest."""
        p, q = self.fast[mode]
        return -p / q

    def side(self, mode: str, sign: Callable[[Any], int]) -> int:
        """Return the sign of the velocities for which a mode has its critical manifold; 0 in stick or without one."""
        if sign(self.fast[mode][1]) == 0:
            return 0
        return sign(self.rest(mode)) * {"slip_same": 1, "slip_opposite": -1, "stick": 0}[mode]

    def acceleration(self, mode: str) -> Any:
        """Return z' on the critical manifold of a mode."""
        h0, h1 = self.rate[mode]
        return h0 + h1 * self.rest(mode)

    def returns(self, mode: str, sign: Callable[[Any], int]) -> bool:
        """Tell whether the slow motion on the critical manifold of a mode heads for the switching plane."""
        return self.side(mode, sign) * sign(self.acceleration(mode)) < 0

    def margin(self, load: Any) -> Any:
        """Return the force that static friction can hold less that which it must hold; not negative where it holds."""
        return self.static * abs(load) - abs(self.drive[0] + self.drive[1] * load)

    def edges(self, sign: Callable[[Any], int]) -> Iterator[tuple[str, Any]]:
        """Yield the names of the edges ``drive = k static s``, k = 1 and -1, and the loads there."""
        for name in EDGES:
            if sign(self._slope(name)):
                yield name, self.load_at(name)

    def load_at(self, level: str) -> Any:
        """Return the load at a level: an edge of the cone, or ``"load"`` itself, where it vanishes."""
        return self.drive[0] / self._slope(level) if level in EDGES else 0

    def _slope(self, edge):
        return EDGES[edge] * self.static - self.drive[1]


def itinerary(line: LoadLine, load: Any, velocity: Any, sign: Callable[[Any], int]) -> tuple[ItineraryStep, ...]:
    """Return the steps from a start (load, velocity) until the layer has landed on a critical manifold.

    ``sign`` returns the sign of an expression, and may record it. Raises ``OutOfRange`` for a start on the repelling
    manifold, which divides two itineraries, for a mode without fast motion and for a load that settles at 0. Raises
    ``NotDerivable`` where no critical manifold is reached.
    """
    steps: list[ItineraryStep] = []
    side, far = sign(velocity), 0
    while not steps or steps[-1].event:
        if len(steps) == LONGEST:
            raise NotDerivable(f"the layer passes through more than {LONGEST} modes: {[s.mode for s in steps]}")
        step = None
        if side == 0 and (far or sign(line.margin(load)) >= 0):
            step, load = _stick(line, load, far, sign)
        if step:
            side, far = _direction(line, load, sign) if step.event else 0, 0
        else:
            side = side or _direction(line, load, sign)
            step, load, far = _slip(line, load, side, sign)
            side = 0 if far else side
        steps.append(step)
    return tuple(steps)


def require_no_return(
    line: LoadLine, steps: tuple[ItineraryStep, ...], velocity: Any, sign: Callable[[Any], int]
) -> None:
    """Raise ``NotDerivable`` where a velocity that has left rest may vanish again at a time that is no series.

    This velocity is of order mu. Its rate is affine in the load, which is monotonic in a mode: the velocity may return
    where its rate opposes it at the end of the mode. The load there, which is no closed form, decides the next mode, to
    order 0, too.
    """
    rested = sign(velocity) == 0
    for mode, side, event, _ in steps:
        last = line.rate[mode][0] if event else line.acceleration(mode)  # at no load, or on the critical manifold
        if rested and side and (event == "velocity_zero" or sign(last) * side < 0):
            raise NotDerivable(f"{mode}: the velocity, of order mu since it left rest, vanishes again at a time that "
                               f"is no series in mu and log(1/mu); {IN_NUMBERS}")
        rested = rested or event == "velocity_zero"


def _slip(line, load, side, sign):
    of_load = sign(load) or sign(line.fast["slip_same"][0])
    mode = "slip_same" if of_load == side else "slip_opposite"
    p, q = line.fast[mode]
    attracts = sign(q)
    if attracts == 0:
        raise OutOfRange(f"{mode}: the load neither settles nor grows at a fast rate (mu s' = {p} + {q} s)")
    if attracts < 0:
        if not (rest := sign(line.rest(mode))):
            raise OutOfRange(f"{mode}: the load settles where it vanishes; terms of order mu decide whether it passes")
        if rest == of_load:
            return ItineraryStep(mode, side), load, 0
        return ItineraryStep(mode, side, "force_zero", "load"), 0 * p, 0
    away = sign(p + q * load)
    if away == 0:
        raise OutOfRange(f"the start lies on the repelling manifold of {mode}, whose sides differ "
                         f"(s = {line.rest(mode)})")
    if away != of_load:
        return ItineraryStep(mode, side, "force_zero", "load"), 0 * p, 0
    if sign(line.rate[mode][1]) * away != -side:
        raise NotDerivable(f"{mode}: the load grows without bound and the velocity with it; {UNBOUNDED}")
    if sign(line.static - abs(line.drive[1])) <= 0:
        raise NotDerivable(f"{mode}: at an unbounded load friction does not hold, and the motion crosses the plane; "
                           f"{IN_NUMBERS}")
    return ItineraryStep(mode, side, "velocity_zero", "velocity"), load, away


def _stick(line, load, far, sign):
    """Return the stick step and the load at its end; None for the step where the load leaves the cone immediately."""
    rest = line.rest("stick")
    if sign(line.fast["stick"][1]) >= 0:
        raise NotDerivable(f"stick: the load does not settle; {UNBOUNDED}")
    way = -far or sign(rest - load)
    ahead = [
        (name, edge) for name, edge in line.edges(sign)
        if sign(rest - edge) == way and (far or sign(edge - load) == way)
    ]
    if not ahead:
        return (ItineraryStep("stick", 0), rest) if sign(line.margin(rest)) >= 0 else (None, load)
    first = ahead[0]
    for other in ahead[1:]:
        first = other if sign(first[1] - other[1]) == way else first
    return ItineraryStep("stick", 0, "slip_onset", first[0]), first[1]


def _direction(line, load, sign):
    return sign(line.drive[0] + line.drive[1] * load)
