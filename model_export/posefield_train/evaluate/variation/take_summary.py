"""Summary of the takes of held-out clips: as JSON and as a table."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield_train.evaluate.footing.foot_quality import FootQuality
from posefield_train.evaluate.variation.field_statistics import FieldStatistics
from posefield_train.evaluate.variation.take_answers import RATE, TakeAnswer, TakeResults
from posefield_train.report.drawing import markdown_table, significant_digits

HEADER = ("takes", "value", "negative control")
MEASURES: dict[str, Callable[[FootQuality], float]] = {
    "acceleration": lambda own: own.acceleration,
    "skate": lambda own: own.skate,
    "weighted_skate": lambda own: own.weighted_skate,
}
"""Measures that are told as a ratio of means over clips."""
ANSWERS = ("predicted", "take", "sliding", "unlimited", "detailed", "detailed_take")
"""Answers that are compared with the captured clips, as `TakeAnswer` names them."""


@dataclass(frozen=True)
class Takes:
    """Takes of all folds: of the clips (C,), in their order, and the fields of each fold's model.

    Both are empty against the truth, and for a covariance that no takes can be drawn of; clips
    without feet that can stand, and fields for models of few samples.
    """

    clips: Sequence[TakeAnswer] = ()
    fields: Sequence[FieldStatistics] = ()


def merge(parts: Sequence[TakeResults | None], order: Sequence[int]) -> Takes:
    """Return the takes of folds; order: indices that sort all clips of the folds."""
    told = [part for part in parts if part]
    found = [answer for part in told for answer in part.clips]
    fields = [part.fields for part in told if part.fields]
    return Takes([found[i] for i in order] if len(found) == len(order) else (), fields)


def facts(found: Takes) -> dict[str, Any]:
    """Return the figures by name, ratios all of them; empty without takes.

    Ranges are the least and the greatest of the bins of distance, each the mean over folds. In
    `controls` are the negative controls of the fields.
    """
    fields = _field_facts(found.fields) if found.fields else {}
    return fields | (_clip_facts(found.clips) if found.clips else {})


def _field_facts(fields: Sequence[FieldStatistics]) -> dict[str, Any]:
    def mean(name: str) -> float:
        return _rounded(np.mean([getattr(own, name) for own in fields]))

    def least_and_most(name: str) -> list[float]:
        bins = np.mean([getattr(own, name) for own in fields], axis=0)
        return [_rounded(bins.min()), _rounded(bins.max())]

    return {
        "variogram": least_and_most("variogram"),
        "variance": mean("variance"),
        "mean_in_standard_errors": mean("mean_error"),
        "controls": {
            "variogram_of_half_scales": least_and_most("wrong_variogram"),
            "variance_without_conditioning": mean("unconditioned"),
            "mean_in_standard_errors_of_equal_errors": mean("shared_errors"),
        },
    }


def _clip_facts(clips: Sequence[TakeAnswer]) -> dict[str, Any]:
    ratios = {
        key: {
            name: _ratio(clips, name, value)
            for name in ANSWERS
            if any(getattr(own, name) is not None for own in clips)
        }
        for key, value in MEASURES.items()
    }
    return {"clips": len(clips), "frames_per_second": RATE, **ratios}


def _ratio(clips: Sequence[TakeAnswer], name: str, value: Callable[[FootQuality], float]) -> float:
    """Return the mean of a measure of an answer over that of the captured clips."""
    captured = float(np.mean([value(own.captured) for own in clips]))
    # A fold whose model has no detail answers without it: the prediction and the take.
    plain = {"detailed": "predicted", "detailed_take": "take"}
    answers = [getattr(own, name) or getattr(own, plain.get(name, name)) for own in clips]
    return _rounded(np.mean([value(own) for own in answers]) / max(captured, 1e-9))


def _rounded(value: Any) -> float:
    return significant_digits.round_number(float(value))


def rows(found: Takes) -> tuple[tuple[str, ...], ...]:
    """Return the rows of the table under HEADER; empty without takes."""
    told = facts(found)
    return (
        *(_field_rows(told) if found.fields else ()),
        *(_clip_rows(told) if found.clips else ()),
    )


def _field_rows(told: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return the rows of the random fields."""
    other = told["controls"]
    return [
        (
            "variogram over the model's, 6 distances",
            _range(told["variogram"]),
            f"{_range(other['variogram_of_half_scales'])} with half the scales",
        ),
        (
            "variance over kriging variance",
            f"{told['variance']:.2f}",
            f"{other['variance_without_conditioning']:.2f} without conditioning",
        ),
        (
            "mean over seeds in standard errors (RMS)",
            f"{told['mean_in_standard_errors']:.2f}",
            f"{other['mean_in_standard_errors_of_equal_errors']:.2f} with equal errors at samples",
        ),
    ]


def _clip_rows(told: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return the rows of the motions of takes."""
    faster = told["acceleration"]
    control = f"{faster['unlimited']:.2f} of all time functions" if "unlimited" in faster else ""
    words = "acceleration over captured: predicted → take"
    found = [(words, f"{faster['predicted']:.2f} → {faster['take']:.2f}", control)]
    if "detailed" in faster:
        both = f"{faster['detailed']:.2f}; {faster['detailed_take']:.2f}"
        words = "acceleration with detail over captured: predicted; take"
        found.append((words, both, f"{faster['predicted']:.2f} without detail"))
    for key, name in (("skate", "planted"), ("weighted_skate", "low")):
        own = told[key]
        words = f"speed of {name} feet of a take over captured"
        found.append((words, f"{own['take']:.2f}", f"{own['sliding']:.2f} before feet stand"))
    return found


def _range(values: Sequence[float]) -> str:
    return f"{values[0]:.2f} to {values[1]:.2f}"


def table(found: Takes) -> str:
    """Return the table in Markdown; empty without takes."""
    listed = rows(found)
    return markdown_table.markdown_table(HEADER, listed) if listed else ""
