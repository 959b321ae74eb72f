"""Ctrl-C at any line of the writing and the reading of a chunk's file is heard, once, and as nothing else."""

import gc
import signal
import sys

import numpy as np
import pytest

from asympk.sweep import stored

COLUMNS = {"x": np.arange(3.0)}


def _interrupted_at(line, work):
    """Call ``work`` with Ctrl-C at one of its lines; tell whether it came to that line."""
    passed = 0

    def trace(frame, event, argument):
        nonlocal passed
        passed += event == "line"
        if passed == line and event == "line":
            signal.raise_signal(signal.SIGINT)
        return trace

    sys.settrace(trace)
    try:
        work()
    finally:
        sys.settrace(None)
    return passed >= line


@pytest.fixture
def unraised(monkeypatch):
    """What Python could only print because nobody was there to catch it; Ctrl-C is heard during the test."""
    found = []
    monkeypatch.setattr(sys, "unraisablehook", lambda what: found.append(what.exc_value))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield found
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("kind", ["writing", "reading"])
@pytest.mark.few(0)
def test_an_interruption_at_any_line_stays_one(tmp_path, unraised, kind):
    path = tmp_path / "chunk.npz"
    path.write_bytes(stored.content(COLUMNS, {}, "npz"))
    work = {"writing": lambda: stored.content(COLUMNS, {}, "npz"), "reading": lambda: stored.load_arrays(path)}[kind]
    line, heard = 1, 0
    while True:
        try:
            if not _interrupted_at(line, work):
                break
        except KeyboardInterrupt:
            heard += 1
        line += 7
    gc.collect()
    assert heard == (line - 1) // 7 > 20
    assert unraised == []
