"""Tests of the choice of a body: what each kind writes, and which formats refuse one."""

import json
import struct

import conftest
import crowds
import numpy as np
import pytest
from pxr import Usd, UsdShade, UsdSkel

from posefield.common.errors import InvalidField
from posefield.encode import crowd_writer
from posefield.encode.formats import CLIP_ENCODERS

BODILESS = [name for name, each in CLIP_ENCODERS.items() if not each.has_body]
KINDS = ("none", "mannequin", "bones")


def stage_of(walk, folder, ending, kind):
    encoder = CLIP_ENCODERS[ending]
    path = folder / f"clip.{ending}"
    path.write_bytes(encoder.encode(walk, encoder.convention(None, None, kind)))
    return Usd.Stage.Open(str(path))


def document(content):
    (length,) = struct.unpack_from("<L", content, 12)
    return json.loads(content[20 : 20 + length])


@pytest.mark.parametrize("ending", BODILESS)
def test_a_format_without_a_body_refuses_one(ending):
    with pytest.raises(InvalidField, match=f"body: 'bones', .*{ending} files carry no body"):
        CLIP_ENCODERS[ending].convention(None, None, "bones")
    assert CLIP_ENCODERS[ending].convention(None, None).body == "mannequin"


@pytest.mark.parametrize("ending", ["usda", "usdc", "usdz"])
def test_no_body_is_a_skeleton_that_moves(walk, tmp_path, ending):
    stage = stage_of(walk, tmp_path, ending, "none")
    kinds = [prim.GetTypeName() for prim in stage.Traverse()]
    assert kinds == ["SkelRoot", "Skeleton", "SkelAnimation"]
    query = UsdSkel.Cache().GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath("/Character/Skel")))
    moved = np.array(query.ComputeJointSkelTransforms(20))[:, 3, :3]
    np.testing.assert_allclose(moved, walk.clip.positions()[20], atol=1e-5)


@pytest.mark.parametrize("kind", ["mannequin", "bones"])
def test_a_body_wears_a_material(walk, tmp_path, kind):
    stage = stage_of(walk, tmp_path, "usdc", kind)
    body = stage.GetPrimAtPath("/Character/Body")
    material, _ = UsdShade.MaterialBindingAPI(body).ComputeBoundMaterial()
    surface, _, _ = material.ComputeSurfaceSource()
    assert surface.GetIdAttr().Get() == "UsdPreviewSurface"
    colour = surface.GetInput("diffuseColor")
    if kind == "mannequin":
        shown = body.GetAttribute("primvars:displayColor").Get()
        np.testing.assert_allclose(colour.Get(), shown[0])
    else:
        reader, name, _ = colour.GetConnectedSource()
        assert name == "result"
        assert UsdShade.Shader(reader).GetInput("varname").Get() == "displayColor"


@pytest.mark.parametrize("kind", KINDS)
def test_gltf_has_the_body_that_is_asked_for(walk, kind):
    encoder = CLIP_ENCODERS["glb"]
    found = document(encoder.encode(walk, encoder.convention(None, None, kind)))
    joints = len(walk.clip.skeleton)
    if kind == "none":
        assert not {"meshes", "skins", "materials"} & set(found)
        assert len(found["nodes"]) == joints
        return
    attributes = found["meshes"][0]["primitives"][0]["attributes"]
    assert ("COLOR_0" in attributes) == (kind == "bones")
    assert ("baseColorFactor" in found["materials"][0]["pbrMetallicRoughness"]) == (
        kind == "mannequin"
    )
    assert len(found["nodes"]) == joints + 1


@pytest.mark.parametrize(
    ("instancing", "kind"),
    [("references", "none"), ("scenegraph", "mannequin"), ("flatten", "bones")],
)
def test_a_crowd_has_the_body_that_is_asked_for(tmp_path, instancing, kind):
    person = conftest.person()
    made = crowds.motions(person, 2, 5)
    path = tmp_path / "crowd.usda"
    crowd_writer.write(crowds.crowd(person, made, np.array([0, 1, 1])), path, instancing, kind)
    stage = Usd.Stage.Open(str(path))
    meshes = [prim for prim in stage.TraverseAll() if prim.GetTypeName() == "Mesh"]
    assert (not meshes) == (kind == "none")
    again = crowds.crowd(person, crowds.motions(person, 2, 5), np.array([0, 1, 1]))
    sent = b"".join(crowd_writer.stream(again, "usda", instancing, kind))
    assert sent == path.read_bytes()
