"""Gait of a cyclic model: controls and labels of walkers for speeds and rates of turning.

Names and units of controls are the recipe's, so their effect is measured on the model's own clips.
Without a request each walker has one of the captured combinations of labels. A label set that a
request gives has the same name or weights for all walkers; the names in the other sets, the usual
speed and the usual controls are those of a captured combination that is drawn for each walker.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from posefield.common.errors import InvalidField
from posefield.common.units import (
    Floats,
    Indices,
    PerCharacter,
    PerClip,
    PerPoint,
    PointControls,
    Scalars,
)
from posefield.inference.session import Session
from posefield.locomotion import stride
from posefield.model_file.model_card import PERFORMER, ModelCard
from posefield.question.motion_question import LabelValue
from posefield.validation.question_validation import label_weights


@dataclass(frozen=True)
class WalkerLabels:
    """Labels of walkers by combination, the index in `stride.label_rows`; -1 without label sets.

    rows: names of each combination by label set. weights: (K + 1, p), of all labels for each
    combination, zeros at the end. asked: name or weights by label set of the request. shares: (K,),
    share of the walkers with each combination; None for equal shares.
    """

    rows: tuple[Mapping[str, str], ...]
    weights: Annotated[Floats, "rows labels"]
    asked: Mapping[str, LabelValue] = field(default_factory=dict)
    shares: Annotated[Floats, "combinations"] | None = None

    def draw(self, numbers: PerCharacter) -> Annotated[Indices, "characters"]:
        """Return the combinations (N,) of random numbers (N,) from 0 to less than 1."""
        if not self.rows:
            return np.full(len(numbers), -1)
        if self.shares is None:
            return (numbers * len(self.rows)).astype(np.int64)
        cumulative = np.cumsum(self.shares)
        indices = np.searchsorted(cumulative, numbers * cumulative[-1], side="right")
        # The product may round up to the last end.
        return np.minimum(indices, np.flatnonzero(self.shares)[-1])

    def facts(self, combinations: Annotated[Indices, "characters"]) -> dict[str, Any]:
        """Return the performer of each walker, None for none, and its labels in further sets.

        A mixture of performers is among the labels.
        """
        sets = [*self.rows[0]] if self.rows else []
        labels = {
            name: [self._label(name, int(combination)) for combination in combinations]
            for name in sets
        }
        performers: list[Any] = [None] * len(combinations)
        if isinstance(self.asked.get(PERFORMER, ""), str):
            performers = labels.pop(PERFORMER, performers)
        return {"performers": performers} | ({"labels": labels} if labels else {})

    def _label(self, name: str, combination: int) -> LabelValue:
        return self.asked.get(name, self.rows[combination][name])


def captured_labels(card: ModelCard) -> WalkerLabels:
    """Return the captured combinations of labels, in equal shares."""
    rows = stride.label_rows(card)
    return WalkerLabels(tuple(rows), stride.label_table(card))


def requested_labels(card: ModelCard, request: Mapping[str, LabelValue]) -> WalkerLabels:
    """Return the captured combinations with the labels of a request in their sets.

    The share of a combination is the product of the requested weights of its names, or their sum
    where no captured combination has names of all requested sets. Raises InvalidField for a label
    that the model does not have, and for invalid weights.
    """
    requested_weights = label_weights(card, None, request)[0]
    captured = captured_labels(card)
    if not request:
        return captured
    weights, set_shares, first = captured.weights.copy(), [], 0
    for label_set in card.labels:
        columns = slice(first, first + len(label_set.names))
        if label_set.name in request:
            weights[:-1, columns] = requested_weights[columns]
            shares = dict(zip(label_set.names, requested_weights[columns].tolist(), strict=True))
            set_shares.append(np.array([shares[row[label_set.name]] for row in captured.rows]))
        first = columns.stop
    return WalkerLabels(captured.rows, weights, request, combination_shares(np.array(set_shares)))


def combination_shares(
    set_shares: Annotated[Floats, "sets combinations"],
) -> Annotated[Floats, "combinations"]:
    """Return the shares (K,) of combinations.

    set_shares: (S, K), requested weight of each combination's name in each requested set. Shares
    are the products over the sets, or the sums where all products are zero.
    """
    together = set_shares.prod(axis=0)
    return together if together.any() else set_shares.sum(axis=0)


# Tolerance for the rounding of points on an edge, m/s and rad/s.
SLACK = 1e-6


@dataclass(frozen=True)
class GaitRegion:
    """Convex region of speeds, m/s, and rates of turning, rad/s.

    normals: (E, 2) and limits: (E,); a pair is inside where normals times it are at most the
    limits. speeds: the smallest and the largest.
    """

    normals: Annotated[Floats, "edges 2"]
    limits: Annotated[Floats, "edges"]
    speeds: tuple[float, float]

    def contains(
        self, speeds: Scalars, turning: Scalars
    ) -> Annotated[npt.NDArray[np.bool_], "*batch"]:
        """Return whether pairs (...) are inside the region."""
        pairs = np.stack(np.broadcast_arrays(speeds, turning), axis=-1)
        return np.all(pairs @ self.normals.T <= self.limits + SLACK, axis=-1)

    def turning(
        self, speeds: Annotated[Floats, "*batch"]
    ) -> tuple[Annotated[Floats, "*batch"], Annotated[Floats, "*batch"]]:
        """Return the smallest and the largest rate of turning (...), rad/s, at speeds (...)."""
        right, left = self.normals[:, 1] < 0.0, self.normals[:, 1] > 0.0
        return self._edge_rates(speeds, right).max(axis=-1), self._edge_rates(speeds, left).min(
            axis=-1
        )

    def _edge_rates(
        self, speeds: Annotated[Floats, "*batch"], edges: npt.NDArray[np.bool_]
    ) -> Annotated[Floats, "*batch some"]:
        """Return the rates of turning (..., E) at which the edges lie at speeds (...)."""
        along, across = self.normals[edges].T
        return (self.limits[edges] - speeds[..., None] * along) / across


def convex_hull(pairs: Annotated[Floats, "pairs 2"]) -> GaitRegion:
    """Return the convex hull of pairs (N, 2) of speed and rate of turning."""
    ordered = np.unique(pairs, axis=0)
    # Counter-clockwise (Andrew's monotone chain).
    corners = np.array([*_chain(ordered)[:-1], *_chain(ordered[::-1])[:-1]])
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    limits = np.sum(normals * corners, axis=1)
    return GaitRegion(normals, limits, (float(pairs[:, 0].min()), float(pairs[:, 0].max())))


def _chain(ordered: Annotated[Floats, "pairs 2"]) -> list[Annotated[Floats, "2"]]:
    chain: list[Floats] = []
    for point in ordered:
        while len(chain) > 1 and _area(chain[-2], chain[-1], point) <= 0.0:
            chain.pop()
        chain.append(point)
    return chain


def _area(a: Annotated[Floats, "2"], b: Annotated[Floats, "2"], c: Annotated[Floats, "2"]) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


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

    def with_labels(self, request: Mapping[str, LabelValue]) -> "Gait":
        """Return the gait of walkers with requested labels, by label set.

        Raises InvalidField for a label that the model does not have, and for invalid weights.
        """
        return replace(self, labels=requested_labels(self.session.card, request))

    def mean_controls(
        self, speeds: PerPoint, turning: PerPoint, combinations: Annotated[Indices, "points"]
    ) -> PointControls:
        """Return the conditional mean of the controls (K, d) at given rates.

        speeds: (K,), m/s. turning: (K,), rad/s. combinations: labels (K,) by index in
        `stride.label_rows`, -1 for open ones. The mean is a linear regression over the captured
        clips, which also determines controls that do not affect speed or turning, such as the
        stride length.
        """
        return _design_matrix(speeds, turning) @ self.slopes + self.performer_offsets[combinations]

    def controls(
        self, speeds: PerPoint, turning: PerPoint, combinations: Annotated[Indices, "points"]
    ) -> PointControls:
        """Return the controls (K, d), along the regression, that lead to these rates."""
        labels = stride.RowLabels(self.labels.weights, combinations)
        speed, turn = speeds, turning
        for _ in range(ITERATIONS):
            done = stride.strides(
                self.session, self.mean_controls(speed, turn, combinations), labels
            )
            speed, turn = speed + speeds - done.speeds, turn + turning - done.turning
        return self.mean_controls(speed, turn, combinations)


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
    combinations = stride.clip_performers(card)
    cycles = stride.strides(session, controls, stride.labels(session, combinations))
    rates = np.column_stack([cycles.speeds, cycles.turning])
    _check_speeds(card.name, rates[:, 0])
    slopes = np.linalg.lstsq(_design_matrix(*rates.T), controls, rcond=None)[0]
    manners = mean_residuals(
        controls - _design_matrix(*rates.T) @ slopes, combinations, len(stride.label_rows(card))
    )
    # With straight walking at the slowest and the fastest speed: a stride cut from a straight walk
    # turns by a few degrees, which is no lower bound of the turning.
    speed_range = np.array([rates[:, 0].min(), rates[:, 0].max()])
    region = convex_hull(np.vstack([rates, np.column_stack([speed_range, np.zeros(2)])]))
    return Gait(session, rates, slopes, manners, region, captured_labels(card))


def _check_speeds(name: str, speeds: PerClip) -> None:
    low, high = speeds.min(), speeds.max()
    if low < MIN_SPEED or high - low < MIN_SPEED:
        raise InvalidField(
            "model",
            f"{name} goes {low:.3f} to {high:.3f} m/s, expected one that travels at several speeds",
        )


def _design_matrix(speeds: PerPoint, turning: PerPoint) -> Annotated[Floats, "points 3"]:
    return np.column_stack([np.ones(len(speeds)), speeds, turning])


def mean_residuals(
    residuals: Annotated[Floats, "clips controls"],
    combinations: Annotated[Indices, "clips"],
    performers: int,
) -> Annotated[Floats, "{performers}+1 controls"]:
    """Return the mean residuals (p + 1, d) of performers, with zeros at the end.

    Each mean is shrunk by one additional clip with a residual of zero.
    """
    theirs = np.arange(performers)[:, None] == combinations
    means = theirs @ residuals / (theirs.sum(axis=1, keepdims=True) + 1.0)
    return np.vstack([means, np.zeros(residuals.shape[1])])
