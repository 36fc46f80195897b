"""Tests of progress without a terminal: plain lines on standard error only."""

import re
import time

from posefield.console.output import LateProgress
from posefield.console.progress import ProgressBar
from posefield_train.cli.output_files import ProgressPrinter


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


def test_lines_are_some_seconds_apart_and_short_work_shows_nothing(capsys):
    """Negative control of `interval`: a thousand updates at once write nothing."""
    with ProgressBar("clips", 1000) as bar, LateProgress("points") as late:
        for _ in range(1000):
            bar.advance(1)
        assert [*late.count("abc")] == ["a", "b", "c"]
        late.update(3, 3)
    assert capsys.readouterr().err == ""


def test_progress_of_steps_estimates_the_rest_by_the_finished_ones(capsys):
    with ProgressPrinter("training", 3) as progress:
        progress("reading")
        time.sleep(0.05)
        progress.expect([1e-4, 0.2, 0.3])
        progress("fitting")
        progress("done")
    said = [line[10:] for line in capsys.readouterr().err.splitlines()]
    assert said[0] == "reading"
    # At least 500 times 0.05 s of ours are as many times the 0.1 ms expected.
    left = re.fullmatch(r"fitting \(about (\d+) (s|min) left\)", said[1])
    assert left is not None
    assert int(left[1]) * (60 if left[2] == "min" else 1) >= 120
    assert said[2] == "done"


def test_a_rest_of_a_few_seconds_is_not_told(capsys):
    with ProgressPrinter("training", 2) as progress:
        progress("reading")
        progress.expect([10.0, 1.0])
        progress("writing")
    assert "left" not in capsys.readouterr().err
