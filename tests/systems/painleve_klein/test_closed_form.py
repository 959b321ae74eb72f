"""The closed forms of one mode: they solve the equations, and every cancellation they avoid is one that would show."""

import math
from fractions import Fraction
from itertools import product

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asympk.arithmetic import Doubles, flow_context, set_digits
from asympk.systems.painleve_klein.arrays.motions import SeparateSegments, SmoothSegments, arithmetic_of
from asympk.systems.painleve_klein.flow import fastslow, segments, shortcut, starts, superposition
from asympk.systems.painleve_klein.flow.fastslow import FastSlow, well_apart
from asympk.systems.painleve_klein.flow.roots import bracketed_root
from asympk.systems.painleve_klein.flow.rounding import largest_state
from asympk.systems.painleve_klein.flow.segments import RodFlow, follow_rod, on_level, on_plane
from asympk.systems.painleve_klein.flow.starts import beginning
from asympk.systems.painleve_klein.flow.superposition import SmoothMode, short_responses, superposed

BOUND = 2e-15
balance = shortcut._balance
settings.register_profile("theorems", derandomize=True, deadline=None, max_examples=60)
settings.load_profile("theorems")


def digits(n):
    m = flow_context(400)
    set_digits(m, n)
    return m


def state_by_integration(a, b, mu, x, y, z, t, n=25):
    """Return (x, y, z) at t by mpmath's Taylor integrator, which knows nothing of modes or exponents."""
    with mpmath.workdps(n):
        a, b, mu = (mpmath.mpf(v) for v in (a, b, mu))

        def field(_, state):
            p, q, _ = state
            s = p + q
            return [q, (a - b * s) / mu, a - (b - 1) * s]

        return mpmath.odefun(field, 0, [mpmath.mpf(v) for v in (x, y, z)])(t)


MODES = [
    (1, 5, "0.3"),  # fast and slow
    (1, -1, "0.3"),  # growing
    (1, 5, "2"),  # complex
    (0, 1, "0.25"),  # coalescence of the stick mode
    (1, "0.001", "0.7"),  # nearly degenerate
    (1, 0, "0.7"),
    (1, "-0.001", "0.7"),
    (1, 1, "0.1"),  # z' = 1
]


@pytest.mark.parametrize(("a", "b", "mu"), MODES)
def test_a_closed_form_solves_its_mode(a, b, mu):
    m = digits(40)
    b, mu = m.mpf(Fraction(b).numerator) / Fraction(b).denominator, m.mpf(mu)
    x, y, z = m.mpf("0.3"), m.mpf("-1.1"), m.mpf("-0.7")
    forms = [SmoothMode] if not b or not -2 <= mu / b <= 0.125 else [SmoothMode, FastSlow]
    with mpmath.workdps(40):
        expected = state_by_integration(a, mpmath.mpf(b), mpmath.mpf(mu), x, y, z, 1.5)
    for form in forms:
        state = form(m, a, b, mu).start(x, y, x + y, z).state(m.mpf("1.5"))
        assert max(abs(state[i] - e) for i, e in zip((0, 1, 3), expected, strict=True)) < 1e-22
        assert abs(state[2] - state[0] - state[1]) < 1e-35
        assert abs(state[4] - (a - b * state[2])) < 1e-35


@pytest.mark.parametrize(("a", "b", "mu"), MODES)
def test_short_times_agree_with_long_ones(a, b, mu):
    m = digits(60)
    mode = SmoothMode(m, a, m.mpf(Fraction(b).numerator) / Fraction(b).denominator, m.mpf(mu))
    t = m.mpf("0.4")
    if b:
        for short, long in zip(short_responses(m, mode.beta, t), mode.responses(t), strict=True):
            assert abs(short - long) < 1e-48 * abs(long)


@pytest.mark.parametrize(("a", "b", "mu"), MODES)
def test_the_rows_of_an_array_move_as_single_numbers_do(a, b, mu):
    starts, times = np.random.default_rng(1).normal(size=(3, 50)), np.geomspace(1e-9, 9, 50)
    b, mu, (x, y, z) = float(b), float(mu), starts
    kind, form = (FastSlow, SeparateSegments) if well_apart(b, mu) else (SmoothMode, SmoothSegments)
    with np.errstate(all="ignore"):
        rows = form(kind(arithmetic_of(x.dtype), a, np.full(50, b), np.full(50, mu)), x, y, x + y, z)
        states, turns = rows.state(times), rows.turning()
    for k, (t, *start) in enumerate(zip(*map(np.ndarray.tolist, (times, x, y, x + y, z)), strict=True)):
        single = kind(Doubles, a, b, mu).start(*start)
        assert [w[k] for w in states] == pytest.approx(single.state(t), rel=1e-12, abs=1e-13)
        assert turns[k] == pytest.approx(single.turning(), rel=1e-12)


@given(
    a=st.sampled_from([0, 1]),
    b=st.floats(-3, 6).filter(bool),
    mu=st.floats(-8, 1).map(lambda p: 10.0**p),
    start=st.tuples(*[st.floats(-2, 2)] * 3),
    share=st.floats(0.01, 1),
)
def test_a_state_in_doubles_is_right_to_the_rounding_of_its_terms(a, b, mu, start, share):
    x, y, z = start
    states = []
    for m in (Doubles, digits(60)):
        usual = RodFlow(m, 0, 0, m.number(mu))
        usual.load = lambda name: (a, b)
        segment = usual.mode("any").start(*map(m.number, (x, y)), m.number(x) + m.number(y), m.number(z))
        t = share * 2 * min(1, 20 / abs(float(getattr(segment.mode, "fast_rate", 1)))) if b < 0 else share * 5
        states.append(segment.state(m.number(t)))
    size = max(1, abs(a / b), *map(abs, (x, z, states[1][0], states[1][3])), abs(mu * states[1][1]))
    assert max(abs(states[0][i] - states[1][i]) for i in (0, 3)) < 40 * BOUND * size


def solved(m, sigma, mu, start, until, sigma0=None):
    """Return the legs of a scene in the numbers of ``m``, with no account of rounding and no second run."""
    from asympk.systems.painleve_klein.flow.exact import RodNumbers

    case = RodNumbers(sigma, sigma if sigma0 is None else sigma0, mu, *start, until, None)
    of_scene = RodFlow(m, m.number(case.sigma), m.number(case.sigma0), m.number(mu))
    return follow_rod(of_scene, *_swapped(beginning(of_scene, case), m.number(until)))


def _swapped(begun, until):
    start, deviation = begun
    return start, until, deviation


def error_of(sigma, mu, start, until, sigma0=None):
    """Return the error of the final (x, z) in plain doubles, relative to the largest; inf when the events differ."""
    rough, true = (solved(m, sigma, mu, start, until, sigma0) for m in (Doubles, digits(60)))
    if [leg.mode for leg in rough] != [leg.mode for leg in true]:
        return math.inf
    return float(max(abs(rough[-1].end[i] - true[-1].end[i]) for i in (0, 3)) / largest_state(true))


def test_the_constants_of_a_mode_are_right_to_a_few_ulps():
    assert worst_constant() < 1e-15


def worst_constant():
    """Return the largest relative error of the constants of fast-slow modes over the domain."""
    worst = 0.0
    for b, mu in product((1.5, 5.0, 1e6, 0.3, -1.0, -0.01, -1e6), (1e-300, 1e-17, 1e-12, 1e-8, 1e-3, 0.03)):
        if -2 <= mu / b <= 0.125:
            rough, true = fastslow.FastSlow(Doubles, 1, b, mu), FastSlow(digits(60 + 300), 1, b, mu)
            for name in CONSTANTS:
                worst = max(worst, float(abs(getattr(rough, name) / getattr(true, name) - 1)))
    return worst


CONSTANTS = ("fast_rate", "slow_rate", "gap", "lift", "line", "fast_x", "fast_y", "fast_s", "fast_z", "slow_z", "turn")


class TextbookRoot(FastSlow):
    """The slow root as the difference of two nearly equal numbers."""

    def __init__(self, m, a, b, mu):
        super().__init__(m, a, b, mu)
        self.slow_rate = (-b + math.copysign(math.sqrt(b * b - 4 * mu * b), b)) / (2 * mu)


class TextbookLift(FastSlow):
    """1 + lambda as a sum."""

    def __init__(self, m, a, b, mu):
        super().__init__(m, a, b, mu)
        self.lift = 1 + self.slow_rate


class TextbookLine(FastSlow):
    """The slow line without its term of order mu."""

    def __init__(self, m, a, b, mu):
        super().__init__(m, a, b, mu)
        self.line = a / b


class TextbookShares(FastSlow):
    """The shares of the fast part from the difference of the roots."""

    def __init__(self, m, a, b, mu):
        super().__init__(m, a, b, mu)
        self.slow_z = mu * (b - 1) / b * (-b + math.copysign(math.sqrt(b * b - 4 * mu * b), b)) / (2 * mu)


@pytest.mark.parametrize("textbook", [TextbookRoot, TextbookLift, TextbookLine, TextbookShares])
def test_a_textbook_constant_in_its_place_would_break_the_bound(textbook, monkeypatch):
    monkeypatch.setattr(fastslow, "FastSlow", textbook)
    assert worst_constant() > 1e-9


def textbook_superposition(segment, t, responses):
    """Particular solution and partial fractions at every time, short or not."""
    mode = segment.mode
    if mode.m is not Doubles:
        return superposed(segment, t, responses)
    rate, g, h, _ = mode.responses(t)
    rest = mode.a / mode.b
    s = rest + (segment.s0 - rest) * rate + segment.y0 * g
    x = rest + (segment.x0 - rest) * (rate + mode.beta * g) + segment.y0 * g
    z = segment.z0 + mode.a * t / mode.b + mode.fall * ((segment.s0 - rest) * g + segment.y0 * h)
    return x, s - x, s, z, mode.a - mode.b * s


def coarse_plane(segment, t):
    x, y, s, z, thrust = segment.state(t)
    return (t, (x, y, s, z - z, thrust)) if segment.mode.m is Doubles else on_plane(segment, t)


def coarse_level(segment, level, t):
    x, _, _, z, thrust = segment.state(t)
    return (t, (x, level - x, level, z, thrust)) if segment.mode.m is Doubles else on_level(segment, level, t)


def exponential_balance(base, k, fast, rate, *rest):
    """The fast part at its root from its exponential, whose exponent is rounded."""
    found = balance(base, k, fast, rate, *rest)
    return found and (found[0], fast * math.exp(rate * found[0]), found[2])


def state_only(flow_, case, x, s):
    return None


SWAPS = {
    "expm1": ([Doubles], "expm1", staticmethod(lambda p: math.exp(p) - 1), (0.6, 0.05, (0.0, 1e9, 1.0), 1e-9)),
    "superposition": ([superposition], "superposed", textbook_superposition,
                      (1e-8, 1e-3, (0.4, 0.3, -0.2), 5.0)),
    "state where z = 0": ([segments], "on_plane", coarse_plane, (1.86, 6.38, (-0.265, 0.0263, -173.6), 11.1)),
    "fast part at an event": ([shortcut], "_balance", exponential_balance, (2.41, 1e-295, (-1.75, 0.46, -1.3), 3.0)),
    "state on an edge": (
        [segments],
        "on_level",
        coarse_level,
        (-0.009132168110426568, 384.5635289468976, (1.1645882230637756, 270504.0508388527, -22.365777589991062), 91.53),
    ),
    "deviation from the unstable line": (
        [starts],
        "_from_unstable_line",
        state_only,
        (1.0, 1e-3, (0.3, -1.2987025935171457 + 1e-12, 1.0), 5.0),
    ),
}


@pytest.mark.parametrize("name", SWAPS)
def test_a_textbook_form_in_its_place_would_break_the_bound(name, monkeypatch):
    modules, attribute, textbook, scene = SWAPS[name]
    assert error_of(*scene) <= BOUND
    for module in modules:
        monkeypatch.setattr(module, attribute, textbook)
    assert error_of(*scene) > BOUND


def test_partial_fractions_would_fail_at_the_coalescence():
    assert error_of(1.0, 0.25, (1.0, 2.0, -0.5), 5.0) <= BOUND
    with pytest.raises(ZeroDivisionError):
        FastSlow(Doubles, 0, 1.0, 0.25)
    beside = FastSlow(Doubles, 0, 1.0, 0.25 * (1 - 1e-14)).start(1.0, 2.0, 3.0, 0.0).state(2.0)
    true = SmoothMode(digits(40), 0, 1, 0.25 * (1 - 1e-14)).start(1, 2, 3, 0).state(2)
    assert abs(beside[0] - true[0]) > 100 * BOUND


def test_the_textbook_root_loses_more_the_smaller_mu_is():
    for mu, lost in ((1e-8, 1e-10), (1e-12, 1e-6)):
        true = FastSlow(Doubles, 1, 1.0, mu).slow_rate
        assert abs(TextbookRoot(Doubles, 1, 1.0, mu).slow_rate / true - 1) > lost


@given(root=st.floats(1e-6, 1 - 1e-6), power=st.integers(1, 9), sign=st.sampled_from([-1, 1]))
def test_a_bracketed_root_is_found_whatever_its_slope(root, power, sign):
    exponent = 2 * power - 1

    def curve(t):
        slope = exponent * (t - root) ** (exponent - 1)
        return sign * (t - root) ** exponent, t - (t - root) ** exponent / slope if slope else -1

    found = bracketed_root(Doubles, curve, 0.0, 1.0, sign)
    assert abs(found - root) < 1e-3 * root


def test_an_exponential_overshot_by_thousands_of_time_constants_is_still_solved():
    m = digits(50)

    def curve(t):
        return m.exp(30 * t) - 5, t - (1 - 5 * m.exp(-30 * t)) / 30

    assert abs(bracketed_root(m, curve, m.zero, m.mpf(10) ** 4, 1) - m.log(5) / 30) < 1e-30
