"""Errors of curves in an evaluation: in their own unit, with equal information, with and without
a skeleton.
"""

from dataclasses import replace

import expressions
import numpy as np
import pytest
from joblib import parallel_config

from posefield.motion.curves import distances
from posefield_train.evaluate import (
    compared_motion,
    equal_information,
    methods,
    motion_errors,
    new_performers,
    protocol,
)
from posefield_train.evaluate.methods import OURS, Queries
from posefield_train.evaluate.pages import evaluation_page
from posefield_train.evaluate.summary import evaluation_summary, method_summary
from posefield_train.evaluate.summary.method_summary import NOT_APPLICABLE
from posefield_train.parallel.jobs import ProcessJobs
from posefield_train.sample.face import face_motion
from posefield_train.source import curve_files, ingest
from posefield_train.train import train

JOBS = ProcessJobs(1)
HELD = 4


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
    return compared_motion.motion_of_clip(clip, None)


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


def test_means_pool_the_errors_of_curves():
    true = smooth(SHARES)
    parts = [
        motion_errors.compare_motions(resting(true + off), resting(true), ())
        for off in (0.0, 0.02, 0.06)
    ]
    mean = motion_errors.mean(parts)
    assert mean.curves == pytest.approx(np.mean([part.curves for part in parts], axis=0))
    assert mean.counted == pytest.approx(np.mean([part.counted for part in parts], axis=0))


def test_every_method_predicts_the_curves_within_their_limits(family, alone):
    recipe = expressions.recipe(alone)
    rest = [example for i, example in enumerate(family) if i != HELD]
    asked = Queries(family[HELD].controls[None], [family[HELD].row.labels])
    found = methods.predict_all(recipe, train(recipe, rest, lambda _: None), asked).motions
    true = compared_motion.motion_of_clip(family[HELD].clip, None)
    errors = {
        name: motion_errors.compare_motions(made, true, ()).curves
        for name, (made,) in found.items()
    }
    for name, (made,) in found.items():
        assert made.curves.values.min() >= 0.0 and made.curves.values.max() <= 1.0
        assert made.curves.names == list(face_motion.CURVE_NAMES)
        assert np.sqrt(errors[name].mean()) < 0.3
    # The nearest example is that example, but for its time warping.
    places = np.stack([example.controls for example in rest])
    nearest = rest[int(np.argmin(np.linalg.norm(places - family[HELD].controls, axis=1)))]
    (made,) = found["nearest_no_performer"]
    own = compared_motion.motion_of_clip(nearest.clip, None)
    assert np.sqrt(motion_errors.compare_motions(made, own, ()).curves.mean()) < 0.01
    assert np.sqrt(errors["nearest_no_performer"].mean()) > 0.03
    # A mean motion knows least.
    assert errors["mean"].mean() > 4.0 * errors[OURS].mean()


def test_measures_of_a_result(result, alone):
    keys = [measure.key for measure in equal_information.measures(result)]
    positions = [] if alone else ["relative", "global", "effector"]
    assert keys == [*positions, "duration", "curves", *(f"curve {n}" for n in result.curves)]
    known = equal_information.best_peers(result, equal_information.KNOWN)
    open_ = equal_information.best_peers(result, equal_information.LEFT_OPEN)
    compared = known or open_
    assert {"curves", "curve jawOpen", "curve browInnerUp"} <= set(compared)
    name = compared["curve browInnerUp"].name
    place = result.curves.index("browInnerUp")
    mean = motion_errors.mean(result.of(name, result.asked(name)))
    assert compared["curve browInnerUp"].theirs == pytest.approx(np.sqrt(mean.curves[place]))


def test_measures_of_positions_are_not_applicable_without_a_skeleton(result, alone):
    summaries = evaluation_summary.summarize(result)
    heads = [title for title, _ in method_summary.columns(result)]
    for summary in summaries:
        cells = dict(zip(heads, summary.cells(), strict=True))
        assert float(cells["curves"]) == pytest.approx(100.0 * summary.curve_distance, abs=6e-4)
        assert cells["duration"].endswith("%")
        assert (cells["relative"] == NOT_APPLICABLE) == alone
        assert (cells["accel."] == NOT_APPLICABLE) == alone
        facts = summary.facts()
        assert (facts["relative_cm"] is None) == (facts["distances_cm"] is None) == alone
        assert facts["curves"].keys() == set(face_motion.CURVE_NAMES)
        assert facts["curves_cm"] > 0.0
    assert (NOT_APPLICABLE in evaluation_summary.table(result)) == alone
    assert (evaluation_summary.facts(result)["joint_sigma_ratio"] == {}) == alone
    said = "\n".join(evaluation_summary.trust_text(result))
    assert ("n/a, the clips have no skeleton" in said) == alone
    assert (method_summary.ALONE in evaluation_summary.legend([result])) == alone


def test_a_family_without_curves_is_told_as_before(result, alone):
    if alone:
        return
    plain = replace(result, curves=())
    assert method_summary.columns(plain) == method_summary.COLUMNS
    assert "curve" not in evaluation_summary.table(plain)
    facts = evaluation_summary.facts(plain)["methods"][OURS]
    assert not [key for key in facts if "curve" in key]


def test_the_page_has_the_error_of_each_curve(result, alone):
    page = evaluation_page.html("Faces", [result]).decode()
    assert "Root mean square error of each curve, in its own unit" in page
    assert "browInnerUp" in page and "error of the curves" in page.lower()
    assert ("n/a" in page) == alone
    assert "nan" not in page.replace("sans", "")


def test_clips_of_a_performer_bring_their_curves(result, alone):
    """Adapted models know the brows of the performer whose other clips they were shown."""
    place = result.curves.index("browInnerUp")
    places = result.asked("posefield_adapt_3")
    assert places

    def error(name):
        return np.sqrt(np.mean([one.curves[place] for one in result.of(name, places)]))

    assert error("posefield_adapt_3") < 0.6 * error(OURS)
    assert new_performers.ADAPTATION_COUNTS["posefield_adapt_3"] == 3
