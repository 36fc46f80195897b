"""Results of a protocol as means over clips: as JSON, as a table and in sentences."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from posefield.common.units import Floats
from posefield_train.contacts import held_out_contacts
from posefield_train.evaluate import corrections, equal_information, motion_errors
from posefield_train.evaluate.methods import ASKED_OPEN, EXACT, OURS, TOLD, definition
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.new_performers import ADAPTATION_COUNTS
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.report.drawing import markdown_table, significant_digits

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
UNITS = (
    "Distances are in centimetres, mean over joints, frames and clips. Sigma ratio: mean squared "
    "error over the squared error that the model predicts; 1 is ideal."
)


@dataclass(frozen=True)
class MethodSummary:
    """Errors of one method over all clips that it predicted.

    clips: number of those. left_out: number of all others. mean: its errors. standard_error: of the
    mean relative distance, m. worse: mean difference of its relative distance from posefield's with
    equal information on the same clips, m. worse_error: standard error of that difference, m.
    """

    name: str
    clips: int
    left_out: int
    mean: MotionErrors
    standard_error: float
    worse: float
    worse_error: float

    @property
    def skate(self) -> float:
        """Return the ratio of foot speed on the ground to that of captured feet; 0 without feet."""
        captured = self.mean.skate_captured
        return self.mean.skate / captured if captured else 0.0

    def facts(self) -> dict[str, Any]:
        """Return the figures by name, distances in centimetres."""
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
            "acceleration_ratio": significant_digits.round_number(mean.acceleration),
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
        """Return the row of the table under COLUMNS."""
        mean = self.mean
        ours = self.name == OURS
        return (
            f"{self.name} ({self.clips} clips)" if self.left_out else self.name,
            _centimetre_text(mean.relative.mean),
            _centimetre_text(self.standard_error),
            "" if ours else f"{100 * self.worse:+.2f}",
            "" if ours else _centimetre_text(self.worse_error),
            _centimetre_text(mean.absolute.mean),
            "" if np.isnan(mean.effector) else _centimetre_text(mean.effector),
            _centimetre_text(mean.plain_relative.mean),
            _centimetre_text(mean.plain_absolute.mean),
            f"{100 * mean.duration:.1f} %",
            f"{mean.acceleration:.2f}",
            f"{self.skate:.2f}" if mean.skate_captured else "",
        )


def _centimetre_text(metres: float) -> str:
    return f"{100 * metres:.2f}"


def centimetres(metres: float) -> float | None:
    """Return a rounded length in centimetres; None for NaN."""
    return None if np.isnan(metres) else significant_digits.round_number(100.0 * metres)


def relative_distances(found: Sequence[MotionErrors]) -> Floats:
    """Return the mean relative distance (C,) of each clip, m."""
    return np.array([error.relative.mean for error in found])


def summarize(result: EvaluationResult) -> list[MethodSummary]:
    """Return the summary of each method, posefield's first."""
    return [_summary(result, name) for name in result.errors if result.asked(name)]


def _summary(result: EvaluationResult, name: str) -> MethodSummary:
    places = result.asked(name)
    found = result.of(name, places)
    row = equal_information.posefield_row(result, name)
    own, ours = relative_distances(found), relative_distances(result.of(row, places))
    takes = np.array(result.takes)[places]
    return MethodSummary(
        name,
        len(found),
        len(result.clips) - len(found),
        motion_errors.mean(found),
        equal_information.clustered_standard_error(own, takes),
        float((own - ours).mean()),
        equal_information.clustered_standard_error(own - ours, takes),
    )


def sigma_ratio(result: EvaluationResult) -> float:
    """Return the mean of squared error over squared sigma."""
    squared = np.array([error.mean_squared_error for error in result.of(OURS, result.asked(OURS))])
    return float(np.mean(squared / np.square(result.sigma)))


def joint_sigma_ratios(result: EvaluationResult) -> dict[str, float]:
    """Return the mean of squared error over squared sigma of each joint."""
    squared = np.stack([error.joints for error in result.of(OURS, result.asked(OURS))])
    ratios = np.mean(squared / np.square(result.joint_sigma), axis=0)
    return dict(zip(result.joints, ratios.tolist(), strict=True))


def facts(result: EvaluationResult) -> dict[str, Any]:
    """Return the figures of a result as JSON values."""
    held = {} if result.flags is None else {"support": result.flags.facts()}
    contacts = held_out_contacts.mean_facts(result.contacts) if result.contacts else None
    by_joint = joint_sigma_ratios(result)
    methods = {summary.name: summary.facts() for summary in summarize(result)}
    if EXACT in methods:
        methods[EXACT]["exact"] = corrections.facts(result)
    return {
        "family": result.family,
        "protocol": result.protocol,
        "clips": len(result.clips),
        "sigma_ratio": significant_digits.round_number(sigma_ratio(result)),
        "joint_sigma_ratio": {
            name: significant_digits.round_number(ratio) for name, ratio in by_joint.items()
        },
        **held,
        **({"contacts": contacts} if contacts else {}),
        "equal_information": equal_information.facts(result),
        "methods": methods,
    }


def table(result: EvaluationResult) -> str:
    """Return a result as a table in Markdown under a title."""
    title = (
        f"{result.family}, {result.protocol.replace('_', ' ')}: {len(result.clips)} motions, "
        f"sigma ratio {sigma_ratio(result):.2f}"
    )
    head = [title for title, _ in COLUMNS]
    rows = [summary.cells() for summary in summarize(result)]
    paired = equal_information.table(result)
    return "\n\n".join(
        [title, markdown_table.markdown_table(head, rows), *([paired] if paired else [])]
    )


def trust_text(result: EvaluationResult) -> list[str]:
    """Return sentences on sigma by joint, on the support flag and on contacts."""
    ratios = joint_sigma_ratios(result)
    least, most = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    joints = (
        f"sigma ratio by joint: median {np.median(list(ratios.values())):.2f}, "
        f"from {ratios[least]:.2f} ({least}) to {ratios[most]:.2f} ({most})"
    )
    flags = [result.flags.text()] if result.flags else []
    contacts = [held_out_contacts.text(result.contacts)] if result.contacts else []
    return [joints, *flags, *contacts]


def legend(results: Sequence[EvaluationResult]) -> str:
    """Return units, columns and methods of the tables of some results, one per line."""
    meanings = [f"  {title}: {meaning}" for title, meaning in COLUMNS if title != "±"]
    names = dict.fromkeys(name for result in results for name in result.errors)
    definitions = [f"  {name}: {definition(name)}" for name in names]
    return "\n".join(
        [UNITS, *meanings, "  ±: standard error over takes", "Methods:", *definitions, TOLD]
    )


def performer_facts(results: Sequence[EvaluationResult]) -> dict[str, Any]:
    """Return the error reduction by performer names and by clips of new performers.

    Empty unless both protocols were run on a model that distinguishes performers.
    """
    by_name = {result.protocol: result for result in results}
    clips, others = (by_name.get(f"leave_one_{held}_out") for held in ("clip", "performer"))
    if not clips or not others or ASKED_OPEN not in clips.errors:
        return {}
    everyone = clips.asked(ASKED_OPEN)
    named, unnamed = (_mean_relative(clips, name, everyone) for name in (OURS, ASKED_OPEN))
    adapted = {
        name: _adaptation_facts(clips, others, name)
        for name in ADAPTATION_COUNTS
        if others.asked(name)
    }
    return {"named_nearer": significant_digits.round_number(1.0 - named / unnamed), **adapted}


def _adaptation_facts(
    clips: EvaluationResult, others: EvaluationResult, name: str
) -> dict[str, Any]:
    """Compare an adapted model with models of none, and of the other clips of the performer."""
    places = others.asked(name)
    own, none = (_mean_relative(others, one, places) for one in (name, OURS))
    whole = _mean_relative(clips, OURS, places)
    return {
        "clips": len(places),
        "relative_cm": centimetres(own),
        "shown_none_cm": centimetres(none),
        "shown_all_cm": centimetres(whole),
        "farther_than_all": significant_digits.round_number(own / whole - 1.0),
    }


def _mean_relative(result: EvaluationResult, name: str, places: Sequence[int]) -> float:
    return float(relative_distances(result.of(name, places)).mean())


def performer_text(results: Sequence[EvaluationResult]) -> list[str]:
    """Return the performer facts, a sentence each."""
    found = performer_facts(results)
    if not found:
        return []
    return [
        f"with the performer's name the error is {100 * found['named_nearer']:.1f} % smaller",
        *(
            f"{name}: {one['relative_cm']:.2f} cm on {one['clips']} clips; without clips of the "
            f"performer {one['shown_none_cm']:.2f} cm; trained with all other clips "
            f"{one['shown_all_cm']:.2f} cm ({100 * one['farther_than_all']:+.1f} %)"
            for name in ADAPTATION_COUNTS
            if (one := found.get(name))
        ),
    ]
