"""Tests of the suggestion of a known name for an unknown one."""

import time

import pytest

from posefield.common import errors
from posefield.common.errors import similar_name

JOINTS = ("Hips", "LeftHand", "RightHand", "RightHandThumb", "Head")


@pytest.mark.parametrize(
    ("name", "expected"),
    [("right_hand", "RightHand"), ("LeftHadn", "LeftHand"), ("Tail", None), ("", None)],
)
def test_the_most_similar_name_is_suggested(name, expected):
    assert similar_name(name, JOINTS) == expected


def test_a_beginning_suggests_the_only_name_that_it_begins():
    assert similar_name("pos", ("joint", "position", "time")) == "position"
    assert similar_name("Rig", ("RightArm", "RightLeg")) is None
    assert similar_name("po", ("position",)) is None


def test_two_equally_similar_names_suggest_none():
    assert similar_name("usd", ("usda", "usdc", "usdz")) is None
    assert similar_name("usdb", ("usda", "usdc", "usdz", "usd")) == "usd"


def test_a_long_name_gets_no_suggestion():
    longest = "a" * errors.MAX_NAME_LENGTH
    assert similar_name(longest, [longest[:-1]])
    assert similar_name(longest + "a", [longest]) is None
    assert similar_name("abc", ["abc" + "d" * errors.MAX_NAME_LENGTH]) is None


def test_the_time_is_bounded_for_any_text_of_a_client():
    """A megabyte, and the most similar names of the greatest length: below a second."""
    length = errors.MAX_NAME_LENGTH
    known = [f"{'ab' * length}{number:04}"[-length:] for number in range(10_000)]
    began = time.process_time()
    assert similar_name("ab" * 500_000, known) is None
    similar_name("ba" * (length // 2), known)
    assert time.process_time() - began < 1.0
