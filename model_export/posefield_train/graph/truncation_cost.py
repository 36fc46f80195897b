"""Choice of the ranks of the core tensor."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield_train.graph.float_model import FloatModel
from posefield_train.kriging import kriging_bank
from posefield_train.kriging.kriging_bank import KrigingBank
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.source.recipe_sections import Size
from posefield_train.tensor import hosvd
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.motion_tensor import MotionTensor
from posefield_train.tensor.truncation_error import TruncationReference


@dataclass(frozen=True)
class RankCost:
    """Cost of ranks (r1, r2, r3): the core's r1 r2 r3 plus linear terms.

    ranks: cost per rank of each mode. pair: cost per pair of ranks of the first two modes.
    """

    ranks: tuple[int, int, int]
    pair: int = 0

    def evaluate(self, r1: Any, r2: Any, r3: Any) -> Any:
        """Return the cost of ranks, integers or arrays that broadcast against each other."""
        alone = sum(price * rank for price, rank in zip(self.ranks, (r1, r2, r3), strict=True))
        return r1 * r2 * r3 + self.pair * r1 * r2 + alone


def storage_cost(tensor: MotionTensor, controls: int) -> RankCost:
    """Return the price in numbers stored for the motion: core, bases and kriging weights.

    A rank of the first mode is a direction of the D' degrees of freedom that vary, one of the
    second a column over the frames, one of the third a weight for every sample and every drift
    function. Parts that do not grow with the ranks are left out: the means, the samples' controls,
    the coefficient models of duration, warp and bones, and sigma's matrix.
    """
    return stored(tensor.values.shape, controls)


def stored(shape: Sequence[int], controls: int) -> RankCost:
    """Return the price in stored numbers for a tensor shape (D', T, N)."""
    freedoms, frames, samples = shape
    return RankCost((freedoms, frames, samples + controls + 1))


def operation_cost(tensor: MotionTensor, controls: int) -> RankCost:
    """Return the price in multiply-adds of one pose, counting terms that grow with the ranks.

    Counted are the kriging weights, the core, the interpolation between two frames, its product
    with the motion, and directions of three numbers for the root, a quaternion for each joint and a
    number for each curve.
    """
    joints, samples = len(tensor.chart.means), tensor.values.shape[2]
    directions = 4 * joints + 3 + len(tensor.curves)
    return RankCost((directions, 1, samples + controls + 1), pair=1)


def count_numbers(model: FloatModel, level: int) -> int:
    """Return how many numbers a level reads: core, bases, kriging weights and samples."""
    bank, size = model.bank, model.decoder.level_sizes[level]
    r1, r2, r3 = size.ranks
    samples = bank.columns(level)
    varies = np.any(model.decoder.at_level(level).unwhiten != 0.0, axis=1)
    bases = r1 * np.count_nonzero(varies) + r2 * len(model.decoder.reduced.bases[1])
    blend = model.decoder.event
    if blend and not level:
        bases += blend.times.size + blend.mixing.size
    rows = _form_rows(bank, level)
    numbers = samples * len(bank.low) + rows * (rows + 1) // 2
    return int(r1 * r2 * r3 + bases + numbers + _weights_size(bank, level))


def _form_rows(bank: KrigingBank, level: int) -> int:
    """Return the number of rows of the variance's quadratic form, of which half is stored."""
    return 0 if level else bank.linear + len(bank.pose.samples)


def _weights_size(bank: KrigingBank, level: int) -> int:
    if level:
        return bank.coarse[level - 1].size
    fields = [*bank.other_models.values(), bank.pose, *([bank.event] if bank.event else [])]
    near = [field.dual for field in fields if isinstance(field, UniversalKriging)]
    return bank.linear * sum(map(kriging_bank.width, fields)) + sum(
        len(bank.pose.samples) * dual.shape[1] for dual in near
    )


def count_operations(model: FloatModel, level: int) -> int:
    """Return the multiply-adds of one pose of a level, from controls to quaternions."""
    bank, size = model.bank, model.decoder.level_sizes[level]
    columns = bank.columns(level)
    r1, r2, r3 = size.ranks if level else model.decoder.blended[0].shape
    distances = columns * (2 + 2 * len(bank.low) + len(bank.labels) * bank.label_count)
    values = (bank.linear + columns) * sum(bank.sizes(r3))
    decoding = r1 * r2 * (r3 + 1) + r1 * (4 * len(size.joints) + 3 + len(model.decoder.curves))
    return distances + values + _form_rows(bank, level) ** 2 + decoding


RANK_COSTS = {"numbers": storage_cost, "operations": operation_cost}


@dataclass(frozen=True)
class Compression:
    """Compression ratios of the raw tensor (D', T, N).

    core: relative to the core alone. stored: relative to all stored numbers.
    """

    core: float
    stored: float


def shape_compression(shape: Sequence[int], ranks: Sequence[int], controls: int) -> Compression:
    """Return the compression of a tensor of shape (D', T, N) at ranks (r1, r2, r3).

    `storage_cost` defines what counts as stored.
    """
    raw, numbers = float(np.prod(shape)), stored(shape, controls).evaluate(*ranks)
    return Compression(raw / float(np.prod(ranks)), raw / float(numbers))


RankTriple = tuple[int, int, int]
BudgetRatio = Callable[[RankTriple], float]
"""Largest ratio of a true error to its budget at some ranks; at most one within all budgets."""


@dataclass(frozen=True)
class ParetoFront:
    """Pareto front of rank triples (F, 3) by cost and error, the cheapest first.

    errors: squared error (F,) of each in the tensor's metric, decreasing.
    """

    triples: npt.NDArray[np.int64]
    errors: Floats

    def __getitem__(self, index: int) -> RankTriple:
        r1, r2, r3 = (int(rank) for rank in self.triples[index])
        return r1, r2, r3

    def near(self, error: float, low: int, high: int) -> int:
        """Return the index of the first triple within an error, strictly between low and high."""
        index = int(np.searchsorted(-self.errors, -error))
        return min(max(index, low + 1), high - 1)


def choose_ranks(
    size: Size,
    full: TuckerTensor,
    price: RankCost,
    reference: TruncationReference,
    limits: Mapping[str, float],
) -> RankTriple:
    """Return the ranks of a recipe, or the cheapest whose true errors stay within its budgets.

    limits: m, errors of the truncation beside those of the prediction; the smaller of a budget and
    its limit applies.
    """
    if size.ranks is not None:
        return recipe_ranks(full.core, size.ranks)
    budgets = dict(limits)
    for name, budget in size.budgets.items():
        budgets[name] = min(budget, limits.get(name, budget))

    def strain(triple: RankTriple) -> float:
        return reference.strain(full.truncated(triple), budgets)

    point_count = reference.tensor.weight * np.prod(reference.points.shape[:2])
    aim = min(budgets.values()) ** 2 * float(point_count)
    return cheapest_within(pareto_front(full.core, price), strain, aim)


def pareto_front(core: Floats, price: RankCost, within: RankTriple | None = None) -> ParetoFront:
    """Return the Pareto front of rank triples by cost and exact squared error.

    within: largest ranks; None for all. All triples are evaluated from one cumulative sum of the
    squared core; Mukai & Kuriyama 2006, section 4, leave the choice of size open.
    """
    errors = hosvd.squared_errors(core)[tuple(map(slice, within or core.shape))]
    # Rounding errors of the sum must not add a rank.
    errors[errors <= 1e-12 * float(np.sum(np.square(core)))] = 0.0
    costs = price.evaluate(*np.ix_(*(np.arange(1, size + 1) for size in errors.shape)))
    order = np.lexsort((errors.ravel(), costs.ravel()))
    ordered = errors.ravel()[order]
    best_before = np.minimum.accumulate(np.concatenate([[np.inf], ordered[:-1]]))
    indices = order[ordered < best_before]
    triples = np.stack(np.unravel_index(indices, errors.shape), axis=1) + 1
    return ParetoFront(triples, errors.ravel()[indices])


def cheapest_within(pareto_front: ParetoFront, strain: BudgetRatio, aim: float) -> RankTriple:
    """Return the first triple of a front within every budget, if true errors decrease along it.

    The triple returned is within the budgets in any case. aim: squared error of the first guess.
    Bisection alternates with a guess from the last strain, which grows as the root of the error.
    """
    low, high, guess = -1, len(pareto_front.errors) - 1, True
    while high - low > 1:
        tried = pareto_front.near(aim, low, high) if guess else (low + high) // 2
        ratio = strain(pareto_front[tried])
        low, high = (low, tried) if ratio <= 1.0 else (tried, high)
        aim, guess = pareto_front.errors[tried] / ratio**2, not guess
    return pareto_front[high]


def recipe_ranks(core: Floats, ranks: list[int]) -> RankTriple:
    """Return the recipe's own ranks; raise TrainingError if they exceed the tensor's size."""
    if any(rank > size for rank, size in zip(ranks, core.shape, strict=True)):
        raise TrainingError(
            f"size.ranks {ranks}, expected at most {list(core.shape)}: degrees of freedom, frames "
            "and samples of the tensor"
        )
    r1, r2, r3 = ranks
    return r1, r2, r3
