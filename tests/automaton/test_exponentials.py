"""Exponentials and products of many small matrices at once."""

import mpmath
import numpy as np
import pytest
from scipy.linalg import expm

from asympk.automaton.exponentials import exponentials, running_products


@pytest.mark.parametrize("size", [1, 3])
def test_running_products_of_exponentials_are_those_of_the_matrices_so_far(size):
    matrices = np.random.default_rng(1).normal(size=(4, size, size))
    found, expected = running_products(exponentials(matrices)), np.eye(size)
    for product, matrix in zip(found, matrices, strict=True):
        expected = expected @ expm(matrix)
        assert product == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("power", [16, 30, 100])
def test_slow_parts_of_an_exponential_are_right_beside_fast_ones_however_fast(power):
    """e^P was squared, in which slow parts are rounding beside 1: at 10^30 they grew beyond all bounds."""
    fast = 10.0**power
    matrix = np.array([[-0.5, 0.25, 1.0], [0.25, -1.0, 2.0], [fast, -fast / 3, -fast]])
    with mpmath.workdps(3 * power + 30):
        rates, modes = mpmath.eig(mpmath.matrix(matrix.tolist()))
        found = modes * mpmath.diag([mpmath.exp(rate) for rate in rates]) * modes**-1
        expected = [[float(found[i, j].real) for j in range(2)] for i in range(3)]
    assert exponentials(matrix[None])[0, :, :2] == pytest.approx(np.array(expected), rel=1e-12)
