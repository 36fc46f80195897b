"""Tests of whole performances: their frames at several rates, and their joins as they are sent."""

import msgspec
import numpy as np
import pytest

from posefield.inference import session
from posefield.motion.clip import Clip
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis.synthesizer import Synthesizer

MAX_FRAMES = 1000
# The window of a join, s, and a share: rotations of a clip have length 1.
BEFORE, AFTER, TOLERANCE = 0.1, 0.6, 1e-4


@pytest.fixture(scope="module")
def perform(walk_path):
    walk = Synthesizer("walk", session.load(walk_path))

    def performed(fps, feet="stand"):
        script = {
            "fps": fps,
            "feet": feet,
            "segments": [
                {"kind": "walk", "model": "walk", "seconds": 1.5, "stop": "standing"},
                {"kind": "hold", "seconds": 0.5},
                {"kind": "walk", "model": "walk", "to": [0.5, 5.0], "start": "standing"},
            ],
        }
        content = msgspec.json.encode(script)
        asked = json_decoding.decode_question(PerformanceQuestion, content)
        return composition.perform(resolve_script(asked, lambda _: walk), MAX_FRAMES)

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
    for own in joins:
        assert own.peak == pytest.approx(peak(answer.clip, own.time), rel=TOLERANCE)
    other = perform(60.0, "as_predicted" if feet == "stand" else "stand")
    assert joins[0].peak != pytest.approx(peak(other.clip, joins[0].time), rel=TOLERANCE)
