"""Joints of files at rest, whose rest pose has rotations, as skeletons at rest without.

USD and glTF store a rotation of every joint at rest, in the unit and axes of the file; BVH and this
project's models do not. With R for the orientation of a joint at rest, and P for that of its
parent, in the file's world, a rotation Q of the file becomes P Q R⁻¹ and a translation t becomes
s P t, with s for the metres of the parent's unit: every joint stays where it is, and bones of the
rest pose keep their directions.
"""

from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from posefield.common.errors import MotionFileError
from posefield.common.units import (
    Bones,
    Floats,
    JointRotations,
    JointWeights,
    Positions,
    Rotations,
    UpAxis,
)
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield.roles import joint_recognition


@contextmanager
def naming_faults(source: str, *faults: type[Exception]) -> Iterator[None]:
    """Raise faults of values of wrong types as MotionFileError with the file's name."""
    try:
        yield
    except faults as fault:
        message = f"{type(fault).__name__}: {' '.join(str(fault).split())[:200]}"
        raise MotionFileError(source, f"breaks its format: {message}") from fault


class Transform(NamedTuple):
    """Scale, rotation and translation of a node or joints, or from a root to the world.

    rotation (..., 4): unit quaternions. translation, scale (..., 3).
    """

    rotation: Floats
    translation: Floats
    scale: Floats

    def inside(self, other: "Transform") -> "Transform":
        """Return this transform followed by another one."""
        return Transform(
            quat.mul(other.rotation, self.rotation),
            other.translation + quat.rotate(other.rotation, other.scale * self.translation),
            other.scale * self.scale,
        )

    def below(self, other: "Transform") -> "Transform":
        """Return the transform that is this one when followed by another one."""
        back = quat.conj(other.rotation)
        translation = quat.rotate(back, self.translation - other.translation) / other.scale
        return Transform(quat.mul(back, self.rotation), translation, self.scale / other.scale)

    def root_inside(self, other: "Transform") -> "Transform":
        """Return transforms of joints of which the first one is followed by another one."""
        inside = Transform(*(values.copy() for values in self))
        root = Transform(*(values[..., 0, :] for values in self)).inside(other)
        for values, value in zip(inside, root, strict=True):
            values[..., 0, :] = value
        return inside

    def unmirrored(self) -> "Transform":
        """Return the transform with half a turn in place of two negative scales."""
        negative = self.scale < 0.0
        pair = negative.sum(axis=-1, keepdims=True) == 2
        half = np.concatenate([np.zeros_like(self.scale[..., :1]), ~negative], axis=-1)
        return Transform(
            np.where(pair, quat.mul(self.rotation, half), self.rotation),
            self.translation,
            np.where(pair, np.abs(self.scale), self.scale),
        )


WORLD = Transform(quat.IDENTITY, np.zeros(3), np.ones(3))
"""Transform of what lies in the world."""


def of_matrix(matrix: Floats, label: object, skew: float = 1e-3) -> Transform:
    """Return a matrix (4, 4) for row vectors as a transform.

    label: in messages. skew: largest cosine between axes that are perpendicular. Raises ValueError
    for axes that skew or mirror.
    """
    sizes = np.linalg.norm(matrix[:3, :3], axis=1)
    axes = matrix[:3, :3] / np.maximum(sizes, 1e-30)[:, None]
    if np.abs(axes @ axes.T - np.eye(3)).max() > skew or np.linalg.det(axes) < 0.0:
        raise ValueError(f"a transform of {label} skews or mirrors, expected neither")
    return Transform(quat.from_matrix(axes.T), matrix[3, :3], sizes)


def stacked(transforms: Sequence[Transform]) -> Transform:
    """Return transforms (J, ...) of joints."""
    return Transform(*map(np.stack, zip(*transforms, strict=True)))


EIGHTH, POSED = float(np.cos(np.pi / 8)), 0.9999
"""Products of two quaternions that are turned against each other by 45 and by 1.6 degrees."""
NEAR = 0.25
"""Largest distance between the roots of bind and rest pose, as a share of the length of bones."""


def bound_rest(
    local: Transform,
    parents: Sequence[int],
    outer: Transform,
    bind: Mapping[int, Transform],
    nearest: float = EIGHTH,
) -> Transform:
    """Return the transforms (J, ...) at rest, with turns and root of the bind pose.

    local: of the nodes, each to its parent, the first to `outer`. bind: orientations and places of
    joints in the frame of the exporter: exporters differ on it, but not on turns between joints.
    nearest: least product of the roots' quaternions for which the frame is taken as that of local.
    """
    world = local.root_inside(outer).rotation
    for joint, parent in enumerate(parents):
        if parent >= 0:
            world[joint] = quat.mul(world[parent], local.rotation[joint])
        world[joint] = bind[joint].rotation if joint in bind else world[joint]
    turns, positions = local.rotation.copy(), local.translation.copy()
    turns[1:] = quat.mul(quat.conj(world[list(parents[1:])]), world[1:])
    roots = [bind[0].below(outer), bind[0]] if 0 in bind else []
    root = max(roots, key=lambda candidate: abs(float(candidate.rotation @ turns[0])), default=None)
    if root is not None and abs(float(root.rotation @ turns[0])) >= nearest:
        # A file that was exported in a pose of its motion has the root of that pose.
        is_posed = np.abs(np.sum(turns * local.rotation, axis=-1)).min() < POSED
        bones = np.linalg.norm(positions[1:], axis=-1).sum()
        turns[0] = root.rotation
        if is_posed and np.linalg.norm(root.translation - positions[0]) <= NEAR * bones:
            positions[0] = root.translation
    return Transform(turns, positions, local.scale)


SCALE_TOLERANCE = 2e-3
"""Largest relative change of a scale that is rounding: USD stores scales in half precision."""


class JointTree(NamedTuple):
    """A skeleton of a file. label: in messages. names, parents: of its joints, parents first."""

    label: str
    names: tuple[str, ...]
    parents: tuple[int, ...]


def plain_motion(
    source: str, joints: JointTree, rest: Transform, motion: Transform
) -> tuple[Skeleton, Rotations, Positions, tuple[str, ...]]:
    """Return joints at rest with identity rotations and without scale, their motion, and notes.

    rest (J, ...), motion (F, J, ...): local to the parent, those of the root in the file's world.
    Raises MotionFileError for a scale that is animated, uneven or mirrored, but at the end of a
    chain, where no joint follows it.
    """
    if not all(np.all(np.isfinite(array)) for array in (*rest, *motion)):
        raise MotionFileError(source, "has transforms that are not finite, expected numbers")
    sizes, notes = _constant_scales(source, joints, motion.scale)
    # Products (J,) of the scales of each joint's ancestors.
    above = np.ones(len(sizes))
    for joint, parent in enumerate(joints.parents[1:], start=1):
        above[joint] = above[parent] * sizes[parent]
    turns = _in_world(rest.rotation, joints.parents)
    parents = np.array(joints.parents)
    outer = np.concatenate([quat.IDENTITY[None], turns[parents[1:]]])
    rotations = quat.mul(quat.mul(outer, quat.normalize(motion.rotation)), quat.conj(turns))
    translations = quat.rotate(outer, above[:, None] * motion.translation)
    offsets = quat.rotate(outer, above[:, None] * rest.translation)
    skeleton = Skeleton(joints.names, joints.parents, offsets, (), np.zeros((0, 3)))
    return skeleton, rotations, translations, notes


def _in_world(turns: JointRotations, parents: Sequence[int]) -> JointRotations:
    """Return orientations (J, 4) in the world of joints with rotations local to the parent."""
    world = quat.normalize(turns)
    for joint, parent in enumerate(parents[1:], start=1):
        world[joint] = quat.normalize(quat.mul(world[parent], world[joint]))
    return world


def _constant_scales(
    source: str, joints: JointTree, scales: Floats
) -> tuple[Floats, tuple[str, ...]]:
    """Return the scale (J,) of each joint, and a note on those that are left out.

    Raises MotionFileError for one that is not constant and even, unless no joint is below it.
    """
    uniform = scales[0].mean(axis=-1)
    deviations = np.abs(scales - uniform[:, None]).max(axis=(0, 2))
    odd = ~(deviations <= SCALE_TOLERANCE * np.abs(uniform)) | (uniform <= 0.0)
    inner = np.isin(np.arange(len(odd)), joints.parents)
    for joint in np.flatnonzero(odd & inner)[:1].tolist():
        low, high = scales[:, joint].min(), scales[:, joint].max()
        raise MotionFileError(
            source,
            f"joint {joints.names[joint]!r} has scales from {low:.4g} to {high:.4g}, expected one "
            "positive scale along all axes in all frames: bake the scale into the bones",
        )
    names = ", ".join(joints.names[joint] for joint in np.flatnonzero(odd)[:10])
    notes = (f"the scale of {names} left out: no joint follows it",) if names else ()
    # Scales of 1 in half precision, or of rounded matrices, are 1.
    return np.where(odd | (np.abs(uniform - 1.0) <= SCALE_TOLERANCE), 1.0, uniform), notes


Z_UP = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(-0.5 * np.pi))
"""Rotation of the axes of a file with Z up: (x, y, z) becomes (x, z, -y)."""

MAX_JOINTS = 1000
"""Limit of joints, several times those of any character."""


def one_skeleton(source: str, trees: Sequence[JointTree], joint_names: Set[str]) -> int:
    """Return the index of the skeleton with named joints or legs; MotionFileError for several."""
    candidates = list(range(len(trees)))
    if len(candidates) > 1:
        candidates = [
            candidate
            for candidate in candidates
            if joint_names & {trees[candidate].label, *trees[candidate].names}
        ] or candidates
    if len(candidates) > 1:
        is_person = joint_recognition.is_person
        candidates = [
            candidate for candidate in candidates if is_person(*trees[candidate][1:])
        ] or candidates
    if len(candidates) > 1:
        labels = ", ".join(trees[index].label for index in candidates[:20])
        raise MotionFileError(
            source,
            f"found {len(candidates)} skeletons ({labels}), expected one: export each character "
            "alone, or name one by --skeleton of convert, its joints by --roles for --character",
        )
    return candidates[0]


@dataclass(frozen=True)
class RestJoints:
    """Joints of a file at rest, parents first.

    rotations (J, 4), translations (J, 3), scales (J, 3): local to the parent, in the file's unit;
    those of the root are local to the transform `outer`. metres_per_unit, up: of the file's world.
    """

    source: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    rotations: JointRotations
    translations: Bones
    scales: Bones
    outer: Transform
    metres_per_unit: float
    up: UpAxis

    @cached_property
    def _upright(self) -> Transform:
        """Return the outer transform to metres with Y up."""
        turn = Z_UP if self.up == "z" else quat.IDENTITY
        return self.outer.inside(Transform(turn, np.zeros(3), np.full(3, self.metres_per_unit)))

    @cached_property
    def skeleton(self) -> Skeleton:
        """Return the skeleton at rest with identity rotations, in metres with Y up.

        Raises MotionFileError for a scale that is uneven or mirrored.
        """
        rest = Transform(self.rotations, self.translations, self.scales).root_inside(self._upright)
        still = Transform(*(array[None] for array in rest))
        return plain_motion(self.source, JointTree("", self.names, self.parents), rest, still)[0]

    @cached_property
    def orientations(self) -> JointRotations:
        """Return the orientations (J, 4) at rest in the world with Y up."""
        transform = Transform(self.rotations, self.translations, self.scales).root_inside(
            self._upright
        )
        return _in_world(transform.rotation, self.parents)

    @cached_property
    def _outer_orientations(self) -> JointRotations:
        """Return the orientation (J, 4) at rest of what each joint is local to."""
        above = self.orientations[list(self.parents)]
        above[0] = self._upright.rotation
        return above

    @cached_property
    def unit_lengths(self) -> JointWeights:
        """Return the metres (J,) of a unit of each joint's translation."""
        sizes = self.scales.mean(axis=-1)
        lengths = np.empty(len(sizes))
        lengths[0] = self._upright.scale.mean()
        for joint, parent in enumerate(self.parents[1:], start=1):
            lengths[joint] = lengths[parent] * sizes[parent]
        return lengths

    def file_rotations(self, rotations: Rotations) -> Rotations:
        """Return rotations (F, J, 4) of the plain skeleton as local rotations of the file."""
        turned = quat.mul(quat.conj(self._outer_orientations), rotations)
        return quat.mul(turned, self.orientations)

    def file_translations(self, translations: Positions) -> Positions:
        """Return translations (F, J, 3), m, of the plain skeleton in the file's axes and unit."""
        in_file = translations.copy()
        in_file[:, 0] -= self._upright.translation
        turned = quat.rotate(quat.conj(self._outer_orientations), in_file)
        return turned / self.unit_lengths[:, None]

    def in_metres(self) -> "RestJoints":
        """Return the joints with the same axes in a world of metres with Y up, without scales."""
        above = np.concatenate([quat.IDENTITY[None], self.orientations[list(self.parents[1:])]])
        return RestJoints(
            self.source,
            self.names,
            self.parents,
            quat.normalize(quat.mul(quat.conj(above), self.orientations)),
            quat.rotate(quat.conj(above), self.skeleton.offsets),
            np.ones((len(self.names), 3)),
            WORLD,
            1.0,
            "y",
        )
