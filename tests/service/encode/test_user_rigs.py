"""Files of a user's character: read by usd-core and by the rules of glTF, they show its motion."""

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel, Vt
from user_rigs import glb_positions, glb_rig, read_glb, stage_positions, usd_rig

from posefield.characters.user_character import open_character
from posefield.common.errors import FileError, InvalidField
from posefield.encode.character import Convention
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion.clip import Clip
from posefield.question.motion_question import FileQuestion
from posefield.question.results import SampledClip, Trust

FRAMES = (0, 3, 7)
NEAR = 2e-5
"""Difference of positions that float32 leaves, m."""
TRUST = Trust("walk@0000000000000000", {}, None, 0, 1.0, 0.0, True, ())
ASKED = FileQuestion(controls={})
FILES = {
    "y.usdc": lambda path, card: usd_rig(path, card, 0.7, Convention(1.0, "y")),
    "z.usdc": usd_rig,
    "g.glb": glb_rig,
}


@pytest.fixture(scope="module", params=FILES)
def character(request, shipped_walk, tmp_path_factory):
    path = tmp_path_factory.mktemp("rigs") / request.param
    FILES[request.param](path, shipped_walk.session.card)
    return open_character(path, f"./{path.name}")


@pytest.fixture(scope="module")
def motion(character):
    """A motion of all joints of the rig."""
    rng, rig = np.random.default_rng(5), character.rig
    turns = rng.standard_normal((8, len(rig.skeleton), 4)) * 0.2 + np.array([1.0, 0.0, 0.0, 0.0])
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    places = np.tile(rig.skeleton.offsets, (8, 1, 1))
    places[:, 0] += np.linspace(0.0, 2.0, 8)[:, None] * np.array([0.3, 0.02, 1.0])
    return SampledClip(Clip(rig.skeleton, turns, places, 30.0), TRUST)


def written(character, motion, form):
    encoder = CLIP_ENCODERS[form]
    return character.encode(encoder, motion, character.convention(encoder, ASKED))


def usd_file(character, motion, form="usda"):
    path = character.rig.path.parent / f"made-{character.name}.{form}"
    path.write_bytes(written(character, motion, form))
    return path


@pytest.mark.parametrize("form", ["usda", "usdc"])
def test_usd_shows_the_motion_of_the_rig(character, motion, form):
    path = usd_file(character, motion, form)
    expected = motion.clip.positions()
    for frame in FRAMES:
        joints, _ = stage_positions(path, frame)
        assert np.abs(joints - expected[frame]).max() < NEAR
        # Negative control: a frame later the joints are elsewhere.
        assert np.abs(joints - expected[frame - 1]).max() > 0.05


def test_usd_refers_to_the_file_and_copies_neither_bind_nor_skin(character, motion):
    if character.rig.format != "USD":
        pytest.skip("USD cannot refer to glTF")
    path = usd_file(character, motion)
    layer = Sdf.Layer.FindOrOpen(str(path))
    (reference,) = layer.GetPrimAtPath("/Character").referenceList.prependedItems
    assert (reference.assetPath, str(reference.primPath)) == (f"./{character.file}", "/Character")
    text = path.read_text()
    for own in ("bindTransforms", "restTransforms", "points", "skel:jointWeights", "Mesh"):
        assert own not in text
    stage = Usd.Stage.Open(layer)
    rest = character.rig.rest
    assert UsdGeom.GetStageMetersPerUnit(stage) == rest.metres_per_unit
    assert UsdGeom.GetStageUpAxis(stage) == rest.up.upper()
    assert stage.GetPrimAtPath("/Character/Body").IsA(UsdGeom.Mesh)


def test_the_mesh_of_the_file_moves_within_the_extent(character, motion):
    if character.rig.format != "USD":
        pytest.skip("USD cannot refer to glTF")
    path = usd_file(character, motion)
    still = stage_positions(character.rig.path, 0)[1]
    stage = Usd.Stage.Open(str(path))
    root = UsdGeom.Boundable(stage.GetPrimAtPath("/Character"))
    world = np.array(UsdGeom.XformCache(0).GetLocalToWorldTransform(root.GetPrim()))
    low, high = np.array(root.GetExtentAttr().Get(), float)
    for frame in FRAMES:
        joints, points = stage_positions(path, frame)
        assert len(points) == len(still) > 100
        assert np.abs(points - still).max() > 0.1
        apart = np.linalg.norm(points[:, None] - joints[None], axis=-1).min(axis=1)
        assert apart.max() < 0.3
        unit, up = character.rig.rest.metres_per_unit, character.rig.rest.up
        own = points if up == "y" else points[:, [0, 2, 1]] * np.array([1.0, -1.0, 1.0])
        local = (own / unit - world[3, :3]) @ np.linalg.inv(world[:3, :3])
        assert np.all(local > low - 1e-3) and np.all(local < high + 1e-3)
        # Negative control: the box is not far too large.
        assert np.ptp(local, axis=0).max() * unit > 0.2 * np.ptp((low, high), axis=0).max() * unit


def test_glb_animates_the_nodes_of_the_file(character, motion):
    content = written(character, motion, "glb")
    expected = motion.clip.positions()
    for frame in FRAMES:
        names, positions = glb_positions(content, frame)
        assert tuple(names) == character.rig.rest.names
        assert np.abs(positions - expected[frame]).max() < NEAR
        assert np.abs(positions - expected[frame - 1]).max() > 0.05
    document, _ = read_glb(content)
    assert "meshes" not in document and "skins" not in document
    assert document["asset"]["extras"]["posefield"]["model"] == TRUST.model


@pytest.mark.parametrize(
    ("form", "asked", "said"),
    [
        ("usda", {"names": "ue5"}, "names: 'ue5' with a character, expected 'own'"),
        ("json", {"joint_sigma": True}, "joint_sigma: true with a character, expected false"),
        ("usdc", {"unit": "m", "up": "z"}, "expected none given: the layer has the unit"),
    ],
)
def test_what_a_file_cannot_hold_is_refused(character, form, asked, said):
    question = replace_question(asked)
    with pytest.raises(InvalidField, match=said):
        character.check(question)
        character.convention(CLIP_ENCODERS[form], question)


def replace_question(asked):
    return FileQuestion(controls={}, **asked)


def _without_binds(stage):
    stage.GetPrimAtPath("/Character/Skel").RemoveProperty("bindTransforms")


def _of_no_joint(stage):
    body = UsdSkel.BindingAPI(stage.GetPrimAtPath("/Character/Body"))
    indices = np.array(body.GetJointIndicesAttr().Get())
    body.GetJointIndicesAttr().Set(Vt.IntArray([5000] * len(indices)))


def _of_other_length(stage):
    body = UsdSkel.BindingAPI(stage.GetPrimAtPath("/Character/Body"))
    body.GetJointWeightsAttr().Set(Vt.FloatArray([1.0, 0.0]))


@pytest.mark.parametrize("broken", [_without_binds, _of_no_joint, _of_other_length])
def test_skins_that_break_their_format_are_refused(tmp_path, shipped_walk, broken):
    path = tmp_path / "hero.usdc"
    usd_rig(path, shipped_walk.session.card)
    open_character(path, "./hero.usdc")
    stage = Usd.Stage.Open(str(path))
    broken(stage)
    stage.GetRootLayer().Save()
    with pytest.raises(FileError, match=r"hero\.usdc"):
        open_character(path, "./hero.usdc")
