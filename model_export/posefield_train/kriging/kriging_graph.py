"""ONNX graph of the bank of coefficient models; `kriging_bank` is its NumPy counterpart."""

from typing import Annotated

import numpy as np

from posefield.common.array_shapes import SampleValues
from posefield.common.units import Floats
from posefield_train.kriging import kriging_bank
from posefield_train.kriging.covariance_graph import COVARIANCES
from posefield_train.kriging.kriging_bank import (
    POSE,
    VARIANCE,
    CoefficientModel,
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
    sizes = [[1, *bank.sizes(rank)] for rank in ranks]
    columns = [bank.columns(level) for level in range(len(ranks))]
    shapes = [(bank.linear + n, sum(size)) for n, size in zip(columns, sizes, strict=True)]
    ends = np.cumsum([0, *(rows * values for rows, values in shapes)]).tolist()
    return {
        "columns": [[n] for n in columns],
        "from": [[start] for start in ends[:-1]],
        "to": [[end] for end in ends[1:]],
        "weighing": list(shapes),
        "sizes": list(sizes),
        # Coarser levels have no quadratic form; its slice keeps a single zero.
        "curved": [[own, own] for own in (1 + len(bank.low) + samples, *(1 for _ in ranks[1:]))],
        "own": [[bank.linear + samples], *([len(bank.performers) + 1] for _ in ranks[1:])],
    }


def onnx(
    bank: KrigingBank, net: GraphBuilder, controls: str, ends: dict[str, str]
) -> dict[str, str]:
    """Build values (B, m) of each quantity by name, with `sigma` (B,) in place of the variance.

    With performers, the graph has the optional input `performer` (B or 1, p) of labels. Its default
    is zeros, which stand for an unseen performer.
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
    variance = _variance(bank, net, basis, fields.pop("straight"), ends)
    variance = net("Mul", variance, net("Exp", fields.pop(VARIANCE)))
    one = net.indices(1)
    sigma = net(
        "Squeeze", net("Sqrt", net("Mul", variance, net.weights("sill", np.array(bank.sill)))), one
    )
    return {**fields, "sigma": sigma}


def _points(bank: KrigingBank, net: GraphBuilder, controls: str) -> str:
    """Build one and the controls (B, 1 + d), scaled so that their sampled range is -1 to 1."""
    low, high = bank.low, bank.high
    gain = np.hstack([np.zeros((len(low), 1)), np.diag(2.0 / (high - low))])
    shift = np.concatenate([[1.0], -(high + low) / (high - low)])
    return net(
        "Gemm", controls, net.weights("control_gain", gain), net.weights("control_shift", shift)
    )


def _linear(bank: KrigingBank, net: GraphBuilder, controls: str, points: str) -> str:
    """Build the points with labels in front (B, p + 1 + d), if there are performers."""
    if not bank.performers:
        return points
    performers = len(bank.performers)
    performer = net.weights("performer", np.zeros((1, performers)))
    rows = net("Shape", controls, start=0, end=1)
    shape = net("Concat", rows, net.indices(performers), axis=0)
    return net("Concat", net("Expand", performer, shape), points, axis=1)


def _covariances(
    bank: KrigingBank, net: GraphBuilder, points: str, linear: str, columns: str
) -> str:
    """Build the covariances of every model at every sample (B, F n), or their first columns.

    Squared distances come from one product with [p², q, 1, p], without an array (B, n, d). Its
    factors are computed from samples and scales when the session loads, and are not stored.
    """
    # The points contain the constant one, so both products include it.
    both = net("Concat", net("Mul", points, points), linear, axis=1)
    zero, one = net.indices(0), net.indices(1)
    factors = net("Slice", _factors(bank, net), zero, columns, one)
    # Rounding can make a squared distance of zero negative, and its square root NaN.
    squared = net("Relu", net("MatMul", both, factors))
    return COVARIANCES[bank.pose.hyper.covariance].onnx(net, squared)


def _factors(bank: KrigingBank, net: GraphBuilder) -> str:
    """Build factors (1 + d + p + 1 + d, F n) that map [1, p², q, 1, p] to squared distances."""
    d, n = len(bank.low), len(bank.pose.samples)
    scales = np.stack([field.hyper.scales for field in bank.kriged])
    worth = net.weights("squared_scales", np.square(scales)[:, :, None])
    samples = net.weights("samples", bank.pose.samples[:, :d].T[None])
    cross = net("Mul", net("Mul", worth, samples), net.number(-2.0))
    squares = net("Mul", net("Mul", samples, samples), worth)
    own = net("ReduceSum", squares, net.indices(1))
    nothing = net("Mul", own, net.number(0.0))
    everywhere = net("Expand", worth, net.indices(len(scales), d, n))
    middle = _labels(bank, net, own) if bank.performers else [own]
    blocks = net("Concat", nothing, everywhere, *middle, cross, axis=1)
    return net(
        "Reshape",
        net("Transpose", blocks, perm=[1, 0, 2]),
        net.indices(2 + 2 * d + len(bank.performers), len(scales) * n),
    )


def _labels(bank: KrigingBank, net: GraphBuilder, own: str) -> list[str]:
    """Build the factors of labels (F, p, n) and of one (F, 1, n) in the squared distances.

    They add label² (1 - q·e) for each model, for labels q of the input and e of a sample. own:
    factor of one without labels (F, 1, n).
    """
    p, d = len(bank.performers), len(bank.low)
    labels = np.square([field.hyper.label for field in bank.kriged])
    apart = net.weights("squared_labels", labels[:, None, None])
    whose = net.weights("whose", np.argmax(bank.pose.samples[:, d:], axis=1))
    states = net.weights("states", np.array([0.0, -1.0]))
    same = net("OneHot", whose, net.indices(p), states, axis=0)
    return [net("Mul", apart, same), net("Add", own, apart)]


def _weights(bank: KrigingBank, net: GraphBuilder) -> str:
    """Build the concatenated weights of all levels, the finest from parts at session load."""
    finest = net("Concat", _linear_weights(bank, net), *_duals(bank, net), axis=0)
    coarse = [_coarse_weights(bank, net, level) for level in range(1, 1 + len(bank.coarse))]
    flat = net("Reshape", finest, net.indices(-1))
    return net("Concat", flat, *coarse, axis=0) if coarse else flat


def _coarse_weights(bank: KrigingBank, net: GraphBuilder, level: int) -> str:
    """Build the flat weights of a coarser level, preceded by those of a constant one."""
    stored = net.weights(f"weights_{level}", bank.coarse[level - 1])
    one = np.zeros((len(bank.coarse[level - 1]), 1))
    one[len(bank.performers)] = 1.0
    both = net("Concat", net.weights(f"one_{level}", one), stored, axis=1)
    return net("Reshape", both, net.indices(-1))


def _linear_weights(bank: KrigingBank, net: GraphBuilder) -> str:
    """Build weights (p + 1 + d, M) of labels, one and controls; those of labels are zero."""
    d, slope, constant = len(bank.low), *bank.slope
    variance = np.concatenate([[constant], np.zeros(d - bank.drift), slope[: bank.drift]])
    fields = [*bank.others.values(), bank.pose]
    nothing = np.zeros((1 + d, 1))
    top = np.hstack([variance[:, None], nothing, *(_linear_part(field, d) for field in fields)])
    stored = net.weights("drift_weights", top)
    if not bank.performers:
        return stored
    return net("Pad", stored, net.indices(len(bank.performers), 0, 0, 0))


def _duals(bank: KrigingBank, net: GraphBuilder) -> list[str]:
    """Build weights (n, M) of each model's covariances.

    Those of the pose come first; the variance uses them too.
    """
    total = 2 + sum(map(kriging_bank.width, bank.others.values()))
    pose = net.weights("pose_weights", _dual_part(bank.pose))
    beside = net("Pad", pose, net.indices(0, total - 1, 0, 0))
    slope = net.weights("variance_weights", bank.slope[0][bank.drift :, None])
    blocks, start = [net("Concat", slope, beside, axis=1)], 2
    for name, field in bank.others.items():
        after = total - start - kriging_bank.width(field) + kriging_bank.width(bank.pose)
        if isinstance(field, UniversalKriging):
            own = net.weights(f"{name}_weights", _dual_part(field))
            blocks.append(net("Pad", own, net.indices(0, start, 0, after)))
        start += kriging_bank.width(field)
    return blocks


def _dual_part(field: UniversalKriging) -> SampleValues:
    return field.dual[: len(field.samples)]


def _linear_part(
    field: CoefficientModel, controls: int
) -> Annotated[Floats, "{controls}+1 values"]:
    """Return weights (1 + d, m) of one and the controls, zero for terms outside the drift."""
    if isinstance(field, ConstantModel):
        return np.vstack([field.mean, np.zeros((controls, len(field.mean)))])
    drift = field.dual[len(field.samples) :]
    return np.vstack([drift, np.zeros((1 + controls - len(drift), drift.shape[1]))])


def _variance(
    bank: KrigingBank, net: GraphBuilder, basis: str, straight: str, ends: dict[str, str]
) -> str:
    """Build the finest level's variance (B, 1), a quadratic form of one, controls, covariances."""
    start, one = net.indices(len(bank.performers)), net.indices(1)
    own = net("Slice", basis, start, ends["own"], one)
    around = 1 + len(bank.low) - bank.drift
    stored = net.weights("precision", -bank.precision)
    precision = net("Pad", stored, net.indices(around, around, 0, 0))
    form = net("Slice", precision, net.indices(0, 0), ends["curved"], net.indices(0, 1))
    ones = net.weights("pairs", np.ones((len(bank.precision) + around, 2)))
    pairs = net("Slice", ones, net.indices(0, 0), ends["curved"], net.indices(0, 1))
    curved = net.row_sums(net("Mul", net("MatMul", own, form), own), pairs)
    return net("Relu", net("Add", curved, straight))
