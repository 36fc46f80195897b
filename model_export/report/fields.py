"""Everything that is kriged, and how much of each field the controls explain."""

from dataclasses import dataclass
from typing import Any

from model_export.field_bank import POSE
from model_export.kriging import Hyper, Kriging
from model_export.report import plain
from model_export.report.page import Section, Table
from model_export.train import Trained
from service.motion.card import Control

_MEANING = {
    "pose": "motion on canonical time",
    "offsets": "bone lengths",
    "duration": "length of the clip",
    "warp": "pace within the clip",
    "travel": "way and turn of a cycle",
}


@dataclass(frozen=True)
class Field:
    """A field's name, the share that it explains, and its parameters where it is not its mean."""

    name: str
    explained: float
    hyper: Hyper | None


@dataclass(frozen=True)
class Fields:
    """The fields of a model over its controls' names."""

    fields: tuple[Field, ...]
    controls: tuple[str, ...]

    def facts(self) -> dict[str, Any]:
        """By name the share explained, and the parameters in use."""
        return {field.name: {**self._facts(field)} for field in self.fields}

    def _facts(self, field: Field) -> dict[str, Any]:
        own: dict[str, Any] = {
            "explained": plain.number(field.explained),
            "answered_with": "kriging" if field.hyper else "mean",
        }
        if field.hyper:
            scales = dict(zip(self.controls, plain.numbers(field.hyper.scales), strict=True))
            own |= {"nugget": plain.number(field.hyper.nugget), "scales": scales}
            own |= {"performers": plain.number(field.hyper.label)}
            own |= {"drifts": list(field.hyper.drifts)}
        return own

    def section(self) -> Section:
        """A row a field."""
        words = (
            "The share of the variation between clips that leave-one-out predicts from the "
            "controls. A field that does not gain on the mean of the clips by two standard errors "
            "is answered with that mean. A scale is what a half-range of the control is worth as "
            "distance: at the lower bound of 0.15 the field is all but linear in it. The nugget, "
            "as share of the sill, is what equal controls leave open. Performers is how far apart "
            "two of them are, wherever the controls are equal; zero where they are not told apart.",
        )
        heading = ("field", "what it is", "explained", "answered with", "nugget", "performers")
        scales = tuple(f"scale: {name}" for name in self.controls)
        table = Table((*heading, *scales), tuple(map(self._row, self.fields)))
        return Section("fields", "What the controls explain", words, (table,))

    def _row(self, field: Field) -> tuple[str, ...]:
        meaning, share = _MEANING.get(field.name, ""), f"{100 * field.explained:.0f} %"
        if field.hyper is None:
            return (field.name, meaning, share, "mean", "", "", *("" for _ in self.controls))
        scales = (f"{scale:.3g}" for scale in field.hyper.scales)
        two = f"{field.hyper.nugget:.3g}", f"{field.hyper.label:.3g}"
        return (field.name, meaning, share, "kriging", *two, *scales)


def of(trained: Trained, controls: tuple[Control, ...]) -> Fields:
    """The fields of a trained model, the pose's first."""
    bank = {POSE: trained.model.bank.pose, **trained.model.bank.others}
    found = [
        Field(name, share, own.hyper if isinstance(own := bank[name], Kriging) else None)
        for name, share in trained.explained.items()
    ]
    return Fields(tuple(found), tuple(control.name for control in controls))
