"""What a model does in one cycle, and its poses apart from where they take place.

A cycle carries its walker along an arc: a way of constant speed and direction in his own axes while
his heading turns evenly. Poses are given in a frame that goes along that arc evenly in time. In
that frame a cycle ends in the very pose that it begins with, whichever way it goes, and all that
sways about the arc is left in the pose.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.motion.card import ModelCard
from service.motion.conventions import Floats, Indices, Singles
from service.synthesis.session import Session
from service.synthesis.walk import plane
from service.synthesis.walk.plane import Plane

# Of more, onnxruntime's buffers outgrow the caches and each costs up to eight times as much.
BATCH = 1000
# The graph takes a time after the end for the end, s.
AFTER = 1e9


@dataclass(frozen=True)
class Strides:
    """One cycle each of B walkers.

    durations (B,), s. ways (B,): covered in a cycle, m, in the walker's own axes. turns (B,):
    change of heading, rad. starts (B,): where the model puts the root at the beginning.
    """

    durations: Floats
    ways: Plane
    turns: Floats
    starts: Plane

    @property
    def speeds(self) -> Floats:
        """Speed (B,) along the arc, m/s."""
        return np.abs(self.ways) / self.durations

    @property
    def turning(self) -> Floats:
        """Rate of turning (B,) to the left, rad/s."""
        return self.turns / self.durations

    @property
    def drifts(self) -> Floats:
        """Angle (B,) to the left of the heading at which the walker goes, rad."""
        return np.angle(self.ways)


@dataclass(frozen=True)
class Poses:
    """K poses in frames that go along: rotations (K, J, 4), heights (K,), m, of the root, and where
    it is (K,) over the floor."""

    rotations: Floats
    heights: Floats
    places: Plane


def strides(session: Session, controls: Floats, labels: Floats, level: int = 0) -> Strides:
    """Cycles of controls (B, d) as performers of labels (B, p) walk them at a level of detail."""
    ends = np.full((len(controls), 1), AFTER)
    asked = ("duration", "travel", "root_position")
    durations, travel, roots = _ask(session, controls, ends, labels, level, *asked)
    gap, turns = travel[:, 0, 1] + 1j * travel[:, 0, 0], travel[:, 0, 2]
    # Without its travel a cycle ends where it began.
    starts = plane.of(roots[:, 0]) - gap
    return Strides(durations, plane.straightened(gap, turns), turns, starts)


def straight(session: Session, controls: Floats, labels: Floats, level: int = 0) -> Strides:
    """The same of clips that are no cycles: the straight way from the first pose to the last."""
    times = np.tile([0.0, AFTER], (len(controls), 1))
    asked = ("duration", "root_position")
    durations, roots = _ask(session, controls, times, labels, level, *asked)
    begin, end = plane.of(roots).T
    return Strides(durations, end - begin, np.zeros(len(begin)), begin)


def poses(
    session: Session, controls: Floats, labels: Floats, phases: Floats, level: int = 0
) -> Poses:
    """Poses of controls (K, d), labels (K, p) and phases (K,) of the cycle, from 0 to 1."""
    own = strides(session, controls, labels, level)
    times = (phases * own.durations)[:, None]
    asked = ("rotations", "root_position")
    rotations, roots = _ask(session, controls, times, labels, level, *asked)
    return beside(own, phases, rotations[:, 0], roots[:, 0])


def beside(own: Strides, phases: Floats, rotations: Floats, roots: Floats) -> Poses:
    """Poses of rotations (K, J, 4) and roots (K, 3) at phases (K,) of K strides, or of one."""
    turned = phases * own.turns
    gone = plane.of(roots) - own.starts - plane.arc(phases * own.ways, turned)
    return Poses(plane.turned(rotations, -turned), roots[:, 1], gone * plane.facing(-turned))


def bones(session: Session, controls: Floats, labels: Floats) -> Singles:
    """Bone offsets (B, J, 3), m, at controls (B, d) and labels (B, p)."""
    begin = np.zeros((len(controls), 1))
    return _ask(session, controls, begin, labels, 0, "bone_offsets")[0].astype(np.float32)


def movers(card: ModelCard) -> Indices:
    """Whose each captured clip is (N,), by place on the card, or -1 where nobody is told apart."""
    return np.array(card.moved_by or [-1] * len(card.examples))


def labels(session: Session, who: Indices) -> Floats:
    """Labels (..., p) of performers by their place on the card; all zero at -1, for nobody."""
    performers = len(session.card.performers)
    return np.vstack([np.eye(performers), np.zeros(performers)])[who]


def _ask(
    session: Session, controls: Floats, times: Floats, labels: Floats, level: int, *outputs: str
) -> list[Floats]:
    """Outputs for any number of rows, a batch at a time."""
    answers = [
        session.run(controls[rows], times[rows], *outputs, labels=labels[rows], level=level)
        for rows in _batches(len(controls))
    ]
    return [np.concatenate(parts).astype(np.float64) for parts in zip(*answers, strict=True)]


def _batches(rows: int) -> Iterator[slice]:
    return (slice(first, first + BATCH) for first in range(0, rows, BATCH))
