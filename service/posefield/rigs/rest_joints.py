"""Joints of files at rest, whose rest pose has rotations, as skeletons at rest without.

USD and glTF store a rotation of every joint at rest, in the unit and axes of the file; BVH and this
project's models do not. With R for the orientation of a joint at rest, and P for that of its
parent, in the file's world, a rotation Q of the file becomes P Q R⁻¹ and a translation t becomes
s P t, with s for the metres of the parent's unit: every joint stays where it is, and bones of the
rest pose keep their directions.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from posefield.common.array_shapes import Bones, JointRotations, JointWeights, Positions, Rotations
from posefield.common.errors import MotionFileError
from posefield.common.units import Floats, UpAxis
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton


@contextmanager
def naming_faults(source: str, *faults: type[Exception]) -> Iterator[None]:
    """Raise faults of values of wrong types as MotionFileError with the file's name."""
    try:
        yield
    except faults as fault:
        said = f"{type(fault).__name__}: {' '.join(str(fault).split())[:200]}"
        raise MotionFileError(source, f"breaks its format: {said}") from fault


SCALE_TOLERANCE = 2e-3
"""Largest relative change of a scale that is rounding: USD stores scales in half precision."""


@dataclass(frozen=True)
class PosedJoints:
    """Joints of a file with their rest pose, parents first, and their motion.

    names, parents: as in a skeleton. rest_rotations (J, 4), rest_translations (J, 3): local to the
    parent at rest. rotations (F, J, 4), translations (F, J, 3), scales (F, J, 3): local to the
    parent in the motion. Those of the root are in the file's world.
    """

    source: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    rest_rotations: Floats
    rest_translations: Bones
    rotations: Rotations
    translations: Positions
    scales: Positions


@dataclass(frozen=True)
class PlainMotion:
    """A skeleton at rest with identity rotations, and its motion, as in a MotionFile."""

    skeleton: Skeleton
    rotations: Rotations
    translations: Positions


def plain_motion(joints: PosedJoints) -> PlainMotion:
    """Return the joints at rest with identity rotations and without scale.

    Raises MotionFileError for a scale that is animated, uneven or mirrored.
    """
    sizes = _constant_scales(joints)
    # Products (J,) of the scales of each joint's ancestors.
    above = np.ones(len(sizes))
    for joint, parent in enumerate(joints.parents[1:], start=1):
        above[joint] = above[parent] * sizes[parent]
    # Orientations (J, 4) of the joints at rest in the file's world.
    turns = quat.normalize(joints.rest_rotations)
    for joint, parent in enumerate(joints.parents[1:], start=1):
        turns[joint] = quat.normalize(quat.mul(turns[parent], turns[joint]))
    parents = np.array(joints.parents)
    outer = np.concatenate([quat.IDENTITY[None], turns[parents[1:]]])
    rotations = quat.mul(quat.mul(outer, quat.normalize(joints.rotations)), quat.conj(turns))
    translations = quat.rotate(outer, above[:, None] * joints.translations)
    offsets = quat.rotate(outer, above[:, None] * joints.rest_translations)
    skeleton = Skeleton(joints.names, joints.parents, offsets, (), np.zeros((0, 3)))
    return PlainMotion(skeleton, rotations, translations)


def _constant_scales(joints: PosedJoints) -> Floats:
    """Return the scale (J,) of each joint; MotionFileError if it is not constant and even."""
    scales = joints.scales
    usual = scales[0].mean(axis=-1)
    apart = np.abs(scales - usual[:, None]).max(axis=(0, 2))
    odd = np.flatnonzero(~(apart <= SCALE_TOLERANCE * np.abs(usual)) | (usual <= 0.0))
    if len(odd):
        joint = int(odd[0])
        low, high = scales[:, joint].min(), scales[:, joint].max()
        raise MotionFileError(
            joints.source,
            f"joint {joints.names[joint]!r} has scales from {low:.4g} to {high:.4g}, expected one "
            "positive scale along all axes in all frames: bake the scale into the bones",
        )
    # Scales of 1 in half precision, or of rounded matrices, are 1.
    return np.where(np.abs(usual - 1.0) <= SCALE_TOLERANCE, 1.0, usual)


Z_UP = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(-0.5 * np.pi))
"""Rotation of the axes of a file with Z up: (x, y, z) becomes (x, z, -y)."""

MAX_JOINTS = 1000
"""Limit of joints, several times those of any character."""


@dataclass(frozen=True)
class OuterTransform:
    """Scale, rotation and translation of a node, or from the root's parent to the file's world."""

    rotation: Floats
    translation: Floats
    scale: Floats

    def inside(self, other: "OuterTransform") -> "OuterTransform":
        """Return this transform followed by another one."""
        return OuterTransform(
            quat.mul(other.rotation, self.rotation),
            other.translation + quat.rotate(other.rotation, other.scale * self.translation),
            other.scale * self.scale,
        )


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
    outer: OuterTransform
    metres_per_unit: float
    up: UpAxis

    @cached_property
    def _upright(self) -> OuterTransform:
        """Return the outer transform to metres with Y up."""
        turn = Z_UP if self.up == "z" else quat.IDENTITY
        size = np.full(3, self.metres_per_unit)
        return self.outer.inside(OuterTransform(turn, np.zeros(3), size))

    @cached_property
    def skeleton(self) -> Skeleton:
        """Return the skeleton at rest with identity rotations, in metres with Y up.

        Raises MotionFileError for a scale that is uneven or mirrored.
        """
        outer = self._upright
        turns, places, sizes = self.rotations.copy(), self.translations.copy(), self.scales.copy()
        turns[0] = quat.mul(outer.rotation, turns[0])
        places[0] = outer.translation + quat.rotate(outer.rotation, outer.scale * places[0])
        sizes[0] *= outer.scale
        moved = (turns[None], places[None], sizes[None])
        own = PosedJoints(self.source, self.names, self.parents, turns, places, *moved)
        return plain_motion(own).skeleton

    @cached_property
    def orientations(self) -> JointRotations:
        """Return the orientations (J, 4) at rest in the world with Y up."""
        found = quat.normalize(self.rotations)
        found[0] = quat.mul(self._upright.rotation, found[0])
        for joint, parent in enumerate(self.parents[1:], start=1):
            found[joint] = quat.mul(found[parent], found[joint])
        return found

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
        found = np.empty(len(sizes))
        found[0] = self._upright.scale.mean()
        for joint, parent in enumerate(self.parents[1:], start=1):
            found[joint] = found[parent] * sizes[parent]
        return found

    def file_rotations(self, rotations: Rotations) -> Rotations:
        """Return rotations (F, J, 4) of the plain skeleton as local rotations of the file."""
        turned = quat.mul(quat.conj(self._outer_orientations), rotations)
        return quat.mul(turned, self.orientations)

    def file_translations(self, translations: Positions) -> Positions:
        """Return translations (F, J, 3), m, of the plain skeleton in the file's axes and unit."""
        own = translations.copy()
        own[:, 0] -= self._upright.translation
        turned = quat.rotate(quat.conj(self._outer_orientations), own)
        return turned / self.unit_lengths[:, None]
