"""Tests of one topology for clips of different skeletons."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from expressed_skeletons import arms_first, random_turns, renamed, with_joint, with_rest

from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import sample_files
from posefield_train.source import common_topology, unified_clips
from posefield_train.source.common_topology import TopologyError

FEW = 6


@pytest.fixture(scope="module")
def clips():
    return [trial.clip for trial in islice(sample_files.samples(), FEW)]


def unify(clips, stated=None, stretches=False):
    files = [f"{at}.bvh" for at in range(len(clips))]
    return unified_clips.unify_recipe(clips, files, stated or {}, stretches)


def index(clip, *names):
    return [clip.skeleton.names.index(name) for name in names]


def equal_turns(a, b):
    """The largest difference of two rotations whose quaternions may differ by their signs."""
    return np.abs(1.0 - np.abs(np.sum(a * b, axis=-1))).max()


def test_joints_of_roles_keep_their_places(clips):
    found, notes = unify(clips)
    chains = [name for name in found[0].skeleton.names if name.startswith(("spine", "neck"))]
    assert chains == ["spine1", "spine2", "spine3", "neck1", "neck2"]
    pairs = {
        "hips": "Hips",
        "leftToes": "LeftToeBase",
        "rightHand": "RightHand",
        "spine1": "LowerBack",
        "spine3": "Spine1",
        "neck2": "Neck1",
        "head": "Head",
        "leftLowerArm": "LeftForeArm",
    }
    for before, after in zip(clips, found, strict=True):
        was = before.positions()[:, index(before, *pairs.values())]
        assert after.positions()[:, index(after, *pairs)] == pytest.approx(was, abs=1e-12)
        assert np.ptp(after.translations[:, 1:], axis=0).max() < 1e-12
    assert notes == [
        "6 of 6 clips, such as 0.bvh: 33 joints became 23 by their roles, without LeftThumb1, "
        "LeftThumb2, LeftIndex1, LeftMiddle1, LeftPinky1, RightThumb1 and 4 more; 99 % of the "
        "joints lie within 0.00 cm (limbs) and 0.00 cm (trunk) of the files'"
    ]


def test_the_rest_pose_is_a_t_pose(clips):
    found, _ = unify(clips)
    own = found[0].skeleton
    rest = own.at_rest(own.offsets)
    for side, outwards in (("left", 1.0), ("right", -1.0)):
        ends = [rest[own.names.index(side + role)] for role in ("UpperArm", "LowerArm", "Hand")]
        for bone in np.diff(ends, axis=0):
            assert bone / np.linalg.norm(bone) == pytest.approx([outwards, 0, 0], abs=1e-3)
        ends = [rest[own.names.index(side + role)] for role in ("UpperLeg", "LowerLeg", "Foot")]
        for bone in np.diff(ends, axis=0):
            assert bone / np.linalg.norm(bone) == pytest.approx([0, -1, 0], abs=1e-3)
        assert rest[own.names.index(side + "Toes"), 2] > ends[-1][2]
        # Elbow and knee turn about one axis: forearm ahead, lower leg backwards.
        elbow, knee = (index(found[0], side + role)[0] for role in ("LowerArm", "LowerLeg"))
        for joint, axis in ((elbow, [0, -outwards, 0]), (knee, [1, 0, 0])):
            turns = np.concatenate([clip.rotations[:, joint] for clip in found])
            turns = quat.log(np.where(turns[:, :1] < 0, -turns, turns))
            along = turns @ np.array(axis)
            assert along.max() > 0.3 and np.median(along) > 0
            assert np.abs(turns - along[:, None] * axis).mean() < 0.15 * np.abs(along).mean()


def other_rests(clips):
    turns = random_turns(len(clips[0].skeleton), seed=3)
    return [arms_first(with_rest(clip, turns)) for clip in clips]


def test_another_rest_pose_and_order_of_joints_change_nothing(clips):
    found, _ = unify(clips)
    others, _ = unify(other_rests(clips))
    for one, other in zip(found, others, strict=True):
        assert one.skeleton.same_tree(other.skeleton)
        assert equal_turns(one.rotations, other.rotations) < 1e-10
        assert one.translations == pytest.approx(other.translations, abs=1e-9)
    # Without the common rest pose the same joints turn differently.
    own = with_rest(clips[0], random_turns(len(clips[0].skeleton), seed=3))
    assert equal_turns(own.rotations, clips[0].rotations) > 1e-2


def test_rest_poses_of_one_name_are_told_apart(clips):
    turns = random_turns(len(clips[0].skeleton), seed=5)
    mixed = [with_rest(clip, turns) if at % 2 else clip for at, clip in enumerate(clips * 2)]
    found, _ = unify(mixed)
    plain, _ = unify(clips * 2)
    worst = max(equal_turns(a.rotations, b.rotations) for a, b in zip(found, plain, strict=True))
    # Axes of two halves differ by a few degrees at most, not by the 45 of the frames.
    assert 2 * np.degrees(np.arccos(1.0 - worst)) < 12.0


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_helper_joints_are_left_out(clips, share):
    helped = [with_joint(clip, "LHipJoint", "LeftUpLeg") for clip in clips]
    helped = [with_joint(clip, "LeftForeArmTwist", "LeftHand", share) for clip in helped]
    found, notes = unify([*clips, *helped])
    assert "35 joints became 23 by their roles, without LHipJoint, LeftForeArmTwist" in notes[1]
    for one, other in zip(found[:FEW], found[FEW:], strict=True):
        assert equal_turns(one.rotations, other.rotations) < 1e-10
        assert one.translations == pytest.approx(other.translations, abs=1e-9)


def longer(clip, angle):
    """The clip with one more joint in the lowest bone of the spine, which bends by up to rad."""
    clip = with_joint(clip, "Waist", "Spine", 0.5)
    bends = angle * np.sin(np.linspace(0.0, 2 * np.pi, len(clip)))
    rotations, at = clip.rotations.copy(), clip.skeleton.names.index("Waist")
    turns = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), bends)
    rotations[:, at] = quat.mul(rotations[:, at], turns)
    return replace(clip, rotations=rotations)


def test_chains_have_the_joints_that_all_files_have(clips):
    mixed = [longer(clips[0], 0.2), *clips[1:]]
    found, notes = unify(mixed)
    assert found[0].skeleton.same_tree(found[1].skeleton) and len(found[0].skeleton) == 23
    assert "34 joints became 23" in notes[0]
    own = mixed[0].positions()[:, index(mixed[0], "LowerBack", "Spine1", "Head", "RightHand")]
    mean = found[0].translations.copy()
    mean[:, 1:] = mean[:, 1:].mean(axis=0)
    placed = replace(found[0], translations=mean).positions()
    gaps = np.linalg.norm(
        placed[:, index(found[0], "spine1", "spine3", "head", "rightHand")] - own, axis=-1
    )
    assert 1e-5 < np.percentile(gaps, 99) < 0.01
    assert gaps[:, 0].max() < 1e-12


def test_a_joint_that_is_missed_is_refused_or_accepted(clips):
    mixed = [longer(clips[0], 1.5), *clips[1:]]
    said = (
        r"skeleton.topology: joints between spine\d and spine\d are left out, .* moves by up to "
        r"[\d.]+ cm against spine\d, expected at most [\d.]+ cm; say motion.bones = 'stretch'"
    )
    with pytest.raises(TopologyError, match=said) as caught:
        unify(mixed)
    assert caught.value.clip == 0
    found, notes = unify(mixed, stretches=True)
    assert len(found) == FEW and "0.00 cm (trunk)" not in notes[0]


def test_a_lacking_role_is_named_with_the_way_out(clips):
    odd = renamed(clips[2], {"LeftForeArm": "Thing", "RightForeArm": "Other"})
    with pytest.raises(TopologyError) as caught:
        unify([clips[0], odd])
    assert caught.value.clip == 1
    assert str(caught.value).startswith(
        "skeleton.topology: found no joint for leftLowerArm, rightLowerArm, expected one for each; "
        "state them in the recipe, such as [skeleton.roles] leftLowerArm = 'JOINT'"
    )
    stated = {"leftLowerArm": ["Thing", "LeftForeArm"], "rightLowerArm": ["Other"]}
    found, _ = unify([clips[0], odd], stated)
    assert found[0].skeleton.same_tree(found[1].skeleton)


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"head": ["Nothing"]}, "skeleton.roles: no file has joint 'Nothing'"),
        ({"head": ["Head", "Neck1"]}, "skeleton.roles.head: found joints .*expected one"),
        ({"leftHand": ["LeftFoot"], "leftFoot": ["LeftHand"]}, "is not below"),
        ({"hips": ["Neck1"]}, "no joint of the spine between 'Neck1'"),
    ],
)
def test_stated_roles_that_do_not_fit_are_refused(clips, stated, said):
    with pytest.raises(TopologyError, match=said):
        unify(clips[:1], stated)


def test_a_role_that_some_lack_is_left_out_with_a_note(clips):
    odd = renamed(clips[2], {"LeftToeBase": "Thing", "RightToeBase": "Thing2"})
    found, notes = unify([clips[0], odd])
    assert "leftToes" not in found[0].skeleton.names and len(found[0].skeleton) == 21
    assert notes[-2:] == [
        f"{side}Toes is left out: 1 of 2 clips, such as 1.bvh, have no joint for it"
        for side in ("left", "right")
    ]


def test_a_neck_that_carries_the_arms_is_a_spine(clips):
    own = clips[0].skeleton
    gone = {"LowerBack", "Spine", "Spine1"}
    kept = [at for at, name in enumerate(own.names) if name not in gone]
    above = {name: own.names[own.parents[at]] for at, name in enumerate(own.names) if at}
    above |= {"Neck": "Hips", "LeftShoulder": "Neck", "RightShoulder": "Neck"}
    names = tuple(own.names[at] for at in kept)
    order = sorted(range(len(kept)), key=lambda at: names[at] not in ("Hips", "Neck"))
    names = tuple(names[at] for at in order)
    parents = tuple(names.index(above[name]) if name in above else -1 for name in names)
    flat = Skeleton(names, parents, np.ones((len(names), 3)), (), np.zeros((0, 3)))
    found = common_topology.role_joints(flat, {})
    assert [flat.names[at] for at in found.spine] == ["Neck"]
    assert [flat.names[at] for at in found.neck] == ["Neck1"]


@pytest.mark.parametrize(
    ("spine", "roles"),
    [(1, {"spine": "spine1"}), (5, {"spine": "spine1", "chest": "spine3", "upperChest": "spine5"})],
)
def test_models_tell_other_tools_their_roles(spine, roles):
    spines = common_topology.numbered("spine", spine)
    names = ("hips", *spines, "neck1", "neck2", "head", "leftHand")
    others = {"hips": "hips", "neck": "neck1", "head": "head", "leftHand": "leftHand"}
    assert common_topology.model_roles(names) == others | roles
