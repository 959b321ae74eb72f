"""What the modes of many blocks have in common is derived once."""

import pytest
import sympy as sp

import asympk as ap
from asympk.automaton import decide, poles
from asympk.automaton.modes import mode_of
from asympk.errors import Unfinished
from asympk.symbolic import forces, long, lowering
from asympk.symbolic.branches import Phase

COUNT = 5
xs, vs, fs = (sp.symbols(f"{letter}0:{COUNT}", real=True) for letter in "xvF")
k = sp.Symbol("k", positive=True)


def chain():
    """Blocks on springs between one another, whose friction falls with the speed."""
    pulls = [sum(xs[j] - xs[i] for j in (i - 1, i + 1) if 0 <= j < COUNT) for i in range(COUNT)]
    rates = dict(zip(xs, vs, strict=True)) | {v: k * pull + F for v, pull, F in zip(vs, pulls, fs, strict=True)}
    frictions = [ap.Friction(velocity=v - 1, force=F, load=1, kinetic=1 / (1 + abs(v - 1)), static=1)
                 for v, F in zip(vs, fs, strict=True)]
    return ap.System.with_frictions(rates, {}, frictions)


def blocks(*velocities):
    """The mode of the chain in which the blocks slip in these directions, or stick for 0."""
    return mode_of(chain(), tuple(Phase(velocity, 1) for velocity in velocities))


def test_where_one_block_of_a_chain_stops_no_rate_of_another_is_tidied_anew():
    assert len(blocks(1, 1, 1, 1, 1).rates) == 2 * COUNT
    before = long.tidied.cache_info().misses
    assert blocks(1, 1, 1, 1, 0).rates[:-1] == blocks(1, 1, 1, 1, 1).rates[:-1]
    assert long.tidied.cache_info().misses - before <= 2


def test_each_force_of_a_chain_is_sought_in_its_own_equation(monkeypatch):
    sought, slope_by = [], forces.slope_by
    monkeypatch.setattr(forces, "slope_by", lambda e, s: sought.append(s) or slope_by(e, s))
    _, matrix, _ = forces.force_equations(chain(), blocks(1, 1, -1, 0, -1).branch)
    assert matrix == sp.eye(COUNT)
    assert len([s for s in sought if s in fs]) == COUNT


def test_velocities_each_with_a_state_of_its_own_are_no_combinations_and_need_no_rank(monkeypatch):
    monkeypatch.setattr(sp.Matrix, "rank", lambda *_, **__: pytest.fail("a rank is computed"))
    assert forces._dependent.__wrapped__(chain()) == frozenset()


def test_limits_at_the_divisor_of_one_block_are_looked_for_once_in_all_modes(monkeypatch):
    assert blocks(1, 1, 1, 1, -1).poles
    orders, order = [], poles._order
    monkeypatch.setattr(poles, "_order", lambda e, *zero: orders.append(e) or order(e, *zero))
    assert blocks(1, 1, 1, 1, 0).poles
    assert not orders


def test_an_expression_that_two_functions_share_is_written_once():
    x, y = sp.symbols("x y_of_this_test", real=True)
    lowering.lower((x,), (sp.sin(x) + x**3,), "math")
    before = lowering._text.cache_info().misses
    assert "sin" in lowering.lower((x, y), (sp.sin(x) + x**3, y), "math").source
    assert lowering._text.cache_info().misses - before == 1


@pytest.mark.parametrize("count", [1, 60])
def test_a_diagonal_matrix_has_an_inverse_unless_an_entry_is_0(count):
    entries = [k + n for n in range(count)]
    assert long.has_no_inverse(sp.diag(*entries)) is False
    assert long.has_no_inverse(sp.diag(*entries, 0)) is True


def pushed_by_cosines(count, spring):
    """Blocks that rest at the bound of their friction, which the push cos t leaves at once; springs may join them."""
    t, positions, velocities, frictions = sp.Symbol("t"), *(sp.symbols(f"{name}1:{count + 1}") for name in "xvF")
    ends = (0, *positions, 0)
    pulls = [spring * (ends[n] - 2 * x + ends[n + 2]) for n, x in enumerate(positions)]
    rates = {v: sp.cos(t) + pull + F for v, pull, F in zip(velocities, pulls, frictions, strict=True)}
    laws = [ap.Friction(velocity=v, force=F, load=1, kinetic=1) for v, F in zip(velocities, frictions, strict=True)]
    system = ap.System.with_frictions(dict(zip(positions, velocities, strict=True)) | rates, {}, laws, time=t)
    return ap.Scene(system=system, start=dict.fromkeys(system.states, 0), until=1)


@pytest.mark.parametrize("spring", [0, 1])
def test_blocks_whose_ties_are_independent_are_judged_one_by_one(spring, monkeypatch):
    """Springs move the ties by derivatives higher than those that tell: of six blocks 64 modes were derived."""
    judged, staying = [], decide.staying
    monkeypatch.setattr(decide, "staying", lambda *asked: judged.append(asked) or staying(*asked))
    assert ap.solve(pushed_by_cosines(6, spring)).modes == ("+".join(["stick"] * 6),)
    assert len(judged) == 1


@pytest.mark.slow
@pytest.mark.further
def test_more_independent_ties_than_have_combinations_to_be_tried_are_decided():
    """Of thirteen blocks that may each rest or slip at first, 8192 combinations were too many."""
    assert ap.solve(pushed_by_cosines(13, 0)).modes == ("+".join(["stick"] * 13),)


def test_a_tie_that_a_derivative_of_another_force_decides_is_not_judged_alone():
    """The first block breaks loose, the second stays, and the spring between them makes the third slip."""
    t, (x, y), (u, v, w), (F, G, H) = sp.Symbol("t"), *map(sp.symbols, ("x y", "u v w", "F G H"))
    laws = [ap.Friction(velocity=s, force=force, load=1, kinetic=1) for s, force in ((u, F), (v, G), (w, H))]
    rates = {x: u, y: v, u: 1 + t + F, v: 1 - t + G, w: 1 + x - y + H}
    system = ap.System.with_frictions(rates, {}, laws, time=t)
    path = ap.solve(ap.Scene(system=system, start=dict.fromkeys(system.states, 0), until=1))
    assert path.modes == ("slip_same+stick+slip_same",)
    assert path.final == pytest.approx((1 / 6, 0, 1 / 2, 0, 1 / 24), abs=1e-12)


@pytest.mark.parametrize("options", [{"method": "lsoda"}, {"digits": 20}])
def test_a_choice_among_ties_ends_with_the_time_of_the_run(options):
    """On elastic contacts that begin without load, modes were derived for minutes, whatever the time allowed."""
    t, x, v, F = sp.symbols("t x v F")
    block = ap.System.with_frictions({x: v, v: sp.cos(t) + x**2 + F}, {}, [
        ap.Friction(velocity=v, force=F, load=1, kinetic=1)], time=t)
    scene = ap.Scene(system=block, start={x: 0, v: 0}, until=1)
    with pytest.raises(Unfinished, match="time limit reached where the motion is chosen among many at t = 0, x = 0"):
        ap.solve(scene, seconds=0, **options)
