"""Question for a crowd: one row per character, validated on construction."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Booleans, Floats, Indices, Singles
from posefield.inference.level_selection import MAX_COORDINATE, LevelCriteria
from posefield.model_file.model_card import PERFORMER, ModelCard
from posefield.motion.crowd_clip import Placement
from posefield.question.motion_question import ExtrapolationPolicy, LabelValue, RootMode
from posefield.validation.label_validation import label_weights

Value = TypeVar("Value")


@dataclass(frozen=True)
class Blending:
    """Transitions between levels: previous levels (N,) and completed shares (N,), 0 to 1."""

    levels: Indices
    shares: Floats


@dataclass(frozen=True)
class LabelColumn:
    """Labels of N characters in one label set.

    values: the distinct names or weights, None where the set is left open. index: (N,), into
    `values`.
    """

    values: tuple[LabelValue | None, ...]
    index: Indices


@dataclass(frozen=True)
class CharacterTakes:
    """Takes of N characters.

    seeds (N,): 0 for the prediction. variety (N,): size of the deviations. detail (N,): whether
    details are added.
    """

    seeds: Indices
    variety: Floats
    detail: Booleans

    @property
    def columns(self) -> dict[str, Indices | Floats]:
        """Return the columns by the names of their fields in a request."""
        return {"take": self.seeds, "variety": self.variety}


@dataclass(frozen=True)
class CrowdQuestion:
    """Question for one pose of each of N characters.

    controls: (N,) by name, in their units. times: (N,), s from the start of each character's clip.
    performers: the distinct performers, None for an unseen performer. performer: (N,), index into
    `performers`. labels: of further label sets. detail: levels of detail (N,), or the view that
    chooses them. extrapolate: policy for controls without similar captured clips. blending:
    transitions between levels, None without. takes: of the characters, None for the predictions.

    Raises InvalidField, with the index of the first character at fault, for columns of different
    lengths, numbers that are not finite, and positions beyond the precision of float32.
    """

    controls: Mapping[str, Floats]
    times: Floats
    placement: Placement
    performers: tuple[str | None, ...]
    performer: Indices
    detail: Indices | LevelCriteria
    root: RootMode
    extrapolate: ExtrapolationPolicy
    blending: "Blending | None" = None
    labels: Mapping[str, LabelColumn] = field(default_factory=dict)
    takes: "CharacterTakes | None" = None

    def __post_init__(self) -> None:
        for name, column in self._columns().items():
            if len(column) != len(self):
                raise InvalidField(name, f"{len(column)} characters, expected {len(self)}")
            _check(name, column, np.isfinite(column), "a finite number")
        near = np.abs(self.placement.positions) <= MAX_COORDINATE
        _check("position", self.placement.positions, near, f"at most {MAX_COORDINATE:g} m")
        if self.blending is not None:
            shares = self.blending.shares
            _check("blend", shares, (shares >= 0.0) & (shares <= 1.0), "0 to 1")

    def __len__(self) -> int:
        return len(self.times)

    def _columns(self) -> dict[str, Floats | Indices]:
        seen = isinstance(self.detail, LevelCriteria)
        levels = self.detail.previous if isinstance(self.detail, LevelCriteria) else self.detail
        own = self.blending
        return {
            **{f"controls/{name}": values for name, values in self.controls.items()},
            "time": self.times,
            "position": self.placement.positions,
            "heading": self.placement.headings,
            "performer": self.performer,
            **{f"labels/{name}": column.index for name, column in self.labels.items()},
            **({} if levels is None else {"previous_level" if seen else "level": levels}),
            **({} if own is None else {"from_level": own.levels, "blend": own.shares}),
            **({} if self.takes is None else self.takes.columns),
        }


def check_levels(question: CrowdQuestion, count: int) -> None:
    """Raise InvalidField for the first character with a level outside 0 to count - 1."""
    if isinstance(question.detail, LevelCriteria):
        field, levels = "previous_level", question.detail.previous
    else:
        field, levels = "level", question.detail
    columns = {field: levels}
    if question.blending is not None:
        columns["from_level"] = question.blending.levels
    for name, column in columns.items():
        if column is not None:
            _check(name, column, (column >= 0) & (column < count), f"0 to {count - 1}")


def labels(question: CrowdQuestion, card: ModelCard) -> Singles:
    """Return the weights (N, p) of the characters' labels; zeros in sets that are left open.

    Raises InvalidField for the first character with an unknown name or invalid weights.
    """
    found = np.zeros((len(question), sum(card.label_counts)), dtype=np.float32)
    if PERFORMER in question.labels and question.performers != (None,):
        raise InvalidField("performer", "given, and labels/performer too, expected one")
    for performer, rows in _distinct(question.performers, question.performer):
        found[rows] += _checked(card, rows, performer, {})
    for name, column in question.labels.items():
        for given, rows in _distinct(column.values, column.index):
            found[rows] += _checked(card, rows, None, {} if given is None else {name: given})
    return found


def _distinct(values: Sequence[Value], index: Indices) -> Iterator[tuple[Value, Indices]]:
    """Yield each of distinct values with the indices of its characters."""
    for place, value in enumerate(values):
        yield value, np.flatnonzero(index == place)


def _checked(
    card: ModelCard, rows: Indices, performer: str | None, named: Mapping[str, LabelValue]
) -> Floats:
    """Return weights (p,); InvalidField with the first of the rows for invalid ones."""
    try:
        return label_weights(card, performer, named)[0]
    except InvalidField as fault:
        raise InvalidField(fault.field, fault.message, int(rows[0])) from fault


def _check(field: str, column: Floats | Indices, good: Booleans, expected: str) -> None:
    """Raise InvalidField for the first character with an entry of `good` (N, ...) that is false."""
    if not good.all():
        first = int(np.argmin(good.reshape(len(column), -1).all(axis=1)))
        raise InvalidField(field, f"{column[first].tolist()}, expected {expected}", first)
