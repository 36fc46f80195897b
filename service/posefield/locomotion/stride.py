"""One cycle of a model: its duration and travel, and poses relative to the travel.

A cycle moves a character along an arc: at constant speed and direction in its own axes, while its
heading turns evenly. Poses are given in a frame that moves along that arc evenly in time. In that
frame the last pose of a cycle equals its first, and the sway about the arc is part of the pose.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple

import numpy as np

from posefield.common import cancellation
from posefield.common.units import Floats, Indices, PerPoint, PointControls, PointLabels, Singles
from posefield.inference import onnx_runtime
from posefield.inference.session import Session
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.model_file.model_card import ModelCard

# A time after the end of every clip, s; the graph limits times to the end.
AFTER_END = 1e9
ROWS_PER_CALL = 1000
"""Most rows of a call of the graph."""


class Strides(NamedTuple):
    """One cycle each of B characters, or of N characters in F frames (N, F).

    durations: (B,), s. travels: (B,), along the arc, m, in the character's own axes. turns:
    (B,), change of heading, rad. starts: (B,), root positions at the beginning.
    """

    durations: Annotated[Floats, "*strides"]
    travels: Annotated[FloorVectors, "*strides"]
    turns: Annotated[Floats, "*strides"]
    starts: Annotated[FloorVectors, "*strides"]

    @property
    def speeds(self) -> Annotated[Floats, "*strides"]:
        """Speed (B,) along the arc, m/s."""
        return np.abs(self.travels) / self.durations

    @property
    def turning(self) -> Annotated[Floats, "*strides"]:
        """Rate of turning (B,) to the left, rad/s."""
        return self.turns / self.durations

    @property
    def drifts(self) -> Annotated[Floats, "*strides"]:
        """Direction of travel (B,) relative to the heading, positive to the left, rad."""
        return np.angle(self.travels)


@dataclass(frozen=True)
class RowLabels:
    """Weights (B, p) of the labels of performers (B,), computed for the requested rows.

    weights: (K, p), of K combinations of labels. who: (B,), combination by index. All rows at once
    would take more memory than the rest of a plan.
    """

    weights: Annotated[Floats, "combinations labels"]
    who: Annotated[Indices, "points"]

    def __getitem__(self, rows: slice) -> Annotated[Floats, "rows labels"]:
        return self.weights[self.who[rows]]


@dataclass(frozen=True)
class RelativePoses:
    """K poses in frames that travel with the characters.

    rotations: (K, J, 4). heights: (K,), of the root, m. places: (K,), of the root over the floor.
    curves: values (K, C); None for a model without curves. contacts: their probabilities (K, C);
    None for a model without contacts.
    """

    rotations: Annotated[Floats, "poses joints 4"]
    heights: Annotated[Floats, "poses"]
    places: Annotated[FloorVectors, "poses"]
    curves: Annotated[Floats, "poses curves"] | None = None
    contacts: Annotated[Floats, "poses contacts"] | None = None

    @property
    def arrays(self) -> dict[str, Any]:
        """Return the arrays that the poses have, by name."""
        return {name: array for name, array in vars(self).items() if array is not None}


def strides(
    session: Session,
    controls: PointControls,
    labels: PointLabels | RowLabels,
    level: int = 0,
) -> Strides:
    """Return the cycles of controls (B, d) for labels (B, p), at a level of detail."""
    outputs = ("duration", "way", "coefficients")
    durations, travels, coefficients = _run_batches(
        session, controls, None, labels, level, *outputs
    )
    return unit_strides(session, travels, coefficients, level)._replace(durations=durations)


def unit_strides(
    session: Session,
    travels: Annotated[Floats, "strides 3"],
    coefficients: Annotated[Floats, "strides modes"],
    level: int,
) -> Strides:
    """Return cycles that last 1 s, by their travels (B, 3) and sample coefficients (B, r3)."""
    weights, constant = session.starts[level]
    # Not a matrix product, whose sums could go in another order for more cycles.
    starts = np.einsum("bk,ck->bc", coefficients, weights) + constant
    gap, turns = travels[:, 1] + 1j * travels[:, 0], travels[:, 2]
    ways = floor_plane.inverse_arc(gap, turns)
    return Strides(np.ones(len(ways)), ways, turns, floor_plane.project(starts))


def straight_strides(
    session: Session,
    controls: PointControls,
    labels: PointLabels,
    level: int = 0,
) -> Strides:
    """Return the straight line from first to last pose of clips that are not cyclic."""
    times = np.tile([0.0, AFTER_END], (len(controls), 1))
    outputs = ("duration", "root_position")
    durations, roots = _run_batches(session, controls, times, labels, level, *outputs)
    begin, end = floor_plane.project(roots).T
    return Strides(durations, end - begin, np.zeros(len(begin)), begin)


def synthesize_poses(
    session: Session,
    controls: PointControls,
    labels: PointLabels,
    phases: PerPoint,
    level: int = 0,
) -> RelativePoses:
    """Return the poses of controls (K, d), labels (K, p) and phases (K,) of the cycle, 0 to 1."""
    optional = (onnx_runtime.CURVES, onnx_runtime.CONTACTS)
    more = [name for name in optional if getattr(session.card, name)]
    outputs = ["way", "coefficients", "rotations", "root_position", *more]
    travels, coefficients, rotations, roots, *values = _run_batches(
        session, controls, phases[:, None], labels, level, *outputs, phases=True
    )
    cycles = unit_strides(session, travels, coefficients, level)
    posed = relative_poses(cycles, phases, rotations[:, 0], roots[:, 0])
    arrays: dict[str, Any] = {name: array[:, 0] for name, array in zip(more, values, strict=True)}
    return replace(posed, **arrays)


def root_places(
    session: Session,
    controls: PointControls,
    labels: PointLabels,
    phases: Annotated[Floats, "phases"],
    level: int = 0,
) -> Annotated[FloorVectors, "points phases"]:
    """Return the places (B, P) of the root over the floor as `synthesize_poses` does, alone.

    controls: (B, d). labels: (B, p). phases: (P,) of the cycle, the same for all. In a third of the
    time of the poses.
    """
    count = len(phases)
    rows, times = np.repeat(np.arange(len(controls)), count), np.tile(phases, len(controls))
    inputs = controls[rows], times[:, None], labels[rows], level
    outputs = ("way", "coefficients", "root_position")
    travels, coefficients, roots = _run_batches(session, *inputs, *outputs, phases=True)
    cycles = unit_strides(session, travels, coefficients, level)
    return _relative_places(cycles, times, roots[:, 0]).reshape(-1, count)


def contact_probabilities(
    session: Session,
    controls: PointControls,
    labels: PointLabels,
    phases: PerPoint,
    level: int = 0,
) -> Annotated[Floats, "points contacts"]:
    """Return the probabilities (K, C) of the contacts on the card, at phases (K,) of the cycle."""
    inputs = controls, phases[:, None], labels, level, onnx_runtime.CONTACTS
    return _run_batches(session, *inputs, phases=True)[0][:, 0]


def relative_poses(
    cycles: Strides,
    phases: Annotated[Floats, "poses"],
    rotations: Annotated[Floats, "poses joints 4"],
    roots: Annotated[Floats, "poses 3"],
) -> RelativePoses:
    """Return poses relative to the travel, at phases (K,) of the cycle.

    cycles: K strides, or one for all. rotations: (K, J, 4) and roots: (K, 3), m, of the poses.
    """
    return RelativePoses(
        floor_plane.turn_roots(rotations, -phases * cycles.turns),
        roots[:, 1],
        _relative_places(cycles, phases, roots),
    )


def _relative_places(
    cycles: Strides, phases: Annotated[Floats, "poses"], roots: Annotated[Floats, "poses 3"]
) -> Annotated[FloorVectors, "poses"]:
    """Return the places (K,) of roots (K, 3), m, relative to the travel at phases (K,)."""
    turned = phases * cycles.turns
    gone = (
        floor_plane.project(roots)
        - cycles.starts
        - floor_plane.arc_displacement(phases * cycles.travels, turned)
    )
    return np.asarray(gone * floor_plane.unit_vectors(-turned))


def bones(
    session: Session, controls: PointControls, labels: PointLabels
) -> Annotated[Singles, "points joints 3"]:
    """Return the bone offsets (B, J, 3), m, at controls (B, d) and labels (B, p)."""
    begin = np.zeros((len(controls), 1))
    return _run_batches(session, controls, begin, labels, 0, "bone_offsets")[0].astype(np.float32)


def label_rows(card: ModelCard) -> list[dict[str, str]]:
    """Return the combinations of labels that were captured, in the order of the card's names.

    With performers alone, these are the performers. Empty without label sets.
    """
    return [card.clip_names(clip) for clip in _first_clips(card)[0]] if card.labels else []


def clip_performers(card: ModelCard) -> Annotated[Indices, "clips"]:
    """Return the labels (N,) of the captured clips by index in `label_rows`; -1 without any."""
    return _first_clips(card)[1] if card.labels else np.full(len(card.examples), -1)


def labels(
    session: Session, combinations: Annotated[Indices, "*batch"]
) -> Annotated[Floats, "*batch labels"]:
    """Return the weights (..., p) of labels by index in `label_rows`; all zero for -1."""
    return label_table(session.card)[combinations]


def label_table(card: ModelCard) -> Annotated[Floats, "combinations labels"]:
    """Return the weights (K + 1, p) of the labels of `label_rows`, with zeros at the end."""
    weights = card.clip_labels
    captured = weights[_first_clips(card)[0]] if card.labels else weights[:0]
    return np.vstack([captured, np.zeros(weights.shape[1])])


def _first_clips(card: ModelCard) -> tuple[Indices, Annotated[Indices, "clips"]]:
    """Return the first clip of each combination of labels, and the combination of each clip."""
    indices = np.column_stack([label_set.clips for label_set in card.labels])
    _, first, whose = np.unique(indices, axis=0, return_index=True, return_inverse=True)
    return first, whose.ravel()


def _run_batches(
    session: Session,
    controls: PointControls,
    times: Annotated[Floats, "points frames"] | None,
    labels: PointLabels | RowLabels,
    level: int,
    *outputs: str,
    phases: bool = False,
) -> list[Annotated[Floats, "points ..."]]:
    """Return the graph's outputs for any number of rows, computed in batches."""
    arrays: list[Floats] = []
    for rows in batches(len(controls)):
        cancellation.check()
        inputs = controls[rows], None if times is None else times[rows]
        batch_arrays = session.run(
            *inputs, *outputs, labels=labels[rows], level=level, phases=phases
        )
        if not arrays:
            arrays = [
                np.empty((len(controls), *batch_array.shape[1:])) for batch_array in batch_arrays
            ]
        # Copied, not kept: small blocks between onnxruntime's large ones would prevent the
        # allocator from reusing those, and memory would grow with each batch.
        for array, batch_array in zip(arrays, batch_arrays, strict=True):
            array[rows] = batch_array
    return arrays


def batches(rows: int) -> Iterator[slice]:
    """Yield the rows of each call of the graph, at most ROWS_PER_CALL of them."""
    first = 0
    while first < rows:
        # A matrix product with one row sums in another order, so no batch of several has one row.
        count = ROWS_PER_CALL - 1 if rows - first == ROWS_PER_CALL + 1 else ROWS_PER_CALL
        yield slice(first, first + count)
        first += count
