"""The jump law of any mechanism: the rows that the paper shows, and mechanisms that nobody chose."""

from itertools import groupby
from math import log
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from contactmodel import Model, follow

from asympk.pictures.anymechanism import limit
from asympk.storage.rows import read_rows
from asympk.studies import anymechanism
from asympk.systems.catalogue import described_mechanism

ROWS = Path(__file__).parents[2] / "paper" / "generated" / "rows"
h = 0.5


def random_mechanism(seed, n=4):
    """A mechanism of ``n`` coordinates with constant mass, forces and directions of contact, all of them drawn."""
    draw = np.random.default_rng(seed)
    root, W = draw.normal(size=(n, n)), draw.normal(size=(2, n))
    M = root @ root.T + np.eye(n)
    G = W @ np.linalg.solve(M, W.T)
    pushed = draw.normal(size=n)
    gamma = np.sign(-(W[0] @ np.linalg.solve(M, pushed)) * G[0, 1])  # the side that has no rigid motion
    at_rest = draw.normal(size=n)
    across = np.linalg.lstsq(W, np.array([0, gamma]) - W @ at_rest, rcond=None)[0]
    friction = 1.5 * G[0, 0] / abs(G[0, 1])
    terms = lambda q, u: (M, pushed, W, np.zeros(2), W[0] @ q, 1.0)  # noqa: E731
    return terms, friction, G, gamma, at_rest + across


@pytest.mark.parametrize("seed", range(4))
def test_mechanisms_that_are_drawn_at_random_jump_as_the_law_says(seed):
    terms, friction, G, gamma, rates = random_mechanism(seed)
    M, _, W, *_ = terms(np.zeros(4), None)
    D = G[0, 0] * G[1, 1] - G[0, 1] ** 2
    P = np.array([gamma * G[0, 1] / D, -gamma * G[0, 0] / D])
    assert abs(P[1]) < friction * abs(P[0])
    errors = []
    for c in (1e-4, 1e-5, 1e-6):
        growth = min(0.5 * G[0, 0] * h, D / G[1, 1] * h)
        _, q, u = follow(Model(terms, friction, 1 / c, h), np.zeros(4), rates, 3 * c * log(1 / c) / growth)
        jumped = np.concatenate([u - rates - np.linalg.solve(M, W.T @ P), [-W[0] @ q / c - P[0] / h]])
        errors.append(np.abs(jumped).max() / (c * log(1 / c)))
    assert errors[2] == pytest.approx(errors[1], rel=0.15)
    assert abs(errors[2] - errors[1]) < abs(errors[1] - errors[0]) + 1e-3 * errors[2]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["painleve_rod", "brake_shoe", "crank_slider"])
def test_the_formulas_in_short_form_are_those_of_the_law(name):
    told = described_mechanism(name)
    kinetics, numbers = told.mechanism.plain, told.mechanism.keyed(told.numbers)
    for short, full in zip(anymechanism.impulses(kinetics), told.mechanism.jump_law().impulses, strict=True):
        value = told.mechanism.evaluate(full, told.numbers)
        gamma = told.mechanism.evaluate(told.mechanism.sliding_velocity, told.numbers)
        assert float(short.subs(numbers)) * gamma == pytest.approx(value, rel=1e-12)


def test_errors_over_c_log_c_lie_on_straight_lines_over_one_over_log():
    """error = c (A L + B + ..): the constant from the last two rows is that from the two before."""
    for _, several in groupby(read_rows(ROWS / "jumplaw.csv"), key=lambda row: row["mechanism"]):
        several = list(several)
        assert limit(several) == pytest.approx(limit(several[:-1]), rel=0.02)


def test_what_was_followed_rebounds_as_the_formula_says():
    met = [row for row in read_rows(ROWS / "rebound.csv") if row["followed"] is not None]
    assert len(met) == len(anymechanism.REBOUNDS) * len(anymechanism.FOLLOWED)
    for row in met:
        assert row["followed"] == pytest.approx(row["law"], rel=0.012)


def test_the_rebound_lies_between_its_limits_and_tends_to_both():
    for _, several in groupby(read_rows(ROWS / "rebound.csv"), key=lambda row: row["theta"]):
        several = list(several)
        assert all(row["law"] < min(row["undamped"], row["overdamped"]) for row in several)
        assert several[0]["law"] == pytest.approx(several[0]["undamped"], rel=0.02)
        assert several[-1]["law"] == pytest.approx(several[-1]["overdamped"], rel=0.01)


def test_a_stored_row_is_what_the_study_computes():
    stored = {row["mechanism"]: row for row in read_rows(ROWS / "mechanisms.csv")}
    found = anymechanism._formulas("painleve_rod")
    kept = stored["painleve_rod"]
    assert (found["normal_latex"], found["critical"]) == (kept["normal_latex"], kept["critical"])
    assert sp.Rational(repr(found["friction"])) == 2
