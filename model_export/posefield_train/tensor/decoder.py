"""Decoder from reduced coefficients and canonical time to rotations, root and bone offsets."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import (
    Bones,
    ClipBones,
    ClipFrames,
    ClipPaths,
    ClipRotations,
    ClipTravel,
    JointRotations,
)
from posefield.common.units import Floats, Indices
from posefield.motion import blend, quat
from posefield.motion.curves import Curve, clamp, limits
from posefield_train.onnx_graph.graph_builder import GraphBuilder
from posefield_train.onnx_graph.level_tables import Integers
from posefield_train.tensor.event_blend import EventBlend
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.pose_vectors import PoseChart

# Added to squared half angles, so that sin(a) / a is defined at zero.
TINY = 1e-12
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
    the metric's coordinates, of the D' degrees of freedom that vary, to pose vectors. means:
    rotations (J, 4) about which the rotation vectors are taken. coarse: ranks and joints of each
    coarser level. event: blend into a second prediction around the event, at the finest level; its
    coefficients follow those of the core. curves: those of the last
    numbers of a pose vector.
    """

    reduced: TuckerTensor
    mean: Annotated[Floats, "dof"]
    unwhiten: Annotated[Floats, "dof varying"]
    means: JointRotations
    coarse: tuple[LevelSize, ...] = ()
    event: EventBlend | None = None
    curves: tuple[Curve, ...] = ()

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
        rung = self.level_sizes[level]
        moves = np.zeros((1 + len(self.means), 3))
        moves[[0, *(1 + joint for joint in rung.joints)]] = 1.0
        moved = np.append(moves, np.ones(len(self.curves)))
        return replace(
            self,
            reduced=self.reduced.truncated(rung.ranks),
            unwhiten=self.unwhiten * moved[:, None],
            coarse=(),
            event=None if level else self.event,
        )

    @property
    def directions(self) -> Annotated[Floats, "freedoms dof"]:
        """Return the pose vectors (r1, D) that the first mode's coefficients multiply."""
        return self.reduced.bases[0].T @ self.unwhiten.T

    def numpy(
        self, coefficients: Annotated[Floats, "clips modes"], place: ClipFrames
    ) -> tuple[ClipRotations, ClipPaths]:
        """Return rotations (B, S, J, 4) and root positions (B, S, 3) at canonical frames (B, S).

        coefficients: (B, r3). The time basis is interpolated linearly between frames (Mukai &
        Kuriyama 2006, section 2).
        """
        numbers = self.mean + self.reduced_poses(coefficients, place) @ self.directions
        return PoseChart(self.means).poses(numbers)

    def curve_values(
        self, coefficients: Annotated[Floats, "clips modes"], place: ClipFrames
    ) -> Annotated[Floats, "clips frames curves"]:
        """Return the values (B, S, C) of the curves at canonical frames (B, S).

        coefficients: (B, r3).
        """
        own = PoseChart(self.means).curve_numbers
        numbers = self.mean[own] + self.reduced_poses(coefficients, place) @ self.directions[:, own]
        return clamp(self.curves, numbers)

    def at_frame(
        self, coefficients: Annotated[Floats, "clips modes"], frame: int
    ) -> tuple[Annotated[Floats, "clips joints 4"], ClipTravel]:
        """Return rotations (B, J, 4) and root positions (B, 3) at one canonical frame of all.

        The core is contracted with that frame first, which saves nearly all of the work of `numpy`.
        """
        whole, times = self.blended
        core = np.tensordot(times[frame], whole, axes=(0, 1))
        numbers = self.mean + coefficients @ (core.T @ self.directions)
        return PoseChart(self.means).poses(numbers)

    def select_joints(self, joints: Sequence[int]) -> "Decoder":
        """Return the finest level's decoder of some joints, including the root, without curves."""
        kept = [0, *(1 + joint for joint in joints)]
        rows = np.ravel(np.arange(3 + 3 * len(self.means)).reshape(-1, 3)[kept])
        return replace(
            self,
            mean=self.mean[rows],
            unwhiten=self.unwhiten[rows],
            means=self.means[list(joints)],
            coarse=(),
            curves=(),
        )

    def reduced_poses(
        self, coefficients: Annotated[Floats, "clips modes"], place: ClipFrames
    ) -> Annotated[Floats, "clips frames freedoms"]:
        """Return coefficients (B, S, r1) of the first mode."""
        whole, table = self.blended
        r1, r2, r3 = whole.shape
        time = blend.interpolate_rows(table, place)
        # Contracting the core first as a matrix product is 17 times as fast as one einsum.
        core = whole.transpose(2, 0, 1).reshape(r3, -1)
        poses = np.empty((*place.shape, r1))
        step = max(1, BLOCK_NUMBERS // core.shape[1])
        for start in range(0, len(place), step):
            block = slice(start, start + step)
            motion = (coefficients[block] @ core).reshape(-1, r1, r2)
            poses[block] = time[block] @ motion.swapaxes(1, 2)
        return poses

    def entries(self) -> dict[str, list[Integers]]:
        """Return the level-dependent slice ends and shapes of the decoder's graph, by name."""
        ranks, joints = (
            [self.blended[0].shape, *(rung.ranks for rung in self.coarse)],
            [len(r.joints) for r in self.level_sizes],
        )
        return {
            "core": [[r2, r1, r3] for r1, r2, r3 in ranks],
            "core_rows": [[-1, r3] for _, _, r3 in ranks],
            "motion": [[-1, r2, r1] for r1, r2, _ in ranks],
            "flat": [[-1, r1] for r1, _, _ in ranks],
            "time": [[r2] for _, r2, _ in ranks],
            "root": [[3, r1] for r1, _, _ in ranks],
            "turning": [[4 * n, r1] for n, (r1, _, _) in zip(joints, ranks, strict=True)],
            "joints": [[n] for n in joints],
            "half_angles": [[n, 1, -1] for n in joints],
            "quaternions": [[4 * n] for n in joints],
            **({"curves": [[len(self.mean), r1] for r1, _, _ in ranks]} if self.curves else {}),
        }

    def onnx(
        self, net: GraphBuilder, coefficients: str, place: str, ends: dict[str, str]
    ) -> tuple[str, ...]:
        """Build `numpy` and `curve_values` in a graph, from canonical frames (B, S, 1).

        ends: graph values of the level's slice ends, by the names of `entries`. The third name, of
        the curves (B S, C), is missing without curves.
        """
        flat = self._reduced(net, coefficients, place, ends)
        directions = self._directions(net)
        three, end = net.indices(3), net.indices(3 + 3 * len(self.means))
        of_root = net("Slice", directions, net.indices(0, 0), ends["root"])
        mean = net.weights("root_mean", self.mean[:3])
        root = net("Gemm", flat, of_root, mean, transB=1)
        steps = net("Shape", place, start=0, end=2)
        root_shape = net("Concat", steps, net.indices(3), axis=0)
        joint_shape = net("Concat", steps, net.indices(len(self.means), 4), axis=0)
        of_joints = net("Slice", directions, three, end, net.indices(0))
        return (
            self._rotations(net, flat, of_joints, {**ends, "rotations": joint_shape}),
            net("Reshape", root, root_shape),
            *([self._curves(net, flat, directions, ends)] if self.curves else []),
        )

    def _curves(self, net: GraphBuilder, flat: str, directions: str, ends: dict[str, str]) -> str:
        """Build the values (B S, C) of the curves, clamped, from coefficients (B S, r1)."""
        own = PoseChart(self.means).curve_numbers
        of_curves = net("Slice", directions, net.indices(own.start, 0), ends["curves"])
        mean = net.weights("curve_mean", self.mean[own])
        values = net("Gemm", flat, of_curves, mean, transB=1)
        low, high = limits(self.curves)
        least, most = net.weights("curve_minimum", low), net.weights("curve_maximum", high)
        return net("Min", net("Max", values, least), most)

    def _reduced(
        self, net: GraphBuilder, coefficients: str, place: str, ends: dict[str, str]
    ) -> str:
        """Build the coefficients of the first mode (B S, r1).

        Each clip is a product of its own, time coefficients (S, r2) with its motion (r2, r1), so
        that sums have the same order in every batch.
        """
        core = net("Slice", self._core(net), net.indices(0, 0, 0), ends["core"])
        rows = net("Reshape", core, ends["core_rows"])
        motion = net("Reshape", net("Gemm", coefficients, rows, transB=1), ends["motion"])
        time = self._time(net, place, ends["time"])
        return net("Reshape", net("MatMul", time, motion), ends["flat"])

    def _core(self, net: GraphBuilder) -> str:
        """Build the core (r2, r1, r3); the event's block is made when the session loads."""
        whole = net.weights("core", self.reduced.core.transpose(1, 0, 2))
        if self.event is None:
            return whole
        (r1, r2, r3), count = self.reduced.core.shape, self.event.count
        columns = self.event.mixing.shape[1]
        zero, two = net.indices(0), net.indices(2)
        leading = net("Slice", whole, zero, net.indices(count), two)
        flat = net("Reshape", leading, net.indices(r2, r1 * count))
        mixed = net("MatMul", net.weights("event_mixing", self.event.mixing.T), flat)
        block = net("Reshape", mixed, net.indices(columns, r1, count))
        before = net("Expand", net.number(0.0), net.indices(columns, r1, r3))
        beside = net("Expand", net.number(0.0), net.indices(r2, r1, count))
        upper = net("Concat", whole, beside, axis=2)
        return net("Concat", upper, net("Concat", before, block, axis=2), axis=0)

    def _time(self, net: GraphBuilder, place: str, end: str) -> str:
        """Build time coefficients (B, S, r2), linearly interpolated between frames."""
        table = net.weights("time_basis", self.reduced.bases[1].T)
        if self.event:
            table = net("Concat", table, net.weights("event_times", self.event.times.T), axis=0)
        frames = len(self.reduced.bases[1])
        zero, one = net.indices(0), net.indices(1)
        # Rows of frames are copied whole. Behind the last frame nothing changes.
        every = net("Transpose", table, perm=[1, 0])
        after = net(
            "Gather", every, net.weights("next_frames", np.append(np.arange(1, frames), frames - 1))
        )
        kept = net("Slice", every, zero, end, one)
        steps = net("Slice", net("Sub", after, every), zero, end, one)
        before = net("Floor", place)
        row = net("Cast", net("Squeeze", before, net.indices(2)), to=6)
        rise = net("Mul", net("Gather", steps, row), net("Sub", place, before))
        return net("Add", net("Gather", kept, row), rise)

    def _directions(self, net: GraphBuilder) -> str:
        """Build directions (D, r1) from stored nonzero rows when the session loads."""
        varies = np.any(self.unwhiten != 0.0, axis=1)
        stored = net.weights("directions", self.directions[:, varies].T)
        nothing = net.weights("no_direction", np.zeros((1, len(self.directions))))
        # Degrees of freedom that never vary take the row of zeros after the others.
        row = np.where(varies, np.cumsum(varies) - 1, np.count_nonzero(varies))
        return net("Gather", net("Concat", stored, nothing, axis=0), net.weights("freedoms", row))

    def _rotations(
        self, net: GraphBuilder, flat: str, directions: str, ends: dict[str, str]
    ) -> str:
        """Build quaternions (B, S, J, 4) from the first mode's coefficients (B S, r1)."""
        turning = half_angle_products_onnx(net, self.means, directions)
        offset = half_angle_products(self.means, self._mean_vectors)
        if any(len(rung.joints) < len(self.means) for rung in self.level_sizes):
            return self._partly_fixed_rotations(net, flat, turning, offset, ends)
        turning = net("Slice", turning, net.indices(0, 0), ends["turning"])
        means = net.weights("mean_rotations", self.means[:, :, None])
        constant = net.weights("rotation_mean", offset[:, None])
        return innermost_joints(
            net,
            quaternions(
                net,
                net("Gemm", turning, flat, constant, transB=1),
                means,
                ends["half_angles"],
            ),
            len(self.means),
            ends["rotations"],
        )

    def _partly_fixed_rotations(
        self,
        net: GraphBuilder,
        flat: str,
        turning: str,
        offset: Annotated[Floats, "..."],
        ends: dict[str, str],
    ) -> str:
        """Build quaternions where some level fixes joints.

        Joints are sorted by the number of levels that move them, so that a slice selects a level's
        joints.
        """
        order = self._order()
        joints, zero = len(order), net.indices(0)
        rows = np.arange(4 * joints).reshape(joints, 4)[order].ravel()
        turning = net("Gather", turning, net.weights("turning_order", rows))
        turning = net("Slice", turning, net.indices(0, 0), ends["turning"])
        constant = net.weights("rotation_mean", offset[rows][:, None])
        constant = net("Slice", constant, zero, ends["quaternions"], zero)
        ordered = net.weights("mean_rotations", self.means[:, :, None])
        ordered = net("Gather", ordered, net.weights("joint_order", order))
        moving = net("Slice", ordered, zero, ends["joints"], zero)
        rows_of_joints = net("Gemm", turning, flat, constant, transB=1)
        found = quaternions(net, rows_of_joints, moving, ends["half_angles"])
        still = quat.mul(self.means, quat.exp(self._mean_vectors.reshape(-1, 3)))[order][:, :, None]
        still_ones = net(
            "Slice", net.weights("still", still), ends["joints"], net.indices(joints), zero
        )
        poses = net("Shape", found, start=2, end=3)
        shape = net("Concat", net.indices(1, 1), poses, axis=0)
        both = net("Concat", found, net("Expand", still_ones, shape), axis=0)
        back = net("Gather", both, net.weights("joint_places", np.argsort(order)))
        return innermost_joints(net, back, joints, ends["rotations"])

    @property
    def _mean_vectors(self) -> Annotated[Floats, "numbers"]:
        """Return the mean rotation vectors (3 J,)."""
        return self.mean[PoseChart(self.means).joint_numbers]

    def _order(self) -> Annotated[Indices, "joints"]:
        """Return the joints sorted by the number of coarser levels that keep them, descending."""
        kept = [[j in rung.joints for j in range(len(self.means))] for rung in self.coarse]
        return np.argsort(-np.sum(kept, axis=0), kind="stable")


def half_angle_products(
    means: JointRotations, vectors: Annotated[Floats, "*batch joints*3"]
) -> Annotated[Floats, "*batch joints*4"]:
    """Return mean · v / 2 of rotation vectors (..., 3 J) about means (J, 4), as (..., 4 J).

    mean · exp(v) = mean cos φ + (mean · v / 2) sin φ / φ with φ = |v| / 2. The bracket is linear in
    v and keeps its length, so it is folded into the model's directions and the graph needs no
    quaternion products.
    """
    pure = np.zeros((*vectors.shape[:-1], len(means), 4))
    pure[..., 1:] = 0.5 * vectors.reshape(*vectors.shape[:-1], -1, 3)
    return quat.mul(means, pure).reshape(*vectors.shape[:-1], -1)


def half_angle_products_onnx(net: GraphBuilder, means: JointRotations, vectors: str) -> str:
    """Build `half_angle_products` in a graph: columns (3 J, r) to columns (4 J, r)."""
    # A quaternion's product with each axis is linear in it: (J, 4) becomes (J, 4, 3).
    axes = quat.mul(np.eye(4)[:, None], 0.5 * np.eye(4)[1:]).swapaxes(1, 2).reshape(4, 12)
    rotations = net("Squeeze", net.weights("mean_rotations", means[:, :, None]), net.indices(2))
    products = net("MatMul", rotations, net.weights("half_axes", axes))
    matrices = net("Reshape", products, net.indices(-1, 4, 3))
    columns = net("MatMul", matrices, net("Reshape", vectors, net.indices(len(means), 3, -1)))
    return net("Reshape", columns, net.indices(4 * len(means), -1))


def quaternions(net: GraphBuilder, rows: str, means: str, shape: str) -> str:
    """Build quaternions (J, 4, P) from turned rotation vectors (4 J, P) about means (J, 4, 1).

    Poses lie innermost, so that every operation runs over long rows. shape: graph value of the
    shape (J, 1, -1).
    """
    joints = net(
        "Reshape", rows, net("Concat", net("Shape", means, start=0, end=2), net.indices(-1), axis=0)
    )
    squares = net("ReduceSum", net("Mul", joints, joints), net.indices(1), keepdims=1)
    cosine, share = _half_angle_terms(net, squares, shape)
    return net("Add", net("Mul", means, cosine), net("Mul", joints, share))


def _half_angle_terms(net: GraphBuilder, squares: str, shape: str) -> tuple[str, str]:
    """Build cosines of half angles a and ratios sin(a) / a, from their squares (J, 1, P)."""
    half = net("Sqrt", net("Add", net.padded(squares), net.number(TINY)))
    share = net("Div", net("Sin", half), half)
    return net.unpadded(net("Cos", half), shape), net.unpadded(share, shape)


def innermost_joints(net: GraphBuilder, rotations: str, joints: int, shape: str) -> str:
    """Build quaternions of a shape (..., J, 4) from quaternions (J, 4, P) with poses innermost."""
    finished = net("Reshape", rotations, net.indices(4 * joints, -1))
    return net("Reshape", net("Transpose", finished, perm=[1, 0]), shape)


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
        """Build `numpy` in a graph."""
        flat = net(
            "Gemm",
            coefficients,
            net.weights("offset_directions", self.directions.reshape(len(self.directions), -1)),
            net.weights("offset_mean", self.mean.ravel()),
        )
        return net("Reshape", flat, net.indices(-1, len(self.mean), 3))
