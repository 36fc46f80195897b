"""The kriging model of each quantity."""

from typing import Any

from posefield.model_file.model_card import Control
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging.kriging_bank import POSE
from posefield_train.kriging.universal_kriging import Hyper, UniversalKriging
from posefield_train.report.page import Chapter, Section, Table

_MEANING = {
    "pose": "joint rotations and root path",
    "offsets": "bone lengths",
    "duration": "length of the clip",
    "warp": "timing within the clip",
    "travel": "distance and turn of a cycle",
}


def quantity_chapter(trained: TrainedModel, controls: tuple[Control, ...]) -> Chapter:
    """Return the explained share and the parameters of each kriged quantity, the pose first."""
    names, label_sets = [control.name for control in controls], tuple(trained.model.bank.labels)
    bank = {POSE: trained.model.bank.pose, **trained.model.bank.other_models}
    facts: dict[str, Any] = {}
    rows = []
    for name, share in trained.explained.items():
        model = bank[name]
        meaning, explained = _MEANING.get(name, ""), f"{100 * share:.0f} %"
        if not isinstance(model, UniversalKriging):
            facts[name] = {"explained": share, "answered_with": "mean"}
            blank = [""] * (1 + 2 * len(label_sets) + len(names))
            rows.append((name, meaning, explained, "mean", "", *blank))
            continue
        hyper, parameters = model.hyper, _parameters(model.hyper, label_sets)
        facts[name] = {
            "explained": share,
            "answered_with": "kriging",
            "nugget": hyper.nugget,
            "scales": dict(zip(names, hyper.scales.tolist(), strict=True)),
            **parameters,
            "drifts": list(hyper.drifts),
        }
        numbers = (hyper.nugget, *parameters.values(), *hyper.scales)
        rows.append((name, meaning, explained, "kriging", *(f"{value:.3g}" for value in numbers)))
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
    pose = next(model.hyper for model in bank.values() if isinstance(model, UniversalKriging))
    titles = (
        *("quantity", "meaning", "explained", "predicted by", "nugget"),
        *_parameters(pose, label_sets),
        *(f"scale of {name}" for name in names),
    )
    table = Table("UniversalKriging models", titles, tuple(rows))
    return Chapter(facts, Section("fields", "What the controls explain", paragraphs, (table,)))


def _parameters(hyper: Hyper, label_sets: tuple[str, ...]) -> dict[str, float]:
    """Return the parameters of a quantity beside its scales and nugget, by name."""
    parameters = {"trend": hyper.trend}
    for name, label in zip(label_sets, hyper.labels, strict=True):
        parameters[f"correlation of {name}s"] = label.correlation
        parameters[f"offset of {name}s"] = label.offset
    return parameters
