"""The jump map: derived for every layer, and right to the last term that is claimed."""

from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise

import mpmath
import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import asympk as ap
from asympk.asymptotics.jump import first_integral, jump_map
from asympk.asymptotics.ratio import Ratios
from asympk.errors import InputError, NotDerivable, OrderError, OutOfRange
from asympk.symbolic.lowering import lower
from asympk.symbolic.system import System
from asympk.systems import painleve_klein as pk

SYSTEM = pk.system()
F = sp.Symbol("F", real=True)
x, y, z, mu, sigma, sigma0 = pk.x, pk.y, pk.z, SYSTEM.small, pk.sigma, pk.sigma0
MUS = [f"1e-{k}" for k in (2, 3, 4, 6, 8, 10, 12)]

FROM_BELOW = ("slip_opposite", "stick", "slip_same")
FROM_BELOW_TENSE = ("slip_same", *FROM_BELOW)
FROM_ABOVE = ("slip_opposite", "stick", "slip_opposite", "slip_same")
STEEP = {
    FROM_BELOW: [(1, (0, "1/5", -1)), ("1/2", ("3/10", "1/5", -2)), (3, (-1, 2, "-1/2"))],
    FROM_BELOW_TENSE: [(1, (0, -1, -1)), ("1/2", ("-1/3", -1, -2)), (3, (1, -2, "-3/2"))],
    FROM_ABOVE: [(1, (0, -2, 1)), ("1/2", ("1/3", -4, 2)), (3, ("-1/2", -1, 1))],
    ("slip_opposite", "slip_same"): [(1, (0, "-1/2", 1)), (3, (1, "-11/10", 1))],
    ("slip_same",): [(1, (0, "1/2", 1)), (3, (-1, 3, 2))],
}
SHALLOW = {
    ("slip_opposite",): [("-1/2", (0, "1/5", -1)), ("-17/10", (-1, 2, -1))],
    ("slip_same", "slip_opposite"): [("-6/5", (0, -1, -1))],
    ("slip_opposite", "slip_same"): [("-17/10", (0, -1, 1)), ("-1/2", (1, -3, 1))],
}
CASES = [(s, start, way) for ways in (STEEP, SHALLOW) for way, starts in ways.items() for s, start in starts]


def values(s, start, static=None):
    named = {sigma: s, sigma0: static or s, x: start[0], y: start[1], z: start[2]}
    return {symbol: sp.Rational(value) for symbol, value in named.items()}


def test_the_layer_of_a_rod_that_all_of_several_assumptions_make_shallow_does_not_jump():
    shallow = System.with_friction({x: y}, {y: 1 - 2 * (x + y) + F}, velocity={z: 1 - (x + y) + F}, force=F,
                                   load=x + y, kinetic=sigma + 2, small=mu,
                                   assumptions=sp.And(sigma > -2, sigma < 0))
    found = jump_map(shallow)
    assert found.itinerary == ("slip_opposite",)
    assert sp.cancel(found.x.coefficient(1) - (x + y + 1 / sigma) / -sigma) == 0  # y - (-1/sigma - x) decays at -sigma


@pytest.mark.parametrize("range_", [sp.And(sigma > 3, sigma < 40), sigma > 7, sp.Or(sigma > 5, sp.Eq(sigma, 4))])
@pytest.mark.few(1)
def test_a_layer_has_its_law_in_every_range_of_parameters_that_the_assumptions_allow(range_):
    def limit(assumptions):
        steep = System.with_friction({x: y}, {y: 1 - 2 * (x + y) + F}, velocity={z: 1 - (x + y) + F}, force=F,
                                     load=x + y, kinetic=sigma + 2, small=mu, assumptions=assumptions)
        return jump_map(steep)

    assert limit(range_).itinerary == FROM_BELOW
    assert sp.cancel(limit(range_).x.expr - limit(sigma > 0).x.expr) == 0


def layer_of_a_load_without_the_slow_state(back, start):
    """The load y of mu y' = 1 - 2 y + F decays to 1/3 as exp(-3 t/mu) where it pushes, and grows as 1 - y before."""
    viscous = System.with_friction({x: y - back * x}, {y: 1 - 2 * y + F}, velocity={z: 2 - y + F}, force=F, load=y,
                                   kinetic=1, small=mu)
    return jump_map(viscous, 2, start)


@pytest.mark.parametrize("back", [0, 1])
def test_a_load_that_the_slow_state_does_not_change_has_its_layer_though_a_slow_rate_is_zero_or_exact(back):
    layer = layer_of_a_load_without_the_slow_state(back, {x: 0, y: 2, z: 1})
    decayed = y - sp.Rational(1, 3)  # x loses decayed/(fast + back), fast = -3/mu
    assert layer.itinerary == ("slip_same",)
    assert [sp.expand(layer.x.coefficient(k)) for k in range(3)] == [
        x, sp.expand(decayed / 3), sp.expand(back * decayed / 9)]
    assert sp.expand(layer.z.expr - (z - 2 * mu * decayed / 3)) == 0


def test_a_load_that_is_the_fast_state_alone_vanishes_where_this_state_does():
    layer = layer_of_a_load_without_the_slow_state(0, {x: 0, y: -1, z: 1})
    assert layer.itinerary == ("slip_opposite", "slip_same")
    assert layer.events[0].y.expr == 0
    until, at = sp.log(1 - y), {x: sp.S(3), y: sp.S(-1), z: sp.S(1)}  # 1 - y is 1 after mu until
    ahead = layer.x - x - mu * (2 * until / 3 + y - sp.Rational(1, 9))
    faster = layer.z - z - mu * (2 * until / 3 + sp.Rational(2, 9))
    assert all(abs(in_numbers(series, at, "1/7")) < 1e-60 for series in (ahead, faster))



@pytest.mark.parametrize("begun", [{x: 0, y: 4, z: 0, sigma: "-3/2"}, {x: 0, y: "9/2", z: 0, sigma: "-3/2"}])
def test_a_velocity_that_returns_to_rest_within_the_layer_in_which_it_left_rest_is_refused(begun):
    """The map led to Pi_2, and was wrong by order mu: the exact rod stops at once and slides forward."""
    path = ap.solve(ap.Scene(sigma="-3/2", mu="1e-6", start=tuple(begun[v] for v in (x, y, z)), until="1/2"))
    assert path.modes[:2] == ("slip_opposite", "stick")
    with pytest.raises(NotDerivable, match="slip_opposite: the velocity, of order mu since it left rest, vanishes"):
        jump_map(SYSTEM, 1, begun)


@cache
def derived(s, start, order, static=None):
    return jump_map(SYSTEM, order, values(s, start, static))


lowered = cache(lower)


def in_numbers(series, at, mu_text):
    symbols = sorted(at, key=str)
    found = lowered((*symbols, mu), series.expr, "mpmath")
    return found(*(Fraction(int(at[v].p), int(at[v].q)) for v in symbols), mu_text)


def tends_to_omitted(series, kept, omitted, at, true):
    """Tell whether what a series misses of ``true(mu)`` tends to its first omitted terms."""
    missed = [true(mu_text) - in_numbers(series.truncated(kept), at, mu_text) for mu_text in MUS]
    first = [in_numbers(series.power(omitted), at, mu_text) for mu_text in MUS]
    closeness = [abs(error / term - 1) for error, term in zip(missed, first, strict=True)]
    return closeness[-1] < 1e-7 and all(b < a for a, b in pairwise(closeness[-4:]))


def landed(path, scene):
    """Return (x, z) at t = 0 of the exact slow motion that the path is on at its end."""
    b = mpmath.mpf(scene.sigma.numerator) / scene.sigma.denominator
    b = b + 4 if path.modes[-1] == "slip_same" else -b
    m, t = (mpmath.mpf(v.numerator) / v.denominator for v in (scene.mu, scene.until))
    slow = (-b + mpmath.sqrt(b * b - 4 * m * b)) / (2 * m) if b > 0 else -2 / (1 + mpmath.sqrt(1 - 4 * m / b))
    rest, (last, _, velocity) = 1 / b, path.final
    part = (last - rest) * mpmath.exp(-slow * t)
    per = (1 - b) * (1 + slow) / slow
    return rest + part, velocity - rest * t - per * part * (mpmath.exp(slow * t) - 1)


def exact(s, start, mu_text, until, static=None):
    scene = ap.Scene(str(s), mu_text, tuple(map(str, start)), until, sigma0=None if static is None else str(static))
    return ap.solve(scene, digits=60), scene


@pytest.fixture(autouse=True)
def many_digits():
    with mpmath.workdps(70):
        yield


# structure


def test_the_integral_with_a_slow_drift_is_found():
    found = first_integral(SYSTEM)
    assert sp.expand(found.expr - (z - mu * y - x)) == 0
    assert found.rate == x
    for mode in SYSTEM.modes:
        rate = sum(sp.diff(found.expr, v) * f for v, f in mode.slow.items())
        assert sp.expand(rate + sp.diff(found.expr, y) / mu * mode.fast[y] - x) == 0


@pytest.mark.parametrize("way", [FROM_BELOW, FROM_BELOW_TENSE, FROM_ABOVE])
def test_in_the_limit_the_velocity_vanishes_and_x_takes_it_over(way):
    for s, start in STEEP[way]:
        jump = derived(s, start, 0)
        assert jump.itinerary == way
        assert jump.z.coefficient(0) == 0
        assert sp.expand(jump.x.coefficient(0) - (x - z)) == 0


@pytest.mark.parametrize("way", [FROM_BELOW, FROM_BELOW_TENSE, FROM_ABOVE])
def test_mid_jump_on_the_switching_plane_y_is_of_order_one_over_mu(way):
    hit = next(e for e in derived(*STEEP[way][0], 0).events if e.kind == "velocity_zero")
    assert sp.cancel(hit.y.coefficient(-1) + sigma * z / (sigma + 1)) == 0
    assert sp.cancel(hit.x.coefficient(0) - (x - z / (sigma + 1))) == 0


def test_the_plane_is_met_after_mu_log_over_sigma_and_left_after_mu_log_more():
    jump = derived(*STEEP[FROM_BELOW][0], 1)
    assert jump.t_hit.coefficient(1, 1) == 1 / sigma
    assert sp.cancel((jump.t_leave - jump.t_hit).coefficient(1, 1)) == 1


@pytest.mark.parametrize(("s", "start", "way"), CASES)
@pytest.mark.few(3)
def test_a_lower_order_is_the_beginning_of_a_higher_one(s, start, way):
    low, high = derived(s, start, 0), derived(s, start, 1)
    assert low.itinerary == high.itinerary == way
    for name in ("x", "z"):
        difference = getattr(high, name).truncated(0) - getattr(low, name)
        assert not any(sp.cancel(c) for c in difference.terms.values())


@pytest.mark.parametrize(("s", "start", "way"), CASES)
def test_the_start_satisfies_the_domain_of_its_layer(s, start, way):
    assert derived(s, start, 0).domain.subs(values(s, start)) == sp.true


def test_domains_are_the_quadrants_of_the_phase_space():
    assert derived(*STEEP[FROM_BELOW][0], 1).domain == sp.And(sigma > 0, z < 0, x + y > 0)
    assert derived(*STEEP[FROM_BELOW_TENSE][0], 1).domain == sp.And(sigma > 0, z < 0, x + y < 0)
    assert derived(*STEEP[("slip_same",)][0], 1).domain == sp.And(z > 0, x + y > 0)
    above = derived(*STEEP[FROM_ABOVE][0], 1).domain
    assert above == sp.And(sigma > 0, z > 0, x + y < 0, -sigma * (x + y) - 1 > 0)


@pytest.mark.slow
def test_the_shallow_rod_sticks_on_arrival_above_minus_three_halves_and_crosses_below():
    ways = {s: jump_map(SYSTEM, 0, {sigma: sp.Rational(s)}, arrival="slip_opposite").itinerary
            for s in ("-1/2", "-6/5", "-149/100", "-151/100", "-17/10")}
    assert [ways[s] for s in ("-1/2", "-6/5", "-149/100")] == [("stick", "slip_same")] * 3
    assert [ways[s] for s in ("-151/100", "-17/10")] == [("slip_same",)] * 2


def test_an_arrival_on_the_shallow_side_changes_x_and_z_by_order_mu_alone():
    for s in ("-1/2", "-6/5", "-17/10"):
        jump = jump_map(SYSTEM, 1, {sigma: sp.Rational(s)}, arrival="slip_opposite")
        assert jump.x.coefficient(0) == x
        assert jump.z.coefficient(0) == jump.z.coefficient(1, 1) == jump.x.coefficient(1, 1) == 0


# against the exact flow


@pytest.mark.few(0)
@pytest.mark.parametrize(("s", "start", "way"), CASES)
@pytest.mark.parametrize("order", [0, 1])
def test_error_of_the_jump_map_tends_to_its_first_omitted_terms(s, start, way, order):
    jump, at, until = derived(s, start, order + 1), values(s, start), 1 if way[-1] == "slip_same" else "1/4"
    assert all(exact(s, start, mu_text, until)[0].modes == way for mu_text in MUS)
    for k, series in enumerate((jump.x, jump.z)):
        assert tends_to_omitted(series, order, order + 1, at, lambda mu, k=k: landed(*exact(s, start, mu, until))[k])


@pytest.mark.parametrize("way", [FROM_BELOW, FROM_BELOW_TENSE, FROM_ABOVE])
@pytest.mark.few(1)
def test_errors_of_event_times_and_states_tend_to_their_first_omitted_terms(way):
    s, start = STEEP[way][0]
    jump, at = derived(s, start, 1), values(s, start)
    for i, event in enumerate(jump.events):
        for name, kept, omitted in (("t", 1, 2), ("x", 0, 1), ("y", event.y.size[0], event.y.size[0] + 1)):
            true = {mu_text: exact(s, start, mu_text, 1)[0].events[i] for mu_text in MUS}
            assert {e.kind for e in true.values()} == {event.kind}
            found = {mu_text: getattr(e, name) for mu_text, e in true.items()}
            assert tends_to_omitted(getattr(event, name), kept, omitted, at, found.get)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.few(0)
def test_the_events_of_the_model_in_numbers_are_those_of_the_map_cut_at_its_order(order):
    jump, start, mu = jump_map(pk.system(), order=2, start={pk.sigma: 1}), (0, Fraction(1, 5), -1), Fraction(1, 1000)
    path = ap.solve(ap.Scene(1, mu, start, 1), method="jump", order=order)
    given = {pk.sigma: 1, pk.sigma0: 1, **dict(zip((pk.x, pk.y, pk.z), map(sp.Rational, start), strict=True))}
    at = lambda series, p: float(series.cut(p).expr.subs({**given, pk.mu: sp.Rational(mu)}))  # noqa: E731
    for event, own in zip(path.events, jump.events, strict=True):
        assert event.t == pytest.approx(at(own.t, 1 + order), rel=1e-12)
        found = [at(own.x, order), at(own.y, order + min(0, own.y.size[0]))]
        assert event.state[:2] == pytest.approx(found, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("start", [(0, "1/5", -1), (0, -2, 1)])
def test_static_friction_enters_at_order_mu_and_as_the_exact_flow_says(start):
    jump, at = derived(1, start, 2, 3), values(1, start, 3)
    assert not any(sigma0 in jump.x.coefficient(p, q).free_symbols for p, q in ((0, 0), (1, 1)))
    assert tends_to_omitted(jump.x, 1, 2, at, lambda mu_text: landed(*exact(1, start, mu_text, 1, 3))[0])


# other systems


def other_system():
    a, b, v, force, small = *sp.symbols("a b v F", real=True), sp.Symbol("epsilon", positive=True)
    load = 2 * a + b - 1
    return System.with_friction(
        slow={a: b - a / 2}, fast={b: 1 - 2 * load + force}, velocity={v: 1 - load + force}, force=force,
        load=load, kinetic=3, static=sp.Rational(7, 2), small=small,
    )


def integrated(system, start, jump, small):
    """Return x at t = 0 of the slow motion that an integration, mode by mode, ends on."""
    (fast,), velocity = system.modes[0].fast, system.friction.velocity
    states = (next(v for v in system.modes[0].slow if v != velocity), fast, velocity)
    friction, t, state = system.friction, 0.0, [float(start[v]) for v in states]
    edge = system.drive - friction.static * friction.load
    levels = {"velocity_zero": velocity, "slip_onset": edge, "force_zero": friction.load}
    for mode, event in zip(jump.itinerary, [*jump.events, None], strict=True):
        rates = system.mode(mode)
        field = lower(states, [rates.slow[states[0]], rates.fast[fast] / small, rates.slow[velocity]], "math")
        stop = []
        if event:
            level = lower(states, levels[event.kind], "math")
            stop = [lambda t, u, level=level: level(*u)]
            stop[0].terminal = True
        found = solve_ivp(lambda t, u, field=field: field(*u), (t, t + 0.2), state, "Radau", events=stop,
                          rtol=1e-10, atol=1e-12, first_step=float(small) * 1e-4)
        t, state = found.t[-1], list(found.y[:, -1])
    equations = sp.Matrix([rates.slow[states[0]], rates.fast[fast] / small])
    matrix = np.array(equations.jacobian(states[:2]), dtype=float)
    rest = np.linalg.solve(matrix, -np.array(equations.subs(dict.fromkeys(states, 0)), dtype=float).ravel())
    speeds, vectors = np.linalg.eig(matrix)
    parts = np.linalg.solve(vectors, np.array(state[:2]) - rest)
    k = np.argmin(abs(speeds))
    return rest[0] + parts[k] * vectors[0, k] * np.exp(-speeds[k] * t)


@pytest.mark.further
def test_another_system_jumps_as_its_equations_say():
    system = other_system()
    a, b = sp.symbols("a b", real=True)
    start = {a: sp.Rational(1, 3), b: sp.Rational(3, 2), system.friction.velocity: -1}
    jump = jump_map(system, 2, start)
    assert jump.itinerary == FROM_BELOW
    closeness = []
    for small in ("1/100", "1/200", "1/400"):
        at = {system.small: sp.Rational(small), **start}
        error = integrated(system, start, jump, sp.Rational(small)) - float(jump.x.truncated(1).expr.subs(at))
        closeness.append(abs(error / float(jump.x.power(2).expr.subs(at)) - 1))
    assert closeness[0] > closeness[1] > closeness[2]
    assert closeness[2] < 0.05


def test_a_system_without_a_common_integral_says_so():
    found = first_integral(other_system())
    assert found.rate.free_symbols == {sp.Symbol("a", real=True)}
    entering = System.with_friction(
        slow={x: y - F / 2}, fast={y: 1 - 2 * (x + y) + F}, velocity={z: 1 - (x + y) + F}, force=F, load=x + y,
        kinetic=sigma + 2, static=sigma0 + 2, small=mu, assumptions=SYSTEM.assumptions,
    )
    with pytest.raises(NotDerivable, match="free of the fast motion"):
        first_integral(entering)


# refusals


@pytest.mark.parametrize("push", [sp.pi, sp.sqrt(2), sp.sin(sigma)])
def test_a_coefficient_that_is_not_rational_in_the_parameters_is_refused_in_symbols(push):
    pushed = System.with_friction(
        slow={x: y}, fast={y: push - 2 * (x + y) + F}, velocity={z: 1 - (x + y) + F}, force=F, load=x + y,
        kinetic=sigma + 2, small=mu, assumptions=sigma > -2,
    )
    with pytest.raises(NotDerivable, match="is not rational in the parameters"):
        jump_map(pushed, start={sigma: 1})


@pytest.mark.parametrize("order", [-1, 4, 1.0, True, "1"])
def test_an_order_that_is_not_known_is_refused(order):
    with pytest.raises(OrderError, match="orders 0"):
        jump_map(SYSTEM, order)


def test_coefficients_beyond_the_order_are_refused():
    jump = derived(*STEEP[FROM_BELOW][0], 1)
    with pytest.raises(OrderError, match="not known"):
        jump.x.coefficient(2)
    with pytest.raises(OrderError, match="asked for"):
        jump.z.truncated(2)


def test_a_start_on_the_divide_has_no_layer():
    with pytest.raises(OutOfRange, match="repelling manifold of slip_opposite"):
        jump_map(SYSTEM, 1, {sigma: 1, x: 0, y: -1, z: 1})


def test_without_a_fast_rate_there_is_no_layer():
    with pytest.raises(OutOfRange, match="neither settles nor grows"):
        jump_map(SYSTEM, 1, {sigma: 0, sigma0: 0})


def test_a_layer_that_meets_no_event_of_a_kind_says_so():
    with pytest.raises(NotDerivable, match="slip_same has no velocity_zero"):
        _ = derived(*STEEP[("slip_same",)][0], 0).t_hit


def test_systems_without_a_jump_are_refused():
    cubic = System.with_friction(
        slow={x: y}, fast={y: -(y**3) - x + sigma0}, velocity={z: -y + sigma0}, force=sigma0, load=x + y, kinetic=1,
        static=1, small=mu,
    )
    with pytest.raises(NotDerivable, match=r"not affine in x and y alone.*solve\(scene, method='jump'"):
        jump_map(cubic)
    block = System.with_frictions({x: z}, {z: sigma0 - x}, [ap.Friction(z, sigma0, 1, 1)], small=mu)
    with pytest.raises(NotDerivable, match="the sliding velocity z is no slow state"):
        jump_map(block)


@pytest.mark.parametrize("start", [{x: "1/3", y: "3/2", z: -1}, {x: "1/3", y: -2, z: 1}])
@pytest.mark.parametrize(
    ("pull", "static", "words"),
    [(5, "7/2", r"at an unbounded load friction does not hold, .*; solve\(scene, method='jump'"), (5, 6, None),
     (1, "7/2", None), (-5, 6, r"the load grows without bound and the velocity with it; follow it by solve\(scene\)")],
)
@pytest.mark.few(2)
def test_a_load_without_bound_must_stop_the_mass_and_hold_it(pull, static, words, start):
    """Friction 3 L does not stop it against a pull of -5 L, and 7/2 L does not hold it against 5 L; 6 L does."""
    load = x + y
    system = System.with_friction(
        slow={x: y}, fast={y: 1 - 2 * load + F}, velocity={z: 1 + pull * load + F}, force=F, load=load, kinetic=3,
        static=sp.Rational(static), small=mu,
    )
    with pytest.raises(NotDerivable, match=words) if words else nullcontext():
        assert "stick" in jump_map(system, 1, start).itinerary


def test_a_system_whose_rates_contain_the_time_has_no_jump_map_in_symbols():
    # the time that a layer takes would be missing from the order 2 on; a time that nothing depends on is none
    time, force = sp.symbols("t F")

    def driven(drive):
        return System.with_friction({x: y}, {y: 1 - 2 * (x + y) + force + drive}, velocity={z: 1 - x - y + force},
                                    force=force, load=x + y, kinetic=3, small=mu, time=time)

    for drive in (time, sp.exp(time)):
        with pytest.raises(NotDerivable, match=r"the time t is in the system.*solve\(scene, method='jump'"):
            jump_map(driven(drive))
    assert str(jump_map(driven(0), order=0).z) == "O(mu L)"


def _heavier(static, more=0):
    """Return a rod with a rough mass as heavy again as the smooth one, with ``more`` in the load."""
    load = x + y + more
    return System.with_friction({x: y}, {y: 1 - 3 * load / 2 + F}, velocity={z: 1 - load + F}, force=F, load=load,
                                kinetic=3, static=static, small=mu)


def test_static_friction_of_the_jump_is_that_at_rest_and_that_by_the_states_is_refused():
    """Both were taken at the start: stick by 3 + x^2 was told to end too early, and by 3 + z^2 too late."""
    assert jump_map(_heavier(3 + z**2), 1).t_leave == jump_map(_heavier(3), 1).t_leave
    for static in (3 + x**2, sp.Piecewise((3, z > 0), (4, True))):
        with pytest.raises(NotDerivable, match=r"static friction .* changes with the states or the direction"):
            jump_map(_heavier(static))


def test_static_friction_without_a_value_at_rest_is_refused():
    """A quotient 0/0 at rest ended in a TypeError, and 3 + x z was refused, which is 3 at rest."""
    for static in (3 + sp.sin(z) / z, 3 + 1 / (1 + sp.exp(-1 / z**2)), 3 + 1 / sp.Abs(z)):
        with pytest.raises(NotDerivable, match=r"static friction .* is not finite at rest"):
            jump_map(_heavier(static))
    assert jump_map(_heavier(3 + x * z), 1).t_leave == jump_map(_heavier(3), 1).t_leave


def test_a_small_parameter_in_the_rates_is_named_as_what_a_jump_map_is_derived_without():
    """The load x + y + mu y ended in a TypeError."""
    for more in (mu, mu * y):
        with pytest.raises(NotDerivable, match="the small parameter mu is in the rates"):
            jump_map(_heavier(3, more))


def test_a_load_that_contains_its_own_force_is_named_as_what_a_jump_map_is_derived_without():
    """It ended in a TypeError."""
    fed_back = System.with_friction({x: y}, {y: 1 - 2 * (x + y) + F}, velocity={z: 1 - (x + y) + F}, force=F,
                                    load=x + y + F / 8, kinetic=sp.Rational(1, 2), small=mu)
    with pytest.raises(NotDerivable, match="contains its own force"):
        jump_map(fed_back)


def test_an_unknown_symbol_in_the_start_is_refused():
    with pytest.raises(ap.errors.InputError, match="q is not a state or parameter of start"):
        jump_map(SYSTEM, 0, {sp.Symbol("q"): 1})


# which region


def test_the_region_comes_first_and_says_what_was_chosen_and_how_to_choose_another():
    jump = jump_map(SYSTEM, 1)
    first, second, *_ = str(jump).splitlines()
    assert first == "for sigma > 0 and z < 0 and x + y > 0"
    assert second.startswith("(chosen: sigma = 1, x = 0, y = 1/5, z = -1; another region by start=")
    assert repr(jump).startswith(f"JumpMap {first}\n(chosen: sigma = 1")
    assert len(repr(jump)) < 1200
    assert repr(jump).splitlines()[-1] == f"as mu -> 0, x -> x - z, z -> 0; known to order {jump.order}"
    assert jump.chosen == ("sigma", "x", "y", "z")
    assert jump.domain.subs(jump.sample) == sp.true


def test_another_start_by_name_gives_the_map_of_another_region():
    jump = jump_map(SYSTEM, 0, {"sigma": "-1/2", "x": 0, "y": 1, "z": -1})
    assert jump.chosen == ()
    assert str(jump).startswith("for sigma < 0 and z < 0 and x + y > 0\nx -> ")
    assert jump.domain != jump_map(SYSTEM, 0).domain
    assert jump == jump_map(SYSTEM, 0, {sigma: sp.Rational(-1, 2), x: 0, y: 1, z: -1})


@pytest.mark.parametrize(
    ("start", "match"),
    [
        ((0, 0, 0), r"\(0, 0, 0\) is not a mapping from each state or parameter of start to its value, such as"),
        ("sigma", "'sigma' is not a mapping"),
        ({"sgima": 1}, "sgima is not a state or parameter of start; .*; did you mean sigma?"),
        ({"z": float("nan")}, "z = 'nan'"),
        ({"z": [1, 2]}, r"z = \[1, 2\]"),
        ({"sigma": -3}, r"sigma = -3 is outside the range of this system, sigma > -2"),
        ({"sigma": 1, "sigma0": 0}, "sigma = 1, sigma0 = 0 is outside the range of this system, sigma0 >= sigma"),
        ({sp.Symbol("sigma"): 1}, "the Symbol sigma has other assumptions"),
        ({"sigma": 1, sigma: 2}, "sigma is given twice"),
    ],
)
def test_a_start_that_is_none_is_refused_by_name(start, match):
    with pytest.raises(ap.errors.InputError, match=match):
        jump_map(SYSTEM, 0, start)


@pytest.mark.parametrize("option", ["arrival", "near"])
def test_a_mode_that_does_not_exist_is_refused_by_name(option):
    with pytest.raises(ap.errors.InputError, match="mode 'slip_oposite' is unknown"):
        jump_map(SYSTEM, 0, **{option: "slip_oposite"})


def test_a_force_with_any_coefficient_in_the_velocity_leaves_the_cone_by_the_drive_over_it():
    """With z counted in another unit, z -> z / 3, friction enters z' with 1/3, and the map is the same."""
    scaled = System.with_friction(
        slow={x: y}, fast={y: 1 - 2 * (x + y) + F}, velocity={z: (1 - (x + y) + F) / 3}, force=F, load=x + y,
        kinetic=sigma + 2, static=sigma0 + 2, small=mu, assumptions=SYSTEM.assumptions,
    )
    ours, theirs = jump_map(SYSTEM, 1, {sigma: 1}), jump_map(scaled, 1, {sigma: 1})
    assert theirs.itinerary == ours.itinerary
    at = {sigma: 1, sigma0: 2, y: sp.Rational(1, 3), x: sp.Rational(1, 7), mu: sp.Rational(1, 1000)}
    for found, expected in ((theirs.x, ours.x), (3 * theirs.z.expr, ours.z.expr)):
        found, expected = (getattr(e, "expr", e) for e in (found, expected))
        assert abs((found.subs(z, sp.Rational(-1, 3)) - expected.subs(z, -1)).subs(at).evalf(30)) < 1e-20


def test_at_sigma_0_the_jump_takes_the_root_of_mu_and_so_does_its_error():
    """The stop comes after sqrt(-2 mu z), x ends at x - z; what is left of both goes like sqrt(mu)."""
    late, moved = [], []
    for mu in (1e-4, 1e-6, 1e-8):
        stop, leave = ap.solve(ap.Scene(sigma=0, mu=mu, start=(0, 0.2, -1), until=1)).events
        late.append((stop.t / np.sqrt(2 * mu) - 1) / np.sqrt(mu))
        moved.append((leave.x - 1) / np.sqrt(mu))
    for found in (late, moved):
        assert abs(found[2] - found[1]) < 0.2 * abs(found[1] - found[0])
        assert 0.1 < abs(found[2]) < 2


def _contact(fast, rate, kinetic, static):
    return System.with_friction({x: y}, {y: fast}, {z: rate}, F, x + y, kinetic, static, mu)


def test_a_load_that_settles_where_it_vanishes_is_refused_and_not_said_to_pass():
    system = _contact(F / 2 - 2 * (x + y), 2 * F + x + y, sp.Rational(7, 2), None)
    with pytest.raises(OutOfRange, match="settles where it vanishes"):
        jump_map(system, start={x: 3, y: 2, z: -2})


@pytest.mark.parametrize("order", [0, 1])
def test_a_velocity_that_leaves_rest_and_vanishes_again_within_the_layer_has_no_series(order):
    system = _contact(F - sp.Rational(5, 3) * (x + y) + sp.S.Half, 2 * F + 2 * (x + y) - 1, sp.Rational(7, 3), 4)
    with pytest.raises(NotDerivable, match=r"slip_opposite: .* vanishes again at a time .*; solve\(scene,"):
        jump_map(system, order, start={x: -3, y: "1/3", z: 1})


def test_every_product_of_states_in_a_coefficient_has_one_cancelled_factor():
    a, s, x = sp.symbols("a s x")
    ratios = Ratios((a, s, x), parameters=1)
    given = ((a + 1) * (a + 2) * s + (a + 1) * x + 1) / ((a + 1) * (a + 2) * (1 + x))
    assert ratios.expr(ratios(given)) == (s + x / (a + 2) + 1 / ((a + 1) * (a + 2))) / (x + 1)


def test_the_states_of_the_jump_map_to_order_one_stand_apart_and_a_line_in_latex_has_one_term():
    jump = jump_map(pk.system(), order=1)
    sigma, static, x, y, z = pk.sigma, pk.sigma0, pk.x, pk.y, pk.z
    plain = sum(term for term in jump.x.coefficient(1).args if not term.has(sp.log))
    edge = (sigma**2 + 7 * sigma + static + 15) / ((sigma + 4) ** 2 * (static + 3))
    assert {x, y, z * (1 - 2 * sigma) / sigma} < {*plain.args}
    assert sp.cancel(plain - (x + y - (2 - 1 / sigma) * z - edge)) == 0
    assert sp.latex(jump.x).count(r"\\ &") == len(jump.x.terms)


def test_the_jump_map_does_not_depend_on_the_origin_of_the_fast_state():
    (friction,), moved = SYSTEM.frictions, lambda expr: expr.subs(y, y - 1)
    slow, fast = ({s: moved(rate) for s, rate in rates.items()} for rates in (SYSTEM.slow, SYSTEM.fast))
    beside = System.with_frictions(
        slow=slow, fast=fast, frictions=(replace(friction, load=moved(friction.load)),), small=mu,
        assumptions=SYSTEM.assumptions,
    )
    here, there = jump_map(SYSTEM, start={x: 0, y: 0.2, z: -1}), jump_map(beside, start={x: 0, y: 1.2, z: -1})
    for found, known in ((there.x, here.x), (there.z, here.z)):
        assert found.terms.keys() == known.terms.keys()
        assert all(sp.cancel(found.terms[m] - moved(c)) == 0 for m, c in known.terms.items())


def test_a_jump_map_holds_where_friction_opposes_the_velocity_and_static_friction_is_not_below_it():
    """A map was derived for static friction 2 beside kinetic friction 3, and for kinetic friction -3."""
    kinetic, static = sp.symbols("a b", real=True)

    def system(*laws):
        rates = {x: y}, {y: 1 - 2 * (x + y) + F}, {z: 1 - (x + y) + F}
        return System.with_friction(*rates, F, x + y, *laws, mu)

    found = jump_map(system(kinetic, static), order=0, start={kinetic: 1, static: 3})
    assert {kinetic >= 0, static >= kinetic} <= {*sp.And.make_args(found.domain)}
    for laws in ((3, 2), (3, -1), (kinetic, static)):
        with pytest.raises(InputError, match=r"static friction .* is below the kinetic one"):
            jump_map(system(*map(sp.sympify, laws)), start={kinetic: 3, static: 2} if kinetic in laws else None)
    with pytest.raises(InputError, match="kinetic friction -3 is negative"):
        jump_map(system(sp.Integer(-3), sp.Integer(2)))
