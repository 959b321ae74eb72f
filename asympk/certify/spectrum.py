r"""The residues of the resolvent of a matrix in balls: exact entries, or entries that range over intervals.

``of_exact`` isolates the roots of an exact polynomial that vanishes at the matrix and takes the residues there.

``of_balls`` requires that every matrix within the intervals has simple eigenvalues, apart from an eigenvalue 0 whose
multiplicity follows from the zeros of the matrix. Rows and columns without nonzero entries are removed, again and
again; what remains is the core, and Krawczyk's test encloses its eigenpairs (``_enclosed``, the hard function). The
projector of the eigenvalue 0 is the unit matrix less the projectors of all other eigenvalues. The derivatives by the
parameters follow from the equation of the eigenpair (``_moved``).
"""

from itertools import product

import numpy as np

from asympk.affine.polynomial import eigenvalue_polynomial, in_whole_numbers, residues_at, resolvent, taylor
from asympk.certify.balls import Refused, flint
from asympk.certify.families import NARROWINGS, Family, abreast, constant, real, stacked, transposed

_INFLATIONS = 12
Spectrum = tuple[tuple[Family, tuple[Family, ...]], ...]


def of_exact(rows: tuple, spans: tuple, matrix: Family | None = None) -> Spectrum:
    """Return pairs (root, its residues) of a matrix of Fractions, or of one with the same characteristic polynomial.

    Of a complex pair there is the upper root. The residues are the matrices before ``t^k/k! e^{l t}`` in ``e^{M t}``,
    k below the multiplicity.
    """
    whole, denominator = in_whole_numbers(rows)
    if matrix:
        polynomial = eigenvalue_polynomial(whole)
        adjugate = _adjugate(polynomial, matrix * flint().acb(denominator))
    else:
        polynomial, matrices = resolvent(rows).polynomial, resolvent(rows).adjugate
        adjugate = [constant(flint().acb_mat([[int(c) for c in row] for row in m]), spans) for m in matrices]
    coefficients, scale = [flint().acb(c) for c in polynomial], flint().acb(denominator)
    found = []
    for root, many in flint().fmpz_poly(list(polynomial)).complex_roots():
        if not root.imag < 0:
            parts = residues_at(coefficients, taylor(adjugate, root, many), root)
            value = constant(flint().acb_mat([[flint().acb(root.real / denominator, root.imag / denominator)]]), spans)
            found.append((value, tuple((part * (1 / scale**k)).tight() for k, part in enumerate(parts))))
    return tuple(found)


def _adjugate(polynomial, matrix):
    """Return the matrices N_k before z^k in the adjugate of z - M.

    With c_k before z^k in the characteristic polynomial of degree n, N_{n-1} = 1 and N_{k-1} = M N_k + c_k.
    """
    unit = _unit(matrix)
    adjugate = [unit]
    for coefficient in polynomial[-2:0:-1]:
        adjugate.insert(0, matrix * adjugate[0] + unit * flint().acb(coefficient))
    return adjugate


def _unit(matrix):
    places = range(matrix.whole.nrows())
    return constant(flint().acb_mat([[int(i == j) for j in places] for i in places]), matrix.spans)


def of_balls(pattern: np.ndarray, matrix: Family, scaled: Family, scales: Family) -> Spectrum:
    """Return pairs (root, its residues), as ``of_exact``, of a matrix on a box.

    ``pattern`` (n, n) is true where an entry is not exactly 0. ``scaled`` are the rows times ``scales``, without
    fractions: a parameter that divides a row occurs once in them. Raises ``Refused`` where eigenvalues may coincide.
    """
    core, before, after = core_of(pattern)
    rows = _within(scaled, core, core), _within(scales, [0], core)
    rest, found = _unit(matrix), []
    for value, right, left in _eigenpairs(_within(matrix, core, core), *rows):
        column = _extended(matrix, value, dict(zip(core, right, strict=True)), [*before, *after])
        order, across = [*after[::-1], *before[::-1]], matrix.linear(transposed)
        row = _extended(across, value, dict(zip(core, left, strict=True)), order).linear(transposed)
        part = (column * row).tight()
        rest = rest - part
        if not value.whole[0, 0].imag < 0:
            found.append((value, (part,)))
    if powers := _powers(matrix, rest.tight(), pattern, core, [*before, *after]):
        found.append((constant(flint().acb_mat(1, 1), matrix.spans), powers))
    return tuple(found)


def _within(matrix, rows, columns):
    """Return the part of a matrix in some rows and columns."""
    return matrix.linear(lambda part: flint().acb_mat([[part[i, j] for j in columns] for i in rows]))


def seen_in(basis: Family, spectrum: Spectrum, inverse: Family) -> Spectrum:
    """Return the spectrum of M from that of ``T M T^-1``; ``basis`` is T, ``inverse`` is ``T^-1``."""
    return tuple((root, tuple((inverse * part * basis).tight() for part in parts)) for root, parts in spectrum)


def _powers(matrix, part, pattern, core, outside):
    """Return the matrices ``P M^k`` that the pattern does not make vanish, P being the projector of the eigenvalue 0.

    As the core is invertible, states outside the core also drive one another through any chain of states of the core.
    """
    places = range(len(pattern))
    drives = any(pattern[i, j] for i in outside for j in core)
    none = {*product(core if drives else places, core)}  # P is 0 within the core, which is invertible
    part = part.linear(lambda p: flint().acb_mat([[0 if (i, j) in none else p[i, j] for j in places] for i in places]))
    within = np.linalg.matrix_power(pattern[np.ix_(core, core)] | np.eye(len(core), dtype=bool), len(core))
    through = pattern[np.ix_(outside, core)] @ within @ pattern[np.ix_(core, outside)]
    step, linked = pattern[np.ix_(outside, outside)] | through, np.eye(len(outside), dtype=bool)
    found = []
    while linked.any():
        found.append(part)
        part, linked = (part * matrix).tight(), linked @ step
    return tuple(found)


def core_of(pattern: np.ndarray) -> tuple[list[int], list[int], list[int]]:
    """Return the indices of the core, of states that only drive it and of states it only drives, by dependence."""
    left, before, after = set(range(len(pattern))), list[int](), list[int]()
    for found, matrix in ((before, pattern), (after, pattern.T)):
        while empty := [i for i in sorted(left) if not any(matrix[i, j] for j in left)]:
            found += empty
            left -= {*empty}
    return sorted(left), before, after[::-1]


def _eigenpairs(matrix, scaled, scales):
    """Yield (eigenvalue, right eigenvector, left eigenvector) of the core; the product of the vectors is 1."""
    places, parts = range(matrix.whole.nrows()), [*zip(scaled.parts[:2], scales.parts[:2], strict=True)]
    if not places:
        return
    try:
        values, right = matrix.parts[:2][-1].mid().eig(right=True, algorithm="rump")
        heads = [[_enclosed(*part, values[k], right.mid(), k) for part in parts] for k in places]
        stills = [_is_real(heads, k) for k in places]
        pairs = [_moved(scaled, scales, heads[k], _held(right.mid(), k)) for k in places]
        inverse = abreast([vector for _, vector in pairs]).inverse()
    except (ValueError, ZeroDivisionError):
        raise Refused("spectrum: eigenvalues of a mode may meet, or cannot be told apart") from None
    for k, (still, (value, vector)) in enumerate(zip(stills, pairs, strict=True)):
        left = [inverse.entry(k, i) for i in places]
        yield value.linear(real) if still else value, [vector.entry(i) for i in places], left


def _is_real(heads, k):
    """Tell whether an eigenvalue is real on the whole box.

    Raises ``Refused`` where that is not certain, or where it may vanish or meet another, on the box or at its centre.
    """
    value = heads[k][0][0]
    others = [other[0][0] for j, other in enumerate(heads) if j != k]
    still = value.imag.contains(0) and not any(map(value.conjugate().overlaps, others))
    apart = not value.contains(0) and not any(v.overlaps(other) for v, _ in heads[k] for other in others)
    if not apart or not (still or value.imag > 0 or value.imag < 0):
        raise Refused("spectrum: eigenvalues of a mode may meet or vanish in the box")
    return still


def _moved(matrix, scales, heads, held):
    """Return an eigenvalue and its eigenvector with their derivatives.

    The derivatives are those of ``M v = l S v``, S = diag(``scales``), where component ``held`` of v is 1. ``heads``
    are pairs (l, v) on the box and at its centre.
    """
    places, acb_mat = range(matrix.whole.nrows()), flint().acb_mat
    pairs = [(acb_mat([[value]]), vector) for value, vector in heads]
    for _ in matrix.spans and range(NARROWINGS):
        value, vector = pairs[0][0][0, 0], pairs[0][1]
        rates = matrix.whole - acb_mat([[value * s if i == j else 0 for j in places]
                                        for i, s in enumerate(scales.whole.entries())])  # fmt: skip
        for i in places:
            rates[i, held] = -scales.whole[0, i] * vector[i, 0]
        near, slopes = rates.mid().inv().mid(), []
        for change, stretch in zip(matrix.parts[2:], scales.parts[2:], strict=True):
            pull = acb_mat([[value * stretch[0, i] * vector[i, 0]] for i in places]) - change * vector
            slope = (near * rates).solve(near * pull)
            turn, slope[held, 0] = acb_mat([[slope[held, 0]]]), 0
            slopes.append((turn, slope))
        found = [Family(parts, matrix.spans).tight() for parts in zip(*pairs[:2], *slopes, strict=True)]
        pairs = [*zip(*(family.parts for family in found), strict=True)]
    return [Family(parts, matrix.spans) for parts in zip(*pairs, strict=True)]


def _held(vectors, k):
    """Return the place of the largest component of an approximate eigenvector."""
    return max(range(vectors.nrows()), key=lambda i: float(vectors[i, k].abs_upper()))


def _enclosed(matrix, scales, value, vectors, k):
    """Return balls of eigenvalue k and its eigenvector for every matrix within the balls, by Krawczyk's test.

    The equation is ``M v = l S v`` with S = diag(``scales``). The approximate eigenpair of the midpoints changes by dl
    and dv, and the largest component of v is held at 1. The unknown x is dv with dl in the place of the held component,
    and the equation is ``r + B x - dl S dv = 0``. If ``-Y r + (1 - Y B) x + Y dl S dv`` lies in the box x for all
    matrices, x contains a root, and so does this image of x. Raises ``ValueError`` where no such box is found.
    """
    size, acb_mat = matrix.nrows(), flint().acb_mat
    held = _held(vectors, k)
    vector = acb_mat([[(vectors[i, k] / vectors[held, k]).mid()] for i in range(size)])
    unit = acb_mat([[int(i == j) for j in range(size)] for i in range(size)])
    scale = acb_mat([[scales[0, i] if i == j else 0 for j in range(size)] for i in range(size)])
    moved = matrix - scale * value.mid()
    off = moved * vector
    for i in range(size):
        moved[i, held] = -scales[0, i] * vector[i, 0]
    near = moved.mid().inv().mid()
    start, linear = -(near * off), unit - near * moved
    def image_of(box):
        rest = acb_mat(box.tolist())
        rest[held, 0] = 0
        return start + linear * box + near * (scale * rest * box[held, 0])

    box = start
    for _ in range(_INFLATIONS):
        box = _inflated(box)
        image = image_of(box)
        if all(box[i, 0].contains(image[i, 0]) for i in range(size)):
            for _ in range(NARROWINGS):
                image = image_of(image)
            found, value = vector + image, value.mid() + image[held, 0]
            found[held, 0] = 1
            return value, found
        box = image
    raise ValueError("no enclosure")


def _inflated(box):
    """Return a column of balls somewhat larger than the given ones."""
    arb, acb = flint().arb, flint().acb
    tiny = arb(2) ** (-flint().ctx.prec + 16)

    def larger(part):
        return part + arb(0, float((part.abs_upper() * 3 / 2 + tiny).upper()))

    return flint().acb_mat([[acb(larger(box[i, 0].real), larger(box[i, 0].imag))] for i in range(box.nrows())])


def _extended(matrix, value, known, order):
    """Return an eigenvector of the whole matrix from that of its core: ``v_i = sum_j M_ij v_j / l``."""
    for i in order:
        total = constant(flint().acb_mat(1, 1), matrix.spans)
        known[i] = sum((matrix.entry(i, j) * v for j, v in known.items()), total) / value
    return stacked([known[i] for i in range(matrix.whole.nrows())])
