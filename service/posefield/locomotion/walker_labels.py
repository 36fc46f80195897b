"""Labels of walkers: the captured combinations, and those that a request names.

Without a request each walker has one of the captured combinations of labels. A label set that a
request gives has the same name or weights for all walkers; the names in the other sets, the usual
speed and the usual controls are those of a captured combination that is drawn for each walker.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from posefield.common.array_shapes import PerCharacter
from posefield.common.units import Floats, Indices
from posefield.locomotion import stride
from posefield.model_file.model_card import PERFORMER, LabelSet, ModelCard
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
        ends = np.cumsum(self.shares)
        found = np.searchsorted(ends, numbers * ends[-1], side="right")
        # The product may round up to the last end.
        return np.minimum(found, np.flatnonzero(self.shares)[-1])

    def facts(self, who: Annotated[Indices, "characters"]) -> dict[str, Any]:
        """Return the performer of each walker, None for none, and its labels in further sets.

        A mixture of performers is among the labels.
        """
        sets = [*self.rows[0]] if self.rows else []
        found = {name: [self._label(name, int(each)) for each in who] for name in sets}
        performers: list[Any] = [None] * len(who)
        if isinstance(self.asked.get(PERFORMER, ""), str):
            performers = found.pop(PERFORMER, performers)
        return {"performers": performers} | ({"labels": found} if found else {})

    def _label(self, name: str, who: int) -> LabelValue:
        return self.asked.get(name, self.rows[who][name])


def captured_labels(card: ModelCard) -> WalkerLabels:
    """Return the captured combinations of labels, in equal shares."""
    rows = stride.label_rows(card)
    return WalkerLabels(tuple(rows), stride.label_table(card))


def requested_labels(card: ModelCard, asked: Mapping[str, LabelValue]) -> WalkerLabels:
    """Return the captured combinations with the labels of a request in their sets.

    The share of a combination is the product of the requested weights of its names, or their sum
    where no captured combination has names of all requested sets. Raises InvalidField for a label
    that the model does not have, and for invalid weights.
    """
    given = label_weights(card, None, asked)[0]
    own = captured_labels(card)
    if not asked:
        return own
    weights, parts, first = own.weights.copy(), [], 0
    for each in card.labels:
        columns = slice(first, first + len(each.names))
        if each.name in asked:
            weights[:-1, columns] = given[columns]
            parts.append(_row_weights(own, each, given[columns]))
        first = columns.stop
    return WalkerLabels(own.rows, weights, asked, combination_shares(np.array(parts)))


def _row_weights(
    own: WalkerLabels, label_set: LabelSet, given: Annotated[Floats, "names"]
) -> Annotated[Floats, "combinations"]:
    """Return the requested weight of each combination's name in a label set."""
    weights = dict(zip(label_set.names, given.tolist(), strict=True))
    return np.array([weights[row[label_set.name]] for row in own.rows])


def combination_shares(
    parts: Annotated[Floats, "sets combinations"],
) -> Annotated[Floats, "combinations"]:
    """Return the shares (K,) of combinations.

    parts: (S, K), requested weight of each combination's name in each requested set. Shares are the
    products over the sets, or the sums where all products are zero.
    """
    together = parts.prod(axis=0)
    return together if together.any() else parts.sum(axis=0)
