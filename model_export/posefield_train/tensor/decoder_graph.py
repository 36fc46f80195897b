"""ONNX graph of the decoder; `decoder` is its NumPy counterpart."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.motion import quat
from posefield.motion.curves import limits
from posefield.motion.quat import CHARTS, ChartName
from posefield_train.onnx_graph import GraphBuilder, Integers
from posefield_train.tensor.decoder import Decoder
from posefield_train.tensor.pose_vectors import PoseChart

# Added to squared half angles, so that sin(a) / a is defined at zero.
TINY = 1e-12


def mean_products(
    chart: PoseChart, numbers: Annotated[Floats, "*batch numbers"]
) -> Annotated[Floats, "*batch products"]:
    """Return mean · s v of the numbers v (..., 3 J) of rotations, as (..., 4 J).

    mean · (c + k s v) = mean c + (mean · s v) k. The bracket is linear in v and as long as s v, so
    it is folded into the model's directions and the graph needs no quaternion products.
    """
    pure = np.zeros((*numbers.shape[:-1], len(chart.means), 4))
    pure[..., 1:] = CHARTS[chart.chart].share * numbers.reshape(*numbers.shape[:-1], -1, 3)
    return quat.mul(chart.means, pure).reshape(*numbers.shape[:-1], -1)


def mean_products_onnx(net: GraphBuilder, chart: PoseChart, columns: str) -> str:
    """Build `mean_products` in a graph: columns (3 J, r) to columns (4 J, r)."""
    # A quaternion's product with each axis is linear in it: (J, 4) becomes (J, 4, 3).
    axes = CHARTS[chart.chart].share * np.eye(4)[1:]
    table = quat.mul(np.eye(4)[:, None], axes).swapaxes(1, 2).reshape(4, 12)
    count = len(chart.means)
    rotations = net(
        "Squeeze", net.weights("mean_rotations", chart.means[:, :, None]), net.indices(2)
    )
    products = net("MatMul", rotations, net.weights("number_axes", table))
    matrices = net("Reshape", products, net.indices(-1, 4, 3))
    joint_products = net("MatMul", matrices, net("Reshape", columns, net.indices(count, 3, -1)))
    return net("Reshape", joint_products, net.indices(4 * count, -1))


def quaternions(net: GraphBuilder, chart: ChartName, rows: str, means: str, shape: str) -> str:
    """Build quaternions (J, 4, P) about means (J, 4, 1) from rows (4 J, P).

    Poses lie innermost, so that every operation runs over long rows. The rows are mean products,
    of the stereographic chart with the means added. shape: graph value of the shape (J, 1, -1).
    """
    joints = net("Concat", net("Shape", means, start=0, end=2), net.indices(-1), axis=0)
    vectors = net("Reshape", rows, joints)
    squares = net("ReduceSum", net("Mul", vectors, vectors), net.indices(1), keepdims=1)
    if chart == "rotation_vector":
        cosine, share = _half_angle_terms(net, squares, shape)
        return net("Add", net("Mul", means, cosine), net("Mul", vectors, share))
    # 2 y / |y|² - mean with y = mean + mean · s v, whose squared length is 1 + |s v|².
    return net("Sub", net("Mul", vectors, net("Div", net.number(2.0), squares)), means)


def _half_angle_terms(net: GraphBuilder, squares: str, shape: str) -> tuple[str, str]:
    """Build cosines of half angles a and ratios sin(a) / a, from their squares (J, 1, P)."""
    row = net.padded(net("Reshape", squares, net.indices(-1)))
    half = net("Sqrt", net("Add", row, net.number(TINY)))
    ratio = net("Div", net("Sin", half), half)
    cosine, share = (net.unpadded(term) for term in (net("Cos", half), ratio))
    return net("Reshape", cosine, shape), net("Reshape", share, shape)


def rows_of_poses(net: GraphBuilder, planes: str, joints: int) -> str:
    """Build quaternions (P, 4 J) from quaternions (J, 4, P) with poses innermost."""
    return net("Transpose", net("Reshape", planes, net.indices(4 * joints, -1)), perm=[1, 0])


def entries(decoder: Decoder) -> dict[str, list[Integers]]:
    """Return the level-dependent slice ends and shapes of the decoder's graph, by name."""
    ranks, joints = (
        [decoder.blended[0].shape, *(size.ranks for size in decoder.coarse)],
        [len(r.joints) for r in decoder.level_sizes],
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
        **({"curves": [[len(decoder.mean), r1] for r1, _, _ in ranks]} if decoder.curves else {}),
    }


@dataclass(frozen=True)
class DecodedRows:
    """Graph values of the poses P = B S, as rows: the root (P, 3) and curves (P, C), if any.

    planes: rotations (J, 4, P), with poses innermost.
    """

    planes: str
    root: str
    curves: str | None


def onnx(
    decoder: Decoder, net: GraphBuilder, coefficients: str, frames: str, tables: dict[str, str]
) -> DecodedRows:
    """Build `Decoder.numpy` and `curve_values` in a graph, from canonical frames (B, S).

    tables: graph values of the level's slice ends, by the names of `entries`.
    """
    flat = _moves(decoder, net, coefficients, frames, tables)
    directions = _directions(decoder, net)
    three, end = net.indices(3), net.indices(3 + 3 * len(decoder.means))
    of_root = net("Slice", directions, net.indices(0, 0), tables["root"])
    mean = net.weights("root_mean", decoder.mean[:3])
    root = net("Gemm", flat, of_root, mean, transB=1)
    of_joints = net("Slice", directions, three, end, net.indices(0))
    return DecodedRows(
        _rotations(decoder, net, flat, of_joints, tables),
        root,
        _curves(decoder, net, flat, directions, tables) if decoder.curves else None,
    )


def _curves(
    decoder: Decoder, net: GraphBuilder, flat: str, directions: str, tables: dict[str, str]
) -> str:
    """Build the values (P, C) of the curves, clamped, from coefficients (P, r1)."""
    columns = decoder.chart.curve_numbers
    of_curves = net("Slice", directions, net.indices(columns.start, 0), tables["curves"])
    mean = net.weights("curve_mean", decoder.mean[columns])
    values = net("Gemm", flat, of_curves, mean, transB=1)
    low, high = limits(decoder.curves)
    minimum, maximum = net.weights("curve_minimum", low), net.weights("curve_maximum", high)
    return net("Min", net("Max", values, minimum), maximum)


def _moves(
    decoder: Decoder, net: GraphBuilder, coefficients: str, frames: str, tables: dict[str, str]
) -> str:
    """Build the coefficients of the first mode (P, r1).

    Each clip is a product of its own, time coefficients (S, r2) with its motion (r2, r1), so
    that sums have the same order in every batch.
    """
    core = net("Slice", _core(decoder, net), net.indices(0, 0, 0), tables["core"])
    rows = net("Reshape", core, tables["core_rows"])
    motion = net("Reshape", net("Gemm", coefficients, rows, transB=1), tables["motion"])
    time = _time(decoder, net, frames, tables["time"])
    return net("Reshape", net("MatMul", time, motion), tables["flat"])


def _core(decoder: Decoder, net: GraphBuilder) -> str:
    """Build the core (r2, r1, r3); the event's block is made when the session loads."""
    core = net.weights("core", decoder.reduced.core.transpose(1, 0, 2))
    if decoder.event is None:
        return core
    (r1, r2, r3), count = decoder.reduced.core.shape, decoder.event.count
    columns = decoder.event.mixing.shape[1]
    zero, two = net.indices(0), net.indices(2)
    leading = net("Slice", core, zero, net.indices(count), two)
    flat = net("Reshape", leading, net.indices(r2, r1 * count))
    mixed = net("MatMul", net.weights("event_mixing", decoder.event.mixing.T), flat)
    block = net("Reshape", mixed, net.indices(columns, r1, count))
    before = net("Expand", net.number(0.0), net.indices(columns, r1, r3))
    padding = net("Expand", net.number(0.0), net.indices(r2, r1, count))
    upper = net("Concat", core, padding, axis=2)
    return net("Concat", upper, net("Concat", before, block, axis=2), axis=0)


def _time(decoder: Decoder, net: GraphBuilder, canonical: str, end: str) -> str:
    """Build time coefficients (B, S, r2), linearly interpolated between frames."""
    table = net.weights("time_basis", decoder.reduced.bases[1].T)
    if decoder.event:
        table = net("Concat", table, net.weights("event_times", decoder.event.times.T), axis=0)
    frames = len(decoder.reduced.bases[1])
    zero, one = net.indices(0), net.indices(1)
    # Rows of frames are copied whole. Behind the last frame nothing changes.
    rows = net("Transpose", table, perm=[1, 0])
    after = net(
        "Gather", rows, net.weights("next_frames", np.append(np.arange(1, frames), frames - 1))
    )
    level_rows = net("Slice", rows, zero, end, one)
    steps = net("Slice", net("Sub", after, rows), zero, end, one)
    before = net("Floor", canonical)
    row = net("Cast", before, to=6)
    share = net("Unsqueeze", net("Sub", canonical, before), net.indices(2))
    rise = net("Mul", net("Gather", steps, row), share)
    return net("Add", net("Gather", level_rows, row), rise)


def _directions(decoder: Decoder, net: GraphBuilder) -> str:
    """Build directions (D, r1) from stored nonzero rows when the session loads."""
    varies = np.any(decoder.unwhiten != 0.0, axis=1)
    stored = net.weights("directions", decoder.directions[:, varies].T)
    nothing = net.weights("no_direction", np.zeros((1, len(decoder.directions))))
    # Degrees of freedom that never vary take the row of zeros after the others.
    row = np.where(varies, np.cumsum(varies) - 1, np.count_nonzero(varies))
    return net("Gather", net("Concat", stored, nothing, axis=0), net.weights("freedoms", row))


def _rotations(
    decoder: Decoder, net: GraphBuilder, flat: str, directions: str, tables: dict[str, str]
) -> str:
    """Build quaternions (J, 4, P) from the first mode's coefficients (P, r1)."""
    turning = mean_products_onnx(net, decoder.chart, directions)
    offset = mean_products(decoder.chart, decoder.mean_turns)
    if any(len(size.joints) < len(decoder.means) for size in decoder.level_sizes):
        return _partly_fixed_rotations(decoder, net, flat, turning, offset, tables)
    turning = net("Slice", turning, net.indices(0, 0), tables["turning"])
    means = net.weights("mean_rotations", decoder.means[:, :, None])
    constant = net.weights("rotation_mean", offset[:, None])
    return _chart_quaternions(decoder, net, (turning, flat, constant), means, tables)


def _chart_quaternions(
    decoder: Decoder,
    net: GraphBuilder,
    rows: tuple[str, str, str],
    means: str,
    tables: dict[str, str],
) -> str:
    """Build quaternions (J, 4, P) of directions (4 J, r1), poses (P, r1), constant (4 J, 1)."""
    directions, poses, constant = rows
    chart = decoder.chart.chart
    # The rows that `quaternions` takes have the means added in the stereographic chart.
    if chart != "rotation_vector":
        constant = net("Add", constant, net("Reshape", means, net.indices(-1, 1)))
    products = net("Gemm", directions, poses, constant, transB=1)
    return quaternions(net, chart, products, means, tables["half_angles"])


def _partly_fixed_rotations(
    decoder: Decoder,
    net: GraphBuilder,
    flat: str,
    turning: str,
    offset: Annotated[Floats, "..."],
    tables: dict[str, str],
) -> str:
    """Build quaternions where some level fixes joints.

    Joints are sorted by the number of levels that move them, so that a slice selects a level's
    joints.
    """
    order = _order(decoder)
    joints, zero = len(order), net.indices(0)
    rows = np.arange(4 * joints).reshape(joints, 4)[order].ravel()
    turning = net("Gather", turning, net.weights("turning_order", rows))
    turning = net("Slice", turning, net.indices(0, 0), tables["turning"])
    constant = net.weights("rotation_mean", offset[rows][:, None])
    constant = net("Slice", constant, zero, tables["quaternions"], zero)
    ordered = net.weights("mean_rotations", decoder.means[:, :, None])
    ordered = net("Gather", ordered, net.weights("joint_order", order))
    moving = net("Slice", ordered, zero, tables["joints"], zero)
    turned = _chart_quaternions(decoder, net, (turning, flat, constant), moving, tables)
    still = decoder.chart.rotation_planes(decoder.mean_turns[:, None])[order]
    still_ones = net(
        "Slice", net.weights("still", still), tables["joints"], net.indices(joints), zero
    )
    poses = net("Shape", turned, start=2, end=3)
    shape = net("Concat", net.indices(1, 1), poses, axis=0)
    both = net("Concat", turned, net("Expand", still_ones, shape), axis=0)
    return net("Gather", both, net.weights("joint_places", np.argsort(order)))


def _order(decoder: Decoder) -> Annotated[Indices, "joints"]:
    """Return the joints sorted by the number of coarser levels that keep them, descending."""
    moving = [[j in size.joints for j in range(len(decoder.means))] for size in decoder.coarse]
    return np.argsort(-np.sum(moving, axis=0), kind="stable")
