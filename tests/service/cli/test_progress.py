"""Tests of progress without a terminal: plain lines on standard error only."""

from posefield.console.progress import ProgressBar


def test_a_line_says_how_much_is_finished(capsys):
    with ProgressBar("clips", 1000, 250, interval=0.0) as bar:
        bar.update(260)
        bar.advance(5)
    out, err = capsys.readouterr()
    first, second = err.splitlines()
    assert out == ""
    assert first == "clips: 260 of 1000"
    assert second.startswith("clips: 265 of 1000, ")
    assert second.endswith(" left") and " a second, " in second


def test_the_total_may_be_known_late(capsys):
    with ProgressBar("truth", interval=0.0) as bar:
        bar.update(1, 4)
        bar.update(4, 4)
    assert capsys.readouterr().err.splitlines()[0] == "truth: 1 of 4"


def test_lines_are_some_seconds_apart(capsys):
    """Negative control of `interval`: a thousand updates at once write nothing."""
    with ProgressBar("clips", 1000) as bar:
        for _ in range(1000):
            bar.advance(1)
    assert capsys.readouterr().err == ""


def test_no_control_sequences_are_written_for_colours(capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    with ProgressBar("clips", 10, interval=0.0) as bar:
        bar.print("[a] note at 7 of 10")
        bar.update(5)
    assert capsys.readouterr().err.splitlines() == ["[a] note at 7 of 10", "clips: 5 of 10"]
