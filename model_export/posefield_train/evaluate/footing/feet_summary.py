"""Summary of the feet of held-out clips: as JSON and as a table."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from posefield_train.evaluate.footing.foot_quality import FootQuality
from posefield_train.evaluate.footing.standing_answers import FeetAnswer
from posefield_train.report.drawing import markdown_table, significant_digits

HEADER = ("feet", "captured", "as predicted", "standing", "without swing rules")
NAMES = ("predicted", "standing", "locked")
"""Answers that are compared with captured clips, in the order of the columns."""
RATIOS: dict[str, tuple[str, Callable[[FootQuality], float]]] = {
    "skate": ("planted feet, speed over captured", lambda own: own.skate),
    "weighted_skate": ("low feet, weighted speed over captured", lambda own: own.weighted_skate),
    "acceleration": ("acceleration over captured", lambda own: own.acceleration),
    "knee_peak": (
        "99th percentile of the knees' acceleration over captured",
        lambda own: own.knee_peak,
    ),
    "knee_mean": ("mean of the knees' acceleration over captured", lambda own: own.knee_mean),
}
"""Measures that are told as a ratio of means over clips, and their meanings."""


def facts(found: Sequence[FeetAnswer]) -> dict[str, Any]:
    """Return the figures by name: centimetres, centimetres a second, ratios; empty without feet."""
    if not found:
        return {}
    told: dict[str, Any] = {
        "clips": len(found),
        "captured_skate_cm_per_s": _centimetres([own.captured.skate for own in found]),
        "predicted_error_cm": _centimetres([own.predicted_error for own in found]),
        "standing_error_cm": _centimetres([own.standing_error for own in found]),
        "lowered_worst_cm": significant_digits.round_number(
            100.0 * max(own.lowered for own in found)
        ),
        "lowest_cm": {
            name: significant_digits.round_number(
                100.0 * min(getattr(own, name).lowest for own in found)
            )
            for name in ("captured", *NAMES)
        },
    }
    for key, (_, value) in RATIOS.items():
        told[key] = {
            name: significant_digits.round_number(_ratio(found, name, value)) for name in NAMES
        }
    return told


def rows(found: Sequence[FeetAnswer]) -> tuple[tuple[str, ...], ...]:
    """Return the rows of the table under HEADER; empty without feet."""
    if not found:
        return ()
    own = facts(found)
    ratios = [
        (words, "1", *(f"{own[key][name]:.2f}" for name in NAMES))
        for key, (words, _) in RATIOS.items()
    ]
    errors = [f"{own[key]:.2f}" for key in ("predicted_error_cm", "standing_error_cm")]
    return (
        *ratios,
        ("relative distance (cm)", "", *errors, ""),
        ("lowest foot (cm)", *(f"{value:.1f}" for value in own["lowest_cm"].values())),
        ("pelvis lowered, worst clip (cm)", "", "", f"{own['lowered_worst_cm']:.1f}", ""),
    )


def table(found: Sequence[FeetAnswer]) -> str:
    """Return the table in Markdown; empty without feet."""
    listed = rows(found)
    return markdown_table.markdown_table(HEADER, listed) if listed else ""


def _ratio(found: Sequence[FeetAnswer], name: str, value: Callable[[FootQuality], float]) -> float:
    """Return the mean of a measure over that of the captured clips."""
    captured = float(np.mean([value(own.captured) for own in found]))
    return float(np.mean([value(getattr(own, name)) for own in found]) / max(captured, 1e-9))


def _centimetres(metres: Sequence[float]) -> float:
    return significant_digits.round_number(100.0 * float(np.mean(metres)))
