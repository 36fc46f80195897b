"""From reduced coefficients and canonical time to rotations, root position and bone offsets."""

from dataclasses import dataclass

import numpy as np

from model_export.hosvd import Multilinear
from model_export.net import Net
from service.motion import quat
from service.motion.conventions import Floats

# Added to squared half angles, so that the sine over the angle has a value at zero.
TINY = 1e-12


@dataclass(frozen=True)
class Decoder:
    """Reduced tensor to poses.

    reduced: core (r1, r2, r3) and bases of degrees of freedom, frames and samples, in the metric's
    coordinates. mean (D,): pose vector that the tensor is centred on. unwhiten (D, D'): from the
    metric's coordinates, of the D' degrees of freedom that vary, to pose vectors. means (J, 4):
    rotations about which the rotation vectors are taken.
    """

    reduced: Multilinear
    mean: Floats
    unwhiten: Floats
    means: Floats

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
        before = np.minimum(place.astype(np.int64), len(table) - 2)
        share = (place - before)[..., None]
        time = (1.0 - share) * table[before] + share * table[before + 1]
        return np.einsum("bsr,qrc,bc->bsq", time, self.reduced.core, coefficients, optimize=True)

    def onnx(self, net: Net, coefficients: str, place: str) -> tuple[str, str]:
        """The same in a graph, from canonical frames (B, S, 1)."""
        r1, r2, _ = self.reduced.core.shape
        core = net.weights("core", self.reduced.core.transpose(2, 1, 0).reshape(-1, r2 * r1))
        motion = net("Reshape", net("MatMul", coefficients, core), net.indices(-1, r2, r1))
        poses = net("MatMul", self._time(net, place), motion)
        flat = net("Reshape", poses, net.indices(-1, r1))
        directions = self._directions(net)
        zero, three = net.indices(0), net.indices(3)
        of_root = net("Slice", directions, zero, three, zero)
        root = net("Gemm", flat, of_root, net.weights("root_mean", self.mean[:3]), transB=1)
        steps = net("Shape", place, start=0, end=2)
        root_shape = net("Concat", steps, net.indices(3), axis=0)
        joint_shape = net("Concat", steps, net.indices(len(self.means), 4), axis=0)
        return (
            net("Reshape", self._rotations(net, flat, directions), joint_shape),
            net("Reshape", root, root_shape),
        )

    def _time(self, net: Net, place: str) -> str:
        """Time coefficients (B, S, r2): two rows of the table, and a line between them."""
        table = net.weights("time_basis", self.reduced.bases[1])
        last = len(self.reduced.bases[1]) - 1
        zero, one = net.indices(0), net.indices(1)
        first = net("Slice", table, zero, net.indices(last), zero)
        steps = net("Sub", net("Slice", table, one, net.indices(last + 1), zero), first)
        before = net("Min", net("Floor", place), net.number(last - 1.0))
        row = net("Cast", net("Squeeze", before, net.indices(2)), to=6)
        rise = net("Mul", net("Gather", steps, row), net("Sub", place, before))
        return net("Add", net("Gather", first, row), rise)

    def _directions(self, net: Net) -> str:
        """Directions (D, r1), put together when the session loads: what is zero is not stored."""
        varies = np.any(self.unwhiten != 0.0, axis=1)
        stored = net.weights("directions", self.directions[:, varies].T)
        nothing = net.weights("no_direction", np.zeros((1, len(self.directions))))
        # Degrees of freedom that never vary take the row of zeros behind the others.
        row = np.where(varies, np.cumsum(varies) - 1, np.count_nonzero(varies))
        return net("Gather", net("Concat", stored, nothing, axis=0), net.weights("freedoms", row))

    def _rotations(self, net: Net, flat: str, directions: str) -> str:
        """Quaternions (B S, J, 4) of the first mode's coefficients (B S, r1)."""
        zero, three, end = net.indices(0), net.indices(3), net.indices(len(self.mean))
        rows = net(
            "Gemm",
            turned_onnx(net, self.means, net("Slice", directions, three, end, zero)),
            flat,
            net.weights("rotation_mean", turned(self.means, self.mean[3:])[:, None]),
            transB=1,
        )
        return quaternions(net, rows, self.means)


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


def quaternions(net: Net, rows: str, means: Floats) -> str:
    """Graph's quaternions (P, J, 4) of turned rotation vectors (4 J, P).

    Poses lie innermost until the end, so that every operation runs over long rows.
    """
    joints = net("Reshape", rows, net.indices(len(means), 4, -1))
    squares = net("ReduceSum", net("Mul", joints, joints), net.indices(1), keepdims=1)
    half = net("Sqrt", net("Add", squares, net.number(TINY)))
    along = net("Mul", net.weights("mean_rotations", means[:, :, None]), net("Cos", half))
    across = net("Mul", joints, net("Div", net("Sin", half), half))
    finished = net("Reshape", net("Add", along, across), net.indices(4 * len(means), -1))
    return net("Reshape", net("Transpose", finished, perm=[1, 0]), net.indices(-1, len(means), 4))


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
