"""Tests of the rest pose by the rules of engines: it stands on the floor at the origin."""

from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd
from user_rigs import read_glb

from posefield.encode.formats import CLIP_ENCODERS
from posefield.model_file import checked_file
from posefield.motion import clip as clips
from posefield.motion import quat
from posefield.question.results import SampledClip, Trust
from posefield.registry import model_registry
from posefield.roles.joint_recognition import standing

SOLE = 0.011
"""Largest distance of the body's lowest point from the floor, m."""
PLACES = ((0.0, 0.0, 0.0), (1.734, 0.92, -5.183), (0.0, 12.0, 0.0))


@pytest.fixture(params=["cmu_walk", "hdm05_grab_high"])
def model(request):
    path = model_registry.SHIPPED_FOLDER / f"{request.param}.onnx"
    return checked_file.load_card(path.read_bytes(), request.param)


@pytest.mark.parametrize("place", PLACES)
def test_a_skeleton_stands_at_the_origin_wherever_its_file_has_the_root(model, place):
    moved = model.skeleton.offsets.copy()
    moved[0] = place
    found = standing(replace(model.skeleton, offsets=moved))
    assert np.array_equal(found.offsets, model.skeleton.offsets)
    heights = found.at_rest(found.offsets)[:, 1]
    assert found.offsets[0, 0] == found.offsets[0, 2] == 0.0 < 0.8 < found.offsets[0, 1] < 1.1
    assert 0.0 <= heights.min() < 0.05


def test_a_foot_without_toes_has_its_ankle_above_the_floor(model):
    joints = model.skeleton
    index = {role: joints.names.index(name) for role, name in model.roles.items()}
    below = {index[side + "Toes"] for side in ("left", "right")}
    kept = [j for j in range(len(joints)) if not below & set(_path(joints.parents, j))]
    parents = tuple(kept.index(joints.parents[j]) if joints.parents[j] >= 0 else -1 for j in kept)
    names = tuple(joints.names[j] for j in kept)
    cut = standing(replace(
        joints, names=names, parents=parents, offsets=joints.offsets[kept],
        tip_joints=(), tip_offsets=np.empty((0, 3)),
    ))  # fmt: skip
    assert 0.06 < cut.at_rest(cut.offsets)[:, 1].min() < 0.09


def _path(parents, joint):
    found = [joint]
    while parents[found[-1]] >= 0:
        found.append(parents[found[-1]])
    return found


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.15])
def test_clips_of_all_sizes_stand_at_rest(model, scale, tmp_path):
    joints = model.skeleton
    path = np.array([[3.0, 1.4, -2.0], [3.0, 1.4, -1.9]])
    turns = np.tile(quat.IDENTITY, (2, len(joints), 1))
    answer = SampledClip(
        clips.assemble(joints, turns, path, joints.offsets * scale, 30.0),
        Trust("m@0000000000000000", {}, None, 0, 1.0, 0.0, True, ()),
    )
    document, binary = read_glb(CLIP_ENCODERS["glb"].encode(answer))
    height = document["nodes"][0]["translation"][1]
    assert document["nodes"][0]["translation"] == [0.0, height, 0.0] and 0.6 < height < 1.2
    view = document["bufferViews"][document["skins"][0]["inverseBindMatrices"]]
    inverse = np.frombuffer(binary, "f4", 16 * len(joints), view["byteOffset"])
    local = np.array([node["translation"] for node in document["nodes"][: len(joints)]])
    assert np.abs(joints.at_rest(local) + inverse.reshape(-1, 4, 4)[:, 3, :3]).max() < 1e-6
    mesh = document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    assert abs(document["accessors"][mesh]["min"][1]) < SOLE
    (tmp_path / "c.usda").write_bytes(CLIP_ENCODERS["usda"].encode(answer))
    stage = Usd.Stage.Open(str(tmp_path / "c.usda"))
    skel = stage.GetPrimAtPath("/Character/Skel")
    rest, bind = (np.array(skel.GetAttribute(f"{n}Transforms").Get()) for n in ("rest", "bind"))
    assert np.abs(rest[:, 3, :3] - local).max() < 1e-6
    assert np.abs(bind[:, 3, :3] - joints.at_rest(local)).max() < 1e-6
