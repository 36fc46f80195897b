"""Errors of curves in an evaluation: in their own unit, with and without a skeleton."""

from dataclasses import replace

import expressions
import numpy as np
import pytest
from families import face_motion
from joblib import parallel_config

from posefield.motion.curves import distances
from posefield_train.evaluate import motion_errors, protocol, summary
from posefield_train.evaluate.summary import NOT_APPLICABLE
from posefield_train.jobs import ProcessJobs
from posefield_train.source import curve_files, ingest

JOBS = ProcessJobs(1)


@pytest.fixture(scope="module", autouse=True)
def _sequential():
    """Run joblib's jobs here: starting its processes takes longer."""
    with parallel_config(backend="sequential"):
        yield


@pytest.fixture(scope="module", params=[False, True], ids=["head", "alone"])
def alone(request):
    return request.param


@pytest.fixture(scope="module")
def family(alone, tmp_path_factory):
    folder = expressions.write(tmp_path_factory.mktemp("faces"))
    return ingest.ingest(expressions.recipe(alone), folder)[0]


@pytest.fixture(scope="module")
def result(family, alone):
    recipe = expressions.recipe(alone)
    return protocol.run_protocol(recipe, family, "performer", JOBS, lambda *_: None)


def resting(values):
    """A clip of curves alone, as it is compared."""
    own = face_motion.expression(0.5, 0.5).curves
    clip = curve_files.resting_clip(replace(own, values=values), 60.0)
    return motion_errors.motion_of_clip(clip, None)


def smooth(shares):
    """Curves that rise one after the other, at shares of the clip."""
    starts = np.linspace(0.0, 0.5, len(face_motion.CURVE_NAMES))
    return 0.2 + 0.5 * np.clip((shares[:, None] - starts) / 0.4, 0.0, 1.0)


SHARES = np.linspace(0.0, 1.0, 121)


def test_a_curve_that_is_off_by_a_constant_is_off_by_that():
    true, off = smooth(SHARES), np.zeros(len(face_motion.CURVE_NAMES))
    off[3] = 0.05
    # A constant is no difference of timing: warping cannot take all of it away.
    found = motion_errors.compare_motions(resting(true + off), resting(true), ())
    errors = np.sqrt(found.curves)
    assert errors[3] == pytest.approx(0.05, rel=0.1)
    assert np.delete(errors, 3).max() < 0.01
    own = face_motion.expression(0.5, 0.5).curves
    assert found.counted == pytest.approx(found.curves * np.square(distances(own.curves)))
    # Sigma predicts the error over the joint that rests and all curves.
    assert found.mean_squared_error == pytest.approx(found.counted.sum() / 12)
    assert motion_errors.compare_motions(resting(true), resting(true), ()).curves.max() < 1e-30


def test_curves_that_differ_in_timing_alone_are_near():
    """Curves take part in the time warping, as they do in training."""
    late = SHARES**1.3
    found = motion_errors.compare_motions(resting(smooth(late)), resting(smooth(SHARES)), ())
    unwarped = np.sqrt(np.mean(np.square(smooth(late) - smooth(SHARES))))
    assert np.sqrt(found.curves.mean()) < 0.15 * unwarped
    assert unwarped > 0.05


def test_measures_of_positions_are_not_applicable_without_a_skeleton(result, alone):
    facts = summary.facts(result)
    heads = [title for title, _ in summary.columns(result)]
    rows = summary.table(result).split("\n\n")[1].splitlines()[2:]
    for line, one in zip(rows, summary.summarize(result), strict=True):
        cells = dict(zip(heads, map(str.strip, line.split("|")[1:-1]), strict=True))
        assert float(cells["curves"]) == pytest.approx(100.0 * one.curve_distance, abs=6e-4)
        assert cells["duration"].endswith("%")
        assert (cells["relative"] == cells["accel."] == NOT_APPLICABLE) == alone
        figures = facts["methods"][one.name]
        assert (figures["relative_cm"] is None) == (figures["distances_cm"] is None) == alone
        assert figures["curves"].keys() == set(face_motion.CURVE_NAMES)
        assert figures["curves_cm"] > 0.0
    assert (facts["joint_sigma_ratio"] == {}) == alone
    text = "\n".join(summary.trust_text(result))
    assert ("n/a, the clips have no skeleton" in text) == alone
    assert (summary.ALONE in summary.legend([result])) == alone
