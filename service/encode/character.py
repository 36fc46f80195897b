"""A character but for its motion: a skeleton at rest and the light body that is skinned to it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Gf, Vt

from service.encode import axes, body, names, reach, specs
from service.encode.body import Bones, Boxes
from service.encode.convention import METRES, Convention
from service.encode.reach import Tree
from service.encode.specs import Type
from service.motion.conventions import Floats, Singles
from service.motion.skeleton import Skeleton

BINDING = ("SkelBindingAPI",)

Numbers = Mapping[str, npt.NDArray[Any]]
"""Arrays of one character by name: bind and rest matrices (J, 4, 4), points and normals (P, 3),
extent (2, 3)."""


@dataclass(frozen=True, eq=False)
class Rig:
    """What all clips of a skeleton share: names and paths of joints, points, and boxes to draw.

    There is one of each skeleton, and it is equal to itself alone.
    """

    skeleton: Skeleton
    names: tuple[str, ...]
    paths: tuple[str, ...]
    tree: Tree
    bones: Bones


def rig(skeleton: Skeleton) -> Rig:
    """Rig of a skeleton; kept, for it takes milliseconds to make."""
    tips = skeleton.tip_offsets.tobytes()
    shape = (skeleton.offsets.tobytes(), skeleton.tip_joints, tips)
    return _rig(_Key((skeleton.names, skeleton.parents, *shape), skeleton))


class _Key:
    """A skeleton by what it says: its arrays can neither be compared nor hashed."""

    def __init__(self, said: tuple[Any, ...], skeleton: Skeleton) -> None:
        self.said, self.skeleton = said, skeleton

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self.said == other.said

    def __hash__(self) -> int:
        return hash(self.said)


@lru_cache(maxsize=64)
def _rig(key: _Key) -> Rig:
    joints = key.skeleton
    paths = names.paths(names.legal(joints.names), joints.parents)
    return Rig(joints, joints.names, paths, reach.tree(joints), body.bones(joints))


@dataclass(frozen=True)
class Rest:
    """Characters of one rig at rest: offsets (M, J, 3) from parents, m, and their bodies' boxes."""

    rig: Rig
    offsets: Floats
    boxes: Boxes


def resting(rig: Rig, offsets: Floats | Singles) -> Rest:
    """Characters whose bones have the offsets (M, J, 3), m; each root is where the rig's is."""
    rest = offsets.astype(np.float64)
    rest[:, 0] = rig.skeleton.offsets[0]
    return Rest(rig, rest, body.boxes(rig.skeleton, rig.bones, rest))


def numbers(rest: Rest, convention: Convention) -> dict[str, npt.NDArray[Any]]:
    """Arrays (M, ...) of characters, but for their extents."""
    points, normals = body.mesh(rest.boxes)
    points, normals = axes.places(convention, points), axes.directions(convention, normals)
    bind = _matrices(convention, rest.rig.skeleton.at_rest(rest.offsets))
    local = _matrices(convention, rest.offsets)
    return {"bind": bind, "rest": local, "points": points, "normals": normals}


def balls(rest: Rest) -> Floats:
    """Radii (M, P) about joints and tips within which what is drawn lies between them, m."""
    bones, found, (characters, joints, _) = rest.rig.bones, rest.boxes, rest.offsets.shape
    radii = np.zeros((characters, joints + len(rest.rig.tree.tips)))
    every = np.arange(characters)[:, None]
    count, near = len(bones.ends), found.radii.copy()
    # A stub is as high as it is wide.
    near[:, count:] *= np.sqrt(2.0)
    np.maximum.at(radii, (every, bones.joints), near)
    np.maximum.at(radii, (every, bones.ends), near[:, :count])
    return radii


def at_rest(rig: Rig, convention: Convention = METRES) -> Numbers:
    """Arrays of the character as its skeleton rests."""
    rest = resting(rig, rig.skeleton.offsets[None])
    made = {name: array[0] for name, array in numbers(rest, convention).items()}
    places = np.concatenate([made["bind"][:, 3, :3], made["points"]])
    extent = reach.outwards(places.min(axis=0), places.max(axis=0))
    return made | {"extent": extent.astype(np.float32)}


def root(parent: Any, name: str, rig: Rig) -> Any:
    """New SkelRoot with a skeleton and a body that are bound to each other, without numbers."""
    made = specs.prim(parent, name, "SkelRoot", BINDING)
    made.kind = "component"
    specs.attribute(made, "extent", Type.Float3Array)
    skeleton = specs.prim(made, "Skel", "Skeleton", BINDING)
    mesh = specs.prim(made, "Body", "Mesh", BINDING)
    for bound in (made, mesh):
        specs.relation(bound, "skel:skeleton", skeleton.path)
    _skeleton(skeleton, rig)
    _mesh(mesh, rig.bones)
    return made


def fill(root: Any, numbers: Numbers) -> None:
    """Give a SkelRoot its numbers."""
    extent = Vt.Vec3fArray.FromNumpy(numbers["extent"])
    for prim in ("", "Body"):
        _attribute(root, prim, "extent").default = extent
    for name, key in (("bindTransforms", "bind"), ("restTransforms", "rest")):
        _attribute(root, "Skel", name).default = Vt.Matrix4dArray.FromNumpy(numbers[key])
    for name in ("points", "normals"):
        _attribute(root, "Body", name).default = Vt.Vec3fArray.FromNumpy(numbers[name])


def bind(root: Any, animation: Any) -> None:
    """Let the skeleton of a SkelRoot move as the SkelAnimation at a path does."""
    skeleton = root.layer.GetPrimAtPath(root.path.AppendChild("Skel"))
    specs.relation(skeleton, "skel:animationSource", animation)


def animation(parent: Any, name: str, paths: tuple[str, ...]) -> Any:
    """New SkelAnimation of these joints that still lacks the samples of its two attributes."""
    made = specs.prim(parent, name, "SkelAnimation")
    specs.uniform(made, "joints", Type.TokenArray, Vt.TokenArray(paths))
    specs.attribute(made, "translations", Type.Float3Array)
    specs.attribute(made, "rotations", Type.QuatfArray)
    # Some readers keep the rest pose, without a word, where scales are missing.
    specs.attribute(made, "scales", Type.Half3Array, Vt.Vec3hArray(len(paths), Gf.Vec3h(1, 1, 1)))
    return made


def _attribute(root: Any, prim: str, name: str) -> Any:
    path = root.path.AppendChild(prim) if prim else root.path
    return root.layer.GetAttributeAtPath(path.AppendProperty(name))


def _matrices(convention: Convention, metres: Floats) -> Floats:
    """Matrices (..., 4, 4) that move; USD multiplies row vectors, so the last row holds how far."""
    made = np.zeros((*metres.shape[:-1], 4, 4))
    made[...] = np.eye(4)
    made[..., 3, :3] = axes.rounded(convention, axes.places(convention, metres))
    return made


def _skeleton(prim: Any, rig: Rig) -> None:
    specs.uniform(prim, "joints", Type.TokenArray, Vt.TokenArray(rig.paths))
    specs.uniform(prim, "jointNames", Type.TokenArray, Vt.TokenArray(rig.names))
    for name in ("bindTransforms", "restTransforms"):
        specs.uniform(prim, name, Type.Matrix4dArray)


def _mesh(prim: Any, bones: Bones) -> None:
    counts, corners = map(Vt.IntArray.FromNumpy, body.faces(bones))
    specs.attribute(prim, "points", Type.Point3fArray)
    specs.per_point(prim, "normals", Type.Normal3fArray)
    specs.attribute(prim, "faceVertexCounts", Type.IntArray, counts)
    specs.attribute(prim, "faceVertexIndices", Type.IntArray, corners)
    specs.uniform(prim, "subdivisionScheme", Type.Token, "none")
    specs.attribute(prim, "extent", Type.Float3Array)
    _color(prim, bones)
    _binding(prim, bones)


def _color(prim: Any, bones: Bones) -> None:
    tints, chosen = specs.vectors(body.TINTS), np.repeat(bones.tints, body.POINTS)
    specs.per_point(prim, "primvars:displayColor", Type.Color3fArray, tints)
    indices = Vt.IntArray.FromNumpy(chosen)
    specs.attribute(prim, "primvars:displayColor:indices", Type.IntArray, indices)


def _binding(prim: Any, bones: Bones) -> None:
    joints = np.repeat(bones.joints, body.POINTS)
    for name, kind, value in (
        ("jointIndices", Type.IntArray, Vt.IntArray.FromNumpy(joints)),
        ("jointWeights", Type.FloatArray, Vt.FloatArray(len(joints), 1.0)),
    ):
        specs.per_point(prim, f"primvars:skel:{name}", kind, value).SetInfo("elementSize", 1)
    specs.attribute(prim, "primvars:skel:geomBindTransform", Type.Matrix4d, Gf.Matrix4d(1.0))
