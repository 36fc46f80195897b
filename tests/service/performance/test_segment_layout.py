"""Tests of the layout of segments in USD: each is a part of the whole, and one animation is bound.

The oracle is usd-core, which reads what the encoders wrote.
"""

import json
from itertools import pairwise

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdSkel, UsdValidation

from posefield.encode import formats
from posefield.encode.formats import CLIP_ENCODERS
from posefield.encode.performance_layer import segment_frames
from posefield.inference import session
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis.synthesizer import Synthesizer

SCRIPT = {
    "segments": [
        {"kind": "walk", "model": "walk", "seconds": 2.0, "stop": "standing"},
        {"kind": "hold", "seconds": 0.51},
        {"kind": "walk", "model": "walk", "to": [0.5, 6.0], "start": "standing"},
    ]
}
SAMPLED = ("translations", "rotations")


@pytest.fixture(scope="module")
def perform(walk_path):
    walk = Synthesizer("walk", session.load(walk_path))

    def made(**more):
        content = json.dumps({**SCRIPT, **more}).encode()
        question = json_decoding.decode_question(PerformanceQuestion, content)
        return composition.perform(resolve_script(question, lambda _: walk), 2000)

    return made


@pytest.fixture(scope="module")
def answer(perform):
    return perform(fps=24.0)


def encoded(answer, name, layout="segments", **measures):
    form = CLIP_ENCODERS[name]
    convention = form.convention(measures.get("unit"), measures.get("up"))
    return formats.performance_encoder(form, layout)(answer, convention)


def opened(answer, path, **more):
    path.write_bytes(encoded(answer, path.suffix[1:], **more))
    return Usd.Stage.Open(str(path))


@pytest.fixture(params=formats.SEGMENTED)
def stage(request, answer, tmp_path):
    return opened(answer, tmp_path / f"performance.{request.param}")


def segments(stage):
    return stage.GetPrimAtPath("/Performance/Segments").GetChildren()


def values(prim, name, time):
    found = prim.GetAttribute(name).Get(time)
    if name == "rotations":
        return np.array([[q.GetReal(), *q.GetImaginary()] for q in found])
    return np.array(found)


def test_a_segment_has_the_samples_of_the_whole_at_its_times(stage, answer, rng):
    whole = stage.GetPrimAtPath("/Character/Anim")
    own = answer.trust.segments
    assert len(segments(stage)) == len(own) == 3
    for prim, span in zip(segments(stage), own, strict=True):
        assert prim.GetTypeName() == "SkelAnimation"
        assert prim.GetAttribute("joints").Get() == whole.GetAttribute("joints").Get()
        assert prim.GetAttribute("scales").Get() == whole.GetAttribute("scales").Get()
        last = answer.trust.frames - 1
        times = 24.0 * np.array([span.begins, span.ends, *rng.uniform(span.begins, span.ends, 5)])
        for name in SAMPLED:
            for time in np.minimum(times, last).tolist():
                same = values(whole, name, time)
                # The begin is rounded to a millionth of a second.
                np.testing.assert_allclose(values(prim, name, time), same, rtol=0, atol=1e-6)
    frames = [prim.GetAttribute("rotations").GetTimeSamples() for prim in segments(stage)]
    assert frames[0][0] == 0.0 and frames[-1][-1] == answer.trust.frames - 1
    # No time is outside of every segment, and neighbours share two frames at most.
    for one, other in pairwise(frames):
        assert one[-1] >= other[0] and one[-1] - other[0] <= 1.0


def test_skeletons_resolve_the_whole_alone(stage, answer, tmp_path):
    alone = opened(answer, tmp_path / "whole.usdc", layout="whole")
    assert not alone.GetPrimAtPath("/Performance")
    for time in (0.0, 30.5, float(answer.trust.frames - 1)):
        assert np.array_equal(pose(stage, time), pose(alone, time))
    targets = [
        str(target)
        for prim in stage.Traverse()
        for each in prim.GetRelationships()
        if each.GetName() == "skel:animationSource"
        for target in each.GetTargets()
    ]
    assert targets == ["/Character/Anim"]


def pose(stage, time):
    cache, root = UsdSkel.Cache(), UsdSkel.Root(stage.GetPrimAtPath("/Character"))
    assert cache.Populate(root, Usd.PrimDefaultPredicate)
    skeleton = cache.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath("/Character/Skel")))
    assert str(skeleton.GetAnimQuery().GetPrim().GetPath()) == "/Character/Anim"
    return np.array(skeleton.ComputeJointSkelTransforms(time))


def plain(value):
    """Return metadata of USD with dictionaries of the keys 0, 1, ... and arrays as lists."""
    if isinstance(value, dict):
        keys = [str(index) for index in range(len(value))]
        found = {key: plain(each) for key, each in value.items()}
        return [found[key] for key in keys] if value and set(value) == set(keys) else found
    return value if isinstance(value, str | float | int | bool) else [plain(each) for each in value]


def without_empty(value):
    """Return plain values without empty lists, which USD has in several forms."""
    if isinstance(value, dict):
        return {key: without_empty(each) for key, each in value.items() if each not in ([], {})}
    return [without_empty(each) for each in value] if isinstance(value, list) else value


def test_the_metadata_of_the_prims_is_the_report(stage, answer):
    said = plain(stage.GetPrimAtPath("/Performance").GetCustomDataByKey("posefield"))
    said["segments"] = [plain(prim.GetCustomDataByKey("posefield")) for prim in segments(stage)]
    report = json.loads(json.dumps(answer.trust.facts()))
    assert without_empty(said) == without_empty(report)
    assert [each["time"] for each in said["joins"]] == [own.time for own in answer.trust.joins]
    assert [prim.GetName() for prim in segments(stage)] == ["s000", "s001", "s002"]


def test_contacts_are_the_stances_of_the_report(stage, answer):
    scope = stage.GetPrimAtPath("/Performance")
    joints = list(scope.GetAttribute("posefield:contactJoints").Get())
    stances = answer.trust.feet.stances
    assert sorted(joints) == sorted({stance.joint for stance in stances})
    contact = scope.GetAttribute("posefield:contact")
    seen = set()
    for frame in range(answer.trust.frames):
        found = dict(zip(joints, contact.Get(frame), strict=True))
        seen |= set(found.values())
        for joint in joints:
            expected = any(
                own.joint == joint and own.begin - 1e-6 <= frame / 24.0 <= own.end + 1e-6
                for own in stances
            )
            assert found[joint] is expected
    assert seen == {False, True}


@pytest.mark.parametrize(("rate", "frames"), [(29.97, 200), (240.0, 1700)])
def test_frames_enclose_their_segment(rate, frames, rng):
    for _ in range(200):
        # Segments begin and end at a sixtieth of a second, rounded in the report.
        first, last = np.sort(rng.integers(0, int(60 * (frames - 1) / rate), 2))
        begins, ends = round(first / 60.0, 6), round(last / 60.0, 6)
        found = segment_frames(begins, ends, rate, frames)
        assert found[0] <= first / 60.0 * rate + 1e-9 < found[0] + 1.0
        assert found[-1] - 1.0 < last / 60.0 * rate - 1e-9 or found[0] == found[-1]
        assert found[-1] >= last / 60.0 * rate - 1e-9


def test_the_stage_complies(stage):
    """All validators of usd-core, as of usdchecker."""
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    assert [each.GetName() for each in context.Validate(stage)] == []
    assert stage.GetDefaultPrim().GetPath() == Sdf.Path("/Character")
