"""Vectorised validation of many rows; it may reject valid rows, but never accepts invalid ones.

Rejected rows are validated one by one by `clips.check`, which names the fault.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from posefield.batch.rows.columns import CONTROL_PREFIX, LABEL_PREFIX
from posefield.common.units import Floats
from posefield.kriging import random_field
from posefield.kriging.support import Support
from posefield.model_file.model_card import PERFORMER, ModelCard
from posefield.question.motion_question import CONSTRAINING, MAX_TAKE, ClipQuestion
from posefield.synthesis import frame_times
from posefield.validation import input_limits

Values = Mapping[str, Sequence[Any]]


def all_valid(card: ModelCard, support: Support, values: Values, usual: ClipQuestion) -> bool:
    """Return whether all rows are valid; false if one needs validation by itself.

    values: by field. usual: defaults of missing values.
    """
    return (
        _controls_valid(card, support, values, usual)
        and _within(_column(values, "level", usual.level), 0, len(card.levels) - 1)
        and _within(_column(values, "fps", usual.fps), *frame_times.FPS_RANGE)
        and _window_valid(card, values, usual)
        and _loops_valid(card, values, usual)
        and _constraints_valid(values)
        and _takes_valid(card, values, usual)
        and _labels_valid(card, values, usual)
        and (bool(card.roles) or {*values.get("names", ()), usual.names} <= {"own", None})
    )


def _controls_valid(card: ModelCard, support: Support, values: Values, usual: ClipQuestion) -> bool:
    strict = "refuse" in values.get("extrapolate", ()) or usual.extrapolate == "refuse"
    allowed = input_limits.sampled_range if strict else input_limits.accepted_range
    columns = [np.asarray(values[CONTROL_PREFIX + control.name]) for control in card.controls]
    pairs = zip(columns, card.controls, strict=True)
    if not all(_within(column, *allowed(control)) for column, control in pairs):
        return False
    return not strict or bool(support.supported(np.stack(columns, axis=1)).all())


def _labels_valid(card: ModelCard, values: Values, usual: ClipQuestion) -> bool:
    """Return whether all labels are names; weights and a mixture of performers need validation.

    The names of columns are known ones already.
    """
    known = {own.name: own.names for own in card.labels if own.name != PERFORMER}
    cells = [cell for field in values if field.startswith(LABEL_PREFIX) for cell in values[field]]
    plain = all(cell is None or isinstance(cell, str) for cell in cells)
    return plain and all(label in known.get(name, ()) for name, label in usual.labels.items())


def _window_valid(card: ModelCard, values: Values, usual: ClipQuestion) -> bool:
    longest = input_limits.duration_range(card)[1]
    start = _column(values, "start", usual.start)
    last = _column(values, "end", longest if usual.end is None else usual.end)
    return (
        _within(start, 0.0, math.inf)
        and _within(last, 0.0, longest)
        and bool(np.all(start <= last))
    )


def _loops_valid(card: ModelCard, values: Values, usual: ClipQuestion) -> bool:
    loops = _column(values, "loop", usual.loop) > 0.0
    if not loops.any():
        return True
    whole = _column(values, "start", usual.start) <= 0.0
    last = _column(values, "end", math.inf if usual.end is None else usual.end) == math.inf
    return card.cyclic and bool(np.all(~loops | (whole & last)))


def _constraints_valid(values: Values) -> bool:
    """Return whether no row has constraints that need validation by themselves.

    The defaults have been validated before.
    """
    plain = {"auto", "none", None}.issuperset(values.get("exact", ()))
    return plain and not any(any(values.get(name, ())) for name in CONSTRAINING)


def _takes_valid(card: ModelCard, values: Values, usual: ClipQuestion) -> bool:
    seeds = _column(values, "take", usual.take)
    drawn = random_field.has_features(card.kriging) or not seeds.any()
    variety = _column(values, "variety", usual.variety)
    return drawn and _within(seeds, 0, MAX_TAKE) and _within(variety, 0.0, 1.0)


def _column(values: Values, field: str, usual: float) -> Floats:
    """Return the numbers of a field (n,), or its default (1,) where no row has a value."""
    said = values.get(field, (None,))
    return np.array([usual if value is None else value for value in said], dtype=float)


def _within(numbers: Floats, low: float, high: float) -> bool:
    """Return whether all numbers are from `low` to `high`; false for NaN."""
    return bool(np.all((numbers >= low) & (numbers <= high)))
