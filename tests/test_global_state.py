"""No call changes what a second thread can see: mpmath's precision, the mask of new files, the numbers it gets."""

import decimal
import locale
import os
import pickle
import random
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import mpmath
import numpy as np
import pytest
import sympy as sp
from precision import precisions_set
from sweeptext import parse_sweep

import asympk as ap
from asympk import sweep
from asympk.automaton.automaton import Automaton
from asympk.certify import certify, cover
from asympk.scenes import scenefile
from asympk.studies import convergence, divide
from asympk.systems import painleve_klein as pk

flint = pytest.importorskip("flint")

X, V, F = sp.symbols("x v F", real=True)
BLOCK = ap.System.with_frictions(
    {X: V, V: -X + F}, {}, [ap.Friction(velocity=V, force=F, load=1, kinetic=sp.Rational(1, 4))])
OSCILLATOR = ap.Scene(system=BLOCK, values={}, start={"x": 2, "v": 0}, until=5)
SWEEP = """seed = 1
count = 40
chunk = 20
sigma = 1
mu = 1e-3
start = [{ uniform = [-1, 1] }, 0.2, { uniform = [-1, 1] }]
until = 5
"""
PHYSICAL = """m = 1
P = 10
f = 3
alpha = "60 deg"
l = 1
k = 1e6
h = 0.01
start = [0, 0, -1]
until = 0.5
"""


def _physical(tmp_path):
    (tmp_path / "rod.toml").write_text(PHYSICAL)
    found = scenefile.read_scene(tmp_path / "rod.toml")
    return ap.solve(found, digits=30).physical()


CALLS = {
    "a physical scene": _physical,
    "digits": lambda _: ap.solve(ap.read_scene("backward"), digits=60)(1),
    "a model with digits": lambda _: ap.solve(ap.read_scene("backward"), "jump", digits=20)(1),
    "a lowered function": lambda _: ap.lower((X,), sp.LambertW(X) + sp.gamma(X) + sp.tan(X), "mpmath")("3.1"),
    "least_model": lambda _: ap.least_model(ap.read_scene("backward")),
    "certify": lambda _: certify(ap.read_scene("backward")),
    "eigenvalues": lambda _: [one.kind(sigma=1, mu="1/100") for one in ap.eigenvalues(pk.system())],
    "manifolds": lambda _: [one.at(sigma="1/2").stability for one in ap.slow_manifolds(pk.system(), order=3)],
    "regions": lambda _: ap.stick_regions(pk.system()).stick.contains("1/4", sigma=1),
    "jump_map": lambda _: ap.jump_map(pk.system(), order=2).x,
    "escapes": lambda _: divide.escapes(1, "1e-3", "1/3", 1, ["1e-12", "0"]),
    "convergence": lambda _: convergence.rows(sigmas=("1",), mus=("1e-2",)),
}


def _longest_as_slow(calls):
    return [pytest.param(call, marks=pytest.mark.slow) if call == "convergence" else call for call in calls]


@pytest.mark.parametrize("call", _longest_as_slow(CALLS))
@pytest.mark.few(1)
def test_mpmaths_own_precision_is_never_set(call, tmp_path):
    with precisions_set() as found:
        CALLS[call](tmp_path)
    assert not found


def test_setting_mpmaths_own_precision_is_seen():
    with precisions_set() as found, mpmath.workdps(8):
        pass
    assert found


def test_what_units_and_digits_give_does_not_depend_on_the_precision_of_the_user(tmp_path):
    expected, told = _physical(tmp_path), scenefile.read_scene(tmp_path / "rod.toml")
    with mpmath.workdps(8):
        assert scenefile.read_scene(tmp_path / "rod.toml") == told
        assert _physical(tmp_path).final == expected.final


IN_THREADS = """
import sys, threading
import mpmath
import asympk as ap
from asympk.scenes import scenefile

found, wrong = [], []

def work(k):
    for _ in range(3):
        scene = scenefile.read_scene(sys.argv[1])
        found.append((scene, ap.solve(scene, digits=25 + 20 * (k % 3)).modes, mpmath.mp.prec))

threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print(len(found), len(set(found)), mpmath.mp.prec)
"""


@pytest.mark.further
def test_many_threads_from_a_cold_start_read_the_same_scene(tmp_path):
    (tmp_path / "rod.toml").write_text(PHYSICAL)
    command = [sys.executable, "-c", IN_THREADS, str(tmp_path / "rod.toml")]
    for _ in range(3):
        assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() == ["18", "1", "53"]


def test_lowered_functions_of_many_threads_keep_to_their_own_digits():
    f = ap.lower((X,), sp.exp(X) * sp.pi + sp.sqrt(X), "mpmath")
    exact = {digits: f.to_digits(digits, "1/3") for digits in (10, 30, 300)}
    wrong = []

    def work(digits):
        wrong.extend(1 for _ in range(300) if f.to_digits(digits, "1/3") != exact[digits])

    threads = [threading.Thread(target=work, args=(digits,)) for digits in exact for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def seen():
    """Return what every thread of a process shares and no function of a library may change, not even for a while.

    Ctrl-C is not among it: it waits while a chunk's file is written, and the main thread alone hears it.
    """
    handlers = tuple(signal.getsignal(number) for number in signal.valid_signals() - {signal.SIGINT})
    settings = sys.getrecursionlimit(), sys.get_int_max_str_digits(), os.getcwd(), dict(os.environ)
    chances = random.getstate(), tuple(np.random.get_state(legacy=False)["state"]["key"])
    return mpmath.mp.prec, locale.setlocale(locale.LC_ALL), handlers, settings, chances


def kept_by_a_thread():
    """Return what a thread sees that belongs to threads, or that it alone hears."""
    return np.geterr(), decimal.getcontext().prec, signal.getsignal(signal.SIGINT)


WALK = CALLS | {
    "exact": lambda _: ap.solve(ap.read_scene("backward"))([0, 1]),
    "rows": lambda _: ap.solve_many(1, 1e-3, np.linspace(-1, 1, 30), 0.2, np.linspace(-1, 1, 30), 5).events(),
    "models of rows": lambda _: ap.solve_many(1, 1e-3, 0, 0.2, [-1, 1], 5, method="jump", order=1).error,
    "lsoda": lambda _: ap.solve(ap.read_scene("backward"), "lsoda")([0, 1]),
    "affine": lambda _: ap.solve(OSCILLATOR, digits=20)(1),
    "affine rows": lambda _: ap.solve_many(system=OSCILLATOR.system, start={"x": [1, 2], "v": 0}, until=2).final,
    "cover": lambda _: cover(ap.read_scene("backward"), {"mu": ("1e-3", "2e-3")}, 4),
    "picture": lambda path: ap.solve(ap.read_scene("backward")).plot(path / "a.svg"),
    "table": lambda path: ap.solve(ap.read_scene("backward")).to_csv(path / "a.csv"),
    "sweep": lambda path: sweep.run_sweep(parse_sweep(SWEEP), path / "out"),
    "mechanism": lambda _: ap.systems.painleve_rod.mechanism().paradox,
}


@pytest.mark.parametrize("call", _longest_as_slow(WALK))
@pytest.mark.few(4)
def test_a_second_thread_sees_nothing_of_the_process_change(call, tmp_path):
    before, own, told, done = seen(), kept_by_a_thread(), [], threading.Event()

    def watch():
        while not done.wait(1e-4):
            told.append(seen() == before)

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        WALK[call](tmp_path)
    finally:
        done.set()
        watcher.join()
    assert all(told)
    assert (seen(), kept_by_a_thread()) == (before, own)


def test_the_precision_of_balls_is_put_back_whichever_thread_ends_first():
    bits = flint.ctx.prec
    scenes = [ap.read_scene("backward"), ap.Scene(1, "1e-2", (0, 0, 1), 2)] * 3
    expected = [certify(scene, digits=30 * (k % 3 + 1)) for k, scene in enumerate(scenes)]
    with ThreadPoolExecutor(6) as threads:
        found = list(threads.map(lambda k: certify(scenes[k], digits=30 * (k % 3 + 1)), range(6)))
    assert [one.bits for one in found] == [one.bits for one in expected]
    assert flint.ctx.prec == bits


def test_a_system_and_its_automaton_have_the_hash_of_the_process_that_loads_them(tmp_path):
    """The hash of a string differs from process to process, and with it that of a symbol."""
    made = ("import dataclasses, pickle, sys; found = pickle.load(open(sys.argv[1], 'rb')); "
            "copies = [*map(dataclasses.replace, found)]; [*map(hash, copies)]; "
            "pickle.dump(copies, open(sys.argv[1], 'wb'))")
    known = BLOCK, Automaton.at(BLOCK, ())
    (tmp_path / "found").write_bytes(pickle.dumps(known))
    subprocess.run([sys.executable, "-c", made, tmp_path / "found"], check=True)
    found = pickle.loads((tmp_path / "found").read_bytes())
    assert found == [*known]
    assert [*map(hash, found)] == [*map(hash, known)]
