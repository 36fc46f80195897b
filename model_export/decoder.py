"""From reduced coefficients and canonical time to rotations, root position and bone offsets."""

from dataclasses import dataclass, replace

import numpy as np

from model_export.hosvd import Multilinear
from model_export.ladder import Numbers
from model_export.net import Net
from service.motion import blend, quat
from service.motion.conventions import Floats, Indices

# Added to squared half angles, so that the sine over the angle has a value at zero.
TINY = 1e-12


@dataclass(frozen=True)
class Rung:
    """What a level of detail keeps: ranks, and joints that move, in order; the others stay at the
    family's mean."""

    ranks: tuple[int, int, int]
    joints: tuple[int, ...]


@dataclass(frozen=True)
class Decoder:
    """Reduced tensor to poses.

    reduced: core (r1, r2, r3) and bases of degrees of freedom, frames and samples, in the metric's
    coordinates. mean (D,): pose vector that the tensor is centred on. unwhiten (D, D'): from the
    metric's coordinates, of the D' degrees of freedom that vary, to pose vectors. means (J, 4):
    rotations about which the rotation vectors are taken. coarse: ranks and joints of each coarser
    level of detail.
    """

    reduced: Multilinear
    mean: Floats
    unwhiten: Floats
    means: Floats
    coarse: tuple[Rung, ...] = ()

    @property
    def rungs(self) -> tuple[Rung, ...]:
        """Ranks and joints of all levels."""
        r1, r2, r3 = self.reduced.core.shape
        return (Rung((r1, r2, r3), tuple(range(len(self.means)))), *self.coarse)

    def at(self, level: int) -> "Decoder":
        """Decoder of a level: leading parts of core and bases, and joints that do not move."""
        rung = self.rungs[level]
        moves = np.zeros((1 + len(self.means), 3))
        moves[[0, *(1 + joint for joint in rung.joints)]] = 1.0
        unwhiten = self.unwhiten * moves.reshape(-1, 1)
        return replace(
            self, reduced=self.reduced.truncated(rung.ranks), unwhiten=unwhiten, coarse=()
        )

    @property
    def directions(self) -> Floats:
        """Pose vectors (r1, D) that the first mode's coefficients are multiplied with."""
        return self.reduced.bases[0].T @ self.unwhiten.T

    def numpy(self, coefficients: Floats, place: Floats) -> tuple[Floats, Floats]:
        """Rotations (B, S, J, 4) and root positions (B, S, 3) at canonical frames (B, S).

        coefficients (B, r3). Between frames the time basis is linear (Mukai & Kuriyama 2006, 2).
        """
        numbers = self.mean + self.reduced_poses(coefficients, place) @ self.directions
        vectors = numbers[..., 3:].reshape(*place.shape, -1, 3)
        return quat.mul(self.means, quat.exp(vectors)), numbers[..., :3]

    def reduced_poses(self, coefficients: Floats, place: Floats) -> Floats:
        """Coefficients (B, S, r1) of the first mode."""
        table = self.reduced.bases[1]
        time = blend.between(table, place)
        # The core first, as a product of matrices: 17 times as fast as one sum at full rank.
        motion = np.tensordot(coefficients, self.reduced.core, axes=(1, 2))
        return time @ motion.swapaxes(1, 2)

    def entries(self) -> dict[str, list[Numbers]]:
        """What the decoder's graph asks of a ladder."""
        ranks, joints = [rung.ranks for rung in self.rungs], [len(r.joints) for r in self.rungs]
        return {
            "core": [[r2, r1, r3] for r1, r2, r3 in ranks],
            "core_rows": [[-1, r3] for _, _, r3 in ranks],
            "motion": [[r2, r1, -1, 1] for r1, r2, _ in ranks],
            "flat": [[r1, -1] for r1, _, _ in ranks],
            "time": [[r2] for _, r2, _ in ranks],
            "root": [[3, r1] for r1, _, _ in ranks],
            "turning": [[4 * n, r1] for n, (r1, _, _) in zip(joints, ranks, strict=True)],
            "joints": [[n] for n in joints],
            "quaternions": [[4 * n] for n in joints],
        }

    def onnx(
        self, net: Net, coefficients: str, place: str, ends: dict[str, str]
    ) -> tuple[str, str]:
        """The same in a graph, from canonical frames (B, S, 1); `ends` are a ladder's."""
        flat = self._reduced(net, coefficients, place, ends)
        directions = self._directions(net)
        three, end = net.indices(3), net.indices(len(self.mean))
        of_root = net("Slice", directions, net.indices(0, 0), ends["root"])
        mean = net.weights("root_mean", self.mean[:3])
        root = net("Gemm", flat, of_root, mean, transA=1, transB=1)
        steps = net("Shape", place, start=0, end=2)
        root_shape = net("Concat", steps, net.indices(3), axis=0)
        joint_shape = net("Concat", steps, net.indices(len(self.means), 4), axis=0)
        of_joints = net("Slice", directions, three, end, net.indices(0))
        return (
            net("Reshape", self._rotations(net, flat, of_joints, ends), joint_shape),
            net("Reshape", root, root_shape),
        )

    def _reduced(self, net: Net, coefficients: str, place: str, ends: dict[str, str]) -> str:
        """Coefficients of the first mode (r1, B S).

        Poses lie innermost: a product of small matrices for each of them would take longer than
        all that is in it.
        """
        whole = net.weights("core", self.reduced.core.transpose(1, 0, 2))
        core = net("Slice", whole, net.indices(0, 0, 0), ends["core"])
        rows = net("Reshape", core, ends["core_rows"])
        motion = net("Reshape", net("Gemm", rows, coefficients, transB=1), ends["motion"])
        time = net("Unsqueeze", self._time(net, place, ends["time"]), net.indices(1))
        terms = net("Mul", motion, time)
        poses = net("ReduceSum", terms, net.indices(0), keepdims=0)
        return net("Reshape", poses, ends["flat"])

    def _time(self, net: Net, place: str, end: str) -> str:
        """Time coefficients (r2, B, S): two columns of the table, and a line between them."""
        table = net.weights("time_basis", self.reduced.bases[1].T)
        last = len(self.reduced.bases[1]) - 1
        zero, one = net.indices(0), net.indices(1)
        kept = net("Slice", table, zero, end, zero)
        first = net("Slice", kept, zero, net.indices(last), one)
        steps = net("Sub", net("Slice", kept, one, net.indices(last + 1), one), first)
        when = net("Squeeze", place, net.indices(2))
        before = net("Min", net("Floor", when), net.number(last - 1.0))
        column = net("Cast", before, to=6)
        rise = net("Mul", net("Gather", steps, column, axis=1), net("Sub", when, before))
        return net("Add", net("Gather", first, column, axis=1), rise)

    def _directions(self, net: Net) -> str:
        """Directions (D, r1), put together when the session loads: what is zero is not stored."""
        varies = np.any(self.unwhiten != 0.0, axis=1)
        stored = net.weights("directions", self.directions[:, varies].T)
        nothing = net.weights("no_direction", np.zeros((1, len(self.directions))))
        # Degrees of freedom that never vary take the row of zeros behind the others.
        row = np.where(varies, np.cumsum(varies) - 1, np.count_nonzero(varies))
        return net("Gather", net("Concat", stored, nothing, axis=0), net.weights("freedoms", row))

    def _rotations(self, net: Net, flat: str, directions: str, ends: dict[str, str]) -> str:
        """Quaternions (B S, J, 4) of the first mode's coefficients (r1, B S)."""
        turning = turned_onnx(net, self.means, directions)
        offset = turned(self.means, self.mean[3:])
        if any(len(rung.joints) < len(self.means) for rung in self.rungs):
            return self._some(net, flat, turning, offset, ends)
        turning = net("Slice", turning, net.indices(0, 0), ends["turning"])
        means = net.weights("mean_rotations", self.means[:, :, None])
        constant = net.weights("rotation_mean", offset[:, None])
        return innermost_joints(
            net,
            quaternions(net, net("Gemm", turning, flat, constant), means),
            len(self.means),
        )

    def _some(self, net: Net, flat: str, turning: str, offset: Floats, ends: dict[str, str]) -> str:
        """The same where some level keeps joints still: those that move longest come first."""
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
        found = quaternions(net, net("Gemm", turning, flat, constant), moving)
        still = quat.mul(self.means, quat.exp(self.mean[3:].reshape(-1, 3)))[order][:, :, None]
        still_ones = net(
            "Slice", net.weights("still", still), ends["joints"], net.indices(joints), zero
        )
        poses = net("Shape", found, start=2, end=3)
        shape = net("Concat", net.indices(1, 1), poses, axis=0)
        both = net("Concat", found, net("Expand", still_ones, shape), axis=0)
        back = net("Gather", both, net.weights("joint_places", np.argsort(order)))
        return innermost_joints(net, back, joints)

    def _order(self) -> Indices:
        """Joints in the order in which coarser levels let go of them, the last first."""
        kept = [[j in rung.joints for j in range(len(self.means))] for rung in self.coarse]
        return np.argsort(-np.sum(kept, axis=0), kind="stable")


def turned(means: Floats, vectors: Floats) -> Floats:
    """mean · v / 2 of rotation vectors (..., 3 J) about means (J, 4), as (..., 4 J).

    mean · exp(v) = mean cos φ + (mean · v / 2) sin φ / φ with φ = |v| / 2. The product in brackets
    is linear in v and keeps its length: it is folded into the directions of the model, and no
    quaternion is ever multiplied.
    """
    pure = np.zeros((*vectors.shape[:-1], len(means), 4))
    pure[..., 1:] = 0.5 * vectors.reshape(*vectors.shape[:-1], -1, 3)
    return quat.mul(means, pure).reshape(*vectors.shape[:-1], -1)


def turned_onnx(net: Net, means: Floats, vectors: str) -> str:
    """The same in a graph, of columns of rotation vectors (3 J, r), as columns (4 J, r)."""
    # A quaternion's product with each axis is linear in it: (J, 4) becomes (J, 4, 3).
    axes = quat.mul(np.eye(4)[:, None], 0.5 * np.eye(4)[1:]).swapaxes(1, 2).reshape(4, 12)
    rotations = net("Squeeze", net.weights("mean_rotations", means[:, :, None]), net.indices(2))
    products = net("MatMul", rotations, net.weights("half_axes", axes))
    matrices = net("Reshape", products, net.indices(-1, 4, 3))
    columns = net("MatMul", matrices, net("Reshape", vectors, net.indices(len(means), 3, -1)))
    return net("Reshape", columns, net.indices(4 * len(means), -1))


def quaternions(net: Net, rows: str, means: str) -> str:
    """Graph's quaternions (J, 4, P) of turned rotation vectors (4 J, P) about means (J, 4, 1).

    Poses lie innermost, so that every operation runs over long rows.
    """
    joints = net(
        "Reshape", rows, net("Concat", net("Shape", means, start=0, end=2), net.indices(-1), axis=0)
    )
    squares = net("ReduceSum", net("Mul", joints, joints), net.indices(1), keepdims=1)
    cosine, share = _of_half_angles(net, squares)
    return net("Add", net("Mul", means, cosine), net("Mul", joints, share))


def _of_half_angles(net: Net, squares: str) -> tuple[str, str]:
    """Cosines of half angles and shares sin(a) / a, of squares (J, 1, P) of the half angles."""
    half = net("Sqrt", net("Add", net.padded(squares), net.number(TINY)))
    shape = net("Shape", squares)
    share = net("Div", net("Sin", half), half)
    return net.unpadded(net("Cos", half), shape), net.unpadded(share, shape)


def innermost_joints(net: Net, rotations: str, joints: int) -> str:
    """Quaternions (P, J, 4) of those with poses innermost (J, 4, P)."""
    finished = net("Reshape", rotations, net.indices(4 * joints, -1))
    return net("Reshape", net("Transpose", finished, perm=[1, 0]), net.indices(-1, joints, 4))


@dataclass(frozen=True)
class Proportions:
    """Bone offsets as a mean (J, 3) and directions (r, J, 3), m: performers differ in few ways."""

    mean: Floats
    directions: Floats

    def numpy(self, coefficients: Floats) -> Floats:
        """Bone offsets (B, J, 3) of coefficients (B, r), m."""
        return self.mean + np.einsum("br,rjk->bjk", coefficients, self.directions)

    def onnx(self, net: Net, coefficients: str) -> str:
        """The same in a graph."""
        flat = net(
            "Gemm",
            coefficients,
            net.weights("offset_directions", self.directions.reshape(len(self.directions), -1)),
            net.weights("offset_mean", self.mean.ravel()),
        )
        return net("Reshape", flat, net.indices(-1, len(self.mean), 3))
