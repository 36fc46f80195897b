"""Tests of comparisons with equal information: standard errors over takes, verdicts and rivals."""

import numpy as np
import pytest
from evaluation import equal_information

from posefield_train.evaluate import summary
from posefield_train.evaluate.motion_errors import DistanceStatistics, MotionErrors
from posefield_train.evaluate.protocol import EvaluationResult

TAKES = (0, 0, 0, 1, 1, 2, 2, 3)


def error(relative, duration=0.0, effector=0.01):
    own = DistanceStatistics(relative, relative, relative, relative, relative)
    ends, squares = np.ones(2), np.full(2, relative**2)
    return MotionErrors(*[own] * 5, effector, 1.0, 1.0, ends, ends, 0.0, 0.0, duration, squares)


def result(rows, takes=TAKES):
    """Result with relative errors of some methods by clip, m."""
    names = tuple(map(str, range(len(takes))))
    errors = {name: tuple(map(error, row)) for name, row in rows.items()}
    sigma = np.ones(len(takes))
    return EvaluationResult(
        "tiny", "leave_one_clip_out", names, errors, sigma, sigma[:, None], ("Hips",), takes
    )


OURS = np.linspace(0.01, 0.02, len(TAKES))


@pytest.mark.parametrize(
    ("shift", "verdict"),
    [
        (0.01, equal_information.BETTER),
        (0.0, equal_information.WITHIN),
        (-0.01, equal_information.WORSE),
    ],
)
def test_the_verdict_follows_the_paired_difference(rng, shift, verdict):
    noise = 0.001 * rng.standard_normal(len(TAKES))
    found = result({"posefield": OURS, "gp": OURS + shift + noise - noise.mean()})
    one = equal_information.compare(found, "relative", "posefield", "gp")
    assert one["verdict"] == verdict
    assert one["difference"] == pytest.approx(100 * shift, abs=1e-9)
    expected = summary.clustered_standard_error(noise, np.array(TAKES))
    assert one["standard_error"] == pytest.approx(100 * expected)


def test_rivals_have_the_information_of_posefield():
    rows = {
        name: OURS + shift
        for name, shift in (
            ("posefield", 0.0),
            ("posefield_exact", 0.0),
            ("posefield_no_performer", 0.02),
            ("gp", 0.002),
            ("gp_no_performer", 0.03),
            ("mean", 0.05),
            ("mean_no_performer", 0.06),
        )
    }
    found = equal_information.facts(result(rows))
    assert found["known"]["posefield"] == "posefield"
    # Peers without the performer are in the table with performers, too.
    assert set(found["known"]["peers"]) == {
        "gp", "gp_no_performer", "mean", "mean_no_performer"
    }  # fmt: skip
    assert found["open"]["posefield"] == "posefield_no_performer"
    assert set(found["open"]["peers"]) == {"gp_no_performer", "mean_no_performer"}
    assert found["known"]["best"]["relative"]["peer"] == "gp"
    assert found["open"]["best"]["relative"]["difference"] == pytest.approx(1.0)
    assert found["known"]["takes"] == 4
