"""How much of the core tensor to keep."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from model_export import hosvd
from model_export.cost import Price
from model_export.fidelity import Judge
from model_export.hosvd import Multilinear
from model_export.recipe import Size
from service.motion.conventions import Floats
from service.motion.errors import TrainingError

Triple = tuple[int, int, int]
Strain = Callable[[Triple], float]
"""Largest of the true errors at some ranks, each over its budget: at most one if all are kept."""


@dataclass(frozen=True)
class Front:
    """Triples of ranks (F, 3) to which nothing cheaper is as good, the cheapest first.

    errors (F,): the squared error of each in the tensor's metric; it falls from one to the next.
    """

    triples: npt.NDArray[np.int64]
    errors: Floats

    def __getitem__(self, place: int) -> Triple:
        r1, r2, r3 = (int(rank) for rank in self.triples[place])
        return r1, r2, r3

    def near(self, error: float, low: int, high: int) -> int:
        """Place strictly between two others of the first triple whose error is no larger."""
        place = int(np.searchsorted(-self.errors, -error))
        return min(max(place, low + 1), high - 1)


def choose(size: Size, full: Multilinear, price: Price, judge: Judge) -> Triple:
    """Ranks that a recipe gives, or the cheapest whose true errors keep its budgets."""
    if size.ranks is not None:
        return given(full.core, size.ranks)

    def strain(triple: Triple) -> float:
        found = judge.of(full.truncated(triple))
        return max(getattr(found, name) / budget for name, budget in size.budgets.items())

    places = judge.own_tensor.weight * np.prod(judge.whole.shape[:2])
    aim = min(size.budgets.values()) ** 2 * float(places)
    return cheapest(front(full.core, price), strain, aim)


def front(core: Floats, price: Price, within: Triple | None = None) -> Front:
    """Front of all triples by cost and exact squared error; of those within a triple, if given.

    Every triple is scored, from one cumulative sum of the squared core (Mukai & Kuriyama 2006 left
    the choice open).
    """
    errors = hosvd.squared_errors(core)[tuple(map(slice, within or core.shape))]
    # A relative rounding error of the sum is no reason to keep another rank.
    errors[errors <= 1e-12 * float(np.sum(np.square(core)))] = 0.0
    costs = price.of(*np.ix_(*(np.arange(1, size + 1) for size in errors.shape)))
    order = np.lexsort((errors.ravel(), costs.ravel()))
    ordered = errors.ravel()[order]
    best_before = np.minimum.accumulate(np.concatenate([[np.inf], ordered[:-1]]))
    places = order[ordered < best_before]
    triples = np.stack(np.unravel_index(places, errors.shape), axis=1) + 1
    return Front(triples, errors.ravel()[places])


def cheapest(front: Front, strain: Strain, aim: float) -> Triple:
    """First triple of a front that keeps every budget, if true errors fall along it as its own do.

    What is returned keeps them in any case. aim: squared error at which to look first. Halving
    takes turns with where the last strain, which grows as the root of the error, says to look.
    """
    low, high, guess = -1, len(front.errors) - 1, True
    while high - low > 1:
        tried = front.near(aim, low, high) if guess else (low + high) // 2
        found = strain(front[tried])
        low, high = (low, tried) if found <= 1.0 else (tried, high)
        aim, guess = front.errors[tried] / found**2, not guess
    return front[high]


def given(core: Floats, ranks: list[int]) -> Triple:
    """The recipe's own ranks; TrainingError where the tensor has not that many."""
    if any(rank > size for rank, size in zip(ranks, core.shape, strict=True)):
        raise TrainingError(
            f"size.ranks {ranks}, expected at most {list(core.shape)}: degrees of freedom, frames "
            "and samples of the tensor"
        )
    r1, r2, r3 = ranks
    return r1, r2, r3
