r"""The residues of the resolvent of a matrix in balls: exact entries, or entries that range over intervals.

``of_exact`` isolates the roots of an exact polynomial that vanishes at the matrix and takes the residues there.

``of_balls`` requires that every matrix within the intervals has simple eigenvalues, apart from an eigenvalue 0 whose
multiplicity follows from the zeros of the matrix. Rows and columns without nonzero entries are removed, again and
again; what remains is the core, and Krawczyk's test encloses its eigenpairs (``_enclosed``, the hard function). The
projector of the eigenvalue 0 is the unit matrix less the projectors of all other eigenvalues.
"""

from itertools import product

import numpy as np

from asympk.affine.polynomial import eigenvalue_polynomial, in_whole_numbers, residues_at, resolvent, taylor
from asympk.certify.balls import Refused, flint

_INFLATIONS, _NARROWINGS = 12, 3
Spectrum = tuple[tuple, tuple]


def of_exact(rows: tuple, balls: list | None = None) -> Spectrum:
    """Return (roots, residues) of a matrix of Fractions in balls.

    A root is (real part, imaginary part, multiplicity), the upper one of a complex pair. Its residues are the matrices
    before ``t^k/k! e^{l t}`` in ``e^{M t}``, k below the multiplicity. ``balls``, if given, are the entries of another
    matrix with the same characteristic polynomial, whose residues are returned instead.
    """
    whole, denominator = in_whole_numbers(rows)
    if balls is None:
        polynomial, adjugate = resolvent(rows).polynomial, _exact_adjugate(resolvent(rows))
    else:
        polynomial = eigenvalue_polynomial(whole)
        adjugate = _adjugate(polynomial, denominator, balls)
    coefficients, scale = [flint().acb(c) for c in polynomial], flint().acb(denominator)
    roots, residues = [], []
    for root, many in flint().fmpz_poly(list(polynomial)).complex_roots():
        if root.imag < 0:
            continue
        roots.append((root.real / denominator, root.imag / denominator, many))
        parts = residues_at(coefficients, taylor(adjugate, root, many), root)
        residues.append(tuple(part * (1 / scale**k) for k, part in enumerate(parts)))
    return tuple(roots), tuple(residues)


def _exact_adjugate(found):
    acb, acb_mat = flint().acb, flint().acb_mat
    return [acb_mat([[acb(int(c)) for c in row] for row in matrix]) for matrix in found.adjugate]


def _adjugate(polynomial, denominator, balls):
    """Return the matrices N_k before z^k in the adjugate of z - M, for M times its denominator.

    With c_k before z^k in the characteristic polynomial of degree n, N_{n-1} = 1 and N_{k-1} = M N_k + c_k.
    """
    acb, acb_mat = flint().acb, flint().acb_mat
    matrix = acb_mat([[acb(entry) for entry in row] for row in balls]) * acb(denominator)
    unit = acb_mat([[int(i == j) for j in range(len(balls))] for i in range(len(balls))])
    adjugate = [unit]
    for coefficient in polynomial[-2:0:-1]:
        adjugate.insert(0, matrix * adjugate[0] + unit * acb(coefficient))
    return adjugate


def of_balls(pattern: np.ndarray, balls: list, scaled: list, scales: list) -> Spectrum:
    """Return (roots, residues), as ``of_exact``, that enclose those of every matrix within rows of balls.

    ``pattern`` (n, n) is true where an entry is not exactly 0. ``scaled`` are the rows times ``scales``, without
    fractions: a parameter that divides a row occurs once in them. Raises ``Refused`` where eigenvalues may coincide.
    """
    acb, acb_mat = flint().acb, flint().acb_mat
    core, before, after = core_of(pattern)
    matrix = acb_mat([[acb(entry) for entry in row] for row in balls])
    rows = acb_mat([[acb(scaled[i][j]) for j in core] for i in core]), [acb(scales[i]) for i in core]
    rest = acb_mat([[int(i == j) for j in range(len(balls))] for i in range(len(balls))])
    roots, residues = [], []
    for value, right, left in _eigenpairs(matrix, core, *rows):
        column = _extended(matrix, value, dict(zip(core, right, strict=True)), [*before, *after])
        row = _extended(matrix.transpose(), value, dict(zip(core, left, strict=True)), [*after[::-1], *before[::-1]])
        part = acb_mat([[c * r for r in row] for c in column])
        rest = rest - part
        if not value.imag < 0:
            real = value.imag.contains(0)
            roots.append((value.real, flint().arb(0) if real else value.imag, 1))
            residues.append((part,))
    if powers := _powers(matrix, rest, pattern, core, [*before, *after]):
        roots.append((flint().arb(0), flint().arb(0), len(powers)))
        residues.append(powers)
    return tuple(roots), tuple(residues)


def seen_in(basis: list, spectrum: Spectrum, inverse: list) -> Spectrum:
    """Return the spectrum of M from that of ``T M T^-1``; ``basis`` is T in balls, ``inverse`` is ``T^-1``."""
    before, after = (flint().acb_mat([[flint().acb(entry) for entry in row] for row in m]) for m in (inverse, basis))
    roots, residues = spectrum
    return roots, tuple(tuple(before * part * after for part in parts) for parts in residues)


def _powers(matrix, part, pattern, core, outside):
    """Return the matrices ``P M^k`` that the pattern does not make vanish, P being the projector of the eigenvalue 0.

    As the core is invertible, states outside the core also drive one another through any chain of states of the core.
    """
    drives = any(pattern[i, j] for i in outside for j in core)
    for i, j in product(core if drives else range(len(pattern)), core):  # P is 0 within the core, which is invertible
        part[i, j] = 0
    within = np.linalg.matrix_power(pattern[np.ix_(core, core)] | np.eye(len(core), dtype=bool), len(core))
    through = pattern[np.ix_(outside, core)] @ within @ pattern[np.ix_(core, outside)]
    step, linked = pattern[np.ix_(outside, outside)] | through, np.eye(len(outside), dtype=bool)
    found = []
    while linked.any():
        found.append(part)
        part, linked = part * matrix, linked @ step
    return tuple(found)


def core_of(pattern: np.ndarray) -> tuple[list[int], list[int], list[int]]:
    """Return the indices of the core, of states that only drive it and of states it only drives, by dependence."""
    left, before, after = set(range(len(pattern))), list[int](), list[int]()
    for found, matrix in ((before, pattern), (after, pattern.T)):
        while empty := [i for i in sorted(left) if not any(matrix[i, j] for j in left)]:
            found += empty
            left -= {*empty}
    return sorted(left), before, after[::-1]


def _eigenpairs(matrix, core, scaled, scales):
    """Yield (eigenvalue, right eigenvector, left eigenvector) of the core; the product of the vectors is 1."""
    if not core:
        return
    part = flint().acb_mat([[matrix[i, j] for j in core] for i in core])
    try:
        values, right = part.mid().eig(right=True, algorithm="rump")
        pairs = [_enclosed(scaled, scales, value, right.mid(), k) for k, value in enumerate(values)]
        inverse = flint().acb_mat([list(column) for column in zip(*(v for _, v in pairs), strict=True)]).inv()
    except (ValueError, ZeroDivisionError):
        raise Refused("spectrum: eigenvalues of a mode may meet, or cannot be told apart") from None
    for k, (value, vector) in enumerate(pairs):
        others = [other for j, (other, _) in enumerate(pairs) if j != k]
        mirror = flint().acb(value.real, -value.imag)
        real = value.imag.contains(0) and not any(mirror.overlaps(other) for other in others)
        if value.contains(0) or any(map(value.overlaps, others)) or not (real or value.imag > 0 or value.imag < 0):
            raise Refused("spectrum: eigenvalues of a mode may meet or vanish in the box")
        yield value, vector, [inverse[k, i] for i in range(len(core))]


def _enclosed(matrix, scales, value, vectors, k):
    """Return balls of eigenvalue k and its eigenvector for every matrix within the balls, by Krawczyk's test.

    The equation is ``M v = l S v`` with S = diag(``scales``). The approximate eigenpair of the midpoints changes by dl
    and dv, and the largest component of v is held at 1. The unknown x is dv with dl in the place of the held component,
    and the equation is ``r + B x - dl S dv = 0``. If ``-Y r + (1 - Y B) x + Y dl S dv`` lies in the box x for all
    matrices, x contains a root, and so does this image of x. Raises ``ValueError`` where no such box is found.
    """
    size, acb_mat = matrix.nrows(), flint().acb_mat
    held = max(range(size), key=lambda i: float(vectors[i, k].abs_upper()))
    vector = acb_mat([[(vectors[i, k] / vectors[held, k]).mid()] for i in range(size)])
    unit = acb_mat([[int(i == j) for j in range(size)] for i in range(size)])
    scale = acb_mat([[scales[i] if i == j else 0 for j in range(size)] for i in range(size)])
    moved = matrix - scale * value.mid()
    off = moved * vector
    for i in range(size):
        moved[i, held] = -scales[i] * vector[i, 0]
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
            for _ in range(_NARROWINGS):
                image = image_of(image)
            found, value = vector + image, value.mid() + image[held, 0]
            found[held, 0] = 1
            return value, [found[i, 0] for i in range(size)]
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
    size = matrix.nrows()
    for i in order:
        known[i] = sum((matrix[i, j] * v for j, v in known.items()), flint().acb(0)) / value
    return [known[i] for i in range(size)]
