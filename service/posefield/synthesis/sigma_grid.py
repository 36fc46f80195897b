"""Sigma and support on a grid of two controls."""

from collections.abc import Mapping

import numpy as np

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.common.name_suggestion import did_you_mean
from posefield.common.units import Booleans, Floats, Singles
from posefield.model_file.model_card import ModelCard
from posefield.question.model_question import SigmaQuestion
from posefield.question.results import GridAxis, SigmaGrid
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation import question_validation

# Larger batches exceed a core's cache between operators and take 1.5 times as long per row.
BATCH = 1024


def grid(model: Synthesizer, asked: SigmaQuestion) -> SigmaGrid:
    """Return the grid of sigma and support.

    Raises InvalidField for an unknown control or label, and for a value too far outside the
    sampled range.
    """
    card = model.session.card
    question_validation.check_names(card, asked.controls)
    labels = question_validation.label_weights(card, asked.performer, asked.labels)
    across = _axis(card, "across", asked.across, asked.columns, asked)
    along = _axis(card, "along", asked.along, asked.rows, asked)
    fixed = _fixed(card, asked)
    points = _points(card, across, along, fixed)
    sigma = _sigmas(model, points, labels)
    shape = asked.rows, asked.columns
    return SigmaGrid(
        model.identity,
        across,
        along,
        fixed,
        asked.performer,
        sigma.reshape(shape),
        _inside(card, points).reshape(shape),
        model.validator.support.supported(points).reshape(shape),
        asked.labels,
    )


def _sigmas(model: Synthesizer, points: Floats, labels: Floats) -> Singles:
    """Return sigma (B,), m, at points (B, d)."""
    found = []
    for first in range(0, len(points), BATCH):
        cancellation.check()
        found.append(model.session.sigmas(points[first : first + BATCH], labels))
    return np.concatenate(found)


def _axis(card: ModelCard, field: str, name: str, count: int, asked: SigmaQuestion) -> GridAxis:
    control = card.control(name)
    if control is None:
        own = [c.name for c in card.controls]
        found = f"{name!r}{did_you_mean(name, own)}"
        raise InvalidField(
            field, f"{found}, expected one of this model's controls, {', '.join(own)}"
        )
    if name in asked.controls:
        raise InvalidField(f"controls/{name}", f"given, and {field} the grid too; expected one")
    room = asked.margin * (control.maximum - control.minimum)
    return GridAxis(control, np.linspace(control.minimum - room, control.maximum + room, count))


def _fixed(card: ModelCard, asked: SigmaQuestion) -> dict[str, float]:
    """Return the values of the controls that are not axes, in the card's order."""
    usual = {control.name: control.default for control in card.controls} | dict(asked.controls)
    return {
        control.name: question_validation.check_control(control, usual[control.name])
        for control in card.controls
        if control.name not in (asked.across, asked.along)
    }


def _points(
    card: ModelCard, across: GridAxis, along: GridAxis, fixed: Mapping[str, float]
) -> Floats:
    """Return the controls (R C, d) of the grid points in the card's order, row by row."""
    right, up = np.meshgrid(across.values, along.values)
    columns = {across.control.name: right.ravel(), along.control.name: up.ravel()}
    full = (columns.get(c.name, np.full(right.size, fixed.get(c.name))) for c in card.controls)
    return np.stack(list(full), axis=1)


def _inside(card: ModelCard, points: Floats) -> Booleans:
    low, high = np.transpose(
        [question_validation.sampled_range(control) for control in card.controls]
    )
    return np.all((points >= low) & (points <= high), axis=1)
