"""Motions as what is compared: joints and the skin around them, in even steps of their own time."""

from dataclasses import dataclass

import numpy as np

from model_export import align
from service.motion import quat, skeleton
from service.motion.clip import Clip
from service.motion.conventions import Floats

FRAMES = 60
EVEN = np.linspace(0.0, 1.0, FRAMES)
# Three points at right angles this far from a joint, m, as the Animation Compression Library has.
SHELL = 0.03


@dataclass(frozen=True)
class Motion:
    """points (FRAMES, J, 4, 3): each joint, then three points of the shell around it, m. duration,
    s. event: position (3,) of the event's joint at its event, m; None where there is no event."""

    points: Floats
    duration: float
    event: Floats | None

    @property
    def joints(self) -> Floats:
        """Joint positions (FRAMES, J, 3), m."""
        return self.points[:, :, 0]


@dataclass(frozen=True)
class Event:
    """Which joint is looked at, and at which share of a motion's duration."""

    joint: int
    share: float

    def of(self, joints: Floats) -> Floats:
        """Where the joint is then (3,), m."""
        return align.at(joints[:, self.joint], np.array([self.share]))[0]


def of_clip(clip: Clip, event: Event | None) -> Motion:
    """Motion of a captured clip on its own skeleton."""
    rotations, path = align.resample(clip, EVEN)
    translations = skeleton.translations(clip.translations.mean(axis=0), path)
    return posed(clip.skeleton.parents, rotations, translations, clip.duration, event)


def posed(
    parents: tuple[int, ...],
    rotations: Floats,
    translations: Floats,
    duration: float,
    event: Event | None,
) -> Motion:
    """Motion of local rotations (FRAMES, J, 4) and translations (FRAMES, J, 3), m."""
    positions, orientations = skeleton.forward(parents, rotations, translations)
    axes = quat.rotate(orientations[:, :, None], SHELL * np.eye(3))
    shell = positions[:, :, None] + axes
    points = np.concatenate([positions[:, :, None], shell], axis=2)
    return Motion(points, duration, event.of(positions) if event else None)
