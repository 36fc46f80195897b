"""Tests of joins in the report of a performance: one judgement, and what it compares with."""

import json
from dataclasses import replace

import numpy as np
import pytest

from posefield.inference import session
from posefield.model_file.model_card import CapturedAcceleration
from posefield.motion.clip import Clip
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question.json_decoding import decode_question
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.performance_report import ScriptWarning
from posefield.synthesis.synthesizer import Synthesizer

MAX_FRAMES = 2000
WALK = {"kind": "walk", "model": "walk", "seconds": 2.0}
HOLD = {"kind": "hold", "seconds": 0.5}
CUT = {"kind": "walk", "model": "walk", "seconds": 2.0, "join": {"blend": "cut"}}


@pytest.fixture(scope="module")
def walk(walk_path):
    return Synthesizer("walk", session.load(walk_path))


def resolved(segments, models, **fields):
    question = {"segments": segments, "fps": 60, **fields}
    asked = decode_question(PerformanceQuestion, json.dumps(question).encode())
    return resolve_script(asked, models.__getitem__)


def performed(segments, models, **fields):
    return composition.perform(resolved(segments, models, **fields), MAX_FRAMES).trust


def known(model, p99, name="walk"):
    """The model with another 99th percentile on its card, or as a file of an earlier version."""
    own = p99 and CapturedAcceleration(1.0, p99)
    card = replace(model.session.card, captured_acceleration=own)
    return Synthesizer(name, replace(model.session, card=card))


def test_joins_are_compared_with_captured_clips_or_in_earlier_files_with_their_motions(walk):
    (join,) = performed([WALK, HOLD, WALK], {"walk": walk}).joins
    assert join.reference == "captured"
    assert join.usual == walk.session.card.captured_acceleration.p99
    (earlier,) = performed([WALK, HOLD, WALK], {"walk": known(walk, None)}).joins
    assert earlier.reference == "synthesised"
    assert 0.0 < earlier.usual != join.usual and earlier.peak == join.peak


def test_the_larger_of_two_models_counts(walk):
    models = {"walk": known(walk, 7.0), "fast": known(walk, 11.0, "fast")}
    fast = {**WALK, "model": "fast"}
    found = performed([WALK, HOLD, fast, HOLD, WALK, HOLD, WALK], models).joins
    assert [join.usual for join in found] == [11.0, 11.0, 7.0]


def test_warnings_that_differ_in_numbers_only_are_one():
    kinds = "turns by up to {} rad/s more", "stays {} cm away"
    turn, miss, later = (
        ScriptWarning(f"/segments/{index}", kinds[kind].format(number))
        for index, kind, number in ((0, 0, 0.2), (1, 1, 3), (12, 0, 1.25))
    )
    merged = composition.merge_warnings([turn, miss, later])
    message = "turns by up to 0.2 rad/s more; as do 1 more: /segments/12"
    assert merged == (replace(turn, message=message), miss)
    assert composition.merge_warnings([turn, miss]) == (turn, miss)


def test_only_feet_as_they_are_sent_count(walk):
    """A plan warns of its own peaks, and a performance of those with placed feet."""
    script = resolved([WALK, HOLD, CUT], {"walk": known(walk, 10.0)})
    planned = composition.plan(script, MAX_FRAMES)
    sent = composition.perform(script, MAX_FRAMES).trust
    assert planned.joins[0].peak != sent.joins[0].peak
    for report in (planned, sent):
        assert report.joins[0].hard
        said = [each for each in report.warnings if "accelerate" in each]
        assert said == [each for each in said if f"{report.joins[0].peak:.0f} m/s2" in each]
        assert len(said) == 1


def test_given_poses_count_by_their_own_accelerations(walk):
    names = walk.session.card.skeleton.names
    still = {"rotations": [[1.0, 0.0, 0.0, 0.0]] * len(names), "root_position": [0.0, 1.0, 0.0]}
    p99 = walk.session.card.captured_acceleration.p99
    found = performed([WALK], {"walk": walk}, start={"poses": [still] * 10}).joins
    assert [(join.reference, join.usual) for join in found] == [("captured", p99)]
    bent = {**still, "rotations": [[0.8, 0.6, 0.0, 0.0]] * len(names)}
    jumping = performed([WALK], {"walk": walk}, start={"poses": [still, bent] * 5}).joins
    assert jumping[0].usual > 10.0 * p99


# The window of a join, s, and a share: rotations of a clip have length 1.
BEFORE, AFTER, TOLERANCE = 0.1, 0.6, 1e-4


@pytest.fixture(scope="module")
def perform(walk):
    stopped = {**WALK, "seconds": 1.5, "stop": "standing"}
    began = {"kind": "walk", "model": "walk", "to": [0.5, 5.0], "start": "standing"}

    def performed(fps, feet="stand"):
        script = resolved([stopped, HOLD, began], {"walk": walk}, fps=fps, feet=feet)
        return composition.perform(script, MAX_FRAMES)

    return performed


def peak(clip: Clip, time: float) -> float:
    """Largest mean acceleration of the joints relative to the root near a join, m/s²."""
    found = clip.positions() - clip.positions()[:, :1]
    means = np.linalg.norm(np.diff(found, n=2, axis=0), axis=-1).mean(axis=-1) * clip.rate**2
    times = (np.arange(len(means)) + 1) / clip.rate
    return float(means[(times > time - BEFORE - 1e-6) & (times < time + AFTER + 1e-6)].max())


@pytest.mark.parametrize("feet", ["stand", "as_predicted"])
def test_frames_of_half_the_rate_are_every_second_one_bit_for_bit(perform, feet):
    whole, half = perform(60.0, feet).clip, perform(30.0, feet).clip
    assert half.rotations.tobytes() == whole.rotations[::2].tobytes()
    assert half.root_path.tobytes() == whole.root_path[::2].tobytes()
    # The negative control: a rate between whose frames there are others.
    third = perform(24.0, feet).clip
    assert third.rotations[1].tobytes() not in {own.tobytes() for own in whole.rotations}


@pytest.mark.parametrize("feet", ["stand", "as_predicted"])
def test_joins_are_judged_in_the_frames_that_are_sent(perform, feet):
    answer = perform(60.0, feet)
    joins = answer.trust.joins
    assert joins
    assert answer.trust.segments[-1].ends == pytest.approx(answer.clip.duration, abs=1e-6)
    for own in joins:
        assert own.peak == pytest.approx(peak(answer.clip, own.time), rel=TOLERANCE)
    other = perform(60.0, "as_predicted" if feet == "stand" else "stand")
    assert joins[0].peak != pytest.approx(peak(other.clip, joins[0].time), rel=TOLERANCE)
