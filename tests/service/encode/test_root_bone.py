"""Tests of root bones by the rules of engines: travel and heading on the floor, bob in the hips."""

from dataclasses import replace

import numpy as np
import pytest
import test_glb
from pxr import Usd, UsdSkel
from usd_checks import defects
from user_rigs import glb_positions, still

from posefield.characters.delivery import deliver
from posefield.characters.user_character import open_character
from posefield.common.errors import InvalidField
from posefield.encode.character import Convention
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import quat, root_bone
from posefield.motion.skeleton import Skeleton
from posefield.question.motion_question import FileQuestion
from posefield.question.results import SampledClip, Trust
from posefield.synthesis import clips
from posefield_train.source import bvh

NEAR = 2e-6
CONTROLS = {"straight": {"speed": 1.3, "turn": 0.0}, "turning": {"speed": 1.1, "turn": 12.0}}


@pytest.fixture(scope="module", params=CONTROLS)
def answer(request, shipped_walk):
    asked = FileQuestion(controls=CONTROLS[request.param], names="ue5", loop=True)
    return clips.synthesize_clip(shipped_walk, asked)


def gltf_joints(answer, folder):
    file = test_glb.read(CLIP_ENCODERS["glb"].encode(answer))
    rest = np.array([file.nodes[joint].translation for joint in (0, 1)])
    return [node.name for node in file.nodes], test_glb.matrices(file)[..., :3, 3], rest


def usd_joints(answer, folder):
    path = folder / "clip.usdc"
    path.write_bytes(CLIP_ENCODERS["usdc"].encode(answer))
    assert defects(path) == []
    stage, cache = Usd.Stage.Open(str(path)), UsdSkel.Cache()
    cache.Populate(UsdSkel.Root(stage.GetPrimAtPath("/Character")), Usd.PrimDefaultPredicate)
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/Character/Skel"))
    query = cache.GetSkelQuery(skeleton)
    frames = range(len(answer.clip))
    found = [np.array(query.ComputeJointSkelTransforms(frame))[:, 3, :3] for frame in frames]
    rest = np.array(skeleton.GetRestTransformsAttr().Get())[:2, 3, :3]
    return list(skeleton.GetJointNamesAttr().Get()), np.array(found), rest


def bvh_joints(answer, folder):
    file = bvh.loads(CLIP_ENCODERS["bvh"].encode(answer, Convention(1.0, "z")), "clip.bvh")
    clip = bvh.to_clip(file, metres_per_unit=1.0, up="z", root_offset="replace")
    names = ["root", *answer.clip.skeleton.names]
    order = [clip.skeleton.names.index(name) for name in names]
    # Readers that add the OFFSET to channels see the same.
    assert not clip.skeleton.offsets[:2].any()
    return names, clip.positions()[:, order], None


@pytest.mark.parametrize("joints", [gltf_joints, usd_joints, bvh_joints])
def test_a_root_bone_travels_on_the_floor_and_moves_no_other_joint(answer, joints, tmp_path):
    names, found, rest = joints(answer, tmp_path)
    expected = answer.clip.positions()
    assert names[:2] == ["root", "pelvis"]
    assert np.abs(found[:, 1:] - expected).max() < 1e-5
    root, hips = found[:, 0], expected[:, 0]
    assert not root[:, 1].any() and np.ptp(hips[:, 1]) > 0.01
    speeds = [np.linalg.norm(np.diff(own[:, [0, 2]], axis=0), axis=1) for own in (root, hips)]
    assert np.ptp(speeds[0]) < 0.2 * np.ptp(speeds[1])
    assert np.abs((root[-1] - root[0]) - (hips[-1] - hips[0]))[[0, 2]].max() < 1e-5
    if rest is not None:
        assert not rest[0].any() and rest[1, 0] == rest[1, 2] == 0.0 < 0.8 < rest[1, 1]


def test_the_heading_is_the_travels(answer):
    clip = root_bone.add_root(answer.clip, root_bone.with_root(answer.clip.skeleton))
    found = np.unwrap(2.0 * np.arctan2(clip.rotations[:, 0, 2], clip.rotations[:, 0, 0]))
    assert not clip.rotations[:, 0, [1, 3]].any()
    even = np.linspace(found[0], found[-1], len(found))
    assert np.abs(found - even).max() < np.radians(1.5)
    hips = np.unwrap(quat.twist(answer.clip.rotations[:, 0], np.array([0.0, 1.0, 0.0])))
    assert found[-1] - found[0] == pytest.approx(hips[-1] - hips[0], abs=1e-6)


def test_the_body_is_that_of_the_hips(answer):
    plain = SampledClip(replace(answer.clip, root_bone=False), answer.trust)
    bodies = []
    for own in (plain, answer):
        file = test_glb.read(CLIP_ENCODERS["glb"].encode(own))
        attributes = file.meshes[0].primitives[0].attributes
        names = ("POSITION", "JOINTS_0", "WEIGHTS_0")
        bodies.append([test_glb.values(file, getattr(attributes, name)) for name in names])
    (points, joints, weights), (moved, shifted, same) = bodies
    assert np.abs(points - moved).max() < NEAR and np.array_equal(weights, same)
    assert np.array_equal(joints[weights > 0] + 1, shifted[weights > 0])


def test_tables_have_none_and_say_so(answer):
    noted = CLIP_ENCODERS["json"].noted(answer)
    assert "json files have no root bone" in noted.trust.warnings[-1]
    assert CLIP_ENCODERS["glb"].noted(answer) is answer


def rig(path, shipped_walk, root):
    """Write a character whose root is on the floor, with a joint for inverse kinematics."""
    clip = still(shipped_walk.session.card, 0.9, "ue5")
    own = root_bone.with_root(clip.skeleton) if root else clip.skeleton
    joints = Skeleton(
        (*own.names, "ik_foot_root"), (*own.parents, 0),
        np.concatenate([own.offsets, [[0.0, 0.1, 0.0]]]), own.tip_joints, own.tip_offsets,
    )  # fmt: skip
    turns = np.tile(quat.IDENTITY, (2, len(joints), 1))
    places = np.tile(joints.offsets, (2, 1, 1))
    made = replace(clip, skeleton=joints, rotations=turns, translations=places)
    trust = Trust("rig@0000000000000000", {}, None, 0, 1.0, 0.0, True, ())
    path.write_bytes(CLIP_ENCODERS["glb"].encode(SampledClip(made, trust)))
    return open_character(path, f"./{path.name}")


def test_a_characters_root_on_the_floor_travels_there(shipped_walk, tmp_path):
    character = rig(tmp_path / "hero.glb", shipped_walk, root=True)
    asked = FileQuestion(controls=CONTROLS["straight"], loop=True)
    order = deliver(character, CLIP_ENCODERS["glb"], asked)
    card = shipped_walk.session.card
    order.check(asked, card.skeleton, card.roles)
    made = order.clip(clips.synthesize_clip(shipped_walk, asked), asked, card.roles)
    content, names = order.encode(made), made.clip.skeleton.names
    found = np.stack([glb_positions(content, frame)[1] for frame in range(len(made.clip))])
    kept = [joint for joint, name in enumerate(names) if name not in ("root", "ik_foot_root")]
    assert np.abs(found[:, kept] - made.clip.positions()[:, kept]).max() < 1e-5
    root, goal = found[:, names.index("root")], found[:, names.index("ik_foot_root")]
    assert np.abs(root[:, 1]).max() < NEAR and root[-1, 2] - root[0, 2] > 1.0
    assert np.abs(goal - root - [0.0, 0.1, 0.0]).max() < NEAR


def test_a_character_without_a_joint_above_the_hips_is_refused(shipped_walk, tmp_path):
    character = rig(tmp_path / "hero.glb", shipped_walk, root=False)
    asked = FileQuestion(controls=CONTROLS["straight"], root="bone")
    card = shipped_walk.session.card
    with pytest.raises(InvalidField, match="expected one with a joint above the hips"):
        deliver(character, CLIP_ENCODERS["glb"], asked).check(asked, card.skeleton, card.roles)
