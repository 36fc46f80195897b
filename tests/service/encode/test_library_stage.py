"""Tests of library stages with UsdSkel: every clip animates the shared character."""

from dataclasses import replace

import conftest
import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel

from posefield.encode import extent, layers, usd_clip, usd_library
from posefield.encode.character import Convention
from posefield.encode.formats import CENTIMETRES, METRES
from posefield.question.results import ClipAnswer

INCHES = Convention(0.0254, "z")
NAMES = ("walk 1", "walk-1", "ok")

# float32 keeps 1e-7 of a coordinate, and errors add up along the chain of joints.
NEAR = 1e-5


@pytest.fixture(scope="module")
def answers(walk):
    """Clips that differ in length, in bones, in where they go, and one in its rate."""
    slow, moves = conftest.answer(30, 15.0), 1.2 * walk.clip.translations
    moves[:, 0] += (3.0, 0.0, 0.0)
    return [walk, ClipAnswer(replace(walk.clip, translations=moves), walk.trust), slow]


def build(folder, answers, convention=METRES, rate=30.0):
    entries = []
    files = usd_clip.animation_usdc(answers, convention)
    for name, answer, layer in zip(NAMES, answers, files, strict=False):
        file = f"clips/00@/{name}.usdc"
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(layer)
        clip = answer.clip
        box = extent.pose_independent_box(clip.skeleton, clip.translations[0], clip.root_path)
        ends = map(tuple, box.tolist())
        entries.append(usd_library.LibraryEntry(name, file, len(clip), clip.rate, *ends))
    path = folder / "character.usd"
    path.write_bytes(usd_library.library_stage(conftest.person(), convention, rate, entries))
    return path


def metres(stage, places):
    metric = np.asarray(places) * UsdGeom.GetStageMetersPerUnit(stage)
    x, y, z = np.moveaxis(metric, -1, 0)
    return metric if UsdGeom.GetStageUpAxis(stage) == "Y" else np.stack([x, z, -y], axis=-1)


def posed(stage, name, code):
    """Joint positions (J, 3) in the clip of that name at a time code, m."""
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/Character/Skel"))
    source = f"/Character/Clips/{name}"
    UsdSkel.BindingAPI(skeleton).GetAnimationSourceRel().SetTargets([source])
    cache, root = UsdSkel.Cache(), UsdSkel.Root(stage.GetPrimAtPath("/Character"))
    assert cache.Populate(root, Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(skeleton)
    return metres(stage, np.array(query.ComputeJointSkelTransforms(code))[:, 3, :3])


@pytest.mark.parametrize("convention", [METRES, CENTIMETRES, INCHES], ids=str)
def test_every_clip_poses_the_character(answers, convention, tmp_path):
    stage = Usd.Stage.Open(str(build(tmp_path, answers, convention)))
    for name, answer in zip(("walk_1", "walk_1_2", "ok"), answers, strict=True):
        for frame in (0, 13, len(answer.clip) - 1):
            # USD scales time codes between layers of different rates.
            found = posed(stage, name, frame * 30.0 / answer.clip.rate)
            np.testing.assert_allclose(found, answer.clip.positions()[frame], atol=2 * NEAR)
    other = posed(stage, "walk_1", 13) - answers[1].clip.positions()[13]
    assert np.abs(other).max() > 0.1


@pytest.mark.parametrize("convention", [METRES, INCHES], ids=str)
def test_the_extent_holds_the_body_in_every_clip(answers, convention, tmp_path):
    stage = Usd.Stage.Open(str(build(tmp_path, answers, convention)))
    low, high = np.array(stage.GetAttributeAtPath("/Character.extent").Get())
    size = (high - low) * convention.metres_per_unit
    assert np.all(size < 8.0)
    for name in ("walk_1", "walk_1_2", "ok"):
        for code in (0, 20, 44):
            posed(stage, name, code)
            points = skinned(stage, code)
            assert np.all(points >= low) and np.all(points <= high)


def skinned(stage, code):
    cache, root = UsdSkel.Cache(), UsdSkel.Root(stage.GetPrimAtPath("/Character"))
    cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    (skin,) = binding.GetSkinningTargets()
    points = UsdGeom.Mesh(skin.GetPrim()).GetPointsAttr().Get()
    transforms = cache.GetSkelQuery(binding.GetSkeleton()).ComputeSkinningTransforms(code)
    assert skin.ComputeSkinnedPoints(transforms, points, code)
    return np.array(points)


@pytest.mark.parametrize("convention", [METRES, INCHES], ids=str)
def test_layers_are_as_usd_writes_them(answers, convention):
    many = [answers[index] for index in (0, 1, 0, 2, 1)]
    expected = [
        builder.layer(content).ExportToString()
        for builder, content in usd_clip.animation_contents(many, convention)
    ]
    found = usd_clip.animation_usdc(many, convention)
    assert [layers.crate_text(each) for each in found] == expected
    assert usd_clip.animation_usdc(many[1:2], convention) == found[1:2]
    assert len(set(expected)) == 3
