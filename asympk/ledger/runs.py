"""The numeric evidence: runs of 40 digits for decreasing mu, and whether ratios tend to 1 or a residual vanishes."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import sympy as sp

from asympk.methods import solve
from asympk.multiprecision import in_context, private_context
from asympk.numbers import Number
from asympk.path import Event, Path
from asympk.scene import Scene
from asympk.symbolic.lowering import lower
from asympk.symbolic.manifold import SlowManifold
from asympk.systems import painleve_klein as pk

DIGITS = 40
M = private_context(DIGITS + 10)  # ten digits to spare; nothing changes its precision
MUS = tuple(Fraction(1, 10**n) for n in (3, 5, 7, 9))


def precise_path(
    start: Sequence[Number | str], mu: Number, until: Number = 1, sigma: Number = 1, sigma0: Number | None = None
) -> Path:
    """Follow the rod to 40 digits; the numbers given are exact (integers, fractions or strings)."""
    return followed_precisely(Scene(sigma=sigma, mu=mu, start=start, until=until, sigma0=sigma0))


def followed_precisely(scene: Scene) -> Path:
    """Follow a scene to 40 digits, in numbers of ``M``."""
    path = solve(scene, digits=DIGITS)
    events = tuple(event._replace(t=M.mpf(event.t), state=_numbers(event.state)) for event in path.events)
    return replace(path, final=_numbers(path.final), events=events, at=lambda t: _numbers(path(t)))


def _numbers(values):
    return tuple(map(M.mpf, values))


def escape_time(offset: Number, mu: Number) -> Number:
    """Return the time at which a run at sigma = 1, from z = 1 and ``offset`` off the plane Pi2, meets x + y = 0."""
    return followed_precisely(Scene.near("Pi2", x=0, offset=offset, z=1, sigma=1, mu=mu, until=1)).events[0].t


def trend(
    measure: Callable[[Fraction], Number], predicted: Callable[[Fraction], Number], mus: Iterable[Fraction] = MUS
) -> tuple[bool, str]:
    """Return ``tends_to_one`` of measure(mu) / predicted(mu) for falling mu."""
    return tends_to_one([precise(measure(mu)) / precise(predicted(mu)) for mu in mus])


def in_mu(first: Number, with_log: Number = 0) -> Callable[[Fraction], Number]:
    """Return ``first`` mu + ``with_log`` mu log(1/mu) as a function of mu, for ``trend``."""
    return lambda mu: precise(mu) * (precise(first) + precise(with_log) * -M.log(precise(mu)))


def approaches(plane: SlowManifold, sigma: Number, state: Callable[[Fraction], Sequence[Number]]) -> tuple[bool, str]:
    """Return the ``trend`` of a distance in s of ``state(mu)`` from a slow plane at mu = 0 to its term of order mu."""
    level, first = (expr.subs(pk.sigma, sigma) for expr in (pk.x + plane.coefficient(0), plane.coefficient(1)))

    def predicted(mu):
        return precise(mu) * value_at(first, {pk.x: state(mu)[0]})

    return trend(lambda mu: state(mu)[0] + state(mu)[1] - precise(sp.cancel(level)), predicted)


def precise(value: Number) -> Number:
    """Return a fraction, a SymPy number or an mpf as a number of ``M``."""
    return M.mpf(value.evalf(M.dps)._mpf_) if hasattr(value, "evalf") else in_context(M, value)


def value_at(expr: sp.Expr, values: Mapping[sp.Symbol, Number]) -> Number:
    """Return an expression at ``values`` {symbol: number} as a number of ``M``."""
    here = sorted(expr.free_symbols, key=str)
    return M.mpf(lower(here, expr, "mpmath").to_digits(M.dps, *(precise(values[s]) for s in here))[0])


def modes(start: Sequence[Number | str], sigma: Number = 1, until: Number = 1) -> list[tuple[str, ...]]:
    """Return the mode sequences of the runs for decreasing mu, each once, in order of appearance."""
    return list(dict.fromkeys(precise_path(start, mu, until, sigma).modes for mu in MUS))


def event_of(path: Path, kind: str) -> Event:
    """Return the first event of one kind on a path."""
    return next(event for event in path.events if event.kind == kind)


def listing(sequences: Iterable[tuple[str, ...]]) -> str:
    """Return mode sequences as text for the evidence."""
    return "; ".join(" > ".join(sequence) for sequence in sequences)


def decimals(numbers: Iterable[Number]) -> str:
    """Return numbers with four decimal places as text for the evidence."""
    return ", ".join(f"{float(number):.4f}" for number in numbers)


def negligible(residual: Number) -> tuple[bool, str]:
    """Return (whether a residual, computed to more digits, is zero to ``DIGITS`` digits; the words for it)."""
    return bool(abs(residual) < 10**-DIGITS), f"zero to {DIGITS} digits"


def tends_to_one(ratios: Sequence[Number]) -> tuple[bool, str]:
    """Return (whether ratios, for mu falling by a constant factor, tend to 1; the ratios as text).

    Each deviation from 1 must be at most a tenth of the one before, and the first already below 1.
    """
    deviations = [abs(ratio - 1) for ratio in ratios]
    falls = all(10 * later <= earlier for earlier, later in pairwise(deviations))
    return bool(deviations[0] < 1 and falls), ", ".join(f"1{_signed(ratio - 1)}" for ratio in ratios)


def _signed(deviation):
    return f"{float(deviation):+.2e}" if deviation else ""
