r"""The residues of the resolvent of a matrix in balls: exact entries, or entries that range over intervals.

``of_exact`` isolates the roots of an exact polynomial that vanishes at the matrix and takes the residues there.

``of_balls`` gathers eigenvalues that may meet on a box into groups: eigenvalues that meet have no slopes there, but
their invariant subspace has (Lemma 15). Rows and columns without nonzero entries are removed, again and
again; what remains is the core, and Krawczyk's test encloses its invariant subspaces (``_enclosed``, the hard
function). The projector of the eigenvalue 0 is the unit matrix less the projectors of all other groups. The
slopes by the parameters follow from the equation of the subspace (``_moved``).
"""

from contextlib import suppress
from itertools import accumulate, pairwise, product
from math import inf
from typing import NamedTuple

import numpy as np

from asympk.affine.polynomial import residues_at, resolvent, taylor
from asympk.certify.balls import Ball, Refused, flint
from asympk.certify.families import NARROWINGS, Family, abreast, constant, diagonal, stacked, transposed, unit

_INFLATIONS, _SWEEPS = 12, 3
_PARTED = 8  # the distance times the end of the motion, more than a turn, from which eigenvalues are followed apart


class EigenvalueGroup(NamedTuple):
    """Eigenvalues that are followed together, by their mean c, and the residues R_k.

    Their part of ``e^{M t}`` is the sum of ``e^{c t} f_k(t) R_k``, where f is the first column of ``e^{C t}``; C is the
    companion matrix ``bend``. For one eigenvalue of multiplicity m, ``f_k = t^k/k!``.
    """

    mean: Family
    bend: Family
    residues: tuple[Family, ...]


Spectrum = tuple[EigenvalueGroup, ...]


def of_exact(rows: tuple, spans: tuple) -> Spectrum:
    """Return the groups of a matrix of Fractions, one for each eigenvalue; of a complex pair there is the upper one."""
    parts, acb, acb_mat = resolvent(rows), flint().acb, flint().acb_mat
    adjugate = [constant(acb_mat([[int(c) for c in row] for row in matrix]), spans) for matrix in parts.adjugate]
    coefficients, scale = [acb(c) for c in parts.polynomial], acb(parts.denominator)
    found = []
    for root, many in flint().fmpz_poly(list(parts.polynomial)).complex_roots():
        if not root.imag < 0:
            residues = residues_at(coefficients, taylor(adjugate, root, many), root)
            mean = constant(acb_mat([[acb(root.real / parts.denominator, root.imag / parts.denominator)]]), spans)
            scaled = tuple((part * (1 / scale**k)).tight() for k, part in enumerate(residues))
            found.append(EigenvalueGroup(mean, _companion([mean * 0] * many), scaled))
    return tuple(found)


def of_balls(pattern: np.ndarray, until: Ball, matrix: Family, scaled: Family, scales: Family) -> Spectrum:
    """Return the groups, as ``of_exact``, of a matrix on a box, for times up to ``until``.

    ``pattern`` (n, n) is true where an entry is not exactly 0. ``scaled`` are the rows times ``scales``, without
    fractions: a parameter that divides a row occurs once in them. Eigenvalues that may vanish are in the group of 0.
    """
    core, before, after = core_of(pattern)
    rows = _within(scaled, core, core), _within(scales, [0], core)
    rest, found, vanishing = unit(matrix), list[EigenvalueGroup](), list[Family]()
    for right, block, left in _subspaces(_within(matrix, core, core), *rows, until):
        try:
            back = block.inverse()
        except ZeroDivisionError:
            vanishing += [block] if _is_real(block) else [block, block.linear(_conjugate)]
            continue
        columns = _extended(matrix, back, dict(zip(core, _rows(right), strict=True)), [*before, *after])
        across, begun = matrix.linear(transposed), _rows(left.linear(transposed))
        known = dict(zip(core, begun, strict=True))
        row = _extended(across, back.linear(transposed), known, [*after[::-1], *before[::-1]]).linear(transposed)
        part = (columns * row).tight()
        rest = rest - (part if _is_real(block) else part + part.linear(_conjugate))
        found.append(_group(block, columns, row))
    return (*found, *_group_of_zero(matrix, rest.tight(), pattern, core, [*before, *after], vanishing))


def _within(matrix, rows, columns):
    """Return the part of a matrix in some rows and columns."""
    return matrix.linear(lambda part: flint().acb_mat([[part[i, j] for j in columns] for i in rows]))


def _rows(matrix):
    return [_within(matrix, [i], range(matrix.whole.ncols())) for i in range(matrix.whole.nrows())]


def _conjugate(matrix):
    """Return the conjugate of a matrix; that of python-flint is transposed, too."""
    return flint().acb_mat(matrix.nrows(), matrix.ncols(), [entry.conjugate() for entry in matrix.entries()])


def _is_real(matrix):
    return all(entry.imag.is_zero() for entry in matrix.whole.entries())


def seen_in(basis: Family, spectrum: Spectrum, inverse: Family) -> Spectrum:
    """Return the spectrum of M from that of ``T M T^-1``; ``basis`` is T, ``inverse`` is ``T^-1``."""
    return tuple(group._replace(residues=tuple((inverse * part * basis).tight() for part in group.residues))
                 for group in spectrum)


def _group(block, right, left):
    """Return the group of a block B with ``M V = V B`` and ``U V = 1``; the residues are ``V ((B - c)/s)^k U``.

    By Cayley and Hamilton ``e^{(B - c) t}`` is a polynomial in ``(B - c)/s`` of a degree below that of its
    characteristic polynomial; the first column of ``e^{C t}`` are the coefficients. s is the size of the eigenvalues.
    """
    size, acb = block.whole.nrows(), flint().acb
    mean = block.linear(lambda part: flint().acb_mat([[part.trace() / size]]))
    away = block - unit(block) * mean
    polynomial = [*_characteristic(away)[:-1], mean * 0]
    scale = max(float(c.whole[0, 0].abs_upper()) ** (1 / (size - k)) for k, c in enumerate(polynomial)) or 1
    columns = [right]
    for _ in range(1, size):
        columns.append((columns[-1] * away * (1 / acb(scale))).tight())
    residues = tuple((column * left).tight() for column in columns)
    return EigenvalueGroup(mean.tight(), _companion(polynomial, scale), residues)


def _characteristic(matrix):
    """Return the coefficients of a characteristic polynomial, lowest first, but the 1 before ``z^n`` (Le Verrier)."""
    found, power = list[Family](), matrix
    for k in range(1, matrix.whole.nrows() + 1):
        found.insert(0, power.linear(lambda part, k=k: flint().acb_mat([[-part.trace() / k]])).tight())
        power = (matrix * (power + unit(matrix) * found[0])).tight()
    return found


def _companion(polynomial, scale=1):
    """Return the matrix of the multiplication by z of polynomials in ``z/scale`` modulo a polynomial in z."""
    size, acb = len(polynomial), flint().acb
    last = stacked([c * (-1 / acb(scale) ** (size - 1 - k)) for k, c in enumerate(polynomial)])
    below = flint().acb_mat([[scale if i == j + 1 else 0 for j in range(size - 1)] for i in range(size)])
    return abreast([constant(below, last.spans), last]) if size > 1 else last


def _group_of_zero(matrix, part, pattern, core, outside, vanishing):
    """Return the group of the eigenvalue 0 if there is one; its residues are ``P M^k``, P being its projector.

    Without ``vanishing`` blocks the core is invertible: P is 0 within the core, and the pattern tells the power that
    vanishes. States outside the core also drive one another through any chain of states of the core.
    """
    places, zero = range(len(pattern)), constant(flint().acb_mat(1, 1), matrix.spans)
    if vanishing:
        polynomial = _characteristic(diagonal([*(zero for _ in outside), *vanishing]))
    else:
        drives = any(pattern[i, j] for i in outside for j in core)
        none = {*product(core if drives else places, core)}
        part = part.linear(lambda p: flint().acb_mat([[0 if (i, j) in none else p[i, j] for j in places]
                                                      for i in places]))
        within = np.linalg.matrix_power(pattern[np.ix_(core, core)] | np.eye(len(core), dtype=bool), len(core))
        through = pattern[np.ix_(outside, core)] @ within @ pattern[np.ix_(core, outside)]
        step, linked, polynomial = pattern[np.ix_(outside, outside)] | through, np.eye(len(outside), dtype=bool), []
        while linked.any():
            linked, polynomial = linked @ step, [*polynomial, zero]
    if not polynomial:
        return ()
    residues = [part]
    for _ in polynomial[1:]:
        residues.append((residues[-1] * matrix).tight())
    return (EigenvalueGroup(zero, _companion(polynomial), tuple(residues)),)


def core_of(pattern: np.ndarray) -> tuple[list[int], list[int], list[int]]:
    """Return the indices of the core, of states that only drive it and of states it only drives, by dependence."""
    left, before, after = set(range(len(pattern))), list[int](), list[int]()
    for found, matrix in ((before, pattern), (after, pattern.T)):
        while empty := [i for i in sorted(left) if not any(matrix[i, j] for j in left)]:
            found += empty
            left -= {*empty}
    return sorted(left), before, after[::-1]


def _subspaces(matrix, scaled, scales, until):
    """Return triples (V, B, U) of groups of eigenvalues of the core, with ``M V = V B`` and ``U V = 1``.

    A group with imaginary parts above 0 stands for its conjugate, too; every other group is real. Groups are joined
    where one has no enclosure, or, on a box, where they part by less than about a turn, or some powers of e, by
    ``until``: the weights of close eigenvalues are large and cancel, on a box only in part.
    """
    parts, centre = [*zip(scaled.parts[:2], scales.parts[:2], strict=True)], matrix.parts[:2][-1].mid()
    groups = _begun(centre) if centre.nrows() else []
    while groups:
        found, stuck = list[tuple[Family, Family]](), None
        for stuck, group in enumerate(groups):
            if matrix.spans and _nearest(groups, stuck)[0] * until < _PARTED:
                break
            try:
                basis, held = _basis(centre, group)
                found.append(_moved(scaled, scales, [_enclosed(*part, basis, held) for part in parts], held))
            except (ValueError, ZeroDivisionError):
                break
        else:
            everything = [vectors for vectors, block in found]
            everything += [vectors.linear(_conjugate) for vectors, block in found if not _is_real(block)]
            with suppress(ZeroDivisionError):
                inverse, first = _rows(abreast(everything).inverse()), [0, *accumulate(map(len, groups))]
                lefts = [stacked(inverse[a:b]) for a, b in pairwise(first)]
                return [(*pair, left) for pair, left in zip(found, lefts, strict=True)]
            stuck = min(range(len(groups)), key=lambda k: _nearest(groups, k)[0])
        groups = _joined(groups, stuck)
    return []


def _begun(matrix):
    """Return groups of one approximate eigenvalue each, without the lower ones of complex pairs."""
    values, acb = [value.mid() for value in matrix.eig(algorithm="approx")], flint().acb
    noise = max(value.abs_upper() for value in values) * flint().arb(2) ** -(flint().ctx.prec // 3)
    groups = [[value if value.imag > noise else acb(value.real)] for value in values if value.imag >= -noise]
    if sum(1 if _closed(group) else 2 for group in groups) == len(values):
        return groups
    return [[acb(value.real) for value in values]]


def _closed(group):
    """Tell whether a group contains the conjugates of its eigenvalues, which no group above the real axis does."""
    return any(value.imag <= 0 for value in group)


def _nearest(groups, k):
    """Return (distance, place) of the group, or of the conjugate of group k, that is nearest to group k.

    The distance is that of the eigenvalues farthest apart: a chain of neighbours is no group.
    """
    near = [(max(abs(a - b).mid() for a in groups[k] for b in other), j) for j, other in enumerate(groups) if j != k]
    own = [] if _closed(groups[k]) else [(max(2 * value.imag.mid() for value in groups[k]), k)]
    return min([*near, *own], default=(inf, None))


def _joined(groups, k):
    """Return the groups with group k joined to its neighbour; raises ``Refused`` if there is none."""
    place = _nearest(groups, k)[1]
    if place is None:
        raise Refused("spectrum: the eigenvalues of a mode cannot be enclosed")
    pair, found = [groups[j] for j in {k, place}], []
    mixed = len({*map(_closed, pair)}) == 2 or place == k
    for group in pair:
        found += group if _closed(group) or not mixed else [*group, *(value.conjugate() for value in group)]
    return [*(group for j, group in enumerate(groups) if j not in (k, place)), found]


def _basis(matrix, group):
    """Return an approximate basis (n, m) of the invariant subspace of a group by inverse iteration, and its held rows.

    The held rows, chosen as large as possible, are those of the unit matrix.
    """
    size, acb_mat, bits = matrix.nrows(), flint().acb_mat, flint().ctx.prec // 3
    found = acb_mat([[flint().acb(1) / (1 + i + j) for j in range(len(group))] for i in range(size)])
    norm = max(entry.abs_upper() for entry in matrix.entries())
    for value in group * _SWEEPS if len(group) < size else ():
        aside = value + (abs(value) + norm * flint().arb(2) ** -bits) * flint().arb(2) ** -bits
        shifted = matrix - acb_mat([[aside if i == j else 0 for j in range(size)] for i in range(size)])
        found, _ = _with_held_rows(shifted.mid().solve(found, algorithm="approx").mid())
    found, held = _with_held_rows(found)
    return acb_mat(found.real) if _closed(group) else found, held


def _with_held_rows(vectors):
    """Return a basis of the same space with rows of the unit matrix, and the places of these rows."""
    columns, held = vectors.transpose().tolist(), []
    for k in range(len(columns)):
        pivot = max(range(vectors.nrows()), key=lambda i: abs(columns[k][i]))
        columns[k] = [(c / columns[k][pivot]).mid() for c in columns[k]]
        held.append(pivot)
        for j, column in enumerate(columns):
            if j != k:
                columns[j] = [(c - column[pivot] * d).mid() for c, d in zip(column, columns[k], strict=True)]
    places = range(len(held))
    for i, j in product(places, places):
        columns[j][held[i]] = flint().acb(int(i == j))
    return flint().acb_mat(columns).transpose(), held


def _operator(matrix, scales, block, vectors, held):
    """Return the matrix of ``X -> M X_0 - S X_0 B - S V X_h``, X_h being the held rows of X, and X_0 X without them."""
    rows, columns = range(vectors.nrows()), range(vectors.ncols())

    def entry(r, a, i, b):
        if i in held:
            return -scales[0, r] * vectors[r, held.index(i)] if a == b else 0
        return (matrix[r, i] if a == b else 0) - (scales[0, r] * block[b, a] if r == i else 0)

    return flint().acb_mat([[entry(r, a, i, b) for b in columns for i in rows] for a in columns for r in rows])


def _column(matrix):
    return flint().acb_mat([[entry] for row in matrix.transpose().tolist() for entry in row])


def _split(column, size, held):
    """Return X_0 and X_h of the entries of X, column by column."""
    entries = column.entries()
    rows = [entries[i::size] for i in range(size)]
    none = [0] * len(held)
    return (flint().acb_mat([none if i in held else row for i, row in enumerate(rows)]),
            flint().acb_mat([rows[i] for i in held]))


def _moved(matrix, scales, heads, held):
    """Return (V, B) with their slopes, which are those of ``M V = S V B``, S = diag(``scales``).

    ``heads`` are pairs (V, B) on the box and at its centre; the ``held`` rows of V are those of the unit matrix.
    """
    for _ in matrix.spans and range(NARROWINGS):
        (_, block), (vectors, still) = heads[:2]
        rates = _operator(matrix.whole, scales.whole, block, vectors, held)
        near, slopes = rates.mid().inv().mid(), []
        for change, stretch in zip(matrix.parts[2:], scales.parts[2:], strict=True):
            pull = _scaled(stretch, vectors * still) - change * vectors
            slopes.append(_split((near * rates).solve(near * _column(pull)), vectors.nrows(), held))
        found = [Family(parts, matrix.spans).tight() for parts in zip(*heads[:2], *slopes, strict=True)]
        heads = [*zip(*(family.parts for family in found), strict=True)]
    return [Family(parts, matrix.spans) for parts in zip(*heads, strict=True)]


def _scaled(scales, matrix):
    """Return a matrix with its rows multiplied by ``scales``."""
    return flint().acb_mat([[scale * c for c in row]
                            for scale, row in zip(scales.entries(), matrix.tolist(), strict=True)])


def _enclosed(matrix, scales, vectors, held):
    """Return (V, B) for every matrix within the balls, ``vectors`` approximating V, by Krawczyk's test.

    The equation is ``M V = S V B`` with S = diag(``scales``). V changes by X_0 and B by X_h, the rows of X in the place
    of the held ones. With the ``_operator`` L the equation is ``R + L X - S X_0 X_h = 0``. If
    ``-Y R + (1 - Y L) X + Y S X_0 X_h`` lies inside the box X for all matrices, Y is invertible and X contains a
    solution, as does this image of X; where all is real, the solution is real. Raises ``ValueError`` where no such box
    is found.
    """
    size, acb_mat, real = vectors.nrows(), flint().acb_mat, all(entry.imag.is_zero() for entry in vectors.entries())
    moved = matrix * vectors
    block = acb_mat([[(c / scales[0, i]).mid() for c in moved.tolist()[i]] for i in held])
    linear = _operator(matrix, scales, block, vectors, held)
    near = linear.mid().inv().mid()
    near = acb_mat(near.real) if real else near
    start = -(near * _column(moved - _scaled(scales, vectors * block)))
    linear = acb_mat([[int(i == j) for j in range(near.ncols())] for i in range(near.nrows())]) - near * linear

    def image_of(box):
        still, held_part = _split(box, size, held)
        return start + linear * box + near * _column(_scaled(scales, still * held_part))

    box = start
    for _ in range(_INFLATIONS):
        box = _inflated(box, real)
        image = image_of(box)
        if all(map(_surrounds, box.entries(), image.entries())):
            for _ in range(NARROWINGS):
                image = image_of(image)
            still, held_part = _split(image, size, held)
            return vectors + still, block + held_part
        box = image
    raise ValueError("no enclosure")


def _surrounds(outer, inner):
    """Tell whether a complex ball lies in the interior of another, or a real one in that of a real one."""
    aside = outer.imag.is_zero() and inner.imag.is_zero()
    return outer.real.contains_interior(inner.real) and (aside or outer.imag.contains_interior(inner.imag))


def _inflated(box, real):
    """Return a column of balls somewhat larger than the given ones, real if told so."""
    arb, acb = flint().arb, flint().acb
    tiny = arb(2) ** (-flint().ctx.prec + 16)

    def larger(part):
        return part + arb(0, (part.abs_upper() * 3 / 2 + tiny).upper())

    return flint().acb_mat([[acb(larger(entry.real), 0 if real else larger(entry.imag))] for entry in box.entries()])


def _extended(matrix, back, known, order):
    """Return V of the whole matrix from its rows in the core: ``V_i = sum_j M_ij V_j B^-1``; ``back`` is ``B^-1``."""
    for i in order:
        total = next(iter(known.values())) * 0
        known[i] = sum((matrix.entry(i, j) * v for j, v in known.items()), total) * back
    return stacked([known[i] for i in range(matrix.whole.nrows())])
