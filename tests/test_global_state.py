"""No call changes what a second thread can see: mpmath's precision, the mask of new files, the numbers it gets."""

import os
import subprocess
import sys
import threading

import mpmath
import pytest
import sympy as sp
from mpmath.ctx_mp_python import PythonMPContext

import asympk as ap
from asympk.certify import certify
from asympk.ledger import claims
from asympk.scenes import scenefile
from asympk.storage.files import write_text
from asympk.studies import convergence, divide
from asympk.systems import painleve_klein as pk

X = sp.Symbol("x")
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
    found = scenefile.load(tmp_path / "rod.toml")
    return ap.solve(found.scene, digits=30).physical()


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
    "convergence": lambda _: convergence.rows(sigmas=("1",), mus=("1e-2", "1e-3"), orders=(0, 1)),
    "claims": lambda _: claims(),
}


@pytest.mark.parametrize("call", CALLS)
def test_mpmaths_own_precision_is_never_set(call, tmp_path, monkeypatch):
    set_, set_digits = [], []
    for name, log in (("prec", set_), ("dps", set_digits)):
        kept = getattr(PythonMPContext, name)

        def put(context, value, kept=kept, log=log):
            if context is mpmath.mp:
                log.append(value)
            kept.fset(context, value)

        monkeypatch.setattr(PythonMPContext, name, property(kept.fget, put))
    CALLS[call](tmp_path)
    assert not set_
    assert not set_digits


def test_what_units_and_digits_give_does_not_depend_on_the_precision_of_the_user(tmp_path):
    expected, told = _physical(tmp_path), scenefile.load(tmp_path / "rod.toml")
    with mpmath.workdps(8):
        assert scenefile.load(tmp_path / "rod.toml") == told
        assert _physical(tmp_path).final == expected.final


IN_THREADS = """
import sys, threading
import mpmath
import asympk as ap
from asympk.scenes import scenefile

found, wrong = [], []

def work(k):
    for _ in range(12):
        scene = scenefile.load(sys.argv[1]).scene
        found.append((scene, ap.solve(scene, digits=25 + 20 * (k % 3)).modes, mpmath.mp.prec))

threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print(len(found), len(set(found)), mpmath.mp.prec)
"""


def test_many_threads_from_a_cold_start_read_the_same_scene(tmp_path):
    (tmp_path / "rod.toml").write_text(PHYSICAL)
    command = [sys.executable, "-c", IN_THREADS, str(tmp_path / "rod.toml")]
    for _ in range(3):
        assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() == ["72", "1", "53"]


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


def test_writing_a_file_asks_nothing_of_the_process_mask(tmp_path, monkeypatch):
    before = os.umask(0o027)
    try:
        monkeypatch.setattr(os, "umask", None)
        assert write_text(tmp_path / "a.txt", "a").stat().st_mode & 0o777 == 0o640
    finally:
        monkeypatch.undo()
        os.umask(before)
