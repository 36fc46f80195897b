"""Gait of a cyclic model: controls for speeds and rates of turning.

Names and units of controls are the recipe's, so their effect is measured on the model's own clips:
speed and rate of turning.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerClip, PerPoint, PointControls
from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.inference.session import Session
from posefield.locomotion import gait_region, stride, walker_labels
from posefield.locomotion.gait_region import GaitRegion
from posefield.locomotion.walker_labels import WalkerLabels
from posefield.question.motion_question import LabelValue

# A lower speed does not count as travel, and speeds closer than this count as equal, m/s.
MIN_SPEED = 0.05
# Iterations that correct the requested rates by the resulting ones.
ITERATIONS = 3


@dataclass(frozen=True)
class Gait:
    """Relation between the controls of a model and the rates at which it walks.

    rates: (N, 2), speed, m/s, and rate of turning, rad/s, of each captured clip as the model
    synthesises it. slopes: (3, d), regression of controls on 1 and rates. performer_offsets: (p +
    1, d), mean residual of each performer; zeros at the end, for an unseen performer. region:
    convex hull of the rates, extended by walking straight at all speeds. labels: of walkers.
    """

    session: Session
    rates: Annotated[Floats, "clips 2"]
    slopes: Annotated[Floats, "3 controls"]
    performer_offsets: Annotated[Floats, "offsets controls"]
    region: GaitRegion
    labels: WalkerLabels

    def with_labels(self, asked: Mapping[str, LabelValue]) -> "Gait":
        """Return the gait of walkers with requested labels, by label set.

        Raises InvalidField for a label that the model does not have, and for invalid weights.
        """
        return replace(self, labels=walker_labels.requested_labels(self.session.card, asked))

    def mean_controls(
        self, speeds: PerPoint, turning: PerPoint, who: Annotated[Indices, "points"]
    ) -> PointControls:
        """Return the conditional mean of the controls (K, d) at given rates.

        speeds: (K,), m/s. turning: (K,), rad/s. who: labels (K,) by index in `stride.label_rows`,
        -1 for open ones. The mean is a linear regression over the captured clips, which also
        determines controls that do not affect speed or turning, such as the stride length.
        """
        return _design_matrix(speeds, turning) @ self.slopes + self.performer_offsets[who]

    def controls(
        self, speeds: PerPoint, turning: PerPoint, who: Annotated[Indices, "points"]
    ) -> PointControls:
        """Return the controls (K, d), along the regression, that lead to these rates."""
        labels = stride.RowLabels(self.labels.weights, who)
        speed, turn = speeds, turning
        for _ in range(ITERATIONS):
            done = stride.strides(self.session, self.mean_controls(speed, turn, who), labels)
            speed, turn = speed + speeds - done.speeds, turn + turning - done.turning
        return self.mean_controls(speed, turn, who)


def fit_gait(session: Session) -> Gait:
    """Return the gait of a model.

    Raises InvalidField if it is not cyclic, stays in place or has one speed.
    """
    card = session.card
    if not card.cyclic:
        raise InvalidField("model", f"{card.name} is no cycle, expected one that can be repeated")
    if card.root != "travelling":
        raise InvalidField("model", f"{card.name} stays in place, expected one that travels")
    controls = np.array(card.examples)
    who = stride.clip_performers(card)
    own = stride.strides(session, controls, stride.labels(session, who))
    rates = np.column_stack([own.speeds, own.turning])
    _check_speeds(card.name, rates[:, 0])
    slopes = np.linalg.lstsq(_design_matrix(*rates.T), controls, rcond=None)[0]
    manners = mean_residuals(
        controls - _design_matrix(*rates.T) @ slopes, who, len(stride.label_rows(card))
    )
    region = gait_region.convex_hull(_add_straight_rates(rates))
    return Gait(session, rates, slopes, manners, region, walker_labels.captured_labels(card))


def _check_speeds(name: str, speeds: PerClip) -> None:
    low, high = speeds.min(), speeds.max()
    if low < MIN_SPEED or high - low < MIN_SPEED:
        raise InvalidField(
            "model",
            f"{name} goes {low:.3f} to {high:.3f} m/s, expected one that travels at several speeds",
        )


def _add_straight_rates(rates: Annotated[Floats, "clips 2"]) -> Annotated[Floats, "clips+2 2"]:
    """Return the rates with straight walking added at the slowest and the fastest speed.

    A stride cut from a straight walk turns by a few degrees, which is no lower bound of the
    turning.
    """
    ends = np.array([rates[:, 0].min(), rates[:, 0].max()])
    return np.vstack([rates, np.column_stack([ends, np.zeros(2)])])


def _design_matrix(speeds: PerPoint, turning: PerPoint) -> Annotated[Floats, "points 3"]:
    return np.column_stack([np.ones(len(speeds)), speeds, turning])


def mean_residuals(
    residuals: Annotated[Floats, "clips controls"],
    who: Annotated[Indices, "clips"],
    performers: int,
) -> Annotated[Floats, "{performers}+1 controls"]:
    """Return the mean residuals (p + 1, d) of performers, with zeros at the end.

    Each mean is shrunk by one additional clip with a residual of zero.
    """
    theirs = np.arange(performers)[:, None] == who
    means = theirs @ residuals / (theirs.sum(axis=1, keepdims=True) + 1.0)
    return np.vstack([means, np.zeros(residuals.shape[1])])
