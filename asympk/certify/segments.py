r"""The flow of one affine mode in balls: a matrix with its guards, and the motion from an enclosure of its start.

``e^{M t}`` is a sum over groups of eigenvalues, which ``spectrum`` encloses (Lemma 15). On a box of parameters or
starts all are families: the motion of the centre, and slopes on the box (Lemma 14). ``EnclosedSegment`` is the motion.
"""

from copy import copy
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import factorial
from typing import Any, NamedTuple

from asympk.automaton.modes import GuardedMode
from asympk.certify.balls import Ball, Refused, certain_sign, common, flint, whole_power
from asympk.certify.enclosure import root_in
from asympk.certify.families import NARROWINGS, Family, abreast, constant, diagonal, real, stacked
from asympk.certify.rows import EnclosedState, ExactEntries, Row, ball_at, row_rate, sharpened
from asympk.certify.spectrum import Spectrum

_ORDER = 16


class AffineGuard(NamedTuple):
    """A guard of a mode: the kind of its event, its friction, its row.

    ``touching`` is the number of derivatives, the guard included, that vanish where the mode begins; the next is
    positive. ``others`` are the frictions whose guards vanish with this one. ``null`` are rows that vanish throughout
    the mode because such a guard is equal to this one.
    """

    kind: str
    friction: int
    row: Row
    touching: int = 0
    others: tuple[int, ...] = ()
    null: tuple[Row, ...] = ()


@dataclass(frozen=True)
class EnclosedMode:
    """One mode at exact parameters: its matrix M and guards.

    ``kept`` are the rows that vanish throughout the mode: velocities at rest, gaps of closed rigid contacts and their
    rates. ``edges`` are the rows that are positive on the sides of the mode. ``until`` is the end of the motion.
    ``conditions`` are what must not be negative of the parameters alone.
    """

    mode: GuardedMode
    matrix: tuple[Row, ...]
    guards: tuple[AffineGuard, ...]
    kept: tuple[Row, ...]
    edges: tuple[Row, ...]
    field: ExactEntries
    until: Fraction
    conditions: tuple[Any, ...]

    def require_certain(self) -> None:
        """Raise ``Refused`` where a part of the box may exclude the mode."""
        if any(entry and not certain_sign(self.field.ball(entry)) for entry in self.conditions):
            raise Refused("box: only a part of the box fulfils a condition on the parameters of a mode")

    @cached_property
    def spectrum(self) -> Spectrum:
        """The groups of eigenvalues of M with their residues in balls, which only a mode that is followed needs."""
        return self.field.spectrum(self.matrix, self.until)


class EnclosedSegment:
    """The motion of one mode from an enclosure of its start, with the methods that ``enclosure.first_event`` needs.

    Quantities are sums of functions of time, ``e^{c t} f_k(t)`` for every group of eigenvalues, see ``spectrum``.
    Where rows vanish at the start, the states that are known least are written in terms of the others (``sharpened``).
    Jets are divided by ``e^{growth t}``, the fastest growth of the mode, so that wide balls do not hide their signs.
    Weights of close roots are large and cancel: where a sign is hidden, a Taylor series at the middle is taken as well.
    """

    unstable = False

    def __init__(self, mode: EnclosedMode, state: EnclosedState):
        field, places = state.field, range(len(state.exact))
        self.mode, self.start, self.work = mode, state, len(mode.spectrum) * len(state.family.parts)
        self.places = [place for place, group in enumerate(mode.spectrum) for _ in group.residues]
        units = [tuple(int(i == k) for i in places) for k in places]
        known = field.family([sharpened(unit, state) for unit in units])
        columns = [part * known * state.family * (1 if group.mean.whole[0, 0].imag.is_zero() else 2)
                   for group in mode.spectrum for part in group.residues]
        self.terms = abreast(columns).tight()
        self.bends = [group.bend for group in mode.spectrum]
        roots = [group.mean for group in mode.spectrum]
        growing = [root for root in roots if root.whole[0, 0].real > 0]
        fastest = max(growing, key=lambda root: float(root.whole[0, 0].real.mid()), default=None)
        self.rates, self.slowed, self.fastest = stacked(roots), stacked(roots), roots[0] * 0
        if fastest:
            self.fastest = fastest.linear(real)
            turn = fastest.linear(lambda matrix: flint().acb_mat(matrix.imag) * flint().acb(0, 1))
            self.slowed = stacked([turn if root is fastest else root - self.fastest for root in roots])
        self._known: dict[AffineGuard, Family] = {}
        self._expanded: dict[AffineGuard, tuple[Family, Family]] = {}
        self._begun: dict[AffineGuard, Ball] = {}

    @property
    def growth(self) -> Ball:
        """The fastest growth of the mode, or 0."""
        return self.fastest.whole[0, 0].real

    def _matrix(self, rates):
        """Return the matrix that turns the weights of a quantity, a row, into those of its derivative."""
        size, places = range(len(self.places)), self.places
        return diagonal(self.bends) + rates.linear(
            lambda m: flint().acb_mat([[m[places[i], 0] if i == j else 0 for j in size] for i in size]))

    @cached_property
    def central(self) -> "EnclosedSegment":
        """The motion at the centre of the box alone."""
        found = copy(self)
        for name in ("terms", "rates", "slowed", "fastest"):
            setattr(found, name, getattr(self, name).central)
        found.bends = [bend.central for bend in self.bends]
        found._known, found._expanded = {}, {}
        return found

    def _functions(self, t, rates):
        """Return the functions of time (functions, 1) on a time ball, the exponentials of the rates and the bends."""
        found = (rates * t).exp()
        if len(self.places) == len(self.bends):
            return found
        columns = [(bend * t).exponential().linear(lambda part: flint().acb_mat([row[:1] for row in part.tolist()]))
                   * found.entry(place) if bend.whole.nrows() > 1 else found.entry(place)
                   for place, bend in enumerate(self.bends)]
        return stacked(columns)

    def moment(self, guard: AffineGuard, time: Ball) -> Family:
        """Return the time at which a guard falls through 0, of which ``time`` contains all values on the box.

        Its slopes are those of the guard by the parameters over minus its rates at the centre (Lemma 14).
        """
        if not self.terms.spans:
            return constant(flint().acb_mat([[time]]), ())
        alone, acb_mat, row = self.central, flint().acb_mat, self.start.field.family([guard.row])
        centre = root_in(alone, guard, time.lower().mid(), time.upper().mid())
        for _ in range(NARROWINGS):
            value, rate = alone.jet(guard, time, 1)
            direct = row * self._undivided(constant(acb_mat([[time]]), row.spans)) * (-alone.growth * time).exp()
            parted = (self._weights(guard).linear(_first_row) * self._functions(time, self.slowed)).linear(real)
            slopes = (-part[0, 0].real / (rate - alone.growth * value) for part in parted.common(direct).parts[2:])
            found = Family((acb_mat([[part]]) for part in (time, centre, *slopes)), row.spans).tight()
            time = found.whole[0, 0].real
        return found

    @cached_property
    def _late(self):
        """The derivatives of the states at the centre of the box, of an order at which those of polynomials vanish."""
        rates = self.start.field.family(self.mode.matrix).central.whole
        return rates ** rates.nrows() * self.start.family.central.whole

    def polynomial(self, row: Row, start: EnclosedState) -> list[Any]:
        """Return the exact Taylor coefficients of a quantity that is a polynomial of the time from a state (Lemma 16).

        The list is empty where the quantity is no polynomial in this mode, or is not known exactly.
        """
        size, found = len(row), list[Any]()
        if not (self.start.field.family([row]).central.whole * self._late)[0, 0].contains(0):
            return []
        for order in range(2 * size):
            if any(w is None for c, w in zip(row, start.exact, strict=True) if c):
                return []
            found.append(sum(c * w for c, w in zip(row, start.exact, strict=True) if c) * Fraction(1, factorial(order)))
            row = row_rate(row, self.mode.matrix)
        return [] if any(found[size:]) else found[:size]

    def at(self, guard: AffineGuard | None, t: Family) -> Family:
        """Return the state (n + 1, 1) at a time, at which ``guard`` vanishes if given."""
        found = self._along(self.terms, t)
        if guard:
            found = found.common(self._along(self._without_widest(guard, t), t))
        if found.spans:
            found = found.common(self._undivided(t))
        last = len(self.mode.matrix) - 1
        return stacked([*(found.entry(k) for k in range(last)), constant(flint().acb_mat([[1]]), found.spans)]).tight()

    def _undivided(self, t):
        """Return the state at a time by the exponential of the whole matrix: parts of near eigenvalues may cancel."""
        return (self.start.field.family(self.mode.matrix) * t).exponential() * self.start.family

    def _along(self, weights, t):
        """Return quantities at a time; a time that moves by dt moves them by their rates, summed up first, times dt."""
        functions = self._functions(t.whole[0, 0].real, self.rates)
        found = (weights * functions).linear(real)
        if not t.spans:
            return found
        alone, fixed = self.central, weights.central
        near, centre = (alone._functions(time.whole[0, 0].real, alone.rates) for time in (t, t.central))
        centre, rate = ((row * then).linear(real).whole for row, then in (
            (fixed, centre), (fixed * alone._matrix(alone.rates), near)))
        moved = (slope + rate * dt[0, 0] for slope, dt in zip(found.parts[2:], t.parts[2:], strict=True))
        return Family((found.whole, centre, *moved), t.spans).tight()

    def _without_widest(self, guard, t):
        """Return the weights of the states where a guard vanishes, without the real function that is known least in it.

        The equation of the guard gives this function, as a rule a fast exponential, by the others.
        """
        still = [group.mean.whole[0, 0].imag.is_zero() for group in self.mode.spectrum for _ in group.residues]
        weights = self._weights(guard).linear(_first_row)
        functions = self._functions(t.whole[0, 0].real, self.rates).whole.entries()
        pairs = zip(still, weights.whole.entries(), functions, strict=True)
        shares = [float((w * f).real.rad()) if keeps and not w.contains(0) else 0.0 for keeps, w, f in pairs]
        widest = shares.index(max(shares))
        if not shares[widest] > 0:
            return self.terms
        column = self.terms.linear(lambda part: flint().acb_mat([[row[widest]] for row in part.tolist()]))
        found = self.terms - column * (weights / weights.entry(0, widest))
        return found.linear(lambda part: flint().acb_mat([[0 if k == widest else c for k, c in enumerate(row)]
                                                          for row in part.tolist()]))

    def _weights(self, guard):
        """Return the weights of the jets of a guard: a row for the guard and each of its derivatives."""
        if guard not in self._known:
            row = self.start.field.family([guard.row])
            rows = [((row if self.terms.spans else row.central) * self.terms).tight()]
            for _ in range(max(2, guard.touching + 1)):
                rows.append(rows[-1] * self._matrix(self.rates))
            self._known[guard] = stacked(rows)
        return self._known[guard]

    def _series(self, guard):
        """Return the weights of the Taylor coefficients of the jets of a guard, below the last order and of it."""
        if guard not in self._expanded:
            found, matrix = [self._weights(guard)], self._matrix(self.slowed)
            for order in range(1, _ORDER + 1):
                found.append(found[-1] * matrix * (flint().acb(1) / order))
            self._expanded[guard] = stacked(found[:-1]), found[-1]
        return self._expanded[guard]

    def jet(self, guard: AffineGuard, t: Ball, order: int = 0) -> tuple[Ball, ...]:
        """Return the guard and its first ``order`` derivatives on ``t``, all times one positive factor.

        There are two derivatives, or as many as ``guard.touching``.
        """
        functions = self._functions(t, self.slowed)
        found = (self._weights(guard) * functions).numbers()
        if guard.touching and t.contains(0):
            first, then = found[guard.touching :][:2]
            found[guard.touching] = common(first, self._beginning(guard) + t * (then - self.growth * first))
        if t.is_exact() or all(map(certain_sign, found[: order + 1])):
            return tuple(found[: order + 1])
        terms, rest = self._series(guard)
        powers, rows = [whole_power(t - t.mid(), k) for k in range(_ORDER + 1)], range(len(found))
        chosen = flint().acb_mat([[p if i == j else 0 for p in powers[:-1] for j in rows] for i in rows])
        total = (terms * self._functions(t.mid(), self.slowed)).linear(chosen.__mul__) + rest * functions * powers[-1]
        return tuple(map(common, found[: order + 1], total.numbers()))

    def _beginning(self, guard):
        """Return the first derivative of a guard that does not vanish at the start, from the state itself."""
        if guard not in self._begun:
            row = guard.row
            for _ in range(guard.touching):
                row = row_rate(row, self.mode.matrix)
            self._begun[guard] = common(ball_at(row, self.start), ball_at(sharpened(row, self.start), self.start))
        return self._begun[guard]


def _first_row(matrix):
    return flint().acb_mat(matrix.tolist()[:1])
