"""Tests of rigs: characters' files of all formats, their rest poses, roles and refusals."""

from dataclasses import replace

import numpy as np
import pytest
import rig_files
from pxr import Gf, Sdf, Usd, UsdSkel, Vt

from posefield.common.errors import MotionFileError
from posefield.motion import quat, skeleton
from posefield.rigs.rig import read_rig


@pytest.fixture
def files(figure, tmp_path):
    """One figure with any axes of its joints, in four files."""
    own = figure.framed(3)
    return {
        "glb": rig_files.write_glb(tmp_path / "a.glb", own),
        "usda": rig_files.write_usd(tmp_path / "a.usda", own, 0.0254),
        "cm, z up": rig_files.write_usd(tmp_path / "b.usdc", own, 0.01, "z"),
    }


@pytest.mark.parametrize("kind", ["glb", "usda", "cm, z up"])
def test_all_formats_give_the_same_skeleton(figure, files, kind):
    rig = read_rig(files[kind])
    assert rig.skeleton.names == figure.names
    assert np.abs(rig.skeleton.offsets - figure.offsets).max() < 1e-6
    assert {role: own.joint for role, own in rig.roles.items()}["leftLowerLeg"] == "LeftLeg"
    assert abs(rig.facing) < 0.05 and rig.notes == ()
    assert rig.joint_paths[1] == ("1" if kind == "glb" else "/".join(figure.names[:2]))


@pytest.mark.parametrize("kind", ["glb", "usda", "cm, z up"])
def test_values_of_a_file_pose_its_joints_as_the_clip(walk, files, kind):
    """Forward kinematics in the file's own joints, unit and axes against that of the clip."""
    rig = read_rig(files[kind])
    turns = rig.rest.file_rotations(walk.rotations)
    places = rig.rest.file_translations(walk.translations)
    found = skeleton.positions(walk.skeleton.parents, turns, places)
    unit = {"glb": 0.01, "usda": 0.0254, "cm, z up": 0.01}[kind]
    found = unit * found
    if kind == "cm, z up":
        found = found[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0])
    assert np.abs(found - walk.positions()).max() < 1e-6
    # At rest, they are those of the file.
    still = quat.IDENTITY + np.zeros((1, len(walk.skeleton), 1))
    rest = rig.rest.file_rotations(still)[0]
    assert np.abs(np.abs(np.sum(rest * rig.rest.rotations, axis=-1)) - 1.0).max() < 1e-9
    # The axes matter: the clip's own rotations pose other joints.
    wrong = skeleton.positions(walk.skeleton.parents, walk.rotations, places)
    assert np.abs(unit * wrong - walk.positions()).max() > 0.1


def test_stated_roles_are_taken(figure, tmp_path):
    others = {"LeftUpLeg": "bone_7", "RightUpLeg": "bone_9"}
    own = replace(figure, names=tuple(others.get(name, name) for name in figure.names))
    path = rig_files.write_usd(tmp_path / "a.usda", own)
    with pytest.raises(MotionFileError, match=r"found no .*leftUpperLeg.*state them by role"):
        read_rig(path)
    joint = own.index("bone_7")
    named = read_rig(path, {"leftUpperLeg": "bone_7", "rightUpperLeg": "bone_9"})
    assert named.joints["leftUpperLeg"] == joint
    assert named.roles["leftUpperLeg"].confidence == 1.0
    places = {"leftUpperLeg": named.joint_paths[joint], "rightUpperLeg": "bone_9"}
    assert read_rig(path, places).joints == named.joints


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"leftUperLeg": "LeftUpLeg"}, "the role 'leftUperLeg'.*did you mean 'leftUpperLeg'"),
        ({"leftLowerLeg": "LeftArm"}, "leftLowerLeg at 'LeftArm', which is not below"),
        (
            {"leftUpperLeg": "LeftUpLeg", "rightUpperLeg": "LeftUpLeg"},
            "joint 'LeftUpLeg' for leftUpperLeg and rightUpperLeg, expected one for each",
        ),
    ],
)
def test_wrong_statements_are_refused(figure, tmp_path, stated, said):
    path = rig_files.write_glb(tmp_path / "a.glb", figure)
    with pytest.raises(MotionFileError, match=said):
        read_rig(path, stated)


def test_files_that_are_no_rig_are_refused(figure, tmp_path):
    Sdf.Layer.CreateNew(str(tmp_path / "empty.usda")).Save()
    cases = {
        tmp_path / "a.fbx": "suffix '.fbx', expected one of .usd",
        tmp_path / "none.glb": "cannot be read",
        tmp_path / "empty.usda": "found no Skeleton",
        rig_files.write_usd(tmp_path / "two.usda", figure, skeletons=2): "found 2 skeletons",
        rig_files.write_glb(tmp_path / "b.glb", figure, skins=[]): "found no skin",
    }
    for path, said in cases.items():
        with pytest.raises(MotionFileError, match=said):
            read_rig(path)


def test_an_unusual_size_is_told(figure, tmp_path):
    path = rig_files.write_usd(tmp_path / "a.usda", figure.longer(100.0, *figure.names))
    (note,) = read_rig(path).notes
    assert "is the unit of the file right?" in note


def test_a_file_in_a_pose_of_its_motion_stands_as_in_its_bind_pose(figure, tmp_path):
    """Exporters write the pose of the current frame as the rest pose: here a crouch."""
    upright = read_rig(rig_files.write_usd(tmp_path / "a.usda", figure)).skeleton
    path = rig_files.write_usd(tmp_path / "b.usda", figure)
    stage = Usd.Stage.Open(str(path))
    own = UsdSkel.Skeleton(stage.GetPrimAtPath("/Character0/Skel"))
    rest = list(own.GetRestTransformsAttr().Get())
    rest[0] = rest[0] * Gf.Matrix4d().SetTranslate((0.02, -0.07, 0.3))
    knee = figure.index("LeftLeg")
    rest[knee] = Gf.Matrix4d().SetRotate(Gf.Rotation((1, 0, 0), 30)) * rest[knee]
    own.GetRestTransformsAttr().Set(Vt.Matrix4dArray(rest))
    stage.GetRootLayer().Save()
    assert np.abs(read_rig(path).skeleton.offsets - upright.offsets).max() < 1e-6


@pytest.mark.parametrize("place", ["../out.usda", "{outside}/out.usda", "sub/../../out.usda"])
def test_a_character_reads_no_file_out_of_its_folder(figure, tmp_path, place):
    """Through sublayers, references, payloads, value clips and buffers, though the files exist."""
    folder = tmp_path / "characters"
    (folder / "sub").mkdir(parents=True)
    rig_files.write_usd(tmp_path / "out.usda", figure)
    (tmp_path / "out.bin").write_bytes(bytes(4))
    name = place.format(outside=tmp_path)
    changes = {
        "sublayer": lambda made: made.GetRootLayer().subLayerPaths.append(name),
        "reference": lambda made: made.DefinePrim("/Look").GetReferences().AddReference(name),
        "payload": lambda made: made.DefinePrim("/Look").GetPayloads().AddPayload(name),
        "clips": lambda made: Usd.ClipsAPI(made.DefinePrim("/Look")).SetClipAssetPaths([name]),
    }
    for kind, change in changes.items():
        path = rig_files.write_usd(folder / f"{kind}.usda", figure)
        made = Usd.Stage.Open(str(path))
        change(made)
        made.GetRootLayer().Save()
        with pytest.raises(MotionFileError, match=r"refers to '.*out.usda', expected a path below"):
            read_rig(path)
    uri = name.replace("usda", "bin").replace("..", "%2e%2e")
    bind = {"accessors": [{"bufferView": 0, "componentType": 5126, "count": 21, "type": "MAT4"}]}
    buffers = {"buffers": [{"uri": uri, "byteLength": 4}]}
    views = {"bufferViews": [{"buffer": 0, "byteLength": 4}], **bind, **buffers}
    skin = {"joints": list(range(len(figure.names))), "inverseBindMatrices": 0}
    path = rig_files.write_glb(folder / "a.glb", figure, skins=[skin], **views)
    with pytest.raises(MotionFileError, match=r"refers to '.*out.bin', expected a path below"):
        read_rig(path)
