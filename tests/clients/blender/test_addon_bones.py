"""Tests of bone channels: composed as in Blender, they give the clip's joint positions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from without_blender import axes, bones, faults
from without_blender.bones import Rest
from without_blender.clips import Clip

PARENTS = {"Hips": None, "Spine": "Hips", "Head": "Spine", "Leg": "Hips"}
FRAMES = 5


@pytest.fixture
def clip(rng):
    """A random motion of four joints."""
    turns = rng.normal(size=(FRAMES, 4, 4))
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    offsets = rng.normal(size=(4, 3))
    offsets[0] = 0
    return Clip(PARENTS, axes.unrolled(turns), rng.normal(size=(FRAMES, 3)), offsets, 30.0)


@pytest.fixture
def rest(rng):
    """An armature whose bones have axes and places of their own."""
    matrices = np.tile(np.eye(4), (4, 1, 1))
    matrices[:, :3, :3] = Rotation.random(4, random_state=1).as_matrix()
    matrices[:, :3, 3] = rng.normal(size=(4, 3))
    return Rest(matrices, scale=0.5)


def matrices(turns, places):
    found = np.tile(np.eye(4), (*turns.shape[:-1], 1, 1))
    found[..., :3, :3] = (
        Rotation.from_quat(turns.reshape(-1, 4), scalar_first=True)
        .as_matrix()
        .reshape(*turns.shape[:-1], 3, 3)
    )
    found[..., :3, 3] = places
    return found


def meant(clip):
    """World matrices (F, J, 4, 4) of the joints."""
    places = np.tile(clip.offsets, (FRAMES, 1, 1))
    places[:, 0] = clip.path
    return chained(matrices(clip.rotations, places))


def chained(local):
    world = local.copy()
    for joint, parent in enumerate(list(PARENTS).index(p) if p else -1 for p in PARENTS.values()):
        if parent >= 0:
            world[:, joint] = world[:, parent] @ local[:, joint]
    return world


def posed(channels, rest):
    """Return Blender's poses of channels: parent's pose, rest between the two, own channels."""
    places = np.tile(channels.shifts, (FRAMES, 1, 1))
    places[:, 0] = channels.path
    between = rest.matrices.copy()
    for joint, parent in enumerate([-1, 0, 1, 0]):
        if parent >= 0:
            between[joint] = np.linalg.inv(rest.matrices[parent]) @ rest.matrices[joint]
    found = chained(between @ matrices(channels.turns, places))
    found[..., :3, :3] = found[..., :3, :3] @ np.swapaxes(rest.matrices[:, :3, :3], -1, -2)
    found[..., :3, 3] *= rest.scale
    return found


def test_joints_lie_where_the_clip_says_whatever_the_bones_axes(clip, rest):
    found = posed(bones.channels(clip, rest, keep_lengths=False), rest)
    np.testing.assert_allclose(found, meant(clip), atol=1e-12)


def test_the_check_notices_channels_that_are_not_in_the_bones_axes(clip, rest):
    channels = bones.channels(clip, rest, keep_lengths=False)
    raw = bones.Channels(clip.rotations, channels.path, channels.shifts)
    assert np.abs(posed(raw, rest) - meant(clip)).max() > 0.1


def test_an_armature_that_keeps_its_lengths_turns_as_the_clip(clip, rest):
    channels = bones.channels(clip, rest, keep_lengths=True)
    found = posed(channels, rest)
    np.testing.assert_allclose(found[..., :3, :3], meant(clip)[..., :3, :3], atol=1e-12)
    np.testing.assert_allclose(found[:, 0], meant(clip)[:, 0], atol=1e-12)
    np.testing.assert_array_equal(channels.shifts, 0)
    apart = np.diff(found[..., :3, 3][:, [0, 1]], axis=1)
    own = np.linalg.norm(rest.heads[1] - rest.heads[0]) * rest.scale
    np.testing.assert_allclose(np.linalg.norm(apart, axis=-1), own, atol=1e-12)


def test_quaternions_of_matrices_are_scipys(rng):
    turns = Rotation.random(200, random_state=2)
    found = axes.of_matrices(turns.as_matrix())
    np.testing.assert_allclose(
        np.abs((found * turns.as_quat(scalar_first=True)).sum(-1)), 1, atol=1e-12
    )


def test_products_are_scipys():
    a, b = Rotation.random(20, random_state=3), Rotation.random(20, random_state=4)
    found = axes.mul(a.as_quat(scalar_first=True), b.as_quat(scalar_first=True))
    np.testing.assert_allclose(
        np.abs((found * (a * b).as_quat(scalar_first=True)).sum(-1)), 1, atol=1e-12
    )
    np.testing.assert_allclose(axes.angle(found), (a * b).magnitude(), atol=1e-7)


def test_z_up_is_one_turn_of_everything(rng):
    """Points turned by a rotation and then with Z up are those with Z up turned by it with Z up."""
    turn, points = Rotation.random(random_state=5), rng.normal(size=(10, 3))
    turned = Rotation.from_quat(axes.z_up_turns(turn.as_quat(scalar_first=True)), scalar_first=True)
    np.testing.assert_allclose(
        axes.z_up(turn.apply(points)), turned.apply(axes.z_up(points)), atol=1e-12
    )
    np.testing.assert_array_equal(
        axes.z_up(np.array([(0, 1, 0), (0, 0, 1)])), [(0, 0, 1), (0, -1, 0)]
    )


def test_a_new_armature_stands_on_the_ground_and_no_bone_is_without_length(clip):
    still = Clip(PARENTS, clip.rotations, clip.path, np.zeros((4, 3)), 30.0)
    for each in (clip, still):
        heads = bones.at_rest(each)
        assert heads[:, 2].min() == 0
        lengths = np.linalg.norm(bones.tails(each, heads, {}) - heads, axis=-1)
        assert lengths.min() >= 0.999 * bones.SHORTEST
    np.testing.assert_allclose(bones.at_rest(clip)[2] - bones.at_rest(clip)[1], clip.offsets[2])


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (
            {"Hips": None, "Spine": "Hips", "Leg": "Hips"},
            "3 bones, the clip 4 joints: it lacks Head$",
        ),
        (PARENTS | {"Hat": "Head"}, "it has besides Hat$"),
        (PARENTS | {"Head": "Hips"}, r"Head \(child of Hips, expected Spine\)"),
        ({f"B{i}": None for i in range(9)}, "besides B0, B1, B2, B3 and 5 more"),
    ],
)
def test_another_skeleton_is_refused_by_name(clip, found, words):
    with pytest.raises(faults.Mismatch, match=words):
        bones.check(clip, found)


def test_the_same_skeleton_is_taken_in_any_order(clip):
    bones.check(clip, dict(reversed(PARENTS.items())))
    assert bones.check_names(clip) is None


def test_a_name_that_blender_would_cut_is_refused(clip):
    long = Clip({"ü" * 32: None}, clip.rotations, clip.path, clip.offsets, 30.0)
    with pytest.raises(faults.Mismatch, match="64 bytes, a bone's name at most 63"):
        bones.check_names(long)


def test_what_is_not_taken_over_is_said(clip):
    own = np.tile(np.eye(4), (4, 1, 1))
    own[:, :3, 3] = bones.at_rest(clip)
    assert bones.differences(clip, Rest(own)) == []
    longer = own.copy()
    longer[2, :3, 3] += 0.05 * clip.offsets[2] / np.linalg.norm(clip.offsets[2])
    (said,) = bones.differences(clip, Rest(longer))
    assert "up to 5.0 cm off the clip's (Head)" in said
    other = own.copy()
    turned = Rotation.from_euler("x", 30, degrees=True).apply(clip.offsets[3])
    other[3, :3, 3] = other[0, :3, 3] + turned
    (said,) = bones.differences(clip, Rest(other))
    assert "degrees at Leg" in said
