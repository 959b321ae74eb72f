"""The benchmark prints a line per measurement; what it measures is not judged here."""

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


def test_a_scalar_line_tells_time_error_and_ratios():
    text = bench.scalar("ii", 1e-2)
    assert "us, error" in text
    assert "LSODA" in text
