"""The exponentials of many small matrices at once, by which errors grow over the steps of a run, and their products.

    e^M = (1 + P + P^2/2! + ... + P^12/12!)^(2^k),    P = M / 2^k,    by k squarings

The squarings are those of e^P - 1: beside fast parts, slow ones are less than the rounding of 1 in e^P.
"""

from itertools import accumulate

import numpy as np


def exponentials(matrices: np.ndarray) -> np.ndarray:
    """Return the exponentials of many matrices by scaling and squaring of their Taylor series.

    The matrices are balanced together before: else large entries in one row, as in other units, hide the others.
    """
    if matrices.shape[-1] == 1:
        return np.exp(matrices)
    from scipy.linalg.lapack import dgebal  # matrix_balance takes ten times as long for a small matrix

    largest = np.abs(matrices).max(axis=0, initial=0.0)
    if np.isfinite(largest).all():
        _, _, _, units, _ = dgebal(largest, scale=1, permute=0)
    else:
        units = np.ones(len(largest))
    matrices = matrices * units / units[:, None]
    size = np.abs(matrices).sum(axis=2).max(initial=0.5)
    halvings = max(0, int(np.ceil(np.log2(size))) + 1) if np.isfinite(size) else 0
    part = matrices / 2.0**halvings
    term = less = part
    for k in range(2, 13):
        term = term @ part / k
        less = less + term
    for _ in range(halvings):
        less = 2 * less + less @ less
    return np.eye(len(units)) + less * units[:, None] / units


def running_products(factors: np.ndarray) -> np.ndarray:
    """Return A_0, A_0 A_1, A_0 A_1 A_2, ... of square matrices A_k."""
    if factors.shape[-1] == 1:
        return np.multiply.accumulate(factors)
    return np.array([*accumulate(factors, np.matmul)])
