"""ONNX graph of the bank of coefficient models; `kriging_bank` is its NumPy counterpart."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from onnx import TensorProto

from posefield.common.units import Floats
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import COVARIANCE_MODELS, KERNEL_GAINS, RATE32, RATE52
from posefield_train.kriging import kriging_bank
from posefield_train.kriging.kriging_bank import (
    DURATION,
    POSE,
    VARIANCE,
    ConstantModel,
    KrigingBank,
)
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.onnx_graph import SLICE_END, GraphBuilder, Integers


@dataclass(frozen=True)
class Covariance:
    """A covariance of squared distances: a NumPy function, its slope, and a builder of ONNX nodes.

    slope: derivative by the squared distance; zero at distance zero where it is infinite there.
    gain: number by which the nodes expect squared distances to be multiplied, which saves a node.
    Rounding can give a squared distance of zero the other sign, and its square root would be NaN:
    the nodes take it for zero.
    """

    numpy: Callable[[Floats], Floats]
    slope: Callable[[Floats], Floats]
    onnx: Callable[[GraphBuilder, str], str]
    gain: float


def _exponential_onnx(net: GraphBuilder, scaled: str) -> str:
    return net("Exp", net("Neg", net("Sqrt", net("Relu", scaled))))


def _gaussian_onnx(net: GraphBuilder, scaled: str) -> str:
    return net("Exp", net("Min", scaled, net.number(0.0)))


def _spherical_onnx(net: GraphBuilder, scaled: str) -> str:
    h = net("Min", net("Sqrt", net("Relu", scaled)), net.number(1.0))
    cubed = net("Mul", net("Mul", h, h), h)
    falling = net("Sub", net("Mul", cubed, net.number(0.5)), net("Mul", h, net.number(1.5)))
    return net("Add", falling, net.number(1.0))


def _matern32_onnx(net: GraphBuilder, scaled: str) -> str:
    a = net("Sqrt", net("Relu", scaled))
    return net("Div", net("Add", a, net.number(1.0)), net("Exp", a))


def _matern52_onnx(net: GraphBuilder, scaled: str) -> str:
    squared = net("Relu", scaled)
    a = net("Sqrt", squared)
    linear = net("Add", a, net.number(1.0))
    growing = net("Add", net("Mul", squared, net.number(1.0 / 3.0)), linear)
    return net("Div", growing, net("Exp", a))


def _exponential_slope(squared: Floats) -> Floats:
    h = np.sqrt(squared)
    with np.errstate(divide="ignore"):
        return np.where(h > 0.0, -1.5 * np.exp(-3.0 * h) / h, 0.0)


def _gaussian_slope(squared: Floats) -> Floats:
    return -3.0 * np.exp(-3.0 * squared)


def _spherical_slope(squared: Floats) -> Floats:
    h = np.sqrt(squared)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where((h > 0.0) & (h < 1.0), 0.75 * (h - 1.0 / h), 0.0)


def _matern32_slope(squared: Floats) -> Floats:
    return -0.5 * RATE32**2 * np.exp(-RATE32 * np.sqrt(squared))


def _matern52_slope(squared: Floats) -> Floats:
    a = RATE52 * np.sqrt(squared)
    return -(RATE52**2) / 6.0 * (1.0 + a) * np.exp(-a)


_GRAPHS = {
    "exponential": (_exponential_slope, _exponential_onnx, KERNEL_GAINS["exponential"]),
    # The nodes of a Gaussian take negative squares, which saves a negation.
    "gaussian": (_gaussian_slope, _gaussian_onnx, -KERNEL_GAINS["gaussian"]),
    "spherical": (_spherical_slope, _spherical_onnx, KERNEL_GAINS["spherical"]),
    "matern32": (_matern32_slope, _matern32_onnx, KERNEL_GAINS["matern32"]),
    "matern52": (_matern52_slope, _matern52_onnx, KERNEL_GAINS["matern52"]),
}
COVARIANCES = {
    name: Covariance(formula, *_GRAPHS[name]) for name, formula in COVARIANCE_MODELS.items()
}


def entries(bank: KrigingBank, ranks: list[int]) -> dict[str, list[Integers]]:
    """Return the level-dependent slice ends and shapes of the bank's graph, by name.

    ranks: number of pose coefficients of each level.
    """
    samples = len(bank.pose.samples)
    column_counts = [ranks[0] + bank.event_columns, *ranks[1:]]
    sizes = [bank.sizes(rank) for rank in column_counts]
    columns = [bank.columns(level) for level in range(len(ranks))]
    shapes = [(bank.linear + n, sum(size)) for n, size in zip(columns, sizes, strict=True)]
    bounds = np.cumsum([0, *(rows * values for rows, values in shapes)]).tolist()
    # Coarser levels have no quadratic form; they use a single zero behind the finest's.
    rows, coarser = bank.linear + samples, len(ranks) - 1
    return {
        "columns": [[n] for n in columns],
        "from": [[start] for start in bounds[:-1]],
        "to": [[end] for end in bounds[1:]],
        "weighing": list(shapes),
        "sizes": list(sizes),
        "curved_from": [[0, 0], *([rows, rows] for _ in range(coarser))],
        "curved_to": [[rows, rows], *([rows + 1, rows + 1] for _ in range(coarser))],
        "pairs": [[rows, 2], *([1, 2] for _ in range(coarser))],
        "own": [[SLICE_END], *([1] for _ in range(coarser))],
    }


def onnx(
    bank: KrigingBank, net: GraphBuilder, controls: str, tables: dict[str, str]
) -> dict[str, str]:
    """Build values (B, m) of each quantity by name, with `sigma` (B, 2) in place of the variance.

    With label sets, the graph has the optional input `labels` (B or 1, p): a weight for each name
    of each set. Its default is zeros, which leave all sets open.
    """
    linear = _linear(bank, net, controls)
    near = _covariances(bank, net, linear, tables["columns"])
    basis = net("Concat", linear, near, axis=1)
    start, shape = tables["from"], tables["weighing"]
    weights = net("Slice", _weights(bank, net), start, tables["to"], net.indices(0))
    values = net("MatMul", basis, net("Reshape", weights, shape))
    names = [VARIANCE, *bank.other_models, POSE]
    quantities = net.multi_output("Split", len(names), values, tables["sizes"], axis=1)
    fields = dict(zip(names, quantities, strict=True))
    sigma = _sigma(bank, net, basis, fields.pop(VARIANCE), tables)
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
    linear = _linear(bank, net, controls)
    near = _covariances(bank, net, linear, net.indices(n))
    weights = np.vstack([bank.linear_weights(field), field.dual[:n]])
    basis = net("Concat", linear, near, axis=1)
    return net("MatMul", basis, net.weights("contact_weights", weights))


def _linear(bank: KrigingBank, net: GraphBuilder, controls: str) -> str:
    """Build labels, one and controls (B, p + 1 + d), scaled to -1 to 1 in their sampled range."""
    low, high, count = bank.low, bank.high, bank.label_count
    gain = np.zeros((len(low), bank.linear))
    gain[:, count + 1 :] = np.diag(2.0 / (high - low))
    shift = np.concatenate([np.zeros(count), [1.0], -(high + low) / (high - low)])
    rest = net.weights("control_shift", shift)
    if bank.labels:
        labels = net.weights("labels", np.zeros((1, count)))
        # One row of labels serves all controls: the sum broadcasts it.
        rest = net("Gemm", labels, _identity(net, count, bank.linear), rest)
    return net("Gemm", controls, net.weights("control_gain", gain), rest)


def _identity(net: GraphBuilder, rows: int, columns: int) -> str:
    """Build the first rows of an identity matrix, without storing it."""
    label_rows = net.weights("label_places", np.arange(rows))
    states = net.weights("label_states", np.array([0.0, 1.0]))
    return net("OneHot", label_rows, net.indices(columns), states, axis=1)


def _covariances(bank: KrigingBank, net: GraphBuilder, linear: str, columns: str) -> str:
    """Build the stationary covariances at every sample (B, n), or their first columns.

    Squared distances come from one product with the squares of `linear` and itself, without an
    array (B, n, d). Its factors are computed from samples and scales when the session loads, and
    are not stored.
    """
    covariance = COVARIANCES[bank.pose.hyper.covariance]
    both = net("Concat", net("Mul", linear, linear), linear, axis=1)
    zero, one = net.indices(0), net.indices(1)
    factors = net("Slice", _factors(bank, net, covariance.gain), zero, columns, one)
    near = covariance.onnx(net, net("MatMul", both, factors))
    for label_shares in _label_shares(bank, net):
        shares = net("Slice", label_shares, zero, columns, one)
        near = net("Mul", near, net("MatMul", linear, shares))
    return near


def _factors(bank: KrigingBank, net: GraphBuilder, gain: float) -> str:
    """Build factors (2 (p + 1 + d), n) from squares and values of `linear` to squared distances.

    gain: number by which the squared distances are multiplied.
    """
    d, n, count = len(bank.low), len(bank.pose.samples), bank.label_count
    stored = net.weights("squared_scales", np.square(bank.pose.hyper.scales)[:, None])
    worth = net("Mul", stored, net.number(gain))
    samples = net.weights("samples", bank.pose.samples[:, :d].T)
    cross = net("Mul", net("Mul", worth, samples), net.number(-2.0))
    squares = net("Mul", net("Mul", samples, samples), worth)
    squared_norm = net("ReduceSum", squares, net.indices(0))
    everywhere = net("Expand", worth, net.indices(d, n))
    before = net("Expand", net.number(0.0), net.indices(count + 1, n))
    factors = [before, everywhere, squared_norm, cross]
    if count:
        factors.insert(2, net("Expand", net.number(0.0), net.indices(count, n)))
    return net("Concat", *factors, axis=0)


def _label_shares(bank: KrigingBank, net: GraphBuilder) -> list[str]:
    """Build the shares (p + 1 + d, n) of the covariances by `linear`, for each label set.

    Between two names of a set its correlation remains, and the whole of it for one name.
    """
    shares, d, n, counts = [], len(bank.low), len(bank.pose.samples), bank.pose.hyper.label_counts
    for index, columns in enumerate(kriging_model.label_columns(d, counts)):
        correlation = bank.pose.hyper.labels[index].correlation
        names = np.argmax(bank.pose.samples[:, columns], axis=1) + columns.start - d
        whose = net.weights(f"whose_{index}", names)
        states = net.weights(f"states_{index}", np.array([0.0, 1.0 - correlation]))
        same = net("OneHot", whose, net.indices(bank.label_count), states, axis=0)
        floor = net.weights(f"correlation_{index}", np.array([[correlation]]))
        floor = net("Expand", floor, net.indices(1, n))
        controls = net("Expand", net.number(0.0), net.indices(d, n))
        shares.append(net("Concat", same, floor, controls, axis=0))
    return shares


def _weights(bank: KrigingBank, net: GraphBuilder) -> str:
    """Build the flat weights of all levels, the finest first.

    Columns: the logarithm of the variance, m², the other quantities, the pose.
    """
    other_weights = [bank.linear_weights(field) for field in bank.other_models.values()]
    # The first column is not used: files of earlier versions have it, and readers skip two.
    stored = np.hstack([np.zeros((bank.linear, 2)), *other_weights, bank.pose_weights()[0]])
    stored[bank.label_count, 1] = _log_sill(bank)
    one, end = net.indices(1), net.indices(stored.shape[1])
    linear = net("Slice", net.weights("linear_weights", stored), one, end, one)
    finest = net("Concat", linear, _duals(bank, net), axis=0)
    levels = [finest]
    for level, coarse in enumerate(bank.coarse, start=1):
        # Its variance is in m².
        stored = coarse.copy()
        stored[bank.label_count, 0] += _log_sill(bank)
        levels.append(net.weights(f"weights_{level}", stored))
    flat = [net("Reshape", level, net.indices(-1)) for level in levels]
    return net("Concat", *flat, axis=0) if bank.coarse else flat[0]


def _duals(bank: KrigingBank, net: GraphBuilder) -> str:
    """Build weights (n, M) of the covariances; those of constant quantities are zero."""
    n = len(bank.pose.samples)
    nothing = net("Expand", net.number(0.0), net.indices(n, 1))
    blocks = [nothing]
    for name, field in bank.other_models.items():
        if isinstance(field, ConstantModel):
            shape = net.indices(n, kriging_bank.width(field))
            blocks.append(net("Expand", net.number(0.0), shape))
        else:
            blocks.append(net.weights(f"{name}_weights", field.dual[:n]))
    blocks.append(net.weights("pose_weights", bank.pose_weights()[1]))
    return net("Concat", *blocks, axis=1)


def _sigma(
    bank: KrigingBank, net: GraphBuilder, basis: str, logarithm: str, tables: dict[str, str]
) -> str:
    """Build sigma, m, twice (B, 2), from the variance: its logarithm's exponential and a form.

    The finest level's logarithm is that of the sill, so that its form lacks the sill; coarser
    levels have no form.
    """
    level_basis = net("Slice", basis, net.indices(0), tables["own"], net.indices(1))
    variance_form = bank.variance_form
    variance_form[bank.label_count, bank.label_count] -= 1.0
    form = net("Pad", _symmetric(net, "precision", variance_form), net.indices(0, 0, 1, 1))
    form = net("Slice", form, tables["curved_from"], tables["curved_to"], net.indices(0, 1))
    # Two columns: see `GraphBuilder.row_sums`.
    pairs = net("Expand", net.weights("sill", np.array([bank.sill])), tables["pairs"])
    # Large terms cancel: single precision would leave no digits of a small sigma.
    level_basis, form, pairs, sill = (
        net("Cast", value, to=TensorProto.DOUBLE)
        for value in (level_basis, form, pairs, net("Exp", logarithm))
    )
    terms = net("Mul", net("MatMul", level_basis, form), level_basis)
    variance = net("Cast", net("Add", net("MatMul", terms, pairs), sill), to=TensorProto.FLOAT)
    # Not Relu, which onnxruntime-web 1.23 fuses with Gemm into an operator that it lacks.
    return net("Sqrt", net("Max", variance, net.number(0.0)))


def _log_sill(bank: KrigingBank) -> float:
    """Return the logarithm of the sill, m²; clips without any error have a sill of zero."""
    return math.log(max(bank.sill, float(np.finfo(np.float32).tiny)))


def _symmetric(net: GraphBuilder, name: str, matrix: Annotated[Floats, "rows rows"]) -> str:
    """Build a symmetric matrix (n, n), stored as the rows of its lower triangle."""
    packed = net.weights(name, matrix[np.tril_indices(len(matrix))])
    row = net.weights(f"{name}_rows", np.arange(len(matrix)))
    column = net("Unsqueeze", row, net.indices(1))
    later, sooner = net("Max", row, column), net("Min", row, column)
    before = net("Div", net("Mul", later, net("Add", later, net.indices(1))), net.indices(2))
    return net("Gather", packed, net("Add", before, sooner))
