"""Feet that are to stay where they stand while the rest is corrected.

A pin is an aim that may be missed by a centimetre or so: a foot that stands is looked at every so
many frames, and asked to be where the prediction has it. Feet that slide there slide on: no
correction of the reach mends them.
"""

from collections.abc import Sequence

import numpy as np

from service.motion.conventions import UP, Floats, Truths
from service.motion.ground import PLANTED
from service.motion.measure import Measure
from service.synthesis.exact.aims import Place
from service.synthesis.exact.scene import Scene

# By how much a pinned foot may still move, m: as many standard deviations as anything else.
LOOSE = 0.01
# Of the canonical frames in which a foot stands, one in so many is pinned, and the last.
EVERY = 8


def pins(scene: Scene, numbers: Floats, feet: Sequence[int]) -> list[Place]:
    """Pins for the feet of a motion, wherever it has one on the ground."""
    return [pin for foot in feet for pin in _of(scene, numbers, foot)]


def _of(scene: Scene, numbers: Floats, foot: int) -> list[Place]:
    places = np.arange(float(scene.reduced.frames))
    path = scene.positions(numbers, foot, places)
    moment = Measure("height", (foot,), "landmark")
    return [
        Place((f"foot {foot}",), moment, (0, 1, 2), path[frame], float(frame))
        for frame in _chosen(down(path))
    ]


def down(path: Floats) -> Truths:
    """Whether a foot on a path (F, 3), m, stands at each frame: near its lowest, and not alone."""
    heights = path @ UP
    near = heights < heights.min() + PLANTED
    before, after = np.roll(near, 1), np.roll(near, -1)
    before[0] = after[-1] = False
    found: Truths = near & (before | after)
    return found


def _chosen(stands: Truths) -> list[int]:
    """Some frames of each run in which it stands, the first and the last among them."""
    frames = np.flatnonzero(stands)
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    return [int(f) for run in runs if len(run) for f in {*run[::EVERY].tolist(), int(run[-1])}]
