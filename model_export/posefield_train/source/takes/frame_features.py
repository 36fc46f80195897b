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


@dataclass(frozen=True)
class FrameIndex:
    """Frames of all clips, sorted by their joints' mean height above the root.

    features: (F, 2 J) of all frames. owners, frames: clip, and frame within it, of each. order:
    (F,) by mean height. heights: the sorted mean heights, m.
    """

    features: Floats
    owners: Indices
    frames: Indices
    order: Indices
    heights: Floats

    def like(self, wanted: Annotated[Floats, "features"]) -> Iterator[tuple[int, int]]:
        """Yield clip and frame of all frames whose features are the same as the wanted ones."""
        height = _mean_heights(wanted[None])[0]
        first, last = np.searchsorted(self.heights, [height - SAME, height + SAME])
        near = self.order[first:last]
        apart = np.linalg.norm(self.features[near] - wanted, axis=1)
        for found in np.sort(near[apart < SAME]):
            yield int(self.owners[found]), int(self.frames[found])


def index_frames(features: Sequence[Floats]) -> FrameIndex:
    """Return the index of the frames of clips with features (F, 2 J) each."""
    lengths = [len(own) for own in features]
    whole = np.concatenate(features)
    heights = _mean_heights(whole)
    order = np.argsort(heights, kind="stable")
    return FrameIndex(
        whole,
        np.repeat(np.arange(len(lengths)), lengths),
        np.concatenate([np.arange(length) for length in lengths]),
        order,
        heights[order],
    )


def _mean_heights(features: Annotated[Floats, "frames features"]) -> Annotated[Floats, "frames"]:
    """Return the mean height (F,) of the joints above the root, m."""
    joints = features.shape[1] // 2
    return np.asarray(features[:, :joints].sum(axis=1) / np.sqrt(joints))
