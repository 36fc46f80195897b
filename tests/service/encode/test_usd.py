import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from posefield.encode import character
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import forward_kinematics
from posefield.question.results import ClipAnswer

FOLDER = Path(__file__).parent


@pytest.fixture(params=["usda", "usdc"])
def stage(request, walk, tmp_path):
    return opened(CLIP_ENCODERS[request.param].encode(walk), tmp_path / f"clip.{request.param}")


def opened(data, path):
    path.write_bytes(data)
    return Usd.Stage.Open(str(path))


def query(stage):
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/Character/Skel"))
    cache = UsdSkel.Cache()
    root = UsdSkel.Root(stage.GetPrimAtPath("/Character"))
    assert cache.Populate(root, Usd.PrimDefaultPredicate)
    return cache, root, cache.GetSkelQuery(skeleton)


def joint_positions(stage, frame):
    _, _, skeleton = query(stage)
    return np.array(skeleton.ComputeJointSkelTransforms(frame))[:, 3, :3]


def error(stage, clip):
    """Largest distance of a joint from our own forward kinematics at four frames, m."""
    frames = [0, len(clip) // 3, len(clip) // 2, len(clip) - 1]
    found = np.array([joint_positions(stage, frame) for frame in frames])
    return np.max(np.linalg.norm(found - clip.positions()[frames], axis=-1))


def value(stage, path):
    return stage.GetAttributeAtPath(f"/Character{path}").Get()


# float32 keeps 1e-7 of a coordinate, and errors add up along the chain of joints.
NEAR = 1e-5


def test_usd_poses_the_joints_as_we_do(stage, walk):
    assert error(stage, walk.clip) < NEAR


def test_quaternions_in_the_wrong_order_would_be_seen(walk, tmp_path):
    swapped = np.roll(walk.clip.rotations, 1, axis=-1)
    wrong = Clip(walk.clip.skeleton, swapped, walk.clip.translations, walk.clip.rate)
    data = CLIP_ENCODERS["usdc"].encode(ClipAnswer(wrong, walk.trust))
    assert error(opened(data, tmp_path / "wrong.usdc"), walk.clip) > 0.1


def test_the_stage_states_its_units_and_times(stage, walk):
    assert stage.GetDefaultPrim().GetPath() == "/Character"
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, len(walk.clip) - 1)
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 29.97
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    authored = stage.GetRootLayer().pseudoRoot.ListInfoKeys()
    assert {"metersPerUnit", "upAxis", "timeCodesPerSecond", "framesPerSecond"} <= set(authored)


def test_prims_are_bound_to_each_other(stage):
    kinds = {str(p.GetPath()): p.GetTypeName() for p in stage.Traverse()}
    assert kinds == {
        "/Character": "SkelRoot",
        "/Character/Skel": "Skeleton",
        "/Character/Anim": "SkelAnimation",
        "/Character/Body": "Mesh",
        "/Character/Material": "Material",
        "/Character/Material/Surface": "Shader",
    }
    for path in ("", "/Skel", "/Body"):
        assert stage.GetPrimAtPath(f"/Character{path}").HasAPI(UsdSkel.BindingAPI)
    for path, target in (
        (".skel:skeleton", "Skel"),
        ("/Body.skel:skeleton", "Skel"),
        ("/Body.material:binding", "Material"),
        ("/Skel.skel:animationSource", "Anim"),
    ):
        relation = stage.GetRelationshipAtPath(f"/Character{path}")
        assert relation.GetTargets() == [Sdf.Path(f"/Character/{target}")]
    assert stage.GetDefaultPrim().GetMetadata("kind") == "component"


def test_joints_have_legal_unique_leaf_names_and_keep_their_own(stage, walk):
    joints = value(stage, "/Skel.joints")
    leaves = [joint.rpartition("/")[2] for joint in joints]
    assert tuple(leaves) == character.legal_names(walk.clip.skeleton.names)
    assert tuple(value(stage, "/Skel.jointNames")) == walk.clip.skeleton.names
    assert list(value(stage, "/Anim.joints")) == list(joints)


def test_usd_skins_the_body_as_we_blend_its_joints_and_within_the_extent(stage, walk):
    points, joints, extent = skinned(stage)
    weights = np.array(value(stage, "/Body.primvars:skel:jointWeights")).reshape(joints.shape)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    clip = walk.clip
    places, turns = forward_kinematics(clip.skeleton.parents, clip.rotations, clip.translations)
    rest = np.array(value(stage, "/Body.points"))
    bind = np.array(value(stage, "/Skel.bindTransforms"))[:, 3, :3]
    for frame, found in points.items():
        own = rest[:, None] - bind[joints]
        moved = places[frame][joints] + quat.rotate(turns[frame][joints], own)
        blended = np.sum(weights[..., None] * moved, axis=1)
        np.testing.assert_allclose(found, blended, atol=NEAR)
        # Joints that are not blended would be seen.
        assert np.abs(found - moved[:, 0]).max() > 0.01
        assert np.all(found >= extent[0]) and np.all(found <= extent[1])


def skinned(stage, frames=(0, 20, 44)):
    """Points that USD's own skinning gives for some frames, their joints, and the extent."""
    cache, root, skeleton = query(stage)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    (skinning,) = binding.GetSkinningTargets()
    points = {}
    for frame in frames:
        found = UsdGeom.Mesh(skinning.GetPrim()).GetPointsAttr().Get()
        transforms = skeleton.ComputeSkinningTransforms(frame)
        assert skinning.ComputeSkinnedPoints(transforms, found, frame)
        points[frame] = np.array(found)
    joints = np.array(value(stage, "/Body.primvars:skel:jointIndices")).reshape(len(found), -1)
    extent = np.array(value(stage, ".extent"))
    np.testing.assert_array_equal(extent, np.array(value(stage, "/Body.extent")))
    return points, joints, extent


def test_the_layer_says_what_the_answer_is_worth(stage, walk):
    facts = stage.GetRootLayer().customLayerData["posefield"]
    assert facts | {"warnings": tuple(facts["warnings"])} == walk.trust.facts()


PRINT_DIGESTS = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
import conftest
from posefield.encode.formats import CLIP_ENCODERS
walk = conftest.answer(frames=45, rate=29.97)
for encoder in CLIP_ENCODERS.values():
    print(encoder.extension, hashlib.sha256(encoder.encode(walk)).hexdigest())
"""


@pytest.mark.system
def test_other_processes_write_the_same_bytes():
    command = [sys.executable, "-c", PRINT_DIGESTS, str(FOLDER)]
    runs = {
        subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(2)
    }
    assert len(runs) == 1
    assert len(runs.pop().splitlines()) == len(CLIP_ENCODERS)
