"""How much of the core tensor to keep."""

import numpy as np

from model_export import hosvd
from service.motion.conventions import Floats
from service.motion.errors import TrainingError


def smallest(core: Floats, allowed: float, per_rank: tuple[int, int, int]) -> tuple[int, int, int]:
    """Ranks of fewest numbers stored whose truncation costs at most `allowed` squared error.

    Every triple is scored exactly, from one cumulative sum of the squared core (Mukai & Kuriyama
    2006 left the choice open). per_rank: numbers stored for one more rank of each mode, beside
    the core itself.
    """
    errors = hosvd.squared_errors(core)
    stored = sizes(core.shape, per_rank)
    # A relative rounding error of the sum must not forbid full ranks.
    fits = errors <= allowed + 1e-12 * float(np.sum(np.square(core)))
    best = int(np.argmin(np.where(fits, stored, np.inf)))
    r1, r2, r3 = (int(index) + 1 for index in np.unravel_index(best, core.shape))
    return r1, r2, r3


def sizes(shape: tuple[int, ...], per_rank: tuple[int, int, int]) -> Floats:
    """Numbers stored for every triple of ranks; per_rank: for one more of each, core aside."""
    r1, r2, r3 = (np.arange(1.0, size + 1) for size in shape)
    own = r1[:, None, None] * r2[:, None] * r3
    return own + per_rank[0] * r1[:, None, None] + per_rank[1] * r2[:, None] + per_rank[2] * r3


def given(core: Floats, ranks: list[int]) -> tuple[int, int, int]:
    """The recipe's own ranks; TrainingError where the tensor has not that many."""
    if any(rank > size for rank, size in zip(ranks, core.shape, strict=True)):
        raise TrainingError(
            f"size.ranks {ranks}, expected at most {list(core.shape)}: degrees of freedom, frames "
            "and samples of the tensor"
        )
    r1, r2, r3 = ranks
    return r1, r2, r3
