"""The short cut of the ordinary leg finds what the general text finds, and spares it most of the work."""

import numpy as np
import pytest

from asympk.arithmetic import Doubles
from asympk.errors import Undecided
from asympk.systems.painleve_klein.flow import shortcut
from asympk.systems.painleve_klein.flow.exact import RodNumbers, segments_of
from asympk.systems.painleve_klein.flow.rounding import largest_state


def cases(n, seed):
    random = np.random.default_rng(seed)
    for _ in range(n):
        sigma = random.choice([1.0, random.uniform(-1.99, 4), 10 ** random.uniform(-3, 4)])
        start = random.uniform(-2, 2, 3) * 10 ** random.uniform(-4, 3, 3)
        yield RodNumbers(float(sigma), float(sigma), float(10 ** random.uniform(-12, 0)), *map(float, start), 5.0, None)


def followed(case):
    try:
        return segments_of(Doubles, case)
    except (Undecided, OverflowError, ZeroDivisionError):
        return None


def test_the_short_cut_and_the_general_text_agree(monkeypatch):
    scenes = list(cases(600, 1))
    quick = [followed(case) for case in scenes]
    monkeypatch.setattr(shortcut, "slip_end", lambda *_: None)
    monkeypatch.setattr(shortcut, "stick_end", lambda *_: None)
    general = [followed(case) for case in scenes]
    pairs = [(p, q) for p, q in zip(quick, general, strict=True) if p and q]
    assert len(pairs) > 580
    for p, q in pairs:
        assert [leg.mode for leg in p] == [leg.mode for leg in q]
        assert max(abs(p[-1].end[i] - q[-1].end[i]) for i in (0, 3)) <= 1e-14 * largest_state(q) or len(p) > 8


@pytest.mark.parametrize("mu", [1e-2, 1e-4, 1e-6])
def test_the_general_text_is_seldom_needed_for_small_mu(mu, monkeypatch):
    asked, answered = [], []
    for name in ("slip_end", "stick_end"):
        real = getattr(shortcut, name)

        def counting(*args, real=real):
            asked.append(1)
            found = real(*args)
            answered.append(bool(found))
            return found

        monkeypatch.setattr(shortcut, name, counting)
    random = np.random.default_rng(2)
    for _ in range(100):
        followed(RodNumbers(1.0, 1.0, mu, *map(float, random.uniform(-2, 2, 3)), 5.0, None))
    assert sum(answered) > 0.9 * len(asked)


def test_a_balance_is_a_root_of_its_equation():
    base, k, fast, rate, slow, slow_rate = 0.5, 0.2, -3.0, -40.0, 0.01, -1.1
    t, r, lost = shortcut._balance(base, k, fast, rate, slow, slow_rate, 5.0)
    assert r == pytest.approx(fast * np.exp(rate * t), rel=1e-14)
    assert r == pytest.approx(-(base + k * t + slow * np.expm1(slow_rate * t)), rel=1e-14)
    assert lost == pytest.approx(np.expm1(slow_rate * t), rel=1e-14)


@pytest.mark.parametrize(
    ("base", "fast", "rate", "end"),
    [
        (0.5, 3.0, -40.0, 5.0),  # the fast part has the wrong sign
        (5.0, -3.0, -40.0, 5.0),  # it would have to be larger than it ever was
        (0.5, -3.0, -40.0, 1e-3),  # not in time
        (2.99, -3.0, -40.0, 5.0),  # at once
        (0.0, -3.0, -40.0, 5.0),  # never
    ],
)
def test_no_balance_is_claimed_where_there_is_none(base, fast, rate, end):
    assert shortcut._balance(base, 0.0, fast, rate, 0.0, -1.0, end) is None
