"""Controls that nobody gave: the most typical for those that were, of the captured clips.

Samples are taken for draws of a Gaussian, whose conditional mean is what is typical. Nothing of it
knows what the columns are: controls, and labels of who moved beside them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from service.motion.card import Control, ModelCard
from service.motion.conventions import Floats

SHRUNK = 0.1
"""Share of what columns have in common that is not believed: few samples agree by chance. Left-out
samples of three families are met best at 0.1 to 0.4, and hardly worse at any other share."""
DIGITS = 6
"""What is chosen is a number that people can read and ask for again."""


@dataclass(frozen=True)
class Typical:
    """The Gaussian of samples, in units of each column's deviation.

    mean, deviation (k,), correlation (k, k) of all columns.
    """

    mean: Floats
    deviation: Floats
    correlation: Floats

    def __call__(self, given: Mapping[int, float]) -> Floats:
        """The most typical row (k,) for values of some columns, which stand in it as they are."""
        known = sorted(given)
        values = np.array([given[column] for column in known])
        away = (values - self.mean[known]) / self.deviation[known]
        among = self.correlation[np.ix_(known, known)]
        apart = self.correlation[:, known] @ np.linalg.solve(among, away)
        row = self.mean + self.deviation * apart
        row[known] = values
        return row


def fit(samples: Floats, shrunk: float = SHRUNK) -> Typical:
    """The Gaussian of samples (n, k), a share of what columns have in common left out."""
    mean = samples.mean(axis=0)
    deviation = samples.std(axis=0)
    deviation[deviation == 0.0] = 1.0
    apart = (samples - mean) / deviation
    correlation = (1.0 - shrunk) * (apart.T @ apart) / len(samples)
    # One that never varies is of no use to any other, and no hindrance.
    np.fill_diagonal(correlation, 1.0)
    return Typical(mean, deviation, correlation)


class Chooser:
    """Chooses the controls that a question leaves open, for one model."""

    def __init__(self, card: ModelCard) -> None:
        self._controls = card.controls
        self._samples = np.hstack([np.array(card.examples), card.labels])
        self._typical = fit(self._samples)

    def fill_seen(
        self, given: Mapping[str, float], labels: Floats, seen: Floats, wanted: Floats
    ) -> dict[str, float]:
        """All controls as `fill` has them, the most typical too for something else of which the
        captured clips have values (n, m), and which is wanted to be (m,)."""
        start = self._samples.shape[1]
        typical = fit(np.hstack([self._samples, seen]))
        beside = {start + i: float(value) for i, value in enumerate(wanted)}
        return self._fill(typical, given, labels, beside)

    def fill(self, given: Mapping[str, float], labels: Floats) -> dict[str, float]:
        """All controls, in the card's order: those given, and the most typical of the others for
        them and, where one is named, for the performer of labels (1, p).

        A control of few values takes the nearest sampled one, before the others are chosen; none
        leaves what was sampled.
        """
        return self._fill(self._typical, given, labels, {})

    def _fill(
        self,
        typical: Typical,
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
            control.name: known[i] if i in known else _within(control, row[i])
            for i, control in enumerate(self._controls)
        }


def _nearest(values: Sequence[float], value: float) -> float:
    return min(values, key=lambda one: abs(one - value))


def _within(control: Control, value: float) -> float:
    """The value in few digits, and within what was sampled."""
    short = float(f"{value:.{DIGITS}g}")
    return min(max(short, control.minimum), control.maximum)
