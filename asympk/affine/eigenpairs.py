"""The spectral parts ``v u^T`` of an exact matrix whose eigenvalues other than 0 are simple, in whole numbers.

LAPACK's eigenpairs are refined by Newton's method. The residual r of ``M v = l v`` is computed in fixed point: whole
numbers in units of 2^-bits. The correction (dv, dl) solves ``(M - l) dv - v dl = -r`` with the largest component of v
fixed, by an inverse in doubles that is computed once. A step gains some 40 bits at the cost of two products of small
matrices. ``_newton`` is the hard function.

The eigenvalue 0 may have any multiplicity; its part is the unit matrix less the other parts. Its multiplicity modulo a
prime is soon found and at least as large: if larger, powers of the matrix times this part do not vanish. If another
eigenvalue is multiple, Newton's method does not converge. Either way ``eigenpairs`` returns None: see ``polynomial``.
"""

from typing import NamedTuple

import numpy as np

_PRIME = 268_435_399  # the largest below 2^28: sums of up to 127 products stay within 64 bits
_STEPS = 48
_UNSETTLED = 4  # the number of steps after which every step must reduce the residual
_SETTLED = 2.0**10  # the largest last correction, in units of 2^-bits
NOISE = 56  # the number of bits that rounding may take


class Eigenpairs(NamedTuple):
    """Eigenvalues and their spectral parts in units of 2^-bits; a complex pair is represented by its upper member.

    ``values`` (2, m) and ``parts`` (2, m, n, n) hold real and imaginary parts. ``zero`` holds the nonvanishing products
    ``M^k P`` with the part P of the eigenvalue 0.
    """

    values: np.ndarray
    parts: np.ndarray
    zero: list[np.ndarray]


def eigenpairs(whole: np.ndarray, denominator: int, bits: int) -> Eigenpairs | None:
    """Return the ``Eigenpairs`` of ``whole / denominator``, or None where an eigenvalue but 0 is not clearly simple."""
    zeros = _zeros(whole)
    try:
        matrix = (whole / denominator).astype(float)
        values, vectors = _started(matrix, len(whole) - zeros)
        with np.errstate(divide="raise", invalid="raise", over="raise"):  # a matrix of corrections has a row of zeros
            values, right, left = _refined(whole, denominator, matrix, values, vectors, bits)
    except (np.linalg.LinAlgError, OverflowError, ArithmeticError):
        return None
    parts = _parts(right, left, bits)
    many = 1 + (values[1] != 0)[:, None, None]
    rest = (np.array(np.eye(len(whole), dtype=int), dtype=object) << bits) - (many * parts[0]).sum(axis=0)
    zero = _powers(whole, denominator, rest, zeros, bits)
    return None if zero is None else Eigenpairs(cleaned(values, bits), parts, zero)


def _zeros(whole):
    """Return the multiplicity of the root 0 of the characteristic polynomial modulo a prime."""
    matrix, unit = (whole % _PRIME).astype(np.int64), np.eye(len(whole), dtype=np.int64)
    adjugate, last = unit, 0
    for k in range(1, len(whole) + 1):
        moved = matrix @ adjugate % _PRIME
        coefficient = -int(moved.trace()) * pow(k, -1, _PRIME) % _PRIME
        adjugate = (moved + coefficient * unit) % _PRIME
        last = k if coefficient else last
    return len(whole) - last


def _started(matrix, count):
    """Return the ``count`` largest eigenvalues, without the lower members of pairs, and eigenvectors as rows."""
    values, vectors = np.linalg.eig(matrix)
    largest = np.argsort(-abs(values), kind="stable")[:count]
    upper = largest[values[largest].imag >= 0]
    if (1 + (values[upper].imag > 0)).sum() != count:
        raise ArithmeticError("a pair of eigenvalues is parted")
    return values[upper].astype(complex), vectors.T[upper].astype(complex)


def _refined(whole, denominator, matrix, values, vectors, bits):
    """Return (eigenvalues (2, m), eigenvectors (2, m, n) of the matrix, those of its transpose) in whole numbers."""
    vectors, held, inverse = _inverses(matrix, values, vectors)
    exact, right = _newton(whole, denominator, _whole(values, bits), _whole(vectors, bits), held, inverse, bits)
    values = _floats(exact[0], bits) + 1j * _floats(exact[1], bits)
    beside = inverse[np.arange(len(held)), held]  # nearly a left eigenvector: it annihilates all columns but one
    vectors, held, inverse = _inverses(matrix.T, values, beside)
    return exact, right, _newton(whole.T, denominator, exact, _whole(vectors, bits), held, inverse, bits)[1]


def _inverses(matrix, values, vectors):
    """Return (eigenvectors with largest component 1, its index, inverses of the correction matrices)."""
    every, held = np.arange(len(values)), abs(vectors).argmax(axis=1)
    vectors = vectors / vectors[every, held][:, None]
    moved = matrix - values[:, None, None] * np.eye(len(matrix))
    moved[every, :, held] = -vectors
    rows = 1 / abs(moved).max(axis=2, keepdims=True)
    columns = 1 / abs(moved * rows).max(axis=1, keepdims=True)
    return vectors, held, np.linalg.inv(moved * rows * columns) * columns.swapaxes(1, 2) * rows.swapaxes(1, 2)


def _newton(whole, denominator, values, vectors, held, inverse, bits):
    """Return (values, vectors) refined, right but for the last bits; raises ``ArithmeticError`` without convergence."""
    every, size = np.arange(len(held)), 1 + abs(_floats(values[0], bits)) + abs(_floats(values[1], bits))
    before = [bits]
    for _ in range(_STEPS):
        scaled = complex_product(values[:, :, None], vectors) >> bits
        off = np.stack([v @ whole.T // denominator for v in vectors]) - scaled
        most = abs(off).max(axis=(0, 2)) if off.size else np.zeros(0, dtype=object)
        shifts = np.array([max(0, most_of.bit_length() - 60) for most_of in most], dtype=object)
        before.append(max(shifts, default=0))
        if before[-1] and len(before) > _UNSETTLED and before[-1] >= before[-2]:
            break
        parts = (off >> shifts[:, None]).astype(float)
        step = np.matmul(inverse, (parts[0] + 1j * parts[1])[:, :, None])[:, :, 0]
        moved = step[every, held].copy()
        step[every, held] = 0
        vectors = vectors - (_whole(step, 0) << shifts[:, None])
        values = values - (_whole(moved, 0) << shifts)
        if not shifts.any() and (abs(step) < _SETTLED).all() and (abs(moved) < _SETTLED * size).all():
            return values, vectors
    raise ArithmeticError("the eigenpairs do not converge")


def complex_product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the products of complex numbers given by real and imaginary parts."""
    return np.stack([a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]])


def _whole(array, bits):
    """Return the real and imaginary parts of a complex array as whole numbers in units of 2^-bits."""
    shift = min(bits, 60)
    parts = np.stack([array.real, array.imag]) * 2.0**shift
    return np.array([int(v) << (bits - shift) for v in parts.flat], dtype=object).reshape(parts.shape)


def _floats(array, bits):
    return (array / (1 << bits)).astype(float)


def _parts(right, left, bits):
    """Return ``v u^T / (v.u)`` of all pairs; entries below the rounding error are set to 0."""
    product = complex_product(right, left).sum(axis=2) >> bits
    size = product[0] * product[0] + product[1] * product[1]
    inverse = np.stack([product[0] << (2 * bits), -product[1] << (2 * bits)]) // size
    left = complex_product(left, inverse[:, :, None]) >> bits
    return cleaned(complex_product(right[:, :, :, None], left[:, :, None, :]) >> bits, bits)


def cleaned(parts: np.ndarray, bits: int, lost: int = 0) -> np.ndarray:
    """Return ``parts`` with 0 for entries below the rounding error of the largest one; ``lost`` bits are unknown."""
    most = max((abs(v) for v in parts.flat), default=0)
    noise = max(most, 1 << bits) >> (bits - NOISE - lost)
    return np.where(abs(parts) > noise, parts, 0)


def _powers(whole, denominator, part, zeros, bits):
    """Return the nonvanishing ``M^k P``, k = 0, 1, ...

    None where more of them than the multiplicity do not vanish, or too few bits are left to decide.
    """
    found, lost = [], 0
    growth = max(1, max(map(abs, whole.flat)) // denominator).bit_length() + len(whole).bit_length()
    for _ in range(zeros + 1):
        if bits - lost < 2 * NOISE:
            return None
        part = cleaned(part, bits, lost)
        if not part.any():
            return found
        found.append(part)
        part, lost = whole @ part // denominator, lost + growth
    return None
