"""The benchmark prints a line per measurement; what it measures is not judged here."""

from time import sleep

from asympk.studies import bench


def test_each_line_is_printed_with_its_label(capsys):
    assert bench.main([("one", lambda: "1 us"), ("two", lambda: "2 us")]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first.split() == ["one", "1", "us"]
    assert second.split() == ["two", "2", "us"]


def test_a_median_is_taken_over_enough_calls():
    calls = []
    assert bench.median_seconds(lambda: calls.append(1), least=7, budget=0) >= 0
    assert len(calls) == 7


def test_a_long_call_is_timed_once_and_a_short_one_no_more_than_is_asked():
    calls = []
    bench.median_seconds(lambda: (calls.append(1), sleep(0.01)), least=1, budget=0.005, most=5)
    assert len(calls) == 1
    bench.median_seconds(lambda: calls.append(1), least=1, budget=10, most=5)
    assert len(calls) == 6


def test_a_scalar_line_tells_time_error_and_ratios():
    text = bench.scalar("ii", 1e-2)
    assert "us, error" in text
    assert "LSODA" in text
