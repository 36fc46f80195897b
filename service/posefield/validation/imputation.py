"""Choice of the controls that a question leaves open: those of a typical captured clip.

Nothing is averaged over all clips, since a mean may lie between two clusters of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Booleans, Floats
from posefield.kriging import kriging_model, typical_clip
from posefield.kriging.typical_clip import NEAR, Neighbourhood
from posefield.model_file import answer_bounds
from posefield.model_file.model_card import Control, ModelCard

OTHER_LABEL = 4.0
"""Cost of a clip of another performer or style than the named one: as of values two `NEAR` away."""
SHRINKAGE = 0.1
"""Shrinkage of the correlations: few samples correlate by chance. On left-out samples of three
families, the best shares are 0.1 to 0.4, and the error hardly depends on the share.
"""
REACH = 0.5
"""Standard deviation, in half-ranges, of the weights of clips about a typical one."""
DIGITS = 6
"""Significant digits of controls between captured clips, so that they can be read and requested
again."""


@dataclass(frozen=True)
class ConditionalGaussian:
    """Gaussian fitted to samples, in units of each column's standard deviation.

    mean, deviation: (k,). correlation: (k, k).
    """

    mean: Floats
    deviation: Floats
    correlation: Floats

    def __call__(self, given: Mapping[int, float]) -> Floats:
        """Return the conditional mean row (k,), with the given columns unchanged."""
        known = sorted(given)
        values = np.array([given[column] for column in known])
        away = (values - self.mean[known]) / self.deviation[known]
        among = self.correlation[np.ix_(known, known)]
        apart = self.correlation[:, known] @ np.linalg.solve(among, away)
        row = self.mean + self.deviation * apart
        row[known] = values
        return row


def fit_gaussian(
    samples: Floats, shrunk: float = SHRINKAGE, weights: Floats | None = None
) -> ConditionalGaussian:
    """Return the Gaussian of samples (n, k), with off-diagonal correlations reduced by `shrunk`.

    weights (n,): of the samples; equal if None.
    """
    share = np.full(len(samples), 1.0) if weights is None else weights
    share = share / share.sum()
    mean = share @ samples
    deviation = np.sqrt(share @ np.square(samples - mean))
    deviation[deviation == 0.0] = 1.0
    apart = (samples - mean) / deviation
    correlation = (1.0 - shrunk) * (apart.T * share) @ apart
    # A constant column must neither inform other columns nor make the matrix singular.
    np.fill_diagonal(correlation, 1.0)
    return ConditionalGaussian(mean, deviation, correlation)


class ControlImputer:
    """Choice of a model's controls that a question leaves open."""

    def __init__(self, card: ModelCard) -> None:
        self._controls = card.controls
        self._examples, self._labels = np.array(card.examples), card.clip_labels
        self._label_columns = kriging_model.label_columns(0, card.label_counts)
        self._low, self._high = card.sampled_ranges
        self._scaled = kriging_model.half_ranges(self._examples, self._low, self._high)

    def impute(self, given: Mapping[str, float], labels: Floats) -> dict[str, float]:
        """Return all controls in the card's order, those not given as in a typical captured clip.

        That is the medoid, in the open controls, of the clips near the given ones. labels (1, p):
        weights of names, whose own clips come first; all zero in label sets that are left open.
        """
        open_ = self._open(given)
        row = typical_clip.typical_row(self._scaled[:, open_], self._costs(given, labels))
        return self._complete(given, self._examples[row])

    def near_measures(
        self, given: Mapping[str, float], labels: Floats, seen: Floats, wanted: Floats
    ) -> "LocalImputer":
        """Return the choice of open controls about the captured clip typical for measures too.

        seen (n, m): measured quantities of the captured clips. wanted (m,): their target values.
        """
        open_, deviation = self._open(given), seen.std(axis=0)
        deviation[deviation == 0.0] = 1.0
        away = (seen - wanted) / (NEAR * deviation)
        costs = self._costs(given, labels) + np.sum(np.square(away), axis=1)
        row = typical_clip.typical_row(self._scaled[:, open_], costs)
        near = np.sum(np.square(self._scaled - self._scaled[row])[:, open_], axis=1) / REACH**2
        samples = np.hstack([self._examples, self._labels, seen])
        known = {i: given[c.name] for i, c in enumerate(self._controls) if c.name in given}
        who, first = np.ravel(labels), len(self._controls)
        named = [own for own in self._label_columns if who[own].any()]
        beside = {first + i: float(who[i]) for own in named for i in range(own.start, own.stop)}
        return LocalImputer(
            self._controls,
            self._examples[row],
            fit_gaussian(samples, weights=np.exp(-0.5 * near)),
            known | beside,
            open_,
            (self._low[open_], self._high[open_]),
            typical_clip.neighbourhood(self._scaled[:, open_]),
        )

    def _open(self, given: Mapping[str, float]) -> Booleans:
        return np.array([control.name not in given for control in self._controls])

    def _costs(self, given: Mapping[str, float], labels: Floats) -> Floats:
        """Return the squared distances (n,) of the clips from the given controls, in `NEAR`.

        A control acts as if it were within its limits, so it is near the same clips.
        """
        known = [i for i, control in enumerate(self._controls) if control.name in given]
        acting = np.array(
            [
                answer_bounds.limit_control(self._controls[i], given[self._controls[i].name])
                for i in known
            ]
        )
        place = kriging_model.half_ranges(acting, self._low[known], self._high[known])
        costs = np.sum(np.square((self._scaled[:, known] - place) / NEAR), axis=1)
        weights = np.ravel(labels)
        for own in self._label_columns:
            if weights[own].any():
                costs = costs + OTHER_LABEL * (1.0 - self._labels[:, own] @ weights[own])
        return np.asarray(costs, np.float64)

    def _complete(self, given: Mapping[str, float], row: Floats) -> dict[str, float]:
        """Return all controls: the given ones, the others from a row (d,)."""
        return {
            control.name: given.get(control.name, float(value))
            for control, value in zip(self._controls, row, strict=True)
        }


@dataclass(frozen=True)
class LocalImputer:
    """Choice of open controls about one captured clip, for measured quantities.

    clip: controls (d,) of the captured clip. gaussian: of the clips about it: controls, labels and
    measured quantities. known: values of the given columns. open: controls that are not given (d,).
    ranges: smallest and largest sampled value of each open control. surroundings: of the captured
    clips, in the open controls in half-ranges.
    """

    controls: tuple[Control, ...]
    clip: Floats
    gaussian: ConditionalGaussian
    known: Mapping[int, float]
    open: Booleans
    ranges: tuple[Floats, Floats]
    surroundings: Neighbourhood

    def captured(self) -> dict[str, float]:
        """Return all controls, the open ones as in the captured clip."""
        return self._complete(self.clip)

    def __call__(self, wanted: Floats) -> dict[str, float]:
        """Return all controls, the open ones near the clip for measured quantities (m,).

        The conditional mean of the clips about the typical one, as far as it stays near captured
        clips; a control with few sampled values takes the nearest of them.
        """
        first = len(self.gaussian.mean) - len(wanted)
        beside = {first + i: float(value) for i, value in enumerate(wanted)}
        row = self.gaussian(dict(self.known) | beside)[: len(self.controls)]
        for i, control in enumerate(self.controls):
            if self.open[i] and control.values:
                row[i] = min(control.values, key=lambda value: abs(value - row[i]))
        low, high = self.ranges
        start, end = (
            kriging_model.half_ranges(place[self.open], low, high) for place in (self.clip, row)
        )
        inside = self.surroundings.pull_in(start, end)
        row[self.open] = 0.5 * (inside * (high - low) + low + high)
        return self._complete(row)

    def _complete(self, row: Floats) -> dict[str, float]:
        """Return all controls: the given ones, the others from a row (d,), rounded."""
        return {
            control.name: self.known[i] if i in self.known else _round_and_clip(control, row[i])
            for i, control in enumerate(self.controls)
        }


def _round_and_clip(control: Control, value: float) -> float:
    """Return the value rounded to DIGITS and limited to the sampled range, or a listed value."""
    if control.values:
        return min(control.values, key=lambda one: abs(one - value))
    short = float(f"{value:.{DIGITS}g}")
    return min(max(short, control.minimum), control.maximum)
