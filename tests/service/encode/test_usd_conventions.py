"""Tests of units and axes of USD files with UsdSkel: equal positions."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel

from posefield.encode.character import Convention
from posefield.encode.formats import CENTIMETRES, CLIP_ENCODERS, METRES

CONVENTIONS = [METRES, CENTIMETRES, Convention(1.0, "z"), Convention(0.0254, "z")]
FRAMES = (0, 20, 44)

# float32 keeps 1e-7 of a coordinate, and errors add up along the chain of joints.
NEAR = 1e-5


@pytest.fixture(params=CONVENTIONS, ids=str)
def convention(request):
    return request.param


@pytest.fixture
def path(convention, walk, tmp_path):
    return written(convention, walk, tmp_path)


def written(convention, walk, folder):
    path = folder / "clip.usdc"
    path.write_bytes(CLIP_ENCODERS["usdc"].encode(walk, convention))
    return path


def metres(stage, places):
    """Places (..., 3) of a stage by what it says of its units and axes, in metres and Y up."""
    metric = np.asarray(places) * UsdGeom.GetStageMetersPerUnit(stage)
    if UsdGeom.GetStageUpAxis(stage) == "Y":
        return metric
    x, y, z = np.moveaxis(metric, -1, 0)
    return np.stack([x, z, -y], axis=-1)


def opened(path):
    stage = Usd.Stage.Open(str(path))
    cache, root = UsdSkel.Cache(), UsdSkel.Root(stage.GetPrimAtPath("/Character"))
    cache.Populate(root, Usd.PrimDefaultPredicate)
    skeleton = cache.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath("/Character/Skel")))
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    (skin,) = binding.GetSkinningTargets()
    return stage, skeleton, skin


def joints(path, frame):
    stage, skeleton, _ = opened(path)
    return metres(stage, np.array(skeleton.ComputeJointSkelTransforms(frame))[:, 3, :3])


def points(path, frame):
    _stage, skeleton, skin = opened(path)
    found = UsdGeom.Mesh(skin.GetPrim()).GetPointsAttr().Get()
    assert skin.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(frame), found, frame)
    return np.array(found)


def test_joints_are_where_they_are_in_metres(path, walk):
    for frame in FRAMES:
        expected = walk.clip.positions()[frame]
        np.testing.assert_allclose(joints(path, frame), expected, atol=NEAR)


def test_units_or_axes_that_are_stated_but_not_kept_would_be_seen(walk, tmp_path):
    path = written(METRES, walk, tmp_path)
    for name, value in (("metersPerUnit", 0.01), ("upAxis", "Z")):
        stage = Usd.Stage.Open(str(path))
        stage.SetMetadata(name, value)
        stage.Save()
        assert np.abs(joints(path, 20) - walk.clip.positions()[20]).max() > 0.1
        written(METRES, walk, tmp_path)
        stage.Reload()


def test_the_body_and_its_extent_are_where_they_are_in_metres(path, walk, tmp_path_factory):
    plain = written(METRES, walk, tmp_path_factory.mktemp("plain"))
    stage, _, _ = opened(path)
    low, high = np.array(stage.GetAttributeAtPath("/Character.extent").Get())
    for frame in FRAMES:
        found = points(path, frame)
        np.testing.assert_allclose(metres(stage, found), points(plain, frame), atol=NEAR)
        assert np.all(found >= low) and np.all(found <= high)
    other, _, _ = opened(plain)
    expected = np.array(other.GetAttributeAtPath("/Character.extent").Get())
    corners = np.sort(metres(stage, [low, high]), axis=0)
    np.testing.assert_allclose(corners, expected, atol=NEAR)
