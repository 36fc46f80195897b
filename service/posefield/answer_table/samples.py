"""Answers of a model at many controls, each at the same shares of its own duration."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.array_shapes import PointControls
from posefield.common.units import Floats, Indices, Singles
from posefield.inference.graph_ports import CURVES
from posefield.inference.session import Session
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.stride import Strides
from posefield.model_file.model_card import PERFORMER, LabelSet, ModelCard

BATCH = 256
OUTPUTS = ("rotations", "root_position", "bone_offsets", "duration", "sigma")
TURNS = ("rotations", "placed_turns")
"""Arrays of quaternions of an answer."""
MOVING = (*TURNS, "roots", "placed_roots", "curves")
"""Arrays of an answer that have frames."""


@dataclass(frozen=True)
class Queries:
    """Questions of B characters: controls (B, d), names (B,) and one level of detail.

    who: names by index in the named label set, -1 where it is left open.
    """

    controls: PointControls
    who: Annotated[Indices, "points"]
    level: int = 0

    def __len__(self) -> int:
        return len(self.controls)

    def rows(self, which: slice) -> "Queries":
        """Return some of the questions."""
        return Queries(self.controls[which], self.who[which], self.level)


@dataclass(frozen=True)
class Answers:
    """Answers to B questions in F frames.

    rotations: local to the parent, the root's in the character's frame. roots: of the root, m.
    placed_turns, placed_roots: rotation and position of the root in place, without its travel.
    curves: C values in their own units. bones: offsets, m. durations: s. sigmas: m.
    """

    rotations: Annotated[Singles, "points frames joints 4"]
    roots: Annotated[Singles, "points frames 3"]
    placed_turns: Annotated[Singles, "points frames 4"]
    placed_roots: Annotated[Singles, "points frames 3"]
    curves: Annotated[Singles, "points frames curves"]
    bones: Annotated[Singles, "points joints 3"]
    durations: Annotated[Singles, "points"]
    sigmas: Annotated[Singles, "points"]


def named_set(card: ModelCard) -> LabelSet | None:
    """Return the label set whose names are asked one by one; all other sets are left open.

    That of performers, else the first; None for a model without labels.
    """
    first = next(iter(card.labels), None)
    return next((own for own in card.labels if own.name == PERFORMER), first)


def names(card: ModelCard) -> tuple[str, ...]:
    """Return the names of the named label set; empty for a model without labels."""
    own = named_set(card)
    return own.names if own else ()


def sample(session: Session, asked: Queries, frames: int) -> Answers:
    """Return the model's answers at F evenly spaced frames, the first and the last pose included.

    Measured controls are not corrected: the answers are those of `exact="none"`.
    """
    parts = []
    for first in range(0, len(asked), BATCH):
        cancellation.check()
        parts.append(_sampled(session, asked.rows(slice(first, first + BATCH)), frames))
    columns = zip(*(vars(part).values() for part in parts), strict=True)
    return Answers(*(np.concatenate(column) for column in columns))


def _sampled(session: Session, asked: Queries, frames: int) -> Answers:
    labels, level = _weights(session.card, asked.who), asked.level
    lengths = session.durations(asked.controls, labels, level)
    shares = np.linspace(0.0, 1.0, frames)
    times = lengths[:, None] * shares
    outputs = (*OUTPUTS, CURVES) if session.card.curves else OUTPUTS
    turns, roots, bones, durations, sigmas, *others = session.run(
        asked.controls, times, *outputs, labels=labels, level=level
    )
    curves = others[0] if others else np.zeros((*times.shape, 0), np.float32)
    placed_turns, placed_roots = turns[:, :, 0], roots
    if session.card.root == "travelling":
        measure = stride.strides if session.card.cyclic else stride.straight_strides
        way = measure(session, asked.controls, labels, level)
        placed_turns, placed_roots = _in_place(way, shares, turns[:, :, :1], roots)
    return Answers(turns, roots, placed_turns, placed_roots, curves, bones, durations, sigmas)


def _weights(
    card: ModelCard, who: Annotated[Indices, "points"]
) -> Annotated[Floats, "points labels"]:
    """Return the graph's weights (B, p) of names by index in the named set; zeros for -1."""
    own = named_set(card)
    parts = [
        np.vstack([np.eye(len(each.names)), np.zeros(len(each.names))])[who]
        if each is own
        else np.zeros((len(who), len(each.names)))
        for each in card.labels
    ]
    return np.hstack([np.zeros((len(who), 0)), *parts])


def _in_place(
    way: Strides,
    shares: Annotated[np.ndarray, "frames"],
    turns: Annotated[Singles, "points frames 1 4"],
    roots: Annotated[Singles, "points frames 3"],
) -> tuple[Singles, Singles]:
    """Return rotations (B, F, 4) and positions (B, F, 3) of roots without their travel."""
    points, frames = roots.shape[:2]
    each = Strides(*(np.repeat(column, frames) for column in vars(way).values()))
    poses = stride.relative_poses(
        each,
        np.tile(shares, points),
        turns.reshape(-1, 1, 4).astype(float),
        roots.reshape(-1, 3).astype(float),
    )
    placed = floor_plane.at_height(each.starts + poses.places, poses.heights)
    shape = (points, frames)
    return (
        poses.rotations[:, 0].reshape(*shape, 4).astype(np.float32),
        placed.reshape(*shape, 3).astype(np.float32),
    )
