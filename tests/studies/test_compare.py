"""Comparison across jumps, and figures that leave no failure out."""

import json
from dataclasses import replace
from pathlib import Path as File

import numpy as np
import pytest

import asympk as ap
from asympk.errors import Unfinished, UnknownName
from asympk.output import artefacts, gallery, paper, rowtables
from asympk.path import Path
from asympk.pictures import figures, style
from asympk.storage import rows
from asympk.studies import chart, compare, ladder
from asympk.studies.compare import errors_of, path_distance, quiet_times, status_of, timed, workprec

KEPT = File(__file__).parents[2] / "paper" / "generated" / "rows"


def scene(mu="1e-3", name="iii"):
    return ap.Scene(1, mu, chart.SCENES[name], 5, name=name)


@pytest.fixture(scope="module")
def exact():
    return ap.solve(scene(), digits=30)


def late(path, by):
    """Return ``path`` run ``by`` later, as a method that locates the first event badly."""
    shifted = tuple(event._replace(t=event.t + by) for event in path.events)
    return replace(path, events=shifted, at=lambda t: path(max(float(t) - by, 0.0)))


def test_the_exact_flow_in_doubles_has_no_error_worth_the_name(exact):
    found = errors_of(ap.solve(scene()), exact, scene())
    assert found["same_modes"] is True
    assert max(found["final_error"], found["path_error"]) < 1e-14
    assert found["time_error"] < 1e-13


def test_a_jump_that_is_late_by_a_part_of_mu_is_a_time_error_and_no_path_error(exact):
    shifted = late(exact, 1e-4 * float(exact.scene.mu))
    found = errors_of(shifted, exact, exact.scene)
    assert found["time_error"] == pytest.approx(1e-4, rel=1e-6)
    assert found["path_error"] < 1e-6
    middle = float(exact.events[0].t)
    assert abs(float(shifted(middle)[1]) - float(exact(middle)[1])) > 1e-2


def test_quiet_times_keep_away_from_the_start_and_from_every_event(exact):
    mu = float(exact.scene.mu)
    times = quiet_times(exact, mu, 5.0)
    width = 4 * mu * np.log(1 / mu)
    assert len(times) > 50
    assert all(abs(t - float(e.t)) > width for t in times for e in exact.events)
    assert times[0] > width
    assert quiet_times(exact, 10.0, 5.0) == []
    assert path_distance(exact, exact, ap.Scene(1, 10, (0, 0, 1), 5)) is None


@pytest.mark.parametrize(("errors", "status"), [
    ({"final_error": 1e-5, "same_modes": True}, "finished"),
    ({"final_error": 1e-5, "same_modes": None}, "finished"),
    ({"final_error": 1e-5, "same_modes": False}, "events missed"),
    ({"final_error": 0.2, "same_modes": False}, "wrong branch"),
    ({"final_error": 0.2, "same_modes": None}, "wrong branch"),
])
def test_the_status_of_a_finished_run_is_judged_by_its_end_and_its_modes(exact, errors, status):
    assert status_of(exact, errors) == status


def test_a_run_that_did_not_finish_has_a_status_and_no_errors(exact):
    with pytest.raises(Unfinished) as stop:
        ap.solve(scene("1e-6"), method="rk45", steps=50)
    path = stop.value.path
    assert errors_of(path, exact, scene("1e-6")) == {}
    assert status_of(path, {}) == path.info["status"]


@pytest.mark.slow
def test_work_grows_and_errors_fall_with_the_tolerance():
    found = workprec(scene(), "radau", (1e-3, 1e-6, 1e-9), repeats=1)
    assert [row["rtol"] for row in found] == [1e-3, 1e-6, 1e-9]
    assert found[0]["steps"] < found[1]["steps"] < found[2]["steps"]
    assert found[0]["final_error"] > found[1]["final_error"] > found[2]["final_error"]
    assert {row["status"] for row in found} == {"finished"}
    assert all(row["jacobians"] > 0 and row["calls"] > row["steps"] and row["ratio"] > 0 for row in found)


def test_a_refusal_is_a_row_that_says_why():
    (row,) = workprec(scene(), "rigid", (None,), repeats=1)
    assert row["status"].startswith(("NoMotion", "TwoMotions", "OutOfRange"))
    assert (row["final_error"], row["ratio"]) == (None, None)
    with pytest.raises(UnknownName):
        ap.solve(scene(), method="euler")


def test_costs_are_medians_of_interleaved_runs(monkeypatch):
    clock = iter([0, 0.1, 0, 3, 0, 20, 0, 5, 0, 40, 0, 4, 0, 30])
    monkeypatch.setattr(compare, "process_time", lambda: next(clock))
    calls = []
    path = Path(None, "x", (), (), (), None)
    result, ratio = timed(lambda: calls.append("run") or path, lambda: calls.append("unit"), 3)
    assert result is path
    assert ratio == 4 / (30 / 20)
    assert calls == ["run", "unit", *(["run"] + ["unit"] * 20) * 3]


# figures

PLAN = {"scenes": ("iii",), "mus": ("1e-1", "1e-4"), "tolerances": (1e-3, 1e-6), "step_sizes": (1e-2,),
        "offsets": ("1e-8", "-1e-8"), "repeats": 1, "steps": 400, "seconds": 10.0}


@pytest.fixture(scope="module")
def few():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chart, "EXPLICIT", ("rk45",))
        patch.setattr(chart, "IMPLICIT", ("radau", "lsoda"))
        told = []
        work = chart.work_rows(PLAN, told.append)
        plane = chart.plane_rows(PLAN, told.append)
    assert any("rk45" in line for line in told)
    return work, plane


def _drawn(figure):
    return sum(
        len(line.get_xdata()) for ax in figure.axes if ax.get_visible() for line in ax.lines
    )


@pytest.mark.further
def test_the_map_of_failures_counts_every_run_that_did_not_end_right(few):
    pytest.importorskip("matplotlib")
    work, plane = few
    lost = [row for row in (*work, *plane) if row["method"] in figures.style.METHODS]
    lost = [row for row in lost if figures.outcome(row["status"]) in figures.FAILURES]
    drawn = figures.failures([("mu", work, "mu"), ("deviation", plane, "offset")])
    assert sum(int(text.get_text()) for ax in drawn.axes for text in ax.texts) == len(lost) > 0


@pytest.mark.further
def test_every_run_is_a_mark_in_the_picture_whatever_became_of_it(few):
    pytest.importorskip("matplotlib")
    work, _ = few
    assert {figures.outcome(row["status"]) for row in work} >= {"finished", "limit", "stalled", "wrong branch"}
    assert _drawn(figures.work_precision(work, "iii", [1e-1, 1e-4])) == len(work)
    cost = figures.cost_against_mu(work, ["iii"], 1e-4)
    never = next(t.get_text() for t in cost.axes[0].texts if t.get_text().startswith("never: ")).count(",") + 1
    assert never > 1
    assert _drawn(cost) == 2 * (len({row["method"] for row in work}) - never)


@pytest.mark.further
def test_figures_are_saved_to_the_same_bytes_and_leave_rows_alone(few, tmp_path):
    pytest.importorskip("matplotlib")
    work, plane = few
    before = json.dumps([work, plane])
    for name in ("one.pdf", "two.pdf", "one.svg", "two.svg"):
        figures.save(figures.cost_against_mu(work, ["iii"], 1e-4, "a note"), tmp_path / name)
    assert (tmp_path / "one.pdf").read_bytes() == (tmp_path / "two.pdf").read_bytes()
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
    assert json.dumps([work, plane]) == before


def test_the_note_of_a_chart_names_the_integrators_that_are_there_and_no_others():
    full, lacking = ({*style.METHODS} - {*names} for names in ((), ("heyoka", "cvode", "kvaerno5")))
    told = gallery.options_note(full, chart.FULL)
    assert "LSODA (scipy) and CVODE (SUNDIALS, BDF) have the analytic Jacobian; heyoka (Taylor, tol = rtol) and" in told
    assert "are compiled, and compiling is not counted; the others call Python" in told
    assert "At most 100000 steps (heyoka 100 times as many) and 120 s." in told
    told = gallery.options_note(lacking, chart.QUICK)
    assert "Radau, BDF and LSODA (scipy) have the analytic Jacobian; all call Python, as the exact flow does." in told
    assert not any(name in told for name in ("heyoka", "CVODE", "Kvaerno5"))
    assert "Kvaerno5 (diffrax, default root finder and controller, 64 bit) is compiled" in gallery.options_note(
        lacking | {"kvaerno5"}, chart.QUICK)


def test_the_headers_of_kept_tables_have_no_latex_as_csv():
    tables = [*(File(__file__).parents[2] / "paper" / "generated" / "tables").glob("*.csv")]
    assert tables
    assert [path.name for path in tables if {*path.read_text().partition("\n")[0]} & {*"\\{}$^"}] == []


@pytest.mark.further
def test_the_chart_is_drawn_from_rows_alone_and_its_table_counts_every_run(few, tmp_path):
    pytest.importorskip("matplotlib")
    work, plane = few
    for name, found in (("work", work), ("plane", plane)):
        rows.write_rows(tmp_path / "rows" / f"{name}.csv", found, {"plan": PLAN})
    from legibility import flaws

    measured = [artefact for artefact in artefacts.ARTEFACTS if artefact.measured]
    drawn = [draw() for draw in artefacts.pictures(tmp_path / "rows", measured).values()]
    assert [flaws(figure) for figure in drawn if figure] == [[]] * 3
    files = paper.write_chart(tmp_path, lambda line: None)
    assert all(File(file).stat().st_size > 0 for file in files)
    assert {File(file).suffix for file in files} == {".pdf", ".tex", ".csv"}
    table = rowtables.method_table(work)
    assert sum(int(cell) for row in table.rows for cell in row[1:7]) == len(work)
    assert not any("nan" in str(cell) for row in table.rows for cell in row)


@pytest.mark.parametrize(("status", "key"), [
    ("finished", "finished"), ("wrong branch", "wrong branch"), ("events missed", "events missed"),
    ("stalled (x) at t = 1", "stalled"), ("step limit reached at t = 1", "limit"),
    ("limit of 9 events reached", "limit"), ("OutOfRange: mu is not small", "other"),
    ("no discrete solution at t = 1", "other"),
])
def test_every_status_has_a_mark(status, key):
    assert figures.outcome(status) == key


# the rows that are kept


@pytest.fixture(scope="module")
def kept():
    return rows.read_rows(KEPT / "work.csv")


def test_the_kept_rows_cover_ten_methods_three_scenes_and_eight_values_of_mu(kept):
    ran = {(row["method"], row["scene"], row["mu"]) for row in kept if not row["status"].startswith("MissingPackage")}
    methods = {m for m, _, _ in ran} - {name.replace("-", " ") for name in (*ladder.ROD, *ladder.JUMPS)}
    assert len(methods) >= 10
    assert ran >= {(m, s, float(mu)) for m in methods for s in chart.SCENES for mu in chart.MUS}


def test_the_kept_rows_say_what_became_of_every_run(kept):
    assert all(row["status"] and (row["final_error"] is None) == (figures.outcome(row["status"]) in (
        "stalled", "limit", "other")) for row in kept)
    assert list(kept[0]) == list(workprec(scene("1e-1"), "rigid", (None,), repeats=1)[0])


def test_the_exact_flow_is_right_in_all_kept_rows_and_the_careful_stiff_peers_are_too(kept):
    """Fairness: what careful drivers do well is in the rows as well."""
    assert all(row["final_error"] < 1e-14 and row["same_modes"] for row in kept if row["method"] == "exact")
    stiff = [row for row in kept if row["method"] in chart.IMPLICIT]
    assert all(row["same_modes"] and row["final_error"] < 0.02 for row in stiff if row["final_error"] is not None)
    assert sum(row["status"] == "finished" for row in stiff) > 0.95 * len(stiff)
