r"""Convergence of the jump map: its error over the first omitted term, which must tend to 1 as mu -> 0.

From a start in z < 0 the composite of order n and the exact flow, both at many digits, are compared at the end of the
run, in the larger of the errors of x and z; the first omitted term is what order n + 1 adds there.
"""

from dataclasses import dataclass

from asympk.errors import OutOfRange
from asympk.methods import solve
from asympk.scene import Scene
from asympk.storage.rows import provenance, write_rows

SIGMAS = ("-17/10", "-6/5", "-1/2", "1/2", "1", "3")
MUS = tuple(f"1e-{k}" for k in range(1, 9))
START, UNTIL = (0, "1/5", -1), 3
ORDERS = (0, 1)
DIGITS = 40


@dataclass(frozen=True)
class Row:
    """Error and first omitted term of one order at one sigma and mu; ``sigma`` is kept as a word, exact."""

    sigma: str
    order: int
    mu: float
    error: float
    omitted: float


def rows(sigmas=SIGMAS, mus=MUS, orders=ORDERS):
    """Return the rows of every sigma, order and mu at which the expansion says that it holds."""
    found = []
    for sigma in sigmas:
        for mu in mus:
            scene = Scene(sigma, mu, START, UNTIL)
            truth = solve(scene, digits=DIGITS).final
            found += [row for order in orders if (row := _row(scene, sigma, order, truth))]
    return found


def write(out):
    """Compute all rows and write them to ``out``/convergence.csv; return the file."""
    path = out / "convergence.csv"
    story = provenance(start=list(map(str, START)), until=UNTIL, digits=DIGITS, reference="exact flow")
    write_rows(path, rows(), story)
    return path


def _row(scene, sigma, order, truth):
    try:
        kept, finer = (solve(scene, "jump", order=n, digits=DIGITS).final for n in (order, order + 1))
    except OutOfRange:
        return None
    return Row(sigma, order, float(scene.mu), _apart(kept, truth), _apart(kept, finer))


def _apart(first, second):
    return float(max(abs(a - b) for a, b in zip(first[::2], second[::2], strict=True)))
