"""USD layers that animate a user's character.

    /Hero                     the root prim of the user's file, by a reference
      …/Skeleton              the same, bound to the animation of this layer
      Anim                    SkelAnimation of all joints

Bind pose, meshes, skin weights and materials stay in the user's file. For a file in glTF, to which
USD cannot refer, the layer has a skeleton of the same joints without a skin.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from posefield.common.errors import UsdError
from posefield.common.units import Floats, JointWeights, Positions, Rotations, Singles
from posefield.encode import character, layers
from posefield.encode.character import METRES, Convention
from posefield.encode.layers import ValueTypes
from posefield.motion import joint_roles, quat
from posefield.question.results import SampledClip
from posefield.rigs import usd_rig
from posefield.rigs.rest_joints import RestJoints

ANIMATION = "Anim"
"""Name of the animation below the root prim, followed by a number where the file has it."""


def matrices(
    rotations: Annotated[Floats, "*batch joints 4"],
    translations: Annotated[Floats, "*batch joints 3"],
) -> Annotated[Floats, "*batch joints 4 4"]:
    """Return matrices (..., 4, 4) for row vectors, as in USD."""
    stacked = np.zeros((*rotations.shape[:-1], 4, 4))
    stacked[..., :3, :3] = np.swapaxes(quat.to_matrix(rotations), -1, -2)
    stacked[..., 3, :3] = translations
    stacked[..., 3, 3] = 1.0
    return stacked


BLOCK = 256
"""Frames whose matrices are computed together: those of a long motion take gigabytes."""


@dataclass(frozen=True, eq=False)
class RigStage:
    """Place of a skeleton in a USD file.

    skeleton, skel_root: paths of prims. animation: free path for the animation. joints: tokens in
    the order of the rig. to_root (4, 4): for row vectors, from the space of the skeleton to that of
    the SkelRoot. radii (J,): largest distance of a point from a joint that moves it, in the space
    of the skeleton. notes: on what a reference to the root prim lacks.
    """

    skeleton: str
    skel_root: str
    animation: str
    joints: tuple[str, ...]
    to_root: Floats
    radii: JointWeights
    notes: tuple[str, ...] = ()

    @property
    def root(self) -> str:
        """Return the name of the root prim, to which layers refer."""
        return self.skeleton.split("/")[1]

    def extent(self, rest: RestJoints, rotations: Rotations, translations: Positions) -> Floats:
        """Return the lowest and highest corner (2, 3) of the character in the space of its root.

        rotations (F, J, 4), translations (F, J, 3): of the file's joints. A skinned point is a mean
        of points, each as far from a joint as at rest, so it lies within spheres about the joints.
        """
        corners = [
            self._box(rest, rotations[first : first + BLOCK], translations[first : first + BLOCK])
            for first in range(0, len(rotations), BLOCK)
        ]
        low, high = np.stack(corners, axis=1)
        return np.stack([low.min(axis=0), high.max(axis=0)])

    def _box(self, rest: RestJoints, rotations: Rotations, translations: Positions) -> Floats:
        placed = np.zeros((len(rotations), len(rest.names), 4, 4))
        local = matrices(rotations, translations)
        local[..., :3, :3] *= rest.scales[:, :, None]
        for joint, parent in enumerate(rest.parents):
            joint_matrices = local[:, joint]
            placed[:, joint] = joint_matrices @ (self.to_root if parent < 0 else placed[:, parent])
        sizes = np.linalg.norm(self.to_root[:3, :3], axis=1).max()
        origins, reach = placed[..., 3, :3], (sizes * self.radii)[:, None]
        return np.stack([(origins - reach).min(axis=(0, 1)), (origins + reach).max(axis=(0, 1))])


def read_stage(path: Path, skeleton: str, joints: tuple[str, ...]) -> RigStage:
    """Return the place of a skeleton in a file.

    skeleton: path of the prim. joints: its tokens in the order of the rig. Raises UsdError for a
    skeleton to which no layer can bind an animation.
    """
    opened = usd_rig.open_stage(path, str(path))
    stage = opened.stage
    prim = stage.GetPrimAtPath(skeleton)
    if prim.IsInstanceProxy() or prim.IsInstance():
        raise UsdError(
            path,
            f"the skeleton {skeleton} lies in an instance, expected none: no other layer can bind "
            "an animation to it",
        )
    skel_root = UsdSkel.Root.Find(prim)
    if not skel_root:
        raise UsdError(path, f"the skeleton {skeleton} lies in no SkelRoot, expected one")
    root = stage.GetPrimAtPath("/" + skeleton.split("/")[1])
    cache = UsdGeom.XformCache()
    to_world = cache.GetLocalToWorldTransform(prim)
    to_root = to_world * cache.GetLocalToWorldTransform(skel_root.GetPrim()).GetInverse()
    return RigStage(
        skeleton,
        str(skel_root.GetPath()),
        f"{root.GetPath()}/{joint_roles.free_name(ANIMATION, set(root.GetAllChildrenNames()))}",
        joints,
        np.array(to_root, float),
        _radii(UsdSkel.Skeleton(prim), skel_root, joints),
        tuple(_lost_targets(root)),
    )


def _radii(skeleton: Any, skel_root: Any, joints: tuple[str, ...]) -> Floats:
    """Return the largest distance (J,) of a point from a joint that moves it, at bind."""
    cache = UsdSkel.Cache()
    cache.Populate(skel_root, Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(skeleton)
    order = [str(token) for token in query.GetJointOrder()]
    matrices = np.array(query.GetJointWorldBindTransforms(), float)
    if len(matrices) != len(order):
        path = skeleton.GetPath()
        raise ValueError(f"{path} has {len(matrices)} bindTransforms, expected {len(order)}")
    binds = matrices[:, 3, :3]
    radii = dict.fromkeys(order, 0.0)
    for binding in cache.ComputeSkelBindings(skel_root, Usd.PrimDefaultPredicate):
        if binding.GetSkeleton().GetPath() == skeleton.GetPath():
            for skinned in binding.GetSkinningTargets():
                _widen(radii, order, binds, skinned)
    return np.array([radii[joint] for joint in joints])


def _widen(radii: dict[str, float], order: list[str], binds: Floats, skinned: Any) -> None:
    """Widen the radii of the joints that move a skinned mesh."""
    points = UsdGeom.PointBased(skinned.GetPrim()).GetPointsAttr().Get()
    if not points:
        return
    matrix = np.array(skinned.GetGeomBindTransform(), float)
    placed = np.array(points, float) @ matrix[:3, :3] + matrix[3, :3]
    indices, weights = (
        np.array(influences).reshape(len(placed), -1)
        for influences in skinned.ComputeVaryingJointInfluences(len(placed))
    )
    joint_order = [str(token) for token in skinned.GetJointOrder() or order]
    for column in range(indices.shape[1]):
        weighted = weights[:, column] > 0.0
        for index in np.unique(indices[weighted, column]).tolist():
            these = placed[weighted & (indices[:, column] == index)]
            distances = np.linalg.norm(these - binds[order.index(joint_order[index])], axis=-1)
            radii[joint_order[index]] = max(radii[joint_order[index]], float(distances.max()))


def _lost_targets(root: Any) -> list[str]:
    """Return a note if prims refer to others beside the root prim, which a reference leaves out."""
    below = root.GetPath()
    relations = (
        relationship
        for prim in Usd.PrimRange(root)
        for relationship in prim.GetAuthoredRelationships()
    )
    targets = (target for relation in relations for target in relation.GetTargets())
    lost = sorted({str(target) for target in targets if not target.HasPrefix(below)})
    if not lost:
        return []
    return [
        f"prims below {below} refer to {len(lost)} prims beside it ({', '.join(lost[:3])}), which "
        f"a reference to {below} leaves out: move them below it"
    ]


SKELETON_ROOT = "Character"


def referring_layer(answer: SampledClip, rest: RestJoints, stage: RigStage, reference: str) -> Any:
    """Return a layer that refers to a file and binds its skeleton to a motion of its joints.

    reference: path of the file, as the layer states it.
    """
    layer = Sdf.Layer.CreateAnonymous("clip.usda")
    with Sdf.ChangeBlock():
        _set_metadata(layer, answer, stage.root, Convention(rest.metres_per_unit, rest.up))
        root = Sdf.PrimSpec(layer, stage.root, Sdf.SpecifierDef)
        root.referenceList.prependedItems = [Sdf.Reference(reference, root.path)]
        _set_extent(layer, answer, rest, stage)
        skeleton = Sdf.CreatePrimInLayer(layer, stage.skeleton)
        schemas = Sdf.TokenListOp.Create(prependedItems=list(layers.BINDING_SCHEMAS))
        skeleton.SetInfo("apiSchemas", schemas)
        animation = Sdf.Path(stage.animation)
        layers.add_relationship(skeleton, "skel:animationSource", animation)
        _add_animation(root, animation.name, stage.joints, answer, rest)
    return layer


def skeleton_layer(answer: SampledClip, rest: RestJoints) -> Any:
    """Return a layer of the same joints in metres with Y up and their motion, without a skin."""
    rest_in_metres = rest.in_metres()
    layer = Sdf.Layer.CreateAnonymous("clip.usda")
    paths = character.joint_paths(
        character.legal_names(rest_in_metres.names), rest_in_metres.parents
    )
    schemas = layers.BINDING_SCHEMAS
    with Sdf.ChangeBlock():
        _set_metadata(layer, answer, SKELETON_ROOT, METRES)
        root = layers.prim(layer, SKELETON_ROOT, "SkelRoot", schemas)
        root.kind = "component"
        points = answer.clip.positions().reshape(-1, 3)
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        _add_extent(root, box)
        _add_skeleton(root, paths, rest_in_metres)
        _add_animation(root, ANIMATION, paths, answer, rest_in_metres)
        layers.bind_animation(root, root.path.AppendChild(ANIMATION))
    return layer


def _set_metadata(layer: Any, answer: SampledClip, root: str, convention: Convention) -> None:
    clip = answer.clip
    layers.set_layer_metadata(layer, root, len(clip), clip.rate, convention)
    layers.set_custom_data(layer, answer.trust.facts())


def _set_extent(layer: Any, answer: SampledClip, rest: RestJoints, stage: RigStage) -> None:
    """Set the extent of the whole motion instead of that of the file's rest pose."""
    clip = answer.clip
    rotations = quat.normalize(rest.file_rotations(clip.rotations))
    box = stage.extent(rest, rotations, rest.file_translations(clip.translations))
    _add_extent(Sdf.CreatePrimInLayer(layer, stage.skel_root), box)


def _add_extent(root: Any, box: Floats) -> None:
    value = layers.float3_array(box)
    layers.varying_attribute(root, "extent", ValueTypes.Float3Array, value)


def _add_skeleton(root: Any, paths: Sequence[str], rest: RestJoints) -> None:
    """Add a skeleton, whose bind pose is its rest pose."""
    skeleton = layers.prim(root, "Skel", "Skeleton", layers.BINDING_SCHEMAS)
    layers.add_relationship(root, "skel:skeleton", skeleton.path)
    positions = rest.skeleton.at_rest(rest.skeleton.offsets)
    tokens = {"joints": list(paths), "jointNames": list(rest.names)}
    for name, values in tokens.items():
        layers.uniform_attribute(skeleton, name, ValueTypes.TokenArray, Vt.TokenArray(values))
    for name, poses in (
        ("bindTransforms", (rest.orientations, positions)),
        ("restTransforms", (rest.rotations, rest.translations)),
    ):
        transforms = Vt.Matrix4dArray.FromNumpy(matrices(*poses))
        layers.uniform_attribute(skeleton, name, ValueTypes.Matrix4dArray, transforms)


def _add_animation(
    root: Any, name: str, joints: Sequence[str], answer: SampledClip, rest: RestJoints
) -> None:
    clip = answer.clip
    rotations = quat.unroll(quat.normalize(rest.file_rotations(clip.rotations)))
    samples = {
        "rotations": _as_float32(rotations[..., [1, 2, 3, 0]]),
        "translations": _as_float32(rest.file_translations(clip.translations)),
    }
    skel_animation = layers.add_animation(root, name, tuple(joints))
    sizes = Vt.Vec3hArray([Gf.Vec3h(*size) for size in rest.scales.tolist()])
    skel_animation.attributes["scales"].default = sizes
    layers.set_time_samples(skel_animation, samples)


def _as_float32(values: Floats) -> Singles:
    # USD's deduplication does not distinguish -0 from 0.
    return np.ascontiguousarray(values, dtype=np.float32) + np.float32(0.0)
