"""A clip as one USD layer: a bound skeleton, its baked animation and a light skinned body.

Written into a layer without a stage: it is faster, and a stage leaks for each that is opened.
The names of prims never vary, because USD keeps every name that it has ever seen.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Vt

from service.encode import body, bounds, names, specs
from service.encode.body import Body
from service.encode.specs import Type
from service.motion import quat
from service.motion.answer import ClipAnswer, Trust
from service.motion.clip import Clip
from service.motion.conventions import Floats

BINDING = ("SkelBindingAPI",)
MEMORY = Path("/dev/shm")


@dataclass(frozen=True)
class Rig:
    """What the prims share: joint paths, local offsets and positions (J, 3) at rest, extent."""

    paths: tuple[str, ...]
    offsets: Floats
    rest: Floats
    body: Body
    extent: Any


def usda(answer: ClipAnswer) -> bytes:
    """USD as text."""
    text: str = layer(answer).ExportToString()
    return text.encode()


def usdc(answer: ClipAnswer) -> bytes:
    """USD in its binary form, which pxr can only write to a file."""
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        path = Path(folder, "clip.usdc")
        layer(answer).Export(str(path), args={"format": "usdc"})
        return path.read_bytes()


def layer(answer: ClipAnswer) -> Any:
    """Layer that holds the clip; the caller must keep it, since its prims do not."""
    made = Sdf.Layer.CreateAnonymous("clip.usda")
    rig = _rig(answer.clip)
    with Sdf.ChangeBlock():
        _header(made, answer)
        _character(made, answer.clip, rig)
    return made


def _rig(clip: Clip) -> Rig:
    offsets = clip.translations[0].copy()
    offsets[0] = clip.skeleton.offsets[0]
    rest = body.rest_positions(clip.skeleton, offsets)
    bones = body.bones(clip.skeleton, rest)
    return Rig(
        paths=names.paths(names.legal(clip.skeleton.names), clip.skeleton.parents),
        offsets=offsets,
        rest=rest,
        body=body.build(bones, middle=rest[0, 0]),
        extent=specs.vectors(bounds.over(clip, bones, rest)),
    )


def _header(made: Any, answer: ClipAnswer) -> None:
    clip = answer.clip
    made.defaultPrim = "Character"
    made.startTimeCode, made.endTimeCode = 0.0, float(len(clip) - 1)
    # Readers differ in which of the two they believe.
    made.timeCodesPerSecond = made.framesPerSecond = float(clip.rate)
    root = made.pseudoRoot
    root.SetInfo("metersPerUnit", 1.0)
    root.SetInfo("upAxis", "Y")
    made.customLayerData = {"posefield": _facts(answer.trust)}


def _facts(trust: Trust) -> dict[str, Any]:
    facts = trust.facts() | {"warnings": Vt.StringArray(list(trust.warnings))}
    # USD has no value that stands for none.
    return {name: fact for name, fact in facts.items() if fact is not None}


def _character(made: Any, clip: Clip, rig: Rig) -> None:
    root = specs.prim(made, "Character", "SkelRoot", BINDING)
    root.kind = "component"
    specs.attribute(root, "extent", Type.Float3Array, rig.extent)
    skeleton = specs.prim(root, "Skel", "Skeleton", BINDING)
    animation = specs.prim(root, "Anim", "SkelAnimation")
    mesh = specs.prim(root, "Body", "Mesh", BINDING)
    for bound in (root, mesh):
        specs.relation(bound, "skel:skeleton", skeleton)
    specs.relation(skeleton, "skel:animationSource", animation)
    _skeleton(skeleton, clip, rig)
    _animation(animation, clip, rig)
    _mesh(mesh, rig)


def _skeleton(prim: Any, clip: Clip, rig: Rig) -> None:
    specs.uniform(prim, "joints", Type.TokenArray, Vt.TokenArray(rig.paths))
    specs.uniform(prim, "jointNames", Type.TokenArray, Vt.TokenArray(clip.skeleton.names))
    specs.uniform(prim, "bindTransforms", Type.Matrix4dArray, specs.translations(rig.rest))
    specs.uniform(prim, "restTransforms", Type.Matrix4dArray, specs.translations(rig.offsets))


def _animation(prim: Any, clip: Clip, rig: Rig) -> None:
    specs.uniform(prim, "joints", Type.TokenArray, Vt.TokenArray(rig.paths))
    paths = specs.attribute(prim, "translations", Type.Float3Array).path
    turns = specs.attribute(prim, "rotations", Type.QuatfArray).path
    ones = Vt.Vec3hArray(len(rig.paths), Gf.Vec3h(1, 1, 1))
    specs.attribute(prim, "scales", Type.Half3Array, ones)
    # Readers that interpolate quaternions by component need neighbours of the same sign.
    moves, rotations = clip.translations, quat.unroll(clip.rotations)
    samples = zip(specs.vector_frames(moves), specs.quaternion_frames(rotations), strict=True)
    for frame, (move, turn) in enumerate(samples):
        prim.layer.SetTimeSample(paths, frame, move)
        prim.layer.SetTimeSample(turns, frame, turn)


def _mesh(prim: Any, rig: Rig) -> None:
    made = rig.body
    counts, corners = made.face_counts, made.face_points
    specs.attribute(prim, "points", Type.Point3fArray, specs.vectors(made.points))
    specs.per_point(prim, "normals", Type.Normal3fArray, specs.vectors(made.normals))
    specs.attribute(prim, "faceVertexCounts", Type.IntArray, Vt.IntArray.FromNumpy(counts))
    specs.attribute(prim, "faceVertexIndices", Type.IntArray, Vt.IntArray.FromNumpy(corners))
    specs.uniform(prim, "subdivisionScheme", Type.Token, "none")
    specs.attribute(prim, "extent", Type.Float3Array, rig.extent)
    _color(prim, made)
    _binding(prim, made)


def _color(prim: Any, made: Body) -> None:
    tints, chosen = specs.vectors(body.TINTS), Vt.IntArray.FromNumpy(made.tints)
    specs.per_point(prim, "primvars:displayColor", Type.Color3fArray, tints)
    specs.attribute(prim, "primvars:displayColor:indices", Type.IntArray, chosen)


def _binding(prim: Any, made: Body) -> None:
    joints, weights = Vt.IntArray.FromNumpy(made.joints), Vt.FloatArray(len(made.joints), 1.0)
    for name, kind, value in (
        ("jointIndices", Type.IntArray, joints),
        ("jointWeights", Type.FloatArray, weights),
    ):
        specs.per_point(prim, f"primvars:skel:{name}", kind, value).SetInfo("elementSize", 1)
    specs.attribute(prim, "primvars:skel:geomBindTransform", Type.Matrix4d, Gf.Matrix4d(1.0))
