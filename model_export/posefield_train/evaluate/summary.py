"""Results of a protocol as means over clips: as JSON, as a table and in sentences."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from posefield.common.units import Floats, Indices
from posefield_train.contacts import contact_model
from posefield_train.evaluate import motion_errors
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.predictions import OURS
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.report.significant_digits import round_number

DISTANCES = ("relative", "absolute", "plain_relative", "plain_absolute", "shell")
"""Distances of `MotionErrors`."""
COLUMNS = (
    ("method", "defined below"),
    ("relative", "distance without the root's position, after time warping"),
    ("±", "standard error of the column before, over recordings"),
    ("difference", "relative distance less that of posefield with equal information"),
    ("±", "standard error of the column before, over recordings"),
    ("global", "distance with the root's position, after time warping"),
    ("effector", "distance of the event's joint at its event"),
    ("rel. unwarped", "relative distance at equal shares of the duration, without time warping"),
    ("glob. unwarped", "global distance at equal shares of the duration, without time warping"),
    ("duration", "RMS of the logarithm of synthesised over captured duration"),
    ("accel.", "mean acceleration, synthesised over captured"),
    ("peak accel.", "largest acceleration of a frame, synthesised over captured: mean and worst"),
    ("ends", "acceleration of the first and of the last three frames, synthesised over captured"),
    ("skate", "speed of feet on the ground, synthesised over captured"),
)
"""Titles of the table's columns, and their meanings."""
DURATION_COLUMN = [title for title, _ in COLUMNS].index("duration")
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

    clips: number of those. left_out: number of all others. mean: its errors. worst_peak: largest
    ratio of a clip's peak acceleration to the captured one. standard_error: of the
    mean distance of `clip_distances`, m. worse: mean difference of that distance from posefield's
    with equal information on the same clips, m. worse_error: standard error of that difference, m.
    """

    name: str
    clips: int
    left_out: int
    mean: MotionErrors
    worst_peak: float
    standard_error: float
    worse: float
    worse_error: float

    @property
    def curve_distance(self) -> float:
        """Return the RMS error of all curves, as the distance that they count as, m."""
        return float(np.sqrt(np.mean(self.mean.counted)))

    @property
    def ends(self) -> Floats:
        """Return the acceleration (2,) of first and last frames over captured; NaN at rest."""
        captured = self.mean.ends_captured
        return np.divide(self.mean.ends, np.where(captured > 0.0, captured, np.nan))

    @property
    def skate(self) -> float:
        """Return the ratio of foot speed on the ground to that of captured feet; 0 without feet."""
        captured = self.mean.skate_captured
        return self.mean.skate / captured if captured else 0.0


def clip_distances(result: EvaluationResult, errors: Sequence[MotionErrors]) -> Floats:
    """Return the distance (C,) of each clip by which methods are ranked, m.

    It is the relative distance; for clips of curves alone the error of their curves.
    """
    if result.has_positions:
        return np.array([error.relative.mean for error in errors])
    return np.array([np.sqrt(np.mean(error.counted)) for error in errors])


def clustered_standard_error(values: Floats, recordings: Indices) -> float:
    """Return the standard error of the mean of values (C,) that agree within recordings (C,).

    Sums of residuals over recordings take the place of residuals (Liang & Zeger 1986); with one
    clip per recording it is the usual standard error. Zero for a single recording.
    """
    groups = np.unique(recordings, return_inverse=True)[1]
    count = int(groups.max()) + 1
    if count < 2:
        return 0.0
    sums = np.bincount(groups, weights=values - values.mean(), minlength=count)
    return float(np.sqrt(count / (count - 1) * np.sum(np.square(sums))) / len(values))


def summarize(result: EvaluationResult) -> list[MethodSummary]:
    """Return the summary of each method, posefield's first."""
    return [_summary(result, name) for name in result.errors if result.predicted(name)]


def _summary(result: EvaluationResult, name: str) -> MethodSummary:
    clips = result.predicted(name)
    errors, reference = result.of(name), result.references.get(name, OURS)
    distances, ours = (
        clip_distances(result, listed) for listed in (errors, result.of(reference, clips))
    )
    recordings = np.array(result.recordings)[clips]
    return MethodSummary(
        name,
        len(clips),
        len(result.clips) - len(clips),
        motion_errors.mean(errors),
        max(error.peak for error in errors),
        clustered_standard_error(distances, recordings),
        float((distances - ours).mean()),
        clustered_standard_error(distances - ours, recordings),
    )


def sigma_ratio(result: EvaluationResult) -> float:
    """Return the mean of squared error over squared sigma."""
    squared = np.array([error.mean_squared_error for error in result.of(OURS)])
    return float(np.mean(squared / np.square(result.sigma)))


def joint_sigma_ratios(result: EvaluationResult) -> dict[str, float]:
    """Return the mean of squared error over squared sigma of each joint.

    Empty for clips of curves alone, whose only joint rests.
    """
    if not result.has_positions:
        return {}
    squared = np.stack([error.joints for error in result.of(OURS)])
    ratios = np.mean(squared / np.square(result.joint_sigma), axis=0)
    return dict(zip(result.joints, ratios.tolist(), strict=True))


def facts(result: EvaluationResult) -> dict[str, Any]:
    """Return the figures of a result as JSON values."""
    ratios = joint_sigma_ratios(result)
    return {
        "family": result.family,
        "protocol": result.protocol,
        "clips": len(result.clips),
        "sigma_ratio": round_number(sigma_ratio(result)),
        "joint_sigma_ratio": {name: round_number(ratio) for name, ratio in ratios.items()},
        **({"support": result.flags.facts()} if result.flags else {}),
        **({"contacts": contact_model.mean_accuracy(result.contacts)} if result.contacts else {}),
        "methods": {summary.name: method_facts(result, summary) for summary in summarize(result)},
    }


def method_facts(result: EvaluationResult, summary: MethodSummary) -> dict[str, Any]:
    """Return the figures of a method by name, distances in centimetres.

    Measures of positions are null for clips of curves alone.
    """
    mean = summary.mean
    positions = {
        "relative_cm": centimetres(mean.relative.mean),
        "global_cm": centimetres(mean.absolute.mean),
        "effector_cm": centimetres(mean.effector),
        "plain_relative_cm": centimetres(mean.plain_relative.mean),
        "plain_global_cm": centimetres(mean.plain_absolute.mean),
        "standard_error_cm": centimetres(summary.standard_error),
        "difference_cm": centimetres(summary.worse),
        "difference_standard_error_cm": centimetres(summary.worse_error),
        "acceleration_ratio": _rounded(mean.acceleration),
        "peak_ratio": _rounded(mean.peak),
        "worst_peak_ratio": _rounded(summary.worst_peak),
        "first_frames_ratio": _rounded(summary.ends[0]),
        "last_frames_ratio": _rounded(summary.ends[1]),
        "skate_ratio": round_number(summary.skate) if mean.skate_captured else None,
        "skate_cm_per_s": centimetres(mean.skate),
        "distances_cm": {
            name: {key: centimetres(value) for key, value in asdict(getattr(mean, name)).items()}
            for name in DISTANCES
        },
    }
    figures = {
        "clips": summary.clips,
        "clips_left_out": summary.left_out,
        **(positions if result.has_positions else dict.fromkeys(positions)),
        "duration_error": round_number(mean.duration),
        "definition": result.definitions[summary.name],
    }
    if result.curves:
        errors = map(round_number, np.sqrt(mean.curves))
        figures["curves_cm"] = centimetres(summary.curve_distance)
        figures["curves"] = dict(zip(result.curves, errors, strict=True))
    return figures


def _rounded(ratio: float) -> float | None:
    """Return a rounded ratio; None for NaN."""
    return None if np.isnan(ratio) else round_number(ratio)


def centimetres(metres: float) -> float | None:
    """Return a rounded length in centimetres; None for NaN."""
    return None if np.isnan(metres) else round_number(100.0 * metres)


def table(result: EvaluationResult) -> str:
    """Return a result as a table in Markdown under a title."""
    title = (
        f"{result.family}, {result.protocol.replace('_', ' ')}: {len(result.clips)} motions, "
        f"sigma ratio {sigma_ratio(result):.2f}"
    )
    head = [title for title, _ in columns(result)]
    rows = [_cells(result, summary) for summary in summarize(result)]
    return f"{title}\n\n{_markdown_table(head, rows)}"


def _markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table with cells padded to the width of their column."""
    listed = [head, *rows]
    widths = [max(len(row[i]) for row in listed) for i in range(len(head))]
    lines = [
        "| " + " | ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)) + " |"
        for row in listed
    ]
    rule = "|" + "|".join("-" * (width + 2) for width in widths) + "|"
    return "\n".join([lines[0], rule, *lines[1:]])


def columns(result: EvaluationResult) -> tuple[tuple[str, str], ...]:
    """Return the titles of the columns of a result's table, and their meanings."""
    return (*COLUMNS, CURVES_COLUMN) if result.curves else COLUMNS


def _cells(result: EvaluationResult, summary: MethodSummary) -> tuple[str, ...]:
    mean, left_out = summary.mean, summary.left_out
    name = f"{summary.name} ({summary.clips} clips)" if left_out else summary.name
    curves = (f"{100 * summary.curve_distance:.3f}",) if result.curves else ()
    if not result.has_positions:
        cells = [NOT_APPLICABLE] * (len(COLUMNS) - 1)
        cells[DURATION_COLUMN - 1] = f"{100 * mean.duration:.1f} %"
        return (name, *cells, *curves)
    is_ours = summary.name == OURS
    return (
        name,
        f"{100 * mean.relative.mean:.2f}",
        f"{100 * summary.standard_error:.2f}",
        "" if is_ours else f"{100 * summary.worse:+.2f}",
        "" if is_ours else f"{100 * summary.worse_error:.2f}",
        f"{100 * mean.absolute.mean:.2f}",
        "" if np.isnan(mean.effector) else f"{100 * mean.effector:.2f}",
        f"{100 * mean.plain_relative.mean:.2f}",
        f"{100 * mean.plain_absolute.mean:.2f}",
        f"{100 * mean.duration:.1f} %",
        *(
            [NOT_APPLICABLE] * 3
            if np.isnan(mean.acceleration)
            else [
                f"{mean.acceleration:.2f}",
                f"{mean.peak:.2f} ({summary.worst_peak:.1f})",
                ", ".join(f"{ratio:.2f}" for ratio in summary.ends),
            ]
        ),
        f"{summary.skate:.2f}" if mean.skate_captured else "",
        *curves,
    )


def trust_text(result: EvaluationResult) -> list[str]:
    """Return sentences on sigma by joint, on the support flag and on contacts."""
    ratios = joint_sigma_ratios(result)
    flags = [result.flags.text()] if result.flags else []
    if not ratios:
        return [f"sigma ratio by joint: {NOT_APPLICABLE}, the clips have no skeleton", *flags]
    steadiest, worst = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    joints = (
        f"sigma ratio by joint: median {np.median(list(ratios.values())):.2f}, "
        f"from {ratios[steadiest]:.2f} ({steadiest}) to {ratios[worst]:.2f} ({worst})"
    )
    contacts = [contact_model.accuracy_text(result.contacts)] if result.contacts else []
    return [joints, *flags, *contacts]


def legend(results: Sequence[EvaluationResult]) -> str:
    """Return units, columns and methods of the tables of some results, one per line."""
    units = [UNITS]
    if any(result.curves for result in results):
        units.append(CURVE_UNITS)
    if not all(result.has_positions for result in results):
        units.append(ALONE)
    listed = dict.fromkeys(column for result in results for column in columns(result))
    meanings = [f"  {title}: {meaning}" for title, meaning in listed if title != "±"]
    definitions = dict.fromkeys(
        f"  {name}: {result.definitions[name]}" for result in results for name in result.errors
    )
    return "\n".join(
        [*units, *meanings, "  ±: standard error over recordings", "Methods:", *definitions]
    )
