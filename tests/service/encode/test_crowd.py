"""Tests of USD composition and skinning of crowds against the project's kinematics."""

import conftest
import crowds
import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel
from usd_checks import defects

from posefield.encode import character, crowd_writer

MOTION = [0, 1, 2, 3, 4, 2, 0, 1]
FRAMES = 12
LOOKED_AT = (0, 4, 11)
# float32 keeps 2e-6 of the 20 m that characters stand apart, and errors add up along the joints.
NEAR = 3e-5


@pytest.fixture(scope="module")
def made():
    return crowds.motions(conftest.person(), 5, FRAMES)


@pytest.fixture(scope="module")
def clip(made):
    """The crowd, but for its motions."""
    return crowds.crowd(conftest.person(), made, MOTION)


@pytest.fixture(scope="module", params=crowds.LAYOUTS, ids="-".join)
def layout(request):
    return request.param


@pytest.fixture(scope="module")
def instancing(layout):
    return layout[1]


@pytest.fixture(scope="module")
def path(layout, made, instancing, tmp_path_factory):
    found = tmp_path_factory.mktemp(instancing) / f"crowd.{layout[0]}"
    crowd_writer.write(crowds.crowd(conftest.person(), made, MOTION), found, instancing)
    return found


@pytest.fixture(scope="module")
def stage(path):
    return Usd.Stage.Open(str(path))


def characters(stage, root="/Crowd"):
    return stage.GetPrimAtPath(f"{root}/Characters").GetChildren()


def below(prim, name):
    return prim.GetStage().GetPrimAtPath(prim.GetPath().AppendChild(name))


def queries(prim):
    """USD's own reading of one character; the cache must be kept."""
    cache, root = UsdSkel.Cache(), UsdSkel.Root(prim)
    assert cache.Populate(root, Usd.TraverseInstanceProxies())
    return cache, root, cache.GetSkelQuery(UsdSkel.Skeleton(below(prim, "Skel")))


def placed(prim, frame):
    """World positions (J, 3) of a character's joints at a frame, m."""
    _, _, skeleton = queries(prim)
    # The query's own world is the prototype's where characters are instances of one.
    return stands(prim, np.array(skeleton.ComputeJointSkelTransforms(frame))[:, 3, :3])


def error(stage, expected):
    """Largest distance of any character's joint at some frames from where it should be, m."""
    found = np.array([[placed(prim, frame) for frame in LOOKED_AT] for prim in characters(stage)])
    return np.max(np.linalg.norm(found - expected[:, list(LOOKED_AT)], axis=-1))


def test_every_joint_of_every_character_is_where_our_kinematics_put_it(stage, clip, made):
    assert error(stage, crowds.positions(clip, made)) < NEAR


def test_extents_hold_all_that_is_drawn(stage):
    world = box(stage, "/Crowd", "extentsHint")
    np.testing.assert_array_equal(world, box(stage, "/Crowd/Characters", "extentsHint"))
    for prim in characters(stage):
        own = box(stage, prim.GetPath(), "extent")
        body = box(stage, below(prim, "Body").GetPath(), "extent")
        for frame in range(FRAMES):
            points = skinned(prim, frame)
            assert inside(points, own) and inside(points, body)
            assert inside(stands(prim, points), world)


def box(stage, path, name):
    attribute = stage.GetPrimAtPath(path).GetAttribute(name)
    assert attribute.GetNumTimeSamples() == 0
    return np.array(attribute.Get())


def inside(points, corners):
    return np.all(points >= corners[0]) and np.all(points <= corners[1])


def skinned(prim, frame):
    """Points of a character's body in its own frame, as USD's own skinning places them."""
    cache, root, skeleton = queries(prim)
    (binding,) = cache.ComputeSkelBindings(root, Usd.TraverseInstanceProxies())
    (target,) = binding.GetSkinningTargets()
    points = UsdGeom.Mesh(target.GetPrim()).GetPointsAttr().Get()
    assert target.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(frame), points, frame)
    return np.array(points)


def stands(prim, points):
    matrix = np.array(UsdGeom.XformCache(0).GetLocalToWorldTransform(prim))
    return points @ matrix[:3, :3] + matrix[3, :3]


def test_instances_share_one_prototype_and_others_none(stage, instancing):
    expected = 1 if instancing == "scenegraph" else 0
    assert len(stage.GetPrototypes()) == expected
    assert {prim.IsInstance() for prim in characters(stage)} == {bool(expected)}


def test_what_plays_one_motion_shares_its_animation_unless_flattened(stage, instancing):
    played = [animation(prim) for prim in characters(stage)]
    if instancing == "flatten":
        assert len(set(played)) == len(MOTION)
        # three.js names an animation by its own name alone.
        assert [path.name for path in played] == [prim.GetName() for prim in characters(stage)]
    else:
        assert [path.pathString for path in played] == [f"/Crowd/Motions/m{m:05}" for m in MOTION]


def animation(prim):
    skeleton = UsdSkel.BindingAPI(below(prim, "Skel"))
    return skeleton.GetInheritedAnimationSource().GetPath()


def test_animations_are_baked_named_and_of_one_sign(stage, clip, made):
    paths = character.joint_paths(character.legal_names(clip.skeleton.names), clip.skeleton.parents)
    for prim in characters(stage):
        played = stage.GetPrimAtPath(animation(prim))
        assert tuple(played.GetAttribute("joints").Get()) == paths
        assert np.all(np.array(played.GetAttribute("scales").Get()) == 1)
        turns = played.GetAttribute("rotations")
        assert turns.GetTimeSamples() == list(range(FRAMES))
        values = np.array([turns.Get(frame) for frame in range(FRAMES)])
        assert np.all(np.sum(values[1:] * values[:-1], axis=-1) > 0)
    given = made.rotations
    assert np.any(np.sum(given[:, 1:] * given[:, :-1], axis=-1) < 0)


def test_the_stage_states_units_times_and_facts(stage):
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, FRAMES - 1)
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 30
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    facts = stage.GetRootLayer().customLayerData["posefield"]
    assert (facts["model"], facts["seed"]) == ("walk@0123abcd", 7)
    assert facts["controls"]["speed"] == 1.25
    assert list(facts["controls"]["from"]) == [0.5, 1.5]
    assert list(facts["warnings"]) == ["speed is beyond 1.2"]
    assert "performer" not in facts


def test_our_own_check_and_the_official_ones_find_nothing(path):
    assert all("missing-frame" in each or "frames without" in each for each in defects(path))


def test_headings_that_are_left_out_would_be_seen(made, clip, tmp_path):
    standing = type(clip.placement)(clip.placement.positions, 0 * clip.placement.headings)
    given = vars(clip) | {"batches": crowds.cut(made, 2), "placement": standing}
    crowd_writer.write(type(clip)(**given), tmp_path / "wrong.usdc", "references")
    stage = Usd.Stage.Open(str(tmp_path / "wrong.usdc"))
    assert error(stage, crowds.positions(clip, made)) > 0.1
