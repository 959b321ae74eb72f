"""Starts and stops exactly on an edge of what the state switches: the side that the motion goes to has the say."""

import math
from fractions import Fraction

import mpmath
import pytest
import sympy as sp

import asympk as ap
from asympk.errors import Accumulation, InputError, NoMotion, NotDerivable, TooManyEvents, Undecided
from asympk.symbolic.branches import by_direction

x, v, t = sp.symbols("x v t", real=True)
F = sp.Symbol("F", real=True)
ROUGH, ICE, PUSH = sp.Rational(1, 5), sp.Rational(1, 20), sp.Rational(1, 10)


@pytest.fixture(params=[{}, {"digits": 15}, {"method": "radau"}, {"method": "dop853"}])
def how(request):
    return request.param


def block(push, kinetic):
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=kinetic)
    return ap.System.with_frictions({x: v, v: push + F}, {}, [contact], time=t)


def ends(path, modes, end):
    return path.modes == modes and [float(w) for w in path.final] == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize(
    ("ahead", "behind", "modes", "end"),
    [(ICE, ROUGH, ("stick",), (0, 0)), (ROUGH, ICE, ("slip_same",), ("9/40", "3/20"))],
)
def test_a_block_pushed_on_an_edge_that_moves_on_is_on_what_is_behind_the_edge(ahead, behind, modes, end, how):
    """With the push 1/10 and the friction 1/20 it comes t^2/40 far, behind the edge at t/2."""
    system = block(PUSH, sp.Piecewise((behind, x < t / 2), (ahead, True)))
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=3), **how)
    assert ends(path, modes, [float(Fraction(w)) for w in end])


def test_a_block_in_the_corner_of_a_potential_rests(how):
    path = ap.solve(ap.Scene(system=block(-sp.sign(x) / 4, PUSH), start={x: 0, v: 0}, until=3), **how)
    assert ends(path, ("stick",), [0, 0])


def test_what_comes_to_rest_on_an_edge_stays_there(how):
    system = block(0, sp.Piecewise((sp.Rational(1, 2), x < 1), (ICE, True)))
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 1}, until=3), **how)
    assert ends(path, ("slip_same", "stick"), [1, 0])


@pytest.mark.parametrize("how", [{}, {"digits": 15}, {"method": "dop853"}])
@pytest.mark.parametrize("beyond", [2, 1])
def test_what_stops_on_an_edge_whose_law_holds_it_rests_there_though_the_side_it_comes_from_would_not(beyond, how):
    """The push -1 stops it at 1/2, on the edge of friction 1/2, which lets it back; the edge holds it, or just so."""
    friction = sp.Piecewise((sp.Rational(1, 2), x < sp.Rational(1, 2)), (beyond, True))
    path = ap.solve(ap.Scene(system=block(-1, friction), start={x: "1/6", v: 1}, until=2), **how)
    assert ends(path, ("slip_same", "stick"), [0.5, 0])


@pytest.mark.parametrize("how", [{}, {"digits": 15}, {"method": "dop853"}])
@pytest.mark.parametrize("tooth", [0, 3])
@pytest.mark.parametrize(("within", "modes", "end"), [
    (sp.Mod(x, 1) < sp.Rational(1, 2), ("slip_same", "stick"), (1 / 2, 0)),
    (sp.Mod(x, 1) <= sp.Rational(1, 2), ("slip_same", "slip_opposite"), (1 / 18, -2 / 3)),
])
@pytest.mark.few(2)
def test_an_edge_within_the_teeth_of_a_rack_is_one_for_what_stops_on_it(within, modes, end, tooth, how):
    friction = sp.Piecewise((sp.Rational(1, 2), within), (2, True))
    path = ap.solve(ap.Scene(system=block(-1, friction), start={x: tooth + sp.Rational(1, 6), v: 1}, until=2), **how)
    assert ends(path, modes, [tooth + end[0], end[1]])


@pytest.mark.parametrize("how", [{}, {"digits": 15}])
def test_what_stops_on_the_edge_of_its_load_slides_back_under_it(how):
    """The load 1 - x is gone where it stops, at x = 1 after the time ln 3; then 1 - x is 3 (1 - cos(t - ln 3)) / 2."""
    contact = ap.Friction(velocity=v, force=F, load=sp.Max(0, 1 - x), kinetic=1)
    pushed = ap.System.with_frictions({x: v, v: F - sp.Rational(3, 2)}, {}, [contact])
    path = ap.solve(ap.Scene(system=pushed, start={x: 0, v: 2}, until=2), **how)
    after = 2 - math.log(3)
    assert ends(path, ("slip_same", "slip_opposite"), [1.5 * math.cos(after) - 0.5, -1.5 * math.sin(after)])


def _at_an_edge(number, push, below, above):
    """Return rates, friction and start of a block at rest on the edge at 1 of pushes and of frictions."""
    s, u, force = sp.symbols(f"s{number} u{number} F{number}", real=True)
    sides = ((sp.Rational(low), sp.Rational(high)) for low, high in (push, (below, above)))
    pushed, bound = (sp.Piecewise((low, s < 1), (high, True)) for low, high in sides)
    contact = ap.Friction(velocity=u, force=force, load=1, kinetic=bound)
    return {s: u, u: pushed + force}, contact, {s: 1, u: 0}


@pytest.mark.parametrize(
    ("first", "second", "mode", "end"),
    [(((-1, 1), "1/4", 2), ((1, 1), "1/2", 1), "stick+stick", (1, 0, 1, 0)),
     (((-1, 1), "1/4", 2), ((1, 1), 1, "1/2"), "stick+slip_same", (1, 0, 2, 1)),
     (((1, -1), 1, "1/2"), (("1/2", "1/2"), 2, "1/4"), "stick+slip_same", (1, 0, "3/2", "1/2"))],
)
@pytest.mark.few(2)
def test_two_blocks_on_edges_of_their_own_go_on_each_as_it_does_alone(first, second, mode, end, how):
    (rates, one, start), (others, two, place) = _at_an_edge(1, *first), _at_an_edge(2, *second)
    system = ap.System.with_frictions({**rates, **others}, {}, [one, two])
    path = ap.solve(ap.Scene(system=system, start={**start, **place}, until=2), **how)
    assert ends(path, (mode,), [float(Fraction(w)) for w in end])


def test_a_force_towards_an_edge_that_moves_on_pushes_a_block_after_it_from_the_start(how):
    """It is pushed by 1/10 - 1/20 behind the edge at t/10, and held by the springs -x - 2 Max(x, 0)."""
    system = block(-x - sp.sign(x - t / 10) / 10 - 2 * sp.Max(x, 0), ICE)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=3), **how)
    assert path.modes == ("slip_same", "stick")
    assert [float(w) for w in path.final] == pytest.approx([1 / 30, 0], abs=1e-5)


def test_a_block_rests_on_an_edge_where_one_side_pushes_it_back_and_the_other_holds_it(how):
    for edge in (x < 1, x <= 1):
        system = block(-PUSH, sp.Piecewise((ROUGH, edge), (ICE, True)))
        path = ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=3), **how)
        assert ends(path, ("stick",), [1, 0])


STRIP = sp.Piecewise((2, sp.Abs(x - 1) < sp.Rational(1, 2)), (sp.Rational(1, 4), True))


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("push", "speed", "end"), [(1, 0, ("3/2", "3/2")), (-1, 0, (0, 0)), (1, 1, (2, "1/2"))])
@pytest.mark.few(4)
def test_an_edge_of_a_strip_by_its_distance_is_as_any_other_on_either_side(push, speed, end, side, how):
    """Within the strip the friction holds; one that stops on its edge goes on where beyond it the push is larger."""
    start = {x: 1 + side * (sp.Rational(1, 2) if not speed else 0), v: side * speed}
    path = ap.solve(ap.Scene(system=block(side * push, STRIP), start=start, until=2 if not speed else 3), **how)
    assert path.modes == ("stick" if push < 0 else "slip_same" if side > 0 else "slip_opposite",)
    moved = [side * float(w - at) for w, at in zip(path.final, start.values(), strict=True)]
    assert moved == pytest.approx([float(Fraction(w)) for w in end], abs=1e-6)


def test_four_blocks_on_edges_at_once_slide_back_as_each_does_alone(how):
    """Each is pushed back by 1/2 behind its edge and 5/2 ahead. They were told to rest: their signs were left open."""
    blocks = [sp.symbols(f"x{k} v{k} f{k}", real=True) for k in range(4)]
    slow = {q: u for q, u, _ in blocks} | {u: f - 2 * sp.Heaviside(q - 1) - sp.Rational(1, 2) for q, u, f in blocks}
    contacts = [ap.Friction(velocity=u, force=f, load=1, kinetic=ROUGH) for _, u, f in blocks]
    system = ap.System.with_frictions(slow, {}, contacts)
    start = {s: int(s.name[0] == "x") for s in slow}
    path = ap.solve(ap.Scene(system=system, start=start, until=1), **how)
    assert ends(path, ("+".join(["slip_opposite"] * 4),), [0.85] * 4 + [-0.3] * 4)


def test_a_block_that_both_sides_of_an_edge_push_back_is_refused_by_name():
    system = block(sp.Piecewise((PUSH, x < 1), (-PUSH, True)), ICE)
    with pytest.raises(NotDerivable, match="the motion stays on x - 1 = 0 from t = 0 on"):
        ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=3))


def test_an_edge_of_very_many_digits_is_named_in_few():
    system = ap.System.with_frictions({x: v, v: sp.floor(10**300 * x) - x}, {}, [])
    with pytest.raises(NotDerivable, match=r"the motion stays on 1\.0e\+300\*x - 1\.0e\+300 = 0 from t = 0 on"):
        ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=1))


def test_a_velocity_divided_by_its_size_turns_back_through_zero(how):
    """At the rate -3 until t = 1/3, at -1 from then on; beside -u/|u| alone it stays there, which is a friction."""
    pushed, alone = (ap.System.smooth({x: v, v: -v / abs(v) - push}, {}, None) for push in (2, 0))
    for speed, end in ((1, [-43 / 18, -8 / 3]), (0, [-3.5, -3])):
        assert ends(ap.solve(ap.Scene(system=pushed, start={x: 1, v: speed}, until=3), **how), ("smooth",), end)
        with pytest.raises(NotDerivable, match=r"stays on v = 0 .* as a friction"):
            ap.solve(ap.Scene(system=alone, start={x: 1, v: speed}, until=3), **how)


def test_what_rests_where_a_whole_part_jumps_stays_there(how):
    path = ap.solve(ap.Scene(system=block(-sp.floor(x) / 100, PUSH), start={x: 2, v: 0}, until=3), **how)
    assert ends(path, ("stick",), [2, 0])


def test_what_rests_on_a_belt_slips_as_soon_as_the_belt_carries_it_to_a_place_that_does_not_hold_it(how):
    """The spring pulls by 1/10 at x = 1: from there x = 1/2 + cos(w s)/2 + sin(w s)/w, w^2 = 1/10, s = t - 1."""
    contact = ap.Friction(velocity=v - 1, force=F, load=1, kinetic=sp.Piecewise((ROUGH, x < 1), (ICE, True)))
    system = ap.System.with_frictions({x: v, v: F - x / 10}, {}, [contact])
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 1}, until=2), **how)
    w = sp.sqrt(sp.Rational(1, 10))
    end = sp.Rational(1, 2) + sp.cos(w) / 2 + sp.sin(w) / w, sp.cos(w) - sp.sin(w) * w / 2
    tolerance = 1e-5 if "method" in how else 1e-12
    assert [float(w) for w in path.final] == pytest.approx([float(e) for e in end], abs=tolerance)
    assert path.modes == ("stick", "slip_opposite")


def test_a_velocity_that_begins_with_its_second_derivative_is_told_from_its_rounding(how):
    """A block at rest slips back where the push cos(t) - x falls to -1/5; what Max(0, v) brakes is no part of it."""
    braked, free = (block(sp.cos(t) - x - brake, ROUGH) for brake in (sp.Max(0, v), 0))
    path = ap.solve(ap.Scene(system=braked, start={x: 1, v: 0}, until=2), **how)
    truth = ap.solve(ap.Scene(system=free, start={x: 1, v: 0}, until=2))
    assert path.modes == truth.modes == ("stick", "slip_opposite")
    assert [float(a) for a in path.final] == pytest.approx(truth.final, abs=1e-5)


def test_the_side_of_an_edge_agrees_with_the_way_in_which_a_contact_slips(how):
    """The block x rests on an edge with its friction used up, and follows y, which begins to move at once."""
    y, w, G = sp.symbols("y w G", real=True)
    own = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 4))
    other = ap.Friction(velocity=w, force=G, load=1, kinetic=sp.Rational(1, 2), static=1)
    rates = {x: v, v: F - 3 * x / 4 + y / 2, y: w, w: G - w / 5 + 3 * x - 4 * y - 1}
    lifted = {**rates, v: rates[v] + sp.Piecewise((sp.Rational(1, 4), x > 1), (0, True))}
    start = {x: 1, v: 0, y: 1, w: 0}
    plain, switched = (ap.System.with_frictions(each, {}, [own, other]) for each in (rates, lifted))
    path = ap.solve(ap.Scene(system=switched, start=start, until=2), **how)
    truth = ap.solve(ap.Scene(system=plain, start=start, until=2))
    assert path.modes == truth.modes
    assert [float(a) for a in path.final] == pytest.approx(truth.final, abs=1e-4)


@pytest.mark.parametrize("options", [{}, {"digits": 20}])
@pytest.mark.parametrize(
    ("belt", "start", "mode", "end"),
    [
        (sp.Max(sp.sin(t), 0), sp.S.Zero, "slip_opposite", (1 - sp.cos(1)) / 2),
        (sp.Max(sp.sin(t), 0), -sp.Rational(5, 4), "stick", -sp.Rational(1, 4) - sp.cos(1)),
        (sp.Max(t, 0), -sp.Rational(3, 2), "stick", -sp.S.One),
    ],
)
def test_a_belt_that_starts_to_move_at_once_carries_a_block_as_far_as_its_friction_does(
    belt, start, mode, end, options
):
    friction = ap.Friction(velocity=v - belt, force=F, load=1, kinetic=sp.Rational(1, 2))
    block = ap.System.with_frictions({x: v, v: -x + F}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=block, start={x: start, v: 0}, until=1), **options)
    assert path.modes == (mode,)
    assert float(path.final[0]) == pytest.approx(float(end), abs=1e-12)


def test_a_block_at_rest_on_the_brim_of_its_friction_stays_while_a_ramp_relieves_it_and_after_that():
    ramp = sp.Piecewise((t, t < 1), (0, True))
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 2))
    brim = ap.System.with_frictions({x: v, v: -x + F + ramp}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=brim, start={x: sp.Rational(1, 2), v: 0}, until=2))
    assert ends(path, ("stick",), (0.5, 0))


@pytest.mark.parametrize("options", [{}, {"digits": 20}])
def test_a_block_at_rest_on_the_brim_of_its_friction_slips_as_soon_as_a_ramp_begins_to_pull_it(options):
    """From t = 1 on x - 1/2 = 1 - t + sin(t - 1)."""
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 2))
    brim = ap.System.with_frictions({x: v, v: -x + F + sp.Min(0, 1 - t)}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=brim, start={x: sp.Rational(1, 2), v: 0}, until=2), **options)
    assert float(path.events[0].t) == 1
    assert ends(path, ("stick", "slip_opposite"), (math.sin(1) - 0.5, math.cos(1) - 1))


@pytest.mark.parametrize("options", [{}, {"digits": 20}])
def test_a_block_on_the_brim_of_its_friction_stays_until_a_wave_that_is_cut_off_begins_to_pull_it(options):
    """From t = pi/3 on x + 1/2 = (3 sin(s) - sin(3 s))/8, s = t - pi/3."""
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 2))
    brim = ap.System.with_frictions({x: v, v: -x + F + sp.Max(0, -sp.sin(3 * t))}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=brim, start={x: -sp.Rational(1, 2), v: 0}, until=2), **options)
    s = 2 - math.pi / 3
    assert float(path.events[0].t) == pytest.approx(math.pi / 3, abs=1e-15)
    end = (3 * math.sin(s) - math.sin(3 * s)) / 8 - 0.5, 3 * (math.cos(s) - math.cos(3 * s)) / 8
    assert ends(path, ("stick", "slip_same"), end)


@pytest.mark.parametrize("options", [{}, {"digits": 20}])
def test_a_push_that_is_the_friction_itself_until_it_rises_moves_a_block_as_soon_as_it_does(options):
    """Above 1/2 the push sin(3 t) gives the velocity sqrt(3)/3 - pi/9, which nothing takes away."""
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 2))
    push = sp.Max(sp.Rational(1, 2), sp.sin(3 * t))
    path = ap.solve(ap.Scene(system=ap.System.with_frictions({x: v, v: F + push}, {}, [friction], time=t),
                             start={x: 0, v: 0}, until=2), **options)
    speed = math.sqrt(3) / 3 - math.pi / 9
    assert float(path.events[0].t) == pytest.approx(math.pi / 18, abs=1e-15)
    assert ends(path, ("stick", "slip_same"), (speed * (2 - math.pi / 6), speed))


@pytest.mark.few(1)
def test_a_tank_is_empty_once_its_water_has_run_out(how):
    """By Torricelli's law x = (1 - t/2)^2 until t = 2; a second tank, half as wide, is empty some time after that."""
    y = sp.Symbol("y", real=True)
    out = {s: sp.sqrt(sp.Max(s, 0)) for s in (x, y)}
    tanks = ap.System.with_frictions({x: -out[x], y: 2 * (out[x] - out[y])}, {}, [])
    path = ap.solve(ap.Scene(system=tanks, start={x: 1, y: 0}, until=5), **how)
    assert float(path(1)[0]) == pytest.approx(0.25, abs=1e-5)
    assert [float(w) for w in path.final] == pytest.approx([0, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("belt", "modes", "end"),
    [
        (sp.Piecewise((1, x < 1), (2, True)), ("stick", "slip_opposite", "stick"), (10, 2)),
        (sp.Piecewise((2, x < 2), (1, True)), ("stick", "slip_same", "stick"), (8, 1)),
        (1 + sp.Heaviside(t - 1) - sp.Heaviside(t - 5), ("stick", "slip_opposite", "stick", "slip_same"), (9.75, 1.5)),
        (1 + sp.Heaviside(t - 2), ("stick", "slip_opposite", "stick"), (9, 2)),
        (1 + sp.floor(t / 5), ("stick", "slip_opposite"), (6.25, 1.5)),
    ],
)
@pytest.mark.few(4)
def test_a_block_slips_where_its_belt_is_all_at_once_another(belt, modes, end, how):
    """Belts of the speeds 1 and 2, whose friction 1/2 takes the time 2 to give a block the speed of the other."""
    friction = ap.Friction(velocity=v - belt, force=F, load=1, kinetic=sp.Rational(1, 2))
    block = ap.System.with_frictions({x: v, v: F}, {}, [friction], time=t)
    start = {x: 0, v: 2 if belt.has(x) and belt.subs(x, 0) == 2 else 1}
    path = ap.solve(ap.Scene(system=block, start=start, until=6), **how)
    assert path.modes == modes
    assert [e.kind for e in path.events] == ["slip_onset", "velocity_zero", "slip_onset"][: len(modes) - 1]
    assert [float(w) for w in path.final] == pytest.approx(end, abs=1e-8)


@pytest.mark.parametrize("jump", [sp.Heaviside(t - 1), sp.Piecewise((0, t < 1), (1, True)), sp.floor(t)])
@pytest.mark.parametrize(
    ("push", "belt", "end"), [(0, 1, (0.3125, 0.25)), (0, -1, (0.1875, -0.25)), (-2, 0, (0.0625, -0.75))]
)
@pytest.mark.few(6)
def test_what_a_block_does_that_stops_as_its_belt_or_its_push_jumps_is_decided_by_the_law_after_the_jump(
    jump, push, belt, end, how
):
    friction = ap.Friction(velocity=v - belt * jump, force=F, load=1, kinetic=sp.Rational(1, 2))
    block = ap.System.with_frictions({x: v, v: push * jump + F}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=block, start={x: 0, v: sp.Rational(1, 2)}, until=sp.Rational(3, 2)), **how)
    assert path.modes[-1] == ("slip_same" if belt < 0 else "slip_opposite")
    assert [float(w) for w in path.final] == pytest.approx(end, abs=1e-8)


@pytest.mark.parametrize("jump", [sp.Heaviside(t - 1), sp.floor(t)])
@pytest.mark.few(2)
def test_a_block_that_stops_as_the_belt_upon_it_jumps_rests_if_its_own_friction_holds_it(jump, how):
    """It slides at -1/2, slowed down by 1/2, until t = 1; the belt upon it then pulls by 1/2 and is pushed itself."""
    u, G = sp.symbols("u G", real=True)
    half = sp.Rational(1, 2)
    contacts = [ap.Friction(velocity=v, force=F, load=1 + jump, kinetic=half),
                ap.Friction(velocity=u - v - jump, force=G, load=1, kinetic=half)]
    system = ap.System.with_frictions({x: v, v: F - G, u: jump + G}, {}, contacts, time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: -half, u: 0}, until="7/5"), **how)
    assert path.modes[-1] == "stick+slip_opposite"
    assert [float(w) for w in path.final] == pytest.approx([-1 / 6, 0, 3 / 5], abs=1e-5)


@pytest.mark.parametrize(("belt", "end"), [(1, (0.3125, 0.25)), (-1, (0.25, 0))])
def test_a_block_that_stops_where_another_belt_begins_has_its_own_speed_there(belt, end, how):
    """It stops at 1/4: a belt that moves on takes it along, and back from one that moves towards it it would rest."""
    ahead = sp.Piecewise((0, x < sp.Rational(1, 4)), (belt, True))
    friction = ap.Friction(velocity=v - ahead, force=F, load=1, kinetic=sp.Rational(1, 2))
    system = ap.System.with_frictions({x: v, v: F}, {}, [friction])
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: "1/2"}, until="3/2"), **how)
    assert path.modes[-1] == ("slip_opposite" if belt > 0 else "stick")
    assert [float(w) for w in path.final] == pytest.approx(end, abs=1e-5)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("laws", "end"), [
    (("3*s/5", "0", "1"), ("9/20", "3/10")), (("0", "s/2", "1"), ("5/4", "1/2")),
    (("7*d/10", "0", "1 - s*d/2"), ("81/40", "27/20")),
])
@pytest.mark.few(4)
def test_a_contact_feels_the_direction_in_which_another_one_slides(laws, end, direction, how):
    """The other one slides on; its sign s pushes by 3/5 against friction 1/2, drives a belt, or halves a load."""
    u, G = sp.symbols("u G", real=True)
    push, belt, load = (sp.sympify(law, {"s": sp.sign(u), "d": direction}) for law in laws)
    contacts = [ap.Friction(velocity=v - belt, force=F, load=load, kinetic=sp.Rational(1, 2)),
                ap.Friction(velocity=u, force=G, load=1, kinetic=sp.Rational(1, 2))]
    system = ap.System.with_frictions({x: v, v: push + F, u: G / 4}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0, u: direction}, until=3), **how)
    assert [direction * float(w) for w in path.final[:2]] == pytest.approx([float(Fraction(w)) for w in end], abs=1e-5)


@pytest.mark.parametrize(("push", "load", "net"), [("1/2 + s/2", "1", "1/2"), ("3/5", "1 - s/2", "7/20")])
def test_a_contact_at_rest_feels_that_another_one_turns(push, load, net, how):
    """The other one, on a spring, turns at pi. This one was told to rest on, though its bound is then too small."""
    y, u, G = sp.symbols("y u G", real=True)
    push, load = (sp.sympify(law, {"s": sp.sign(u)}) for law in (push, load))
    half = sp.Rational(1, 2)
    contacts = [ap.Friction(velocity=u, force=G, load=1, kinetic=half / 2),
                ap.Friction(velocity=v, force=F, load=load, kinetic=half)]
    system = ap.System.with_frictions({y: u, x: v, u: G - y, v: push + F}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, start={y: 2, u: 0, x: 0, v: 0}, until=6), **how)
    gained, left = float(Fraction(net)) * (6 - math.pi), 6 - math.pi
    assert path.modes == ("slip_opposite+stick", "slip_same+slip_same")
    end = (1.25 * math.cos(6) - 0.25, gained * left / 2, -1.25 * math.sin(6), gained)
    assert [float(w) for w in path.final] == pytest.approx(end, abs=1e-5)


@pytest.mark.parametrize("sign", [sp.sign, lambda u: 2 * sp.Heaviside(u) - 1,
                                  lambda u: sp.Piecewise((1, u > 0), (-1, True))])
@pytest.mark.few(3)
def test_a_block_on_a_belt_that_turns_with_another_block_slips_until_it_has_the_new_speed(sign, how):
    """The other one turns at pi, the belt from -1/2 to 1/2: friction 1/2 takes 2 to follow. It took 1, from rest."""
    y, u, G = sp.symbols("y u G", real=True)
    half = sp.Rational(1, 2)
    contacts = [ap.Friction(velocity=u, force=G, load=1, kinetic=half / 2),
                ap.Friction(velocity=v - sign(u) / 2, force=F, load=1, kinetic=half)]
    system = ap.System.with_frictions({y: u, x: v, u: G - y, v: F}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, start={y: 2, u: 0, x: 0, v: 0}, until=6), **how)
    others = ("opposite+slip_same", "opposite+stick", "same+slip_opposite", "same+stick")
    assert path.modes == tuple(f"slip_{name}" for name in others)
    assert [float(w) for w in path.final[1::2]] == pytest.approx([9 / 4 - math.pi, 1 / 2], abs=1e-5)


@pytest.mark.parametrize("sign", [sp.sign, lambda u: 2 * sp.Heaviside(u) - 1])
def test_a_block_stops_on_a_belt_that_stands_while_the_block_that_turns_it_rests(sign, how):
    """Each feels how the other slides. It was told to slide on, at once on the belt of a block that slides."""
    y, u, G = sp.symbols("y u G", real=True)
    quarter, slip = sp.Rational(1, 4), v - sign(u) / 2
    contacts = [ap.Friction(velocity=u, force=G, load=1, kinetic=quarter),
                ap.Friction(velocity=slip, force=F, load=1, kinetic=2 * quarter)]
    system = ap.System.with_frictions({y: u, x: v, u: G - y + sign(slip) / 8, v: F}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, start={y: 0, u: 0, x: 0, v: "-1/2"}, until=3), **how)
    assert ends(path, ("stick+slip_opposite", "stick+stick"), [0, -1 / 4, 0, 0])


k = sp.Symbol("k", positive=True)
HALF = sp.Rational(1, 2)
DIRECTED = HALF + sp.sign(v) / 4  # 3/4 forward and 1/4 backward


def test_static_friction_that_is_below_the_kinetic_one_of_one_direction_is_refused_as_that():
    """A push forward that static friction 1/2 no longer holds finds neither rest nor slip; backward there is slip."""
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=DIRECTED, static=sp.Rational(1, 2))
    pushed = [ap.System.with_frictions({x: v, v: push + F}, {}, [contact], time=t) for push in (t, -t)]
    with pytest.raises(NoMotion, match=r"at t = 0\.5, .*friction 1, 0\.5 at rest, is 0\.75 in slip; give static"):
        ap.solve(ap.Scene(system=pushed[0], start={x: 0, v: 0}, until=1))
    path = ap.solve(ap.Scene(system=pushed[1], start={x: 0, v: 0}, until=1))
    assert ends(path, ("stick", "slip_opposite"), [-5 / 96, -1 / 4])


@pytest.mark.parametrize(("push", "held"), [(t, 3 / 4), (-t, 1 / 4)])
@pytest.mark.parametrize(("kinetic", "load"), [
    (DIRECTED, 1), (1, DIRECTED), (sp.Heaviside(v) / 2 + HALF / 2, 1), (1, sp.Heaviside(v, 1) / 2 + HALF / 2),
    *((sp.Piecewise((1 - HALF / 2, ahead), (HALF / 2, True)), 1) for ahead in (v > 0, v >= 0)),
    *((sp.Piecewise((1, v > 1), (1 - HALF / 2, ahead), (HALF / 2, True)), 1) for ahead in (v > 0, v >= 0)),
    (sp.Piecewise((1 - HALF / 2, sp.And(v >= 0, v < 1)), (HALF, v >= 1), (HALF / 2, True)), 1),
    (sp.Piecewise((1 - HALF / 2, v >= 0), (HALF / 2, t < 2), (HALF, True)), 1),
    (1, sp.Piecewise((1 - HALF / 2, v >= 0), (HALF / 2, True))),
])
@pytest.mark.few(4)
def test_friction_that_differs_by_the_direction_holds_a_block_by_that_of_the_slip_it_resists(
    push, held, kinetic, load, how
):
    """Then (t - held)^2/2 is gained. By sign(v) it was 1/2 either way, and by v >= 0 3/4: slip began late backward."""
    contact = ap.Friction(velocity=v, force=F, load=load, kinetic=kinetic, normal=sp.Symbol("N"))
    system = ap.System.with_frictions({x: v, v: push + F}, {}, [contact], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=1), **how)
    way = 1 if push == t else -1
    modes = ("stick", "slip_same" if way > 0 else "slip_opposite")
    assert ends(path, modes, [way * (1 - held) ** 3 / 6, way * (1 - held) ** 2 / 2])


@pytest.mark.parametrize(("slip", "ahead"), [(k * v - k, v >= 1), (2 * v - 2, sp.sign(v - 1) >= 0),
                                             (v - 1 / k, sp.Heaviside(k * v - 1, 1) > HALF)])
def test_a_step_at_the_zero_of_a_multiple_of_the_sliding_velocity_is_one_by_the_direction(ahead, slip):
    """Of v >= 1 under the velocity k (v - 1) the value 3/4 of forward slip held a block backward, of signs the mean."""
    contact = ap.Friction(velocity=slip, force=F, load=1, kinetic=sp.Piecewise((1 - HALF / 2, ahead), (HALF / 2, True)))
    system = ap.System.with_frictions({x: v, v: F - t}, {}, [contact], time=t)
    values = dict.fromkeys(system.parameters, 1)
    path = ap.solve(ap.Scene(system=system, values=values, start={x: 0, v: 1}, until=1))
    assert [float(event.t) for event in path.events] == pytest.approx([1 / 4], abs=1e-13)


@pytest.mark.parametrize("factor", [x, k - 1])
@pytest.mark.parametrize("law", [lambda u: HALF + sp.sign(u) / 4, lambda u: HALF / 2 + sp.Heaviside(u, 1) / 2,
                                 *(lambda u, ahead=ahead: sp.Piecewise((1 - HALF / 2, ahead(u, 0)), (HALF / 2, True))
                                   for ahead in (sp.Gt, sp.Ge))])
@pytest.mark.few(4)
def test_a_step_at_the_zero_of_the_velocity_times_any_factor_is_one_by_the_direction(factor, law, how):
    """Back to 0 friction is 1/4, about which the block swings once; held by the mean 1/2, it rested at 2/5."""
    path = ap.solve(ap.Scene(system=block(-x, law(factor * v)), values={"k": 2} if factor.has(k) else {},
                             start={x: "2/5", v: 0}, until=4), **how)
    assert path.modes == ("slip_opposite", "stick")
    assert float(path.final[0]) == pytest.approx(1 / 10, abs=1e-6)


def test_a_law_is_refused_that_has_a_value_of_its_own_at_rest_on_one_side_of_a_place_only():
    """Where x < 0 this block slips forward against 1/4, but 1, the value backward, held it."""
    law = sp.Piecewise((HALF / 2, x * v < 0), (HALF, v > 0), (1, True))
    with pytest.raises(InputError, match=r"value of its own at rest depends on the sign of x; write sign\(v\)"):
        block(-x, law)
    direction = sp.Piecewise((HALF / 2, x * sp.sign(v) < 0), (HALF, sp.sign(v) > 0), (1, True))
    path = ap.solve(ap.Scene(system=block(-x, direction), start={x: -HALF, v: 0}, until=1))
    assert path.final[0] == pytest.approx(-1 / 4 - math.cos(1) / 4)


def test_a_law_of_the_place_holds_a_block_by_the_value_of_the_direction_in_which_it_is_pushed_there():
    """Where x > 0 it slips forward against 1/4, but was held by 1: there was no such value at rest, but one backward.

    The same law with x v > 0 for v < 0 was refused.
    """
    for back in (v < 0, x * v > 0):
        law = sp.Piecewise((HALF / 2, sp.And(x > 0, v > 0)), (HALF, sp.And(x < 0, back)), (1, True))
        path = ap.solve(ap.Scene(system=block(t, law), start={x: 1, v: 0}, until=1))
        assert [float(event.t) for event in path.events] == pytest.approx([1 / 4], abs=1e-13)


def test_a_table_of_many_places_with_a_value_of_its_own_at_rest_is_read_place_by_place():
    """Of 20 places typed downwards nearly all choices of their signs were tried, and of 40 there was no end."""
    table = sp.Piecewise(*((sp.Rational(k + 1, 100), x > 40 - k) for k in range(40)), (1, True))
    law = sp.Piecewise((table, v > 0), (2 * table, v < 0), (3 * table, True))
    assert by_direction(v, law, "static") == 3 * table


def test_a_law_within_a_law_of_the_velocity_has_the_value_at_rest_of_both_together():
    """It slips against 1/4 either way, and 1 holds it at rest: read alone, the inner law has no value of its own."""
    inner = sp.Piecewise((1, v >= 0), (HALF / 2, True))
    law = sp.Piecewise((inner, v <= 0), (HALF / 2, True))
    path = ap.solve(ap.Scene(system=block(t, law), start={x: 0, v: 0}, until=2))
    assert [float(event.t) for event in path.events] == pytest.approx([1], abs=1e-12)
    assert float(path.final[1]) == pytest.approx(5 / 4, abs=1e-12)


@pytest.mark.parametrize("rest", [sp.Ne(v, 0), sp.Or(v > 0, v < 0)])
@pytest.mark.parametrize(("push", "held"), [(t, 9 / 8), (-t, 7 / 8)])
@pytest.mark.few(4)
def test_a_value_of_friction_at_the_zero_of_its_velocity_alone_is_the_static_one(push, held, rest, how):
    """Radau stalled where the block broke loose, and with a law by sign(v) beside it no event was decided."""
    law = sp.Piecewise((HALF, rest), (1, True)) + sp.sign(v) / 8
    path = ap.solve(ap.Scene(system=block(push, law), start={x: 0, v: 0}, until=2), **how)
    assert [float(event.t) for event in path.events] == pytest.approx([held], abs=1e-13)
    assert abs(float(path.final[1])) == pytest.approx(2 - held**2 / 2 - (held - HALF) * (2 - held), abs=1e-9)


@pytest.mark.parametrize("law", [sp.sign(v) ** 2, sp.sign(sp.Abs(v)), sp.sign(v**2)])
def test_a_law_by_the_sign_of_a_speed_holds_at_rest_by_its_value_for_the_slip_that_would_follow(law):
    """sign(|v|) is sign(v)^2, and no event was decided with it: at rest 0, beside it 1; sign(v^2) was even -1."""
    path = ap.solve(ap.Scene(system=block(t, law), start={x: 0, v: 0}, until=2))
    assert [float(event.t) for event in path.events] == pytest.approx([1], abs=1e-13)


def test_a_contact_whose_reaction_jumps_past_zero_on_an_edge_does_not_open_to_fall_into_the_ground(how):
    """What would lift it while it sticks does not while it slips: open, its gap falls as -|t - 1|, two were told."""
    gap, w, N = sp.symbols("g w N", real=True)
    press = F + N - sp.Abs(t - 1)
    belt = ap.Friction(velocity=v - 1, force=F, load=N, kinetic=2, gap=gap, normal=N, constraint=press)
    rates = {x: v, gap: w, v: F - 3 * sp.sign(x - HALF) / 2, w: press}
    system = ap.System.with_frictions(rates, {}, [belt], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, gap: 0, v: 0, w: 0}, until=1), **how)
    left = 107 / 144  # it sticks from t = 1/2, at x = 37/144, to the edge x = 1/2
    assert path.modes == ("slip_opposite", "stick", "slip_opposite")
    assert float(path.final[2]) == pytest.approx(1 + (1 - left) ** 2 / 3 - 3 / 2 * (1 - left), abs=1e-9)


@pytest.mark.parametrize("drag", [-sp.Max(0, v), -sp.Piecewise((v, v > 0), (2 * v, True)), -sp.Max(v, 2 * v)])
@pytest.mark.few(3)
def test_a_drag_that_differs_by_the_direction_leaves_friction_at_rest_that_of_each_direction(drag, how):
    """On the edge v = 0 of the drag, sign(v) was 0 in the friction, too: where the block breaks loose was undecided."""
    path = ap.solve(ap.Scene(system=block(drag - t, DIRECTED), start={x: 0, v: 0}, until=1), **how)
    assert [float(event.t) for event in path.events] == pytest.approx([1 / 4], abs=1e-13)


@pytest.mark.parametrize("speed", [2, -2])
def test_a_law_for_each_direction_is_asked_for_the_direction_of_slip_alone(speed, how):
    """Each root is of no real number the other way; from |v| = 2 the rates are those of the one law."""
    law = sp.Piecewise((sp.sqrt(v), v >= 0), (sp.sqrt(-v), True))
    path = ap.solve(ap.Scene(system=block(0, law), start={x: 0, v: speed}, until=1), **how)
    assert abs(float(path.final[1])) == pytest.approx((math.sqrt(2) - 1 / 2) ** 2, abs=1e-9)


@pytest.mark.parametrize(("push", "held"), [(t, 5 / 4), (-t, 3 / 4)])
def test_two_contacts_hold_a_block_by_the_sum_of_their_friction_in_the_direction_of_the_push(push, held):
    contacts = [ap.Friction(velocity=v, force=F, load=1, kinetic=DIRECTED),
                ap.Friction(velocity=v, force=sp.Symbol("G"), load=1, kinetic=sp.Rational(1, 2))]
    system = ap.System.with_frictions({x: v, v: push + F + sp.Symbol("G")}, {}, contacts, time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=2))
    assert [float(event.t) for event in path.events] == pytest.approx([held], abs=1e-13)


def test_a_rest_that_needs_a_drag_by_the_sign_of_its_velocity_is_refused_as_that():
    system = block(-x - sp.sign(v) / 2, ROUGH)
    with pytest.raises(NoMotion, match=r"rates jump where the velocity of friction 1 is 0; write what jumps there as"):
        ap.solve(ap.Scene(system=system, start={x: "1/2", v: 0}, until=1))


def test_a_smooth_contact_does_not_mind_the_belt_that_another_block_turns():
    """The first block turns at t = pi, and with it the belt below the other, on which there is no friction."""
    y, w, G, N = sp.symbols("y w G N", real=True)
    contacts = [ap.Friction(velocity=v, force=F, load=1, kinetic=sp.S.Half),
                ap.Friction(velocity=w - 3 * sp.sign(v), force=G, load=N, kinetic=0, normal=N, constraint=N - 1)]
    system = ap.System.with_frictions({x: v, v: F - x, y: w, w: G - y}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, start={x: 2, v: 0, y: 0, w: 1}, until=5))
    assert ends(path, ("slip_opposite+closed", "slip_same+closed"),
                [-1 / 2 + math.cos(5) / 2, -math.sin(5) / 2, math.sin(5), math.cos(5)])


def test_of_blocks_that_turn_the_belts_of_each_other_one_that_rests_does_not_turn_the_other_belt(how):
    """One rests at 1/4 on a belt that stands. The other, at w = -0.35, was told to slide as if v were negative."""
    y, w, G = sp.symbols("y w G", real=True)
    contacts = [ap.Friction(velocity=v - 2 * sp.Heaviside(w), force=F, load=1, kinetic=1, static=2),
                ap.Friction(velocity=w - sp.sign(v), force=G, load=1, kinetic=sp.Rational(1, 4))]
    system = ap.System.with_frictions({x: v, v: F - 4 * x - sp.S.Half, y: w, w: G - 1}, {}, contacts)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 1, y: 0, w: 0}, until=1), **how)
    assert path.modes == ("slip_same+slip_opposite", "stick+slip_opposite")
    assert [float(w) for w in path.final] == pytest.approx([1 / 4, 0, -3 / 8, -3 / 4], abs=1e-5)


@pytest.mark.parametrize("switch", [t, x])
def test_a_block_whose_belt_takes_its_speed_at_a_switch_rests_on_it_where_static_friction_holds_it(switch, how):
    """From v = 1 a pull slows it to 1/2 at t = 1, x = 3/4. It was told to slide on, which kinetic friction allows."""
    belt = sp.Piecewise((2, switch < (1 if switch is t else sp.Rational(3, 4))), (sp.S.Half, True))
    contact = ap.Friction(velocity=v - belt, force=F, load=1, kinetic=1, static=2)
    system = ap.System.with_frictions({x: v, v: F - sp.Rational(3, 2)}, {}, [contact], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 1}, until=2), **how)
    assert path.modes == ("slip_opposite", "stick")
    assert [float(w) for w in path.final] == pytest.approx([5 / 4, 1 / 2], abs=1e-5)


def test_a_belt_that_stops_under_a_block_that_another_contact_holds_ends_its_slip(how):
    """The mode went on to be named slip_opposite+stick, with no event."""
    G, belt = sp.Symbol("G", real=True), sp.Piecewise((2, t < 1), (0, True))
    contacts = [ap.Friction(velocity=v - belt, force=F, load=1, kinetic=sp.S.Half), ap.Friction(v, G, 1, 1)]
    system = ap.System.with_frictions({x: v, v: F + G}, {}, contacts, time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 0}, until=2), **how)
    assert path.modes == ("slip_opposite+stick", "stick+stick")
    assert [(e.kind, e.friction, float(e.t)) for e in path.events] == [("velocity_zero", 0, pytest.approx(1))]


@pytest.mark.parametrize("push", [0, 1])
def test_a_block_that_stops_where_it_would_turn_the_belt_of_another_turns_it_only_if_it_goes_on(push, how):
    """It was told to turn the belt though it rests, so that the other one slipped, or no motion was found."""
    u, G = sp.symbols("u G", real=True)
    contacts = [ap.Friction(velocity=v - 1 + sp.sign(t + 1), force=F, load=1, kinetic=sp.S.Half),
                ap.Friction(velocity=u - 2 * sp.Heaviside(v, 0), force=G, load=1, kinetic=1)]
    system = ap.System.with_frictions({x: v, v: F + push, u: G - sp.S.Half}, {}, contacts, time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: "-1/2", u: 0}, until=2), **how)
    expected = ("slip_same+slip_opposite", [11 / 18, 5 / 6, 5 / 6]) if push else ("stick+stick", [-1 / 4, 0, 0])
    assert path.modes == ("slip_opposite+stick", expected[0])
    assert [float(w) for w in path.final] == pytest.approx(expected[1], abs=1e-5)


@pytest.mark.parametrize(("speed", "since"), [("-1/2", 0), (0, 1)])
def test_a_belt_that_jumps_with_the_speed_of_its_block_and_drives_it_back_from_both_sides_is_refused(speed, since, how):
    """The sliding velocity is 1/2 at v = -1/2 and v - 1/2 below: friction is -1/2 above this speed and +1/2 below."""
    half = sp.Rational(1, 2)
    contact = ap.Friction(velocity=v - sp.Piecewise((half, v < -half), (-1, True)), force=F, load=1, kinetic=half)
    system = ap.System.with_frictions({x: v, v: sp.Piecewise((half / 2, v < -half), (0, True)) + F}, {}, [contact])
    with pytest.raises(NotDerivable, match=rf"the motion stays on 2\*v \+ 1 = 0 from t = {since} on"):
        ap.solve(ap.Scene(system=system, start={x: 0, v: speed}, until=2), **how)


def test_a_belt_that_begins_somewhere_carries_a_block_along_by_friction_that_just_holds_it(how):
    belt, push = (sp.Piecewise((0, x < sp.Rational(1, 4)), (speed, True)) for speed in (sp.Rational(1, 2), -1))
    friction = ap.Friction(velocity=v - belt, force=F, load=2, kinetic=sp.Rational(1, 2))
    system = ap.System.with_frictions({x: v, v: push + F}, {}, [friction])
    path = ap.solve(ap.Scene(system=system, start={x: "1/2", v: 1}, until=3), **how)
    assert path.modes == ("slip_same", "stick")
    assert [float(w) for w in path.final] == pytest.approx((2.0625, 0.5), abs=1e-5)


@pytest.mark.few(1)
def test_a_touch_at_the_very_jump_of_a_sawtooth_leaves_the_larger_of_both(how):
    """The sine touches 1 at t = 3, where the sawtooth falls from 1 to 0: the larger is 1 from t = 1 to t = 5."""
    rate = sp.Max(sp.floor(2 * sp.sin(sp.pi * t / 6)), t - sp.floor(t))
    path = ap.solve(ap.Scene(system=ap.System.with_frictions({x: rate}, {}, [], time=t), start={x: 0}, until=6), **how)
    assert float(path.final[0]) == pytest.approx(5, abs=1e-8)


@pytest.mark.parametrize(("belt", "end"), [
    (sp.Max(0, sp.sin(t)), (3 - math.cos(7), math.sin(7))),
    (sp.Piecewise((t, t < 1), (2 - t, t < 2), (0, True)), (1, 0)),
    (t + sum((-1) ** k * sp.Max(0, t - sp.Rational(k, 5)) for k in range(1, 21)), (4.2, 2)),
    (sp.Piecewise((t * (1 - t) ** sp.Rational(3, 2), t < 1), (0, True)), (4 / 35, 0)),  # real only until it stops
])
@pytest.mark.few(1)
def test_a_belt_whose_speed_has_kinks_takes_a_block_along_without_any_slip(belt, end, how):
    friction = ap.Friction(velocity=v - belt, force=F, load=1, kinetic=2)
    block = ap.System.with_frictions({x: v, v: F}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=block, start={x: 0, v: 0}, until=7 if belt.has(sp.sin) else 4), **how)
    assert (path.modes, path.events) == (("stick",), ())
    assert [float(w) for w in path.final] == pytest.approx(end, abs=1e-8)


def test_a_block_slips_on_its_belt_at_the_very_kink_of_the_speed(how):
    """The belt moves the block by 1 until it stops at t = pi; up to there the friction is 6/5, and 17/10 after it."""
    friction = ap.Friction(velocity=v - sp.Max(0, sp.sin(t)) / 2, force=F, load=1, kinetic=1, static=sp.Rational(5, 4))
    block = ap.System.with_frictions({x: v, v: F - x}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=block, start={x: sp.Rational(7, 10), v: 0}, until=5), **how)
    slid = 5 - math.pi
    assert ends(path, ("stick", "slip_opposite"), (1 + 0.7 * math.cos(slid), -0.7 * math.sin(slid)))


def test_a_belt_that_turns_in_a_saw_of_the_time_lets_its_block_slide_on():
    """The belt |mod(t, 4) - 2| - 1 turns at every even time; v = 3 t/10 until 10/13, then 6/13 - 3 t/10."""
    friction = ap.Friction(velocity=v - sp.Abs(sp.Mod(t, 4) - 2) + 1, force=F, load=1, kinetic=sp.Rational(3, 10))
    block = ap.System.with_frictions({x: v, v: F}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=block, start={x: 0, v: 0}, until=5))
    assert [float(e.t) for e in path.events] == pytest.approx([10 / 13, 450 / 169, 10370 / 2197], abs=1e-8)
    assert path.modes == ("slip_opposite", "slip_same", "slip_opposite", "slip_same")


def test_a_belt_takes_a_block_along_while_there_is_a_load_on_it(how):
    """Under the load max(0, sin(t)) v = 3 (1 - cos(t))/10 up to 3/5, and as much more in the next wave until v = 1."""
    friction = ap.Friction(velocity=v - 1, force=F, load=sp.Max(0, sp.sin(t)), kinetic=sp.Rational(3, 10))
    block = ap.System.with_frictions({x: v, v: F}, {}, [friction], time=t)
    path = ap.solve(ap.Scene(system=block, start={x: 0, v: 0}, until=9), **how)
    caught = next(e for e in path.events if e.kind == "velocity_zero")
    assert float(caught.t) == pytest.approx(2 * math.pi + math.acos(-1 / 3), abs=1e-5)
    assert float(path.final[1]) == 1


def test_a_block_whose_friction_differs_by_its_direction_comes_to_rest(how):
    """The push 1/5 is less than the friction 3/10 forward, and more than the friction 1/10 that there is backward."""
    scaly = sp.Piecewise((PUSH, v < 0), (3 * PUSH, True))
    path = ap.solve(ap.Scene(system=block(2 * PUSH, scaly), start={x: 0, v: 1}, until=12), **how)
    assert ends(path, ("slip_same", "stick"), [5, 0])


@pytest.mark.parametrize("how", [{}, {"digits": 15}, {"method": "dop853"}])
def test_a_relay_typed_by_signs_comes_to_its_origin_in_the_known_time_and_is_refused_there(how):
    """x'' = -2 sgn x - sgn x': |x'| at x = 0 shrinks by 1/sqrt 3 in each half turn, from sqrt 2 (Levant 1993)."""
    system = ap.System.smooth({x: v, v: -2 * sp.sign(x) - sp.sign(v)}, {}, None)
    half = math.sqrt(2) + math.sqrt(2) / 3
    with pytest.raises(Accumulation, match=f"accumulate at t = {half / (1 - 1 / math.sqrt(3)):.6g}"):
        ap.solve(ap.Scene(system=system, start={x: 1, v: 0}, until=10), **how)


@pytest.mark.further
def test_steps_that_no_run_will_ever_cross_are_refused_after_a_hundred():
    """x' = 1 + floor(10^300 x)/10^300: each step took its own mode, some thousands of them minutes."""
    x = sp.Symbol("x", real=True)
    steps = ap.System.smooth({x: 1 + sp.floor(10**300 * x) / 10**300}, {}, None)
    with pytest.raises(TooManyEvents, match=r"limit of 11000 crossings comes long before .*100 reached at t = 1e-298"):
        ap.solve(ap.Scene(system=steps, start=[0], until=1))


def test_touches_that_no_run_would_ever_count_are_left_out():
    """From its first slip on, at t = 4/5, a block swings by the belt's velocity, which it has once in each period."""
    system = ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(v - 1, F, load=1, kinetic=sp.Rational(4, 5))])
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: 1}, until=10**100))
    with mpmath.workdps(130):
        phase = mpmath.mpf(10) ** 100 - mpmath.mpf(4) / 5
        expected = float(mpmath.mpf(4) / 5 + mpmath.sin(phase)), float(mpmath.cos(phase))
    assert path.modes == ("stick", "slip_opposite")
    assert path.final == pytest.approx(expected, abs=1e-15)
    with pytest.raises(Undecided, match="take a smaller until"):
        ap.solve(ap.Scene(system=system, start={x: 0, v: 1}, until=1e300))


@pytest.mark.further
def test_crossings_that_become_rarer_are_followed_however_frequent_they_were():
    """A staircase over a layer of 1e-12 was refused after a hundred of its steps."""
    x, y, mu = *sp.symbols("x y", real=True), sp.Symbol("mu", positive=True)
    system = ap.System.smooth({x: sp.floor(200 * y)}, {y: 1 - sp.Rational(1, 1000) - y}, mu)
    path = ap.solve(ap.Scene(system=system, values={mu: "1e-12"}, start=[0, 0], until=1))
    assert path.final[0] == pytest.approx(199, abs=1e-6)


def test_crossings_of_one_edge_that_end_in_a_layer_of_1e_minus_12_are_followed():
    """mu^2 y'' = -(1 + sgn(y)/3) y - mu y'/20 + x/10^5 with y = 1 crosses y = 0 until it has decayed to 1e-5."""
    x, y, v, mu = (sp.Symbol(name, real=True) for name in ("x", "y", "v", "mu"))
    system = ap.System.smooth({x: -x}, {y: v, v: x / 10**5 - y - sp.Abs(y) / 3 - v / 20}, mu)
    end = ap.solve(ap.Scene(system=system, values={mu: "1e-12"}, start={x: 1, y: 1, v: 0}, until=1)).final
    assert end == pytest.approx((math.exp(-1), 0.75e-5 * math.exp(-1), 0), rel=1e-7, abs=1e-12)


@pytest.mark.further
def test_crossings_whose_intervals_shrink_too_slowly_to_end_are_refused_after_some_thousands():
    """With mu y' = -sgn x - y the velocity at the k-th crossing falls like 1/k: the crossings have no end."""
    system = ap.System.smooth({x: v}, {v: -sp.sign(x) - v}, sp.Symbol("mu", positive=True))
    with pytest.raises(TooManyEvents, match=r"limit of 11000 crossings reached at t = 0\.77.*smaller until"):
        ap.solve(ap.Scene(system=system, values={"mu": "1e-2"}, start={x: Fraction(1, 2), v: 0}, until=2))


@pytest.mark.parametrize("options", [{}, {"digits": 15}, {"method": "lsoda"}])
@pytest.mark.parametrize(("at", "said"), [(-1, "no piece of a Piecewise holds; end it with one"),
                                          (1, r"reaches x = 0 at t = 2\.386.*, beyond which a rate has no value")])
def test_a_state_where_no_piece_holds_is_refused_by_name(at, said, options):
    x, v, F = sp.symbols("x v F", real=True)
    spring = sp.Piecewise((x, x > 0))
    friction = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 10))
    system = ap.System.with_frictions({x: v, v: F - spring}, {}, [friction])
    with pytest.raises(ap.AsympkError, match=said):
        ap.solve(ap.Scene(system=system, start={x: at, v: 1}, until=3), **options)


@pytest.mark.parametrize("options", [{}, {"digits": 15}, {"method": "lsoda"}])
@pytest.mark.parametrize("spring", [sp.Piecewise((x, x < 1)), sp.Piecewise((x, x < 1), (2, x > sp.Rational(6, 5)))])
def test_a_start_on_an_edge_that_leads_where_no_piece_holds_is_refused_by_the_name_of_the_edge(spring, options):
    system = ap.System.smooth({x: v, v: -spring}, {}, None)
    with pytest.raises(ap.AsympkError, match=r"x - 1 = 0.* a rate has no value; end its Piecewise with a piece"):
        ap.solve(ap.Scene(system=system, start={x: 1, v: 1}, until=3), **options)


@pytest.mark.parametrize("speed", [-1, -3])
def test_a_block_on_the_edge_beyond_which_its_load_is_zero_goes_on_without_friction(speed, how):
    """Its speed is that at the start plus sin(t), and its place 1 - cos(t) more than at that speed."""
    pressed = ap.Friction(velocity=v + 1, force=F, load=sp.Max(0, x), kinetic=2, static=4)
    system = ap.System.with_frictions({x: v, v: F + sp.cos(t)}, {}, [pressed], time=t)
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: speed}, until=3), **how)
    assert not path.events
    assert [*map(float, path.final)] == pytest.approx([3 * speed + 1 - math.cos(3), speed + math.sin(3)], abs=1e-4)


def test_a_load_is_not_written_as_zero_though_it_may_become_zero():
    with pytest.raises(InputError, match="the load is 0; without a load there is no friction"):
        ap.System.with_frictions({x: v, v: F - x}, {}, [ap.Friction(velocity=v, force=F, load=0, kinetic=1)])
    with pytest.raises(InputError, match="the load is 0; without a load there is no friction"):
        ap.System.with_friction({x: v}, {}, {v: F - x}, F, load=0, kinetic=1)


STEPS = [sp.floor(x), 1 - sp.ceiling(1 - x), x - sp.Mod(x, 1), sp.Heaviside(x - 1, 1), (1 + sp.sign(x - 1)) / 2]


def over(step):
    """Return a body on a rigid ground that steps, with states in an order in which it falls before it moves."""
    y, u, N = sp.symbols("y u N", real=True)
    ground = ap.Friction(velocity=v, force=F, load=N, kinetic=ROUGH, gap=y - step, normal=N, constraint=N - 1)
    return ap.System.with_frictions({y: u, x: v, u: N - 1, v: F}, {}, [ground])


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("off", ["0", "-1e-40", "-1e-8"])
@pytest.mark.few(4)
def test_a_body_at_the_edge_of_a_stair_falls_from_the_height_it_has_above_the_side_it_moves_to(step, off, how):
    """At 1/2 above the lower step, the steps of both sides are as far away as one another: it used to slide there."""
    for height in (Fraction(1, 2), 1):
        start = {"x": 1 + Fraction(off), "y": height, "u": 0, "v": -1}
        path = ap.solve(ap.Scene(system=over(step), start=start, until="3/10"), **how)
        assert ends(path, ("open",), [float(height) - 0.045, 0.7 + float(off), -0.3, -1])


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.few(4)
def test_a_body_on_the_edge_of_a_stair_slides_on_the_step_it_moves_to_and_starts_below_none(step, how):
    def run(height, speed):
        start = {"x": 1, "y": height, "u": 0, "v": speed}
        return ap.solve(ap.Scene(system=over(step), start=start, until="1/2"), **how)

    assert ends(run(1, 1), ("slip_same",), [1, 1.475, 0, 0.9])
    assert ends(run(0, -1), ("slip_opposite",), [0, 0.525, 0, -0.9])
    for height in (0, "1/2"):
        with pytest.raises(InputError, match="of the contact is negative"):
            run(height, 1)


@pytest.mark.parametrize("how", [{}, {"method": "dop853"}])
@pytest.mark.parametrize("step", STEPS)
def test_a_body_that_starts_in_doubles_within_their_rounding_of_the_edge_of_a_stair_falls_from_it_at_once(step, how):
    """It used to slide on at this height: it starts on the step, and in doubles never crosses the edge."""
    start = {"x": 1 + Fraction("1e-40"), "y": 1, "u": 0, "v": -1}
    path = ap.solve(ap.Scene(system=over(step), start=start, until="3/10"), **how)
    assert ends(path, ("open",), [0.955, 0.7, -0.3, -1])


@pytest.mark.parametrize("how", [{}, {"method": "dop853"}])
@pytest.mark.parametrize("off", ["-1e-40", "0", "1e-40"])
def test_a_block_that_starts_in_doubles_within_their_rounding_of_another_belt_is_on_it_at_once(off, how):
    """The friction 1/2 speeds it up, as from the edge itself: beside it, it used to be refused as staying there."""
    contact = ap.Friction(velocity=v - sp.Piecewise((1, x < 1), (2, True)), force=F, load=1, kinetic=5 * PUSH)
    system = ap.System.with_frictions({x: v, v: F}, {}, [contact])
    path = ap.solve(ap.Scene(system=system, start={x: 1 + Fraction(off), v: 1}, until=1), **how)
    assert ends(path, ("slip_opposite",), [2.25, 1.5])


@pytest.mark.parametrize("how", [{}, {"digits": 15}])
@pytest.mark.parametrize("until", [2, "5/2"])
def test_a_body_that_lands_at_rest_as_a_push_begins_that_its_friction_holds_lands_as_without_a_push(until, how):
    """It falls from 4 by -t - t^2/2, so its load is 3 at t = 2; the push was taken to have moved it in the air."""

    def landed(push):
        y, w, N = sp.symbols("y w N", real=True)
        ground = ap.Friction(velocity=v, force=F, load=-9 * y - w, kinetic=1, gap=y, normal=N)
        system = ap.System.with_frictions({x: v, v: push + F, y: w, w: N - 1}, {}, [ground], time=t)
        return ap.solve(ap.Scene(system=system, start={x: 0, v: 0, y: 4, w: -1}, until=until), **how)

    assert ends(landed(sp.Piecewise((0, t < 2), (2, True))), ("open", "stick"), [float(a) for a in landed(0).final])


RESISTANCE = [sp.Heaviside(v, 0) / 5, *(sp.Piecewise((ROUGH, v > 0), (behind, True)) for behind in (0, -ROUGH))]


@pytest.mark.parametrize("drag", RESISTANCE)
def test_a_block_rests_until_friction_and_a_drag_that_jumps_with_its_velocity_are_overcome(drag, how):
    """Friction and drag bear 1/5 each: pushed by t, the block is off at t = 2/5. It used to slip against its slip."""
    path = ap.solve(ap.Scene(system=block(t - drag, ROUGH), start={x: 0, v: 0}, until=1), **how)
    assert ends(path, ("stick", "slip_same"), [0.6**3 / 6, 0.6**2 / 2])
    assert path.events[0].t == pytest.approx(2 / 5, abs=1e-9)


def bounce(drag, *others):
    """Return the run of a pushed body from its touch-down on; the load on it falls from 5 and more to less than 0."""
    y, u, N = sp.symbols("y u N", real=True)
    ground = ap.Friction(velocity=v, force=F, load=-1000 * y - 10 * u, kinetic=ROUGH, gap=y, normal=N)
    forces = sp.Add(*(other.force for other in others))
    system = ap.System.with_frictions({y: u, x: v, u: N - 1, v: F + forces + 1 - drag}, {}, [ground, *others])
    return ap.Scene(system=system, start={y: 0, x: 0, u: -1, v: "2/15"}, until=1)


@pytest.mark.parametrize("drag", [sp.Heaviside(v, 0) / 4, sp.Piecewise((sp.Rational(1, 4), v > 0), (0, True))])
@pytest.mark.parametrize(("speed", "modes"), [(0, ("slip_same",)), (-1, ("slip_opposite", "slip_same"))])
def test_a_drag_that_begins_with_the_slip_holds_no_block_that_static_friction_does_not_hold(drag, speed, modes, how):
    """At rest the push is 11/10, above the bound 1; ahead it is 17/20, above the kinetic friction 1/2."""
    contact = ap.Friction(velocity=v, force=F, load=1, kinetic=sp.Rational(1, 2), static=1)
    system = ap.System.with_frictions({x: v, v: sp.Rational(11, 10) - drag + F}, {}, [contact])
    path = ap.solve(ap.Scene(system=system, start={x: 0, v: speed}, until=2), **how)
    assert path.modes == modes
    assert float(path.final[1]) == pytest.approx(0.35 * (2 - abs(speed) / 1.6), abs=1e-9)


@pytest.mark.parametrize("how", [{}, {"method": "dop853"}])
@pytest.mark.few(1)
def test_a_body_that_bounces_with_a_drag_that_jumps_with_its_velocity_does_what_a_further_friction_makes_it_do(how):
    """It used to leave rest too early, to move backwards while said to slide forwards, and end at v = 0.72173."""
    further = ap.Friction(velocity=v, force=sp.Symbol("G", real=True), load=1, kinetic=ROUGH)
    alike = [float(w) for w in ap.solve(bounce(0, further), **how).final]
    assert alike[3] == pytest.approx(0.72189, abs=1e-5)
    for drag in RESISTANCE[:2]:
        path = ap.solve(bounce(drag), **how)
        assert path.modes == ("slip_same", "stick", "slip_same", "slip_opposite", "open")
        assert [float(w) for w in path.final] == pytest.approx(alike, abs=1e-6)
    with pytest.raises(NotDerivable, match=r"stays on v = 0 from t = 0\.085253\d on, where the rates jump"):
        ap.solve(bounce(sp.sign(v) / 5), **how)


@pytest.mark.parametrize("side", [1, -1])
def test_a_slot_that_a_push_now_presses_on_its_other_side_still_brakes_the_block(side, how):
    """The push turns from 1 to t - 2 at t = 1/2: there the reaction jumps past 0, and then it falls to 0 again."""
    y, u = sp.symbols("y u", real=True)
    push = sp.Piecewise((side, t < sp.Rational(1, 2)), (side * (t - 2), True))
    slot = ap.Contact(gap=y, slip=v, friction=sp.Rational(1, 2))
    system = ap.Mechanism((x, y), (v, u), sp.eye(2), (0, push), slot, time=t).rigid()
    path = ap.solve(ap.Scene(system=system, start={x: 0, y: 0, v: 2, u: 0}, until=1), **how)
    assert path.modes == ("slip_opposite", "slip_same")[::side]
    assert [(event.kind, float(event.t)) for event in path.events] == [("force_zero", pytest.approx(0.5, abs=1e-12))]
    assert [float(w) for w in path.final] == pytest.approx([83 / 48, 0, 23 / 16, 0], abs=1e-9)


@pytest.mark.parametrize("late", ["0", "1e-17", "1e-25"])
@pytest.mark.parametrize("digits", [15, 30])
def test_a_block_that_stops_just_as_its_belt_starts_backward_is_not_carried_off_at_once(digits, late):
    """The velocity vanishes at 1 or just before; then slip goes on, as the belt jumps away from the block."""
    friction = ap.Friction(velocity=v + sp.floor(t), force=F, load=1, kinetic=sp.Rational(1, 2))
    block = ap.System.with_frictions({x: v, v: F}, {}, [friction], time=t)
    start = {x: 0, v: sp.Rational(1, 2) - sp.Rational(late)}
    path = ap.solve(ap.Scene(system=block, start=start, until=sp.Rational(3, 2)), digits=digits)
    assert path.modes[-1] == "slip_same"
    assert [float(w) for w in path.final] == pytest.approx((0.1875, -0.25), abs=1e-12)
