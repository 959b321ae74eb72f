"""Reductions of reaction and predator-prey systems come out as they are published."""

import runpy
from pathlib import Path

import pytest
import sympy as sp

s, b, p = sp.symbols("s b p", positive=True)
kappa, lambda_, k1, k_1, k2, e0 = sp.symbols("kappa lambda k1 k_-1 k2 e0", positive=True)
rho, alpha, beta, delta, eta, theta = sp.symbols("rho alpha beta delta eta theta", positive=True)


@pytest.fixture(scope="module")
def found():
    return runpy.run_path(str(Path(__file__).parents[2] / "derivations" / "reductions_of_others.py"))["RESULTS"]


def test_the_standard_quasi_steady_state_has_its_first_correction(found):
    assert sp.cancel(found["standard_reduction"] + lambda_ * s / (s + kappa)) == 0
    correction = kappa * lambda_ * s * (s + kappa - lambda_) / (s + kappa) ** 4
    assert sp.cancel(found["its_correction"] - correction) == 0


def test_slow_product_formation_is_not_the_quasi_steady_state(found):
    below = k1 * k_1 * e0 + (k1 * s + k_1) ** 2
    assert sp.cancel(found["slow_product_reduction"] + k1 * k2 * e0 * s * (k1 * s + k_1) / below) == 0


def test_a_predator_with_two_stages_has_the_functional_response_of_holling(found):
    assert sp.cancel(found["prey"] - rho * b * (1 - b) + alpha * delta * b * p / (delta + beta * b)) == 0
    assert sp.cancel(found["predators"] - (theta * beta * b - eta * delta) * p / (delta + beta * b)) == 0
