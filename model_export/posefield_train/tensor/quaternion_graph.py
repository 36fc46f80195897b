"""Quaternions of rotation vectors about mean rotations, in a graph."""

from typing import Annotated

import numpy as np

from posefield.common.array_shapes import JointRotations
from posefield.common.units import Floats
from posefield.motion import quat
from posefield_train.onnx_graph.graph_builder import GraphBuilder

# Added to squared half angles, so that sin(a) / a is defined at zero.
TINY = 1e-12


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
