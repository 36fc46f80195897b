"""Peers whose predictions are weighted sums of the samples, and what the performer adds to them.

Such a peer is described by its weights alone, which are the same for every predicted quantity. A
library's interpolator knows controls only. Where every method may know the performer, it gets the
performer in the way of a mixed model: an offset of each performer, estimated from the residuals of
samples that are left out and shrunk as far as these residuals advise, is taken from the samples,
the peer predicts the rest, and the offset of the asked performer is added.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from evaluation.peers import Interpolator
from posefield.common.units import Booleans, Floats
from posefield.kriging import kriging_model
from posefield_train.kriging.sample_points import SamplePoints

MOST_PARTS = 12
"""Samples of more takes than this are left out in as many parts of whole takes."""
SHRINKAGES = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, np.inf)
"""Samples without an offset that each performer's own are averaged with; infinity for no offset."""
ROUNDS = 4
"""Times that offsets are estimated from what the peer leaves of the samples without them."""


@dataclass(frozen=True)
class LinearSmoother:
    """Weights of a peer. at_queries: (q, n). left_out: (n, n), of each sample from other parts."""

    at_queries: Floats
    left_out: Floats

    def residuals(self, values: Floats) -> Floats:
        """Return the errors (n, m) of values (n, m) at samples that are left out."""
        return values - self.left_out @ values


def smoother(peer: Interpolator, samples: SamplePoints, queries: Floats) -> LinearSmoother:
    """Return the weights of a peer whose predictions are linear in the values."""
    count = len(samples.points)
    left_out = np.zeros((count, count))
    for out in left_out_parts(samples):
        rest = replace(samples, points=samples.points[~out], groups=samples.groups[~out])
        left_out[np.ix_(out, ~out)] = peer(rest, np.eye(len(rest.points)), samples.points[out])
    return LinearSmoother(peer(samples, np.eye(count), queries), left_out)


def left_out_parts(samples: SamplePoints) -> list[Booleans]:
    """Return masks (n,) of the samples that are left out together: whole groups.

    Groups are dealt into MOST_PARTS parts, unless one of those carries the line through the rest.
    """
    groups = np.unique(samples.groups, return_inverse=True)[1]
    dealt = groups % MOST_PARTS
    functions = kriging_model.drift(samples.half_ranges, samples.controls, 1)
    if kriging_model.find_required_group(dealt, functions) is not None:
        dealt = groups
    return [dealt == index for index in range(int(dealt.max()) + 1)]


def predict(choices: Sequence[LinearSmoother], values: Floats) -> Floats:
    """Return predictions (q, m) of values (n, m) by the choice of the least left-out error."""
    return _best(choices, values).at_queries @ values


def predict_with_performers(
    choices: Sequence[LinearSmoother], samples: SamplePoints, values: Floats, queries: Floats
) -> Floats:
    """Return the predictions (q, m) of `predict` with offsets of the samples' performers.

    queries: (q, d + p), with zeros as the label of an unknown performer, who has no offset.
    """
    chosen = chosen_offsets(choices, samples, values)
    labels = samples.points[:, samples.controls :]
    return predict(choices, values - labels @ chosen) + queries[:, samples.controls :] @ chosen


def chosen_offsets(
    choices: Sequence[LinearSmoother], samples: SamplePoints, values: Floats
) -> Floats:
    """Return the offset (p, m) of each performer by the choice of the least left-out error."""
    return performer_offsets(_best(choices, values), samples, values)


def performer_offsets(smoother: LinearSmoother, samples: SamplePoints, values: Floats) -> Floats:
    """Return the offset (p, m) of each performer from what a peer predicts without performers."""
    labels = samples.points[:, samples.controls :]
    shrinkage = _best_shrinkage(samples, smoother.residuals(values))
    sums = _shares(labels.sum(axis=0), shrinkage)[:, None] * labels.T
    result = np.zeros((labels.shape[1], values.shape[1]))
    for _ in range(ROUNDS):
        result = sums @ (smoother.residuals(values - labels @ result) + labels @ result)
    return result


def _best(choices: Sequence[LinearSmoother], values: Floats) -> LinearSmoother:
    if len(choices) == 1:
        return choices[0]
    losses = [float(np.sum(np.square(choice.residuals(values)))) for choice in choices]
    return choices[int(np.argmin(losses))]


def _best_shrinkage(samples: SamplePoints, residuals: Floats) -> float:
    """Return the shrinkage with which other takes of the performer predict the residuals best."""
    labels = samples.points[:, samples.controls :]
    rest = labels @ labels.T * (samples.groups[:, None] != samples.groups)
    sums, counts = rest @ residuals, rest.sum(axis=1)
    losses = [
        float(np.sum(np.square(residuals - _shares(counts, shrinkage)[:, None] * sums)))
        for shrinkage in SHRINKAGES
    ]
    # Of equal ones the strongest.
    return SHRINKAGES[len(losses) - 1 - int(np.argmin(losses[::-1]))]


def _shares(counts: Floats, shrinkage: float) -> Floats:
    """Return the weight of each of some samples in a shrunken mean; zero without samples."""
    total = counts + shrinkage
    return np.where(total > 0.0, 1.0 / np.where(total > 0.0, total, 1.0), 0.0)
