"""Motions in the form that is compared: joints and points around them at uniform time steps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.curves import Curve, CurveValues
from posefield_train.align import time_alignment
from posefield_train.tensor import motion_tensor
from posefield_train.tensor.motion_tensor import UNIFORM_SHARES

# Distance of three points at right angles from a joint, m, as in the Animation Compression Library.
SHELL_RADIUS = 0.03


@dataclass(frozen=True)
class ComparedMotion:
    """A motion of J joints.

    points: each joint and three points around it (FRAMES, J, 4, 3), m. duration: s. event: position
    (3,) of the event's joint at its event, m; None without an event. curves: values (FRAMES, C);
    None for a family without curves.
    """

    points: Floats
    duration: float
    event: Floats | None
    curves: CurveValues | None = None

    @property
    def joints(self) -> Floats:
        """Return the joint positions (FRAMES, J, 3), m."""
        return self.points[:, :, 0]


@dataclass(frozen=True)
class MotionEvent:
    """Event of a motion. joint: its index. share: its time as a share of the duration."""

    joint: int
    share: float

    def position_of(self, joints: Floats) -> Floats:
        """Return the joint's position (3,) at that time, m. joints: (FRAMES, J, 3)."""
        return time_alignment.interpolate(joints[:, self.joint], np.array([self.share]))[0]


def motion_of_clip(clip: Clip, event: MotionEvent | None) -> ComparedMotion:
    """Return the motion of a captured clip on its own skeleton."""
    poses = motion_tensor.captured_poses(clip)
    own = motion_of_poses(clip.skeleton.parents, *poses, clip.duration, event)
    if clip.curves is None:
        return own
    values = time_alignment.interpolate(clip.curves.values, UNIFORM_SHARES)
    return replace(own, curves=replace(clip.curves, values=values))


def with_curves(
    motions: Sequence[ComparedMotion], curves: tuple[Curve, ...], values: Floats
) -> list[ComparedMotion]:
    """Return motions with the values (Q, FRAMES, C) of their curves, if there are any."""
    if not curves:
        return list(motions)
    pairs = zip(motions, values, strict=True)
    return [replace(motion, curves=CurveValues(curves, own)) for motion, own in pairs]


def motion_of_poses(
    parents: tuple[int, ...],
    rotations: Floats,
    translations: Floats,
    duration: float,
    event: MotionEvent | None,
) -> ComparedMotion:
    """Return the motion of local rotations (FRAMES, J, 4) and translations (FRAMES, J, 3), m."""
    (found,) = motions_of_poses(parents, rotations[None], translations[None], [duration], [event])
    return found


def motions_of_poses(
    parents: tuple[int, ...],
    rotations: Floats,
    translations: Floats,
    durations: Sequence[float],
    events: Sequence[MotionEvent | None],
) -> list[ComparedMotion]:
    """Return motions of local rotations (Q, FRAMES, J, 4) and translations (Q, FRAMES, J, 3), m."""
    positions, orientations = skeleton.forward_kinematics(parents, rotations, translations)
    axes = quat.rotate(orientations[..., None, :], SHELL_RADIUS * np.eye(3))
    points = positions[..., None, :] + np.concatenate(
        [np.zeros_like(axes[..., :1, :]), axes], axis=-2
    )
    listed = zip(points, durations, positions, events, strict=True)
    return [
        ComparedMotion(own, duration, event.position_of(joints) if event else None)
        for own, duration, joints, event in listed
    ]
