"""Tests of the check of our own files: a planted defect of each kind is found."""

import numpy as np
import pytest
from pxr import Sdf, Vt
from usd_checks import defects

from posefield.encode.formats import CLIP_ENCODERS


@pytest.fixture
def layer(walk, tmp_path):
    path = tmp_path / "damaged.usda"
    path.write_bytes(CLIP_ENCODERS["usda"].encode(walk))
    return Sdf.Layer.FindOrOpen(str(path))


def renamed(layer):
    for prim in ("Skel", "Anim"):
        joints = layer.GetAttributeAtPath(f"/Character/{prim}.joints")
        joints.default = Vt.TokenArray([each.replace("Neck", "1Neck") for each in joints.default])


def flipped(layer):
    path = "/Character/Anim.rotations"
    turned = -np.array(layer.QueryTimeSample(path, 3))
    layer.SetTimeSample(path, 3, Vt.QuatfArray.FromNumpy(turned.astype("f4")))


def narrow(layer):
    spec = layer.GetAttributeAtPath("/Character.extent")
    spec.default = Vt.Vec3fArray.FromNumpy(0.5 * np.array(spec.default, "f4"))


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda layer: layer.pseudoRoot.ClearInfo("upAxis"), "no upAxis"),
        (renamed, "illegal"),
        (lambda layer: layer.EraseTimeSample("/Character/Anim.rotations", 3), "frames without"),
        (flipped, "changes of sign"),
        (narrow, "outside the extent"),
        (lambda layer: layer.GetPrimAtPath("/Character/Skel").ClearInfo("apiSchemas"), "API"),
    ],
)
def test_a_planted_defect_is_found(layer, damage, words):
    assert defects(layer.realPath) == []
    damage(layer)
    layer.Save()
    assert any(words in line for line in defects(layer.realPath))
