"""Progress: nothing of a short job, a line on a terminal, one now and then in a log, none where none is wanted."""

import os
import pty
import re
import subprocess
import sys
import time

import pytest

from asympk.output.meter import Meter, duration


class Screen:
    def __init__(self, live):
        self.live, self.text = live, ""

    def isatty(self):
        return self.live

    def write(self, text):
        self.text += text

    def flush(self):
        pass


class Hours:
    """A clock that is set by hand."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.mark.parametrize("live", [True, False])
def test_a_job_of_two_seconds_shows_nothing(live):
    screen, clock = Screen(live), Hours()
    with Meter(screen, log=True, clock=clock) as meter:
        meter.tell("one")
        meter.tick()
        clock.now += 1.9
        meter.tick()
    assert screen.text == ""


def test_a_longer_job_is_one_line_on_a_terminal_that_is_cleared():
    screen, clock = Screen(True), Hours()
    meter = Meter(screen, clock=clock)
    for words, elapsed in (("one", 2), ("one", 0), ("two", 3)):
        meter.tell(words)
        clock.now += elapsed
        meter.tick()
    meter.tell("")
    assert screen.text == "\r\033[Kone, 2 s\r\033[Ktwo, 5 s\r\033[K"


def test_progress_tells_rate_and_remaining_time_of_fresh_work_alone():
    screen, clock = Screen(True), Hours()
    meter = Meter(screen, 10_000, clock=clock)
    meter.add(4000, fresh=False)
    clock.now += 2
    meter.add(1000)
    meter.tick()
    assert screen.text.endswith("5,000 of 10,000 trajectories, 500 per second, 10 s left")


def test_in_a_log_progress_is_a_line_now_and_then():
    screen, clock = Screen(False), Hours()
    meter = Meter(screen, 10_000, log=True, clock=clock)
    for _ in range(200):
        clock.now += 1
        meter.add(10)
        meter.tick()
    meter.tell("")
    assert screen.text.count("\n") == 3
    assert "\r" not in screen.text


def test_what_is_no_terminal_and_no_log_is_told_nothing():
    screen, clock = Screen(False), Hours()
    meter = Meter(screen, clock=clock)
    meter.tell("one")
    clock.now += 1000
    meter.tick()
    assert screen.text == ""


def test_setting_the_time_of_day_changes_no_progress(monkeypatch):
    meter = Meter(Screen(True), 10)
    monkeypatch.setattr(time, "time", lambda: -1e9)
    meter.add(5)
    assert "-" not in meter.line(time.monotonic())


def test_a_full_disk_under_the_log_stops_no_work():
    with open("/dev/full", "w") as full:
        clock = Hours()
        meter = Meter(full, 10, log=True, clock=clock)
        meter.add(5)
        clock.now += 100
        meter.tick()
        with pytest.raises(OSError, match="No space"):
            full.flush()
        os.dup2(os.open(os.devnull, os.O_WRONLY), full.fileno())


@pytest.mark.parametrize(("seconds", "words"), [(7.4, "7 s"), (125, "2 min 5 s"), (12000, "3 h 20 min"), (0, "0 s")])
def test_durations_in_words(seconds, words):
    assert duration(seconds) == words


@pytest.mark.slow
def test_a_job_that_says_nothing_more_is_shown_on_a_terminal_while_it_lasts_and_then_cleared():
    code = """
import sys, time
from asympk.output.meter import Meter
with Meter(sys.stderr) as meter:
    meter.tell('waiting')
    time.sleep(4.4)
print('done')
"""
    leader, follower = pty.openpty()
    subprocess.run([sys.executable, "-c", code], stdout=follower, stderr=follower, check=True)
    told = os.read(leader, 10_000).decode()
    os.close(leader)
    os.close(follower)
    seconds = [int(number) for number in re.findall(r"waiting, (\d+) s", told)]
    assert len(seconds) >= 2
    assert sorted({*seconds}) == seconds
    assert min(seconds) >= 2
    assert told.endswith("\r\x1b[Kdone\r\n")
