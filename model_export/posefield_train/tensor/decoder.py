"""Decoder from reduced coefficients and canonical time to rotations, root and bone offsets."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import (
    Bones,
    ClipBones,
    ClipFrames,
    ClipPaths,
    ClipRotations,
    ClipTravel,
    Floats,
    Frames,
    JointRotations,
    PerClip,
)
from posefield.motion import quat
from posefield.motion.curves import Curve, clamp
from posefield_train.onnx_graph import GraphBuilder
from posefield_train.tensor import truncation_error
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.pose_vectors import PoseChart
from posefield_train.tensor.truncation_error import EventFrame, TruncationReference

# Width of the blend: standard deviation of the weight, as a share of a clip.
WIDTH = 7 / 60
# Share of the squared weighted time basis that its approximation may lose.
LOST_SHARE = 1e-3


@dataclass(frozen=True)
class EventBlend:
    """Weighted time basis of the event, as a product of two small matrices.

    count: number of leading coefficients that have a second prediction. weights: (T,), from 0 to 1
    at the event. times: (T, q) and mixing: (r2, q); their product approximates the weighted time
    basis.
    """

    count: int
    weights: Frames
    times: Annotated[Floats, "frames columns"]
    mixing: Annotated[Floats, "times columns"]

    def core(
        self, core: Annotated[Floats, "freedoms times modes"]
    ) -> Annotated[Floats, "freedoms more_times more_modes"]:
        """Return the core (r1, r2 + q, r3 + count) with the blend's block in its last corner."""
        r1, r2, r3 = core.shape
        columns = self.mixing.shape[1]
        blended = np.zeros((r1, r2 + columns, r3 + self.count))
        blended[:, :r2, :r3] = core
        block = np.tensordot(core[:, :, : self.count], self.mixing, axes=(1, 0))
        blended[:, r2:, r3:] = block.swapaxes(1, 2)
        return blended


def event_weights(frames: int, event: int, cyclic: bool) -> Frames:
    """Return the blend's weights (T,) of canonical frames, for an event at one of them."""
    distances = np.abs(np.arange(frames) - event) / (frames - 1)
    if cyclic:
        distances = np.minimum(distances, 1.0 - distances)
    return np.exp(-0.5 * np.square(distances / WIDTH))


def build_blend(
    count: int,
    weights: Frames,
    core: Annotated[Floats, "freedoms times modes"],
    basis: Annotated[Floats, "frames times"],
) -> EventBlend:
    """Return the blend of at most `count` leading coefficients of a reduced tensor.

    core: (r1, r2, r3). basis: time basis (T, r2).
    """
    lengths = np.linalg.norm(np.moveaxis(core, 1, 0).reshape(core.shape[1], -1), axis=1)
    carried = np.maximum(lengths, 1e-9 * lengths.max())
    left, values, right = np.linalg.svd(weights[:, None] * basis * carried, full_matrices=False)
    lost = np.cumsum(np.square(values)[::-1])[::-1]
    columns = max(1, int(np.count_nonzero(lost > LOST_SHARE * lost[0])))
    signs = np.where(np.sum(left[:, :columns], axis=0) < 0.0, -1.0, 1.0)
    times = left[:, :columns] * values[:columns] * signs
    return EventBlend(
        min(count, core.shape[2]), weights, times, (right[:columns].T * signs) / carried[:, None]
    )


COEFFICIENTS = 15
"""Number of coefficients, the largest first, whose effect is measured."""
# Forward differences: this share of the deviation of the first coefficient.
STEP = 0.02
# Weight of the event's joint in the loss of kriging beside that of all joints and frames.
EFFECTOR_WEIGHT = 0.5


def effector_weights(
    reference: TruncationReference, full: TuckerTensor
) -> Annotated[Floats, "clips 3 _"] | None:
    """Return matrices (N, 3, m) from a clip's residuals to its weighted error at the event.

    Without an event there are none.
    """
    if reference.event_frame is None:
        return None
    measure = EFFECTOR_WEIGHT * reference.tensor.weight * full.bases[1].shape[0]
    return np.sqrt(measure) * event_jacobians(reference, full, reference.event_frame)


def event_jacobians(
    reference: TruncationReference, full: TuckerTensor, event: EventFrame
) -> Annotated[Floats, "clips 3 _"]:
    """Return the derivatives (N, 3, m), m per unit, of the event joint's position at each clip.

    full: untruncated tensor, whose motions (N, N) are the coefficients. m: at most COEFFICIENTS.
    """
    motions = full.motions
    count = min(COEFFICIENTS, motions.shape[1])
    step = STEP * float(motions[:, 0].std())
    start = _positions(reference, full, motions, event)
    jacobians = np.empty((len(motions), 3, count))
    for column in range(count):
        stepped = motions.copy()
        stepped[:, column] += step
        jacobians[:, :, column] = (_positions(reference, full, stepped, event) - start) / step
    return jacobians


def event_distances(
    reference: TruncationReference,
    full: TuckerTensor,
    event: EventFrame,
    residuals: Annotated[Floats, "clips _"],
) -> PerClip:
    """Return the distances (N,), m, by which residuals (N, N) of the motions move the joint."""
    captured = _positions(reference, full, full.motions, event)
    predicted = _positions(reference, full, full.motions - residuals, event)
    return np.asarray(np.linalg.norm(predicted - captured, axis=1))


def _positions(
    reference: TruncationReference, full: TuckerTensor, motions: Floats, event: EventFrame
) -> Floats:
    """Return the positions (N, 3), m, of the event's joint for coefficients (N, N)."""
    tensor = reference.tensor
    first, second, _ = full.bases
    at_event = TuckerTensor(full.core, (first, second[[event.frame]], full.bases[2]))
    values = at_event.slices(motions)
    points = truncation_error.positions(tensor, values, reference.parents, reference.offsets)
    return points[:, 0, event.joint]


# Numbers of decoded motion per block: 16 MB.
BLOCK_NUMBERS = 2_000_000


@dataclass(frozen=True)
class LevelSize:
    """Size of a level of detail.

    ranks: (r1, r2, r3). joints: indices of the moving joints, in order; all others stay at the
    family's mean.
    """

    ranks: tuple[int, int, int]
    joints: tuple[int, ...]


@dataclass(frozen=True)
class Decoder:
    """Reduced motion tensor and the maps from its coefficients to poses.

    reduced: core (r1, r2, r3) and bases of degrees of freedom, frames and samples, in the metric's
    coordinates. mean: pose vector (D,) on which the tensor is centred. unwhiten: map (D, D') from
    the metric's coordinates, of the D' degrees of freedom that vary, to pose vectors. chart: of the
    poses. coarse: ranks and joints of each coarser level. event: blend into a second prediction
    around the event, at the finest level; its coefficients follow those of the core. curves: those
    of the last numbers of a pose vector.
    """

    reduced: TuckerTensor
    mean: Annotated[Floats, "dof"]
    unwhiten: Annotated[Floats, "dof varying"]
    chart: PoseChart
    coarse: tuple[LevelSize, ...] = ()
    event: EventBlend | None = None
    curves: tuple[Curve, ...] = ()

    @property
    def means(self) -> JointRotations:
        """Return the rotations (J, 4) about which rotations are taken."""
        return self.chart.means

    @property
    def blended(
        self,
    ) -> tuple[Annotated[Floats, "freedoms times modes"], Annotated[Floats, "frames times"]]:
        """Return core and time basis with the event's blend."""
        core, times = self.reduced.core, self.reduced.bases[1]
        if self.event is None:
            return core, times
        return self.event.core(core), np.hstack([times, self.event.times])

    @property
    def level_sizes(self) -> tuple[LevelSize, ...]:
        """Return the ranks and joints of all levels, the finest first."""
        r1, r2, r3 = self.reduced.core.shape
        return (LevelSize((r1, r2, r3), tuple(range(len(self.means)))), *self.coarse)

    def at_level(self, level: int) -> "Decoder":
        """Return the decoder of one level: truncated core and bases, and fixed joints."""
        size = self.level_sizes[level]
        moves = np.zeros((1 + len(self.means), 3))
        moves[[0, *(1 + joint for joint in size.joints)]] = 1.0
        factors = np.append(moves, np.ones(len(self.curves)))
        return replace(
            self,
            reduced=self.reduced.truncated(size.ranks),
            unwhiten=self.unwhiten * factors[:, None],
            coarse=(),
            event=None if level else self.event,
        )

    @property
    def directions(self) -> Annotated[Floats, "freedoms dof"]:
        """Return the pose vectors (r1, D) that the first mode's coefficients multiply."""
        return self.reduced.bases[0].T @ self.unwhiten.T

    def numpy(
        self, coefficients: Annotated[Floats, "clips modes"], frames: ClipFrames
    ) -> tuple[ClipRotations, ClipPaths]:
        """Return rotations (B, S, J, 4) and root positions (B, S, 3) at canonical frames (B, S).

        coefficients: (B, r3). The time basis is interpolated linearly between frames (Mukai &
        Kuriyama 2006, section 2).
        """
        numbers = self.mean + self.reduced_poses(coefficients, frames) @ self.directions
        return self.chart.poses(numbers)

    def curve_values(
        self, coefficients: Annotated[Floats, "clips modes"], frames: ClipFrames
    ) -> Annotated[Floats, "clips frames curves"]:
        """Return the values (B, S, C) of the curves at canonical frames (B, S).

        coefficients: (B, r3).
        """
        columns = self.chart.curve_numbers
        numbers = (
            self.mean[columns]
            + self.reduced_poses(coefficients, frames) @ self.directions[:, columns]
        )
        return clamp(self.curves, numbers)

    def at_frame(
        self, coefficients: Annotated[Floats, "clips modes"], frame: int
    ) -> tuple[Annotated[Floats, "clips joints 4"], ClipTravel]:
        """Return rotations (B, J, 4) and root positions (B, 3) at one canonical frame of all.

        The core is contracted with that frame first, which saves nearly all of the work of `numpy`.
        """
        blended, times = self.blended
        core = np.tensordot(times[frame], blended, axes=(0, 1))
        numbers = self.mean + coefficients @ (core.T @ self.directions)
        return self.chart.poses(numbers)

    def select_joints(self, joints: Sequence[int]) -> "Decoder":
        """Return the finest level's decoder of some joints, including the root, without curves."""
        blocks = [0, *(1 + joint for joint in joints)]
        rows = np.ravel(np.arange(3 + 3 * len(self.means)).reshape(-1, 3)[blocks])
        return replace(
            self,
            mean=self.mean[rows],
            unwhiten=self.unwhiten[rows],
            chart=replace(self.chart, means=self.means[list(joints)]),
            coarse=(),
            curves=(),
        )

    def reduced_poses(
        self, coefficients: Annotated[Floats, "clips modes"], frames: ClipFrames
    ) -> Annotated[Floats, "clips frames freedoms"]:
        """Return coefficients (B, S, r1) of the first mode."""
        blended, table = self.blended
        r1, r2, r3 = blended.shape
        time = quat.interpolate_rows(table, frames)
        # Contracting the core first as a matrix product is 17 times as fast as one einsum.
        core = blended.transpose(2, 0, 1).reshape(r3, -1)
        poses = np.empty((*frames.shape, r1))
        step = max(1, BLOCK_NUMBERS // core.shape[1])
        for start in range(0, len(frames), step):
            block = slice(start, start + step)
            motion = (coefficients[block] @ core).reshape(-1, r1, r2)
            poses[block] = time[block] @ motion.swapaxes(1, 2)
        return poses

    @property
    def mean_turns(self) -> Annotated[Floats, "numbers"]:
        """Return the mean numbers (3 J,) of the rotations."""
        return self.mean[self.chart.joint_numbers]


@dataclass(frozen=True)
class Proportions:
    """Bone offsets as a linear model, m: performers differ in few dimensions.

    mean: (J, 3). directions: (r, J, 3).
    """

    mean: Bones
    directions: Annotated[Floats, "rank joints 3"]

    def numpy(self, coefficients: Annotated[Floats, "clips rank"]) -> ClipBones:
        """Return bone offsets (B, J, 3), m, of coefficients (B, r)."""
        return self.mean + np.einsum("br,rjk->bjk", coefficients, self.directions)

    def onnx(self, net: GraphBuilder, coefficients: str) -> str:
        """Build `numpy` in a graph, as rows (B, 3 J)."""
        flat = self.directions.reshape(len(self.directions), -1)
        directions = net.weights("offset_directions", flat)
        return net("Gemm", coefficients, directions, net.weights("offset_mean", self.mean.ravel()))
