"""Tests of facts about joins."""

from dataclasses import replace

import numpy as np
import pytest
from passages import PARENTS, character, smooth

from posefield.motion import skeleton
from posefield.performance.joins import blends, cut_search, join_quality
from posefield.performance.joins.join_quality import JoinFacts
from posefield.performance.passages.passage import RATE, FloorMotion

EASY = JoinFacts(3.0, 0.05, "dead", 8.0, 4.0, 0.02)


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


def test_the_usual_acceleration_is_that_of_the_livelier_passage():
    calm, lively = smooth(1, size=0.1), smooth(1)
    both = join_quality.usual_acceleration(character(), [calm, lively])
    assert both == join_quality.usual_acceleration(character(), [lively])
    assert both > 2.0 * join_quality.usual_acceleration(character(), [calm])
    assert join_quality.usual_acceleration(character(), []) == 0.0


def judged(before, after, kind, motion=None):
    cut = cut_search.find_cut(character(), before, after, range(30, 50), range(8), motion)
    after = after.placed(cut.motion)
    joined = blends.join(before, after, cut, kind)
    usual = join_quality.usual_acceleration(character(), [before, after])
    return join_quality.judge(character(), (before, after), cut, kind, joined, usual), cut


def test_a_motion_that_goes_on_is_an_easy_join():
    whole = smooth(2, 120)
    facts, cut = judged(whole, whole.part(30, 120), "dead")
    assert not facts.hard
    assert facts.sentence == ""
    assert facts.time == cut.exit / RATE
    assert facts.distance == cut.distance
    assert facts.drop == pytest.approx(0.0, abs=1e-9)


def test_a_plain_cut_is_hard():
    facts, _ = judged(smooth(3), smooth(4), "cut")
    assert facts.hard
    assert facts.peak > 10.0 * facts.usual
    blended, _ = judged(smooth(3), smooth(4), "dead")
    assert blended.peak < 0.3 * facts.peak


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"distance": 0.3}, "the poses are 30 cm apart, expected at most 25"),
        ({"drop": 0.2}, "the root is 20 cm higher on one side, expected at most 12"),
        (
            {"peak": 13.0},
            "joints accelerate by 13 m/s2, expected at most 3 times the 4.0 m/s2 of the motions"
            " that are joined",
        ),
    ],
)
def test_a_hard_join_is_told_with_found_and_expected(change, said):
    facts = replace(EASY, **change)
    assert facts.hard
    assert facts.sentence == f"hard join at 3.00 s: {said}"
    assert not EASY.hard


def test_a_squat_does_not_go_on_into_a_stoop():
    before, after = smooth(5), smooth(5)
    low = replace(after, roots=after.roots - np.array([0.0, 0.2, 0.0]))
    facts, _ = judged(before, low, "dead")
    assert [reason[:8] for reason in facts.reasons] == ["the root"]
