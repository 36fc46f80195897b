"""Tests of glTF and USD files of which a part is needed: the rest is a note, not a refusal."""

import re

import numpy as np
import pytest
import usd_files
from gltf_files import GltfFile, arm
from pxr import Sdf, UsdSkel, Vt

from posefield.common.errors import MotionFileError
from posefield.motion import quat
from posefield.motion.skeleton import positions
from posefield_train.source import motion_readers
from posefield_train.source.motion_file import ReadOptions

FRAMES = 13
TIMES = np.arange(FRAMES) / 30.0
CODES = np.arange(FRAMES)
Y, Z = np.eye(3)[1:]
SWING = quat.from_axis_angle(Z, 1.2 * np.sin(9.0 * TIMES))
HAND = quat.rotate(SWING, np.broadcast_to(Y, (FRAMES, 3)))


def places(file):
    return positions(file.skeleton.parents, file.rotations, file.translations)


SKIN, HILT = {"joints": [0, 1]}, {"joints": [2, 3]}


def swing(*curves, nodes=(), skins=(SKIN,), turn=SWING, **facts):
    """Return a file of a swinging arm with more nodes, curves and facts."""
    file = GltfFile([*arm(), *nodes], list(skins))
    file.facts |= facts
    return file.animate((0, "rotation", TIMES, turn[:, [1, 2, 3, 0]], "LINEAR"), *curves)


def linear(node, part, values):
    return (node, part, TIMES, values, "LINEAR")


def two():
    """Return a file with a second animation, of the same joint."""
    file = swing()
    still = np.tile([0.0, 0.0, 0.0, 1.0], (FRAMES, 1))
    return file.animate(linear(0, "rotation", still), name="pose")


def with_faces():
    mesh = {"primitives": [], "extras": {"targetNames": ["jawOpen", "smile"]}}
    values = np.stack([TIMES, 1.0 - TIMES], axis=-1).reshape(-1)
    return swing(linear(2, "weights", values), nodes=[{"mesh": 0}], meshes=[mesh])


ODD = [{"name": "hilt", "children": [3]}, {"name": "tip"}]
ONES = np.ones((FRAMES, 3))
TURNED = quat.mul(SWING, np.array([0.0, 0.0, 0.0, 1.0]))
GROWING = (1.0 + TIMES)[:, None] * ONES


@pytest.mark.parametrize(
    ("file", "note"),
    [
        (swing(linear(0, "scale", ONES), linear(1, "scale", ONES)), None),
        (swing(linear(1, "scale", GROWING)), "scale of lower left out: no joint follows it"),
        (swing(linear(0, "scale", ONES * [-1, -1, 1]), turn=TURNED), None),
        (swing(nodes=ODD, skins=(HILT, SKIN)), "read: hilt left out"),
        (two(), "'walk' moves the skeleton: 'pose' left out"),
        (with_faces(), r"curves \(jawOpen, smile\) are no joints"),
        (swing(extensionsRequired=["KHR_draco_mesh_compression", "KHR_node_visibility"]), None),
        (swing(extensionsRequired=["ACME_cloth"]), "required ACME_cloth was not read"),
    ],
)
def test_the_skeleton_of_a_gltf_file_is_read(tmp_path, file, note):
    (tmp_path / "a.glb").write_bytes(file.glb())
    found = motion_readers.read(tmp_path / "a.glb")
    assert found.skeleton.names == ("upper", "lower")
    assert np.abs(places(found)[:, 1] - HAND).max() < 1e-6
    assert_noted(found, note)


def assert_noted(file, note):
    """Check that the notes are one that matches, or none."""
    assert len(file.notes) == (note is not None)
    assert note is None or re.search(note, file.notes[0])


def test_weights_of_morph_targets_are_curves(tmp_path):
    (tmp_path / "a.glb").write_bytes(with_faces().glb())
    found = motion_readers.read(tmp_path / "a.glb").curves
    assert np.allclose(found["jawOpen"], TIMES) and np.allclose(found["smile"], 1.0 - TIMES)


def test_one_of_two_moving_skeletons_is_named(tmp_path):
    file = swing(linear(2, "rotation", SWING[:, [1, 2, 3, 0]]), nodes=ODD, skins=(HILT, SKIN))
    (tmp_path / "a.glb").write_bytes(file.glb())
    for name in ("hilt", "tip"):
        found = motion_readers.read(tmp_path / "a.glb", ReadOptions(skeleton=name))
        assert found.skeleton.names == ("hilt", "tip")
    for name, said in ((None, r"2 skeletons \(hilt, upper\), expected one"), ("x", "2 skeletons")):
        with pytest.raises(MotionFileError, match=said):
            motion_readers.read(tmp_path / "a.glb", ReadOptions(skeleton=name))
    (tmp_path / "b.glb").write_bytes(swing().glb())
    with pytest.raises(MotionFileError, match="found the skeleton 'upper', expected 'x'"):
        motion_readers.read(tmp_path / "b.glb", ReadOptions(skeleton="x"))


def stage(path):
    made = usd_files.stage(path)
    still = np.tile(quat.IDENTITY, (FRAMES, 1))
    usd_files.animation(made, "/Root/Anim", CODES, np.stack([SWING, still], axis=1))
    return made


def no_rest(made):
    made.GetPrimAtPath("/Root/Skel").RemoveProperty("restTransforms")


def no_poses(made):
    no_rest(made)
    made.GetPrimAtPath("/Root/Skel").RemoveProperty("bindTransforms")


def only_rotations(made):
    for name in ("scales", "translations"):
        made.GetPrimAtPath("/Root/Anim").RemoveProperty(name)


def second_animation(made):
    usd_files.animation(made, "/Root/Run", CODES, np.ones((FRAMES, 2, 4)), bind_to=None)


def missing_look(made):
    made.DefinePrim("/Looks").GetReferences().AddReference("none.usda")


def missing_layer(made):
    made.GetRootLayer().subLayerPaths.append("none.usda")


def narrow(made):
    made.SetStartTimeCode(2)
    made.SetEndTimeCode(5)


def second_skeleton(made):
    UsdSkel.Root.Define(made, "/Prop")
    usd_files.skeleton(made, "/Prop/Skel", joints=["hilt", "hilt/tip"])


def illegal(made):
    names = ["upper", "upper/lower left"]
    for path in ("/Root/Skel", "/Root/Anim"):
        made.GetPrimAtPath(path).GetAttribute("joints").Set(names)


def smiling(made):
    own = UsdSkel.Animation(made.GetPrimAtPath("/Root/Anim"))
    own.CreateBlendShapesAttr(["smile"])
    for code in CODES.tolist():
        own.CreateBlendShapeWeightsAttr().Set(Vt.FloatArray([0.5 * code / FRAMES]), code)


def instances(made):
    made.DefinePrim("/Kit")
    for name in ("Root", "Two"):
        prim = made.DefinePrim(f"/Kit/{name}")
        prim.GetReferences().AddInternalReference("/Root")
        prim.SetInstanceable(True)
    made.GetPrimAtPath("/Root").SetSpecifier(Sdf.SpecifierClass)


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (no_rest, "no restTransforms: the bindTransforms were taken"),
        (no_poses, "no restTransforms: the first frame was taken"),
        (only_rotations, "no translations and scales: those at rest were taken"),
        (second_animation, "/Root/Anim moves /Root/Skel: /Root/Run left out"),
        (missing_layer, "/ refers to what cannot be read, which was left out.*none.usda"),
        (missing_look, "/Looks refers to what cannot be read, which was left out.*none.usda"),
        (narrow, "time codes 2 to 5: all samples, 0 to 12, were read"),
        (second_skeleton, "skeleton /Root/Skel was read: /Prop/Skel left out"),
        (illegal, None),
        (smiling, r"curves \(smile\) are no joints"),
        (instances, None),
    ],
)
def test_the_skeleton_of_a_usd_file_is_read(tmp_path, change, note):
    made = stage(tmp_path / "a.usda")
    change(made)
    made.GetRootLayer().Save()
    found = motion_readers.read(tmp_path / "a.usda")
    assert np.abs(places(found)[:, 1] - HAND).max() < 1e-6
    assert_noted(found, note)
    # Clients of the service read such notes of characters.
    assert str(tmp_path) not in "".join(found.notes)
    if change is smiling:
        assert np.allclose(found.curves["smile"], 0.5 * CODES / FRAMES)
