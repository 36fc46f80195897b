"""Tests of evidence against clips: jumps, bone lengths, exchanged sides and unusual distances."""

from dataclasses import replace

import numpy as np
import pytest
from minimal import SKELETON, small_clip

from posefield.kriging.kriging_model import Hyper
from posefield.motion import quat
from posefield_train import outliers
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source import clip_joints, recording_groups

HYPER = Hyper("matern52", (1,), np.array([0.5]), 0.1, 0.0)
NAMES = ("Hips", "LeftHand", "RightHand", "lfoot", "rfoot", "Neck")


def spoiled(clip, frames, joint, by):
    translations = clip.translations.copy()
    translations[frames, joint, 0] += by
    return replace(clip, translations=translations)


@pytest.mark.parametrize("frames", [slice(50, None), slice(50, 51)])
def test_a_leap_is_found_whether_or_not_it_leads_back(frames):
    clip = small_clip(frames=100)
    found = outliers.largest_jump(spoiled(clip, frames, 4, 0.3))
    assert found.frame in (49, 50)
    assert (found.joint, found.whole_body) == (4, False)
    assert found.distance == pytest.approx(0.3, abs=0.03)
    assert outliers.largest_jump(clip) is None
    assert outliers.largest_jump(spoiled(clip, frames, 0, 0.3)).whole_body


@pytest.fixture
def offsets(rng):
    """Bones of three performers, three clips of each."""
    own = SKELETON.offsets + 0.02 * rng.normal(size=(3, *SKELETON.offsets.shape))
    return np.repeat(own, 3, axis=0)


WHO = tuple("aaabbbccc")


def test_bones_of_another_performer_are_named(offsets):
    assert all(clip_joints.find_foreign_bones(offsets, WHO, clip) is None for clip in range(9))
    wrong = offsets.copy()
    wrong[1] = offsets[7]
    found = clip_joints.find_foreign_bones(wrong, WHO, 1)
    assert (found.nearest_performer, found.clips, found.nearest_distance) == ("c", 2, 0.0)
    assert found.distance > 0.01
    assert all(
        clip_joints.find_foreign_bones(wrong, WHO, clip) is None for clip in range(9) if clip != 1
    )


def body(rng):
    """Joints (T, J, 3) of a body that is not like its mirror image."""
    left = np.array([0.0, 0.4, -0.4, 0.1, -0.1, 0.0])[None, :, None] * [1.0, 0.0, 0.0]
    return left + 0.3 * rng.normal(size=(20, 6, 3))


def test_a_disguise_is_seen_through(rng):
    expected, left = body(rng), np.array([1.0, 0.0, 0.0])
    swap, flip = list(recording_groups.mirrored_joints(NAMES)), np.array([-1.0, 1.0, 1.0])
    up = quat.rotate(quat.from_axis_angle(left, np.array(np.pi / 2)), expected)
    round_about = quat.rotate(
        quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(np.pi / 2)), expected
    )
    worn = {
        "mirrored left to right": expected[:, swap] * flip,
        "with the names of left and right joints exchanged": expected[:, swap],
        "with the axis from left to right reversed": expected * flip,
        "with z for up": up,
        "turned by -90 degrees about the vertical": round_about,
    }
    for said, own in worn.items():
        found = outliers.find_transform(own, expected, NAMES, left)
        assert (found.description, found.after < 1e-9, found.before > 0.1) == (said, True, True)
    assert outliers.find_transform(expected + 0.1, expected, NAMES, left) is None
    for degrees, noticed in ((-1.0, False), (8.0, False), (30.0, True)):
        up = np.array([0.0, 1.0, 0.0])
        own = quat.rotate(quat.from_axis_angle(up, np.array(np.radians(degrees))), expected)
        found = outliers.find_transform(own, expected, NAMES, left)
        assert (found is not None) == noticed
    assert outliers.find_transform(body(rng), expected, NAMES, left) is None


def line(rng, count=30):
    """Samples along one control and values that follow it, with a little noise."""
    at = np.linspace(-1.0, 1.0, count)[:, None]
    values = at * [1.0, -0.5, 0.2] + 0.05 * rng.normal(size=(count, 3))
    return SamplePoints(at, 1, np.arange(count)), values


def test_an_outsider_is_found_and_its_neighbours_are_not(rng):
    laid, values = line(rng)
    assert outliers.measure_outliers(HYPER, laid, values).outside == ()
    values[[10, 12]] += [[0.0, 3.0, 0.0], [0.0, 0.0, 2.0]]
    judged = outliers.measure_outliers(HYPER, laid, values)
    assert set(judged.outside) == {10, 12}
    # Each is judged by those who belong, so the two do not spoil each other's distance.
    assert judged.distances[[10, 12]] == pytest.approx([3.0, 2.0], abs=0.3)
    assert judged.times[11] < outliers.MEDIAN_FACTOR
    assert judged.usual < 0.2
