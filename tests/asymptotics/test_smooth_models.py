"""Smooth slow-fast systems: base points, reduced flows and composites against exact solutions and stiff integrators."""

import math
import sys
from fractions import Fraction
from functools import cache, partial
from time import process_time

import mpmath
import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.special import airy, ellipj

import asympk as ap
from asympk.asymptotics import landing, reduced
from asympk.asymptotics.fibre import formulas
from asympk.asymptotics.landing import land, root
from asympk.asymptotics.stiff import jacobian
from asympk.errors import InputError, NotDerivable, NotNormallyHyperbolic, OrderError, OutOfRange, UnknownName
from asympk.studies import ladder
from asympk.studies.ladder import distance

x, y, u, v, w, T = sp.symbols("x y u v w T", real=True)
mu = sp.Symbol("mu", positive=True)
kappa, lambda_, a, b = sp.symbols("kappa lambda a b", positive=True)

LINEAR = ap.System.smooth(slow={x: -x + y}, fast={y: x - 2 * y}, small=mu)
ENZYME = ap.System.smooth(slow={x: -x + (x + kappa - lambda_) * y}, fast={y: x - (x + kappa) * y}, small=mu)
CUBIC = ap.System.smooth(slow={x: -x * y}, fast={y: x - y - y**3 + mu * sp.sin(y)}, small=mu)
FOUR = ap.System.smooth(
    slow={x: -x + u * v, w: x - w * u},
    fast={u: -2 * u + v + x + u * v / 4, v: -u - 3 * v + w**2},
    small=mu,
)
VAN_DER_POL = ap.System.smooth(slow={x: -y}, fast={y: x + y - y**3 / 3}, small=mu)
PENDULUM = ap.System.smooth(slow={x: v, v: -sp.sin(x)}, fast={y: x - y}, small=mu)
SCENES = {
    "enzyme": (ENZYME, {kappa: 1, lambda_: "1/2"}, {x: 1, y: 0}),
    "cubic": (CUBIC, {}, {x: 1, y: 2}),
    "four": (FOUR, {}, {x: 1, w: "1/2", u: -1, v: 1}),
    "van der Pol": (VAN_DER_POL, {}, {x: 1, y: "1/2"}),
}


def _states(system):
    mode = system.modes[0]
    return (*mode.slow, *mode.fast)


@cache
def _truth(name, small, until):
    """Return the states as functions of time by Radau at a tight tolerance."""
    system, values, start = SCENES[name]
    given = {s: sp.Rational(c) for s, c in {**values, mu: small}.items()}
    mode, states = system.modes[0], _states(system)
    rates = [r.subs(given) for r in mode.slow.values()] + [r.subs(given) / given[mu] for r in mode.fast.values()]
    rhs = sp.lambdify(states, rates)
    jac = sp.lambdify(states, sp.Matrix(rates).jacobian(states))
    begin = [float(sp.Rational(start[s])) for s in states]
    return solve_ivp(lambda _, q: rhs(*q), (0, until), begin, "Radau", rtol=1e-12, atol=1e-13,
                     jac=lambda _, q: np.array(jac(*q), dtype=float), dense_output=True).sol


def _path(name, small, until, method="jump", order=1):
    system, values, start = SCENES[name]
    return _solved(system, {**values, mu: small}, start, until, method, order)


def _solved(system, values, start, until, method="jump", order=1):
    return ap.solve(ap.Scene(system=system, values=values, start=start, until=until), method, order=order)


def _ends(system, values, start, until):
    """Return the last states by Radau."""
    return ap.solve(ap.Scene(system=system, values=values, start=start, until=until), "radau", rtol=1e-11).final


def test_the_base_point_of_a_linear_system_is_that_of_its_eigenvectors():
    m = sp.Symbol("m", positive=True)
    total, product = -1 - 2 / m, 1 / m
    slow, fast = ((total + s * sp.sqrt(total**2 - 4 * product)) / 2 for s in (1, -1))
    exact = sp.series(sp.simplify((3 - (fast + 1)) / (slow - fast)), m, 0, 5).removeO()
    found = land(formulas(LINEAR.modes[0], mu, ()), 4, (1.0,), (3.0,), ()).base
    assert found.ravel() == pytest.approx([float(exact.coeff(m, k)) for k in range(5)], abs=1e-11)


@pytest.mark.parametrize("slopes", [("1/10", "-1/2", "3/2", "-1/10"), ("3/10", "-13/10", "7/10", "-3/10")])
def test_a_centre_is_refused_as_one_though_rounding_gives_its_eigenvalues_a_negative_real_part(slopes):
    """The trace is 0; with -7e-18 for the real part, 20,000 steps were taken of a layer that never decays."""
    first, second, third, last = map(sp.Rational, slopes)
    centre = ap.System.smooth({x: -x}, {u: first * u + second * v + x, v: third * u + last * v}, mu)
    scene = ap.Scene(system=centre, values={mu: "1e-3"}, start=[1, 0, 0], until=1)
    with pytest.raises(OutOfRange, match=r"does not attract, so no layer fades.*: the largest real part .* is 0 for"):
        ap.solve(scene, "jump")


def test_a_branch_attracts_at_a_rate_that_is_less_than_the_rounding_of_a_faster_one():
    """The slow manifold is v = x / (1 - mu)."""
    decaying = ap.System.smooth({x: -x}, {u: -(10**16) * (u - x), v: x - v}, mu)
    path = ap.solve(ap.Scene(system=decaying, values={mu: "1e-3"}, start=[1, 1, 1], until=1), "jump")
    assert path.final == pytest.approx([math.exp(-1), math.exp(-1), math.exp(-1) / 0.999], rel=2e-6)


def test_the_slow_motion_in_numbers_is_that_of_the_symbolic_expansion():
    known = formulas(FOUR.modes[0], mu, ())
    branch = root(known, (1.0, 0.5), (0.0, 0.0), ())
    at = {x: 1.0, w: 0.5, mu: 0.01, **dict(zip((u, v), branch, strict=True))}
    manifold = ap.slow_manifold(FOUR, order=2)
    flow = ap.reduced_flow(manifold)
    assert known.height(2)(1.0, 0.5, *branch, 0.01) == pytest.approx([float(manifold.expr[s].subs(at)) for s in (u, v)])
    assert known.flow(2)(1.0, 0.5, *branch, 0.01) == pytest.approx([float(flow[s].subs(at)) for s in (x, w, u, v)])


@pytest.mark.parametrize(("system", "point", "p"), [(FOUR, (1.0, 0.5), ()), (ENZYME, (1.0,), (1.0, 0.5))])
def test_what_each_power_of_mu_adds_sums_up_to_the_slow_motion(system, point, p):
    known = formulas(system.modes[0], mu, (kappa, lambda_)[: len(p)])
    at = known.on_branch(point, root(known, point, (0.0,) * len(known.fast_states), p))
    for order in range(4):
        whole = known.height(order)(*at, 0.1, *p), known.flow(order)(*at, 0.1, *p)
        assert np.sum(known.terms(order)(*at, 0.1, *p), axis=0) == pytest.approx([*whole[0], *whole[1]], rel=1e-13)


@pytest.mark.parametrize(("system", "point", "p"), [(FOUR, (1.0, 0.5), ()), (ENZYME, (1.0,), (1.0, 0.5))])
def test_attraction_is_the_jacobian_of_the_fast_rates_on_the_manifold_to_order_0(system, point, p):
    known = formulas(system.modes[0], mu, (kappa, lambda_)[: len(p)])
    branch = root(known, point, (0.0,) * len(known.fast_states), p)
    found = known.attraction(*known.on_branch(point, branch), 0.1, *p)
    assert found == pytest.approx(known.jacobian(*point, *branch, *p), rel=1e-13)


def _formulas_asked(call):
    """Return how often compiled formulas are called."""
    asked, before = [0], sys.getprofile()
    sys.setprofile(lambda frame, event, _: asked.append(event == "call" and frame.f_code.co_name == "compiled"))
    try:
        call()
    finally:
        sys.setprofile(before)
    return sum(asked)


def test_what_an_error_remembers_takes_two_formulas_at_a_point():
    known = formulas(ENZYME.modes[0], mu, (kappa, lambda_))
    found = reduced.follow_reduced_flow(known, 1, np.array([1.0]), 1e-4, (1.0, 0.5), 1.0)
    found.remembered(0.5, (1, 2))  # compiles
    assert 0 < _formulas_asked(lambda: found.remembered(1.0, (1, 2))) <= 2 * len(found.recent[0])


def test_a_jump_of_a_reaction_takes_few_formulas():
    scene = ap.Scene(system=ENZYME, values={kappa: 1, lambda_: "1/2", mu: "1e-4"}, start={x: 1, y: 0}, until=1)
    ap.solve(scene, "jump")  # compiles
    assert 0 < _formulas_asked(lambda: ap.solve(scene, "jump")) < 150


@pytest.mark.few(0)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_composite_is_wrong_by_mu_to_the_next_power_uniformly(name, order):
    system, _, start = SCENES[name]
    constants = []
    for small in ("1/50", "1/200"):
        path, truth = _path(name, small, 0.5, order=order), _truth(name, small, 0.5)
        h = float(sp.Rational(small))
        t = np.concatenate([np.linspace(0, 8 * h, 40), np.linspace(8 * h, 0.5, 20)])
        constants.append(np.abs(path(t) - truth(t)).max() / h ** (order + 1))
    assert constants[1] == pytest.approx(constants[0], rel=0.5)
    assert path(0) == pytest.approx([float(sp.Rational(start[s])) for s in _states(system)], abs=10 * h ** (order + 1))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.few(1)
def test_the_predicted_error_bounds_the_error_and_tends_to_it(name, order):
    path, truth = _path(name, "1/200", 0.5, order=order), _truth(name, "1/200", 0.5)(0.5)
    error = np.abs(np.array(path.final) - truth).max() / max(1, np.abs(truth).max())
    assert error < path.error < 1.2 * error + 1e-11


@pytest.mark.parametrize("order", range(5))
@pytest.mark.parametrize(("rate", "force"), [((10 * mu) ** 4, 0), (0, (10 * mu) ** 3), (0, (5 * mu) ** 7)])
def test_powers_of_mu_beyond_those_expanded_are_predicted(rate, force, order):
    path = _solved(ap.System.smooth({x: rate - x}, {y: x - y + force}, mu), {mu: "1/40"}, {x: 1, y: 2}, 1, order=order)
    true = ap.solve(path.scene, digits=20).final
    assert path.scene.system.parameters == (mu,)
    assert distance(path.final, true) < path.error < 15 * distance(path.final, true)


def test_a_layer_that_is_over_leaves_no_more_than_the_error_of_its_steps():
    """Within the last steps, as long as the layer, their interpolation was wrong by ten times the predicted error."""
    system = ap.System.smooth({}, {u: v - u / 2 - sp.atan(u) / 8, v: sp.atan(v) / 4 - v}, mu)
    for tau in range(30, 90, 5):
        path = _solved(system, {mu: "1/50"}, {u: -1, v: "7/8"}, Fraction(tau, 50))
        assert max(map(abs, path.final)) < path.error + math.exp(-tau / 2)


def test_states_at_an_array_of_times_are_as_accurate_as_the_state_at_each():
    """Two fast states apart by a factor of 50: interpolation in the long steps of the layer was off by 1e-9."""
    system = ap.System.smooth({x: -u}, {u: x - u - u**2 / 10, v: 50 * (u - v)}, mu)
    path = _solved(system, {mu: "1/1000"}, {x: 1, u: 2, v: 0}, "1/2", order=4)
    times = np.linspace(0, 0.01, 101)
    off = path(times) - np.transpose([path(t) for t in times])
    assert np.abs(off).max() < 1e-11


def test_a_manifold_of_order_two_from_the_start_itself_is_wrong_by_order_mu():
    known = formulas(ENZYME.modes[0], mu, (kappa, lambda_))
    start, errors = np.array(known.on_branch((1.0,), (0.5,))), []
    for small in ("1/50", "1/200"):
        h = float(sp.Rational(small))
        found = reduced.follow_reduced_flow(known, 2, start, h, (1.0, 0.5), 0.5).states(0.5)[0]
        errors.append(abs(found[0] - _truth("enzyme", small, 0.5)(0.5)[0]) / h)
    assert errors[1] == pytest.approx(errors[0], rel=0.05)
    assert errors[1] > 0.1


def test_slow_is_the_composite_without_its_layer():
    jump, slow = (_path("cubic", "1/100", 0.5, method) for method in ("jump", "slow"))
    assert slow.final == pytest.approx(jump.final, abs=1e-12)
    assert abs(slow(0)[1] - 2) > 1
    inside, outside = (_path("cubic", "1/100", t, "slow") for t in (0.01, 0.5))
    assert inside.error > 0.01 > outside.error


def test_a_fold_stops_the_reduced_flow_by_name_with_the_state_reached():
    with pytest.raises(NotNormallyHyperbolic, match=r"lost at t = .*, x = -0\.6.*, y = 1\..* before a fold"):
        _path("van der Pol", "1/10000", 3)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_fold_is_named_where_higher_terms_outgrow_all_bounds_before_it_and_states_by_their_names(order):
    toe = ap.System.smooth(slow={u: -1}, fast={v: u - v**2}, small=mu)
    with pytest.raises(NotNormallyHyperbolic, match=r"lost at t = 0\.99.*, u = 0\.00.*, v = 0\.0.* before a fold"):
        _solved(toe, {mu: "1e-5"}, {u: 1, v: 2}, 2, order=order)


def test_implicit_steps_of_a_slow_motion_count_as_the_explicit_ones_that_take_as_long(monkeypatch):
    """Near its fold the manifold of order 3 of the prey meets the pole of x', where 19900 implicit steps took 25 s."""
    taken = []
    monkeypatch.setattr(reduced, "jacobian", lambda flow, at: taken.append(at) or jacobian(flow, at))
    monkeypatch.setattr(reduced, "STEPS", 4000)
    monkeypatch.setattr(reduced, "MORE", 1000)
    eaten = x * y / (y + sp.Rational(321, 1000))
    prey = ap.System.smooth({x: eaten - x * sp.Rational(447, 500)}, {y: y * (1 - y / sp.Rational("1.783")) - eaten}, mu)
    with pytest.raises(OutOfRange, match="its steps become too small"):
        _solved(prey, {mu: "1/164"}, {x: "0.611", y: "1.926"}, "1.556")
    assert 100 < len(taken) <= 400


@pytest.mark.parametrize("small", ["1e-100", "1e-300"])
def test_a_layer_is_followed_however_small_the_parameter_is(small):
    """It ends where y + y^3 = 1; then x = y + y^3, and 1/y - 2 atan(y) grows as the time: rates overflowed before."""
    x_end, y_end = _solved(CUBIC, {mu: small}, {x: 1, y: 2}, 2).final
    first = brentq(lambda s: s + s**3 - 1, 0, 1)
    passed = 1 / y_end - 2 * math.atan(y_end) - (1 / first - 2 * math.atan(first))
    assert (x_end, passed) == pytest.approx((y_end + y_end**3, 2), rel=1e-11)


@pytest.mark.slow
def test_flows_to_several_orders_that_end_early_are_not_followed_again_to_a_finer_tolerance(monkeypatch):
    """The bristle of a speed that nearly stops: where that of order 4 does, both took 20000 steps of 1e-11."""
    taken, along = [], reduced._steps
    monkeypatch.setattr(reduced, "_steps", lambda formulas, kinds, *more: taken.append(len(kinds)) or along(
        formulas, kinds, *more))
    monkeypatch.setattr(reduced, "STEPS", 400)
    bristle = {y: v - abs(v) * y / (1 + sp.exp(-100 * v**2) / 2)}
    sliding = ap.System.smooth(slow={x: v, v: 1 - x - y}, fast=bristle, small=mu)
    with pytest.raises(NotNormallyHyperbolic, match="about as fast, as before a fold"):
        _solved(sliding, {mu: "1/100"}, {x: 0, v: 1, y: 0}, 2, "slow", 3)
    assert taken.count(3) == 1


def test_a_focus_that_ceases_to_attract_is_named_a_hopf_point():
    """The eigenvalues x - i and x + i of the fast part meet the imaginary axis at x = 0."""
    bautin = ap.System.smooth({x: sp.S.One}, {u: x * u - v - u**3, v: u + x * v - v**3}, mu)
    with pytest.raises(NotNormallyHyperbolic, match=r"lost at t = 1, .* before a Hopf point, or where mu"):
        _solved(bautin, {mu: "1/1000"}, {x: -1, u: "1/2", v: 0}, 2)


def _repelling(middle, width):
    return -1 + 2 * sp.exp(-(((x - middle) / width) ** 6))


def _focus(change):
    return {u: change * u - v + sp.Rational(1, 10), v: u + change * v}


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize(("fast", "lost"), [
    (_focus(_repelling(10, 4)), "t = 3.11851, .* before a Hopf point"),
    (_focus(_repelling(7, 1)), "t = 2.91771, .* before a Hopf point"),
    ({u: _repelling(10, 4) * u + mu**2}, "t = 2.83601, .* before a fold"),
    ({u: _repelling(sp.Rational(15, 2), 2) * u + mu**2}, "t = 2.62155, .* before a fold"),
    ({u: _repelling(7, 1) * u + mu**2}, "t = 2.91053, .* before a fold"),
])
def test_a_manifold_that_repels_for_a_while_is_lost_though_the_slow_motion_does_not_feel_it(fast, lost, order):
    system = ap.System.smooth({x: sp.Integer(2)}, fast, mu)
    with pytest.raises(NotNormallyHyperbolic, match=lost):
        _solved(system, {mu: "1/5"}, {x: 0, **dict.fromkeys(fast, 0)}, 10, order=order)


@pytest.mark.parametrize(("until", "more"), [(1, {}), (2, {}), (2, {u: y - 2 * u})])
@pytest.mark.parametrize("height", [sp.sqrt(x**2 - sp.S.One / 4), sp.log(x**2 - sp.S.One / 4), w * sp.acosh(2 * x)])
def test_a_manifold_that_has_no_value_for_a_while_is_lost_though_the_slow_motion_does_not_feel_it(height, until, more):
    """Where x = -1, y had its value again, of a motion that no rate leads through |x| < 1/2."""
    system = ap.System.smooth({x: -sp.S.One, w: -w}, {y: height - y, **more}, mu)
    with pytest.raises(NotNormallyHyperbolic, match=r"lost at t = 0\.5, .* no value beyond; take a smaller until$"):
        _solved(system, {mu: "1/1000"}, {x: 1, w: 1, y: 1, **dict.fromkeys(more, 1)}, until)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_layer_of_numbers_alone_is_that_of_an_exponential(order):
    relay = ap.System.smooth(slow={x: v - x}, fast={v: 1 - v}, small=mu)
    h, t = 0.01, 0.5
    path = _solved(relay, {mu: h}, {x: 0, v: 0}, t, order=order)
    # x = 1 - (e^{-t} - mu e^{-t/mu}) / (1 - mu), the last term beyond all orders
    error = path.final[0] - 1 + math.exp(-t) / (1 - h)
    assert error == pytest.approx(math.exp(-t) * h ** (order + 1) / (1 - h), rel=1e-6)
    assert path.final[1] == pytest.approx(1, abs=1e-15)


def test_layers_without_slow_states_are_the_whole_motion():
    alone = ap.System.smooth(slow={}, fast={v: 1 - v, w: v - w**3}, small=mu)
    path = _solved(alone, {mu: "1/100"}, {v: 0, w: 0}, 1, order=2)
    assert path.final == pytest.approx((1, 1), abs=1e-12)
    assert path(0.02)[0] == pytest.approx(1 - math.exp(-2), abs=1e-9)
    single = ap.System.smooth(slow={}, fast={v: 1 - v}, small=mu)
    assert _solved(single, {mu: "1/100"}, {v: 0}, "1/100").final[0] == pytest.approx(1 - math.exp(-1), abs=1e-12)


@pytest.mark.parametrize("order", [0, 1])
def test_a_state_that_only_rounding_moves_has_no_unit_of_its_size(order):
    x, w, y, small = sp.symbols("x w y mu", real=True)
    cancelling = (x + y) ** 3 - (x**3 + 3 * x**2 * y + 3 * x * y**2 + y**3)
    system = ap.System.smooth(slow={x: w - x, w: cancelling - w}, fast={y: sp.cos(x) - y}, small=small)
    scene = ap.Scene(system=system, values={small: "1e-3"}, start=("1/3", "1e-20", 1), until=3)
    path = ap.solve(scene, "jump", order=order)
    assert path.final[0] == pytest.approx(math.exp(-3) / 3, abs=path.error)
    assert abs(path.final[1]) < 1e-14


@pytest.mark.parametrize("size", ["1e-8", "1e-9", "1e-10"])
@pytest.mark.parametrize("order", [0, 1])
def test_a_small_state_has_a_unit_above_the_rounding_of_its_rate_by_terms_that_cancel(size, order):
    """Of x' = 1 - y rounding leaves errors of 1e-16: in units of x its steps were refused as too small."""
    system = ap.System.smooth({x: 1 - y}, {y: sp.exp(x) - y}, mu)
    path = _solved(system, {mu: "1/100"}, {x: size, y: 1}, 1, order=order)
    roots = np.roots([0.01, 1, 1])  # of the linear system, as x is small
    shares = np.linalg.solve([[1, 1], roots], [float(size), 0])
    assert abs(path.final[0] - shares @ np.exp(roots)) < path.error < float(size)


def test_errors_do_not_grow_beside_a_state_that_only_rounding_moves():
    """Two supports of a drawer yield alike but for 1e-21, beside which errors of 1e-13 were as large as the state."""
    one, two = x + y, u + v
    lean = (one - two) / 10
    drawer = ap.System.smooth(slow={x: y, u: v, w: mu * (y - v)},
                              fast={y: 1 - 2 * one - two + lean, v: 1 - one - 2 * two + lean}, small=mu)
    scene = ap.Scene(system=drawer, values={mu: "1e-5"}, start=(0,) * 5, until="1/2")
    path = ap.solve(scene, "jump", order=1)
    assert np.abs(np.subtract(path.final, ap.solve(scene).final)).max() < path.error < 1e-10


@pytest.mark.parametrize("size", ["1e8", "1e100", "1e300"])
def test_a_linear_system_is_followed_alike_at_every_size(size):
    linear = ap.System.smooth(slow={x: -x}, fast={y: x - 2 * y}, small=mu)
    once, many = (_solved(linear, {mu: "1/100"}, {x: start, y: 0}, 1) for start in (1, size))
    assert [v / float(size) for v in many.final] == pytest.approx(once.final, rel=1e-9)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("power", [1, 2])
def test_a_layer_that_fades_as_the_manifold_moves_does_not_hide_what_is_omitted(power, order):
    """y = p t e^{-p t}: to every order layer and manifold cancel, and so do the terms that tell the error."""
    even = ap.System.smooth(slow={x: -x}, fast={y: (x**power - y) * power / 1000}, small=mu)
    with pytest.raises(OutOfRange, match="is not small here"):
        _solved(even, {mu: "1/1000"}, {x: 1, y: 0}, 1, order=order)
    late = _solved(even, {mu: "1/1000"}, {x: 1, y: 0}, 5, order=order)
    assert abs(late.final[1] - 5 * power * math.exp(-5 * power)) < late.error


def test_a_start_on_a_repelling_branch_is_refused():
    with pytest.raises(OutOfRange, match="does not attract"):
        _solved(VAN_DER_POL, {mu: 0.01}, {x: 0, y: 0}, 1)


def test_a_start_that_the_layer_carries_to_infinity_is_refused():
    system = ap.System.smooth(slow={x: -x}, fast={y: y**2 - x}, small=mu)
    with pytest.raises(OutOfRange, match="grows beyond bounds"):
        _solved(system, {mu: 0.01}, {x: 1, y: 2}, 1)
    assert _solved(system, {mu: 0.01}, {x: 1, y: "1/2"}, 0.1).final[1] == pytest.approx(-1, abs=0.1)
    with pytest.raises(OutOfRange, match="the layer from v = 1 grows beyond bounds, or its rates do: after"):
        _solved(ap.System.smooth({}, {v: v**3}, mu), {mu: 0.01}, {v: 1}, 1, order=2)


@pytest.mark.parametrize(
    ("force", "until", "passed"),
    [(1 / (x - 1), 2, "x - 1 = 0"), (1 / (x - 1) ** 2, 2, "x - 1 = 0"), (sp.tan(x), 5, r"cos\(x\) = 0"),
     (1 / (x - 1) + sp.sign(x - 4), 2, "x - 1 = 0"), (sp.tan(x) + sp.sign(x - sp.Rational(9, 2)), 5, r"cos\(x\) = 0")],
)
@pytest.mark.parametrize("order", [0, 1])
def test_a_pole_that_slow_motion_does_not_feel_is_not_passed(force, until, passed, order):
    """x' = 1 goes on beyond, and y = tan(x) too, twice within 5; there is no such motion."""
    system = ap.System.smooth({x: sp.S.One}, {y: force - y}, mu)
    with pytest.raises(OutOfRange, match=f"have a pole, which the motion has passed before t = .*{passed}"):
        _solved(system, {mu: "1/1000"}, {x: 0, y: 1}, until, order=order)
    assert _solved(system, {mu: "1/1000"}, {x: 0, y: 1}, "1/2", order=order).error < 0.01


@pytest.mark.parametrize("order", [0, 1, 2])
def test_functions_of_parameters_need_no_series_of_their_own(order):
    """From the closed form of y' = (x - a y)/mu, x = e^-t, with a = gamma(1 + mu) + gamma(k): y tends to x/(a - mu)."""
    k, small, rate = sp.Symbol("k", positive=True), 0.01, math.gamma(1.01) + math.gamma(1.5)
    system = ap.System.smooth({x: -x}, {y: x - y * (sp.gamma(1 + mu) + sp.gamma(k))}, mu)
    path = _solved(system, {mu: "1/100", k: "3/2"}, {x: 1, y: 0}, 1, order=order)
    error = abs(path.final[1] - (math.exp(-1) - math.exp(-rate / small)) / (rate - small))
    assert error < path.error < 1.5 * error


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.few(1)
def test_the_predicted_error_depends_on_no_unit_of_the_small_parameter(order):
    """Henri's enzyme: in a unit of 1e-6 the error of order 2, 8e-9, was predicted as 5e-6."""
    errors = []
    for unit in (1, 10**3, 10**6, sp.Rational(1, 10**6)):
        enzyme = ap.System.smooth({x: (x + sp.S.Half) * y - x}, {y: (x - (x + 1) * y) * unit}, mu)
        errors.append(_solved(enzyme, {mu: sp.Rational(unit, 100)}, {x: 1, y: 0}, 1, order=order).error)
    assert errors == pytest.approx([errors[0]] * 4, rel=0.1)


@pytest.mark.parametrize("method", ["exact", "jump"])
def test_a_divisor_that_dies_out_with_its_states_is_no_pole(method):
    """Prey v and predator u decay for ever, and v/(u + v) is finite; in numbers u + v comes down to rounding."""
    share = v / (u + v)
    system = ap.System.smooth({u: u * (share - 1)}, {v: v * (1 - v) - 3 * u * share}, mu)
    with pytest.raises(OutOfRange, match=r"divided by u \+ v, of which only errors of the states are left by t = "):
        ap.solve(ap.Scene(system=system, values={mu: "1/100"}, start={u: 1, v: "1/2"}, until=100), method)


APART = {
    "a layer": ({x: -x + u}, {u: x - u, v: x**2 - 10000 * v}, (1, 0, 3)),
    "a layer that is not affine": ({x: -x * v + u}, {u: x - u - u**3, v: 10**4 * (x**2 + u * v - v - v**3)}, (1, 2, 3)),
    "a layer that turns": ({x: -x + u}, {u: x - u + 3 * v, v: -3 * u - v, w: 10**4 * (u - w)}, (1, 0, 3, -1)),
    "slow motion": ({x: -x + y, u: 10**5 * (x - u)}, {y: x - 2 * y + u}, (1, 3, 0)),
    "layers at an edge": ({x: -1 - y / 4}, {y: sp.sign(x) - y, v: 10**4 * (y - v)}, ("1/5", 0, 3)),
}


@pytest.mark.parametrize("name", APART)
@pytest.mark.few(1)
def test_rates_that_are_far_apart_are_followed_as_rightly_as_others(name):
    slow, fast, start = APART[name]
    small = "1e-7" if u in slow else "1e-4"
    scene = ap.Scene(system=ap.System.smooth(slow, fast, mu), values={mu: small}, start=start, until="1/4")
    path, truth = ap.solve(scene, "jump", order=1), ap.solve(scene, "radau", rtol=1e-9, atol=1e-11)
    assert distance(path.final, truth.final) < path.error < 1e-7
    times = np.array([1e-5, 1e-4, 1e-3]) if u not in slow else np.array([0.1, 0.2])
    assert path(times) == pytest.approx(truth(times), abs=1e-6)


@pytest.mark.parametrize("small", ["1/200", "1/2000"])
@pytest.mark.few(1)
def test_a_layer_whose_parts_are_as_far_apart_as_140_is_followed_to_the_highest_order(small):
    """A burst of Hindmarsh and Rose: accuracy, not stability, keeps explicit steps to order 4 short for 20000 steps."""
    burst = ap.System.smooth({w: 4 * x + 6 - w}, {x: y - x**3 + 3 * x**2 - w, y: 1 - 5 * x**2 - y}, mu)
    scene = ap.Scene(system=burst, values={mu: small}, start=(3, "-1.3", -8), until="1/2")
    path, truth = ap.solve(scene, "jump", order=4), ap.solve(scene, "radau", rtol=1e-11, atol=1e-11)
    assert distance(path.final, truth.final) < path.error + 1e-10 < 1e-5


def test_an_error_near_a_fold_is_predicted_by_the_state_whose_terms_fall_least():
    """Of the others the second term passes through 0 at the time from which they are continued."""
    rates = {x: y - x**3 + 3 * x**2 - w + 1, y: 1 - 5 * x**2 - y}
    neuron = ap.System.smooth({w: 4 * x + sp.Rational(32, 5) - w}, rates, mu)  # of Hindmarsh and Rose
    scene = ap.Scene(system=neuron, values={mu: "1/100"}, start=(2, "-1.2", -6), until="0.3")
    path, truth = ap.solve(scene, "jump", order=3), ap.solve(scene, "radau", rtol=1e-10, atol=1e-11)
    assert distance(path.final, truth.final) < path.error < 2e-3


@pytest.mark.parametrize("method", ["slow", "jump"])
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize(("drift", "force", "start"), [(-x + y / 2, y - y**3 + mu * x, (1, "-1/2000")),
                                                       (1, (y - x) * (1 - y**2), (0, "1/2000"))])
@pytest.mark.few(2)
def test_a_start_so_near_the_edge_of_a_basin_that_the_small_parameter_decides_is_refused(
    drift, force, start, order, method
):
    """The motion tends to the other branch than its limit; ten times as far from the edge both tend to the same."""
    system, (begun, near) = ap.System.smooth({x: drift}, {y: force}, mu), start
    side = round(math.copysign(1, Fraction(near)))
    words = rf"the layer leads to y = {-side} at t = .* in the limit to y = {side}: mu = 0.001 is not small"
    with pytest.raises(OutOfRange, match=words):
        _solved(system, {mu: "1/1000"}, {x: begun, y: near}, "1/4", method, order=order)
    far = _solved(system, {mu: "1/1000"}, {x: begun, y: 10 * Fraction(near)}, "1/4", method, order=order)
    assert far.final[1] == pytest.approx(side, abs=0.01)


EDGE = ap.System.smooth({x: -2 * x**2 / (1 + x**2)}, {y: x - y**2}, mu)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_start_that_the_small_parameter_lets_escape_to_infinity_is_refused(order):
    """The branch that repels rises over the start, which is above it in the limit mu -> 0."""
    with pytest.raises(OutOfRange, match="the layer of smooth from t = 0 grows beyond bounds"):
        _solved(EDGE, {mu: "1/10"}, (1, "-0.99"), "0.4", order=order)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_layer_that_lingers_at_the_edge_of_a_basin_is_as_wrong_as_is_said(order):
    path = _solved(EDGE, {mu: "1/10"}, (1, "-0.97"), "0.4", order=order)
    truth = _ends(EDGE, {mu: "1/10"}, (1, "-0.97"), "0.4")
    assert distance(path.final, truth) < path.error < 0.6


def test_a_layer_that_moves_slow_states_to_where_the_only_branch_repels_is_refused():
    system = ap.System.smooth({x: y}, {y: (x - 1) * y}, mu)
    with pytest.raises(OutOfRange, match=r"x = 0\.5 to about x = .* does not attract: mu = 0\.1 is not small"):
        _solved(system, {mu: "1/10"}, (sp.S.Half, 4), 2, order=0)
    assert _solved(system, {mu: "1/100"}, (sp.S.Half, 4), 2, order=0).error < 0.2


@pytest.mark.parametrize(("values", "start", "small", "until", "order"), [
    (("1.35", "0.2707", "-0.02243", "-0.8124", "0.01294"), ("0.8801", "-6.268"), "0.0141", "0.00621", 1),
    (("0.1337", "0.1132", "-0.2142", "-0.511", "0.8396"), ("0.05125", "-5.206"), "0.00703", "0.0436", 2),
])
def test_the_distance_by_which_a_composite_misses_its_start_fades_no_faster_than_the_branch_attracts(
    values, start, small, until, order
):
    drift, rate, turn, force, more = map(sp.Rational, values)
    system = ap.System.smooth({x: drift * y + more}, {y: force * x - (rate + sp.sin(turn * x)) * y}, mu)
    path = _solved(system, {mu: small}, start, until, order=order)
    assert distance(path.final, _ends(system, {mu: small}, start, until)) < path.error


def test_what_is_left_of_a_layer_counts_how_its_terms_have_grown_on_the_way_to_the_branch():
    """From y = 0.2, near the branch y = 0 that repels, the first term in mu grows to twice the limit."""
    force = (y - y**3 + 853 * u / 5000, 1063 * y / 10000 - u + x)
    system = ap.System.smooth({x: 137 * x / 1000 - 1729 * y / 2000}, dict(zip((y, u), force, strict=True)), mu)
    start = ("-0.1231", "0.2066", "0.2603")
    path = _solved(system, {mu: "0.0426"}, start, "0.307", "slow", order=2)
    assert distance(path.final, _ends(system, {mu: "0.0426"}, start, "0.307")) < path.error < 1e-3


def test_what_is_left_of_a_layer_counts_that_it_moves_slow_states_to_where_the_branch_attracts_more():
    drift = (4183 * y / 5000 - sp.Rational(2291, 1000)) * x
    force = (6899 * mu / 10000 - x - sp.Rational(1571, 5000)) * y
    system, start = ap.System.smooth({x: drift}, {y: force + 23 * y**2 / 1250}, mu), ("0.5882", "1.328")
    path = _solved(system, {mu: "0.156"}, start, "5.45", order=2)
    assert distance(path.final, _ends(system, {mu: "0.156"}, start, "5.45")) < path.error < 3e-4


def test_a_composite_that_is_near_no_branch_when_its_layer_is_over_is_refused_by_its_terms():
    system = ap.System.smooth({x: 10 * y - 1}, {y: x + y - y**3 / 3}, mu)
    with pytest.raises(OutOfRange, match=r"terms that order 2 omits amount to .* of the states"):
        _solved(system, {mu: "1/10"}, {x: "-3/5", y: 8}, "1/20", order=2)


@pytest.mark.parametrize("place", [-0.8, -0.85, -0.9, -0.95, -1.15])
def test_a_branch_is_not_followed_past_its_fold_to_another_branch(place):
    """y = 1.73 at x = 0 ends in the fold at x = -2/3, beyond which the only root is near y = -2."""
    known = formulas(ap.System.smooth({x: y}, {y: x + y - y**3 / 3}, mu).modes[0], mu, ())
    with pytest.raises(OutOfRange, match=rf"the base point x = {place} is off the branch"):
        reduced.branch_at(known, (place,), (math.sqrt(3),), (), (0.0,))
    assert reduced.branch_at(known, (-0.66,), (math.sqrt(3),), (), (0.0,))[1] == pytest.approx(1.08057, rel=1e-5)


def test_a_layer_to_a_double_root_settles_on_no_branch_though_its_rounding_seems_to_attract(monkeypatch):
    monkeypatch.setattr(landing, "STEPS", 2000)
    monkeypatch.setattr(landing, "SEARCHING", 2000)
    system = ap.System.smooth(slow={x: -x + y}, fast={y: x - 2 * y + y**2}, small=mu)
    for small in ("1/100", "1/10000"):
        with pytest.raises(OutOfRange, match=r"does not settle on an attracting branch|that does not attract"):
            _solved(system, {mu: small}, {x: 1, y: "1/10"}, 1, order=0)


@pytest.mark.parametrize("start", [0, 2])
def test_a_layer_whose_rates_take_too_many_steps_is_refused_as_that(start, monkeypatch):
    """A linear layer settles on its only branch, also where it is still far from it."""
    monkeypatch.setattr(landing, "STEPS", 50)
    system = ap.System.smooth({x: -x + u}, {u: x - u / 10000 + v, v: -u - v / 10000}, mu)
    with pytest.raises(OutOfRange, match=r"too many steps to settle on u = 0\.0001.*, v = -1"):
        _solved(system, {mu: "1/100"}, {x: 1, u: start, v: -1}, 1)


def test_a_layer_on_a_limit_cycle_is_refused_a_fifth_of_the_way_that_one_may_take_to_settle():
    radius = 1 - u**2 - v**2
    system = ap.System.smooth(slow={x: u}, fast={u: radius * u - v, v: radius * v + u}, small=mu)
    with pytest.raises(OutOfRange, match=f"does not settle on an attracting branch: after {landing.STEPS // 5} steps"):
        _solved(system, {mu: 0.01}, {x: 1, u: 2, v: 0}, 1)


def test_orders_and_numbers_that_are_not_known_are_refused():
    for order in (5, 1.0, "1", True, 10**5000):
        with pytest.raises(OrderError, match=r"method 'jump' takes whole orders 0 \.\. 4"):
            _path("cubic", "1/100", 1, order=order)
    assert _path("cubic", "1/100", 1, order=np.int64(1)).final == _path("cubic", "1/100", 1, order=1).final
    with pytest.raises(InputError, match="from 0 to until"):
        _path("cubic", "1/100", 1)(2)


def test_an_explicit_time_is_a_slow_state_more():
    t = sp.Symbol("t", real=True)
    system = ap.System.smooth(slow={x: sp.cos(t)}, fast={y: sp.sin(t) + x - y}, small=mu, time=t)
    path = _solved(system, {mu: "1/100"}, {x: 0, y: 1}, 2)
    # y' + y/mu = 2 sin(t)/mu has an elementary solution
    h = 0.01
    forced = 2 * (np.sin(2) - h * np.cos(2)) / (1 + h**2)
    assert path.final == pytest.approx((np.sin(2), forced), abs=3e-4)
    assert path.final[1] == pytest.approx(2 * (np.sin(2) - h * np.cos(2)), abs=1e-9)
    assert path(np.linspace(0, 2, 5)).shape == (2, 5)
    assert path(0)[1] == pytest.approx(1, abs=1e-3)


def test_the_closed_base_point_is_that_of_the_layer_followed_in_numbers():
    closed = ap.jump_map(ENZYME, order=2)
    at = {kappa: 1, lambda_: sp.Rational(1, 2), x: 1, y: sp.Rational(1, 5)}
    numbers = closed.at({"kappa": 1, "lambda": "1/2"}, {x: 1, y: "1/5"})["x"]
    assert numbers == pytest.approx([float(sp.sympify(closed[x].coefficient(k)).subs(at)) for k in range(3)], abs=1e-9)


@pytest.mark.further
@pytest.mark.parametrize(("slow", "fast"), [
    (y / (1 + x), x / (1 + x) - y / (2 + x)), (y**12 - x, x - y),
    (y * sp.tanh(x) + y**2 * sp.atan(x), sp.tanh(x) - sp.cosh(x) * y),
])
def test_a_base_point_is_closed_within_seconds_however_the_rates_depend_on_the_states(slow, fast):
    """In the rates themselves, written out, the coefficients of order 3 took minutes."""
    begun = process_time()
    closed = ap.jump_map(ap.System.smooth(slow={x: slow}, fast={y: fast}, small=mu), order=3)
    assert process_time() - begun < 10
    at = {x: sp.Rational(1, 3), y: sp.Rational(1, 2)}
    numbers = closed.at({}, at)["x"]
    assert numbers == pytest.approx([float(sp.sympify(closed[x].coefficient(k)).subs(at)) for k in range(4)], rel=1e-9)


@pytest.mark.parametrize("constant", [sp.EulerGamma, sp.GoldenRatio, sp.Catalan, sp.TribonacciConstant])
def test_the_composite_of_rates_with_any_constant_of_sympy_is_that_of_its_value(constant):
    a, b, c, small = sp.symbols("a b c mu", real=True)
    ends = []
    for value, given in ((constant, {}), (c, {"c": float(constant)})):
        system = ap.System.smooth({a: -a + b}, {b: a - (1 + value) * b + b**3 / 8}, small)
        scene = ap.Scene(system=system, values={"mu": "1e-3", **given}, start=(0.25, 0), until=1)
        ends.append(ap.solve(scene, method="jump", order=2).final)
    assert ends[0] == pytest.approx(ends[1], rel=1e-12)


def test_the_constants_of_the_rates_are_numbers_in_a_closed_base_point():
    a, b, small = sp.symbols("a b mu", real=True)
    closed = ap.jump_map(ap.System.smooth({a: -a + sp.pi * b}, {b: a - sp.E * b}, small), order=2)
    exact = [float(sp.sympify(closed[a].coefficient(k)).subs({a: 1, b: 2})) for k in range(3)]
    assert closed.at({}, {a: 1, b: 2})["a"] == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("rate", [0, 2, -3 * x])
def test_a_slow_state_that_the_fast_one_does_not_move_is_its_own_base_point(rate):
    found = ap.jump_map(ap.System.smooth({x: rate}, {y: x - 2 * y}, mu), order=2)[x]
    assert (found.coefficient(0), found.coefficient(1), found.coefficient(2)) == (x, 0, 0)


def test_a_base_point_is_closed_only_where_every_slow_rate_is_a_polynomial_in_the_fast_state():
    a, b, small = sp.symbols("a b mu", real=True)
    turned = ap.jump_map(ap.System.smooth({a: b, x: sp.sin(b)}, {b: -b}, small))
    with pytest.raises(NotDerivable, match="a base point has a closed form where"):
        turned[x]
    # b = 2 exp(-tau), so that a and x gain mu times the integrals of 2 exp(-tau) and sin(2 exp(-tau))
    found = turned.at({}, {a: 0, x: 0, b: 2})
    assert found["a"] == pytest.approx((0, 2), abs=1e-8)
    assert found["x"] == pytest.approx((0, float(sp.Si(2))), abs=1e-8)


@pytest.mark.parametrize("rtol", [0, -1, 1, 1e-14, "nan"])
def test_a_base_point_in_numbers_refuses_a_tolerance_that_it_cannot_keep(rtol):
    found = ap.jump_map(ap.System.smooth({x: -x + y}, {y: x - 2 * y - y**3}, mu))
    with pytest.raises(InputError, match="rtol = "):
        found.at({}, {x: 1, y: 2}, rtol=rtol)


def test_a_base_point_takes_the_values_of_a_scene_which_have_the_small_parameter():
    """By its name it was said to be given twice."""
    found, start = ap.jump_map(CUBIC, order=1), {x: 1, y: 2}
    assert found.at({"mu": "1e-3"}, start) == found.at({mu: "1e-3"}, start) == found.at({}, start)
    with pytest.raises(ap.errors.InputError, match="values = None"):
        found.at(None, start)


def test_a_whole_number_for_an_exponent_is_that_exponent_also_from_zero_and_below():
    """The promoter of a gene that represses itself, with Hill's exponent."""
    n = sp.Symbol("n", real=True)
    for start in ((0, 0), ("-1/2", 1)):
        given, told = (ap.System.smooth({x: y - x}, {y: 5 / (1 + x**power) - y}, mu) for power in (n, 2))
        paths = [ap.solve(ap.Scene(system=system, values={mu: "1/100", **values}, start=start, until=1), method="jump")
                 for system, values in ((given, {n: 2}), (told, {}))]
        assert paths[0].final == paths[1].final
        found, known = ap.jump_map(given), ap.jump_map(told)
        assert found.at({n: 2}, start) == known.at({}, start)
        assert found[x].coefficient(1).subs(n, 2) == known[x].coefficient(1)
    with pytest.raises(OutOfRange, match="the layer from x = 0, y = 0 has no finite value"):
        found.at({n: "1/2"}, {x: 0, y: 0})


@pytest.mark.parametrize("method", ["slow", "jump"])
def test_a_layer_with_a_power_that_leaves_the_floats_is_refused_and_ends(method):
    system = ap.System.smooth({x: y - x}, {y: x**100000 / (1 + x**100000) - y}, mu)
    with pytest.raises(OutOfRange, match=r"the layer from y = 1 at x = 2 .* or its rates do"):
        ap.solve(ap.Scene(system=system, values={mu: "1/100"}, start=(2, 1), until=3), method=method)


def test_a_base_point_names_its_slow_states_and_there_is_none_without_one_attracting_smooth_mode():
    with pytest.raises(UnknownName, match="y is not a slow state; the base point has x"):
        ap.jump_map(ENZYME)[y]
    with pytest.raises(NotDerivable, match="one smooth mode with fast states"):
        ap.jump_map(ap.System.smooth({x: -x}, {}, None))
    with pytest.raises(NotDerivable, match=r"without an explicit time; solve\(scene, method='jump'\) follows any"):
        ap.jump_map(ap.System.smooth({x: y}, {y: sp.cos(T) - y}, mu, time=T))
    with pytest.raises(NotDerivable, match=r"the rates switch, by Max\(0, y\): .*one smooth mode.*method='jump'"):
        ap.jump_map(ap.System.smooth({x: -sp.Max(0, y)}, {y: x - y}, mu))
    with pytest.raises(NotDerivable, match="trace 0, and so an eigenvalue whose real part is not negative: no layer"):
        ap.jump_map(ap.System.smooth({x: -y}, {u: v, v: x - u}, mu))


def test_a_base_point_is_shown_as_its_series_or_by_where_its_numbers_are():
    """It was shown as the call that makes it, with the whole system inside."""
    title = "Base point to order 1 of the fast fibre through a start\n"
    linear, cubic = (ap.System.smooth({x: -x + y}, {y: x - 2 * y - part}, mu) for part in (0, y**3))
    assert repr(ap.jump_map(linear)) == title + "  x  (x) + (-(x - 2*y)/4) mu + O(mu^2)"
    assert repr(ap.jump_map(cubic)).endswith("no closed form; .at(values, start) gives numbers")


def test_the_first_correction_of_the_base_point_is_the_quadrature_along_the_layer():
    closed = ap.jump_map(ENZYME, order=1)["x"].coefficient(1)
    at = {x: sp.Rational(3, 2), y: sp.Rational(1, 7), kappa: 2, lambda_: sp.Rational(1, 3)}
    s, branch = sp.Symbol("s", positive=True), x / (x + kappa)
    fast = branch + (y - branch) * sp.exp(-(x + kappa) * s)
    drift = (ENZYME.slow[x].subs(y, fast) - ENZYME.slow[x].subs(y, branch)).subs(at)
    assert sp.integrate(sp.expand(drift), (s, 0, sp.oo)) == closed.subs(at)


def test_the_base_point_of_two_fast_states_is_closed_to_order_one_and_in_numbers_beyond():
    values, start = {a: 2, b: 3}, {x: 1, w: "1/2", u: "3/10", v: "1/5"}
    system = ap.System.smooth(
        slow={x: -x + u * v, w: x - w * u}, fast={u: -a * u + x * v + w**2, v: -b * v - u + x}, small=mu
    )
    closed, numbers = ap.jump_map(system, order=1), ap.jump_map(system, order=2).at(values, start)
    at = {s: sp.Rational(c) for s, c in {**values, **start}.items()}
    for s in (x, w):
        assert numbers[s.name][1] == pytest.approx(float(closed[s].coefficient(1).subs(at)), abs=1e-9)
    with pytest.raises(NotDerivable, match=r"use \.at"):
        ap.jump_map(system, order=2)[x]


@pytest.mark.parametrize(
    ("fast", "match"),
    [({y: x}, "singular everywhere"), ({y: x - y, w: y - x}, "singular everywhere"), ({y: x + y}, "has the trace 1")],
)
def test_a_layer_that_never_settles_has_no_base_point(fast, match):
    with pytest.raises(NotDerivable, match=match):
        ap.jump_map(ap.System.smooth(slow={x: 1 + y}, fast=fast, small=mu))


def test_a_nonlinear_layer_has_its_first_correction_as_an_integral_over_the_fast_state():
    from scipy.integrate import quad
    from scipy.optimize import brentq

    (_, found), branch = ap.jump_map(CUBIC, order=1).at({}, {x: 1, y: 2})["x"], brentq(lambda q: 1 - q - q**3, 0, 1)
    integral, _ = quad(lambda q: -(q - branch) / (1 - q - q**3), 2, branch, epsabs=1e-12)
    assert found == pytest.approx(integral, abs=1e-9)


@pytest.mark.further
def test_the_base_point_in_twenty_digits_is_where_the_exact_motion_leads_back_to():
    import mpmath

    with mpmath.workdps(20):
        kept = ap.jump_map(ENZYME, order=2)
        start = {kappa: 1, lambda_: sp.Rational(1, 2), x: 1, y: 0}
        closed = [mpmath.mpf(sp.sympify(kept[x].coefficient(k)).subs(start).evalf(20)._mpf_) for k in range(3)]
        manifold = ap.slow_manifold(ENZYME, {y: x / (x + kappa)}, order=8)
        flow = sp.lambdify((x, mu), ap.reduced_flow(manifold)[x].subs({kappa: 1, lambda_: sp.Rational(1, 2)}), "mpmath")
        errors = []
        for small in (mpmath.mpf(1) / 100, mpmath.mpf(1) / 200):
            until = 20 * small
            exact = mpmath.odefun(
                lambda _, q, h=small: [-q[0] + (q[0] + 0.5) * q[1], (q[0] - (q[0] + 1) * q[1]) / h], 0, [1, 0]
            )(until)
            back = mpmath.odefun(lambda _, q, h=small: [-flow(q[0], h)], 0, [exact[0]])(until)
            errors.append((back[0] - sum(c * small**k for k, c in enumerate(closed))) / small**3)
        assert abs(errors[1] / errors[0] - 1) < 0.02
        assert abs(errors[1]) < 0.01


@pytest.mark.parametrize(
    ("fast", "start", "error", "words"),
    [
        (sp.log(x) - y, (-1, 1), OutOfRange, "no finite value"),
        (x - y ** sp.Rational(3, 2), (1, 0), OutOfRange, r"\(y\*\*\(3/2\) has no Taylor series where y = 0\)"),
        ((sp.exp(x) - sp.exp(x * y)) / x - 2 * y, (0, 1), OutOfRange, r"\(1/x has no Taylor series where x = 0\)"),
        (x - y + sp.sqrt(mu + x), (0, 1), OutOfRange, r"\(sqrt\(mu \+ x\) has no Taylor series where x = 0\)"),
        (x - y + sp.log(mu + 2 * x), (0, 1), OutOfRange, r"\(log\(mu \+ 2\*x\) has no Taylor series where 2\*x = 0\)"),
        (sp.besselj(0, x) - y, (1, 1), InputError, "no series here"),
        (sp.gamma(x) - y, (1, 1), InputError, "no series here"),
        (sp.sign(x - y / 2), (1, 1), NotDerivable, r"stays on 2\*x - y = 0 from t = "),
        (y**2 + x**2, (0, 1), OutOfRange, "grows beyond bounds"),
        (-1 / y, (0, 1), OutOfRange, "grows beyond bounds, or its rates do"),
        (-(y**3), (1, 1), OutOfRange, "lies on a branch that does not attract"),
        (-x - y**2, (0, 0), OutOfRange, "lies on a branch that does not attract: .* 0 there"),  # a fold
        (y - y**3 / 3 - x, ("2/3", 1), OutOfRange, "lies on a branch that does not attract: .* 0 there"),
        (x - x**2 * y, (0, 1), OutOfRange, "no layer fades there: the largest real part of an eigenvalue of g_y is 0 "),
        (x - y + sp.sqrt(mu), (1, 1), InputError, r"sqrt\(mu\) has no series.*make it a par"),
        (x - y + mu ** sp.Rational(5, 2), (1, 1), InputError, r"mu\*\*\(5/2\) has no series in the small parameter"),
        (x - y + sp.exp(-1 / mu), (1, 1), InputError, "the rate of y has no series in mu"),
        (x - y / mu, (1, 1), InputError, "the rate of y has no series in mu.* fast = {y: g} means mu y' = g"),
    ],
)
def test_what_cannot_be_followed_is_refused_by_name(fast, start, error, words):
    system = ap.System.smooth(slow={x: -x}, fast={y: fast}, small=mu)
    with pytest.raises(error, match=words):
        _solved(system, {mu: "1/100"}, start, 1)


def test_a_power_that_the_time_raises_has_no_taylor_series_where_its_base_is_zero():
    t = sp.Symbol("t")
    system = ap.System.with_frictions({x: -x}, {y: x + y ** (t + 1) - 2 * y}, [], small=mu, time=t)
    with pytest.raises(OutOfRange, match=r"\(y\*\*\(t \+ 1\) has no Taylor series where y = 0\)"):
        _solved(system, {mu: "1/100"}, (1, 0), 1)


@pytest.mark.parametrize("rates", [
    {u: v - 2 * u, v: 2 * u - v}, {u: w - u * v, v: w - u * v + mu * w, w: u * v - w - mu * w},
])
def test_a_layer_that_conserves_a_function_of_the_fast_states_is_refused_with_the_advice_to_make_it_slow(rates):
    system = ap.System.smooth({x: -x}, rates, mu)
    with pytest.raises(OutOfRange, match=r"g_y is singular everywhere, .*; make it a slow state$"):
        _solved(system, {mu: "1/100"}, {x: 1, **dict.fromkeys(rates, 1)}, 1)


@pytest.mark.slow
def test_quotients_that_are_singular_by_their_form_alone_are_expanded():
    """The system is linear, so that its exact flow is known; errors of successive orders fall by mu and constants."""
    slow = {x: -x * sp.sin(a * mu) / mu + y * (1 - sp.cos(mu)) / mu}
    system = ap.System.smooth(slow, {y: x * sp.log(1 + mu) / mu - y * (2 + 1 / mu - 1 / sp.sin(mu))}, mu)
    exact = ap.solve(ap.Scene(system=system, values={mu: "1/100", a: 2}, start=(1, 2), until=1)).final
    for order in range(4):
        path = _solved(system, {mu: "1/100", a: 2}, (1, 2), 1, order=order)
        assert np.abs(np.subtract(path.final, exact)).max() < path.error < 10.0 ** (-2 * order - 1)


def test_quotients_in_the_states_keep_their_limits():
    curved = ap.System.smooth({x: -sp.sin(mu * x) / mu}, {y: (sp.exp(mu * x) - 1) / (mu * x) - y}, mu)
    path = _solved(curved, {mu: "1/100"}, (1, 2), 1, order=3)
    bent = 2 * math.atan(math.tan(0.005) * math.exp(-1)) * 100  # of x' = -sin(mu x)/mu
    assert abs(path.final[0] - bent) < path.error < 1e-8


@pytest.mark.further
def test_many_fast_states_that_all_depend_on_each_other_have_their_models_at_once():
    """A ring of seven: the inverse of a full matrix of symbols, written out, took too long for six already."""
    ring = sp.symbols("r1:8", real=True)
    force = [x - 3 * r + sum(ring) / 7 - r * ring[k - 1] * ring[k - 2] / 3 for k, r in enumerate(ring)]
    system = ap.System.smooth({x: -ring[0]}, dict(zip(ring, force, strict=True)), mu)
    start = {x: 1, **dict.fromkeys(ring, 0)}
    path = _solved(system, {mu: "1/1000"}, start, 1, order=1)
    truth = ap.solve(ap.Scene(system=system, values={mu: "1/1000"}, start=start, until=1), digits=20)
    assert 1e-8 < distance(path.final, truth.final) < path.error < 1e-7


def test_a_small_parameter_that_is_not_small_is_refused_and_a_tiny_one_is_not():
    with pytest.raises(NotNormallyHyperbolic, match=r"attracts at the rate 2, .* or where mu is not small; take"):
        _solved(LINEAR, {mu: 1}, (1, 3), 1)
    path = _solved(LINEAR, {mu: "1e-300"}, (1, 3), 1)
    assert path.final == pytest.approx((np.exp(-0.5), np.exp(-0.5) / 2))
    assert path(0) == pytest.approx((1, 3))


def test_branches_and_fractional_powers_of_any_kind_have_their_slow_motion():
    system = ap.System.smooth(slow={x: -x}, fast={y: x - y ** sp.Rational(3, 2)}, small=mu)
    path = _solved(system, {mu: "1e-8"}, (1, 2), 1)
    assert path.final[1] == pytest.approx(np.exp(-2 / 3), abs=1e-7)


@pytest.mark.parametrize("order", range(3))
def test_a_layer_in_units_that_are_too_large_does_not_step_over_a_branch_that_repels(order):
    """x' = -x + y, mu y' = x - 2 y + a y^2 is of size 1/a: the same as for a = 1 in these units."""
    paths = []
    for size in (1, 10**8):
        system = ap.System.smooth({x: -x + y}, {y: x - 2 * y + size * y**2}, small=mu)
        start = {x: sp.Rational(1, 10 * size), y: 0}
        paths.append(_solved(system, {mu: "1/100"}, start, 1, order=order))
    assert np.array(paths[1].final) * 10**8 == pytest.approx(paths[0].final, rel=1e-7)


def test_a_layer_that_is_followed_roughly_stands_still_as_near_to_its_branch_as_its_tolerance_lets_it():
    """x' = -x - tanh(3 y / 2), mu y' = 1 - y: on y = 1, x = -tanh(3/2) (1 - exp(-t))."""
    system = ap.System.smooth({x: -x - sp.tanh(3 * y / 2)}, {y: 1 - y}, mu)
    scene = ap.Scene(system=system, values={"mu": "1/50"}, start={"x": 0, "y": "3/2"}, until="3/2")
    path = ap.solve(scene, method="jump", order=0)
    assert path.final == pytest.approx((-math.tanh(1.5) * -math.expm1(-1.5), 1), abs=path.error)


@pytest.mark.parametrize(("small", "start", "until"), [
    ("1711/500000", ("5237/10000", "443/10000", "2603/10000", "-137/200"), "17/200"),
    ("597/50000", ("849/1250", "459/2500", "-29/100", "-13/20"), "2931/10000"),
])
@pytest.mark.few(1)
def test_the_composite_is_right_where_its_layer_is_just_over(small, start, until):
    # the layer is followed twice, for its base point and for itself, and the two runs end at times of their own
    scene = ap.Scene(system=FOUR, values={mu: small}, start=start, until=until)
    truth = ap.solve(scene, "radau", rtol=1e-12, atol=1e-13).final
    path = ap.solve(scene, "jump", order=1)
    assert np.abs(np.array(path.final) - truth).max() < path.error < 2e-5


@pytest.mark.parametrize("order", [1, 2, 3])
def test_what_is_predicted_bounds_the_error_where_the_series_hardly_converges(order):
    cubic = ap.System.smooth(slow={x: u - a * y, u: -b * x}, fast={y: x - y - y**3}, small=mu)
    values, start = {a: "1.854", b: "0.722", mu: "1/10"}, {x: "-0.405", u: "-1.158", y: "-0.931"}
    scene = ap.Scene(system=cubic, values=values, start=start, until="2.576")
    path, truth = ap.solve(scene, "jump", order=order), ap.solve(scene)
    assert distance(path.final, truth.final) < path.error


@pytest.mark.parametrize(("slow", "fast", "start", "small", "until", "order"), [
    ("1.587 - x*y", "x*exp(-y) - 0.8303*y", ("0.2087", "1.616"), "0.0821", "0.05711", 2),
    ("-x - 0.7732*y", "x - sin(y)", ("0.03291", "-1.404"), "0.201", "1.022", 1),
    ("-0.7802*y", "x - exp(y)", ("0.6116", "1.187"), "0.0814", "0.8624", 0),
    ("cos(y) - 1.997*x", "-sin(1.05*x) - y + 0.7009*sin(y)", ("0.1312", "0.8181"), "0.0203", "0.01827", 0),
    ("cos(y) - 1.675*x", "-sin(1.219*x) - y - 0.228*sin(y)", ("0.4913", "0.5719"), "0.303", "1.316", 2),
])
@pytest.mark.few(2)
def test_what_is_predicted_bounds_the_error_where_omitted_terms_are_small_by_chance(
    slow, fast, start, small, until, order
):
    drift, force = (sp.sympify(rate, {"x": x, "y": y}, rational=True) for rate in (slow, fast))
    system = ap.System.smooth(slow={x: drift}, fast={y: force}, small=mu)
    scene = ap.Scene(system=system, values={mu: small}, start=start, until=until)
    path, truth = ap.solve(scene, "jump", order=order), ap.solve(scene, "radau", rtol=1e-11, atol=1e-12)
    assert distance(path.final, truth.final) < path.error


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("drive", [10 * T**3 - 15 * T**4 + 6 * T**5, 35 * T**4 - 84 * T**5 + 70 * T**6 - 20 * T**7])
@pytest.mark.parametrize("kind", ["smooth", "switched", "friction"])
@pytest.mark.few(2)
def test_terms_that_vanish_together_as_a_drive_comes_to_rest_are_told_from_those_before(kind, drive, order):
    """At T = 1 the first 2 or 3 derivatives of the drive are 0: an error of 6e-5 was predicted as 5e-12."""
    if kind == "friction":
        rough = ap.Friction(velocity=v, force=u, load=1, kinetic=sp.S.Half)
        system = ap.System.with_frictions({x: v, v: 2 - v + u}, {y: drive - y}, [rough], small=mu, time=T)
    else:
        speed = sp.Piecewise((1, x < sp.Rational(1, 3)), (2, True)) if kind == "switched" else sp.S.One
        system = ap.System.smooth({x: speed, v: -v}, {y: drive - y}, mu, time=T)
    scene = ap.Scene(system=system, values={mu: "1/100"}, start={x: 0, v: 1, y: 0}, until=1)
    path, truth = ap.solve(scene, "jump", order=order), ap.solve(scene, "radau", rtol=1e-11, atol=1e-12).final
    predicted = ladder.predicted(path, partial(ap.solve, scene))
    assert distance(path.final, truth) < predicted < 20 * distance(path.final, truth) + 1e-4


@pytest.mark.parametrize("lags", [1, 2, 6, 8])
def test_equal_lags_in_a_row_remember_the_terms_of_all_their_delays(lags):
    """With k lags y = sum_j C(k + j - 1, j) (-mu)^j d^j drive, and the first two terms are 0 at T = 1.

    For 8 lags 0.75 of the error was predicted.
    """
    small, drive = sp.Rational(1, 1000), 10 * T**3 - 15 * T**4 + 6 * T**5
    row = sp.symbols(f"y:{lags}", real=True)
    system = ap.System.smooth({x: -x}, {b: a - b for a, b in zip((drive, *row), row, strict=False)}, mu, time=T)
    path = _solved(system, {mu: small}, (1, *[0] * lags), 1, order=0)
    truth = sum(sp.binomial(lags + j - 1, j) * (-small) ** j * drive.diff(T, j).subs(T, 1) for j in range(6))
    error = abs(path.final[-1] - truth)
    assert error < path.error < 6 * error


@pytest.mark.parametrize(("flat", "small", "order", "most"),
                         [(7, "1/20", 1, 6), (9, "1/50", 0, 40), (11, "1/50", 2, 10)])
@pytest.mark.few(1)
def test_terms_that_are_rounding_where_a_drive_comes_to_rest_do_not_hide_those_before(flat, small, order, most):
    """The first 7 derivatives of the drive are 0 at T = 1: an error of 6e-4 was predicted as 1e-6 to order 1."""
    drive, m = sp.integrate((T * (1 - T)) ** flat, T), sp.Rational(small)
    system = ap.System.smooth({x: 1}, {y: drive / drive.subs(T, 1) - y}, mu, time=T)
    path = _solved(system, {mu: m}, (0, 0), 1, order=order)
    terms = [drive.diff(T, k).subs(T, 1) / drive.subs(T, 1) * (-m) ** k for k in range(2 * flat + 2)]
    missed = abs(float(sum(terms)) - path.final[1])
    assert missed < path.error < most * missed


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("height", [1, 2])
@pytest.mark.parametrize("until", ["1001/1000", "101/100", "11/10"])
@pytest.mark.few(3)
def test_what_terms_that_vanish_at_a_switch_left_out_shortly_before_is_told_until_it_has_faded(until, height, order):
    """A drive that has come to rest at x = 1 stays there or jumps: after it 2e-5 was predicted as 5e-7 to order 0."""
    drive = sp.Piecewise((10 * x**3 - 15 * x**4 + 6 * x**5, x < 1), (height, True))
    system = ap.System.smooth({x: 1}, {y: drive - y}, mu)
    scene = ap.Scene(system=system, values={mu: "1/100"}, start={x: 0, y: 0}, until=until)
    path, since = ap.solve(scene, "jump", order=order), 100 * (Fraction(until) - 1)
    at_switch = 1 - 60e-6 + 360e-8 - 720e-10
    truth = float(Fraction(until)), height + (at_switch - height) * math.exp(-since)
    missed = distance(path.final, truth)
    predicted = ladder.predicted(path, partial(ap.solve, scene))
    assert missed < predicted < 20 * missed + 6e-7


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("until", ["0.51", "0.55"])
def test_an_error_made_before_a_drive_stands_still_is_remembered_after(until, order):
    """The layer of the drive at rest begins on its manifold: an error of 2e-4 was predicted as 5e-7."""
    small, twice = sp.Rational(1, 100), 2 * T
    ramp = 10 * twice**3 - 15 * twice**4 + 6 * twice**5
    system = ap.System.smooth({x: -x}, {y: sp.Piecewise((ramp, twice < 1), (1, True)) - y}, mu, time=T)
    path = _solved(system, {mu: small}, (1, 0), until, order=order)
    known = sum((-small) ** j * ramp.diff(T, j).subs(T, sp.S.Half) for j in range(6))
    truth = 1 + (known - 1) * sp.exp((sp.S.Half - sp.Rational(until)) / small)
    error = abs(path.final[1] - truth)
    assert error < path.error < 10 * error


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("force", [mu - u, mu - u + mu * sp.sign(x) / 4])
def test_high_powers_of_the_small_parameter_that_the_rates_only_imply_are_among_what_is_predicted(force, order):
    """u rests at mu, or on either side of it by the sign of x, so that w' = -w + c mu**5 with a c of some 10**14."""
    system = ap.System.smooth({x: -1, w: -w + 10**14 * u**5}, {u: force}, mu)
    scene = ap.Scene(system=system, values={mu: "1/1000"}, start={x: "1/4", w: 1, u: "1/1000"}, until="1/2")
    path, truth = ap.solve(scene, "jump", order=order), ap.solve(scene)
    assert 1e-3 < distance(path.final, truth.final) < path.error < 0.9


@pytest.mark.parametrize("order", [0, 1, 3])
@pytest.mark.parametrize("term", [
    sp.sin(50 * mu) ** 6, 10**10 * mu ** sp.Rational(13, 2),
    (sp.exp(50 * x * mu) - 1) ** 6, (sp.sin(50 * mu) * x) ** 6, sp.sinc(10**7 * mu**4), sp.sinc(50 * x * mu),
    x * (sp.exp(10**5 * mu**3) - 1) / (10**5 * mu**3),
])
@pytest.mark.few(2)
def test_terms_whose_first_powers_of_the_small_parameter_vanish_are_among_what_is_predicted(term, order):
    """x = e^-t; a term of orders above n + 2 alone was left out of the prediction to order n."""
    system = ap.System.smooth({x: -x}, {y: x - y + term}, mu)
    path = _solved(system, {mu: "1/100"}, (1, 0), "1/2", order=order)
    truth = ap.solve(ap.Scene(system=system, values={mu: "1/100"}, start=(1, 0), until="1/2"))
    assert distance(path.final, truth.final) < path.error < 0.9


@pytest.mark.parametrize("order", [0, 1])
def test_the_next_term_of_a_quotient_that_is_singular_by_its_form_is_among_what_is_predicted(order):
    """y = x - (50 mu)**4 x**3/6 + ... has no term of the orders 1, 2 and 3."""
    system = ap.System.smooth({x: -x / 1000}, {y: sp.sin((50 * mu) ** 2 * x) / (50 * mu) ** 2 - y}, mu)
    path = _solved(system, {mu: "1/100"}, (2, 2), 1, order=order)
    truth = ap.solve(ap.Scene(system=system, values={mu: "1/100"}, start=(2, 2), until=1))
    assert 1e-3 < distance(path.final, truth.final) < path.error < 0.9


@pytest.mark.parametrize("step", [sp.floor(100 * mu), sp.sign(mu - sp.Rational(1, 100))])
def test_what_jumps_with_the_small_parameter_has_its_value_in_a_model(step):
    """At mu = 1/100 these are 1 and 0."""
    value, number = step.subs(mu, sp.Rational(1, 100)), sp.Symbol("number", real=True)
    paths = [_solved(ap.System.smooth({x: -x + part}, {y: x - y + part}, mu), {mu: "1/100", **more}, (1, 2), 1, order=1)
             for part, more in ((step, {}), (number, {number: value}))]
    assert paths[0].final == paths[1].final


def test_a_coefficient_that_rounding_would_lose_is_predicted_by_its_series():
    """log(1 + mu) is 0 in doubles, and w' = -2 w."""
    system = ap.System.smooth({w: -w * (1 + kappa * sp.log(1 + mu))}, {u: w - u}, mu)
    path = _solved(system, {mu: "1e-30", kappa: "1e30"}, {w: 1, u: 0}, 1, order=1)
    assert path.error < 1e-11
    assert path.final == pytest.approx((math.exp(-2),) * 2, abs=path.error)


@pytest.mark.parametrize("order", range(4))
def test_near_a_fold_the_predicted_error_is_the_error_though_the_terms_do_not_fall(order):
    """y is a quotient of Airy's functions. The terms that order 2 omits added up to 44 times its error."""
    system, s = ap.System.smooth({x: 1}, {y: -x - y**2}, mu), 0.01 ** (1 / 3)
    path = _solved(system, {mu: "1/100"}, {x: -1, y: 1}, "19/20", order=order)
    (a, da, b, db), (c, dc, d, dd) = airy(1 / s**2), airy(0.05 / s**2)
    share = -(s * da + a) / (s * db + b)
    wrong = abs(path.final[1] + s * (dc + share * dd) / (c + share * d))
    assert wrong < path.error < 1.2 * wrong


@pytest.mark.parametrize("order", [1, 3])
@pytest.mark.parametrize(("more", "begun", "until"), [(0, "1e-9", 21), (sp.Max(0, x - sp.S.Half) / 4, "1e-8", 20)])
@pytest.mark.few(2)
def test_errors_that_grow_as_a_slow_motion_leaves_what_repels_it_are_predicted(more, begun, until, order):
    system = ap.System.smooth({x: y - x**3 - more}, {y: x - y}, mu)  # those of a step grow as much as the start does
    field = sp.lambdify((x, y), (y - x**3 - more, 100 * (x - y)))
    truth = solve_ivp(lambda _, q: field(*q), (0, until), (float(begun), 0), "DOP853", rtol=3e-14, atol=1e-40).y[:, -1]
    path = _solved(system, {mu: "1/100"}, {x: begun, y: 0}, until, order=order)
    assert np.abs(path.final - truth).max() < path.error < 10.0 ** -(order + 1)


LATE = {  # layers that leave a branch that repels, by 24 terms of Taylor series in 45 digits
    "growth": ({x: -x * y / 2}, {y: y * (2 + x - y)}, (1, "1e-10"),
               {"0.03": (0.96776623276694856, 2.9682503579459215), "0.0125": (0.99334104264574408, 2.993833241501349)}),
    "three branches": ({x: -x + y}, {y: (y - sp.S.Half) * (2 + x - y) * (y + 1 + x**2 / 4)}, (1, "0.50000001"),
                       {"0.06": (1.1094445088581306, 3.1092709677551815),
                        "0.0045": (0.99848129096469573, 2.73800096810718)}),
}


@pytest.mark.parametrize(("name", "until"), [(name, until) for name, (*_, ends) in LATE.items() for until in ends])
@pytest.mark.parametrize("order", [1, 2, 4])
def test_errors_that_grow_as_a_layer_leaves_what_repels_it_are_predicted(name, until, order):
    """The layer grew from errors of 1e-13 beside 1e-10: the error of order 4 was 1.8e-6, and 2e-11 was predicted."""
    slow, fast, start, ends = LATE[name]
    path = _solved(ap.System.smooth(slow, fast, mu), {mu: "1/1000"}, dict(zip((x, y), start, strict=True)), until,
                   order=order)
    wrong = np.abs(np.subtract(path.final, ends[until])).max() / max(ends[until])
    assert wrong < path.error < (4e-6 if until == "0.0045" else 1e-8) + 1e-2 ** (order + 1) / 2


@pytest.mark.parametrize(("fast", "start", "end", "most"), [
    ({y: (y - sp.S.Half) * (2 + x - y) * (y + 1 + x**2 / 4)}, (1, "0.500000000001"), (1.184171295, 3.184006961), 1e-5),
    ({u: v, v: -2 * v - sp.sin(u) + x / 10}, (0, "3.141592654", 0), (0, 2 * math.pi, 0), 1e-11),
])
def test_a_layer_from_so_near_what_repels_it_that_the_start_is_rounded_ends_with_the_errors_of_that(
        fast, start, end, most):
    """Tolerances were below the rounding of the fast states, and the layer was refused after hundreds of steps."""
    system = ap.System.smooth({x: -x + y if y in fast else -x}, fast, mu)
    path = _solved(system, {mu: "1/1000"}, dict(zip((x, *fast), start, strict=True)), "0.1", order=4)
    assert np.abs(np.subtract(path.final, end)).max() / max(end) < path.error < most


@pytest.mark.parametrize("more", [0, sp.Max(0, x - 1)])
def test_a_slow_motion_that_starts_within_its_own_errors_of_what_repels_it_is_refused_as_that(more):
    third = sp.Rational(1, 3)
    system = ap.System.smooth({x: (y - third) * (1 - (y - third) ** 2) - more}, {y: x - y}, mu)
    with pytest.raises(OutOfRange, match=r"errors of 1e-13 grow as large .* keeps to a repelling set"):
        _solved(system, {mu: "1/100"}, {x: third + sp.Rational(1, 10**15), y: third}, 40, order=2)


def test_errors_of_steps_that_err_alike_are_told_by_steps_twice_as_long():
    """The phase of a pendulum drifts, as its steps change its energy always the same way: sin(x/2) = k sn(t, k)."""
    known, k, until, rtol = formulas(PENDULUM.modes[0], mu, ()), 0.9, 1000.0, 1e-9
    found = reduced.follow_reduced_flow(known, 0, np.array([0, 2 * k]), 1e-5, (), until, rtol)
    sn, cn, _, _ = ellipj(until, k**2)
    wrong = np.abs(np.subtract(found.trajectory.state_at(until), (2 * np.arcsin(k * sn), 2 * k * cn)))
    assert (wrong[:2] < found.errors(rtol)[:2]).all()
    assert found.errors(rtol)[:2].max() < 20 * wrong.max()


def test_steps_at_rest_do_not_make_errors_grow():
    """There a rate is rounding: by it errors were said to grow by 3e4."""
    known = formulas(ap.System.smooth({x: sp.S.One / 3 - sp.tanh(3 * y)}, {y: x - y}, mu).modes[0], mu, ())
    assert reduced.follow_reduced_flow(known, 1, np.array([2.0]), 0.01, (), 50.0, 1e-9).grown.most < 5


@pytest.mark.parametrize("order", [1, 2])
def test_terms_that_are_omitted_fade_with_a_slow_motion_that_comes_to_rest(order):
    """Steps that did not see them fade told 3/4 of the error of a gene that makes a protein that forms pairs."""
    slow, fast = {x: 1 / (1 + u) - x, y: 5 * x - y - 2 * y**2 + 2 * u}, {u: y**2 - u}
    field = sp.lambdify((x, y, u), (*slow.values(), *(50 * rate for rate in fast.values())))
    truth = solve_ivp(lambda _, q: field(*q), (0, 20), (0, 0, 0), "Radau", rtol=1e-12, atol=1e-14).y[:, -1]
    path = _solved(ap.System.smooth(slow, fast, mu), {mu: "1/50"}, {x: 0, y: 0, u: 0}, 20, order=order)
    wrong = distance(path.final, truth)
    assert wrong < path.error < 2 * wrong


@pytest.mark.parametrize(("slow", "rate", "start", "end", "small"), [
    (sp.Integer(1), x * y - y**3, {x: -1, y: "1/2"}, "1/2", "1/50"),
    *((-x, -(x + sp.Rational(1, 20)) * sp.sin(y), {x: 1, y: 2}, 3, small) for small in ("1/10", "1/20")),
    (-7 * x / 5, -(x + sp.Rational(9, 25)) * (1 - x**2 / 4) * y, {x: 1, y: "3/2"}, "12/5", "1/10"),
    *((-3 * x / 2, (3 * mu * (x**2 + 1) - (1 + 11 * x + 2 * y) / 9) * y, {x: "9/5", y: "-4/5"}, end, "3/40")
      for end in ("5/4", 3)),
    (sp.Integer(1), -(sp.Rational(3, 2) - sp.cos(x)) * y, {x: 1, y: -2}, "5/2", "1/10"),
])
@pytest.mark.parametrize(("method", "order"), [("jump", 0), ("jump", 1), ("jump", 2), ("slow", 1)])
def test_what_is_left_of_a_layer_whose_attraction_changes_is_told(slow, rate, start, end, small, method, order):
    """No other term is omitted: y = 0 is invariant. By the terms of the layer alone a third of the error was told.

    By a term that was small by chance 1/160 was told, and without what mu adds to the attraction 1/10**5. Where the
    attraction grows, up to 2400 times the error was told.
    """
    scene = ap.Scene(system=ap.System.smooth({x: slow}, {y: rate}, mu), values={mu: small}, start=start, until=end)
    path, exact = ap.solve(scene, method, order=order), ap.solve(scene, digits=20).final
    wrong = float(distance(path.final, exact))
    assert wrong <= path.error < 4 * wrong + 1e-11


@pytest.mark.parametrize("until", ["1/100", "1/10"])
def test_a_layer_is_followed_though_the_rates_have_no_value_at_the_base_point(until):
    """The layer takes x from 1 to about 0, and by higher orders below, where the attraction sqrt(x) has no value."""
    system = ap.System.smooth({x: -10 * y}, {y: -sp.sqrt(x) * y}, mu)
    scene = ap.Scene(system=system, values={mu: "1/10"}, start=(1, 1), until=until)
    path, exact = ap.solve(scene, "jump", order=0), ap.solve(scene, digits=20).final
    assert distance(path.final, exact) <= path.error


@pytest.mark.parametrize("order", [0, 1, 2])
def test_terms_omitted_since_the_start_are_remembered_where_slow_motion_fades_faster_than_a_layer(order):
    """The slow motion falls by exp(12), what the fast state remembers of it by exp(6): 1/30 of the error was told.

    By the attraction at the end, which is weaker than before, 25 times the error was told.
    """
    rate = -(x + sp.Rational("0.0452")) * (y - x**2)
    scene = ap.Scene(system=ap.System.smooth({x: sp.Rational("-1.96") * x}, {y: rate}, mu),
                     values={mu: "0.0448"}, start={x: "1.22", y: "-0.954"}, until="6.31")
    assert 9.1e-5 < ap.solve(scene, order=order, method="jump").error < 9.1e-4


@pytest.mark.parametrize(("fading", "least", "small", "start", "until", "missed"), [
    ("2.07", "0.0596", "0.0993", ("1.81", "-0.75"), "7.54", 1.56e-3),
    ("2.3", "0.0817", "0.105", ("0.777", "2.68"), "6.79", 1.12e-3),
])
def test_terms_that_were_largest_between_two_times_or_fell_slowly_are_remembered(
    fading, least, small, start, until, missed
):
    """Of the first error 0.76 was told, and of the second 0.98 without the second omitted term."""
    rate = -(x + sp.Rational(least)) * (y - x**2)
    system = ap.System.smooth({x: -sp.Rational(fading) * x}, {y: rate}, mu)
    scene = ap.Scene(system=system, values={mu: small}, start=dict(zip((x, y), start, strict=True)), until=until)
    assert missed < ap.solve(scene, order=2, method="jump").error < 10 * missed


@pytest.mark.parametrize("method", ["jump", "slow"])
def test_terms_of_a_layer_that_has_nearly_faded_do_not_cancel_those_of_the_slow_motion(method):
    """Of the error 0.66 was told: the layer's terms, of either sign, were far larger than what was left of it."""
    turn, force = sp.Rational("3.44"), mu * v * (sp.Rational("0.6") * x - sp.S.Half) - sp.Rational("1.88") * v * x
    system = ap.System.smooth({x: turn * v, v: -turn * x}, {y: force - (x + sp.Rational("1.11")) * y}, mu)
    scene = ap.Scene(system=system, values={mu: "0.023"}, start={x: "-0.687", v: "0.315", y: "-1.97"}, until="0.633")
    path = ap.solve(scene, method, order=1)
    wrong = distance(path.final, ap.solve(scene).final)
    assert wrong < path.error < 2 * wrong


def test_errors_at_the_start_grow_on_a_branch_that_is_integrated_as_motions_from_beside_it_part():
    system = ap.System.smooth({x: y - x / 3, v: x * v / 5 - sp.sin(y)}, {y: x + v - y - y**3 / 3}, mu)
    known = formulas(system.modes[0], mu, ())

    def follow(*begun):
        return reduced.follow_reduced_flow(known, 2, reduced.branch_at(known, begun, (0.3,), ()), 0.01, (), 5.0)

    ends = [[follow(1 + off, 0.5).trajectory.state_at(5.0), follow(1, 0.5 + off).trajectory.state_at(5.0)]
            for off in (1e-5, -1e-5)]
    slopes = np.subtract(*ends).T / 2e-5
    assert follow(1, 0.5).grown.kept == pytest.approx(slopes, abs=0.01)


def test_edges_that_an_oscillation_crosses_do_not_multiply_its_errors():
    """By t = 60 errors of 1e-13 were said to be as large as the states."""
    force = -sp.sin(x) - sp.Max(0, x - 1)
    system, field = ap.System.smooth({x: v, v: force}, {y: x - y}, mu), sp.lambdify((x, v), (v, force))
    path = _solved(system, {mu: "1e-5"}, {x: 0, v: "9/5", y: 0}, 60, order=2)
    truth = solve_ivp(lambda _, q: field(*q), (0, 60), (0, 1.8), "DOP853", rtol=3e-14, atol=1e-15).y[:, -1]
    assert np.abs(path.final[:2] - truth).max() < path.error < 1e-9


def test_terms_that_fall_at_a_single_time_by_chance_do_not_tell_the_error_at_a_later_one():
    slow = -7 * v * x**2 / 5 - 9 * x**2 / 5 - x / 2 - 13 * sp.cos(u + x) / 10
    fast = (2 * v / (5 * (v**2 + 1)) - 4 * u**3 / 5 - 13 * u / 5,
            9 * u * v**2 / 5 - v**3 / 2 - 3 * v / 2 + 8 * sp.tanh(u) / 5)
    field = sp.lambdify((x, u, v), (slow, *(4 * rate for rate in fast)))
    truth = solve_ivp(lambda _, q: field(*q), (0, 0.1), (1.3, -1.6, 2), "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    system, start = ap.System.smooth({x: slow}, dict(zip((u, v), fast, strict=True)), mu), ("1.3", "-1.6", 2)
    path = _solved(system, {mu: "1/4"}, dict(zip((x, u, v), start, strict=True)), "1/10", order=2)
    assert np.abs(path.final - truth).max() < path.error < 0.02


def test_what_a_composite_misses_of_the_start_is_what_it_is_wrong_by_there():
    path = _path("cubic", "1/10", "1/2", order=0)
    wrong = [path(0.0)[1] - 2, *(_path("cubic", "1/10", "1/2", order=k)(0.0)[1] - 2 for k in (1, 2))]
    assert path.at.dense.motion.misses().ravel() == pytest.approx(wrong, abs=1e-9)


def test_slow_motion_within_a_layer_is_refused_as_that():
    system = ap.System.smooth(slow={x: -x}, fast={y: x - y}, small=mu)
    with pytest.raises(OutOfRange, match=r"still in its layer.*method 'jump', or a later until"):
        _solved(system, {mu: "1e-6"}, (1, 4), "1e-6", method="slow")
    assert _solved(system, {mu: "1e-6"}, (1, 4), "1e-6").final[1] == pytest.approx(1 + 3 / math.e, abs=1e-5)
    assert _solved(system, {mu: "1e-6"}, (1, 4), "1e-4", method="slow").error < 1e-9


@pytest.mark.parametrize("method", ["exact", "slow", "jump"])
@pytest.mark.parametrize("time", ["now", True, float("nan"), -1, "2.1", [0, 3]])
def test_a_time_that_is_none_or_not_of_the_run_is_refused_alike_by_every_model(method, time):
    path = ap.solve(ap.Scene(system=LINEAR, values={mu: "1/100"}, start={x: 1, y: 0}, until=2), method)
    with pytest.raises(InputError, match=r"from 0 to until = 2|must be a (decimal|number)"):
        path(time)


@pytest.mark.parametrize("method", ["slow", "jump"])
@pytest.mark.parametrize(
    ("slow", "fast", "by_hand"),
    [
        (-x + sp.Abs(y), sp.Abs(x) - 2 * y, (-x + y, x - 2 * y)),
        (-x * sp.sign(x + y), sp.Max(x, 3 * y - 9) - y, (-x, x - y)),
        (sp.Piecewise((y - x, x > sp.Rational(1, 4)), (9, True)), sp.floor(x) * x + sp.Rational(3, 4) - y,
         (y - x, x + sp.Rational(3, 4) - y)),
    ],
)
def test_a_motion_beside_all_edges_is_that_of_the_formulas_on_its_side(slow, fast, by_hand, method):
    switched, plain = (ap.System.smooth({x: f}, {y: g}, mu) for f, g in ((slow, fast), by_hand))
    for order in (0, 1, 2):
        scenes = (ap.Scene(system=s, values={mu: "1/100"}, start=("5/4", 2), until="1/4") for s in (switched, plain))
        path, known = (ap.solve(scene, method, order=order) for scene in scenes)
        assert (path.final, path.error) == (known.final, known.error)


CROSSINGS = {
    "kink": ({x: -x + sp.Abs(y)}, {y: sp.Abs(x) - 2 * y}, {x: 1, y: -2}, 1),
    "jump of the manifold": ({x: -1 - y / 4, u: y - u}, {y: sp.sign(x) + u - y}, {x: "1/2", u: 1, y: 0}, 1),
    "edge at the manifold": ({x: 1 - sp.Min(x, y)}, {y: x - y}, {x: "1/2", y: 3}, 1),
    "stop": ({x: v, v: -x - 3 * sp.Max(0, x - sp.Rational(1, 2)) - y}, {y: v - y}, {x: 1, v: 0, y: 0}, 10),
    "forced kink": ({x: -x + y}, {y: sp.Abs(x) / 2 + sp.cos(2 * T) - y}, {x: 1, y: 0}, 6),
    "saturated": ({x: v, v: -y}, {y: sp.Min(1, sp.Max(-1, 2 * x + v)) - y}, {x: 2, v: 0, y: 0}, 10),
    "jump of the force": ({x: sp.cos(T) - y / 4}, {y: x - y + sp.Heaviside(y - sp.Rational(1, 2))}, {x: 0, y: -1}, 2),
    "relaxation at corners": ({x: -y}, {y: x + y - 2 * sp.Max(0, y - 1) + 2 * sp.Max(0, -1 - y)}, {x: 0, y: 2}, 5),
}


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) if name in ("forced kink", "saturated")
                                  else name for name in CROSSINGS])
@pytest.mark.few(1)
def test_a_motion_through_edges_is_as_right_as_it_says(name, order):
    errors = []
    for small in ("1/1000", "1/10000"):
        scene, truth = _through_edges(name, small)
        path = ap.solve(scene, "jump", order=order)
        errors.append(distance(path.final, truth))
        assert errors[-1] < path.error
        assert ap.solve(scene, "slow", order=order).final == path.final
    assert name.startswith("relax") or errors[1] < 2 * errors[0] / 10 ** (order + 1) + 1e-10


@cache
def _through_edges(name, small):
    """Return a scene through edges, and its end, which the default method and Radau agree on."""
    slow, fast, start, until = CROSSINGS[name]
    scene = ap.Scene(system=ap.System.smooth(slow, fast, mu, time=T), values={mu: small}, start=start, until=until)
    truth = ap.solve(scene).final
    assert truth == pytest.approx(ap.solve(scene, "radau", rtol=1e-9, atol=1e-12).final, abs=1e-5)
    return scene, truth


@pytest.mark.slow
def test_the_path_through_pulses_is_right_at_all_times_and_in_its_layers_too():
    pulse = sp.Piecewise((1, T < 1), (-1, T < 2), (sp.sin(T), True))
    system = ap.System.smooth({x: y - x}, {y: pulse - y - x * y / 4}, mu, time=T)
    scene = ap.Scene(system=system, values={mu: "1e-3"}, start={x: 0, y: 0}, until=4)
    times = np.concatenate([np.linspace(0, 4, 41), [0.001, 1.0005, 1.003, 2.001]])
    truth, path = ap.solve(scene, "radau", rtol=1e-10), ap.solve(scene, "jump", order=1)
    assert path(times) == pytest.approx(truth(times), abs=5e-6)


RECORDS = {
    "steps": sp.floor(3 * T) / 4,
    "saw-tooth": sp.Mod(T, sp.Rational(2, 5)),
    "teeth of steps": sp.Abs(sp.Mod(sp.floor(4 * T), 3) - 1),
    "record": sp.Piecewise(*((k % 3 + k * T / 9, sp.Rational(k, 40) > T) for k in range(1, 20)), (0, True)),
}


@pytest.mark.parametrize("name", RECORDS)
@pytest.mark.few(0)
def test_steps_teeth_and_records_by_the_time_are_passed_as_rightly_as_it_is_said(name):
    system = ap.System.smooth({x: -x + y}, {y: RECORDS[name] - y - x * y / 4}, mu, time=T)
    scene = ap.Scene(system=system, values={mu: "1/1000"}, start={x: 1, y: 2}, until="4/5")
    truth = ap.solve(scene, "radau", rtol=1e-8, atol=1e-10).final
    for order in (0, 1):
        path = ap.solve(scene, "jump", order=order)
        assert distance(path.final, truth) < path.error < 1 / 1000**order / 100


def test_what_switches_too_often_is_refused_as_that():
    table = sp.Piecewise(*((k % 3, x < sp.Rational(k, 70)) for k in range(70)), (0, True))
    with pytest.raises(InputError, match=r"the rate of y switches too often, by .*; use an exact method"):
        _solved(ap.System.smooth({x: -x}, {y: table - y}, mu, time=T), {mu: "1/100"}, (1, 0), 1)


def test_a_motion_that_slides_along_an_edge_is_refused_by_name():
    with pytest.raises(NotDerivable, match=r"the motion stays on x = 0 from t = 0\.53.* on, where the rates jump"):
        _solved(ap.System.smooth({x: -sp.sign(x) + y / 4}, {y: x - y}, mu), {mu: "1/100"}, ("1/2", 0), 1)


@pytest.mark.parametrize("number", [-2, 0, 2])
def test_what_the_parameters_alone_switch_is_a_number(number):
    k = sp.Symbol("k", real=True)
    size, whole, sign = abs(number), math.floor(number / 3), (number > 0) - (number < 0)
    force = sp.Abs(x - sp.Abs(k) - 3) * sp.sign(k) + sp.floor(k / 3) - y
    switched = ap.System.smooth({x: -sp.Max(k, 1) * x}, {y: force}, mu)
    plain = ap.System.smooth({x: -max(number, 1) * x}, {y: (size + 3 - x) * sign + whole - y}, mu)
    path = _solved(switched, {mu: "1/100", k: number}, (1, 0), 1)
    assert path.final == pytest.approx(_solved(plain, {mu: "1/100"}, (1, 0), 1).final, rel=1e-14)


@pytest.mark.parametrize("method", ["slow", "jump"])
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.few(2)
def test_the_units_of_a_fast_state_do_not_decide_which_branch_its_layer_settles_on(order, method):
    paths = [_solved(ap.System.smooth({x: y / unit}, {y: y - y**3 / unit**2}, mu), {mu: "1/1000"}, (0, unit / 2), 1,
                     method, order) for unit in (sp.S.One, sp.Rational(1, 10**8))]
    assert paths[0].final[0] == paths[1].final[0] > 0.999
    assert paths[0].error == paths[1].error
    times = np.linspace(0, 1, 9)
    assert paths[1](times)[1] == pytest.approx(paths[0](times)[1] * 1e-8, rel=1e-14)


def test_the_units_of_fast_states_do_not_decide_whether_their_manifold_is_lost():
    ends = []
    for unit in (1, sp.Rational(1, 1000), sp.Rational(1, 10**6), 10**6):
        slow, fast = {x: -x + y * w / unit}, {y: -y + unit * w - y**3 / unit**2, w: -w + x}
        path = _solved(ap.System.smooth(slow, fast, mu), {mu: "1/100"}, (1, unit, 2), 1)
        ends.append([path.final[0], path.final[1] / unit, path.final[2]])
    assert all(end == pytest.approx(ends[0], rel=1e-7) for end in ends)


@pytest.mark.parametrize("small", ["1/100", "1/1000", "1/10000"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_speed_that_is_small_but_in_its_layer_keeps_its_unit(order, small):
    """The speed w of a damped oscillation is of order mu in slow motion, and of order 1 while it fades."""
    system = ap.System.smooth({x: -x + y}, {y: w, w: x - y - w / 5}, mu)
    scene = ap.Scene(system=system, values={mu: small}, start={x: 1, y: 0, w: 0}, until=1)
    path = ap.solve(scene, "jump", order=order)
    assert distance(path.final, ap.solve(scene).final) < path.error < 10 * float(sp.Rational(small)) ** (order + 1)


@pytest.mark.parametrize("unit", [10**6, 10**20])
@pytest.mark.parametrize("force", [x + 1 - y, x + 1 - y - y**3 / 3, 1 + sp.Max(x - sp.Rational(1, 2), 0) - y])
def test_a_fast_state_that_leaves_zero_settles_on_a_branch_that_is_large_in_its_unit(force, unit):
    plain, scaled = (
        _solved(ap.System.smooth({x: y / unit - x}, {y: unit * force.subs(y, y / unit)}, mu), {mu: "1/1000"},
                {x: "1/4", y: 0}, 1) for unit in (1, unit)
    )
    assert np.array(scaled.final) / (1, unit) == pytest.approx(plain.final, rel=1e-9)


def test_states_that_stay_small_without_slow_ones_settle_on_their_own_branch():
    unit = sp.Rational(1, 10**9)
    alone = ap.System.smooth({}, {y: y - y**3 / unit**2, w: 10 * y - w}, mu)
    assert _solved(alone, {mu: "1/100"}, (unit / 2, 0), 1, order=0).final == pytest.approx((1e-9, 1e-8), rel=1e-9)


@pytest.mark.parametrize(("damping", "turning", "most"), [(0.1, 10, 1e-8), (0.02, 5, 2e-8)])
@pytest.mark.few(1)
def test_a_fast_oscillation_whose_damping_is_a_hundredth_is_followed_until_it_has_settled(damping, turning, most):
    """With a damping of 0.02 the layer was given up before it was near its branch, the only one there is."""
    k, r = sp.Rational(str(damping)), turning
    system = ap.System.smooth({x: -x + y}, {y: -k * y + r * w + x, w: -r * y - k * w}, mu)
    path = _solved(system, {mu: "1/1000"}, (1, 1, 1), 1)
    rates = np.array([[-1, 1, 0], [1000, -1000 * damping, 1000 * turning], [0, -1000 * turning, -1000 * damping]])
    assert abs(path.final - expm(rates) @ np.ones(3)).max() < path.error < most


@pytest.mark.parametrize(("order", "most"), [(0, "5e-5"), (1, "1e-7")])
def test_the_error_of_a_small_state_counts_by_its_size_beside_a_large_one(order, most):
    """Michaelis and Menten's product P is 1 and takes up a substrate of 1e-6: P is nearly right whatever the latter."""
    product = sp.Symbol("P", real=True)
    system = ap.System.smooth({x: y / 2 - x * (1 - y), product: y / 2}, {y: x * (1 - y) - y}, mu)
    start = {x: "1e-6", product: 1, y: 0}
    scene = ap.Scene(system=system, values={mu: "1/100"}, start=start, until=1)
    path, truth = ap.solve(scene, "jump", order=order), ap.solve(scene, digits=16).final
    error = max(abs(float(a - b)) for a, b in zip(path.final, truth, strict=True))
    assert error < path.error < float(most)


@pytest.mark.parametrize("method", ["jump", "slow"])
@pytest.mark.few(1)
def test_the_terms_of_a_layer_count_where_those_of_its_slow_motion_do_not_fall(method):
    """u fades like exp(-t/3mu): at mu = 1/5 its layer drives x and y long after both would rest on their manifold."""
    slow = {x: -6 * u - x * y / 2, y: 5 * u - 3 * x * y}
    fast = {v: 5 * y / 12 - 3 * x**2 - 4 * v, u: 2 * sp.tanh(u) / 3 - u}
    start = {x: "3/4", y: "-1/2", v: "-7/4", u: "-1/2"}
    scene = ap.Scene(system=ap.System.smooth(slow, fast, mu), values={mu: "1/5"}, start=start, until=2)
    path, truth = ap.solve(scene, method, order=1), ap.solve(scene, digits=10).final
    assert distance(path.final, truth) < path.error


@pytest.mark.parametrize("until", ["8/10", "1"])
def test_a_motion_that_leaves_for_infinity_is_as_wrong_as_is_said_or_refused(until):
    """The terms are small at first; near the end, where the states grow without bound, they no longer fall."""
    slow, fast = {x: -6 * u, y: -u - 6 * v}, {v: u**2 / 12 - v + 3 * sp.Abs(x) / 4, u: 3 * y - sp.sin(y) / 4 - 4 * u}
    start = {x: "-3/2", y: -1, v: "-5/4", u: "3/2"}
    scene = ap.Scene(system=ap.System.smooth(slow, fast, mu), values={mu: "1/1000"}, start=start, until=until)
    try:
        path = ap.solve(scene, "jump", order=0)
    except (OutOfRange, NotNormallyHyperbolic):
        assert until == "1"
    else:
        assert distance(path.final, ap.solve(scene).final) < path.error


def test_a_refusal_tells_states_of_a_tenth_in_their_own_unit():
    """The Oregonator is near its fold: its base point is off the branch, in whatever units it is looked for."""
    force = x * (1 - x) - v * (x - sp.Rational(1, 50)) / (x + sp.Rational(1, 50))
    system = ap.System.smooth({v: x - v}, {x: force}, mu)
    scene = ap.Scene(system=system, values={mu: "1/10"}, start={v: "1/5", x: 1}, until="1/2")
    with pytest.raises(OutOfRange, match=r"the base point v = 0\.35442 is off the branch"):
        ap.solve(scene, order=1, method="jump")


@pytest.mark.parametrize("function", [sp.sec, sp.csc, sp.cot, sp.sech, sp.csch, sp.coth, sp.asinh, sp.acosh, sp.atanh])
@pytest.mark.few(2)
def test_models_know_inverse_hyperbolic_functions_and_quotients_of_circular_ones(function):
    argument = 2 + x / 5 if function in (sp.csc, sp.cot, sp.acosh) else x / 2 + sp.Rational(1, 5)
    system = ap.System.smooth({x: y / 5 - x}, {y: function(argument) - y - y**3 / 100}, mu)
    scene = ap.Scene(system=system, values={mu: "1/100"}, start={x: 1, y: 0}, until="1/2")
    path, truth = ap.solve(scene, "jump", order=2), ap.solve(scene)
    times = [0.0, 0.01, 0.3]
    assert distance(path.final, truth.final) < path.error < 1e-5
    assert path(times) == pytest.approx(truth(times), abs=3e-5)


@pytest.mark.parametrize("order", [0, 1])
def test_a_saw_tooth_that_comes_up_to_a_bound_jumps_back_from_it(order):
    x, y, t = sp.symbols("x y t", real=True)
    system = ap.System.smooth({x: sp.Max(1, sp.Mod(t, 1))}, {y: x - y}, sp.Symbol("mu", positive=True), time=t)
    path = ap.solve(ap.Scene(system=system, values={"mu": "1e-3"}, start=[0, 0], until=3), "jump", order=order)
    assert path.final[0] == pytest.approx(3, abs=1e-9)


@pytest.mark.parametrize(("begun", "small", "told"), [
    ("1e200", "1/1000", "a number is beyond floats"), ("0", "1e300", "Numerical result out of range"),
])
def test_a_number_beyond_floats_is_told_in_words_alone(begun, small, told):
    """It was told as (34, 'Numerical result out of range'), or not at all."""
    system = ap.System.smooth(slow={x: 1 - x * (1 + y) ** 2}, fast={y: x * (1 + y) ** 2 - y**3}, small=mu)
    with pytest.raises(OutOfRange, match=rf"no finite value \({told}\)"):
        ap.solve(ap.Scene(system=system, values={mu: small}, start={x: 1, y: begun}, until=1), "jump")


@pytest.mark.parametrize(("drawn", "at"), [
    (lambda x, z: sp.erf(x), lambda x, z: mpmath.erf(x)), (sp.atan2, mpmath.atan2),
], ids=["erf", "atan2"])
def test_models_with_the_error_function_and_with_an_angle_converge_with_their_order(drawn, at):
    """A fast state relaxes to a function of exp(-t) and -exp(-t/2): an integral."""
    x, y, z, mu = *sp.symbols("x y z", real=True), sp.Symbol("mu", positive=True)
    system = ap.System.smooth({x: -x, z: -z / 2}, {y: drawn(x, z) - y}, mu)
    end, errors = mpmath.mpf("0.8"), []
    for small in (mpmath.mpf("0.01"), mpmath.mpf("0.005")):
        drive = lambda s, m=small: at(mpmath.exp(m * s - end), -mpmath.exp((m * s - end) / 2))  # noqa: E731
        eased = mpmath.quad(lambda s, drive=drive: mpmath.exp(-s) * drive(s), [0, 5, 20, end / small])
        scene = ap.Scene(system=system, values={mu: small}, start={x: 1, z: -1, y: 0}, until=end)
        reached = [ap.solve(scene, "jump", order=n).final[2] for n in (0, 1, 2)]
        errors.append([abs(value - eased) for value in reached])
    for n, (wide, fine) in enumerate(zip(*errors, strict=True)):
        assert wide / fine == pytest.approx(2 ** (n + 1), rel=0.05)


@pytest.mark.parametrize(("fast", "plain"), [
    ((sp.exp(2 * x + 2 * kappa) - 1) / (sp.exp(x + kappa) - 1) - y, sp.exp(x + kappa) + 1 - y),
    (x - y - sp.sin(y / 5) / sp.sin(y / 10), x - y - 2 * sp.cos(y / 10)),
])
@pytest.mark.parametrize("start", ["-1", "-0.99999"])
def test_a_quotient_that_is_0_over_0_at_the_start_has_the_models_of_its_limit(fast, plain, start):
    """It was refused there, and beside it as motion whose states grow beyond bounds: the values were rounding."""
    at = {"values": {kappa: 1, mu: "1/50"}, "start": {x: start, y: sp.Rational(start) + 1}, "until": 1}
    found, known = (ap.solve(ap.Scene(system=ap.System.smooth({x: y - 2 * kappa - x**3}, {y: rate}, mu), **at),
                             "jump", order=3) for rate in (fast, plain))
    assert np.abs(np.subtract(found.final, known.final)).max() < 1e-12
    assert abs(found.error / known.error - 1) < 0.01


@pytest.mark.slow
def test_flows_to_higher_orders_that_blow_up_are_given_up_soon():
    """The flow to order 1 took 7 steps, and those to orders 2 and 3 took 20,000 towards a pole: 15 seconds."""
    slow = {x: 5 * T**3 + 12 * sp.sqrt(x**2 + 1) / 5, w: 18 * v / 5 + 4 * x * w**2 - sp.sin(u) / 10,
            T: -T - 4 * v * x**2 / 5 - 3 * v / 2 - sp.tanh(v) / 10}
    fast = {u: -u / 2 + 5 * sp.log(w**2 + 1) / 4 - 6 * sp.tanh(v) / 5 + sp.Rational(1, 5),
            v: 11 * T / (20 * (u**2 + 1)) - v - sp.Rational(1, 6) + sp.exp(-(x**2)) / 30}
    begun = process_time()
    with pytest.raises(OutOfRange, match=r"the reduced flow ends near t = 0\.4915"):
        _solved(ap.System.smooth(slow, fast, mu), {mu: "1/10"}, ("0.3", 2, -1, "-1.7", "1.7"), "1/2", "slow")
    assert process_time() - begun < 6
