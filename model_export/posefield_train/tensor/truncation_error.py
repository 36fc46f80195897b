"""Joint errors of a truncation, by forward kinematics.

The metric of the tensor is a first-order approximation; forward kinematics gives the true
distances.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import ClipBones, Floats, JointWeights
from posefield.model_file.model_card import Event
from posefield.motion import skeleton
from posefield.motion.curves import distances
from posefield_train.source import canonical
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import hosvd
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.motion_tensor import MotionTensor


@dataclass(frozen=True)
class TruncationErrors:
    """Distances, m, between joints of the truncated and the full tensor.

    rms: weighted root mean square over clips, frames and joints. p99, max: over the same,
    unweighted. effector: root mean square over clips of the event's joint at its event; None
    without event.
    """

    rms: float
    p99: float
    max: float
    effector: float | None


@dataclass(frozen=True)
class EventFrame:
    """A joint and the canonical frame of its event."""

    joint: int
    frame: int


@dataclass(frozen=True)
class TruncationReference:
    """Joint positions of the full tensor, for measuring truncations.

    points: joint positions (N, T, J, 3), m, without a cycle's travel, and points of the curves
    behind them. offsets: (N, J, 3), m. weights: of joints and curves.
    """

    tensor: MotionTensor
    parents: tuple[int, ...]
    offsets: ClipBones
    weights: Annotated[Floats, "points"]
    event_frame: EventFrame | None
    points: Annotated[Floats, "clips frames points 3"]

    def evaluate(self, reduced: TuckerTensor) -> TruncationErrors:
        """Return the fidelity of a truncation of this tensor."""
        distances = self._distances(reduced)
        rms, p99, largest = (self._statistic(name, distances) for name in ("rms", "p99", "max"))
        effector = self._statistic("effector", distances) if self.event_frame else None
        return TruncationErrors(rms, p99, largest, effector)

    def strain(self, reduced: TuckerTensor, budgets: Mapping[str, float]) -> float:
        """Return the largest ratio of an error of a truncation to its budget.

        budgets: m, by name in `TruncationErrors`.
        """
        distances = self._distances(reduced)
        return max(self._statistic(name, distances) / limit for name, limit in budgets.items())

    def _statistic(self, name: str, gaps: Annotated[Floats, "clips frames points"]) -> float:
        """Return one of `TruncationErrors` of distances (N, T, J), m."""
        if name == "rms":
            squares = np.mean(np.square(gaps), axis=(0, 1))
            return float(np.sqrt(np.average(squares, weights=self.weights)))
        if name == "p99":
            return float(np.quantile(gaps, 0.99))
        if name == "max":
            return float(gaps.max())
        event = self.event_frame
        if event is None:
            raise ValueError("effector without an event")
        return float(np.sqrt(np.mean(np.square(gaps[:, event.frame, event.joint]))))

    def _distances(self, reduced: TuckerTensor) -> Annotated[Floats, "clips frames points"]:
        blocks = [
            self._block_distances(reduced, rows) for rows in canonical.clip_blocks(len(self.points))
        ]
        return blocks[0] if len(blocks) == 1 else np.concatenate(blocks)

    def _block_distances(
        self, reduced: TuckerTensor, rows: slice
    ) -> Annotated[Floats, "rows frames points"]:
        """Return the distances of some clips: all at once would take as much memory as reading."""
        first, times, samples = reduced.bases
        # Restore pose vectors directly: the whitened tensor would be as large again.
        bases = self.tensor.unwhiten @ first, times, samples[rows]
        restored = TuckerTensor(reduced.core, bases).restored()
        gaps = _joint_positions(self.tensor, restored, self.parents, self.offsets[rows])
        gaps -= self.points[rows]
        return np.sqrt(np.sum(np.square(gaps, out=gaps), axis=-1))


def joint_weights(recipe: Recipe, examples: Sequence[Example]) -> JointWeights:
    """Return the weight (J,) of each joint's position from the recipe, by default one."""
    names = examples[0].clip.skeleton.names
    return np.array([recipe.motion.joint_weights.get(name, 1.0) for name in names])


def truncation_reference(
    recipe: Recipe, examples: Sequence[Example], tensor: MotionTensor
) -> TruncationReference:
    """Return the reference for truncations of a recipe's tensor.

    Raises TrainingError if the skeleton lacks the event's joint.
    """
    parents = examples[0].clip.skeleton.parents
    weights = np.append(joint_weights(recipe, examples), np.ones(len(tensor.curves)))
    offsets = np.stack([example.offsets for example in examples])
    points = _all_positions(tensor, parents, offsets)
    return TruncationReference(
        tensor, parents, offsets, weights, event_frame(recipe, examples), points
    )


def _all_positions(
    tensor: MotionTensor, parents: tuple[int, ...], offsets: ClipBones
) -> Annotated[Floats, "clips frames points 3"]:
    """Return the joint positions (N, T, J, 3), m, of a tensor, block by block of clips."""
    values = tensor.values
    blocks = canonical.clip_blocks(values.shape[2])
    block_points = (
        positions(tensor, values[:, :, rows], parents, offsets[rows]) for rows in blocks
    )
    if len(blocks) == 1:
        return next(block_points)
    shape = (values.shape[2], values.shape[1], len(parents) + len(tensor.curves), 3)
    points = np.empty(shape)
    for rows, block in zip(blocks, block_points, strict=True):
        points[rows] = block
    return points


def positions(
    tensor: MotionTensor,
    values: Annotated[Floats, "varying frames clips"],
    parents: tuple[int, ...],
    offsets: ClipBones,
) -> Annotated[Floats, "clips frames points 3"]:
    """Return joint positions (N, T, J, 3), m, of whitened values (D', T, N).

    Points of the curves follow those of the joints. offsets: bone offsets (N, J, 3), m.
    """
    return _joint_positions(tensor, hosvd.mode_dot(values, tensor.unwhiten, 0), parents, offsets)


def _joint_positions(
    tensor: MotionTensor,
    centred: Annotated[Floats, "dof frames clips"],
    parents: tuple[int, ...],
    offsets: ClipBones,
) -> Annotated[Floats, "clips frames points 3"]:
    """Return joint positions (N, T, J, 3) of pose vectors (D, T, N) less the tensor's mean.

    Points of the curves follow those of the joints.
    """
    _, frames, samples = centred.shape
    chart, joints = tensor.chart, len(parents)
    points = np.zeros((joints + len(tensor.curves), 3, frames, samples))
    units = distances(tensor.curves)[:, None, None]
    bones = offsets.transpose(1, 2, 0)[1:, :, None]
    step = max(1, skeleton.POSES_PER_BLOCK // samples)
    for start in range(0, frames, step):
        block = slice(start, start + step)
        numbers = tensor.mean[:, None, None] + centred[:, block]
        rotations = chart.rotation_planes(numbers[chart.joint_numbers])
        points[:joints, :, block] = skeleton.position_planes(
            parents, rotations, [numbers[:3], *bones]
        )
        points[joints:, 0, block] = units * numbers[chart.curve_numbers]
    return points.transpose(3, 2, 0, 1)


def event_frame(recipe: Recipe, examples: Sequence[Example]) -> EventFrame | None:
    """Return the joint and canonical frame of the recipe's event; None without event.

    Raises TrainingError if the skeleton lacks its joint.
    """
    event = recipe.event
    if event is None:
        return None
    names = examples[0].clip.skeleton.names
    if event.joint not in names:
        raise TrainingError(f"event.joint {event.joint!r}, expected one of {', '.join(names)}")
    share = _event_share(recipe, event.at, examples)
    return EventFrame(names.index(event.joint), round((recipe.motion.frames - 1) * share))


def event(recipe: Recipe, examples: Sequence[Example]) -> Event | None:
    """Return the recipe's event: its joint and share of canonical time; None without event."""
    frame = event_frame(recipe, examples)
    if frame is None or recipe.event is None:
        return None
    return Event(frame.joint, round(_event_share(recipe, recipe.event.at, examples), 4))


def _event_share(recipe: Recipe, at: str, examples: Sequence[Example]) -> float:
    if at in ("start", "end"):
        return float(at == "end")
    mark = recipe.landmark_names.index(at)
    return float(np.mean([example.landmarks[mark] for example in examples]))
