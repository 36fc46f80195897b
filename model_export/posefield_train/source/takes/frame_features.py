"""Features of frames that neither the place, the heading nor a mirror changes.

They find candidates for shared frames; a comparison of joint positions then decides.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Positions
from posefield.common.units import Floats, Indices

SAME = 0.001
"""Root mean square distance of joints below which two frames are the same, m: a file that a tool
wrote again with fewer digits differs by less, two performances by more."""


def frame_features(motion: Positions) -> Annotated[Floats, "frames features"]:
    """Return heights of the joints and horizontal distances from the root (F, 2 J), m / sqrt(J).

    Features of two frames differ at most as much as their joint positions (F, J, 3), root mean
    square, after any turn about the vertical and any horizontal move.
    """
    relative = motion - motion[:, :1]
    away = np.hypot(relative[..., 0], relative[..., 2])
    joints = motion.shape[1]
    return np.concatenate([relative[..., 1], away], axis=1) / np.sqrt(joints)


CHECKED = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Shares of common frames at which features are compared before all joints are: a pose that is held
is like thousands of others."""


@dataclass(frozen=True)
class FrameIndex:
    """Frames of all clips, sorted by their joints' mean height above the root.

    features: (F, 2 J) of all frames. counts: frames of each clip. owners, frames: clip, and frame
    within it, of each. order: (F,) by mean height. heights: the sorted mean heights, m.
    """

    features: Floats
    counts: Indices
    owners: Indices
    frames: Indices
    order: Indices
    heights: Floats

    def like(self, wanted: Annotated[Floats, "_ features"]) -> Iterator[tuple[int, int]]:
        """Yield clip and frame of all frames from which on the features may be the wanted ones.

        They are compared at CHECKED of the frames that the clip and the wanted ones have.
        """
        height = _mean_heights(wanted[:1])[0]
        first, last = np.searchsorted(self.heights, [height - SAME, height + SAME])
        near = np.sort(self.order[first:last])
        common = np.minimum(self.counts[self.owners[near]] - self.frames[near], len(wanted)) - 1
        for share in CHECKED:
            ahead = (share * common).astype(int)
            apart = np.linalg.norm(self.features[near + ahead] - wanted[ahead], axis=1)
            near, common = near[apart < SAME], common[apart < SAME]
        for found in near:
            yield int(self.owners[found]), int(self.frames[found])


def index_frames(features: Sequence[Floats]) -> FrameIndex:
    """Return the index of the frames of clips with features (F, 2 J) each."""
    lengths = [len(own) for own in features]
    whole = np.concatenate(features)
    heights = _mean_heights(whole)
    order = np.argsort(heights, kind="stable")
    return FrameIndex(
        whole,
        np.array(lengths),
        np.repeat(np.arange(len(lengths)), lengths),
        np.concatenate([np.arange(length) for length in lengths]),
        order,
        heights[order],
    )


def _mean_heights(features: Annotated[Floats, "frames features"]) -> Annotated[Floats, "frames"]:
    """Return the mean height (F,) of the joints above the root, m."""
    joints = features.shape[1] // 2
    return np.asarray(features[:, :joints].sum(axis=1) / np.sqrt(joints))
