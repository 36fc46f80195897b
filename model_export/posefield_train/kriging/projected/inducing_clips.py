"""Choice of inducing clips, and of the clips that parameters are tuned on, in large families.

They are leading clips of a pivoted Cholesky factorisation: each is the one whose controls and
labels the clips before it determine least. The covariance is fixed, so that the choice
follows from the controls and labels alone.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Samples
from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper, LabelKernel

LARGEST_DENSE = 299
"""Clips up to which each clip has weights of its own (decision 0064)."""
INDUCING = 160
"""Inducing clips of a larger family, at most."""
LARGEST_TUNED = 500
"""Clips on which parameters are tuned, at most (decision 0025)."""
FEW_VALUES = 10
"""Values of a control up to which each of them has an inducing clip."""
# The means of the priors of scale and correlation, and of the offset.
SCALE, CORRELATION, OFFSET = 0.45, 0.5, 0.3
# Share of the variance below which a clip repeats others.
REPEATED = 1e-6


def choose_inducing(
    points: Samples, controls: int, labels: tuple[int, ...]
) -> Annotated[Indices, "inducing"] | None:
    """Return the sorted indices of inducing clips; None for a family of at most LARGEST_DENSE.

    points: (n, d + p), controls in half-ranges and weights of labels. controls: d. labels: number
    of names of each label set. The ends of each control's range, the values of a control of few,
    and each name have an inducing clip.
    """
    if len(points) <= LARGEST_DENSE:
        return None
    needed = _required(points, controls)
    count = max(INDUCING, len(needed))
    return np.sort(_pivoted(points, fixed_parameters(controls, labels), count, needed))


def choose_tuned(
    points: Samples, controls: int, labels: tuple[int, ...], draw: int
) -> Annotated[Indices, "tuned"]:
    """Return the sorted indices of the clips of one draw, of LARGEST_TUNED at most.

    Half of them lie apart; the others are random, because near pairs tell the nugget. draw: 0 or 1;
    the two share no clip where not all are drawn, so that a draw is of half the clips at most.
    Other arguments as in `choose_inducing`.
    """
    if len(points) <= LARGEST_TUNED:
        return np.arange(len(points))
    mixed = np.random.Generator(np.random.PCG64(len(points))).permutation(len(points))
    half = mixed[draw::2]
    hyper = fixed_parameters(controls, labels)
    apart = half[_pivoted(points[half], hyper, LARGEST_TUNED // 2, ())]
    others = half[~np.isin(half, apart)]
    return np.sort(np.concatenate([apart, others[: LARGEST_TUNED - len(apart)]]))


def tuned_count(clips: int) -> int:
    """Return the number of clips of a family's first draw, on which parameters are tuned."""
    return clips if clips <= LARGEST_TUNED else min(LARGEST_TUNED, (clips + 1) // 2)


def fixed_parameters(controls: int, labels: tuple[int, ...]) -> Hyper:
    """Return the parameters of the covariance that clips are chosen by."""
    kernels = tuple(LabelKernel(count, CORRELATION, OFFSET) for count in labels)
    return Hyper("matern52", (0,), np.full(controls, SCALE), 0.0, 0.0, kernels)


def _required(points: Samples, controls: int) -> list[int]:
    """Return the clips that the card of a model needs, in order."""
    found: set[int] = set()
    for column in points[:, :controls].T:
        values, first = np.unique(column, return_index=True)
        found |= {*first.tolist()} if len(values) <= FEW_VALUES else {int(first[0]), int(first[-1])}
    found |= {int(np.argmax(column)) for column in points[:, controls:].T}
    return sorted(found)


def _pivoted(
    points: Samples, hyper: Hyper, count: int, first: Sequence[int]
) -> Annotated[Indices, "chosen"]:
    """Return `count` samples, fewer where the rest repeats them: `first`, then the pivots."""
    unknown = kriging_model.prior_variances(hyper, points)
    whole = float(unknown.max())
    columns: Annotated[Floats, "chosen samples"] = np.zeros((count, len(points)))
    taken: list[int] = []
    while len(taken) < min(count, len(points)):
        at = len(taken)
        # Rounded, so that rounding errors do not break ties.
        chosen = first[at] if at < len(first) else int(np.argmax(np.round(unknown, 9)))
        if at >= len(first) and unknown[chosen] < REPEATED * whole:
            break
        taken.append(chosen)
        left = kriging_model.covariances(hyper, points[[chosen]], points)[0]
        left = left - columns[:at, chosen] @ columns[:at]
        if unknown[chosen] >= REPEATED * whole:
            columns[at] = left / np.sqrt(unknown[chosen])
        unknown = unknown - np.square(columns[at])
        unknown[taken] = 0.0
    return np.array(taken)
