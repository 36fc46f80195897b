"""Tests of VRM animations as files; `interop/avatars.py` plays them on avatars."""

from dataclasses import replace

import numpy as np
import pytest
from user_rigs import read_glb

import posefield
from posefield.common.errors import InvalidField
from posefield.encode import vrma
from posefield.encode.character import METRES
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import quat, skeleton
from posefield.motion.curves import Curve, CurveValues
from posefield.motion.skeleton import Skeleton

ARMS = [(side + "UpperArm", side + "LowerArm") for side in ("left", "right")]
LEGS = [
    (side + upper, side + lower)
    for side in ("left", "right")
    for upper, lower in (("UpperLeg", "LowerLeg"), ("LowerLeg", "Foot"))
]
SINGLE = 2e-6


def rest_of(document):
    """Places and orientations of the nodes of bones in the rest pose, and their parents."""
    nodes = [node for node in document["nodes"] if "rotation" in node]
    parents = [-1] * len(nodes)
    for number, node in enumerate(nodes):
        for child in node.get("children", ()):
            parents[child] = number
    turns = np.array([node["rotation"] for node in nodes])[:, [3, 0, 1, 2]]
    offsets = np.array([node["translation"] for node in nodes])
    places, world = skeleton.forward_kinematics(tuple(parents), turns, offsets)
    return dict(zip([n["name"] for n in nodes], zip(places, world, strict=True), strict=True))


@pytest.fixture(scope="module")
def walk():
    return posefield.load("cmu_walk").clip(speed=1.3, turn=0.0)


@pytest.mark.parametrize("name", ["cmu_walk", "hdm05_kick"])
def test_bones_rest_in_the_t_pose_of_vrm(name):
    clip = posefield.load(name).clip()
    document, _ = read_glb(CLIP_ENCODERS["vrma"].encode(clip))
    rest = rest_of(document)
    bones = document["extensions"]["VRMC_vrm_animation"]["humanoid"]["humanBones"]
    assert {b: document["nodes"][n["node"]]["name"] for b, n in bones.items()} == {
        b: b for b in rest
    }
    for upper, lower in ARMS:
        along = rest[lower][0] - rest[upper][0]
        assert along / np.linalg.norm(along) == pytest.approx(
            [1.0 if upper.startswith("left") else -1.0, 0.0, 0.0], abs=SINGLE
        )
    for upper, lower in LEGS:
        along = rest[lower][0] - rest[upper][0]
        assert along / np.linalg.norm(along) == pytest.approx([0.0, -1.0, 0.0], abs=SINGLE)
    for side in ("left", "right"):
        toes = rest[side + "Toes"][0] - rest[side + "Foot"][0]
        assert toes[2] > 0.1 and abs(toes[0]) < SINGLE
    # Toes hover over the floor by no more than they do at rest.
    assert 0.0 < rest["leftToes"][0][1] < 0.08
    # Straight legs are as long as spread ones are in the motion's own rest.
    hips = rest["hips"][0]
    assert (hips[0], hips[2]) == (0.0, 0.0) and hips[1] > clip.clip.skeleton.offsets[0, 1]


def test_rotations_are_those_of_the_motion_between_bones(walk):
    document, binary = read_glb(CLIP_ENCODERS["vrma"].encode(walk))
    animation = document["animations"][0]
    paths = [(c["target"]["node"], c["target"]["path"]) for c in animation["channels"]]
    assert [path for path in paths if path[1] == "translation"] == [(0, "translation")]
    bones = vrma.humanoid(walk.clip.skeleton, walk.clip.roles)
    _, world = skeleton.forward_kinematics(
        walk.clip.skeleton.parents, walk.clip.rotations, walk.clip.translations
    )
    parents = {
        child: n for n, node in enumerate(document["nodes"]) for child in node.get("children", ())
    }
    joints = list(bones.values())
    for channel in animation["channels"]:
        node = channel["target"]["node"]
        if channel["target"]["path"] == "rotation":
            accessor = document["accessors"][animation["samplers"][channel["sampler"]]["output"]]
            view = document["bufferViews"][accessor["bufferView"]]
            start = view["byteOffset"] + accessor.get("byteOffset", 0)
            keys = np.frombuffer(binary, "<f4", 4 * accessor["count"], start).reshape(-1, 4)
            wanted = world[:, joints[node]]
            if node:
                wanted = quat.mul(quat.conj(world[:, joints[parents[node]]]), wanted)
            dots = np.abs(np.sum(keys[:, [3, 0, 1, 2]] * wanted, axis=-1))
            assert dots == pytest.approx(np.ones(len(dots)), abs=SINGLE)


def test_a_rest_in_another_direction_gives_the_same_t_pose(walk):
    """The same body captured at rest with its arms down, facing to the left."""
    joints, roles = walk.clip.skeleton, walk.clip.roles
    turn = quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(0.5 * np.pi))
    offsets = quat.rotate(turn, joints.offsets)
    down = quat.mul(turn, quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(-1.3)))
    for role in ("leftLowerArm", "leftHand"):
        offsets[roles[role]] = quat.rotate(down, joints.offsets[roles[role]])
    other = Skeleton(joints.names, joints.parents, offsets, joints.tip_joints, joints.tip_offsets)
    straight = []
    for form in (joints, other):
        rest = form.at_rest(form.offsets)
        turns = vrma.t_pose(vrma.humanoid(form, roles), rest)
        straight.append(
            {
                role: quat.rotate(turns[role], rest[roles[below]] - rest[roles[role]])
                for role, below in (*ARMS, *LEGS)
            }
        )
    for role, bone in straight[0].items():
        assert straight[1][role] == pytest.approx(bone, abs=1e-9)


def test_bodies_that_vrm_has_not_are_refused(walk):
    card = walk.clip.skeleton
    headless = {role: joint for role, joint in walk.clip.roles.items() if role != "head"}
    with pytest.raises(InvalidField, match="no joint for head"):
        vrma.humanoid(card, headless)
    lying = Skeleton(
        card.names, card.parents, card.offsets[:, [1, 0, 2]], card.tip_joints, card.tip_offsets
    )
    with pytest.raises(InvalidField, match="does not stand upright at rest"):
        vrma.humanoid(lying, walk.clip.roles)


def test_curves_are_expressions(walk):
    curves = (Curve("aa", 0.0, 1.0, 0.1), Curve("jawOpen", 0.0, 1.0, 0.1))
    weights = np.linspace(0.0, 1.0, 2 * len(walk.clip)).reshape(-1, 2)
    clip = replace(walk.clip, curves=CurveValues(curves, weights))
    document, binary = read_glb(vrma.vrma(replace(walk, clip=clip), METRES))
    expressions = document["extensions"]["VRMC_vrm_animation"]["expressions"]
    assert {kind: [*names] for kind, names in expressions.items()} == {
        "preset": ["aa"],
        "custom": ["jawOpen"],
    }
    animation = document["animations"][0]
    for column, (kind, name) in enumerate((("preset", "aa"), ("custom", "jawOpen"))):
        node = expressions[kind][name]["node"]
        (channel,) = (c for c in animation["channels"] if c["target"]["node"] == node)
        assert channel["target"]["path"] == "translation"
        accessor = document["accessors"][animation["samplers"][channel["sampler"]]["output"]]
        start = document["bufferViews"][accessor["bufferView"]]["byteOffset"]
        keys = np.frombuffer(binary, "<f4", 3 * accessor["count"], start).reshape(-1, 3)
        assert keys[:, 0] == pytest.approx(weights[:, column], abs=SINGLE)


def test_an_export_of_a_model_without_a_person_is_refused_at_once(posefield, model_file, tmp_path):
    words = (
        "--grid",
        "haste=1.0,1.2",
        "-o",
        tmp_path / "out",
        "--format",
        "vrma",
        "--workers",
        "1",
    )
    code, _, err = posefield("export", model_file("styled"), *words)
    assert (code, "no joint for" in err) == (2, True), err
    assert not [*tmp_path.rglob("*.vrma")]
