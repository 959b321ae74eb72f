"""Mechanics from first principles: sections 1 and 2 of the paper, against derivations made another way."""

import pytest
import sympy as sp

import asympk as ap
from asympk.errors import InputError, NotDerivable
from asympk.systems import painleve_klein as pk
from asympk.systems.painleve_klein import rod


def test_the_rigid_reaction_is_the_one_of_a_constrained_pair():
    """Lagrange's way: both masses move as one of 2m under P + F, and the smooth one takes half of that force."""
    reaction = rod.rigid_reaction()
    along = (rod.P + rod.kappa * reaction * sp.sin(rod.alpha)) / 2
    assert sp.simplify(reaction * sp.cos(rod.alpha) - along) == 0


@pytest.mark.parametrize(
    ("position", "forward", "backward"),
    [("1/2", 2, 0), ("-1/2", 2, 0), ("99/100", 2, 0), ("101/100", 1, 1), ("3", 1, 1), ("-3", 1, 1)],
)
def test_the_steep_rod_has_two_motions_forward_and_none_backward(position, forward, backward):
    counts = [rod.count_motions(velocity, sp.Rational(position)) for velocity in (1, -1, 0)]
    assert counts == [forward, backward, 1]


def test_every_listed_motion_obeys_its_own_inequality_and_no_other_does():
    for motion in rod.rigid_motions():
        for position in (sp.Rational(n, 7) for n in (-20, -6, -1, 1, 6, 20)):
            reaction = 1 / (position - motion.sign)
            motion_sign = motion.velocity or sp.sign(motion.load.subs(rod.steepness, position))
            assert (position in motion.positions) == (motion.sign * reaction * motion_sign < 0)


def test_small_angle_formulas_are_the_first_terms_of_the_exact_geometry():
    at = {rod.l: 2, rod.alpha: sp.pi / 5}
    for exact, first in zip(rod.geometry(), rod.small_angle(), strict=True):
        second = sp.diff(exact, rod.delta, 2).subs(rod.delta, 0) / 2
        error = (exact - first).subs(at)
        ratios = [
            (error / (second * rod.delta**2)).subs(at).subs(rod.delta, sp.Rational(1, 10**n)).evalf(30)
            for n in (2, 4, 6)
        ]
        assert [abs(ratio - 1) < sp.Rational(3, 10**n) for ratio, n in zip(ratios, (2, 4, 6), strict=True)] == [
            True
        ] * 3


def test_the_dropped_terms_are_the_first_order_of_the_turned_reaction():
    """cos and sin of alpha + beta at the turn that belongs to R_1, to first order in 1/k."""
    soft = sp.Symbol("epsilon", positive=True)
    elastic = rod.elastic_rod()
    turn = rod.R1 * sp.tan(rod.alpha) / rod.k
    for function, dropped in ((sp.cos, -elastic.dropped), (sp.sin, elastic.dropped_friction)):
        turned = function(rod.alpha + turn.subs(rod.k, 1 / soft)) / function(rod.alpha)
        first = sp.diff(turned, soft).subs(soft, 0) / rod.k
        assert sp.simplify(first - dropped) == 0


def test_every_group_is_a_pure_number():
    rod_length_over_time = {sp.Symbol("t", real=True): rod.h * rod.l, sp.Symbol("x_1", real=True): rod.l}
    for group in pk.groups():
        assert rod.dimension(group.definition.subs(rod_length_over_time)) == 1


def test_every_physical_equation_is_dimensionally_homogeneous():
    elastic = rod.elastic_rod()
    force = rod.dimension(rod.P)
    assert rod.dimension(elastic.balance) == force
    assert rod.dimension(elastic.stick()) == force
    assert rod.dimension(elastic.acceleration) == force / rod.MASS
    assert rod.dimension(elastic.dropped) == rod.dimension(elastic.dropped_friction) == 1


@pytest.mark.further
def test_the_scales_carry_the_physical_equations_to_the_canonical_ones():
    """Substitute the scales by hand in (2.5), in the quadrant R > 0, u > 0, and compare with (2.7)."""
    scales = rod.find_scales(rod.elastic_rod())
    balance, acceleration = rod.elastic_rod().slip(1)
    rho, rate, second = sp.symbols("rho rho1 rho2", positive=True)
    reaction = scales.reaction * (rho + rate)
    canonical = {rod.R: reaction, rod.ddR1: scales.reaction * second / scales.time**2}
    tangent = {rod.f: (pk.sigma + 2) / sp.tan(rod.alpha)}
    alpha = sp.Symbol("alpha", positive=True)

    def carried(expr, scale):
        expr = (expr.subs(canonical) * scale).subs(tangent).subs(rod.alpha, alpha)
        return sp.simplify(expr.subs(sp.Abs(rho + rate) / sp.cos(alpha), (rho + rate) / sp.cos(alpha)))

    stiffness = sp.Symbol("mu_", positive=True)
    by_mu = {rod.k: rod.m / (rod.l * rod.h**2 * sp.cos(alpha) ** 2 * stiffness)}
    turned = carried(balance, 1 / rod.P).subs(by_mu)
    assert (
        sp.simplify(
            turned.subs(sp.Abs(sp.cos(alpha)), sp.cos(alpha)) - (stiffness * second + (pk.sigma + 4) * (rho + rate) - 1)
        )
        == 0
    )
    speed = carried(acceleration, scales.time / scales.velocity)
    assert sp.simplify(speed.subs(sp.Abs(sp.cos(alpha)), sp.cos(alpha)) - (1 - (pk.sigma + 3) * (rho + rate))) == 0


def test_the_modes_are_those_of_the_paper_for_general_sigma():
    s, sigma = pk.x + pk.y, pk.sigma
    expected = {
        "slip_same": (1 - (sigma + 4) * s, 1 - (sigma + 3) * s),
        "slip_opposite": (1 + sigma * s, 1 + (sigma + 1) * s),
        "stick": (-s, 0),
    }
    for mode in pk.system().modes:
        fast, velocity = expected[mode.name]
        assert sp.expand(mode.fast[pk.y] - fast) == 0
        assert sp.expand(mode.slow[pk.z] - velocity) == 0
        assert mode.slow[pk.x] == pk.y


def test_the_scenes_run_forward_jump_from_below_and_escape_from_beyond_the_divide():
    assert [(scene.name, ap.solve(scene).modes) for scene in pk.scenes()] == [
        ("forward", ("slip_same",)),
        ("backward", ("slip_opposite", "stick", "slip_same")),
        ("escape", ("slip_opposite", "stick", "slip_opposite", "slip_same")),
    ]


def test_the_smooth_mass_gives_an_invariant_in_every_mode():
    """d/dt (z - mu y - x) = x is the equation m x_2'' = R cos(alpha) of the smooth mass."""
    for mode in pk.system().modes:
        assert sp.expand(mode.slow[pk.z] - mode.fast[pk.y] - mode.slow[pk.x] - pk.x) == 0


def test_a_nonlinear_damper_flows_through_to_the_load():
    damper = rod.h * rod.l * rod.dR1
    load = pk.system(rod.R1 + damper + damper**3 / rod.P**2).friction.load
    assert sp.expand(load - (pk.x + pk.y + pk.y**3 / sp.cos(rod.alpha) ** 2)) == 0


def test_half_the_damping_halves_the_scale_of_time():
    half = rod.find_scales(rod.elastic_rod(rod.R1 + rod.h * rod.l * rod.dR1 / 2))
    assert sp.cancel(half.time / rod.find_scales(rod.elastic_rod()).time) == sp.Rational(1, 2)


@pytest.mark.parametrize(("law", "words"), [
    (rod.R1, r"with 1 R_1 \+ 0 Rdot_1 near 0"),
    (rod.h * rod.l * rod.dR1 - rod.R1, "with -1 R_1"),  # a spring that pulls when compressed
])
def test_without_damping_or_with_a_negative_stiffness_there_are_no_scales_and_the_error_says_so(law, words):
    with pytest.raises(NotDerivable, match=rf"{words}.* has no scales of time and force"):
        pk.system(law)


@pytest.mark.parametrize("law", [rod.R1 + rod.dR1, rod.R1 * rod.l, sp.Symbol("c") * rod.R1, rod.R1 + rod.F])
def test_a_law_that_is_no_force_in_the_rod_is_refused(law):
    with pytest.raises(InputError):
        rod.elastic_rod(law)
