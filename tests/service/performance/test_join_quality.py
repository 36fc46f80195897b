"""Tests of facts about joins."""

from dataclasses import replace

import numpy as np
import pytest
from passages import PARENTS, character, smooth

from posefield.feet.foot_placement import PlacedFrames
from posefield.motion import skeleton
from posefield.performance import join_quality, joins
from posefield.performance.join_quality import CutFacts, JoinFacts, UsualMotion
from posefield.performance.passage import RATE, FloorMotion

CUT = CutFacts(0.05, 0.02, "dead", UsualMotion(4.0, "captured"))
EASY = JoinFacts(CUT, 8.0)


def test_accelerations_are_second_differences_relative_to_the_root():
    passage = smooth(1)
    moved = skeleton.translations(character().bones, passage.roots)
    places = skeleton.positions(PARENTS, passage.rotations, moved) - passage.roots[:, None]
    expected = [
        np.linalg.norm(places[i - 1] - 2 * places[i] + places[i + 1], axis=-1).mean() * RATE**2
        for i in range(20, 30)
    ]
    found = join_quality.accelerations(character(), passage, 20, 30)
    assert found == pytest.approx(expected)
    # The floor and the root's own path do not matter.
    far = replace(passage.placed(FloorMotion(1.0, 5.0j)), roots=np.zeros((len(passage), 3)))
    assert join_quality.accelerations(character(), far, 20, 30) == pytest.approx(expected)
    assert len(join_quality.accelerations(character(), passage, 0, 60)) == 58
    assert len(join_quality.accelerations(character(), passage.part(0, 2), 0, 2)) == 0


def judged(before, after, kind, motion=None):
    cut = joins.find_cut(character(), before, after, range(30, 50), range(8), motion)
    after = after.placed(cut.motion)
    joined = joins.join(before, after, cut, kind)
    found = join_quality.usual_acceleration(character(), [before, after])
    usual = UsualMotion(found, "synthesised")
    facts = join_quality.describe_cut((before, after), cut, kind, usual)
    sent = PlacedFrames(joined.rotations, joined.roots)
    (judgement,) = join_quality.judge(character(), [(cut.exit, facts)], sent)
    return judgement, cut


def test_a_plain_cut_is_hard():
    facts, _ = judged(smooth(3), smooth(4), "cut")
    assert facts.hard
    assert facts.peak > 10.0 * facts.cut.usual.acceleration
    blended, _ = judged(smooth(3), smooth(4), "dead")
    assert blended.peak < 0.3 * facts.peak


def test_the_peak_is_that_of_the_frames_near_the_join():
    passage = smooth(1, 120)

    def peak(frames, frame):
        sent = PlacedFrames(passage.rotations[:frames], passage.roots[:frames])
        (found,) = join_quality.judge(character(), [(frame, CUT)], sent)
        return found.peak

    every = join_quality.accelerations(character(), passage, 0, 120)
    # The first acceleration is that of the second frame.
    assert peak(120, 50) == pytest.approx(every[43:86].max())
    assert peak(120, 0) == pytest.approx(every[:36].max())
    # Negative control: the largest one of all is not near every frame.
    assert peak(120, 0) != pytest.approx(every.max())
    assert peak(2, 0) == 0.0


def twitching(frame, frames=160):
    """A still character whose joints turn in one frame."""
    still = smooth(1, 1)
    rotations = np.repeat(still.rotations, frames, axis=0)
    rotations[frame] = smooth(2, 1).rotations[0]
    return PlacedFrames(rotations, np.repeat(still.roots, frames, axis=0))


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


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        (
            replace(EASY, cut=replace(CUT, distance=0.3)),
            "the poses are 30 cm apart, expected at most 25",
        ),
        (
            replace(EASY, peak=13.0),
            "joints accelerate by 13 m/s2, expected at most 3 times the 4.0 m/s2 of the captured"
            " clips of the models that are joined",
        ),
    ],
)
def test_a_hard_join_is_told_with_found_and_expected(facts, said):
    assert facts.hard
    assert facts.reasons == (said,)
    assert not EASY.hard
