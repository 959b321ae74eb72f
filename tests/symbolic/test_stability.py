"""Eigenvalues, exactly and as series, against the matrices themselves."""

import pytest
import sympy as sp

from asympk.errors import InputError, NotDerivable, OrderError
from asympk.symbolic import stability
from asympk.symbolic.manifold import slow_manifolds
from asympk.symbolic.system import Friction, System
from asympk.systems import painleve_klein as pk

SYSTEM = pk.system()
SPECTRA = {spectrum.mode: spectrum for spectrum in stability.eigenvalues(SYSTEM)}
STIFFNESS = {"slip_same": pk.sigma + 4, "slip_opposite": -pk.sigma, "stick": sp.Integer(1)}


@pytest.mark.parametrize("mode", STIFFNESS)
def test_both_eigenvalues_are_roots_and_exhaust_the_polynomial(mode):
    spectrum, b = SPECTRA[mode], STIFFNESS[mode]
    assert sp.expand(spectrum.polynomial - (pk.mu * stability.LAMBDA**2 + b * stability.LAMBDA + b)) == 0
    assert sp.simplify(spectrum.slow * spectrum.fast - b / pk.mu) == 0
    assert sp.simplify(spectrum.slow + spectrum.fast + b / pk.mu) == 0
    assert spectrum.neutral == 1


@pytest.mark.parametrize("mode", STIFFNESS)
def test_the_series_of_both_eigenvalues_have_catalan_coefficients(mode):
    spectrum, b = SPECTRA[mode], STIFFNESS[mode]
    slow = stability.series_in_mu("slow", spectrum, 6)
    fast = stability.series_in_mu("fast", spectrum, 6)
    for k in range(7):
        assert sp.cancel(slow[k] + sp.catalan(k) / b**k) == 0
        assert sp.cancel(fast[k] - (-b if k == 0 else sp.catalan(k - 1) / b ** (k - 1))) == 0


@pytest.mark.parametrize(
    ("sigma", "mode"), [(1, "slip_same"), (1, "slip_opposite"), (sp.Rational(-3, 2), "slip_opposite"), (0, "stick")]
)
def test_the_matrix_has_these_eigenvalues_to_forty_digits(sigma, mode):
    at = {pk.sigma: sigma, pk.mu: sp.Rational(1, 1000)}
    b = STIFFNESS[mode].subs(at)
    matrix = sp.Matrix([[0, 1], [-b / at[pk.mu], -b / at[pk.mu]]])
    expected = sorted(root.evalf(50) for root in matrix.eigenvals())
    found = sorted((SPECTRA[mode].slow.subs(at).evalf(50), SPECTRA[mode].fast.subs(at).evalf(50)))
    assert all(abs(a / b - 1) < sp.Rational(1, 10**40) for a, b in zip(found, expected, strict=True))


def test_node_turns_to_focus_where_the_series_stops_converging():
    for mode, b in STIFFNESS.items():
        assert sp.cancel(SPECTRA[mode].coalescence - b / 4) == 0
        assert SPECTRA[mode].radius == sp.Abs(SPECTRA[mode].coalescence)


def test_a_bound_on_mu_tells_nodes_from_foci():
    end = 1 + pk.sigma / 4
    assert SPECTRA["slip_same"].kinds == (("stable node", pk.mu < end), ("stable focus", pk.mu > end))


@pytest.mark.parametrize(
    ("mode", "sigma", "mu", "kind"),
    [
        ("slip_same", 1, "1/100", "stable node"),
        ("slip_same", 1, 2, "stable focus"),
        ("slip_opposite", 1, "1/100", "saddle"),
        ("slip_opposite", 1, 100, "saddle"),
        ("slip_opposite", -1, "1/5", "stable node"),
        ("slip_opposite", -1, "1/3", "stable focus"),
        ("stick", 1, "1/5", "stable node"),
        ("stick", 1, "1/3", "stable focus"),
    ],
)
def test_kinds_agree_with_the_signs_of_the_eigenvalues(mode, sigma, mu, kind):
    spectrum = SPECTRA[mode]
    assert spectrum.kind(sigma=sigma, mu=mu) == kind
    values = [v.subs({pk.sigma: sigma, pk.mu: sp.Rational(mu)}).evalf() for v in (spectrum.slow, spectrum.fast)]
    assert ("focus" in kind) == any(value.is_real is False for value in values)
    assert ("saddle" in kind) == (sp.re(values[0]) * sp.re(values[1]) < 0)


@pytest.mark.parametrize(("small", "kind"), [("1/10", "stable node"), ("1/2", "stable focus"), (2, "stable node")])
def test_a_discriminant_quadratic_in_mu_bounds_the_foci_on_both_sides(small, kind):
    x, y = sp.symbols("x y", real=True)
    a = sp.Symbol("a", positive=True)  # (1 + a mu)^2 = 4 (1 + a) mu: at mu = 1/9 and at mu = 1 for a = 3
    (spectrum,) = stability.eigenvalues(System.smooth({x: y - a * x}, {y: -x - y}, pk.mu), at={x: 0, y: 0})
    at = {a: 3, pk.mu: sp.Rational(small)}
    assert [name for name, condition in spectrum.kinds if condition.subs(at) == sp.true] == [kind]


def test_no_kind_is_listed_that_the_assumptions_exclude():
    assert {name for name, _ in SPECTRA["slip_same"].kinds} == {"stable node", "stable focus"}
    assert {name for name, _ in SPECTRA["slip_opposite"].kinds} == {"saddle", "stable node", "stable focus"}
    assert dict(SPECTRA["slip_opposite"].kinds)["saddle"] == (pk.sigma > 0)
    assert SPECTRA["slip_opposite"].hyperbolic == sp.Ne(pk.sigma, 0)


def test_on_a_boundary_or_with_a_value_missing_the_kind_is_refused():
    with pytest.raises(InputError, match="boundary"):
        SPECTRA["slip_opposite"].kind(sigma=0, mu=1)
    with pytest.raises(InputError, match="mu not given"):
        SPECTRA["slip_opposite"].kind(sigma=1)


@pytest.mark.parametrize("order", [-1, 1.5, True, "2"])
def test_an_order_that_is_not_a_whole_number_is_refused(order):
    with pytest.raises(OrderError, match="whole number"):
        stability.series_in_mu("slow", SPECTRA["stick"], order)


def test_a_nonlinear_mode_is_refused_by_name():
    x, y, mu = sp.symbols("x y mu")
    with pytest.raises(NotDerivable, match="not linear"):
        stability.eigenvalues(System.smooth(slow={x: y}, fast={y: (1 - x**2) * y - x}, small=mu))


a, b = sp.symbols("a b", real=True)
SQUARES_AND_BOUNDS = {
    "a rate that is a square": ((1, (a - b) ** 2), sp.true),
    "a stiffness that is a square": ((1, 1, (a - b) ** 2), sp.true),
    "a stiffness that may reach its bound": ((1, 1, a - b), a >= b),
    "a damping that may reach its bound": ((1, a, 1), a >= 0),
    "a damping that is a square": ((1, a**2, 1), sp.true),
    "three rates": ((1, b**2, 2, a**2), sp.true),
}


@pytest.mark.parametrize("name", SQUARES_AND_BOUNDS)
@pytest.mark.few(2)
def test_a_kind_is_told_just_where_numbers_tell_it_squares_and_closed_bounds_included(name):
    (_, *coefficients), assumptions = SQUARES_AND_BOUNDS[name]
    states = sp.symbols(f"x:{len(coefficients)}")
    last = -sum(c * x for c, x in zip(reversed(coefficients), states, strict=True))
    system = System.smooth(dict(zip(states, (*states[1:], last), strict=True)), {}, None, assumptions=assumptions)
    (found,) = stability.eigenvalues(system)
    for at in ({a: p, b: q} for p in (-1, 0, 1, 3) for q in (0, 1, 3)):
        if assumptions.subs(at) == sp.true:
            told = [kind for kind, condition in found.kinds if condition.subs(at) == sp.true]
            assert told == kind_of_numbers(found, {s: at[s] for s in found.polynomial.free_symbols & {a, b}})


def kind_of_numbers(spectrum, values):
    try:
        return [spectrum.kind(values)]
    except InputError:
        return []


def test_eigenvalues_that_meet_at_a_negative_mu_have_that_as_their_radius():
    x, y = sp.symbols("x y")
    mu = sp.Symbol("mu", positive=True)
    (found,) = stability.eigenvalues(System.smooth({x: y}, {y: 2 * x - a * y}, mu))
    assert (found.coalescence, found.radius) == (-(a**2) / 8, a**2 / 8)


x, v, F = sp.symbols("x v F", real=True)


KINKS = [10 * sp.Max(x, 0), sp.Abs(x), sp.Abs(v), sp.sign(x), sp.Piecewise((0, x < 0), (x, True)), sp.floor(x)]


@pytest.mark.parametrize("force", KINKS)
def test_at_a_kink_or_a_jump_of_the_rates_there_is_no_spectrum(force):
    with pytest.raises(NotDerivable, match="kink or a jump at x = 0, v = 0"):
        stability.eigenvalues(System.smooth({x: v, v: -x - force}, {}, None), at={x: 0, v: 0})


@pytest.mark.parametrize(
    ("force", "place", "stiffness"),
    [(10 * sp.Max(x, 0), 1, 11), (v * sp.Abs(v), 0, 1), (sp.Max(x, 0) ** 2, 0, 1), (10 * sp.Max(x - 1, 0), 0, 1)],
)
def test_beside_a_kink_and_where_the_slopes_of_both_sides_agree_there_is_one(force, place, stiffness):
    rest = {x: place, v: 0}
    system = System.smooth({x: v, v: (x + force).subs(rest) - x - force}, {}, None)
    (found,) = stability.eigenvalues(system, at=rest)
    assert found.polynomial == stability.LAMBDA**2 + stiffness


def test_a_mode_that_does_not_hold_at_a_rest_state_has_no_spectrum_there():
    belt = Friction(velocity=v - 1, force=F, load=1, kinetic=sp.Rational(1, 2))
    block = System.with_frictions({x: v, v: F - x}, {}, [belt])
    assert [s.mode for s in stability.eigenvalues(block, at={x: "1/2", v: 0})] == ["slip_opposite"]


y = sp.Symbol("y", real=True)
m = sp.Symbol("m", positive=True)


@pytest.mark.parametrize(
    ("rate", "slow"), [(sp.exp(m), -1), (sp.sqrt(4 + m), -2), (sp.sin(a * m) / m, -a), (1 / (1 + m), -1)]
)
def test_a_rate_that_is_no_polynomial_in_mu_has_a_spectrum_to_leading_order(rate, slow):
    (found,) = stability.eigenvalues(System.smooth({x: -x * rate}, {y: x - 3 * y}, m))
    assert found.slow_rates == (slow,)
    assert found.fast_rates == (-3,)


def test_a_spectrum_with_a_root_of_the_states_as_a_factor_has_its_eigenvalues():
    """On y = asin(x) the Jacobian of x - sin(y) is -sqrt(1 - x^2); to show it ended in a TypeError."""
    x, y, mu = sp.symbols("x y mu", real=True)
    system = System.smooth({x: 1 - x}, {y: x - sp.sin(y)}, mu)
    found = {m.branch[y]: s for m in slow_manifolds(system, order=0) for s in stability.eigenvalues(system, on=m)}
    assert {branch: (s.slow_rates, s.fast_rates) for branch, s in found.items()} == {
        sp.asin(x): ((-1,), (-sp.sqrt(1 - x**2),)), sp.pi - sp.asin(x): ((-1,), (sp.sqrt(1 - x**2),))}


def test_a_spectrum_with_a_root_of_the_states_as_a_divisor_has_its_eigenvalues():
    """On y = sin(x) the Jacobian of x - asin(y) is -1/sqrt(1 - sin(x)^2); it was a PolynomialError."""
    x, y, mu = sp.symbols("x y mu", real=True)
    system = System.smooth({x: 1 - x}, {y: x - sp.asin(y)}, mu)
    (found,) = (s for m in slow_manifolds(system, order=0) for s in stability.eigenvalues(system, on=m))
    assert (found.slow_rates, found.fast_rates) == ((-1,), (-1 / sp.sqrt(1 - sp.sin(x) ** 2),))


@pytest.mark.parametrize(("slow", "fast"), [(1 / m, 1), (1, 1 / m)])
def test_eigenvalues_that_grow_beyond_bounds_as_mu_vanishes_are_refused(slow, fast):
    with pytest.raises(InputError, match="no limit as m vanishes"):
        stability.eigenvalues(System.smooth({x: -x * slow}, {y: x - fast * y}, m))


@pytest.mark.further
def test_the_spectrum_of_quotients_in_quotients_is_refused_however_deep_they_are():
    """Fresh from its formula, the derivative of forty levels was beyond Python's depth of calls."""
    x, y, mu = sp.symbols("x y mu")
    quotient = x
    for _ in range(40):
        quotient = 1 / (2 + y * quotient)
    with pytest.raises(NotDerivable, match="depend on the state"):
        stability.eigenvalues(System.smooth({x: -x}, {y: quotient - y}, mu))
