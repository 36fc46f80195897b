"""Motions in the form that is compared: joints and points around them at uniform time steps."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield_train.align import time_alignment

FRAMES = 60
EVEN = np.linspace(0.0, 1.0, FRAMES)
# Distance of three points at right angles from a joint, m, as in the Animation Compression Library.
SHELL = 0.03


@dataclass(frozen=True)
class Motion:
    """A motion of J joints.

    points: each joint and three points around it (FRAMES, J, 4, 3), m. duration: s. event: position
    (3,) of the event's joint at its event, m; None without an event.
    """

    points: Floats
    duration: float
    event: Floats | None

    @property
    def joints(self) -> Floats:
        """Return the joint positions (FRAMES, J, 3), m."""
        return self.points[:, :, 0]


@dataclass(frozen=True)
class Event:
    """Event of a motion. joint: its index. share: its time as a share of the duration."""

    joint: int
    share: float

    def of(self, joints: Floats) -> Floats:
        """Return the joint's position (3,) at that time, m. joints: (FRAMES, J, 3)."""
        return time_alignment.at(joints[:, self.joint], np.array([self.share]))[0]


def of_clip(clip: Clip, event: Event | None) -> Motion:
    """Return the motion of a captured clip on its own skeleton."""
    rotations, path = time_alignment.resample(clip, EVEN)
    translations = skeleton.translations(clip.translations.mean(axis=0), path)
    return posed(clip.skeleton.parents, rotations, translations, clip.duration, event)


def posed(
    parents: tuple[int, ...],
    rotations: Floats,
    translations: Floats,
    duration: float,
    event: Event | None,
) -> Motion:
    """Return the motion of local rotations (FRAMES, J, 4) and translations (FRAMES, J, 3), m."""
    positions, orientations = skeleton.forward(parents, rotations, translations)
    axes = quat.rotate(orientations[:, :, None], SHELL * np.eye(3))
    shell = positions[:, :, None] + axes
    points = np.concatenate([positions[:, :, None], shell], axis=2)
    return Motion(points, duration, event.of(positions) if event else None)
