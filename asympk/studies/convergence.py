r"""Convergence of the expansions: their error over the first omitted term, which must tend to 1 as mu -> 0.

A composite expansion of order n, or the slow flow, is compared with the exact flow, both at many digits, in x and z at
the end of the run and in the times of the events. With the value e(n) of order n, the first omitted term is
e(n+1) - e(n), and

    error/(first omitted) - 1 = (second omitted)/(first omitted) + ...,

which is mu times a rational function of L = log(1/mu). The right-hand side tends to 0 monotonically once mu is below
all zeros of its numerator and its denominator as functions of L. Where such a zero lies within the range of mu, the
column ``excess`` changes its sign or has a peak, as the column ``expected`` does, and is not monotone.
"""

from collections.abc import Iterable, Iterator
from itertools import groupby, pairwise

from asympk.methods import solve
from asympk.scene import Scene
from asympk.storage.rows import KEPT, StoredRows, in_kept_digits

SIGMAS = ("-17/10", "-6/5", "-1/2", "1/2", "1", "3")
MUS = tuple(f"1e-{k}" for k in range(2, 13))
UNTIL = 3
ORDERS = (0, 1, 2)
DIGITS = 80
# expansion -> (model, a start within its domain, the signs of sigma for which it exists)
EXPANSIONS: dict[str, tuple[str, tuple, str]] = {
    "z < 0, s > 0": ("jump", (0, "1/5", -1), "-+"),
    "z < 0, s < 0": ("jump", ("1/3", -1, "-3/2"), "-+"),
    "z > 0, s < -1/sigma": ("jump", (0, -3, 1), "+"),
    "z > 0, s < 0": ("jump", ("-1/2", "3/10", "3/4"), "-+"),
    "slow, Pi1": ("slow", ("-1/2", 1, "3/4"), "-+"),
    "slow, Pi2": ("slow", (0, "1/5", -1), "-"),
}


def rows(sigmas: Iterable[str] = SIGMAS, mus: Iterable[str] = MUS) -> StoredRows:
    """Return the rows by expansion, sigma, order and quantity, in order of decreasing mu.

    A row has the error of one quantity at one order, beside the first term that the order omits. ``quantity`` is x, z,
    or tk, the time of the k-th event. ``excess`` is error/omitted - 1, computed before rounding, and ``expected`` the
    second omitted term over the first. ``sigma`` is a string, and thus exact.
    """
    starts = {name: list(map(str, start)) for name, (_, start, _) in EXPANSIONS.items()}
    settings = {"starts": starts, "until": UNTIL, "digits": DIGITS, "kept": KEPT, "reference": "exact flow"}
    found = StoredRows(provenance=settings)
    for name, (_, _, signs) in EXPANSIONS.items():
        for sigma in (sigma for sigma in sigmas if ("-" if sigma.startswith("-") else "+") in signs):
            here = [row for mu in mus for row in _rows(name, sigma, mu)]
            found += sorted(here, key=lambda row: (row["order"], row["quantity"], -row["mu"]))
    return found


def monotone_from(group: list[dict]) -> float:
    """Return the largest mu below which the modulus of ``excess`` only falls, from rows of one quantity."""
    sizes = [abs(row["excess"]) for row in group]
    broken = [k + 1 for k, (before, after) in enumerate(pairwise(sizes)) if not after < before]
    return group[broken[-1] if broken else 0]["mu"]


def by_quantity(rows: Iterable[dict]) -> Iterator[list[dict]]:
    """Yield lists of the rows, as dictionaries, that have the same expansion, sigma, order and quantity."""
    names = ("expansion", "sigma", "order", "quantity")
    for _, group in groupby(rows, key=lambda row: [row[name] for name in names]):
        yield list(group)


def _rows(name, sigma, mu):
    method, start, _ = EXPANSIONS[name]
    scene = Scene(sigma, mu, start, UNTIL)
    truth = _quantities(solve(scene, digits=DIGITS))
    levels = sorted({n + k for n in ORDERS for k in range(3)})
    found = {n: _quantities(solve(scene, method, order=n, digits=DIGITS)) for n in levels}
    for n in ORDERS:
        for quantity in found[n]:
            now, next_, last = (found[n + k][quantity] for k in range(3))
            error, omitted = truth[quantity] - now, next_ - now
            numbers = {"error": error, "omitted": omitted, "excess": error / omitted - 1,
                       "expected": (last - next_) / omitted}
            place = {"expansion": name, "sigma": sigma, "order": n, "quantity": quantity, "mu": float(mu)}
            yield place | in_kept_digits(numbers)


def _quantities(path):
    x, _, z = path.final
    return {"x": x, "z": z, **{f"t{k}": event.t for k, event in enumerate(path.events, 1)}}
