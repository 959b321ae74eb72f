"""Sweeps over any system: what ``solve`` says of every row, the same bits however it is killed, cut or computed."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from itertools import product

import numpy as np
import pytest
from blocks import sliding_blocks, spring_block
from mechanisms import FALLING_BALL, ON_HIGH_GROUND, SLENDER_ROD
from sweeptext import parse_sweep

import asympk as ap
from asympk.__main__ import main
from asympk.errors import AsympkError, InputError
from asympk.many import OUTCOMES, PHASES
from asympk.output import terminal
from asympk.output.terminal import sweep_as_text
from asympk.scenes.scenefile import read_scene
from asympk.shown import condensed
from asympk.sweep import chunks, results, run_sweep, summary
from asympk.sweep.itineraries import Alphabet
from asympk.sweep.sweepfile import from_description

# a rough, moving ground under one of two masses on springs, and a fast actuator: four states, affine
CHAIN = """
seed = 3
count = {count}
chunk = {chunk}
until = 5

[system]
small = "mu"
time = "t"

[system.slow]
x = "v"
v = "y - 2*x + F + cos(2*t)/2"
w = "x - w/4"

[system.fast]
y = "w - y"

[[system.frictions]]
velocity = "v"
force = "F"
load = "2 + x/4"
kinetic = "k"
static = "k + 1/4"

[values]
mu = 1e-3
k = [0.25, 0.5, 1]

[start]
x = {{ uniform = [-2, 2] }}
v = 1
w = 0
y = 0.5
"""
BELT = "\nuntil = {until}\n\n" + spring_block("k / (1 + abs(v - 1))", "v - 1") + """static = "k0"

[values]
k = {k}
k0 = {k0}

[start]
x = {x}
v = 1
"""
# the rod as a user would write it, under names in the order of its own
ROD = """
until = [1, 3]
{settings}

[system]
small = "b"
assumptions = ["a > -2", "c >= a"]

[system.slow]
x = "y"
z = "1 - x - y + F"

[system.fast]
y = "1 - 2*(x + y) + F"

[[system.frictions]]
velocity = "z"
force = "F"
load = "x + y"
kinetic = "a + 2"
static = "c + 2"

[values]
a = [-1.5, 0.5, 2]
b = [1e-2, 1e-5]
c = 2

[start]
x = {{ uniform = [-1, 1] }}
y = 0.2
z = -1
"""


def _chain(count=30, chunk=10, **changes):
    text = CHAIN.format(count=count, chunk=chunk)
    for old, new in changes.items():
        text = text.replace(old, new)
    return parse_sweep(text)


def _bytes(out):
    return {path.name: path.read_bytes() for path in out.iterdir() if path.name != "summary.json"}


def _whole(out):
    parts = [columns for _, _, columns in results(out)]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _paths(sweep):
    """Yield what ``solve`` says of every row."""
    columns = {field: np.broadcast_to(v, sweep.total) for field, v in sweep.quantities(0, sweep.total).items()}
    family = sweep.family
    for row in range(sweep.total):
        here = {field: float(values[row]) for field, values in columns.items()}
        values, start = ({name: here[name] for name in names} for names in (family.parameters, family.states))
        yield ap.solve(ap.Scene(system=family.system, values=values, start=start, until=here["until"]))


def _agree(sweep, found, **tolerances):
    for row, path in enumerate(_paths(sweep)):
        assert [found[name][row] for name in path.names] == pytest.approx(path.final, **tolerances)
        kinds = [event.kind for event in path.events]
        words = f"{path.modes[0]}: {', '.join(kinds)}" if kinds else path.modes[0]
        assert sweep.family.alphabet.words(found["itinerary"][row]) == words
        assert (found["n_events"][row], found["collisions"][row]) == (len(kinds), kinds.count("velocity_zero"))
        assert found["outcome"][row] == 0


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The files of an uninterrupted sweep over four states, a parameter and a start, in one process."""
    out = tmp_path_factory.mktemp("plain")
    assert run_sweep(_chain(), out) == 9
    return out


def test_every_row_over_an_affine_system_is_what_solve_says(plain):
    _agree(_chain(), _whole(plain), rel=1e-11, abs=1e-12)


def test_every_row_over_a_nonlinear_system_is_what_solve_says(tmp_path):
    sweep = parse_sweep(BELT.format(until=4, k="[0.5, 0.8]", k0=1, x="[0, 0.7]"))
    run_sweep(sweep, tmp_path)
    _agree(sweep, _whole(tmp_path), rel=1e-15)


def test_the_rod_by_its_name_is_swept_over_by_its_kernel(tmp_path):
    settings, values = "until = 3\ncount = 40\nseed = 3\n", "mu = 1e-3\nsigma = [-1, 1]\nsigma0 = 1\n"
    drawn = "{ uniform = [-1, 1] }"
    texts = {
        "own": f"{settings}{values}start = [{drawn}, 0.2, -1]\n",
        "named": f'{settings}system = "painleve_klein"\n[values]\n{values}[start]\nx = {drawn}\ny = 0.2\nz = -1\n',
    }
    for name, text in texts.items():
        run_sweep(parse_sweep(text), tmp_path / name)
    own, named = (_whole(tmp_path / name) for name in texts)
    assert len(own["x"]) == 80
    for field in own.keys() - {"provenance"}:
        assert np.array_equal(own[field], named[field]), field


def test_numbers_of_a_sweep_may_be_formulas_as_those_of_its_scene():
    text = CHAIN.format(count=1, chunk=1).replace("[0.25, 0.5, 1]", "['pi/4', '45 deg', '2/3', 'exp(-600)']")
    given = parse_sweep(text).quantities(0, 4)["k"]
    assert given.tolist() == [math.pi / 4, math.pi / 4, 2 / 3, math.exp(-600)]


def test_a_chunk_is_large_unless_a_random_number_changes_modes_otherwise_than_affinely():
    """A friction times a constant load is affine in the friction, times a load of a state it is not."""
    random = CHAIN.replace("chunk = {chunk}", "").format(count=1).replace("[0.25, 0.5, 1]", "{ uniform = [0.25, 1] }")
    assert [parse_sweep(random.replace("2 + x/4", load)).chunk for load in ("2", "2 + x/4")] == [8192, 64]


def test_a_smooth_system_has_one_itinerary(tmp_path):
    sweep = parse_sweep('until = 1\n[system.slow]\nx = "v"\nv = "(1 - x^2)*v - x"\n[start]\nx = [0, 1]\nv = 1\n')
    run_sweep(sweep, tmp_path)
    _agree(sweep, _whole(tmp_path), rel=1e-15)
    assert summary.summarise(tmp_path)["itineraries"] == {"smooth": 2}


def test_the_rod_written_by_a_user_ends_where_the_rod_does(tmp_path):
    settings = "seed = 2\ncount = 4\n"
    run_sweep(parse_sweep(ROD.format(settings=settings)), tmp_path / "user")
    own = "sigma = [-1.5, 0.5, 2]\nmu = [1e-2, 1e-5]\nsigma0 = 2\nuntil = [1, 3]\n"
    run_sweep(parse_sweep(f"{settings}{own}start = [{{ uniform = [-1, 1] }}, 0.2, -1]"), tmp_path / "rod")
    user, rod = _whole(tmp_path / "user"), _whole(tmp_path / "rod")
    for state in "xyz":
        assert user[state] == pytest.approx(rod[state], rel=1e-9, abs=1e-11)
    assert all(np.array_equal(user[name], rod[name]) for name in ("n_events", "collisions", "outcome", "itinerary"))


@pytest.mark.further
def test_two_worker_processes_compute_the_same_bits(plain, tmp_path):
    (tmp_path / "chain.toml").write_text(CHAIN.format(count=30, chunk=10))
    command = [sys.executable, "-m", "asympk", "sweep", str(tmp_path / "chain.toml"), "--out", str(tmp_path / "out")]
    told = subprocess.run([*command, "--workers", "2"], capture_output=True, text=True)
    assert (told.returncode, told.stderr) == (0, "")
    assert _bytes(tmp_path / "out") == _bytes(plain)


@pytest.mark.further
@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_computes_the_same_bits(plain, tmp_path):
    distributed = pytest.importorskip("distributed")
    (tmp_path / "chain.toml").write_text(CHAIN.format(count=30, chunk=10))
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        assert main(["sweep", str(tmp_path / "chain.toml"), "--out", str(tmp_path / "out"), "--dask",
                     cluster.scheduler_address]) == 0
    assert _bytes(tmp_path / "out") == _bytes(plain)


@pytest.mark.few(0)
@pytest.mark.parametrize("workers", [(), ("--workers", "2")])
def test_killed_and_resumed_equals_the_uninterrupted_sweep(plain, tmp_path, workers):
    (tmp_path / "chain.toml").write_text(CHAIN.format(count=30, chunk=10))
    out = tmp_path / "out"
    command = [sys.executable, "-m", "asympk", "sweep", str(tmp_path / "chain.toml"), "--out", str(out), *workers]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while len([*out.glob("chunk-*")]) < 2 and time.monotonic() < deadline:
        time.sleep(0.005)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert 2 <= len([*out.glob("chunk-*")]) < 9
    assert subprocess.run(command, capture_output=True).returncode == 0
    assert _bytes(out) == _bytes(plain)


@pytest.mark.slow
def test_the_order_of_sums_does_not_hang_on_the_seed_of_hashes(plain, tmp_path):
    (tmp_path / "chain.toml").write_text(CHAIN.format(count=30, chunk=10))
    command = [sys.executable, "-m", "asympk", "sweep", str(tmp_path / "chain.toml"), "--out", str(tmp_path / "out")]
    environment = {**os.environ, "PYTHONHASHSEED": "12345"}
    assert subprocess.run(command, capture_output=True, env=environment).returncode == 0
    assert _bytes(tmp_path / "out") == _bytes(plain)


def test_a_damaged_chunk_is_computed_again(plain, tmp_path):
    run_sweep(_chain(), tmp_path)
    damaged = tmp_path / "chunk-00000003.npz"
    damaged.write_bytes(damaged.read_bytes()[:-100])
    (tmp_path / "chunk-00000004.npz").unlink()
    (tmp_path / "chunk-00000004.npz").mkdir()
    with pytest.raises(InputError, match="the chunk is damaged"):
        chunks.read_chunk(_chain(), damaged)
    assert run_sweep(_chain(), tmp_path) == 2
    assert (tmp_path / "chunk-00000004.npz.damaged").is_dir()
    (tmp_path / "chunk-00000004.npz.damaged").rmdir()
    assert _bytes(tmp_path) == _bytes(plain)


@pytest.mark.parametrize("change", [("w - y", "w - 2*y"), ("2 + x/4", "2 + x/5"), ("[0.25, 0.5, 1]", "[0.25, 0.5]")])
def test_another_system_is_refused_in_a_line(plain, tmp_path, capsys, change):
    (tmp_path / "other.toml").write_text(CHAIN.format(count=30, chunk=10).replace(*change))
    assert main(["sweep", str(tmp_path / "other.toml"), "--out", str(plain)]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "it holds another sweep" in told


def test_a_manifest_with_another_system_is_refused(plain, tmp_path):
    run_sweep(_chain(), tmp_path)
    told = json.loads((tmp_path / "sweep.json").read_text())
    told["sweep"]["system"]["fast"]["y"] = "w - 2*y"
    (tmp_path / "sweep.json").write_text(json.dumps(told))
    with pytest.raises(InputError, match="not the manifest of a sweep, or damaged"):
        [*results(tmp_path)]


def test_how_a_file_is_laid_out_does_not_matter():
    assert _chain().digest == _chain(**{"mu = 1e-3\nk = [0.25, 0.5, 1]": "k = [0.25, 0.5, 1.0]\nmu = 0.001"}).digest
    assert _chain().digest != _chain(**{"w - y": "w - 2*y"}).digest
    assert _chain(**{"[start]": "[start]\n# x, v, w and y"}).digest == _chain().digest


def test_the_summary_labels_its_axes_by_the_names_of_the_states(plain):
    told = summary.summarise(plain)
    assert [*told["quantiles"]] == ["x", "v", "w", "y"]
    lines = sweep_as_text(told).splitlines()
    assert lines[-8].split() == ["quantile", "x", "v", "w", "y"]
    assert [line.split()[0] for line in lines[-7:]] == ["0", "0.05", "0.25", "0.5", "0.75", "0.95", "1"]
    whole = _whole(plain)
    assert told["quantiles"]["w"] == np.quantile(whole["w"], told["probabilities"], method="lower").tolist()


def test_a_summary_fits_a_terminal_of_eighty_characters_and_loses_no_word(monkeypatch):
    names = [f"velocity_zero {k}" for k in range(9)]
    told = {"trajectories": 3, "outcomes": {"followed": 3}, "refused": "",
            "itineraries": {f"stick: {', '.join(names)}": 3},
            "collisions": {k: 1000 + k for k in range(9)}, "probabilities": (0, 0.5, 1),
            "quantiles": {f"theta{k}": (-1.23456789e-05,) * 3 for k in range(9)}}
    wide = sweep_as_text(told)
    assert "collisions (zeros of a velocity): 0 each in 1,000, 1 each in 1,001, " in wide
    monkeypatch.setattr(terminal, "columns", lambda: 80)
    narrow = sweep_as_text(told)
    assert max(map(len, narrow.splitlines())) <= 80 < max(map(len, wide.splitlines()))
    assert {*wide.split()} <= {*narrow.replace(",", " ").split(), *narrow.split()}


RIGID = """
until = 0.5
[system]
mechanism = {mechanism}
contact = "rigid"
{more}
[values]
f = [0.5, 2]
g = 1
l = 1
m = 1
[start]
X = 0
Y = 0.8912073600614353
theta = 1.1
"X'" = -1
"Y'" = 0
"theta'" = 0
"""
OWN = f"[system.mechanism]\n{SLENDER_ROD}"


def test_a_rigid_mechanism_ends_in_no_motion_beyond_the_critical_friction(tmp_path):
    run_sweep(parse_sweep(RIGID.format(mechanism='"painleve_rod"', more="")), tmp_path / "a")
    found = _whole(tmp_path / "a")
    assert [OUTCOMES[k] for k in found["outcome"]] == ["followed", "no motion"]
    assert np.isnan(found["theta"]).tolist() == [False, True]
    own = RIGID.replace("mechanism = {mechanism}\n", "").format(more=OWN)
    run_sweep(parse_sweep(own), tmp_path / "b")
    other = _whole(tmp_path / "b")
    assert found["theta"][0] == pytest.approx(other["theta"][0], rel=1e-12)
    assert other["outcome"].tolist() == found["outcome"].tolist()


def test_the_file_of_a_mechanism_that_is_a_scene_is_a_sweep_too():
    own = RIGID.replace("mechanism = {mechanism}\n", "").format(more=OWN)
    numbers = own[own.index("[values]"):].replace("[start]", "[state]")
    file = f'{SLENDER_ROD}contact = "rigid"\nuntil = 0.5\n{numbers}'
    assert parse_sweep(file).digest == parse_sweep(own).digest
    assert parse_sweep(f'chunk = 1\nname = "rod"\n{file}').chunks == 2
    with pytest.raises(InputError, match="sweep: key 'cuont' is unknown"):
        parse_sweep(f"cuont = 3\n{file}")


def test_an_elastic_mechanism_and_the_catalogue_are_swept_over(tmp_path):
    elastic = RIGID.format(mechanism='"painleve_rod"', more='compliance = "c"\ndamping = "h"').replace(
        'contact = "rigid"', 'contact = "elastic"')
    elastic = elastic.replace("f = [0.5, 2]", "f = 0.5\nc = [1e-2, 1e-3]\nh = 0.5").replace(
        "\"X'\" = -1\n\"Y'\" = 0\n", "x = 0\ny = 0\nz = -1\n").replace("until = 0.5", "until = 0.1")
    named = 'until = 0.1\nsystem = "painleve_rod"\n' + elastic.partition("damping = \"h\"\n")[2]
    for name, text in (("own", elastic), ("named", named)):
        sweep = parse_sweep(text)
        run_sweep(sweep, tmp_path / name)
        _agree(sweep, _whole(tmp_path / name), rel=1e-12)
    one, two = _whole(tmp_path / "own"), _whole(tmp_path / "named")
    assert one["theta"] == pytest.approx(two["theta"], rel=1e-9)


def test_an_elastic_mechanism_is_swept_over_from_coordinates_and_rates_as_its_scenes_start(tmp_path):
    text = RIGID.format(mechanism='"painleve_rod"', more='compliance = "c"\ndamping = "h"').replace(
        'contact = "rigid"', 'contact = "elastic"')
    text = text.replace("f = [0.5, 2]", "f = 2\nc = 1e-3\nh = 0.5").replace("until = 0.5", "until = 0.02")
    sweep = parse_sweep(text.replace("\"X'\" = -1", "\"X'\" = [-1, -0.5]"))
    run_sweep(sweep, tmp_path / "sweep")
    found = _whole(tmp_path / "sweep")
    for row, speed in enumerate((-1, -0.5)):
        (tmp_path / "scene.toml").write_text(text.replace("\"X'\" = -1", f"\"X'\" = {speed}"), encoding="utf-8")
        path = ap.solve(read_scene(tmp_path / "scene.toml"))
        assert [found[name][row] for name in path.names] == pytest.approx(path.final, rel=1e-12)
    with pytest.raises(InputError, match="no value for Y', theta; give all coordinates and rates"):
        parse_sweep(text.replace("\"Y'\" = 0\n", "").replace("theta = 1.1\n", ""))
    falling = text.replace("\"Y'\" = 0", "\"Y'\" = -1")  # its damper pushes already
    with pytest.raises(InputError, match="the start is above the contact"):
        parse_sweep(falling.replace("Y = 0.8912", "Y = 0.8913"))
    above = parse_sweep(falling.replace("Y = 0.8912073600614353", "Y = [0.8912073600614353, 0.9]"))
    run_sweep(above, tmp_path / "above")
    assert [OUTCOMES[k] for k in _whole(tmp_path / "above")["outcome"]] == ["followed", "refused"]


def test_a_start_at_which_a_gap_has_no_value_is_an_outcome_of_its_own_row(tmp_path):
    """The ground is the parabola Y = sqrt(X); left of X = 0 there is none."""
    text = FALLING_BALL.replace('gap = "Y"', 'gap = "Y - sqrt(X)"').replace('"X\'" = 1', '"X\'" = 0')
    text = text.replace("{X = 0, Y = 1", "{X = [1, -1], Y = 4").replace("until = 2", "until = 1")
    run_sweep(parse_sweep(text), tmp_path)
    found = _whole(tmp_path)
    assert [OUTCOMES[k] for k in found["outcome"]] == ["followed", "refused"]
    assert found["Y"][0] == pytest.approx(3.5)
    told = summary.summarise(tmp_path)["refused"]
    assert told.startswith("trajectory 1: an equation of the contact is not finite at X = -1")


@pytest.mark.parametrize(("kinetic", "wrong"), [("1 - a", "[0, 2]"), ("1 + a", "[-2, 0]")])
def test_of_very_many_corners_of_ranges_the_lowest_and_the_highest_are_checked(kinetic, wrong):
    names = "abcdefgh"
    text = f"""until = 1
[system.slow]
v = "F + {"+".join(names)}"
[[system.frictions]]
velocity = "v"
force = "F"
load = 1
kinetic = "{kinetic}"
[start]
v = 1
[values]
""" + "\n".join(f"{name} = [0, 1]" for name in names)
    assert parse_sweep(text).total == 2**8
    with pytest.raises(InputError, match="is negative at a = "):
        parse_sweep(text.replace("a = [0, 1]", f"a = {wrong}"))


def test_a_sweep_may_be_over_a_quantity_on_which_only_the_start_depends(tmp_path):
    """At theta = 0 the reaction x = -g/c starts at (H - Y)/c."""
    text = "until = 0\n" + ON_HIGH_GROUND.format(height="[0, 0.125, 0.25]", centre=0)
    sweep = parse_sweep(text)
    run_sweep(sweep, tmp_path / "sweep")
    assert _whole(tmp_path / "sweep")["x"].tolist() == [0, 1, 2]
    with pytest.raises(InputError, match="U is not a parameter of this system"):
        parse_sweep(text.replace("h = 1", "h = 1\nU = 1"))


RELAY = """
until = [1, 9]
[system.slow]
x = "v"
v = "1/4*F + G"
[[system.frictions]]
velocity = "x"
force = "G"
load = 1
kinetic = 1
[[system.frictions]]
velocity = "v"
force = "F"
load = 1
kinetic = 2
[start]
x = 1
v = 0
"""


def test_events_that_accumulate_are_an_outcome(tmp_path):
    run_sweep(parse_sweep(RELAY), tmp_path)
    found = _whole(tmp_path)
    assert [OUTCOMES[k] for k in found["outcome"]] == ["followed", "events accumulate"]


SLED = """
coordinates = ["X", "Y"]
lagrangian = "(X'^2 + Y'^2)/2 - X^2"
gap = "Y"
slip = "X"
friction = "1/5"
contact = "rigid"
until = 3
[forces]
Y = -1
[state]
X = { grid = [-2, 2], points = 5 }
Y = [0, 1]
"X'" = 0
"Y'" = 0
"""


def test_a_start_off_a_rigid_contact_leaves_the_others_to_the_arrays(monkeypatch):
    """A row without a start sent all rows of its chunk one by one to the scalar flow, seven times as slow."""
    monkeypatch.setattr("asympk.sweep.systems.one_by_one", pytest.fail)
    all_begin, half = (parse_sweep(text) for text in (SLED.replace("[0, 1]", "0"), SLED))
    whole, found = (s.family.follow(s.quantities(0, s.total), s.total, True) for s in (all_begin, half))
    begun = np.arange(half.total) % 2 == 0
    assert [OUTCOMES[k] for k in found.outcome] == ["followed", "refused"] * 5
    assert np.isnan(found.final[:, ~begun]).all()
    for name in ("final", "first"):
        assert np.array_equal(getattr(found, name)[:, begun], getattr(whole, name))
    assert np.array_equal(found.n_events[begun], whole.n_events)
    assert np.array_equal(found.kind, whole.kind)


def test_parameters_that_are_refused_cost_the_others_nothing(tmp_path):
    sweep = _chain(1, 10, **{
        'time = "t"': 'time = "t"\nassumptions = ["k^2 > 1/4"]',
        'kinetic = "k"': 'kinetic = "k^2"', "k + 1/4": "k^2 + 1/4",
        "k = [0.25, 0.5, 1]": "k = { grid = [-1, 1], points = 3 }", "{ uniform = [-2, 2] }": "1",
    })
    run_sweep(sweep, tmp_path)
    found = _whole(tmp_path)
    assert [OUTCOMES[k] for k in found["outcome"]] == ["followed", "refused", "followed"]
    assert np.isnan(found["x"]).tolist() == [False, True, False]
    assert found["itinerary"][1] == 0


@pytest.mark.parametrize("frictions", range(1, 7))
@pytest.mark.parametrize("opens", [False, True])
def test_an_itinerary_in_words_is_what_was_put_into_it(frictions, opens):
    alphabet = Alphabet(frictions, opens)
    random = np.random.default_rng(frictions)
    count = random.integers(0, alphabet.longest + 1, 50)
    first = random.integers(0, 3 + 2 * opens, (frictions, 50)).astype(np.uint8)
    kind = np.array(alphabet.kinds)[random.integers(0, len(alphabet.kinds), count.sum())]
    friction = random.integers(0, frictions, count.sum())
    codes, at = alphabet.codes(first, count, kind, friction), 0
    for row in range(50):
        mine = range(at, at := at + count[row])
        events = ", ".join(f"{kind[k]} {friction[k]}" if frictions > 1 else kind[k] for k in mine)
        phases = "+".join(PHASES[k] for k in first[:, row])
        events += ", ..." * (len(mine) == alphabet.longest)
        assert alphabet.words(codes[row]) == (f"{phases}: {events}" if events else phases)


def test_an_itinerary_that_is_too_long_is_cut_after_its_first_events():
    alphabet, kinds = Alphabet(), np.array(["velocity_zero", "slip_onset"] * 40)
    (code,) = alphabet.codes(np.array([[1]]).astype("u8"), np.array([80]), kinds, np.zeros(80, int))
    assert alphabet.words(code) == f"{PHASES[1]}: {', '.join(kinds[:alphabet.longest])}, ..."
    assert condensed(alphabet.words(code)) == f"{PHASES[1]}: {alphabet.longest // 2} x (velocity_zero, slip_onset), ..."
    assert condensed("open: touch_down 1, touch_down 10, touch_down 10") == "open: touch_down 1, 2 x touch_down 10"
    assert condensed("stick+open, open, open") == "stick+open, 2 x open"
    assert condensed("stick+open, stick+open, stick") == "2 x stick+open, stick"


def test_a_number_that_is_no_itinerary_is_told():
    for alphabet, code in product((Alphabet(), Alphabet(2, True)), (0, 1 << 61, (1 << 62) - 1)):
        if alphabet == Alphabet() and code == (1 << 62) - 1:
            assert alphabet.words(code).startswith("stick: slip_onset")
            continue
        with pytest.raises((ValueError, IndexError)):
            alphabet.words(code)


HOSTILE = ["__import__('os').system('touch evaluated')", "9**9**9", "1e99999999", "1/0", "lambda: 0", "x" * 100_000,
           "(" * 500, "nan", "x; y", ""]


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
@pytest.mark.parametrize("place", ["w - y", "2 + x/4", "k + 1/4", '[0.25, 0.5, 1]', "1e-3", "{{ uniform = [-2, 2] }}"])
@pytest.mark.few(4)
def test_a_hostile_string_is_refused_at_once_in_one_line(tmp_path, monkeypatch, place, text):
    monkeypatch.chdir(tmp_path)
    put = text if place in ("w - y", "2 + x/4", "k + 1/4") else json.dumps(text)
    begin = time.process_time()
    with pytest.raises(AsympkError) as refusal:
        parse_sweep(CHAIN.replace(place, put.replace("{", "{{")).format(count=1, chunk=1))
    assert time.process_time() - begin < 2
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 400
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("k = [0.25, 0.5, 1]", "kk = 1"), "the name k is unknown; did you mean kk"),
        (("mu = 1e-3", "mu = 1e-3\nq = 1"), "q is not a parameter of this system"),
        (("w = 0\n", ""), "start: the state w is missing"),
        (("w = 0\ny = 0.5\n", ""), "start: the states w, y are missing; give numbers for x, "),
        (("y = 0.5", "yy = 0.5\ny = 1"), "yy is not a state of this system"),
        (("mu = 1e-3", "mu = 0"), "mu = 0 is refused"),
        (("mu = 1e-3", "mu = {{ uniform = [-1, 1] }}"), "mu = -1 is refused"),
        (("[0.25, 0.5, 1]", "[-1, 1]"), "kinetic friction k is negative at k = -1; friction"),
        (("until = 5", "until = -1"), "until reaches -1"),
        (("seed = 3\ncount = {count}", ""), "seed and count must be given"),
        (("[-2, 2]", "[2, -2]"), "must grow"),
        (("until = 5", "until = 5\nsigma = 1"), "sigma is the rod's"),
        (('kinetic = "k"', 'kinetic = "k"\nkinetik = 1'), "nearest known one is 'kinetic'"),
        (('small = "mu"', 'small = "mu"\nmechanism = "painleve_rod"'), "key 'small' is unknown"),
        (("[start]", "[strat]"), "key 'strat' is unknown"),
        (('"w - y"', "true"), "the rate of y = True"),
        (("k + 1/4", "k - 1/4"), "below the kinetic one"),
    ],
)
def test_what_is_not_a_sweep_over_a_system_is_refused_by_name(change, said):
    assert change[0] in CHAIN
    with pytest.raises(AsympkError) as refusal:
        parse_sweep(CHAIN.replace(*change).format(count=5, chunk=5))
    assert said in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("system", "said"),
    [
        ('system = "painleve_rdo"', "the nearest is 'painleve_rod'"),
        ("system = 3", "system = 3: it must be a table, [system]"),
        ("", "system missing"),
        ('[system]\nmechanism = "none"\ncontact = "rigid"', "mechanism 'none' is unknown"),
        ('[system]\nmechanism = "painleve_rod"\ncontact = "soft"', 'contact must be "rigid", or "elastic"'),
        ('[system]\nmechanism = "painleve_rod"\ncontact = "elastic"', "with compliance and damping"),
        ('[system.slow]\nuntil = "1"', "until is a name that a sweep uses itself"),
        ('[system.slow]\noutcome = "1"', "outcome is a name that a sweep uses itself"),
    ],
)
def test_what_is_no_system_is_refused_by_name(system, said):
    with pytest.raises(AsympkError) as refusal:
        parse_sweep(f"until = 1\n{system}\n[values]\n[start]\n")
    assert said in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(("opens", "most"), [(False, 10), (True, 9)])
def test_itineraries_fit_as_long_as_one_event_is_left_room_for(opens, most):
    assert Alphabet(most, opens).longest >= 1
    with pytest.raises(InputError, match=f"itineraries of {most + 1} frictions do not fit"):
        _ = Alphabet(most + 1, opens).longest


@pytest.mark.slow
def test_itineraries_that_do_not_fit_are_refused_unless_they_are_not_asked_for():
    start = "".join(f"v{k} = 1\n" for k in range(14))
    text = f"until = 1\n{sliding_blocks(14)}[start]\n{start}"
    with pytest.raises(InputError, match="itineraries of 14 frictions do not fit; set itineraries = false"):
        parse_sweep(text)
    assert parse_sweep("itineraries = false\n" + text).total == 1


@pytest.mark.slow
def test_the_picture_of_a_summary_names_every_state_and_is_legible(plain, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    from legibility import flaws

    from asympk.pictures.spread import plot

    figure = plot(summary.summarise(plain))
    assert [panel.get_ylabel() for panel in figure.axes] == ["x", "v", "w", "y", "itineraries"]
    assert flaws(figure) == []
    (tmp_path / "chain.toml").write_text(CHAIN.format(count=30, chunk=10))
    assert main(["sweep", str(tmp_path / "chain.toml"), "--out", str(plain), "--plot", str(tmp_path / "a.svg")]) == 0
    assert (tmp_path / "a.svg").read_text().startswith("<?xml")
    assert main(["sweep", "absent.toml", "--out", "o", "--plot", "a.gif"]) == 2
    assert ".pdf, .svg, .png" in capsys.readouterr().err


def test_quantiles_of_many_digits_have_ticks_that_can_be_told_apart():
    pytest.importorskip("matplotlib")
    from legibility import flaws

    from asympk.pictures.spread import plot

    ends = (0.895462, 0.895462, 0.895462, 0.895462, 0.895462, 0.895462, 0.895853)
    told = {"quantiles": {"Y": ends}, "probabilities": (0, 0.05, 0.25, 0.5, 0.75, 0.95, 1), "itineraries": {},
            "outcomes": {}}
    assert flaws(plot(told)) == []


def test_a_sweep_in_which_nothing_is_followed_is_summed_up_and_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    from asympk.pictures.spread import plot

    run_sweep(parse_sweep(RIGID.format(mechanism='"painleve_rod"', more="").replace("[0.5, 2]", "2")), tmp_path)
    told = summary.summarise(tmp_path)
    assert (told["outcomes"], told["quantiles"]["theta'"]) == ({"no motion": 1}, [])
    assert sweep_as_text(told) == "1 trajectory: 1 no motion"
    (panel,) = plot(told).axes
    assert [words.get_text() for words in panel.texts] == ["not followed: no motion"]


def test_of_trajectories_that_are_refused_the_first_is_said_to_be_so_and_why(tmp_path):
    text = """
        system = {mechanism = "painleve_klein", contact = "rigid"}
        values = {alpha = 1, P = 1, m = 1, f = 0.2, f_0 = 0.5}
        start = {x1 = [0, 0.3], x2 = 0, "x1'" = 0.5, "x2'" = 0.5}
        until = 2
    """
    run_sweep(parse_sweep(text), tmp_path)
    told = summary.summarise(tmp_path)
    assert told["outcomes"] == {"followed": 1, "refused": 1}
    assert told["refused"].startswith("trajectory 1: the start is off the constraint: g = -0.162")
    assert sweep_as_text(told).splitlines()[1].startswith("refused, first of them trajectory 1: the start is off")


@pytest.mark.parametrize(
    ("kinetic", "x", "outcome"),
    [("k*sqrt(x)", -1, "a rate is not finite"), ("k/x", 0, "a rate is not finite"),
     ("k*log(x)", -1, "a rate is not finite"), ("k*x**0.5", 0, "followed")],
)
def test_a_start_where_a_formula_has_no_value_is_an_outcome_unless_it_is_not_used(tmp_path, kinetic, x, outcome):
    """The belt carries the block, and its kinetic friction, whose slope is infinite at x = 0, does not count."""
    text = BELT.format(until=1, k=0.5, k0=50, x=[x, 1]).replace("k / (1 + abs(v - 1))", kinetic)
    run_sweep(parse_sweep(text), tmp_path)
    found = _whole(tmp_path)
    assert [OUTCOMES[k] for k in found["outcome"]] == [outcome, "followed"]
    assert found["v"].tolist() == pytest.approx([1 if outcome == "followed" else np.nan, 1], nan_ok=True)


def test_a_grid_between_irrational_numbers_takes_few_digits_of_the_manifest_and_a_time_no_degrees():
    text = """
        until = %s
        start = {x = {grid = ["-sqrt(2)", "2*pi"], points = 1000}, v = 0}
        [system.slow]
        x = "v"
        v = "-x"
    """
    sweep = parse_sweep(text % 1)
    values = sweep.axes["x"].values
    assert [float(values[0]), float(values[-1])] == [-math.sqrt(2), 2 * math.pi]
    assert len(json.dumps(sweep.described())) < 300 * len(values)
    assert from_description(sweep.described()) == sweep
    with pytest.raises(InputError, match="until = '60 deg'"):
        parse_sweep(text % '"60 deg"')
