"""Portraits and maps show the geometry that the package derives, and can be read."""

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from legibility import flaws
from matplotlib.backends.backend_agg import FigureCanvasAgg

from asympk.affine.many import solve_many
from asympk.errors import InputError
from asympk.methods import solve
from asympk.output import gallery
from asympk.output.arrow import arrow_drawing, parts_in_order
from asympk.pictures import maps, paths, plate, portraits, spread
from asympk.pictures.figures import save
from asympk.pictures.phase import phase
from asympk.pictures.rigid import motion_plot
from asympk.pictures.trace import SAMPLES, sampled_modes
from asympk.scene import Scene
from asympk.scenes.scenefile import read_scene, scene_names
from asympk.storage.rows import read_rows
from asympk.studies.convergence import EXPANSIONS
from asympk.studies.least import LADDER
from asympk.symbolic.system import System
from asympk.systems.catalogue import described_mechanism

ROWS = Path(__file__).parents[2] / "paper" / "generated" / "rows"
PICTURES = {
    "phase": gallery.phase_picture,
    "jump": gallery.jump_picture,
    "regimes": maps.regime_map,
    "stick": lambda: maps.stick_over_static_friction(("1", "-17/10")),
    "convergence": lambda: maps.convergence(
        [{"expansion": name, "sigma": s, "order": n, "mu": mu, "excess": mu}
         for name in EXPANSIONS for s in ("1", "-1/2") for n in (0, 1, 2) for mu in (1e-2, 1e-8, 1e-12)]),
    "collisions": lambda: maps.collisions(
        [{"mu": mu, "scaled_x": 10.0**i, "z": side * 10.0**j, "count": max(0, i + j)}
         for mu in (1e-3, 3.0) for i in range(-6, 7) for j in range(-6, 7) for side in (-1, 1)]),
    "damping": lambda: gallery.damping_picture(read_rows(ROWS / "damping.csv")),
    "least": lambda: maps.least_models(
        [{"sigma": sigma, "mu": 10.0**i, "z": side * 10.0**j, "rung": max(0, min(4, i + j + 4))}
         for sigma in ("1", "-1/2") for i in range(-8, 0) for j in range(-6, 7) for side in (-1, 1)], list(LADDER)),
}


@pytest.fixture(scope="module")
def figures():
    return {name: draw() for name, draw in PICTURES.items()}


@cache
def twice(name):
    return PICTURES[name](), PICTURES[name]()


@pytest.mark.few(0)
@pytest.mark.parametrize("name", PICTURES)
def test_every_text_is_on_the_sheet_and_lies_on_no_other(name, figures):
    assert flaws(figures[name]) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arm", "crank_slider"])
def test_a_map_of_none_one_and_two_rigid_motions_is_legible(name):
    assert flaws(motion_plot(described_mechanism(name))) == []


def test_words_on_the_level_lines_of_a_reaction_have_a_white_rim():
    forward = motion_plot(described_mechanism("butenin")).axes[1]
    assert sorted(word.get_text() for word in forward.texts if word.get_path_effects()) == ["centre", "saddle"]


@pytest.mark.slow
def test_the_arrow_of_imports_is_legible():
    figure = arrow_drawing(list(parts_in_order(ROWS.parents[2])))
    assert flaws(figure) == []
    figure.set_dpi(720)  # where glyphs are as wide as in SVG: at 72 they are moved to whole pixels
    renderer = FigureCanvasAgg(figure).get_renderer()
    assert min(name.get_window_extent(renderer).x0 for name in figure.axes[0].texts) >= 0


@pytest.mark.parametrize("name", scene_names())
@pytest.mark.few(1)
def test_the_path_of_every_scene_that_ships_is_legible(name):
    assert flaws(solve(read_scene(name)).plot()) == []


@pytest.mark.parametrize(("name", "scale"), [("backward", "function"), ("collisions", "linear")])
def test_time_is_logarithmic_where_most_events_are_early_and_not_where_the_first_alone_is(name, scale):
    assert solve(read_scene(name)).plot().axes[-1].get_xscale() == scale


@pytest.mark.parametrize("mu", ["1e-9", "1e-15", "1e-300"])
@pytest.mark.few(1)
def test_a_picture_of_a_jump_of_any_shortness_is_legible(mu):
    assert flaws(solve(Scene(sigma=1, mu=mu, start=(0, "0.2", -1), until=5)).plot()) == []


def test_labels_of_powers_of_ten_stand_apart_by_more_than_their_size():
    """Of six decades each had a label; with matplotlib 3.9 they overlapped."""
    drawing = solve(Scene(sigma=1, mu="1e-9", start=(0, "0.2", -1), until=5)).plot()
    axis = drawing.axes[1].yaxis
    drawing.canvas.draw()
    places = [axis.axes.transData.transform((0, at))[1] for at in axis.get_majorticklocs()]
    size = axis.get_ticklabels()[0].get_fontsize() * drawing.dpi / 72
    assert len(places) == 5
    assert min(high - low for low, high in pairwise(places)) > 1.4 * size


@pytest.mark.parametrize(("rate", "start", "until"), [
    (1000, 7, 1),     # ends 430 powers of ten below its start
    (100, 20000, 1),  # is usually below a thousand
    (1, 1, "4e-4"),
])
def test_the_path_of_a_decay_is_legible_whatever_its_sizes(rate, start, until):
    x = sp.Symbol("x", real=True)
    decay = System.smooth({x: -rate * x}, {}, None)
    assert flaws(solve(Scene(system=decay, start={x: start}, until=until)).plot()) == []


LONG = sp.Symbol("position_of_the_left_hand_block", real=True)
GROWTH = System.smooth({LONG: LONG}, {}, None)


@pytest.mark.parametrize("figure", [
    lambda: solve(Scene(system=GROWTH, start={LONG: 1}, until=1)).plot(),
    lambda: solve_many(system=GROWTH, values={}, start={LONG: np.ones(5)}, until=1).plot(),
    lambda: spread.plot({"quantiles": {LONG.name: [0, 1, 2, 3, 4, 5, 6]}, "itineraries": {}, "outcomes": {},
                         "probabilities": [0, 0.05, 0.25, 0.5, 0.75, 0.95, 1]}),
], ids=["path", "crowd", "spread"])
def test_a_long_name_stays_on_the_sheet(figure):
    assert flaws(figure()) == []


def test_a_map_of_rigid_motions_reaches_beyond_the_least_critical_friction():
    """That of the slender rod is 4/3."""
    rod = described_mechanism("painleve_rod")
    low, steep = (motion_plot(rod.changed({"f": friction})).axes[0].get_ylim()[1] for friction in ("1/4", 2))
    assert low == pytest.approx(2, rel=1e-3)
    assert steep == 4


@pytest.mark.parametrize(("changes", "marked"), [
    ({}, [(1.1, 2)]), ({"theta": 1, "f": "3/2"}, [(1, 1.5)]), ({"theta": 2}, []),  # the map ends at 1.5
])
def test_a_map_of_rigid_motions_marks_the_example_where_it_lies_on_the_map(changes, marked):
    figure = motion_plot(described_mechanism("painleve_rod").changed(changes))
    assert [tuple(map(float, (*line.get_xdata(), *line.get_ydata()))) for line in figure.axes[0].lines] == marked
    assert flaws(figure) == []


@pytest.mark.further
@pytest.mark.parametrize(("name", "kind"), [("phase", "pdf"), ("phase", "svg"), ("collisions", "svg")])
def test_the_same_picture_has_the_same_bytes(name, kind, tmp_path):
    first, second = (save(figure, tmp_path / f"{k}.{kind}").read_bytes() for k, figure in enumerate(twice(name)))
    assert first == second
    assert b"Date" not in first


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.few(0)
def test_every_picture_is_as_wide_as_a_column(name, figures):
    assert figures[name].get_size_inches()[0] == 3.4


def test_levels_are_those_of_the_paper_at_sigma_1():
    assert portraits.levels(1) == {"Pi1": 1 / 5, "Pi2": -1, "Gamma1": 1 / 4, "Gamma2": -1 / 2}


def test_an_edge_or_a_plane_at_infinity_has_no_level():
    assert "Gamma2" not in portraits.levels(-1)
    assert "Pi2" not in portraits.levels(0)


def test_a_traced_path_passes_through_its_events_and_ends():
    path = solve(Scene(1, "1/50", (0, -2, -1), 2))
    t, (x, y, z) = portraits.sampled(path)
    assert {0.0, 2.0, *(event.t for event in path.events)} <= set(t)
    assert (x[0], y[0], z[0]) == pytest.approx((0, -2, -1))
    assert np.abs(z[np.isin(t, [event.t for event in path.events[1:]])]).max() < 1e-12


@pytest.mark.parametrize(("mu", "until"), [("1e-15", 5), ("1e-6", 1e15)])
def test_the_samples_after_an_early_event_show_the_motion_on_a_logarithmic_axis_of_time(mu, until):
    path = solve(Scene(1, mu, (0, "0.2", -1), until))
    _, (t, *values) = sampled_modes(path, SAMPLES)[-1]
    times = np.geomspace(t[0], t[-1], 200)[1:-1]
    for v, exact in zip(values[:3], path(times), strict=True):
        assert np.interp(np.log(times), np.log(t), v) == pytest.approx(exact, abs=0.02 * np.ptp(v))


def test_what_varies_by_rounding_alone_is_drawn_as_a_constant():
    path = solve(Scene(1, "1e-6", (0, "0.2", -1), "1e-20"))  # y grows by 1.2e-14
    assert [axis.get_ylim() for axis in paths.figure(path).axes[1:]] == [
        pytest.approx(ends) for ends in ((0.08, 0.32), (-1.12, -0.88), (0.08, 0.32))]
    assert phase(path).axes[0].get_xlim() == pytest.approx((0.08, 0.32))


def test_a_path_that_is_shorter_than_any_axis_is_refused_and_not_drawn_empty():
    path = solve(Scene(1, "1e-6", (0, "0.2", -1), "1e-300"))
    with pytest.raises(InputError, match=r"until = 1e-300: matplotlib draws no axis below 2\.23e-287"):
        path.plot()
    assert "<img" not in path._repr_html_()
    assert paths.figure(solve(Scene(1, "1e-6", (0, "0.2", -1), "1e-286"))).axes[0].get_xlim() == (0, 1e-286)


def test_values_that_are_not_finite_do_not_count_for_the_scale_of_an_axis():
    values = np.where(np.arange(1000) < 10, 1e6, 5.0)
    infinite = np.where(np.arange(1000) == 500, np.inf, values)
    found = [paths.logarithmic_from(np.arange(1000.0), v) for v in (values, infinite, infinite * np.inf)]
    assert found == [10, 10, None]


def test_the_phase_space_names_its_planes_edges_and_octants(figures):
    steep, shallow = figures["phase"].axes
    words = [{text.get_text() for text in ax.texts} for ax in (steep, shallow)]
    common = {f"${name}_{k}$" for name in (r"\Pi", "G", r"\Gamma", "O") for k in (1, 2)} | {"$O_3$", "$O_4$"}
    assert common <= words[0] & words[1]
    assert {"$O_5$", "$O_6$"} <= words[0] - words[1]


def test_pi2_lies_at_the_load_minus_one_over_sigma_where_z_has_the_sign_of_sigma(figures):
    for ax, sigma in zip(figures["phase"].axes, (gallery.STEEP, gallery.SHALLOW), strict=True):
        plane = {(-1 / sigma, 0)}
        (ends,) = (line.get_ydata() for line in ax.lines if {*zip(*line.get_data(), strict=True)} & plane)
        assert ends[1] * sigma > 0


def test_arrows_on_a_curve_point_the_way_it_is_run_through():
    with plate(2.0) as (_, axes):
        portraits.arrows(axes.flat[0], *np.linspace((0, 0), (1, 1), 50).T, "black")
        heads = [(note.xy, note.xyann) for note in axes.flat[0].texts]
    assert heads
    assert all(head > tail for head, tail in heads)


def test_the_plane_of_a_reaction_names_two_equilibria_forward_and_none_backward():
    _, *planes = motion_plot(described_mechanism("butenin")).axes
    assert [plane.get_title() for plane in planes] == [
        "sliding forward: a centre and a saddle", "sliding backward: no equilibrium, the reaction runs away",
    ]


def test_over_static_friction_the_stick_region_is_filled_between_the_edges_of_the_static_cone():
    (ax,) = maps.stick_over_static_friction(["1"]).axes
    filled = [path for fill in ax.collections if not fill.get_hatch() for path in fill.get_paths()]
    places = {(2, 0.3): True, (2, 0.15): False, (2, -0.25): False, (2, -0.4): True, (3, -0.4): True, (3, 0.15): False}
    assert {at: any(part.contains_point(at) for part in filled) for at in places} == places


def test_for_small_mu_the_computed_jump_leaves_the_vertical_one_by_as_much_as_z(figures):
    held, _ = portraits.with_x_held(1, (0, "1/5", -1), 3)
    path = solve(Scene(1, "1e-6", (0, "1/5", -1), 3))
    landed = next(event for event in path.events if event.kind == "slip_onset")
    assert held[1] == 0
    assert landed.x == pytest.approx(1, abs=2e-4)


def test_the_stick_region_is_filled_where_the_cone_holds(figures):
    ax = figures["regimes"].axes[0]
    parts = [path for fill in ax.collections for path in fill.get_paths()]
    places = ((1, 1), (1, -0.6), (1, 0), (-1.2, 2), (-1.2, -2), (-0.5, -4))
    inside = [any(part.contains_point(place) for part in parts) for place in places]
    assert inside == [True, True, False, True, False, True]


def test_a_number_stands_inside_the_part_it_counts():
    mask = np.zeros((9, 9), dtype=bool)
    mask[2:7, 1:8] = True
    row, column = maps._inside(mask)
    assert mask[row - 1 : row + 2, column - 1 : column + 2].all()
    assert maps._inside(np.eye(9, dtype=bool)) is None


def test_a_scale_of_a_path_has_no_corner_where_its_logarithms_begin_a_decade_or_more_from_zero():
    panels = paths.figure(solve(read_scene("backward"))).axes
    for axis, least, step, room in ((panels[1].yaxis, 1.0, 100, paths.ROOM), (panels[1].xaxis, 1e-5, 10, 1)):
        assert {0, least, step * least} <= {*axis.get_majorticklocs().round(9)}
        place = axis.get_transform().transform
        zero, before, first, after, tenth, hundredth = place(least * np.array([0, 0.999, 1, 1.001, 100, 1000]))
        assert after - first == pytest.approx(first - before, rel=1e-2)
        assert first - zero == pytest.approx(room * (hundredth - tenth), rel=1e-3)


def test_a_quantity_over_hundreds_of_decades_has_a_logarithmic_axis_without_a_warning():
    x = sp.Symbol("x", real=True)
    decay = System.smooth({x: -x}, {}, None)
    many = solve_many(system=decay, values={}, start={x: np.geomspace(1e-200, 1e200, 5)}, until=1)
    assert many.plot().axes[-1].get_xscale() == "log"
