"""``e^{M t} = sum_r F_r(t) D_r`` of an exact matrix, in whole numbers of any precision.

The F_r are ``t^k/k! e^{a t}`` for a real eigenvalue a, ``t^k/k! e^{a t} cos(w t)`` and ``.. sin(w t)`` for a pair
``a +- i w``, k below the multiplicity. Where no eigenvalue but 0 is multiple, the D_r come from ``eigenpairs``; else
they are residues (``of_roots``), found for each group of states that does not move the others (``of_groups``).

The D_r may grow as eigenvalues approach one another, and their sum loses digits. Those whose D_r cancel are taken
together, by the divided differences of ``e^{z t}`` at them, whose D_r do not grow (``_joined``). ``exponential``
takes more bits until ``X = sum F_r D_r`` satisfies ``X(0) = 1`` and ``X' = M X``: only ``e^{M t}`` does (``_solves``).
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, lru_cache
from itertools import combinations, count, takewhile
from math import comb, log2
from typing import Any

import numpy as np
from sympy.utilities.iterables import connected_components

from asympk.affine.eigenpairs import NOISE, Eigenpairs, cleaned, complex_product, eigenpairs
from asympk.affine.functions import Block, initial, rate_of
from asympk.affine.polynomial import in_whole_numbers, polynomial_roots, residues_at, resolvent
from asympk.arithmetic import DIGITS_OF_DOUBLES, SPARE_DIGITS, flow_context, set_digits
from asympk.errors import InputError, Undecided
from asympk.multiprecision import whole_product

MOST_STATES = 64  # with multiple eigenvalues the search for an exponential takes some seconds
DIGITS_FOR_DOUBLES = DIGITS_OF_DOUBLES + SPARE_DIGITS  # those of the run that may follow one in doubles
LARGEST = 400  # the power of ten beyond which numbers are refused, which no number here comes near
_SPARE_BITS = 64
_BITS_A_DIGIT = 5.4  # some 1.6 digits for each digit asked for
_RIGHT_BITS_A_DIGIT = 3.7  # bits to which ``e^{M t}`` is right for each digit asked for
_NEAR, _LARGE, _FEW = 5, 2, 6  # bits, and eigenvalues
_MOST_BITS = 1 << 13  # beyond which the bits are not doubled again: the search for roots would take minutes


@dataclass(frozen=True)
class Exponential:
    """``e^{M t} = sum F_r(t) D_r`` in whole numbers in units of 2^-bits.

    ``blocks`` give the functions F_r in order, the fastest first. ``matrices`` (functions, n, n) are the D_r.
    """

    bits: int
    blocks: tuple[Block, ...]
    matrices: np.ndarray


def states_beyond(states: int) -> str | None:
    """Return words on a mode with more states than the exact flow takes, or None."""
    return f"a mode has {states} states, forcing included: the exact flow takes {MOST_STATES}" * (
        states > MOST_STATES) or None


@lru_cache(maxsize=256)
def exponential(entries: tuple[tuple[Fraction, ...], ...], digits: int) -> Exponential:
    """Return the ``Exponential`` of rows of Fractions to ``digits`` digits, with more bits the more their sizes differ.

    Raises ``InputError`` for more than ``MOST_STATES``, ``Undecided`` where eigenvalues are too near to one another.
    """
    if found := states_beyond(len(entries)):
        raise InputError(f"{found}; ask for an integrator, such as method 'lsoda'")
    whole, denominator = in_whole_numbers(entries)
    lengths = [abs(entry).bit_length() for entry in whole.flat if entry]
    spread = max(lengths, default=0) - min(lengths, default=0)
    first = int(_BITS_A_DIGIT * digits) + _SPARE_BITS + 2 * spread
    right = int(_RIGHT_BITS_A_DIGIT * digits) + spread
    for bits in takewhile(lambda bits: bits <= max(first, _MOST_BITS), (first << k for k in count())):
        with suppress(Undecided, ZeroDivisionError):  # roots that only more bits tell apart
            pairs = eigenpairs(whole, denominator, bits)
            pieces = [piece for piece in (of_pairs(pairs) if pairs else of_groups(entries, bits)) if piece[0].size]
            found = _exponential(_joined(pieces, bits), bits)
            if _solves(found, whole, denominator, right):
                return found
    raise Undecided(f"eigenvalues of a mode are too near to one another for {bits} bits: give parameters at which "
                    "they are equal, or differ more")


def _joined(pieces, bits):
    """Yield the pieces of eigenvalues in Newton's form where they are near one another, and the others as they are.

    The nearest are gathered first. Two sets become one where both have weights that cancel in the joint set.
    """
    blocks = [block for block, _ in pieces]
    links = [(max(abs(a - b) for a, b in zip(blocks[i][:2], blocks[k][:2], strict=True)), i, k)
             for i, k in combinations(range(len(blocks)), 2)]
    links += [(2 * block.turn, k, k) for k, block in enumerate(blocks) if block.turn]  # from its conjugate
    weights = cache(lambda joined, real: _weights([pieces[k] for k in joined], real, bits))
    sets = {k: (frozenset((k,)), not block.turn) for k, block in enumerate(blocks)}
    found = dict[frozenset, bool]()
    for apart, i, k in sorted(links):
        joined, real = sets[i][0] | sets[k][0], sets[i][1] or sets[k][1] or i == k
        if (joined, real) != sets[i] and apart << _NEAR <= max(_speed(blocks[i]), _speed(blocks[k])):
            many = sum(blocks[n].size * (1 + (real and blocks[n].turn > 0)) for n in joined)
            if many <= _FEW and _cancel(weights(*sets[i]), weights(*sets[k]), weights(joined, real)):
                found = {other: was for other, was in found.items() if not other <= joined} | {joined: real}
            sets |= dict.fromkeys(joined, (joined, real))
    yield from (_newton([pieces[k] for k in joined], real, bits) for joined, real in found.items())
    yield from (piece for k, piece in enumerate(pieces) if not any(k in joined for joined in found))


def _cancel(one, other, joint):
    """Tell whether two sets both have a weight above four times what the joint weights J and their products give.

    ``(1 + J)^2`` is what one state gives another at once or through a third: zeros by chance do not count, nor do the
    units of the states.
    """
    given = np.logaddexp2(joint, np.where(np.eye(len(joint)), 0, -np.inf))
    return (np.minimum(one, other) > np.logaddexp2.reduce(given[:, :, None] + given, axis=1) + _LARGE).any()


def _speed(block):
    return abs(block.decay) + block.turn


def _weights(pieces, real, bits):
    """Return the binary logarithms of the weights ``|P| + |(M - l) P| / |l|`` that a set has in Newton's form.

    P is the sum of spectral parts, and l the first eigenvalue. The conjugates of a ``real`` set are among it.
    """
    chains, (first, _) = [_chain(*piece) for piece in pieces], pieces[0]
    less = _less(chains, (first.decay, 0 if real else first.turn), bits)
    begun, moved = (abs(sum(parts[0] for _, parts in kept)[: 1 if real else 2]).sum(axis=0) for kept in (chains, less))
    sizes = begun + (moved << bits) // (_speed(first) or 1)
    return np.array([log2(size) - bits if size else -np.inf for size in sizes.flat]).reshape(sizes.shape)


def _newton(pieces, real, bits):
    """Return (block, matrices) of several eigenvalues l_0, l_1, ..: E_k has ``(M - l_0) .. (M - l_{k-1}) P``.

    P is the sum of their spectral parts. The conjugates of a ``real`` set are among it, and its first node is real.
    """
    pieces = sorted(pieces, key=lambda piece: -piece[0].decay)
    nodes = [block[:2] for block, _ in pieces for _ in range(block.size)]
    if real and nodes[0][1]:
        nodes = [(nodes[0][0], 0), *nodes]
    chains, every, found = [_chain(*piece) for piece in pieces], list[tuple](), list[Any]()
    for decay, turn in nodes:
        every += [(decay, turn), (decay, -turn)] if real and turn else [(decay, turn)]
        found.append(chains)
        if real and turn:
            found.append(_less(chains, (decay, 0), bits))
            chains = _less(chains, (decay, -turn), bits)
        chains = _less(chains, (decay, turn), bits)
    most = max(abs(part).max() for kept in found for _, parts in kept for part in parts)
    sums = np.array([sum(parts[0] for _, parts in kept) for kept in found])
    sums = np.where(abs(sums) > most >> bits - NOISE, sums, 0)
    decay, turn = every[0]
    apart = tuple((a - decay, b - turn) for a, b in every[1:])
    sums = sums[:, 0] if real else np.stack([sums[:, 0], -sums[:, 1]], axis=1).reshape(-1, *sums.shape[2:])
    return Block(decay, turn, len(every), apart), sums


def _chain(block, matrices):
    """Return (eigenvalue, its matrices as complex numbers)."""
    parts = matrices.reshape(block.size, -1, *matrices.shape[1:])
    return block[:2], [np.stack([part[0], -part[1] if block.turn else 0 * part[0]]) for part in parts]


def _less(chains, node, bits):
    """Return chains times ``M - node``: ``M D_k = l D_k + D_{k+1}`` for the matrices of an eigenvalue l."""
    found = []
    for value, parts in chains:
        apart = np.array([a - b for a, b in zip(value, node, strict=True)], dtype=object)
        moved = [complex_product(apart, part) >> bits if apart.any() else 0 * part for part in parts]
        found.append((value, [a + b for a, b in zip(moved, [*parts[1:], 0], strict=True)]))
    return found


def _exponential(pieces, bits):
    """Return the ``Exponential`` with the given number of bits, some of which eigenvalues near one another take."""
    kept = sorted(pieces, key=lambda piece: -abs(piece[0].decay) - piece[0].turn)
    return Exponential(bits, tuple(block for block, _ in kept), np.concatenate([matrices for _, matrices in kept]))


def _solves(found, whole, denominator, right):
    """Tell whether ``X = sum F_r D_r`` has ``X(0) v = v`` and ``X' v = M X v`` to ``right`` bits, for one v.

    Each component of ``M D_r v`` is right by the size of its own terms and of the eigenvalue, not by the largest entry:
    else all slow eigenvalues would count as one beside a much faster one.
    """
    unit, vector = 1 << found.bits, np.array([pow(5, k, 97) for k in range(len(whole))], dtype=object)
    parts = found.matrices @ vector
    begun = np.array(initial(found.blocks)) @ parts - vector * unit
    off = parts @ whole.T // denominator - (rate_of(found.blocks, unit) @ parts >> found.bits)
    speeds = [abs(b.decay) + b.turn for b in found.blocks for _ in range(b.size * (2 if b.turn else 1))]
    sizes = abs(parts) @ abs(whole).T // denominator + vector.max() * np.array(speeds, dtype=object)[:, None]
    noise = abs(whole).max() * (max(unit, abs(found.matrices).max()) >> found.bits - NOISE) // denominator + 2
    return abs(begun).max() <= unit >> right and (abs(off) <= (sizes >> right) + noise).all()


def of_pairs(found: Eigenpairs) -> Iterator[tuple[Block, np.ndarray]]:
    """Yield (block, matrices) of the simple eigenvalues, and of the eigenvalue 0."""
    for decay, turn, real, imaginary in zip(*found.values, *found.parts, strict=True):
        yield Block(decay, turn, 1), np.array([2 * real, -2 * imaginary] if turn else [real])
    yield Block(0, 0, len(found.zero)), np.array(found.zero).reshape(-1, *found.parts.shape[2:])


def of_groups(entries: tuple[tuple[Fraction, ...], ...], bits: int) -> Iterator[tuple[Block, np.ndarray]]:
    """Yield (block, matrices) of all eigenvalues, which may be multiple, from each of the ``_groups`` by itself.

    Blocks that rest part a chain into groups: an eigenvalue that several groups have is simple in each.
    """
    size, (driving, moving) = len(entries), _groups(entries)
    found: dict[tuple[int, int], np.ndarray] = {}
    for k, moved in enumerate(moving):
        group, rows = [*moved, *driving], moved if k else [*moved, *driving]
        own = tuple(tuple(entries[i][j] for j in group) for i in group)
        pairs = eigenpairs(*in_whole_numbers(own), bits) if len(moving) > 1 else None
        for (decay, turn, *_), matrices in of_pairs(pairs) if pairs else of_roots(own, bits):
            before = found.get((decay, turn), np.zeros((0, size, size), dtype=object))
            summed = np.zeros((max(len(before), len(matrices)), size, size), dtype=object)
            summed[: len(before)] = before
            summed[np.ix_(range(len(matrices)), rows, group)] += matrices[:, : len(rows)]
            found[decay, turn] = summed
    return ((Block(*key, len(matrices) // (2 if key[1] else 1)), matrices) for key, matrices in found.items())


def _groups(entries):
    """Return the states that are polynomials of the time, and the other states in groups that do not move one another.

    The former are those that none but such states move. There is at least one group, which may be empty.
    """
    every = range(len(entries))
    moves = [{j for j in every if entries[i][j]} for i in every]
    driving: set[int] = set()
    while more := {i for i in every if i not in driving and moves[i] <= driving}:
        driving |= more
    others = [i for i in every if i not in driving]
    coupled = [(i, j) for i in others for j in moves[i] - driving]
    return sorted(driving), [sorted(group) for group in connected_components((others, coupled))] or [[]]


def of_roots(entries: tuple[tuple[Fraction, ...], ...], bits: int) -> Iterator[tuple[Block, np.ndarray]]:
    """Return (block, matrices) of all eigenvalues, which may be multiple, as roots of the characteristic polynomial.

    With ``(z - M)^{-1} = N(z) / q(z)``, ``N(z) = sum A_i (z - l)^i`` and ``(z - l)^m / q(z) = sum s_j (z - l)^j``, the
    residue of ``e^{z t} (z - M)^{-1}`` at a root l of multiplicity m gives the coefficient of ``t^k/k! e^{l t}``: the
    sum of A_i s_j over i + j = m - 1 - k. The A_i are whole matrices times powers of l, exact until they are rounded.
    Matrices that vanish at the end are left out.
    """
    found = resolvent(entries)
    m = flow_context(LARGEST)
    set_digits(m, int(0.3 * bits) + 20 + 3 * len(entries))
    return (_piece(m, found, *root, bits) for root in polynomial_roots(found, m))


def _piece(m, found, root, many, bits):
    """Return (block, matrices) of one root of a multiplicity."""
    residues = np.array(_residues(m, found, root, many))
    decay, turn = _fixed(np.array([m.re(root), m.im(root)]) / found.denominator, bits)
    if m.im(root) and not turn:
        raise Undecided("a pair of eigenvalues may be two real ones")
    parts = [[2 * v.real, -2 * v.imag] if turn else [v] for v in residues.flat]
    matrices = np.moveaxis(_fixed(np.array(parts).reshape(*residues.shape, -1), bits), -1, 1)
    size = len(np.trim_zeros(matrices.any(axis=(1, 2, 3)), "b"))
    return Block(decay, turn, size), matrices[:size].reshape(-1, *residues.shape[1:])


def _fixed(values, bits):
    """Return mpmath numbers, or 0, as whole numbers in units of 2^-bits; values within rounding are set to 0."""
    from mpmath.libmp import to_fixed

    whole = [int(to_fixed(value._mpf_, bits)) if value else 0 for value in values.flat]
    return cleaned(np.array(whole, dtype=object).reshape(values.shape), bits)


def _shortened(table, bits):
    """Return (table, shifts) of whole numbers: columns divided by 2^shift, down to ``bits`` bits of the least entry."""
    lengths = [min((abs(int(entry)).bit_length() for entry in column if entry), default=0) for column in table.T]
    shifts = [max(0, length - bits) for length in lengths]
    return (table >> np.array(shifts, dtype=object) if any(shifts) else table), shifts


def _residues(m, found, root, many):
    """Return the ``many`` coefficients D_k of ``t^k/k! e^{z t}`` for a root of this multiplicity."""
    places, shape = range(len(found.adjugate)), found.adjugate.shape[1:]
    (table, shifts), series = _shortened(found.adjugate.reshape(len(places), -1).T, m.prec + _SPARE_BITS), []
    for j in range(many):  # the coefficient of (z - l)^j in N(z)
        weights = [comb(k, j) * root ** max(k - j, 0) * m.ldexp(1, s) for k, s in zip(places, shifts, strict=True)]
        real, imaginary = (whole_product(m, table, 0, np.array([*map(part, weights)])) for part in (m.re, m.im))
        series.append((real + imaginary * m.j if m.im(root) else real).reshape(shape))
    of_whole = residues_at(found.polynomial, series, root)
    return [matrix * m.mpf(found.denominator) ** -k for k, matrix in enumerate(of_whole)]
