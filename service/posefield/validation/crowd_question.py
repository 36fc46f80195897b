"""Question for a crowd: one row per character, validated on construction."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.name_suggestion import did_you_mean
from posefield.common.units import Booleans, Floats, Indices, Singles
from posefield.inference.level_selection import MAX_COORDINATE, LevelCriteria
from posefield.motion.crowd_clip import Placement
from posefield.question.motion_question import ExtrapolationPolicy, RootMode
from posefield.validation import input_limits


@dataclass(frozen=True)
class Blending:
    """Transitions between levels: previous levels (N,) and completed shares (N,), 0 to 1."""

    levels: Indices
    shares: Floats


@dataclass(frozen=True)
class CrowdQuestion:
    """Question for one pose of each of N characters.

    controls: (N,) by name, in their units. times: (N,), s from the start of each character's clip.
    performers: the distinct performers, None for an unseen performer. performer: (N,), index into
    `performers`. detail: levels of detail (N,), or the view that chooses them. extrapolate: policy
    for controls without similar captured clips. blending: transitions between levels, None without.

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

    def __post_init__(self) -> None:
        for field, column in self._columns().items():
            if len(column) != len(self):
                raise InvalidField(field, f"{len(column)} characters, expected {len(self)}")
            _check(field, column, np.isfinite(column), "a finite number")
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
            **({} if levels is None else {"previous_level" if seen else "level": levels}),
            **({} if own is None else {"from_level": own.levels, "blend": own.shares}),
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


def labels(question: CrowdQuestion, known: tuple[str, ...]) -> Singles:
    """Return the labels (N, p) of the characters' performers; zeros for an unseen performer.

    known: performers of the model. Raises InvalidField for the first character with an unknown
    performer.
    """
    for index, name in enumerate(question.performers):
        if name is not None and name not in known:
            first = int(np.argmax(question.performer == index))
            hint = did_you_mean(name, known)
            raise InvalidField(
                "performer", f"{name!r}{hint}, expected {input_limits.accepted_names(known)}", first
            )
    rows = [[name == other for other in known] for name in question.performers]
    return np.array(rows, dtype=np.float32)[question.performer]


def _check(field: str, column: Floats | Indices, good: Booleans, expected: str) -> None:
    """Raise InvalidField for the first character with an entry of `good` (N, ...) that is false."""
    bad = np.flatnonzero(~good.reshape(len(column), -1).all(axis=1))
    if len(bad):
        first = int(bad[0])
        raise InvalidField(field, f"{column[first].tolist()}, expected {expected}", first)
