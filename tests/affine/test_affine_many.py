"""Arrays of affine trajectories: the scalar flow's results, for one decomposition per set of parameters."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp

import asympk as ap
from asympk.affine import many as affine_many
from asympk.affine import run
from asympk.errors import Accumulation, InputError, NegativeFriction, TwoMotions
from asympk.many import PHASES

F, G, t = sp.symbols("F G t", real=True)
x, v, y, u, w = sp.symbols("x v y u w", real=True)
mu, k = sp.symbols("mu k", positive=True)

# two masses on springs, one of them on a rough, moving ground, and a fast actuator
CHAIN = ap.System.with_frictions(
    {x: v, v: y - 2 * x + F + sp.cos(2 * t) / 2, w: x - w / 4}, {y: w - y},
    [ap.Friction(velocity=v, force=F, load=2 + x / 4, kinetic=k, static=k + sp.Rational(1, 4))], small=mu, time=t,
)


def alone(values, start, until, i):
    def at(entries):
        return {name: float(np.broadcast_to(a, (40,))[i]) for name, a in entries.items()}

    end = float(np.broadcast_to(until, 40)[i])
    return ap.solve(ap.Scene(system=CHAIN, values=at(values), start=at(start), until=end))


@pytest.fixture(scope="module")
def starts():
    random = np.random.default_rng(4)
    return {name: random.uniform(-2, 2, 40) for name in ("x", "v", "w", "y")}


def test_arrays_end_where_the_scalar_flow_ends_with_a_function_that_numpy_lacks():
    block = ap.System.with_frictions({x: v, v: F - sp.gamma(k) * x}, {},
                                     [ap.Friction(velocity=v, force=F, load=sp.gamma(k), kinetic=sp.Rational(1, 2))])
    found = ap.solve_many(system=block, values={k: 2.5}, start={x: [1.0, 2, 3], v: 0}, until=6).final.T
    for begin, final in zip((1.0, 2, 3), found, strict=True):
        scene = ap.Scene(system=block, values={k: 2.5}, start={x: begin, v: 0}, until=6)
        assert final == pytest.approx(ap.solve(scene).final, abs=1e-13)


@pytest.mark.parametrize(("belt", "push", "static"), [(0, 0, 2), (sp.S.Half, sp.sin(t), 1)])
def test_rows_that_stop_or_begin_to_slip_slowly_are_followed_together(belt, push, static):
    """The size of a velocity was its rounding before it was set to 0, and roots near the start took too many cuts."""
    friction = ap.Friction(velocity=v - belt, force=F, load=sp.Rational(1, 4), kinetic=1, static=static)
    block = ap.System.with_frictions({x: v, v: F - x - v / 10 + push}, {}, [friction], time=t if push else None)
    many = ap.solve_many(system=block, values={}, start={x: np.linspace(-3, 3, 400), v: 0}, until=10)
    assert many.alone == 0
    for i in (20, 245, 300):
        path = ap.solve(ap.Scene(system=block, start={x: float(np.linspace(-3, 3, 400)[i]), v: 0}, until=10))
        assert many.final[:, i] == pytest.approx(path.final, abs=1e-13)
        assert many.n_events[i] == len(path.events)


def test_rows_of_several_blocks_whose_static_friction_holds_more_are_followed_together():
    """Each of two blocks prefers rest by itself where its force does not act on the other's velocity."""
    frictions = [ap.Friction(velocity=v, force=F, load=1, kinetic=sp.S.Half, static=sp.Rational(3, 4)),
                 ap.Friction(velocity=u, force=G, load=1, kinetic=sp.Rational(1, 4), static=sp.S.Half)]
    blocks = ap.System.with_frictions({x: v, v: y - 2 * x + F, y: u, u: x - 2 * y + G}, {}, frictions)
    begin = {"x": np.linspace(-3, 3, 60), "v": 0, "y": np.linspace(2, -2, 60) ** 3 / 4, "u": np.linspace(0, 1, 60)}
    many = ap.solve_many(system=blocks, values={}, start=begin, until=12)
    assert many.alone == 0
    for i in range(0, 60, 9):
        start = {name: float(np.broadcast_to(w, 60)[i]) for name, w in begin.items()}
        path = ap.solve(ap.Scene(system=blocks, start=start, until=12))
        assert many.final[:, i] == pytest.approx(path.final, abs=1e-13)
        assert many.n_events[i] == len(path.events)


def test_arrays_end_where_the_scalar_flow_ends(starts):
    values, until = {"mu": 1e-4, "k": 0.5}, np.linspace(0.5, 12, 40)
    many = ap.solve_many(system=CHAIN, values=values, start=starts, until=until)
    events = many.events()
    for i in range(40):
        path = alone(values, starts, until, i)
        mine = events.trajectory == i
        assert many.n_events[i] == len(path.events) == mine.sum()
        assert events.kind[mine].tolist() == [e.kind for e in path.events]
        assert events.t[mine] == pytest.approx([e.t for e in path.events], rel=1e-12)
        assert many.final[:, i] == pytest.approx(path.final, rel=1e-11, abs=1e-12)
    assert many.alone < 4
    assert many.names == path.names


def test_parameters_may_be_arrays(starts):
    values = {"mu": np.repeat([1e-2, 1e-6], 20), "k": np.tile([0.25, 1.0], 20)}
    many = ap.solve_many(system=CHAIN, values=values, start=starts, until=3)
    for i in (0, 7, 21, 38):
        assert many.final[:, i] == pytest.approx(alone(values, starts, 3, i).final, rel=1e-11, abs=1e-12)


def test_rows_that_differ_in_a_parameter_of_affine_modes_are_followed_together_as_alone():
    a, b, c = sp.symbols("a b c", real=True)
    frictions = [ap.Friction(v - b, F, load=1, kinetic=k, static=k + b / 2), ap.Friction(u, G, load=1, kinetic=k)]
    pushed = {x: v, v: F - x + a + c * sp.cos(t / 2), y: u, u: G + x - 2 * y}
    block = ap.System.with_frictions(pushed, {}, frictions, time=t)
    random, start = np.random.default_rng(7), {x: 1, v: 0.25, y: 0, u: 0}
    values = {a: random.uniform(1, 3, 30), b: random.uniform(0.1, 1, 30), k: random.uniform(0.1, 0.5, 30)}
    values |= {c: random.uniform(0.5, 1.5, 30)}
    many = ap.solve_many(system=block, values=values, start=start, until=10)
    assert many.alone < 3
    assert many.final.shape == (4, 30)
    for i in range(0, 30, 3):
        here = {key: column[i] for key, column in values.items()}
        path, events = ap.solve(ap.Scene(system=block, values=here, start=start, until=10)), many.events()
        kinds, states = ([event[k] for event in path.events] for k in (0, 2))
        mine = events.trajectory == i
        assert many.final[:, i] == pytest.approx(path.final, abs=1e-13)
        assert events.kind[mine].tolist() == kinds
        assert abs(events.state[:, mine] - np.array(states).T).max() < 1e-12


@pytest.mark.parametrize(("symbol", "words"), [
    (sp.Symbol("k", real=True), "kinetic friction k is negative at k = -0.1"),
    (sp.Symbol("k", positive=True), "k = -0.1 is refused; the symbol is declared positive"),
])
def test_one_number_of_many_that_no_scene_may_have_is_refused(symbol, words):
    block = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v, F, load=1, kinetic=symbol)])
    with pytest.raises(InputError, match=words):
        ap.solve_many(system=block, values={"k": [0.1, 0.2, 0.3, 0.4, -0.1]}, start={x: 2, v: 0}, until=1)


def test_a_velocity_of_several_states_that_rounding_leaves_beside_0_has_stopped():
    tenths = sp.Rational(1, 10)
    rubbing = ap.Friction(velocity=v - 7 * tenths * w + x / 3, force=F, load=1 + x / 3, kinetic=3 * tenths,
                          static=4 * tenths)
    pair = ap.System.with_frictions({x: v, y: w, v: F - 3 * x, w: -y - 7 * tenths * F}, {}, [rubbing])
    columns = zip((-0.6079210585669754, 1.5194157560461075, 0.858785308174745, 0.09387569037322763),
                  (0.3499386314883819, 1.811424490896429, -0.3358812939216138, 0.21526971624064517),
                  (-0.20797470689824937, 0.8590466162813528, 1.4678133214037548, 1.8051306330282433),
                  (0.20660308700965757, 0.02672494681142945, 0.7529519455976095, -0.08028370580911082),
                  strict=True)
    starts = dict(zip("xyvw", map(np.array, columns), strict=True))
    many = ap.solve_many(system=pair, values={}, start=starts, until=6)
    for i in range(4):
        start = {name: column[i] for name, column in starts.items()}
        path = ap.solve(ap.Scene(system=pair, values={}, start=start, until=6), digits=20)
        assert many.n_events[i] == len(path.events)
        assert many.final[:, i] == pytest.approx([float(value) for value in path.final], abs=1e-12)


def test_a_load_of_several_states_that_rounding_leaves_beside_0_has_vanished():
    load = x / 3 + v / 7 + y / 11 - sp.Rational(1, 10)
    sliding = ap.Friction(velocity=w, force=F, load=load, kinetic=sp.Rational(3, 10))
    system = ap.System.with_frictions({x: v, v: -x, y: w, w: F - y / 2}, {}, [sliding])
    random = np.random.default_rng(1)
    start = {"x": random.uniform(-2, 2, 40), "v": random.uniform(-2, 2, 40), "y": 0.5, "w": random.uniform(3, 5, 40)}
    many = ap.solve_many(system=system, values={}, start=start, until=2)
    assert many.alone == 0
    assert "force_zero" in many.events().kind
    for i in range(0, 40, 8):
        here = {name: float(np.broadcast_to(a, 40)[i]) for name, a in start.items()}
        path = ap.solve(ap.Scene(system=system, values={}, start=here, until=2))
        assert many.n_events[i] == len(path.events)
        assert many.final[:, i] == pytest.approx(path.final, abs=1e-13)


def test_rows_whose_rounding_a_mode_lets_grow_are_followed_by_the_scalar_flow():
    """On the stable line v = -3 x of x'' = 9 x the state falls by exp(18), and rounding beside it grows as much."""
    system = ap.System.with_frictions({x: v, v: 9 * x, w: F}, {}, [ap.Friction(w, F, load=1, kinetic=1)])
    starts = np.arange(1, 9) / 8
    many = ap.solve_many(system=system, values={}, start={"x": starts, "v": -3 * starts, "w": 1}, until=6)
    assert many.final[0] == pytest.approx(starts * np.exp(-18), rel=1e-12)
    assert many.alone == 8


def test_blocks_that_bounce_on_springs_are_followed_together():
    """A block falls from the height h, and its ground reverses the velocity sqrt(2 h) and carries its weight."""
    block = ap.Mechanism((x, y), (v, w), sp.eye(2), (0, -1), ap.Contact(gap=y, slip=x, friction=k, unilateral=True))
    elastic, heights = block.elastic(compliance=mu**2, damping=0), np.array([0.3, 0.4, 0.7, 0.9])
    rows = [block.start(elastic, {"x": 0, "y": h, "x'": 9, "y'": 0, "mu": 0.1}) for h in heights]
    start = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    many = ap.solve_many(system=elastic, values={"k": 0.5, "mu": 0.1}, start=start, until=1.75)
    assert many.alone == 0
    assert {PHASES[j] for j in many.first[0]} == {"open"}
    down, up = many.events().t.reshape(4, 2).T
    assert many.events().kind.tolist() == ["touch_down", "lift_off"] * 4
    assert down == pytest.approx(np.sqrt(2 * heights), rel=1e-13)
    assert many.final[many.names.index("z")] == pytest.approx(9 - (2 * down + up - down) / 2, rel=1e-13)
    scenes = [ap.Scene(system=elastic, values={"k": 0.5, "mu": 0.1}, start=row, until=0.5) for row in rows * 2]
    assert {ap.solve(scene).modes for scene in scenes} == {("open",)}


def test_results_are_drawn_over_the_argument_that_varies(starts):
    frictions = np.linspace(0.25, 1, 5)
    start = {name: values[0] for name, values in starts.items()}
    many = ap.solve_many(system=CHAIN, values={mu: "1/100", k: frictions}, start=start, until=[[1], [2]])
    (down, ends), (across, values) = many._axes()
    assert (down, across) == ("until", "k")
    assert (ends.tolist(), values.tolist()) == ([1, 2], frictions.tolist())


def test_shapes_broadcast_and_progress_is_told(starts):
    seen = []
    many = ap.solve_many(
        system=CHAIN, values={"mu": 1e-3, "k": 0.5}, start={**starts, "x": np.ones((3, 1))}, until=1.0,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert many.final.shape == (4, 3, 40)
    assert many.n_events.shape == (3, 40)
    assert seen[-1] == (120, 120)


def test_rows_that_begin_on_an_edge_but_for_their_rounding_begin_as_their_exact_numbers_do():
    """At x = -1/20 and the speed 1 of the belt all forces cancel; the double -0.05 lies beside it."""
    belt = ap.Friction(v - 1, F, load=1, kinetic=sp.Rational(3, 10))
    block = ap.System.with_frictions({x: v, v: F / 2 - t + v / 20 - 2 * x}, {}, [belt], time=t)
    places = np.array([np.nextafter(-0.05, -1), -0.05, np.nextafter(-0.05, 1), -0.25, 0.5])
    many = ap.solve_many(system=block, values={}, start={"x": places, "v": 1.0}, until=2)
    events = many.events()
    for i, place in enumerate(places.tolist()):
        path = ap.solve(ap.Scene(system=block, start=(place, 1.0), until=2))
        assert events.kind[events.trajectory == i].tolist() == [event.kind for event in path.events]


def test_starts_at_rest_on_a_guard_begin_as_the_scalar_flow_does():
    start = {"x": np.array([0.0, 0.1, 3.0, -3.0]), "v": 0, "w": 0, "y": 0}
    many = ap.solve_many(system=CHAIN, values={"mu": 1e-3, "k": 0.5}, start=start, until=5)
    for i in range(4):
        here = {name: float(np.broadcast_to(a, 4)[i]) for name, a in start.items()}
        path = ap.solve(ap.Scene(system=CHAIN, values={"mu": 1e-3, "k": 0.5}, start=here, until=5))
        assert many.n_events[i] == len(path.events)
        assert many.final[:, i] == pytest.approx(path.final, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("share", [sp.Rational(1, 2), 1, -1])
def test_a_load_that_vanishes_while_its_contact_rests_is_a_zero_of_the_force_and_no_onset_of_slip(share):
    """Friction bears a part of its load x = cos t, at most all of it: both are 0 at pi/2, the tip of the cone."""
    held = ap.System.with_frictions({x: y, y: -x, v: share * x + F}, {}, [ap.Friction(v, F, load=x, kinetic=1)])
    events = ap.solve_many(system=held, values={}, start={"x": [1] * 4, "y": 0, "v": 0}, until=3).events()
    found = [*zip(events.kind, events.t, strict=True)]
    for options in ({}, {"digits": 20}):
        path = ap.solve(ap.Scene(system=held, values={}, start={"x": 1, "y": 0, "v": 0}, until=3), **options)
        assert path.modes == ("stick", "stick")
        found += [(event.kind, float(event.t)) for event in path.events]
    assert found == [("force_zero", pytest.approx(np.pi / 2, rel=1e-14))] * 6


def test_two_frictions_are_followed_too():
    a, b = sp.symbols("a b", real=True)
    frictions = ap.Friction(a - b, F, load=1, kinetic=k), ap.Friction(b, G, load=1, kinetic=k / 2)
    clutches = ap.System.with_frictions({a: F + sp.sin(t), b: G - F}, {}, frictions, time=t)
    starts = {"a": np.linspace(-3, 3, 17), "b": np.linspace(2, -1, 17)}
    many = ap.solve_many(system=clutches, values={"k": 0.75}, start=starts, until=9)
    for i in range(17):
        here = {name: float(values[i]) for name, values in starts.items()}
        path = ap.solve(ap.Scene(system=clutches, values={"k": 0.75}, start=here, until=9))
        assert many.n_events[i] == len(path.events)
        assert many.final[:, i] == pytest.approx(path.final, rel=1e-11, abs=1e-12)


def test_starts_from_which_two_motions_go_on_are_left_out_of_arrays_too():
    """Of two blocks at rest either may let go: v' = 5/8 with w at rest, or w' = -21/32 with v at rest."""
    eighth = sp.Rational(1, 8)
    laws = [ap.Friction(rate, force, load=1, kinetic=1, static=12 * eighth) for rate, force in ((v, F), (w, G))]
    pair = ap.System.with_frictions({v: 2 * eighth + F + G, w: -2 * eighth + 9 * eighth * F + G}, {}, laws)
    with pytest.raises(TwoMotions, match="all consistent"):
        ap.solve(ap.Scene(system=pair, values={}, start={"v": 0, "w": 0}, until=1))
    many = ap.solve_many(system=pair, values={}, start={"v": [0, 0, 0, 9, 9], "w": 0}, until=0.1)
    assert np.isnan(many.final[0]).tolist() == [True] * 3 + [False] * 2


def test_bad_arrays_are_refused_in_one_line(starts):
    good = {"mu": 1e-3, "k": 0.5}
    for follow in (ap.solve_many, ap.atlas):
        with pytest.raises(InputError, match="belong to the rod"):
            follow(1, 1e-3, 0, 0, 1, 5, system=CHAIN, values=good, start=starts)
        with pytest.raises(InputError, match="those of a system"):
            follow(1, 1e-3, 0, 0, 1, 5, values=good)
    with pytest.raises(InputError, match="do not broadcast"):
        ap.solve_many(system=CHAIN, values=good, start={**starts, "x": np.ones(3)}, until=1)
    with pytest.raises(InputError, match="finite"):
        ap.solve_many(system=CHAIN, values=good, start={**starts, "x": np.nan}, until=1)
    with pytest.raises(InputError, match="until"):
        ap.solve_many(system=CHAIN, values=good, start=starts, until=-1)
    with pytest.raises(InputError):
        ap.solve_many(system=CHAIN, values=good, start={"x": 1}, until=1)
    van_der_pol = ap.System.smooth({x: v, v: (1 - x**2) * v - x}, {}, None)
    with pytest.raises(InputError, match="affine"):
        ap.solve_many(system=van_der_pol, values={}, start={"x": 1, "v": 0}, until=1)


UNREADABLE = {
    "masked": np.ma.array([1.0, 2.0], mask=[False, True]),
    "complex": [1 + 2j, 2],
    "ragged": [[1, 2], [3]],
    "beyond doubles": [10**400, 1],
    "dates": np.array(["2020-01-01"], dtype="datetime64[D]"),
    "sets": {1},
    "nothing": None,
}


@pytest.mark.parametrize("what", UNREADABLE)
@pytest.mark.parametrize("name", ["x", "k", "until"])
def test_what_is_no_array_of_numbers_is_refused_by_name(starts, what, name):
    given = {"values": {"mu": 1e-3, "k": 0.5}, "start": {key: value[0] for key, value in starts.items()}, "until": 1}
    home = next((part for part in (given["values"], given["start"]) if name in part), given)
    home[name] = UNREADABLE[what]
    with pytest.raises(InputError, match=name):
        ap.solve_many(system=CHAIN, **given)


@pytest.mark.parametrize("shape", [(0,), (0, 3), (2, 0, 1)])
def test_no_trajectories_have_no_ends_of_their_shape(shape):
    values, start = {"mu": 1e-3, "k": np.ones(shape)}, dict.fromkeys("xvwy", 1)
    many = ap.solve_many(system=CHAIN, values=values, start=start, until=1)
    assert many.final.shape == (4, *shape)
    assert many.first.shape == (1, *shape)
    assert many.n_events.shape == many.outcome.shape == many.itineraries().index.shape == shape
    assert len(many.events().t) == 0


def test_what_is_shown_of_many_counts_those_that_are_lost_and_tells_the_others():
    growing = ap.System.with_frictions({x: v, v: x}, {}, [])
    many = ap.solve_many(system=growing, values={}, start={"x": [1, 1e300], "v": 0}, until=[0, 1000])
    shown = str(many)
    assert "beyond the range of doubles  1 of 2" in shown
    assert "from 1 to 1 at the end" in shown
    assert "nan" not in shown


@pytest.mark.parametrize("laws", [[], [ap.Friction(w, F, load=1, kinetic=1)]])
def test_rows_that_grow_beyond_doubles_are_left_out_and_cost_no_other_its_own(laws):
    system = ap.System.with_frictions({x: v, v: x, w: F if laws else -w}, {}, laws)
    ends = np.array([1.0, 2.0, 650.0, 1000.0, 3.0])
    many = ap.solve_many(system=system, values={}, start={"x": 1, "v": 0, "w": 1}, until=ends)
    assert [many.outcomes[k] for k in many.outcome] == ["followed" if end < 710 else "beyond the range of doubles"
                                                        for end in ends]
    assert many.final[0, ends < 710] == pytest.approx(np.cosh(ends[ends < 710]), rel=1e-12)


@pytest.mark.parametrize("until", [6.2, 6.5, 6.9])
def test_a_push_that_grows_is_as_large_after_events_as_in_one_piece(until):
    """The block beside w' = 1e-280 e^(100 t) turns at pi and 2 pi, where the exponent is 628."""
    block = ap.Friction(velocity=v, force=F, load=1, kinetic=1)
    system = ap.System.with_frictions({x: v, v: F - x, w: sp.exp(100 * t) / 10**280}, {}, [block], time=t)
    start = {"x": 20 + np.arange(5), "v": 0, "w": 0}
    many = ap.solve_many(system=system, values={}, start=start, until=until)
    assert many.final[many.names.index("w")] == pytest.approx(np.exp(100 * until) / 1e282, rel=1e-11)


@pytest.mark.parametrize("exact", [np.longdouble(1) / 3, Fraction(1, 3), "1/3"])
def test_arrays_of_exact_numbers_are_read_as_scalars_are(exact):
    given, start = {"mu": Fraction(1, 1000), "k": exact}, dict.fromkeys("xvwy", exact)
    twice = {key: [value, value] for key, value in start.items()}
    many = ap.solve_many(system=CHAIN, values={**given, "k": [exact, exact]}, start=twice, until=1)
    path = ap.solve(ap.Scene(system=CHAIN, values=given, start=start, until=1))
    assert many.final[:, 1] == pytest.approx(path.final, rel=1e-14)


# a twisting relay: events accumulate at the origin
TWIST = ap.System.with_frictions(
    {x: v, v: F / 4 + G}, {}, [ap.Friction(x, G, load=1, kinetic=1), ap.Friction(v, F, load=1, kinetic=2)]
)


@pytest.mark.slow
def test_a_trajectory_that_is_not_followed_has_an_outcome_and_costs_no_other_its_own():
    start, until = {"x": np.linspace(1, 2, 8), "v": 0.0}, np.array([1.0, 99.0, *[1.0] * 6])
    many = ap.solve_many(system=TWIST, values={}, start=start, until=until)
    assert [many.outcomes[k] for k in many.outcome] == ["followed", "events accumulate", *["followed"] * 6]
    assert np.isnan(many.final[:, 1]).all()
    assert many.n_events[1] == 0
    assert 1 not in many.events().trajectory
    others = [0, *range(2, 8)]
    fair = ap.solve_many(system=TWIST, values={}, start={"x": start["x"][others], "v": 0.0}, until=1.0)
    assert many.final[:, others] == pytest.approx(fair.final, rel=1e-14)
    with pytest.raises(Accumulation, match="trajectory 1: events accumulate"):
        ap.solve_many(system=TWIST, values={}, start=start, until=until, strict=True)


def test_rigid_contacts_slide_stop_and_stay_open_in_arrays_too():
    block = ap.Mechanism((x, y), (v, w), sp.eye(2), (0, -1), ap.Contact(gap=y, slip=x, friction=k, unilateral=True))
    slides, stops, falls = [1.0, -1.0, 0.75], [0.25, -0.125, 0.0], [1.0, -1.0]
    start = {"x": 0, "y": [0] * 6 + [1, 1], "v": [*slides, *stops, *falls], "w": 0}
    many = ap.solve_many(system=block.rigid(), values={"k": 0.5}, start=start, until=1)
    ends = [u - np.sign(u) / 4 for u in slides] + [u * abs(u) for u in stops] + falls
    assert many.final[0] == pytest.approx(ends, abs=1e-14)
    assert many.final[1] == pytest.approx([0.0] * 6 + [0.5] * 2, abs=1e-14)


def test_what_every_friction_does_at_the_start_is_told(starts):
    many = ap.solve_many(system=CHAIN, values={"mu": 1e-3, "k": 0.5}, start={**starts, "v": np.zeros(40)}, until=1.0)
    found = [PHASES[k] for k in many.first[0]]
    expected = [alone({"mu": 1e-3, "k": 0.5}, {**starts, "v": 0.0}, 0.0, i).modes[0] for i in range(40)]
    assert found == expected
    assert {"stick"} < {*found}
    few = {name: values[:3] for name, values in starts.items()} | {"v": 0.0}
    fewer = ap.solve_many(system=CHAIN, values={"mu": 1e-3, "k": 0.5}, start=few, until=1.0)
    assert fewer.alone == 3
    assert fewer.first.tolist() == many.first[:, :3].tolist()


@pytest.mark.parametrize("side", [1, -1])
def test_a_friction_that_is_affine_on_one_side_alone_is_followed_by_an_integrator(side):
    """With kinetic friction 1 + (v -+ |v|)^2 one mode is x'' = -x -+ 1, the other quadratic in v."""
    kinetic = 1 + (v - side * sp.Abs(v)) ** 2
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v, F, load=1, kinetic=kinetic, static=2)])
    scene = ap.Scene(system=system, values={}, start={"x": 0, "v": 3 * side}, until=3)
    path = ap.solve(scene)
    assert path.model == "lsoda"
    assert path.final == pytest.approx(ap.solve(scene, method="radau", rtol=1e-11, atol=1e-11).final, abs=1e-8)
    with pytest.raises(InputError, match="affine"):
        ap.solve_many(system=system, values={}, start={"x": 0.0, "v": np.ones(9)}, until=1.0)


def test_two_frictions_that_turn_at_one_instant_are_not_begun_again_for_ever():
    shaken = ap.Friction(velocity=v - sp.cos(t), force=F, load=1, kinetic=sp.Rational(3, 10))
    still = ap.Friction(velocity=v, force=G, load=1, kinetic=sp.Rational(6, 10))
    system = ap.System.with_frictions({x: v, v: F + G - x}, {}, [shaken, still], time=t)
    starts = [(a, b) for a in (0, 1, -1, 0.5, -1.5) for b in (0, 1, -0.5)]
    first, second = np.transpose(starts)
    many = ap.solve_many(system=system, values={}, start={x: first, v: second}, until=9)
    for k in (0, 1, 7):
        one = ap.solve(ap.Scene(system=system, values={}, start=tuple(starts[k]), until=9))
        assert many.final[:, k] == pytest.approx(one.final, abs=1e-9)


def test_rows_within_the_paradox_of_one_of_two_contacts_have_two_motions_each_however_many_there_are():
    """The reaction of a slider, 1/p, may have either sign while it slides; the other block is beside it."""
    q, u = sp.symbols("x1:5"), sp.symbols("u1:5")
    mass = sp.eye(4) + sp.Rational(4, 5) * sp.Matrix(4, 4, lambda i, j: int(i + j == 1))
    contacts = [ap.Contact(gap=q[1], slip=u[0], friction=2), ap.Contact(gap=q[3], slip=u[2], friction=1)]
    pair = ap.Mechanism(q, u, mass, (0, 1, 0, -1), contacts[0], others=contacts[1:])
    start = {**dict.fromkeys(map(str, (*q, *u)), 0), "u1": -np.ones(8)}
    many = ap.solve_many(system=pair.rigid(), values={}, start=start, until=1)
    assert [many.outcomes[k] for k in many.outcome] == ["two motions"] * 8


def test_rows_at_rest_that_repels_have_two_motions_each_however_many_there_are():
    """Of x'' = -F a force by the sign of x drives x away, and either direction goes on from x = 0."""
    driven = ap.System.with_frictions({x: v, v: -F, w: 0}, {}, [ap.Friction(velocity=x, force=F, load=1, kinetic=1)])
    many = ap.solve_many(system=driven, values={}, start={"x": 0, "v": 0, "w": np.linspace(-1, 1, 8)}, until=1)
    assert [many.outcomes[k] for k in many.outcome] == ["two motions"] * 8


def pressed(unilateral, turn=0):
    """A block on a spring, pulled along its guide by sin(2 t), with a slanted mass matrix."""
    mass = sp.Matrix([[1, sp.Rational(1, 5)], [sp.Rational(1, 5), 1]])
    contact = ap.Contact(gap=y, slip=v, friction=sp.Rational(3, 10), unilateral=unilateral)
    return ap.Mechanism((x, y), (v, w), mass, (2 * sp.sin(2 * t) - x, turn * sp.sin(t) - 1), contact, time=t).rigid()


def require_equal_to_solve(many, system, start, until):
    events, names = many.events(), list(start)
    for i, row in [*enumerate(np.transpose(np.broadcast_arrays(*start.values())))][::3]:
        path = ap.solve(ap.Scene(system=system, start=dict(zip(names, row.tolist(), strict=True)), until=until))
        mine = events.trajectory == i
        assert [*zip(events.kind[mine].tolist(), events.friction[mine].tolist(), strict=True)] == [
            (event.kind, event.friction) for event in path.events]
        assert events.t[mine] == pytest.approx([event.t for event in path.events], abs=1e-12)
        assert many.final[:, i] == pytest.approx(path.final, abs=1e-12)


@pytest.mark.parametrize("unilateral", [True, False])
def test_blocks_on_a_rigid_guide_are_followed_together(unilateral):
    system, start = pressed(unilateral), {"x": np.linspace(-1, 1, 6), "y": 0, "v": 1, "w": 0}
    many = ap.solve_many(system=system, values={}, start=start, until=9)
    assert (many.alone, many.n_events.min()) == (0, 5)
    require_equal_to_solve(many, system, start, 9)


def test_blocks_whose_reaction_turns_are_followed_together():
    system, start = pressed(False, turn=3), {"x": np.linspace(-1, 1, 6), "y": 0, "v": 1, "w": 0}
    many = ap.solve_many(system=system, values={}, start=start, until=9)
    assert many.alone < 2
    assert {"force_zero", "velocity_zero"} <= {*many.events().kind.tolist()}
    require_equal_to_solve(many, system, start, 9)


def test_frictions_whose_loads_contain_the_forces_of_others_are_followed_as_alone():
    leaning = ap.Friction(velocity=v, force=F, load=1 + G / 5, kinetic=sp.Rational(1, 2))
    pushed = ap.Friction(velocity=w, force=G, load=1, kinetic=sp.Rational(1, 3))
    system = ap.System.with_frictions({x: v, v: F - x + G / 7, y: w, w: G - y}, {}, [leaning, pushed])
    start = {"x": np.linspace(-2, 2, 6), "v": 0.3, "y": 1.1, "w": -0.2}
    many = ap.solve_many(system=system, values={}, start=start, until=9)
    assert many.n_events.sum() > 6
    require_equal_to_solve(many, system, start, 9)


@pytest.mark.slow
def test_rounding_does_not_grow_with_the_number_of_events():
    """Of a block that a belt shakes 40 times, a bound that takes every error for the worst doubles at each event."""
    rubbing = ap.Friction(velocity=v - sp.cos(2 * t), force=F, load=1, kinetic=sp.Rational(1, 5))
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [rubbing], time=t)
    start = {"x": np.linspace(-1, 1, 6), "v": 0.1}
    many = ap.solve_many(system=system, values={}, start=start, until=60)
    assert (many.alone, many.n_events.min() > 30) == (0, True)
    require_equal_to_solve(many, system, start, 60)


def test_rows_whose_friction_becomes_negative_are_told_in_doubles_from_rows_whose_rates_are_not_finite(monkeypatch):
    """Their outcome was that a rate is not finite, found in many digits: of 1500 rows, 554 of these took 14 s."""
    monkeypatch.setattr(run, "_rounded", lambda case: pytest.fail("more digits than doubles have"))
    v, q, G = sp.symbols("v q G", real=True)
    a, t = sp.Symbol("a", positive=True), sp.Symbol("t", real=True)
    contact = ap.Friction(velocity=v, force=G, load=1, kinetic=1 - a * t)
    system = ap.System.with_frictions(slow={q: v, v: G - q}, fast={}, time=t, frictions=(contact,))
    many = ap.solve_many(system=system, values={a: [0.01, 0.5]}, start={q: 3, v: 0}, until=5)
    assert [many.outcomes[k] for k in many.outcome] == ["followed", "negative friction"]
    with pytest.raises(NegativeFriction, match=r"kinetic friction -a\*t \+ 1 .* is negative at t = 2"):
        ap.solve(ap.Scene(system=system, values={a: 0.5}, start={q: 3, v: 0}, until=5))


@pytest.mark.slow
def test_a_row_that_goes_on_after_all_others_is_followed_alone(monkeypatch):
    rounds = []
    advanced = affine_many._advanced
    monkeypatch.setattr(affine_many, "_advanced", lambda *args: rounds.append(1) or advanced(*args))
    belt = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v - 1, F, 1, 1, 2)])
    until = np.array([6.0] * 7 + [200.0])
    many = ap.solve_many(system=belt, values={}, start={"x": np.linspace(-2, 2, 8), "v": 0}, until=until)
    assert many.alone == 1
    assert many.n_events[7] > 40 > len(rounds)
    path = ap.solve(ap.Scene(system=belt, values={}, start={"x": 2, "v": 0}, until=200))
    assert (tuple(many.final[:, 7]), many.n_events[7]) == (path.final, len(path.events))
