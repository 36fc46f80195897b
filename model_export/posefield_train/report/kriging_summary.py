"""The kriging model of each quantity: the share it explains, and its parameters."""

from dataclasses import dataclass
from typing import Any

from posefield.model_file.model_card import Control
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging.kriging_bank import POSE
from posefield_train.kriging.universal_kriging import Hyper, UniversalKriging
from posefield_train.report.drawing import significant_digits
from posefield_train.report.drawing.html_page import Section, Table

_MEANING = {
    "pose": "joint rotations and root path",
    "offsets": "bone lengths",
    "duration": "length of the clip",
    "warp": "timing within the clip",
    "travel": "distance and turn of a cycle",
}


@dataclass(frozen=True)
class KrigedQuantity:
    """A kriged quantity. explained: share of its variation. hyper: None for a constant."""

    name: str
    explained: float
    hyper: Hyper | None


@dataclass(frozen=True)
class KrigingSummary:
    """All quantities of a model. controls, label_sets: names."""

    quantities: tuple[KrigedQuantity, ...]
    controls: tuple[str, ...]
    label_sets: tuple[str, ...]

    def facts(self) -> dict[str, Any]:
        """Return the explained share and the parameters of each quantity."""
        return {quantity.name: self._facts(quantity) for quantity in self.quantities}

    def _facts(self, quantity: KrigedQuantity) -> dict[str, Any]:
        own: dict[str, Any] = {
            "explained": significant_digits.round_number(quantity.explained),
            "answered_with": "kriging" if quantity.hyper else "mean",
        }
        if quantity.hyper:
            scales = dict(
                zip(
                    self.controls,
                    significant_digits.round_numbers(quantity.hyper.scales),
                    strict=True,
                )
            )
            own |= {
                "nugget": significant_digits.round_number(quantity.hyper.nugget),
                "scales": scales,
            }
            own |= {
                name: significant_digits.round_number(value)
                for name, value in self._parameters(quantity.hyper).items()
            }
            own |= {"drifts": list(quantity.hyper.drifts)}
        return own

    def _parameters(self, hyper: Hyper) -> dict[str, float]:
        """Return the parameters of a quantity beside its scales and nugget, by name."""
        found = {"trend": hyper.trend}
        for name, own in zip(self.label_sets, hyper.labels, strict=True):
            found[f"correlation of {name}s"] = own.correlation
            found[f"offset of {name}s"] = own.offset
        return found

    def section(self) -> Section:
        """Return a table with a row for each quantity."""
        paragraphs = (
            "Explained is the share of the variation between clips that kriging predicts from the "
            "controls, with each clip left out in turn. All quantities but "
            "the pose are shrunk to the mean of the clips, as far as these predictions advise.",
            "The scale of a control is its weight in the distance between clips, per half-range. "
            "All quantities share the scales. The nugget is the share of the variance that remains "
            "between clips with equal controls, and the trend the variance of the slope along a "
            "control. In each label set, such as performers, the correlation is that of the "
            "motions of two names with equal controls, and the offset the variance of a name's "
            "own offset.",
        )
        heading = ("quantity", "meaning", "explained", "predicted by", "nugget")
        scales = tuple(f"scale of {name}" for name in self.controls)
        pose = next(own.hyper for own in self.quantities if own.hyper)
        titles = (*heading, *self._parameters(pose), *scales)
        table = Table("UniversalKriging models", titles, tuple(map(self._row, self.quantities)))
        return Section("fields", "What the controls explain", paragraphs, (table,))

    def _row(self, quantity: KrigedQuantity) -> tuple[str, ...]:
        meaning, share = _MEANING.get(quantity.name, ""), f"{100 * quantity.explained:.0f} %"
        if quantity.hyper is None:
            blank = [""] * (1 + 2 * len(self.label_sets) + len(self.controls))
            return (quantity.name, meaning, share, "mean", "", *blank)
        scales = (f"{scale:.3g}" for scale in quantity.hyper.scales)
        parameters = (quantity.hyper.nugget, *self._parameters(quantity.hyper).values())
        own = (f"{value:.3g}" for value in parameters)
        return (quantity.name, meaning, share, "kriging", *own, *scales)


def summarize_kriging(trained: TrainedModel, controls: tuple[Control, ...]) -> KrigingSummary:
    """Return the quantities of a trained model, the pose first."""
    bank = {POSE: trained.model.bank.pose, **trained.model.bank.others}
    found = [
        KrigedQuantity(
            name, share, own.hyper if isinstance(own := bank[name], UniversalKriging) else None
        )
        for name, share in trained.explained.items()
    ]
    names = tuple(control.name for control in controls)
    return KrigingSummary(tuple(found), names, tuple(trained.model.bank.labels))
