"""Limits of knees and elbows: each joint turns about one axis, within the range of its captures.

A rotation r exp(a flexion) s is a turn from the straight limb r about the hinge's axis a, and a
swing s off the hinge, whose two angles are those of its gnomonic projection: about the bone below
the joint, as a forearm twists, and sideways.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from posefield.common.bounded_types import Index, Number
from posefield.common.units import Booleans, Floats
from posefield.motion import quat

FREE, MOST = np.radians(1.0), np.radians(3.0)
"""Angles beyond the captured range up to which a rotation stays as it is, and which it never
exceeds, rad."""

LEAST_BEND = 0.03
"""Mean sine of the bend of a limb from which its axis is known."""
DECIMALS = 5
RANGE = "low", "high"

Triple = tuple[Number, Number, Number]
HingeRotations = Annotated[Floats, "*poses hinges 4"]
Angles = Annotated[Floats, "*poses hinges 3"]


@dataclass(frozen=True)
class Hinge:
    """Axis and captured angles of a knee or an elbow.

    joint: index. reference: local rotation of the straight limb. axis: of the flexion, in the
    joint's frame, orthogonal to `bone`, the direction of the bone below the joint. low, high:
    captured angles, rad, of flexion (positive where the limb bends), twist about the bone, and
    sideways.
    """

    joint: Index
    reference: tuple[Number, Number, Number, Number]
    axis: Triple
    bone: Triple
    low: Triple
    high: Triple


class LimitedAngles(NamedTuple):
    """Angles (..., H, 3), rad, within the limits.

    shares: their slopes by the angles before. beyond: whether a hinge (..., H) was changed.
    """

    angles: Angles
    shares: Angles
    beyond: Annotated[Booleans, "*poses hinges"]


@dataclass(frozen=True)
class Hinges:
    """Limits of H joints.

    joints: index of each in a skeleton or a chain. frames: rows (H, 4, 4) that take a local
    rotation to its components relative to the reference, along 1, axis, bone and their vector
    product. axes (H, 3, 3): these three directions, in the joint's frame. low, high: captured
    angles (H, 3), rad.
    """

    joints: tuple[int, ...]
    frames: Annotated[Floats, "hinges 4 4"]
    axes: Annotated[Floats, "hinges 3 3"]
    low: Annotated[Floats, "hinges 3"]
    high: Annotated[Floats, "hinges 3"]

    def __len__(self) -> int:
        return len(self.joints)

    def of_chain(self, links: Sequence[int]) -> "Hinges":
        """Return the hinges among some joints, with their places there as indices."""
        rows = [row for row, joint in enumerate(self.joints) if joint in links]
        places = tuple(links.index(self.joints[row]) for row in rows)
        return Hinges(places, *(a[rows] for a in (self.frames, self.axes, self.low, self.high)))

    def angles(self, rotations: Annotated[Floats, "*poses joints 4"]) -> Angles:
        """Return the angles (..., H, 3), rad, of the hinges in local rotations (..., J, 4).

        The flexion is the one nearest to the middle of its range.
        """
        return self.turn_angles(rotations[..., list(self.joints), :])

    def within(
        self, rotations: Annotated[Floats, "*poses joints 4"], centres: Angles | None = None
    ) -> Annotated[Floats, "*poses joints 4"]:
        """Return local rotations (..., J, 4) whose hinges are within their limits, as by `limit`.

        The same array where they are.
        """
        turns = rotations[..., list(self.joints), :]
        limited = self.limit(self.turn_angles(turns), centres)
        if not limited.beyond.any():
            return rotations
        bounded = rotations.copy()
        bounded[..., list(self.joints), :] = self.limited_turns(turns, limited)
        return bounded

    def limit(self, angles: Angles, centres: Angles | None = None) -> LimitedAngles:
        """Return angles (..., H, 3) that are at most MOST beyond their captured range.

        centres: angles about which they deviate; half of the way from them to the limit is free,
        and larger deviations approach the limit smoothly. Without them, what is beyond the range by
        up to FREE is free.
        """
        near = np.clip(angles if centres is None else centres, self.low, self.high)
        away = angles - near
        away[..., 0] -= 2.0 * np.pi * np.round(away[..., 0] / (2.0 * np.pi))
        room = MOST + np.where(away > 0.0, self.high - near, near - self.low)
        free = FREE if centres is None else 0.5 * room
        excess = (np.abs(away) - free) / (room - free)
        beyond, limited, shares = excess > 0.0, angles.copy(), np.ones(angles.shape)
        if beyond.any():
            excess, near, away, free, room = (
                np.broadcast_to(values, angles.shape)[beyond]
                for values in (excess, near, away, free, room)
            )
            limited[beyond] = near + np.sign(away) * (free + (room - free) * np.tanh(excess))
            shares[beyond] = 1.0 / np.square(np.cosh(excess))
        return LimitedAngles(limited, shares, beyond.any(axis=-1))

    def limited_turns(self, turns: HingeRotations, limited: LimitedAngles) -> HingeRotations:
        """Return the rotations (..., H, 4) of limited angles; those within the limits as before."""
        return np.where(limited.beyond[..., None], self._rotations(limited.angles, turns), turns)

    def slopes(self, limited: LimitedAngles) -> Annotated[Floats, "*poses hinges 3 3"]:
        """Return the matrices (..., H, 3, 3) by which limits scale small turns of the joints.

        Both turns are in the joint's frame; to first order in the angles off the hinge.
        """
        scaled = limited.shares[..., None] * self.axes
        slopes: Floats = np.swapaxes(self.axes, -1, -2) @ scaled
        return slopes

    def turn_angles(self, turns: HingeRotations) -> Angles:
        """Return the angles (..., H, 3), rad, of rotations (..., H, 4) as `angles` does."""
        # Not a matrix product, whose sums could go in another order for more poses.
        frames = self.frames
        w, x, y, z = (turns[..., axis] for axis in range(4))
        real, flexed, twisted, aside = (
            row[..., 0] * w + row[..., 1] * x + row[..., 2] * y + row[..., 3] * z
            for row in frames.swapaxes(0, 1)
        )
        middle = 0.5 * (self.low + self.high)[:, 0]
        flexion = 2.0 * np.arctan2(flexed, real)
        flexion -= 2.0 * np.pi * np.round((flexion - middle) / (2.0 * np.pi))
        size = np.hypot(real, flexed)
        cosine, sine = real / np.maximum(size, 1e-12), flexed / np.maximum(size, 1e-12)
        twist = 2.0 * np.arctan2(cosine * twisted + sine * aside, size)
        sideways = 2.0 * np.arctan2(cosine * aside - sine * twisted, size)
        angles = quat.components_first(flexion, 3)
        angles[..., 1], angles[..., 2] = twist, sideways
        return angles

    def bend(
        self,
        rotations: Annotated[Floats, "frames 1 4"],
        above: Annotated[Floats, "#frames 3"],
        below: Annotated[Floats, "#frames 3"],
        squares: Annotated[Floats, "frames"],
    ) -> Annotated[Floats, "frames 1 4"]:
        """Return the rotations (F, 1, 4) with which the ends of a limb of one hinge are apart.

        above, below: bones (F, 3), m, or one for all, in the frames of the parent and of the joint.
        squares: of the distances (F,), m². What is off the hinge stays, within the limits.
        """
        angles = self.limit(self.turn_angles(rotations)).angles
        straight = angles * [0.0, 1.0, 1.0]
        axis, reference = self.axes[0, 0], self.frames[0, 0]
        turned = quat.rotate(self._rotations(straight, rotations)[:, 0], below)
        lower = quat.rotate(quat.conj(reference), turned)
        upper = quat.rotate(quat.conj(reference), above)
        # upper . exp(axis t) lower = constant + cosine cos t + sine sin t
        constant = (upper @ axis) * (lower @ axis)
        cosine = np.sum(upper * lower, axis=-1) - constant
        sine = np.sum(upper * quat.cross(axis, lower), axis=-1)
        sizes = np.sum(np.square(above), axis=-1) + np.sum(np.square(below), axis=-1)
        share = (0.5 * (squares - sizes) - constant) / np.hypot(cosine, sine)
        flexion = np.arctan2(sine, cosine) + np.arccos(np.clip(share, -1.0, 1.0))
        angles[..., 0] = flexion[:, None]
        return self._rotations(self.limit(angles).angles, rotations)

    def _rotations(self, angles: Angles, near: HingeRotations) -> HingeRotations:
        """Return the rotations of angles, with the signs of the rotations `near`."""
        half = 0.5 * angles
        cosine, sine = np.cos(half[..., 0]), np.sin(half[..., 0])
        twist, sideways = np.tan(half[..., 1]), np.tan(half[..., 2])
        parts = (
            cosine,
            sine,
            cosine * twist - sine * sideways,
            cosine * sideways + sine * twist,
        )
        columns = [sum(map(np.multiply, parts, rows)) for rows in self.frames.transpose(2, 1, 0)]
        turns = np.moveaxis(np.stack(columns), 0, -1)
        same = np.sum(turns * near, axis=-1, keepdims=True) >= 0.0
        return quat.normalize(np.where(same, turns, -turns))


@lru_cache(64)
def from_card(hinges: tuple[Hinge, ...]) -> Hinges:
    """Return the limits of the hinges of a model card."""
    axes = np.array([_axes(hinge) for hinge in hinges]).reshape(-1, 3, 3)
    references = quat.normalize(np.array([h.reference for h in hinges]).reshape(-1, 1, 4))
    turns = np.zeros((len(hinges), 4, 4))
    turns[:, 0, 0], turns[:, 1:, 1:] = 1.0, axes
    low, high = (np.array([getattr(h, end) for h in hinges]).reshape(-1, 3) for end in RANGE)
    joints = tuple(hinge.joint for hinge in hinges)
    return Hinges(joints, quat.mul(references, turns), axes, low, high)


@lru_cache(64)
def one_joint(hinge: Hinge) -> Hinges:
    """Return the limits of one hinge, whose joint has the index 0."""
    return from_card((replace(hinge, joint=0),))


def _axes(hinge: Hinge) -> Annotated[Floats, "3 3"]:
    """Return the directions of axis, bone and their vector product."""
    # Numbers of a card are rounded.
    axis, bone = quat.normalize(np.array(hinge.axis)), np.array(hinge.bone)
    bone = quat.normalize(bone - (bone @ axis) * axis)
    return np.stack([axis, bone, quat.cross(axis, bone)])


def measure(
    joint: int,
    rotations: Annotated[Floats, "frames 4"],
    above: Annotated[Floats, "frames 3"],
    below: Annotated[Floats, "frames 3"],
) -> Hinge | None:
    """Return the hinge of a joint by its captured local rotations (F, 4).

    above, below: offsets (F, 3), m, of the joint from its parent and of the next joint of the limb
    from it. None for a limb that is straight in all frames, whose axis is unknown.
    """
    # The limb bends about the mean normal of its two bones, which a twist of the bone below turns
    # but does not hide.
    above, below = quat.normalize(above), quat.normalize(below)
    before = quat.rotate(quat.conj(rotations), above)
    normals = quat.cross(before, below)
    bone, axis = quat.normalize(below.mean(axis=0)), normals.mean(axis=0)
    axis = axis - (axis @ bone) * bone
    if np.linalg.norm(axis) < LEAST_BEND:
        return None
    axis = quat.normalize(axis)
    flexion = np.arctan2(normals @ axis, np.sum(before * below, axis=-1))
    straight = quat.mul(rotations, quat.from_axis_angle(axis, -flexion))
    reference = quat.mean(straight[:, None])[0]
    nearest = float(flexion.mean())
    unlimited = Hinge(
        0, *map(rounded, (reference, axis, bone, [nearest, 0.0, 0.0], [nearest, 0.0, 0.0]))
    )
    angles = one_joint(unlimited).angles(rotations[:, None])[:, 0]
    low, high = rounded(angles.min(axis=0)), rounded(angles.max(axis=0))
    return replace(unlimited, joint=joint, low=low, high=high)


def rounded(numbers: Sequence[float] | Annotated[Floats, "..."]) -> Any:
    """Return numbers as cards store them."""
    # Adding zero takes the sign of a negative one away.
    return tuple(round(float(number), DECIMALS) + 0.0 for number in numbers)
