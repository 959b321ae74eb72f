"""Exponentials and products of many small matrices at once."""

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
