"""ONNX graph of the bank of coefficient models; `kriging_bank` is its NumPy counterpart."""

from typing import Annotated

import numpy as np

from posefield.common.units import Floats
from posefield.kriging import kriging_model
from posefield_train.kriging import kriging_bank
from posefield_train.kriging.covariance_graph import COVARIANCES
from posefield_train.kriging.kriging_bank import (
    DURATION,
    POSE,
    VARIANCE,
    ConstantModel,
    KrigingBank,
)
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.onnx_graph.graph_builder import GraphBuilder
from posefield_train.onnx_graph.level_tables import Integers


def entries(bank: KrigingBank, ranks: list[int]) -> dict[str, list[Integers]]:
    """Return the level-dependent slice ends and shapes of the bank's graph, by name.

    ranks: number of pose coefficients of each level.
    """
    samples = len(bank.pose.samples)
    own = [ranks[0] + bank.event_columns, *ranks[1:]]
    sizes = [[1, *bank.sizes(rank)] for rank in own]
    columns = [bank.columns(level) for level in range(len(ranks))]
    shapes = [(bank.linear + n, sum(size)) for n, size in zip(columns, sizes, strict=True)]
    curved = [1 + bank.linear + samples, *(1 for _ in ranks[1:])]
    ends = np.cumsum([0, *(rows * values for rows, values in shapes)]).tolist()
    return {
        "columns": [[n] for n in columns],
        "from": [[start] for start in ends[:-1]],
        "to": [[end] for end in ends[1:]],
        "weighing": list(shapes),
        "sizes": list(sizes),
        # Coarser levels have no quadratic form; its slice keeps a single zero.
        "curved": [[size, size] for size in curved],
        "own": [[size] for size in curved],
    }


def onnx(
    bank: KrigingBank, net: GraphBuilder, controls: str, ends: dict[str, str]
) -> dict[str, str]:
    """Build values (B, m) of each quantity by name, with `sigma` (B,) in place of the variance.

    With label sets, the graph has the optional input `labels` (B or 1, p): a weight for each name
    of each set. Its default is zeros, which leave all sets open.
    """
    points = _points(bank, net, controls)
    linear = _linear(bank, net, controls, points)
    near = _covariances(bank, net, points, linear, ends["columns"])
    basis = net("Concat", linear, near, axis=1)
    start, shape = ends["from"], ends["weighing"]
    weights = net("Slice", _weights(bank, net), start, ends["to"], net.indices(0))
    values = net("MatMul", basis, net("Reshape", weights, shape))
    names = ["straight", VARIANCE, *bank.others, POSE]
    parts = net.multi_output("Split", len(names), values, ends["sizes"], axis=1)
    fields = dict(zip(names, parts, strict=True))
    curved = _variance(bank, net, basis, ends)
    variance = net("Relu", net("Add", curved, fields.pop("straight")))
    variance = net("Mul", variance, net("Exp", fields.pop(VARIANCE)))
    one = net.indices(1)
    squared = net("Mul", variance, net.weights("sill", np.array([bank.sill])))
    sigma = net("Squeeze", net("Sqrt", squared), one)
    if bank.power_law:
        fields[DURATION] = net("Add", fields[DURATION], bank.power_law.onnx(net, controls))
    return {**fields, "sigma": sigma}


def contact_coefficients(
    bank: KrigingBank, field: UniversalKriging, net: GraphBuilder, controls: str
) -> str:
    """Build the coefficients (B, r) of the contacts, which do not depend on the level.

    field: the bank's model of the contacts.
    """
    n = len(field.samples)
    points = _points(bank, net, controls)
    linear = _linear(bank, net, controls, points)
    near = _covariances(bank, net, points, linear, net.indices(n))
    weights = np.vstack([bank.linear_weights(field), field.dual[:n]])
    basis = net("Concat", linear, near, axis=1)
    return net("MatMul", basis, net.weights("contact_weights", weights))


def _points(bank: KrigingBank, net: GraphBuilder, controls: str) -> str:
    """Build one and the controls (B, 1 + d), scaled so that their sampled range is -1 to 1."""
    low, high = bank.low, bank.high
    gain = np.hstack([np.zeros((len(low), 1)), np.diag(2.0 / (high - low))])
    shift = np.concatenate([[1.0], -(high + low) / (high - low)])
    return net(
        "Gemm", controls, net.weights("control_gain", gain), net.weights("control_shift", shift)
    )


def _linear(bank: KrigingBank, net: GraphBuilder, controls: str, points: str) -> str:
    """Build the points with labels in front (B, p + 1 + d), if there are label sets."""
    if not bank.labels:
        return points
    count = bank.label_count
    labels = net.weights("labels", np.zeros((1, count)))
    rows = net("Shape", controls, start=0, end=1)
    shape = net("Concat", rows, net.indices(count), axis=0)
    return net("Concat", net("Expand", labels, shape), points, axis=1)


def _covariances(
    bank: KrigingBank, net: GraphBuilder, points: str, linear: str, columns: str
) -> str:
    """Build the stationary covariances at every sample (B, n), or their first columns.

    Squared distances come from one product with [1, p², 1, p], without an array (B, n, d). Its
    factors are computed from samples and scales when the session loads, and are not stored.
    """
    # The points contain the constant one, so both products include it.
    both = net("Concat", net("Mul", points, points), points, axis=1)
    zero, one = net.indices(0), net.indices(1)
    factors = net("Slice", _factors(bank, net), zero, columns, one)
    # Rounding can make a squared distance of zero negative, and its square root NaN.
    squared = net("Relu", net("MatMul", both, factors))
    near = COVARIANCES[bank.pose.hyper.covariance].onnx(net, squared)
    if not bank.labels:
        return near
    kept = net("Slice", linear, zero, net.indices(bank.label_count + 1), one)
    for every in _label_shares(bank, net):
        shares = net("Slice", every, zero, columns, one)
        near = net("Mul", near, net("MatMul", kept, shares))
    return near


def _factors(bank: KrigingBank, net: GraphBuilder) -> str:
    """Build factors (2 + 2 d, n) that map [1, p², 1, p] to squared distances."""
    d, n = len(bank.low), len(bank.pose.samples)
    worth = net.weights("squared_scales", np.square(bank.pose.hyper.scales)[:, None])
    samples = net.weights("samples", bank.pose.samples[:, :d].T)
    cross = net("Mul", net("Mul", worth, samples), net.number(-2.0))
    squares = net("Mul", net("Mul", samples, samples), worth)
    own = net("ReduceSum", squares, net.indices(0))
    nothing = net("Mul", own, net.number(0.0))
    everywhere = net("Expand", worth, net.indices(d, n))
    return net("Concat", nothing, everywhere, own, cross, axis=0)


def _label_shares(bank: KrigingBank, net: GraphBuilder) -> list[str]:
    """Build the shares (p + 1, n) of the covariances by a query's labels and one, for each set.

    Between two names of a set its correlation remains, and the whole of it for one name.
    """
    found, d, counts = [], len(bank.low), bank.pose.hyper.label_counts
    shape = net.indices(1, len(bank.pose.samples))
    for index, columns in enumerate(kriging_model.label_columns(d, counts)):
        correlation = bank.pose.hyper.labels[index].correlation
        own = np.argmax(bank.pose.samples[:, columns], axis=1) + columns.start - d
        whose = net.weights(f"whose_{index}", own)
        states = net.weights(f"states_{index}", np.array([0.0, 1.0 - correlation]))
        same = net("OneHot", whose, net.indices(bank.label_count), states, axis=0)
        kept = net.weights(f"correlation_{index}", np.array([[correlation]]))
        found.append(net("Concat", same, net("Expand", kept, shape), axis=0))
    return found


def _weights(bank: KrigingBank, net: GraphBuilder) -> str:
    """Build the flat weights of all levels, the finest first.

    Columns of the finest: one of zeros, the logarithm of one, the other quantities, the pose.
    """
    others = [bank.linear_weights(field) for field in bank.others.values()]
    linear = np.hstack([np.zeros((bank.linear, 2)), *others, bank.pose_weights()[0]])
    finest = net("Concat", net.weights("linear_weights", linear), _duals(bank, net), axis=0)
    flat = net("Reshape", finest, net.indices(-1))
    coarse = [_coarse_weights(bank, net, level + 1) for level in range(len(bank.coarse))]
    return net("Concat", flat, *coarse, axis=0) if coarse else flat


def _coarse_weights(bank: KrigingBank, net: GraphBuilder, level: int) -> str:
    """Build the flat weights of a coarser level, preceded by those of a constant one."""
    stored = net.weights(f"weights_{level}", bank.coarse[level - 1])
    one = np.zeros((len(bank.coarse[level - 1]), 1))
    one[bank.label_count] = 1.0
    both = net("Concat", net.weights(f"one_{level}", one), stored, axis=1)
    return net("Reshape", both, net.indices(-1))


def _duals(bank: KrigingBank, net: GraphBuilder) -> str:
    """Build weights (n, M) of the covariances; those of constant quantities are zero."""
    n = len(bank.pose.samples)
    nothing = net("Expand", net.number(0.0), net.indices(n, 2))
    blocks = [nothing]
    for name, field in bank.others.items():
        if isinstance(field, ConstantModel):
            shape = net.indices(n, kriging_bank.width(field))
            blocks.append(net("Expand", net.number(0.0), shape))
        else:
            blocks.append(net.weights(f"{name}_weights", field.dual[:n]))
    blocks.append(net.weights("pose_weights", bank.pose_weights()[1]))
    return net("Concat", *blocks, axis=1)


def _variance(bank: KrigingBank, net: GraphBuilder, basis: str, ends: dict[str, str]) -> str:
    """Build the finest level's variance (B, 1), a quadratic form of the basis; one for coarser.

    Coarser levels use the constant alone, in front.
    """
    zero, one = net.indices(0), net.indices(1)
    linear = bank.label_count
    constant = net("Slice", basis, net.indices(linear), net.indices(linear + 1), one)
    own = net("Slice", net("Concat", constant, basis, axis=1), zero, ends["own"], one)
    whole = bank.variance_form
    form = net("Pad", _symmetric(net, "precision", whole), net.indices(1, 1, 0, 0))
    form = net("Slice", form, net.indices(0, 0), ends["curved"], net.indices(0, 1))
    ones = net.weights("pairs", np.ones((1 + len(whole), 2)))
    pairs = net("Slice", ones, net.indices(0, 0), ends["curved"], net.indices(0, 1))
    return net.row_sums(net("Mul", net("MatMul", own, form), own), pairs)


def _symmetric(net: GraphBuilder, name: str, matrix: Annotated[Floats, "rows rows"]) -> str:
    """Build a symmetric matrix (n, n), stored as the rows of its lower triangle."""
    packed = net.weights(name, matrix[np.tril_indices(len(matrix))])
    row = net.weights(f"{name}_rows", np.arange(len(matrix)))
    column = net("Unsqueeze", row, net.indices(1))
    later, sooner = net("Max", row, column), net("Min", row, column)
    before = net("Div", net("Mul", later, net("Add", later, net.indices(1))), net.indices(2))
    return net("Gather", packed, net("Add", before, sooner))
