r"""Matrices of balls that depend on the parameters of a box.

By Lemma 14 ``A(p) = A(c) + sum_i A_i (p_i - c_i)`` for every point p of a box with the centre c; the slopes A_i are
some matrices within balls. So A keeps its dependence on p, which balls of the whole box lose wherever p occurs twice;
what is lost here is of second order in the size of the box. Slopes are half as wide as derivatives on the box: in
``A(p) B(p) - A(c) B(c) = (A(p) - A(c)) B(c) + A(p) (B(p) - B(c))`` the factor B(c) is that of the centre.
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import accumulate, product
from typing import Any

from asympk.certify.balls import Ball, common, flint

NARROWINGS = 3  # of slopes: narrower values give narrower slopes, and these narrower values
Matrix = Any  # a flint.acb_mat
Parts = tuple[Any, ...]


class Family:
    """The matrix A(p) of every point p of a box, with the arithmetic of A and its slopes.

    ``parts`` are A on the box and, unless no parameter ranges, A at the centre and the slopes of A, one for each of
    ``spans``, the balls of ``p_i - c_i``. A matrix of one entry multiplies and divides as a number does.
    """

    def __init__(self, parts: Iterable[Matrix], spans: Parts):
        self.parts, self.spans = tuple(parts), spans

    @property
    def whole(self) -> Matrix:
        """The matrices of all points of the box."""
        return self.parts[0]

    @property
    def central(self) -> "Family":
        """The matrix of the centre of the box alone."""
        return Family(self.parts[1:2] or self.parts, ())

    def linear(self, change: Callable[[Matrix], Matrix]) -> "Family":
        """Return a linear function of the matrix."""
        return Family(map(change, self.parts), self.spans)

    def entry(self, row: int, column: int = 0) -> "Family":
        """Return one entry, as a matrix."""
        return self.linear(lambda part: flint().acb_mat([[part[row, column]]]))

    def __add__(self, other: "Family") -> "Family":
        return Family((a + b for a, b in zip(self.parts, other.parts, strict=True)), self.spans)

    def __sub__(self, other: "Family") -> "Family":
        return self + other * -1

    def __mul__(self, other: Any) -> "Family":
        if not isinstance(other, Family):
            return self.linear(lambda part: part * other)
        heads = (_product(a, b) for a, b in zip(self.parts[:2], other.parts[:2], strict=True))
        pairs = zip(self.parts[2:], other.parts[2:], strict=True)
        slopes = (_product(a, other.parts[1]) + _product(self.whole, b) for a, b in pairs)
        return Family((*heads, *slopes), self.spans)

    def __truediv__(self, other: "Family") -> "Family":
        whole, *rest = (1 / part[0, 0] for part in other.parts[:2])
        return self * Family([flint().acb_mat([[part]]) for part in (
            whole, *rest, *(-slope[0, 0] * whole * rest[0] for slope in other.parts[2:]))], self.spans)

    def inverse(self) -> "Family":
        """Return the inverse matrix."""
        found = Family([part.inv() for part in self.parts[:2]] + [part * 0 for part in self.parts[2:]], self.spans)
        for _ in self.spans and range(NARROWINGS):
            whole, centre = found.parts[:2]
            found = Family((whole, centre, *(whole * s * centre * -1 for s in self.parts[2:])), self.spans).tight()
        return found

    def exp(self) -> "Family":
        """Return the exponentials of the entries; ``e^a - e^c`` is ``a - c`` times the mean of e^z between c and a."""
        heads = [each(lambda a: a.exp(), part) for part in self.parts[:2]]
        mean = each(_mean_exponential, *self.parts[:2], *heads) if self.spans else None
        return Family((*heads, *(each(lambda a, b: a * b, mean, s) for s in self.parts[2:])), self.spans)

    def exponential(self) -> "Family":
        """Return the exponential of the matrix."""
        heads = [part.exp() for part in self.parts[:2]]
        slopes = (_slope_of_exponential(self.whole, self.parts[1], slope) for slope in self.parts[2:])
        return Family((*heads, *slopes), self.spans)

    def tight(self) -> "Family":
        """Return the same family, on the box as narrow as its slopes make it."""
        if not self.spans:
            return self
        moves = (slope * span for slope, span in zip(self.parts[2:], self.spans, strict=True))
        return Family((shared(self.whole, sum(moves, self.parts[1])), *self.parts[1:]), self.spans)

    def common(self, other: "Family") -> "Family":
        """Return what two enclosures of a real column have in common; the slopes, which are not unique, are of one."""
        pairs = list(zip(self.parts, other.parts, strict=True))
        sizes = zip(*(family.tight().whole.real.entries() for family in (self, other)), strict=True)
        kept = [mine.rad() < its.rad() for mine, its in sizes]
        slopes = (flint().acb_mat([a if mine else b for a, b, mine in zip(p.tolist(), q.tolist(), kept, strict=True)])
                  for p, q in pairs[2:])
        return Family((*(shared(*pair) for pair in pairs[:2]), *slopes), self.spans)

    def numbers(self) -> list[Ball]:
        """Return the real parts of the entries on the box."""
        return self.tight().whole.real.entries()


def constant(matrix: Matrix, spans: Parts) -> Family:
    """Return a matrix that does not depend on the parameters."""
    return Family((matrix, matrix, *(matrix * 0 for _ in spans)) if spans else (matrix,), spans)


def unit(matrix: Family) -> Family:
    """Return the unit matrix of the size of a square matrix."""
    places = range(matrix.whole.nrows())
    return constant(flint().acb_mat([[int(i == j) for j in places] for i in places]), matrix.spans)


def diagonal(blocks: Sequence[Family]) -> Family:
    """Return the matrix with square blocks on its diagonal."""
    firsts = [0, *accumulate(block.whole.nrows() for block in blocks)]

    def joined(parts):
        found = flint().acb_mat(firsts[-1], firsts[-1])
        for first, part in zip(firsts, parts, strict=False):
            for i, j in product(range(part.nrows()), repeat=2):
                found[first + i, first + j] = part[i, j]
        return found

    return Family(map(joined, zip(*(block.parts for block in blocks), strict=True)), blocks[0].spans)


def stacked(blocks: Sequence[Family]) -> Family:
    """Return the matrix of some matrices, one above the other."""
    parts = zip(*(block.parts for block in blocks), strict=True)
    return Family((flint().acb_mat([row for m in found for row in m.tolist()]) for found in parts), blocks[0].spans)


def abreast(columns: Sequence[Family]) -> Family:
    """Return the matrix of some columns."""
    return stacked([column.linear(transposed) for column in columns]).linear(transposed)


def transposed(matrix: Matrix) -> Matrix:
    """Return the transpose of a matrix."""
    return matrix.transpose()


def real(matrix: Matrix) -> Matrix:
    """Return the real part of a matrix."""
    return flint().acb_mat(matrix.real)


def each(function: Callable, *matrices: Matrix) -> Matrix:
    """Return the matrix of a function of the entries of matrices."""
    entries = [function(*found) for found in zip(*(m.entries() for m in matrices), strict=True)]
    return flint().acb_mat(matrices[0].nrows(), matrices[0].ncols(), entries)


def shared(first: Matrix, second: Matrix) -> Matrix:
    """Return the intersection of two enclosures of one matrix; raises ``Refused`` if there is none."""
    return each(lambda a, b: flint().acb(common(a.real, b.real), common(a.imag, b.imag)), first, second)


def _slope_of_exponential(whole, centre, slope):
    """Return the slope of an exponential: above the diagonal in that of [[A, A_i], [0, A(c)]]."""
    size = whole.nrows()
    upper = [[*a, *b] for a, b in zip(whole.tolist(), slope.tolist(), strict=True)]
    lower = [[*[0] * size, *a] for a in centre.tolist()]
    return flint().acb_mat([row[size:] for row in flint().acb_mat(upper + lower).exp().tolist()[:size]])


def _mean_exponential(at, centre, whole, central):
    """Return the mean of e^z along the line from ``centre`` to ``at``, given the exponentials of both."""
    away, rising = at - centre, flint().arb(0).union(flint().arb(1))
    found = central * (1 + away * (away * rising).exp() / 2)
    return flint().acb(common(whole.real, found.real), common(whole.imag, found.imag))


def _product(first, second):
    """Return a product of matrices; a matrix of one entry is a number."""
    if second.nrows() == second.ncols() == 1:
        return first * second[0, 0]
    return first[0, 0] * second if first.nrows() == first.ncols() == 1 else first * second
