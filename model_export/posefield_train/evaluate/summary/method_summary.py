"""Summary of one method: its errors over all clips as JSON and as a row of the table."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from posefield_train.evaluate.methods import OURS, definition
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.report.drawing import significant_digits

DISTANCES = {
    "relative": "relative",
    "absolute": "global",
    "plain_relative": "relative, unwarped",
    "plain_absolute": "global, unwarped",
    "shell": "shell",
}
"""Distances of `Errors`, and their titles."""
COLUMNS = (
    ("method", "defined below"),
    ("relative", "distance without the root's position, after time warping"),
    ("±", "standard error of the column before, over takes"),
    ("difference", "relative distance less that of posefield with equal information"),
    ("±", "standard error of the column before, over takes"),
    ("global", "distance with the root's position, after time warping"),
    ("effector", "distance of the event's joint at its event"),
    ("rel. unwarped", "relative distance at equal shares of the duration, without time warping"),
    ("glob. unwarped", "global distance at equal shares of the duration, without time warping"),
    ("duration", "RMS of the logarithm of synthesised over captured duration"),
    ("accel.", "mean acceleration, synthesised over captured"),
    ("skate", "speed of feet on the ground, synthesised over captured"),
)
"""Titles of the table's columns, and their meanings."""
CURVES_COLUMN = ("curves", "RMS error of all curves, as the distance that they count as")
"""Last column of the table of a family with curves."""
NOT_APPLICABLE = "n/a"
"""Cell of a measure of positions for clips of curves without a skeleton."""
UNITS = (
    "Distances are in centimetres, mean over joints, frames and clips. Sigma ratio: mean squared "
    "error over the squared error that the model predicts; 1 is ideal."
)
CURVE_UNITS = (
    "Errors of single curves are root mean squares over frames and clips after time warping, in "
    "the unit of the curve."
)
ALONE = (
    "The clips have curves and no skeleton: measures of positions are not applicable, and sigma is "
    "that of the curves."
)


@dataclass(frozen=True)
class MethodSummary:
    """Errors of one method over all clips that it predicted.

    clips: number of those. left_out: number of all others. mean: its errors. standard_error: of the
    mean distance of `clip_distances`, m. worse: mean difference of that distance from posefield's
    with equal information on the same clips, m. worse_error: standard error of that difference, m.
    curves: names. has_positions: False for clips of curves alone.
    """

    name: str
    clips: int
    left_out: int
    mean: MotionErrors
    standard_error: float
    worse: float
    worse_error: float
    curves: tuple[str, ...] = ()
    has_positions: bool = True

    @property
    def curve_distance(self) -> float:
        """Return the RMS error of all curves, as the distance that they count as, m."""
        return float(np.sqrt(np.mean(self.mean.counted)))

    @property
    def skate(self) -> float:
        """Return the ratio of foot speed on the ground to that of captured feet; 0 without feet."""
        captured = self.mean.skate_captured
        return self.mean.skate / captured if captured else 0.0

    def facts(self) -> dict[str, Any]:
        """Return the figures by name, distances in centimetres."""
        found = self._facts()
        if not self.has_positions:
            # As JSON has no word for it, measures that are not applicable are null.
            found |= dict.fromkeys(POSITION_FACTS)
        return found | (self._curve_facts() if self.curves else {})

    def _curve_facts(self) -> dict[str, Any]:
        pairs = zip(self.curves, np.sqrt(self.mean.curves).tolist(), strict=True)
        return {
            "curves_cm": centimetres(self.curve_distance),
            "curves": {name: significant_digits.round_number(error) for name, error in pairs},
        }

    def _facts(self) -> dict[str, Any]:
        mean = self.mean
        return {
            "clips": self.clips,
            "clips_left_out": self.left_out,
            "relative_cm": centimetres(mean.relative.mean),
            "global_cm": centimetres(mean.absolute.mean),
            "effector_cm": centimetres(mean.effector),
            "plain_relative_cm": centimetres(mean.plain_relative.mean),
            "plain_global_cm": centimetres(mean.plain_absolute.mean),
            "standard_error_cm": centimetres(self.standard_error),
            "difference_cm": centimetres(self.worse),
            "difference_standard_error_cm": centimetres(self.worse_error),
            "duration_error": significant_digits.round_number(mean.duration),
            "acceleration_ratio": None
            if np.isnan(mean.acceleration)
            else significant_digits.round_number(mean.acceleration),
            "skate_ratio": significant_digits.round_number(self.skate)
            if mean.skate_captured
            else None,
            "skate_cm_per_s": centimetres(mean.skate),
            "distances_cm": {
                name: {
                    key: centimetres(value) for key, value in asdict(getattr(mean, name)).items()
                }
                for name in DISTANCES
            },
            "definition": definition(self.name),
        }

    def cells(self) -> tuple[str, ...]:
        """Return the row of the table under `columns`."""
        name = f"{self.name} ({self.clips} clips)" if self.left_out else self.name
        curves = (f"{100 * self.curve_distance:.3f}",) if self.curves else ()
        if self.has_positions:
            return (name, *self._position_cells(), *curves)
        cells = [NOT_APPLICABLE] * (len(COLUMNS) - 1)
        cells[DURATION_COLUMN - 1] = f"{100 * self.mean.duration:.1f} %"
        return (name, *cells, *curves)

    def _position_cells(self) -> tuple[str, ...]:
        mean, ours = self.mean, self.name == OURS
        return (
            _centimetre_text(mean.relative.mean),
            _centimetre_text(self.standard_error),
            "" if ours else f"{100 * self.worse:+.2f}",
            "" if ours else _centimetre_text(self.worse_error),
            _centimetre_text(mean.absolute.mean),
            "" if np.isnan(mean.effector) else _centimetre_text(mean.effector),
            _centimetre_text(mean.plain_relative.mean),
            _centimetre_text(mean.plain_absolute.mean),
            f"{100 * mean.duration:.1f} %",
            NOT_APPLICABLE if np.isnan(mean.acceleration) else f"{mean.acceleration:.2f}",
            f"{self.skate:.2f}" if mean.skate_captured else "",
        )


DURATION_COLUMN = [title for title, _ in COLUMNS].index("duration")
POSITION_FACTS = (
    "relative_cm",
    "global_cm",
    "effector_cm",
    "plain_relative_cm",
    "plain_global_cm",
    "standard_error_cm",
    "difference_cm",
    "difference_standard_error_cm",
    "acceleration_ratio",
    "skate_ratio",
    "skate_cm_per_s",
    "distances_cm",
)
"""Facts of a method that measure positions."""


def columns(result: EvaluationResult) -> tuple[tuple[str, str], ...]:
    """Return the titles of the columns of a result's table, and their meanings."""
    return (*COLUMNS, CURVES_COLUMN) if result.curves else COLUMNS


def units(result: EvaluationResult) -> list[str]:
    """Return sentences on the units of a result's tables."""
    said = [UNITS] + [CURVE_UNITS] * bool(result.curves)
    return said if result.has_positions else [*said, ALONE]


def _centimetre_text(metres: float) -> str:
    return f"{100 * metres:.2f}"


def centimetres(metres: float) -> float | None:
    """Return a rounded length in centimetres; None for NaN."""
    return None if np.isnan(metres) else significant_digits.round_number(100.0 * metres)
