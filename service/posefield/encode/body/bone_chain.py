"""Chain of bones: a path from joint to joint to a tip, and which joint moves what along it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from posefield.common.units import Floats

SOFTNESS = 0.34
"""Share of the shorter of two bones, from the joint between them, in which both move the skin."""
SHORTEST = 1e-3
"""Length, m, below which two points of a chain count as one."""


class ChainPlace(NamedTuple):
    """Place along a chain: after which of its points, and the share of the way to the next."""

    segment: int
    share: float


@dataclass(frozen=True)
class BoneChain:
    """Distinct points from a joint outwards.

    anchors (K,): joints and, after all joints, tips. joints (K - 1,): the one that turns each
    segment. points (K, 3): m. tipped: whether the last point is a tip.
    """

    anchors: tuple[int, ...]
    joints: tuple[int, ...]
    points: Floats
    tipped: bool

    @property
    def marks(self) -> Floats:
        """Return the distance (K,) of each point from the first along the chain, m."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=-1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def at(self, mark: float) -> ChainPlace:
        """Return the place at a distance, m; places beyond the ends belong to the last segments."""
        marks = self.marks
        segment = int(np.clip(np.searchsorted(marks, mark, "right") - 1, 0, len(marks) - 2))
        share = (mark - marks[segment]) / (marks[segment + 1] - marks[segment])
        return ChainPlace(segment, float(np.clip(share, 0.0, 1.0)))

    def nearest(self, point: Floats) -> ChainPlace:
        """Return the place nearest to a point (3,)."""
        starts, arms = self.points[:-1], np.diff(self.points, axis=0)
        shares = np.clip(
            ((point - starts) * arms).sum(axis=-1) / (arms * arms).sum(axis=-1), 0.0, 1.0
        )
        far = np.linalg.norm(point - starts - shares[:, None] * arms, axis=-1)
        segment = int(np.argmin(far))
        return ChainPlace(segment, float(shares[segment]))

    def weights(self, place: ChainPlace) -> dict[int, float]:
        """Return the weight of each joint that moves the skin at a place; they sum to 1."""
        marks = self.marks
        lengths = np.diff(marks)
        mark = marks[place.segment] + place.share * lengths[place.segment]
        passed = [1.0]
        for index in range(1, len(lengths)):
            half = SOFTNESS * min(lengths[index - 1], lengths[index])
            x = float(np.clip(0.5 + 0.5 * (mark - marks[index]) / half, 0.0, 1.0))
            passed.append(x * x * (3.0 - 2.0 * x))
        found: dict[int, float] = {}
        for joint, here, after in zip(self.joints, passed, [*passed[1:], 0.0], strict=True):
            if here > after:
                found[joint] = found.get(joint, 0.0) + here - after
        return found


def chain(path: Sequence[int], places: Floats, joints: int) -> BoneChain:
    """Return the chain through joints and perhaps a tip last, without those that coincide.

    path: indices of joints or tips; places (J + E, 3): of all joints and tips, m; joints: J. Of
    joints that coincide the last turns the bone beyond. A chain of a single point gets a second
    one, SHORTEST above it.
    """
    anchors, turning = [path[0]], [path[0]]
    for point in path[1:]:
        if np.linalg.norm(places[point] - places[anchors[-1]]) < SHORTEST:
            if point < joints:
                turning[-1] = point
            continue
        anchors.append(point)
        turning.append(point if point < joints else turning[-1])
    points = places[anchors]
    if len(anchors) == 1:
        anchors *= 2
        points = np.stack([points[0], points[0] + [0.0, SHORTEST, 0.0]])
        turning *= 2
    tipped = anchors[-1] >= joints
    return BoneChain(tuple(anchors), tuple(turning[: len(anchors) - 1]), points, tipped)
