"""Imputation of controls by the conditional mean of a Gaussian fitted to the captured clips.

The columns are the controls and the performer labels; the fit does not distinguish them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.model_file.model_card import Control, ModelCard

SHRINKAGE = 0.1
"""Shrinkage of the correlations: few samples correlate by chance. On left-out samples of three
families, the best shares are 0.1 to 0.4, and the error hardly depends on the share.
"""
DIGITS = 6
"""Significant digits of imputed controls, so that they can be read and requested again."""


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


def fit_gaussian(samples: Floats, shrunk: float = SHRINKAGE) -> ConditionalGaussian:
    """Return the Gaussian of samples (n, k), with off-diagonal correlations reduced by `shrunk`."""
    mean = samples.mean(axis=0)
    deviation = samples.std(axis=0)
    deviation[deviation == 0.0] = 1.0
    apart = (samples - mean) / deviation
    correlation = (1.0 - shrunk) * (apart.T @ apart) / len(samples)
    # A constant column must neither inform other columns nor make the matrix singular.
    np.fill_diagonal(correlation, 1.0)
    return ConditionalGaussian(mean, deviation, correlation)


class ControlImputer:
    """Imputation of a model's controls that a question leaves open."""

    def __init__(self, card: ModelCard) -> None:
        self._controls = card.controls
        self._samples = np.hstack([np.array(card.examples), card.labels])
        self._gaussian = fit_gaussian(self._samples)

    def impute_with_measures(
        self, given: Mapping[str, float], labels: Floats, seen: Floats, wanted: Floats
    ) -> dict[str, float]:
        """Return all controls as `impute` does, conditional also on further measured quantities.

        seen: their values for the captured clips (n, m). wanted: their target values (m,).
        """
        start = self._samples.shape[1]
        typical = fit_gaussian(np.hstack([self._samples, seen]))
        beside = {start + i: float(value) for i, value in enumerate(wanted)}
        return self._impute(typical, given, labels, beside)

    def impute(self, given: Mapping[str, float], labels: Floats) -> dict[str, float]:
        """Return all controls in the card's order, those not given as their conditional mean.

        labels (1, p): of the performer, on whom the mean is conditional as well; all zero for none.
        A discrete control takes the nearest sampled value before the others are computed; every
        imputed control is limited to its sampled range.
        """
        return self._impute(self._gaussian, given, labels, {})

    def _impute(
        self,
        typical: ConditionalGaussian,
        given: Mapping[str, float],
        labels: Floats,
        beside: dict[int, float],
    ) -> dict[str, float]:
        known = {i: given[c.name] for i, c in enumerate(self._controls) if c.name in given}
        who = np.ravel(labels)
        if who.any():
            beside = beside | {len(self._controls) + i: label for i, label in enumerate(who)}
        steps = [i for i, c in enumerate(self._controls) if i not in known and c.values]
        row = typical(known | beside)
        known |= {i: _nearest(self._controls[i].values, row[i]) for i in steps}
        row = typical(known | beside)
        return {
            control.name: known[i] if i in known else _round_and_clip(control, row[i])
            for i, control in enumerate(self._controls)
        }


def _nearest(values: Sequence[float], value: float) -> float:
    return min(values, key=lambda one: abs(one - value))


def _round_and_clip(control: Control, value: float) -> float:
    """Return the value rounded to DIGITS and limited to the sampled range."""
    short = float(f"{value:.{DIGITS}g}")
    return min(max(short, control.minimum), control.maximum)
