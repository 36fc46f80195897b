from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Vt

from posefield.check import Finding, check
from posefield.common.errors import UsdError
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion.clip import Clip
from posefield.question.results import ClipAnswer


def test_a_good_file_has_no_finding(good):
    assert check(good) == []


def test_a_pose_has_no_finding(answer, tmp_path):
    clip = answer.clip
    pose = Clip(clip.skeleton, clip.rotations[:1], clip.translations[:1], clip.rate)
    path = tmp_path / "pose.usdc"
    path.write_bytes(CLIP_ENCODERS["usdc"].encode(ClipAnswer(pose, answer.trust)))
    assert check(path) == []


def root(layer):
    return layer.GetPrimAtPath("/Character")


def skeleton(layer):
    return layer.GetPrimAtPath("/Character/Skel")


def animation(layer):
    return layer.GetPrimAtPath("/Character/Anim")


def body(layer):
    return layer.GetPrimAtPath("/Character/Body")


def drop(prim, name):
    prim.RemoveProperty(prim.properties[name])


def clear_samples(layer, name):
    path = f"/Character/Anim.{name}"
    for time in layer.ListTimeSamplesForPath(path):
        layer.EraseTimeSample(path, time)


def change_samples(layer, name, change):
    path = f"/Character/Anim.{name}"
    for time in layer.ListTimeSamplesForPath(path):
        layer.SetTimeSample(path, time, change(time, layer.QueryTimeSample(path, time)))


def rename(layer, change):
    """The same change to the joints of the skeleton and of the animation."""
    for prim in (skeleton(layer), animation(layer)):
        attribute = prim.attributes["joints"]
        attribute.default = Vt.TokenArray(change(list(attribute.default)))


def replaced(old, new):
    return lambda layer: rename(layer, lambda joints: [j.replace(old, new) for j in joints])


def no_metadata(key):
    return lambda layer: layer.pseudoRoot.ClearInfo(key)


def no_property(find, name):
    return lambda layer: drop(find(layer), name)


def no_api(find):
    return lambda layer: find(layer).ClearInfo("apiSchemas")


def fewer(find, name):
    def damage(layer):
        attribute = find(layer).attributes[name]
        attribute.default = attribute.default[:-1]

    return damage


def fewer_samples(name):
    return lambda layer: change_samples(layer, name, lambda _, value: value[:-1])


def no_default_prim(layer):
    layer.ClearDefaultPrim()


def unknown_default_prim(layer):
    layer.defaultPrim = "Nobody"


def late_start(layer):
    layer.startTimeCode = 1


def plain_transform(layer):
    root(layer).typeName = "Xform"


def no_skeleton(layer):
    skeleton(layer).typeName = "Xform"


def no_mesh(layer):
    del root(layer).nameChildren["Body"]


def unbound_mesh(layer):
    for prim in (root(layer), body(layer)):
        drop(prim, "skel:skeleton")


def texts_for_rotations(layer):
    drop(animation(layer), "rotations")
    texts = Sdf.AttributeSpec(animation(layer), "rotations", Sdf.ValueTypeNames.StringArray)
    texts.default = Vt.StringArray(["a"] * 6)


def no_components(layer):
    for name in ("translations", "rotations", "scales"):
        drop(animation(layer), name)


def children_first(layer):
    rename(layer, lambda joints: joints[::-1])


def joint_twice(layer):
    rename(layer, lambda joints: [*joints[:-1], joints[1]])


def skewed(name, matrix):
    def damage(layer):
        attribute = skeleton(layer).attributes[name]
        attribute.default = Vt.Matrix4dArray([matrix, *list(attribute.default)[1:]])

    return damage


def other_joints(layer):
    joints = animation(layer).attributes["joints"]
    joints.default = Vt.TokenArray(["Nobody", *list(joints.default)[1:]])


def default_pose(layer):
    for name in ("translations", "rotations"):
        path = f"/Character/Anim.{name}"
        layer.GetAttributeAtPath(path).default = layer.QueryTimeSample(path, 0)
        clear_samples(layer, name)


def lost_frame(layer):
    layer.EraseTimeSample("/Character/Anim.rotations", 3)


def frame_beyond_the_end(layer):
    path = "/Character/Anim.rotations"
    layer.SetTimeSample(path, 20, layer.QueryTimeSample(path, 0))


def rotations(change):
    """Samples as numpy x y z w, changed."""

    def turned(time, value):
        return Vt.QuatfArray.FromNumpy(change(time, np.array(value)).astype(np.float32))

    return lambda layer: change_samples(layer, "rotations", turned)


def endless(layer):
    def far(_, value):
        return Vt.Vec3fArray([Gf.Vec3f(float("nan")), *list(value)[1:]])

    change_samples(layer, "translations", far)


def indices(layer):
    attribute = body(layer).attributes["primvars:skel:jointIndices"]
    attribute.default = Vt.IntArray([6, *list(attribute.default)[1:]])


def negative_index(layer):
    attribute = body(layer).attributes["primvars:skel:jointIndices"]
    attribute.default = Vt.IntArray([-1, *list(attribute.default)[1:]])


def light_weights(layer):
    attribute = body(layer).attributes["primvars:skel:jointWeights"]
    attribute.default = Vt.FloatArray([0.5, *list(attribute.default)[1:]])


def too_many_influences(layer):
    for name in ("jointIndices", "jointWeights"):
        attribute = body(layer).attributes[f"primvars:skel:{name}"]
        attribute.SetInfo("elementSize", 2)


def small_extent(layer):
    root(layer).attributes["extent"].default = Vt.Vec3fArray([Gf.Vec3f(-0.2), Gf.Vec3f(0.2)])


SCALED = Gf.Matrix4d().SetScale(2.0)
MIRRORED = Gf.Matrix4d().SetScale(Gf.Vec3d(-1, 1, 1))
ENDLESS = Gf.Matrix4d(float("inf"))
UNDEFINED = Gf.Matrix4d(float("nan"))

DEFECTS = {
    "no up axis": (no_metadata("upAxis"), "missing-upAxis"),
    "no unit": (no_metadata("metersPerUnit"), "missing-metersPerUnit"),
    "no rate": (no_metadata("timeCodesPerSecond"), "missing-timeCodesPerSecond"),
    "no default prim": (no_default_prim, "missing-defaultPrim"),
    "default prim unknown": (unknown_default_prim, "missing-defaultPrim"),
    "starts at 1": (late_start, "start-not-zero"),
    "no skeleton": (no_skeleton, "no-skeleton"),
    "Xform for SkelRoot": (plain_transform, "no-skel-root"),
    "no extent": (no_property(root, "extent"), "missing-extent"),
    "extent too small": (small_extent, "extent-too-small"),
    "no API on the skeleton": (no_api(skeleton), "missing-binding-api"),
    "no API on the root": (no_api(root), "missing-binding-api"),
    "no API on the mesh": (no_api(body), "missing-binding-api"),
    "no animation": (no_property(skeleton, "skel:animationSource"), "no-animation"),
    "no mesh": (no_mesh, "no-skinned-mesh"),
    "mesh not bound": (unbound_mesh, "no-skinned-mesh"),
    "no joints": (no_property(skeleton, "joints"), "no-joints"),
    "colon": (replaced("Spine", "rig:Spine"), "illegal-joint-name"),
    "hyphen": (replaced("Hips", "Bip001-Pelvis"), "illegal-joint-name"),
    "space": (replaced("LeftLeg", "Left Leg"), "illegal-joint-name"),
    "joint twice": (joint_twice, "duplicate-joint"),
    "leaf name twice": (replaced("LeftFoot", "Head"), "duplicate-leaf-name"),
    "children first": (children_first, "child-before-parent"),
    "parent not listed": (replaced("Hips/Spine/Head", "Hips/Spine/Neck/Head"), "missing-parent"),
    "no rest": (no_property(skeleton, "restTransforms"), "missing-restTransforms"),
    "no bind": (no_property(skeleton, "bindTransforms"), "missing-bindTransforms"),
    "rest too short": (fewer(skeleton, "restTransforms"), "restTransforms-count"),
    "bind too short": (fewer(skeleton, "bindTransforms"), "bindTransforms-count"),
    "scaled bind": (skewed("bindTransforms", SCALED), "not-orthonormal"),
    "mirrored rest": (skewed("restTransforms", MIRRORED), "not-orthonormal"),
    "endless rest": (skewed("restTransforms", ENDLESS), "not-finite"),
    "undefined rest": (skewed("restTransforms", UNDEFINED), "not-finite"),
    "no scales": (no_property(animation, "scales"), "missing-scales"),
    "no rotations": (no_property(animation, "rotations"), "missing-rotations"),
    "no translations": (no_property(animation, "translations"), "missing-translations"),
    "no components": (no_components, "no-time-samples"),
    "rotations of text": (texts_for_rotations, "rotations-count"),
    "rotations too short": (fewer_samples("rotations"), "rotations-count"),
    "translations too short": (fewer_samples("translations"), "translations-count"),
    "scales too short": (fewer(animation, "scales"), "scales-count"),
    "unknown joint": (other_joints, "unknown-joint"),
    "fewer joints": (fewer(animation, "joints"), "joint-not-animated"),
    "default pose": (default_pose, "no-time-samples"),
    "frame lost": (lost_frame, "missing-frame"),
    "frame beyond": (frame_beyond_the_end, "outside-range"),
    "not unit": (rotations(lambda _, q: 1.01 * q), "not-unit-rotation"),
    "signs flip": (rotations(lambda time, q: (-1) ** time * q), "rotation-sign-flip"),
    "w first in memory": (rotations(lambda _, q: np.roll(q, 1, axis=-1)), "quaternion-order"),
    "w last in text": (rotations(lambda _, q: np.roll(q, -1, axis=-1)), "quaternion-order"),
    "undefined path": (endless, "not-finite"),
    "index too large": (indices, "joint-index-range"),
    "index negative": (negative_index, "joint-index-range"),
    "weights too light": (light_weights, "joint-weights-sum"),
    "weights too few": (fewer(body, "primvars:skel:jointWeights"), "joint-weights-count"),
    "elementSize wrong": (too_many_influences, "joint-weights-count"),
}


@pytest.mark.parametrize(("damage", "code"), DEFECTS.values(), ids=DEFECTS)
def test_a_defect_is_found_and_nothing_is_printed(layer, damage, code, capfd):
    damage(layer)
    layer.Save(force=True)
    capfd.readouterr()
    assert code in {finding.code for finding in check(Path(layer.realPath))}
    assert capfd.readouterr() == ("", "")


def test_a_finding_names_its_prim_what_was_found_and_what_was_expected(layer):
    drop(animation(layer), "scales")
    layer.Save(force=True)
    message = "no scales, expected translations, rotations, scales: else the rest pose shows"
    assert check(Path(layer.realPath)) == [
        Finding("missing-scales", "/Character/Anim", message, "error")
    ]


def test_warnings_are_told_from_errors(layer):
    late_start(layer)
    layer.Save(force=True)
    found = {finding.code: finding.severity for finding in check(Path(layer.realPath))}
    assert found["start-not-zero"] == "warning"


def test_the_official_validators_are_asked_too(layer):
    no_api(skeleton)(layer)
    layer.Save(force=True)
    assert any(finding.code.startswith("usd:") for finding in check(Path(layer.realPath)))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("text.usda", b"#usda 1.0\ndef Xform {"),
        ("binary.usdc", b"PXR-USDC"),
        ("archive.usdz", b"PK"),
        ("other.txt", b"hello"),
    ],
)
def test_a_file_that_does_not_open_is_refused(name, content, tmp_path):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(UsdError, match=f"{name}: expected a USD file that opens; ."):
        check(path)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(UsdError, match="no such file"):
        check(tmp_path / "none.usda")


def test_a_root_that_was_moved_keeps_its_joints_in_its_extent(layer):
    matrix = Sdf.AttributeSpec(root(layer), "xformOp:transform", Sdf.ValueTypeNames.Matrix4d)
    matrix.default = Gf.Matrix4d().SetTranslate((5, 0, 0))
    order = Sdf.AttributeSpec(
        root(layer), "xformOpOrder", Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform
    )
    order.default = Vt.TokenArray(["xformOp:transform"])
    layer.Save(force=True)
    assert check(Path(layer.realPath)) == []
