"""Choice of the ranks of the core tensor."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield_train.graph.truncation_cost import RankCost
from posefield_train.source.recipe_sections import Size
from posefield_train.tensor import hosvd
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.truncation_error import TruncationReference

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

    def __getitem__(self, place: int) -> RankTriple:
        r1, r2, r3 = (int(rank) for rank in self.triples[place])
        return r1, r2, r3

    def near(self, error: float, low: int, high: int) -> int:
        """Return the index of the first triple within an error, strictly between low and high."""
        place = int(np.searchsorted(-self.errors, -error))
        return min(max(place, low + 1), high - 1)


def choose_ranks(
    size: Size,
    full: TuckerTensor,
    price: RankCost,
    judge: TruncationReference,
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
        return judge.strain(full.truncated(triple), budgets)

    places = judge.own_tensor.weight * np.prod(judge.whole.shape[:2])
    aim = min(budgets.values()) ** 2 * float(places)
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
    places = order[ordered < best_before]
    triples = np.stack(np.unravel_index(places, errors.shape), axis=1) + 1
    return ParetoFront(triples, errors.ravel()[places])


def cheapest_within(pareto_front: ParetoFront, strain: BudgetRatio, aim: float) -> RankTriple:
    """Return the first triple of a front within every budget, if true errors decrease along it.

    The triple returned is within the budgets in any case. aim: squared error of the first guess.
    Bisection alternates with a guess from the last strain, which grows as the root of the error.
    """
    low, high, guess = -1, len(pareto_front.errors) - 1, True
    while high - low > 1:
        tried = pareto_front.near(aim, low, high) if guess else (low + high) // 2
        found = strain(pareto_front[tried])
        low, high = (low, tried) if found <= 1.0 else (tried, high)
        aim, guess = pareto_front.errors[tried] / found**2, not guess
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
