"""Tests of facts about joins."""

from dataclasses import replace

import numpy as np
import pytest
from passages import character, smooth

from posefield.motion.quat import smoothstep
from posefield.performance import join_quality, joins
from posefield.performance.join_quality import JoinFacts
from posefield.performance.joins import Cut
from posefield.performance.passage import RATE, FloorMotion, Passage

EASY = JoinFacts(0.05, 0.02, "dead", 4.0, "captured", peak=8.0)


def judged(before, after, kind):
    cut = joins.find_cut(character(), before, after, range(30, 50), range(8))
    after = after.placed(cut.motion)
    joined = joins.join(before, after, cut, kind)
    usual = join_quality.usual_acceleration(character(), [before, after])
    facts = JoinFacts(cut.distance, 0.0, kind, usual, "synthesised", frame=cut.exit)
    (judgement,) = join_quality.judge(character(), [facts], joined)
    return judgement


def test_a_plain_cut_is_hard():
    facts = judged(smooth(3), smooth(4), "cut")
    assert facts.reasons
    assert facts.peak > 10.0 * facts.usual
    blended = judged(smooth(3), smooth(4), "dead")
    assert blended.peak < 0.3 * facts.peak


def twitching(frame, frames=160):
    """A still character whose joints turn in one frame."""
    still = smooth(1, 1)
    rotations = np.repeat(still.rotations, frames, axis=0)
    rotations[frame] = smooth(2, 1).rotations[0]
    roots = np.repeat(still.roots, frames, axis=0)
    return Passage(rotations, roots, np.zeros((frames, 0)), np.zeros(frames))


def test_an_act_that_is_faster_than_captured_clips_is_told():
    said = join_quality.judge_act(character(), twitching(30), (0, 160), 4.0)
    assert (
        said.startswith("joints accelerate by ") and " m/s2 at 0.50 s, expected at most 3" in said
    )
    assert said.endswith("times the 4.0 m/s2 of captured clips of the model")
    # Negative controls: clips as fast as the act, and frames of another segment.
    assert not join_quality.judge_act(character(), twitching(30), (0, 160), 1e5)
    assert not join_quality.judge_act(character(), twitching(30), (60, 160), 4.0)
    assert not join_quality.judge_act(character(), twitching(30), (28, 34), 4.0)


@pytest.mark.parametrize(("fall", "seconds"), [(0.0, 0.5), (9.81, 0.5), (9.81, 0.1)])
def test_roots_may_differ_by_as_much_as_a_blend_rises_when_they_accelerate_as_usual(fall, seconds):
    times = np.arange(60) / RATE
    still = twitching(0, 60)
    falling = replace(still, roots=np.outer(0.5 * fall * times**2, (0.0, 1.0, 0.0)))
    cut = Cut(59, 0, FloorMotion(), 0.0, 0.0)
    allowed = join_quality.most_drop(falling, falling, cut, seconds)
    # The smooth step over that height has the acceleration of the fall.
    steps = np.arange(0.0, 1.0 + 1e-9, 1e-3)
    risen = allowed * np.gradient(np.gradient(smoothstep(steps), 1e-3), 1e-3) / seconds**2
    limited = allowed == join_quality.MOST_DROP
    assert limited == (fall * seconds**2 / 6.0 < join_quality.MOST_DROP)
    assert limited or np.abs(risen).max() == pytest.approx(fall, rel=0.01)


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        (replace(EASY, distance=0.3), "the poses are 30 cm apart, expected at most 25"),
        (
            replace(EASY, peak=13.0),
            "joints accelerate by 13 m/s2, expected at most 3 times the 4.0 m/s2 of the captured"
            " clips of the models that are joined",
        ),
    ],
)
def test_a_hard_join_is_told_with_found_and_expected(facts, said):
    assert facts.reasons == (said,)
    assert not EASY.reasons
