"""Curves of clips in every format that carries them, with usd-core as the oracle of USD."""

from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd, UsdSkel
from user_rigs import read_glb

from posefield.encode import character, layers, usd_clip
from posefield.encode.character import METRES
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion.curves import Curve, CurveValues
from posefield.question.results import ClipAnswer

FLOAT32 = 1e-7
NAMES = ("jawOpen", "Mouth Smile", "眉")


def curves(count, frames, seed=0):
    rng = np.random.default_rng(seed)
    own = tuple(Curve(f"shape{index}", 0.0, 1.0, 0.02) for index in range(count))
    return CurveValues(own, rng.uniform(0.0, 1.0, (frames, count)))


def with_curves(answer, own):
    return ClipAnswer(replace(answer.clip, curves=own), answer.trust)


@pytest.fixture
def face(walk):
    """The walk with three curves, of names that USD does not allow for prims."""
    own = curves(3, len(walk.clip))
    named = tuple(replace(one, name=name) for one, name in zip(own.curves, NAMES, strict=True))
    return with_curves(walk, CurveValues(named, own.values))


def stage(content, path):
    path.write_bytes(content)
    return Usd.Stage.Open(str(path))


@pytest.mark.parametrize(
    ("ending", "body"), [("usda", "mannequin"), ("usdc", "bones"), ("usdz", "none")]
)
def test_usd_skel_reads_the_weights_of_every_frame(face, ending, body, tmp_path):
    said = replace(METRES, body=body)
    opened = stage(CLIP_ENCODERS[ending].encode(face, said), tmp_path / f"face.{ending}")
    animation = UsdSkel.Animation(opened.GetPrimAtPath("/Character/Anim"))
    assert tuple(animation.GetBlendShapesAttr().Get()) == NAMES
    weights = animation.GetBlendShapeWeightsAttr()
    found = np.array([weights.Get(frame) for frame in weights.GetTimeSamples()])
    assert np.abs(found - face.clip.curve_values).max() < FLOAT32
    assert np.abs(found[1:] - face.clip.curve_values[:-1]).max() > 0.1


@pytest.mark.parametrize("body", ["mannequin", "bones"])
def test_the_body_has_a_blend_shape_for_each_curve_that_moves_no_point(face, body, tmp_path):
    content = CLIP_ENCODERS["usdc"].encode(face, replace(METRES, body=body))
    opened = stage(content, tmp_path / "face.usdc")
    skinned = UsdSkel.BindingAPI(opened.GetPrimAtPath("/Character/Body"))
    shapes = UsdSkel.BlendShapeQuery(skinned)
    assert tuple(skinned.GetBlendShapesAttr().Get()) == NAMES
    assert shapes.GetNumBlendShapes() == len(NAMES)
    targets = [path.name for path in skinned.GetBlendShapeTargetsRel().GetTargets()]
    assert targets == list(character.legal_names(NAMES))
    for target in skinned.GetBlendShapeTargetsRel().GetTargets():
        shape = UsdSkel.BlendShape(opened.GetPrimAtPath(target))
        assert np.all(np.array(shape.GetOffsetsAttr().Get()) == 0.0)


SPARSE = 0.9
"""Share of the frames whose curves rest at zero, as a face's do."""


@pytest.mark.parametrize(
    ("count", "kind"),
    [
        *((count, "busy") for count in (1, 3, 4, 15, 16)),
        *((52, kind) for kind in ("resting", "tiny", "few")),
    ],
)
def test_templates_write_the_weights_as_usd_core_does(walk, count, kind):
    for seed in range(4):
        own = curves(count, len(walk.clip), seed)
        rng = np.random.default_rng(seed)
        values = own.values.copy()
        if kind == "resting":
            values[rng.uniform(size=len(values)) < SPARSE] = 0.0
        if kind == "tiny":
            values *= 1e-7
        if kind == "few":
            values = np.round(2.0 * values) / 2.0
        made = with_curves(walk, CurveValues(own.curves, values))
        ((author, content),) = usd_clip.builders_and_contents([made], METRES)
        expected = author.layer(content).ExportToString().encode()
        assert usd_clip.usda([made], METRES) == [expected]
        (binary,) = usd_clip.usdc([made], METRES)
        assert layers.crate_text(binary).encode() == expected


@pytest.mark.parametrize("body", ["mannequin", "none"])
def test_gltf_has_a_named_morph_target_for_each_curve(face, body):
    document, binary = read_glb(CLIP_ENCODERS["glb"].encode(face, replace(METRES, body=body)))
    (mesh,) = document["meshes"]
    assert mesh["extras"]["targetNames"] == list(NAMES)
    assert [len(one["targets"]) for one in mesh["primitives"]] == [len(NAMES)]
    (animation,) = document["animations"]
    (channel,) = [one for one in animation["channels"] if one["target"]["path"] == "weights"]
    assert document["nodes"][channel["target"]["node"]]["mesh"] == 0
    assert channel["target"]["node"] in document["scenes"][0]["nodes"]
    accessor = document["accessors"][animation["samplers"][channel["sampler"]]["output"]]
    view = document["bufferViews"][accessor["bufferView"]]
    found = np.frombuffer(binary, "<f4", accessor["count"], view["byteOffset"])
    expected = face.clip.curve_values
    assert np.abs(found.reshape(expected.shape) - expected).max() < FLOAT32
    assert np.abs(found.reshape(expected.shape[::-1]).T - expected).max() > 0.1
