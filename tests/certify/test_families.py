"""Families: matrices of balls contain the matrices of all points of a box, and lose little of their dependence."""

from dataclasses import replace
from fractions import Fraction
from itertools import product

import mpmath
import pytest
import sympy as sp

import asympk as ap

flint = pytest.importorskip("flint")

from asympk.certify import certify, cover  # noqa: E402
from asympk.certify.affine import _Modes  # noqa: E402
from asympk.certify.balls import ball, ball_of, hull, precision  # noqa: E402
from asympk.certify.rows import ExactEntries  # noqa: E402
from asympk.certify.segments import EnclosedSegment  # noqa: E402
from asympk.scenes.scenefile import read_scene  # noqa: E402

F, x, v, y, w, t = sp.symbols("F x v y w t", real=True)
a, b, k = sp.symbols("a b k", positive=True)
DAMPED = ap.System.with_frictions({x: v, v: -a * x - b * v + F}, {}, [ap.Friction(v, F, load=1, kinetic=k)])
POINTS = [(Fraction(i, 7), Fraction(j, 5)) for i in range(8) for j in range(6)]  # parts of a box


def entries_on(**sides):
    """Return the exact entries of the damped block on a box."""
    return ExactEntries(DAMPED, (2, 1, 1), {name: tuple(map(Fraction, ends)) for name, ends in sides.items()}, ())


def placed(sides, parts):
    """Return the values of parameters at parts of the sides of a box."""
    pairs = zip(sides.items(), parts, strict=True)
    return {sp.Symbol(name, positive=True): low + (high - low) * part for (name, (low, high)), part in pairs}


def parameters(matrix, field):
    """Return a matrix of expressions as a family."""
    return field.family([[field.exact(entry) for entry in row] for row in matrix.tolist()])


@pytest.mark.parametrize(
    ("of_family", "of_matrix"),
    [
        (lambda m: m * m + m * 3 - m, lambda m: m * m + 2 * m),
        (lambda m: m.inverse(), lambda m: m.inv()),
        (lambda m: m / m.entry(1, 1), lambda m: m / m[1, 1]),
        (lambda m: m.exp(), lambda m: m.applyfunc(sp.exp)),
    ],
    ids=["products", "inverse", "quotient", "exponentials"],
)
def test_a_family_contains_the_matrix_of_every_point_and_its_excess_is_of_second_order(of_family, of_matrix):
    matrix, excess = sp.Matrix([[a, 1 + a * b], [b - a, 2 * b / a]]), []
    for width in (Fraction(1, 50), Fraction(1, 100)):
        sides = {"a": (Fraction(2), 2 + width), "b": (Fraction(1), 1 + width)}
        with precision(100):
            found = of_family(parameters(matrix, entries_on(**sides))).tight().whole
            exact = [of_matrix(matrix.subs(placed(sides, parts))) for parts in POINTS]
            for i in range(4):
                values = [float(m[i]) for m in exact]
                ends = [float(found.entries()[i].real.lower()), float(found.entries()[i].real.upper())]
                assert ends[0] <= min(values) + 1e-15
                assert ends[1] >= max(values) - 1e-15
            spread = [max(float(m[i]) for m in exact) - min(float(m[i]) for m in exact) for i in range(4)]
            excess.append(max(float(found.entries()[i].real.rad()) - spread[i] / 2 for i in range(4)))
    assert excess[1] < excess[0] / 3


def test_the_slopes_of_roots_and_residues_lead_from_the_centre_to_every_point():
    sides = {"a": (Fraction(2), Fraction(201, 100)), "b": (Fraction(1), Fraction(101, 100))}
    free = sp.Matrix([[0, 1, 0], [-a, -b, 1], [0, 0, 0]])
    upper = (-b + sp.I * sp.sqrt(4 * a - b**2)) / 2
    residue = sp.Matrix([[upper + b, 1], [-a, upper]]) / (2 * upper + b)
    with precision(100):
        field = entries_on(**sides)
        found = field.spectrum(tuple(tuple(map(field.exact, row)) for row in free.tolist()), 4)
        root, _, (part,) = next(group for group in found if group.mean.whole[0, 0].imag > 0)
        wanted = [(root, 0, 0, upper), *((part, i, j, residue[i, j]) for i in range(2) for j in range(2))]
        for (family, i, j, formula), parts in product(wanted, POINTS):
            at, centre = placed(sides, parts), placed(sides, (Fraction(1, 2),) * 2)
            moved = complex((formula.subs(at) - formula.subs(centre)).evalf(30))
            slopes = [slope[i, j] for slope in family.parts[2:]]
            along = [slope * ball(at[s] - centre[s]) for slope, s in zip(slopes, (a, b), strict=True)]
            for enclosed, exact in ((sum(along).real, moved.real), (sum(along).imag, moved.imag)):
                assert abs(float(enclosed.mid()) - exact) <= float(enclosed.rad()) + 1e-15
            assert max(float(size.rad()) for slope in slopes for size in (slope.real, slope.imag)) < 0.005


def test_the_slopes_of_a_square_are_half_as_wide_as_its_derivatives():
    with precision(100):
        side = entries_on(a=(Fraction(1), Fraction(3))).side("a")
        slope = (side * side).parts[2][0, 0].real
    assert [float(slope.lower()), float(slope.upper())] == pytest.approx([3, 5])  # (a^2 - 4)/(a - 2) = a + 2


def test_the_time_of_an_event_moves_by_minus_the_rate_by_the_parameter_over_the_rate_by_the_time():
    # without damping and friction ahead the block turns at pi/sqrt(a), which changes by -pi/2 a^(-3/2)
    system = ap.System.with_frictions({x: v, v: -a * x + F}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    modes = _Modes(system, (Fraction(2),), {"a": (Fraction(199, 100), Fraction(201, 100))}, 4)
    state = modes.begun([Fraction(9), Fraction(0)])
    mode, (guard, *_) = modes.chosen([modes.every(state)], state, "start")
    found = EnclosedSegment(mode, state).moment(guard, hull(Fraction(219, 100), Fraction(225, 100)))
    time, centre, slope = (part[0, 0].real for part in found.parts)
    assert abs(float(centre.mid()) - float(mpmath.pi / mpmath.sqrt(2))) < 1e-14
    for value in (1.99, 2.0, 2.005, 2.01):
        assert time.contains(float(mpmath.pi / mpmath.sqrt(value)))
        moved = -mpmath.pi / (mpmath.sqrt(2 * value) * (mpmath.sqrt(value) + mpmath.sqrt(2)))
        assert slope.contains(float(moved))  # (pi/sqrt(a) - pi/sqrt(2))/(a - 2)
    assert float(time.rad()) < 0.0059  # the times themselves differ by 0.0056 on either side


def contained(proof, path):
    """Tell whether a path of forty digits is what a certificate proves."""
    pairs = [*zip(proof.final, path.final, strict=True)]
    for mine, its in zip(proof.events, path.events, strict=True):
        pairs += [(mine.t, its.t), *zip(mine.state, its.state, strict=True)]
    with mpmath.workdps(60):
        near = (abs(mpmath.mpf(m.mid().str(60, radius=False)) - e) <= float(m.rad()) * 1.0001 + 1e-33 for m, e in pairs)
        return proof.modes == path.modes and all(near)


@pytest.mark.slow
def test_the_held_rod_is_proven_for_frictions_that_range_over_five_percent():
    scene = read_scene("held_rod")
    found = cover(scene, {"f": ("2", "2.1")}, 4)
    assert all(one.proven for one in found)
    for one in found:
        low, high = one.box["f"]
        for friction in (low, (low + 2 * high) / 3):
            values = dict(zip(scene.system.parameters, scene.values, strict=True)) | {"f": friction}
            values = {str(name): value for name, value in values.items()}
            near = ap.Scene(system=scene.system, values=values, start=scene.start, until=scene.until)
            assert contained(one, ap.solve(near, digits=40))


def test_a_complex_pair_counts_twice_though_the_ball_of_its_imaginary_part_contains_0():
    modes = _Modes(DAMPED, (Fraction(2), Fraction(1, 10), Fraction(1, 4)), {}, 4)
    state = modes.begun([Fraction(9), Fraction(0)])
    mode, _ = modes.chosen([modes.every(state)], state, "start")
    exact = EnclosedSegment(mode, state).jet(mode.guards[0], ball(1))
    around = flint.acb(0, flint.arb(0, 2))
    wider = [g._replace(mean=g.mean.linear(lambda m: m + around)) if g.mean.whole[0, 0].imag > 0 else g
             for g in mode.spectrum]
    mode.__dict__["spectrum"] = tuple(wider)
    (found,) = EnclosedSegment(mode, state).jet(mode.guards[0], ball(1))
    assert found.contains(exact[0])


def test_damping_and_friction_may_range_in_resonance_through_three_turns():
    system = ap.System.with_frictions(
        {x: v, v: sp.cos(t) - x - b * v + F}, {}, [ap.Friction(v, F, load=1, kinetic=k)], time=t)
    scene = ap.Scene(system=system, values={"b": "0.1", "k": "0.3"}, start={"x": 3, "v": 0}, until=12)
    proof = certify(scene, {"b": ("0.1", "0.1002"), "k": ("0.3", "0.3002")})
    assert proof.proven
    for damping, friction in (("0.1", "0.3002"), ("0.1001", "0.30005"), ("0.1002", "0.3")):
        near = ap.Scene(system=system, values={"b": damping, "k": friction}, start={"x": 3, "v": 0}, until=12)
        assert contained(proof, ap.solve(near, digits=40))


PUSHED, BESIDE = sp.cos(t) - a * x, sp.Rational(1, 50) * (y - x)


@pytest.mark.parametrize(
    ("rates", "until", "width"),
    [
        ({x: v, v: PUSHED + F}, 8, ("0.999", "1.001")),  # in resonance
        ({x: v, v: PUSHED + F}, 8, ("1.01", "1.011")),  # beside it
        ({x: v, v: -a * x + BESIDE + F, y: w, w: -y - BESIDE}, 12, ("0.999", "1.001")),  # two springs in beat
        ({x: v, v: (1 - a) * x + F}, 4, ("0.99", "1.01")),  # a spring that vanishes, together with the drift
        ({x: v, v: -x - 2 * a * v + F}, 6, ("0.99", "1.01")),  # critical damping
        ({x: v, v: y - x - 2 * a * v + F, y: w, w: -y - 2 * a * w}, 3, ("0.999", "1.001")),  # twice
    ],
    ids=["resonance", "beside resonance", "beat", "no spring", "critical", "twice critical"],
)
@pytest.mark.few(1)
def test_a_box_around_eigenvalues_that_meet_is_about_as_wide_as_what_its_points_do(rates, until, width):
    system = ap.System.with_frictions(rates, {}, [ap.Friction(v, F, load=1, kinetic=sp.Rational(1, 5))], time=t)
    start = {x: 2, v: 1} if y not in rates else {x: 2, v: 1, y: -1, w: 0}
    proof = certify(ap.Scene(system=system, values={a: 1}, start=start, until=until), {"a": width})
    assert proof.proven, proof.reason
    low, high = map(Fraction, width)
    near = (ap.Scene(system=system, values={a: low + (high - low) * part / 8}, start=start, until=until)
            for part in range(9))
    paths = [ap.solve(scene, digits=40) for scene in near]
    assert all(contained(proof, path) for path in paths)
    spread = max(float(max(ends) - min(ends)) / 2 for ends in zip(*(path.final for path in paths), strict=True))
    assert max(float(end.rad()) for end in proof.final) < spread * 1.7


def test_a_chain_of_near_eigenvalues_is_no_group():
    (left, middle, right), speeds = sp.symbols("x:3", real=True), sp.symbols("v:3", real=True)
    pulls = (middle - 2 * left, left + right - 2 * middle, middle - 2 * right)
    rates = dict(zip((left, middle, right), speeds, strict=True))
    rates |= {u: a * pull - u / 10 for u, pull in zip(speeds, pulls, strict=True)} | {x: v, v: left / 10}
    system, start = ap.System.smooth(rates, {}, None), dict.fromkeys(rates, 0) | {left: 1}
    proof = certify(ap.Scene(system=system, values={a: 1}, start=start, until=4), {"a": ("0.99", "1.01")})
    assert max(float(end.rad()) for end in proof.final) < 0.05
    for pull in ("0.99", "1.004", "1.01"):
        assert contained(proof, ap.solve(ap.Scene(system=system, values={a: pull}, start=start, until=4), digits=40))


def test_at_a_point_eigenvalues_that_part_are_no_group():
    system = ap.System.with_frictions(  # the eigenvalues -1 and -pi
        {x: v, v: F - (1 + sp.pi) * v - sp.pi * x}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    with precision(100):
        modes = _Modes(system, (), {}, 1)
        mode, _ = modes.chosen([modes.every(state := modes.begun([Fraction(9), Fraction(1)]))], state, "start")
        means = sorted(float(group.mean.whole[0, 0].real.mid()) for group in mode.spectrum)
    assert means == pytest.approx([-float(mpmath.pi), -1, 0])


def test_a_spring_may_range_over_forty_percent_about_critical_damping_through_a_turn():
    system = ap.System.with_frictions({x: v, v: F - a * x - v}, {}, [ap.Friction(v, F, load=1, kinetic=k)])
    scene = ap.Scene(system=system, values={a: "1/4", k: "1/3"}, start={"x": 1, "v": 2}, until=2)
    proof = certify(scene, {"a": ("0.2", "0.3")})
    assert proof.proven, proof.reason
    for value in ("0.2", "1/4", "0.27", "0.3"):
        assert contained(proof, ap.solve(replace(scene, values={a: value, k: "1/3"}), digits=40))


def test_friction_damping_and_start_may_range_over_twenty_percent_in_a_mode_without_a_turn():
    system = ap.System.with_frictions({x: v, v: F - b * v - x / 2}, {}, [ap.Friction(v, F, load=1, kinetic=k)])
    scene = ap.Scene(system=system, values={"b": "0.75", "k": "1.125"}, start={"x": "0.25", "v": "-0.6"}, until=4)
    proof = certify(scene, {"b": ("0.75", "0.9"), "k": ("1.125", "1.35"), "v": ("-0.625", "-0.5")})
    assert proof.modes == ("slip_opposite", "stick"), proof.reason
    for damping, friction, speed in (("0.75", "1.35", "-0.5"), ("0.9", "1.125", "-0.625"), ("0.75", "1.125", "-0.625")):
        values, start = {"b": damping, "k": friction}, {"x": "0.25", "v": speed}
        assert contained(proof, ap.solve(ap.Scene(system=system, values=values, start=start, until=4), digits=40))


c = sp.Symbol("c")
ROUND_KINKS = [1 + sp.Abs(c), sp.Max(1, 1 + c), 1 - sp.Min(c, c / 2), 2 + c * sp.sign(c - 1)]


@pytest.mark.parametrize("stiffness", ROUND_KINKS, ids=str)
@pytest.mark.few(2)
def test_a_parameter_whose_size_counts_may_range_across_0(stiffness):
    system = ap.System.with_frictions({x: v, v: F - x * stiffness}, {}, [ap.Friction(v, F, load=1, kinetic=1)])
    scene = ap.Scene(system=system, values={c: 0}, start={"x": 9, "v": 0}, until=4)
    proof = certify(scene, {"c": ("-1e-3", "2e-3")})
    assert proof.proven, proof.reason
    for value in ("-1e-3", 0, "1e-4", "2e-3"):
        near = ap.Scene(system=system, values={c: value}, start={"x": 9, "v": 0}, until=4)
        assert contained(proof, ap.solve(near, digits=40))


def test_the_sign_of_a_ball_around_0_is_anything_from_minus_1_to_1():
    around = ball_of(sp.sign(x), {x: hull(-1, 2)})
    assert [around.contains(ball(s)) for s in (-1, 0, 1)] == [True] * 3
    assert [ball_of(sp.sign(x), {x: ball(s)}) for s in (-2, 3)] == [-1, 1]
