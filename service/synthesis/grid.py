"""How far answers may be trusted over two controls: sigma and support on a grid of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from service.motion.answer import Axis, SigmaGrid
from service.motion.card import ModelCard
from service.motion.conventions import Floats, Truths
from service.motion.errors import InvalidField
from service.synthesis import door, limits
from service.synthesis.synthesizer import Synthesizer

STEPS = 32
WIDEST = 1.0
"""Shares of a control's range that a grid may go beyond it on either side."""
FEWEST, MOST = 2, 1024
# More rows in a call leave a core's cache between one operator and the next: half as much again.
BATCH = 1024


@dataclass(frozen=True)
class GridQuestion:
    """Which grid: `columns` values of the control `across` by `rows` of the control `along`.

    controls: values of the others, of which those not given are at the card's default. performer:
    who moves, nobody that was seen for none. margin: share of a control's sampled range by which
    the grid goes beyond it on either side.
    """

    across: str
    along: str
    columns: int
    rows: int
    controls: Mapping[str, float]
    performer: str | None
    margin: float

    def __post_init__(self) -> None:
        if self.across == self.along:
            raise InvalidField("along", f"{self.along!r}, expected another control than across")
        for name in ("columns", "rows"):
            limits.within(name, getattr(self, name), FEWEST, MOST, "values")
        limits.within("margin", self.margin, 0.0, WIDEST, "of the range")

    def __len__(self) -> int:
        return self.columns * self.rows


def grid(model: Synthesizer, asked: GridQuestion) -> SigmaGrid:
    """Grid of the question; InvalidField for a control or performer that there is not, and a value
    out of reach."""
    card = model.session.card
    limits.check_names(card, asked.controls)
    labels = door.labels(card.performers, asked.performer)
    across = _axis(card, "across", asked.across, asked.columns, asked)
    along = _axis(card, "along", asked.along, asked.rows, asked)
    fixed = _fixed(card, asked)
    points = _points(card, across, along, fixed)
    sigma = np.concatenate(
        [model.session.sigmas(points[i : i + BATCH], labels) for i in range(0, len(points), BATCH)]
    )
    shape = asked.rows, asked.columns
    return SigmaGrid(
        model.identity,
        across,
        along,
        fixed,
        asked.performer,
        sigma.reshape(shape),
        _inside(card, points).reshape(shape),
        model.door.support.holds(points).reshape(shape),
    )


def _axis(card: ModelCard, field: str, name: str, count: int, asked: GridQuestion) -> Axis:
    control = card.control(name)
    if control is None:
        known = ", ".join(c.name for c in card.controls)
        raise InvalidField(field, f"{name!r}, expected one of this model's controls, {known}")
    if name in asked.controls:
        raise InvalidField(f"controls/{name}", f"given, and {field} the grid too; expected one")
    room = asked.margin * (control.maximum - control.minimum)
    return Axis(control, np.linspace(control.minimum - room, control.maximum + room, count))


def _fixed(card: ModelCard, asked: GridQuestion) -> dict[str, float]:
    """Values of the controls that are no axes, in the card's order."""
    usual = {control.name: control.default for control in card.controls} | dict(asked.controls)
    return {
        control.name: door.checked(control, usual[control.name])
        for control in card.controls
        if control.name not in (asked.across, asked.along)
    }


def _points(card: ModelCard, across: Axis, along: Axis, fixed: Mapping[str, float]) -> Floats:
    """Controls (R C, d) in the card's order, row by row."""
    right, up = np.meshgrid(across.values, along.values)
    columns = {across.control.name: right.ravel(), along.control.name: up.ravel()}
    full = (columns.get(c.name, np.full(right.size, fixed.get(c.name))) for c in card.controls)
    return np.stack(list(full), axis=1)


def _inside(card: ModelCard, points: Floats) -> Truths:
    low, high = np.transpose([limits.sampled(control) for control in card.controls])
    return np.all((points >= low) & (points <= high), axis=1)
