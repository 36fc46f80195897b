"""Choice of the controls that a question leaves open: those of a typical captured clip.

Nothing is averaged over all clips, since a mean may lie between two clusters of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Booleans, Floats
from posefield.inference import session
from posefield.kriging import kriging_model, support
from posefield.kriging.support import NEAR, Neighbourhood
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

    def __call__(self, known_values: Mapping[int, float]) -> Floats:
        """Return the conditional mean row (k,), with the given columns unchanged."""
        indices = sorted(known_values)
        values = np.array([known_values[column] for column in indices])
        away = (values - self.mean[indices]) / self.deviation[indices]
        among = self.correlation[np.ix_(indices, indices)]
        shift = self.correlation[:, indices] @ np.linalg.solve(among, away)
        row = self.mean + self.deviation * shift
        row[indices] = values
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
    deviations = (samples - mean) / deviation
    correlation = (1.0 - shrunk) * (deviations.T * share) @ deviations
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
        self._scaled = support.half_ranges(self._examples, self._low, self._high)

    def impute(self, controls: Mapping[str, float], labels: Floats) -> dict[str, float]:
        """Return all controls in the card's order, those not given as in a typical captured clip.

        That is the medoid, in the open controls, of the clips near the given ones. labels (1, p):
        weights of names, whose own clips come first; all zero in label sets that are left open.
        """
        open_ = np.array([control.name not in controls for control in self._controls])
        row = support.typical_row(self._scaled[:, open_], self._costs(controls, labels))
        return {
            control.name: controls.get(control.name, float(value))
            for control, value in zip(self._controls, self._examples[row], strict=True)
        }

    def near_measures(
        self, controls: Mapping[str, float], labels: Floats, measures: Floats, targets: Floats
    ) -> "LocalImputer":
        """Return the choice of open controls about the captured clip typical for measures too.

        measures (n, m): quantities of the captured clips. targets (m,): their target values.
        """
        deviation = measures.std(axis=0)
        open_ = np.array([control.name not in controls for control in self._controls])
        deviation[deviation == 0.0] = 1.0
        away = (measures - targets) / (NEAR * deviation)
        costs = self._costs(controls, labels) + np.sum(np.square(away), axis=1)
        row = support.typical_row(self._scaled[:, open_], costs)
        near = np.sum(np.square(self._scaled - self._scaled[row])[:, open_], axis=1) / REACH**2
        samples = np.hstack([self._examples, self._labels, measures])
        values = {i: controls[c.name] for i, c in enumerate(self._controls) if c.name in controls}
        weights, first = np.ravel(labels), len(self._controls)
        label_columns = [columns for columns in self._label_columns if weights[columns].any()]
        label_values = {
            first + i: float(weights[i])
            for columns in label_columns
            for i in range(columns.start, columns.stop)
        }
        return LocalImputer(
            self._controls,
            self._examples[row],
            fit_gaussian(samples, weights=np.exp(-0.5 * near)),
            values | label_values,
            open_,
            (self._low[open_], self._high[open_]),
            support.neighbourhood(self._scaled[:, open_]),
        )

    def _costs(self, controls: Mapping[str, float], labels: Floats) -> Floats:
        """Return the squared distances (n,) of the clips from the given controls, in `NEAR`.

        A control acts as if it were within its limits, so it is near the same clips.
        """
        indices = [i for i, control in enumerate(self._controls) if control.name in controls]
        acting = np.array(
            [
                session.limit_control(self._controls[i], controls[self._controls[i].name])
                for i in indices
            ]
        )
        scaled = support.half_ranges(acting, self._low[indices], self._high[indices])
        costs = np.sum(np.square((self._scaled[:, indices] - scaled) / NEAR), axis=1)
        weights = np.ravel(labels)
        for columns in self._label_columns:
            if weights[columns].any():
                costs = costs + OTHER_LABEL * (1.0 - self._labels[:, columns] @ weights[columns])
        return np.asarray(costs, np.float64)


@dataclass(frozen=True)
class LocalImputer:
    """Choice of open controls about one captured clip, for measured quantities.

    clip: controls (d,) of the captured clip. gaussian: of the clips about it: controls, labels and
    measured quantities. values: of the given columns. open: controls that are not given (d,).
    ranges: smallest and largest sampled value of each open control. surroundings: of the captured
    clips, in the open controls in half-ranges.
    """

    controls: tuple[Control, ...]
    clip: Floats
    gaussian: ConditionalGaussian
    values: Mapping[int, float]
    open: Booleans
    ranges: tuple[Floats, Floats]
    surroundings: Neighbourhood

    def captured(self) -> dict[str, float]:
        """Return all controls, the open ones as in the captured clip."""
        return self._complete(self.clip)

    def __call__(self, targets: Floats) -> dict[str, float]:
        """Return all controls, the open ones near the clip for measured quantities (m,).

        The conditional mean of the clips about the typical one, as far as it stays near captured
        clips; a control with few sampled values takes the nearest of them.
        """
        first = len(self.gaussian.mean) - len(targets)
        measures = {first + i: float(value) for i, value in enumerate(targets)}
        row = self.gaussian(dict(self.values) | measures)[: len(self.controls)]
        for i, control in enumerate(self.controls):
            if self.open[i] and control.values:
                row[i] = min(control.values, key=lambda value: abs(value - row[i]))
        low, high = self.ranges
        start, end = (
            support.half_ranges(point[self.open], low, high) for point in (self.clip, row)
        )
        inside = self.surroundings.pull_in(start, end)
        row[self.open] = 0.5 * (inside * (high - low) + low + high)
        return self._complete(row)

    def _complete(self, row: Floats) -> dict[str, float]:
        """Return all controls: the given ones, the others from a row (d,), rounded."""
        return {
            control.name: self.values[i] if i in self.values else _round_and_clip(control, row[i])
            for i, control in enumerate(self.controls)
        }


def _round_and_clip(control: Control, value: float) -> float:
    """Return the value rounded to DIGITS and limited to the sampled range, or a listed value."""
    if control.values:
        return min(control.values, key=lambda one: abs(one - value))
    short = float(f"{value:.{DIGITS}g}")
    return min(max(short, control.minimum), control.maximum)
