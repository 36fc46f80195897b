"""A character but for its motion: a skeleton at rest and the light body that is skinned to it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Gf, Vt

from service.encode import body, bounds, names, specs
from service.encode.body import Body, Bones
from service.encode.specs import Type
from service.motion.conventions import Floats
from service.motion.skeleton import Skeleton

BINDING = ("SkelBindingAPI",)


@dataclass(frozen=True)
class Rig:
    """What the prims share: names and paths of joints, offsets and positions (J, 3) at rest."""

    names: tuple[str, ...]
    paths: tuple[str, ...]
    offsets: Floats
    rest: Floats
    bones: Bones
    body: Body

    @property
    def box(self) -> Floats:
        """Lowest and highest corner (2, 3) of joints and body at rest, m."""
        places = np.concatenate([self.rest, self.body.points])
        return bounds.outwards(places.min(axis=0), places.max(axis=0), bounds.SLACK)


def rig(skeleton: Skeleton, offsets: Floats) -> Rig:
    """Rig of a skeleton whose joints rest at offsets (J, 3) from their parents, m."""
    rest = skeleton.at_rest(offsets)
    bones = body.bones(skeleton, rest)
    return Rig(
        names=skeleton.names,
        paths=names.paths(names.legal(skeleton.names), skeleton.parents),
        offsets=offsets,
        rest=rest,
        bones=bones,
        body=body.build(bones, middle=rest[0, 0]),
    )


def root(parent: Any, name: str, rig: Rig, box: Floats) -> Any:
    """New SkelRoot with a skeleton and a body that are bound to each other.

    box: lowest and highest corner (2, 3) of all that the body does, m.
    """
    extent = specs.vectors(box)
    made = specs.prim(parent, name, "SkelRoot", BINDING)
    made.kind = "component"
    specs.attribute(made, "extent", Type.Float3Array, extent)
    skeleton = specs.prim(made, "Skel", "Skeleton", BINDING)
    mesh = specs.prim(made, "Body", "Mesh", BINDING)
    for bound in (made, mesh):
        specs.relation(bound, "skel:skeleton", skeleton.path)
    _skeleton(skeleton, rig)
    _mesh(mesh, rig.body, extent)
    return made


def bind(root: Any, animation: Any) -> None:
    """Let the skeleton of a SkelRoot move as a SkelAnimation does."""
    skeleton = root.layer.GetPrimAtPath(root.path.AppendChild("Skel"))
    specs.relation(skeleton, "skel:animationSource", animation.path)


def animation(parent: Any, name: str, paths: tuple[str, ...]) -> Any:
    """New SkelAnimation of these joints that still lacks the samples of its two attributes."""
    made = specs.prim(parent, name, "SkelAnimation")
    specs.uniform(made, "joints", Type.TokenArray, Vt.TokenArray(paths))
    specs.attribute(made, "translations", Type.Float3Array)
    specs.attribute(made, "rotations", Type.QuatfArray)
    # Some readers keep the rest pose, without a word, where scales are missing.
    specs.attribute(made, "scales", Type.Half3Array, Vt.Vec3hArray(len(paths), Gf.Vec3h(1, 1, 1)))
    return made


def _skeleton(prim: Any, rig: Rig) -> None:
    specs.uniform(prim, "joints", Type.TokenArray, Vt.TokenArray(rig.paths))
    specs.uniform(prim, "jointNames", Type.TokenArray, Vt.TokenArray(rig.names))
    specs.uniform(prim, "bindTransforms", Type.Matrix4dArray, specs.translations(rig.rest))
    specs.uniform(prim, "restTransforms", Type.Matrix4dArray, specs.translations(rig.offsets))


def _mesh(prim: Any, made: Body, extent: Any) -> None:
    counts, corners = made.face_counts, made.face_points
    specs.attribute(prim, "points", Type.Point3fArray, specs.vectors(made.points))
    specs.per_point(prim, "normals", Type.Normal3fArray, specs.vectors(made.normals))
    specs.attribute(prim, "faceVertexCounts", Type.IntArray, Vt.IntArray.FromNumpy(counts))
    specs.attribute(prim, "faceVertexIndices", Type.IntArray, Vt.IntArray.FromNumpy(corners))
    specs.uniform(prim, "subdivisionScheme", Type.Token, "none")
    specs.attribute(prim, "extent", Type.Float3Array, extent)
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
