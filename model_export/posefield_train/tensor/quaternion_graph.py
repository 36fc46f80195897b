"""Quaternions of rotations about mean rotations, in a graph; `rotation_charts` has the formulas."""

from typing import Annotated

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.rotation_charts import CHARTS, ChartName
from posefield_train.onnx_graph.graph_builder import GraphBuilder
from posefield_train.tensor.pose_vectors import PoseChart

# Added to squared half angles, so that sin(a) / a is defined at zero.
TINY = 1e-12


def mean_products(
    own: PoseChart, numbers: Annotated[Floats, "*batch numbers"]
) -> Annotated[Floats, "*batch products"]:
    """Return mean · s v of the numbers v (..., 3 J) of rotations, as (..., 4 J).

    mean · (c + k s v) = mean c + (mean · s v) k. The bracket is linear in v and as long as s v, so
    it is folded into the model's directions and the graph needs no quaternion products.
    """
    pure = np.zeros((*numbers.shape[:-1], len(own.means), 4))
    pure[..., 1:] = CHARTS[own.chart].share * numbers.reshape(*numbers.shape[:-1], -1, 3)
    return quat.mul(own.means, pure).reshape(*numbers.shape[:-1], -1)


def mean_products_onnx(net: GraphBuilder, own: PoseChart, columns: str) -> str:
    """Build `mean_products` in a graph: columns (3 J, r) to columns (4 J, r)."""
    # A quaternion's product with each axis is linear in it: (J, 4) becomes (J, 4, 3).
    axes = CHARTS[own.chart].share * np.eye(4)[1:]
    table = quat.mul(np.eye(4)[:, None], axes).swapaxes(1, 2).reshape(4, 12)
    count = len(own.means)
    rotations = net("Squeeze", net.weights("mean_rotations", own.means[:, :, None]), net.indices(2))
    products = net("MatMul", rotations, net.weights("number_axes", table))
    matrices = net("Reshape", products, net.indices(-1, 4, 3))
    found = net("MatMul", matrices, net("Reshape", columns, net.indices(count, 3, -1)))
    return net("Reshape", found, net.indices(4 * count, -1))


def row_offset(net: GraphBuilder, chart: ChartName, products: str, means: str) -> str:
    """Build the offset (4 J, 1) of the rows that `quaternions` takes.

    products: mean products (4 J, 1) of the mean numbers. means: (J, 4, 1).
    """
    if chart == "rotation_vector":
        return products
    return net("Add", products, net("Reshape", means, net.indices(-1, 1)))


def quaternions(net: GraphBuilder, chart: ChartName, rows: str, means: str, shape: str) -> str:
    """Build quaternions (J, 4, P) about means (J, 4, 1) from rows (4 J, P).

    Poses lie innermost, so that every operation runs over long rows. The rows are mean products,
    of the stereographic chart with the means added. shape: graph value of the shape (J, 1, -1).
    """
    joints = net("Concat", net("Shape", means, start=0, end=2), net.indices(-1), axis=0)
    own = net("Reshape", rows, joints)
    squares = net("ReduceSum", net("Mul", own, own), net.indices(1), keepdims=1)
    if chart == "rotation_vector":
        cosine, share = _half_angle_terms(net, squares, shape)
        return net("Add", net("Mul", means, cosine), net("Mul", own, share))
    # 2 y / |y|² - mean with y = mean + mean · s v, whose squared length is 1 + |s v|².
    return net("Sub", net("Mul", own, net("Div", net.number(2.0), squares)), means)


def _half_angle_terms(net: GraphBuilder, squares: str, shape: str) -> tuple[str, str]:
    """Build cosines of half angles a and ratios sin(a) / a, from their squares (J, 1, P)."""
    row = net.padded(net("Reshape", squares, net.indices(-1)))
    half = net("Sqrt", net("Add", row, net.number(TINY)))
    ratio = net("Div", net("Sin", half), half)
    cosine, share = (net.unpadded(found) for found in (net("Cos", half), ratio))
    return net("Reshape", cosine, shape), net("Reshape", share, shape)


def rows_of_poses(net: GraphBuilder, planes: str, joints: int) -> str:
    """Build quaternions (P, 4 J) from quaternions (J, 4, P) with poses innermost."""
    return net("Transpose", net("Reshape", planes, net.indices(4 * joints, -1)), perm=[1, 0])
