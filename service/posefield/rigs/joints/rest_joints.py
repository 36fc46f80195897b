"""Joints of a character's file at rest, and their conversion from and to skeletons in metres.

A file stores a rotation of every joint at rest, in its own unit and axes. With R for the
orientation of a joint at rest in the world, and P for that of its parent, a rotation Q of the file
is P Q R⁻¹ in a skeleton that is at rest with identity rotations, and a translation t is s P t, with
s for the metres of the parent's unit.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from posefield.common.array_shapes import Bones, JointRotations, JointWeights, Positions, Rotations
from posefield.common.units import Floats, UpAxis
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield.rigs.joints import posed_joints
from posefield.rigs.joints.posed_joints import PosedJoints

Z_UP = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(-0.5 * np.pi))
"""Rotation of the axes of a file with Z up: (x, y, z) becomes (x, z, -y)."""

MAX_JOINTS = 1000
"""Limit of joints, several times those of any character."""


@dataclass(frozen=True)
class OuterTransform:
    """Transform from the root joint's parent to the file's world: scale, rotation, translation."""

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
        return posed_joints.plain_motion(own).skeleton

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
