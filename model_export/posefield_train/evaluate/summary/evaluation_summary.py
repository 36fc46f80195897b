"""Results of a protocol as means over clips: as JSON, as a table and in sentences."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from posefield.common.units import Floats
from posefield_train.contacts import held_out_contacts
from posefield_train.evaluate import corrections, equal_information, motion_errors
from posefield_train.evaluate.footing import feet_summary
from posefield_train.evaluate.methods import EXACT, OURS, TOLD, definition
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.evaluate.summary import method_summary
from posefield_train.evaluate.summary.method_summary import NOT_APPLICABLE, MethodSummary
from posefield_train.evaluate.variation import take_summary
from posefield_train.report.drawing import markdown_table, significant_digits


def relative_distances(found: Sequence[MotionErrors]) -> Floats:
    """Return the mean relative distance (C,) of each clip, m."""
    return np.array([error.relative.mean for error in found])


def clip_distances(result: EvaluationResult, found: Sequence[MotionErrors]) -> Floats:
    """Return the distance (C,) of each clip by which methods are ranked, m.

    It is the relative distance; for clips of curves alone the error of their curves.
    """
    if result.has_positions:
        return relative_distances(found)
    return np.array([np.sqrt(np.mean(error.counted)) for error in found])


def summarize(result: EvaluationResult) -> list[MethodSummary]:
    """Return the summary of each method, posefield's first."""
    return [_summary(result, name) for name in result.errors if result.asked(name)]


def _summary(result: EvaluationResult, name: str) -> MethodSummary:
    places = result.asked(name)
    found = result.of(name, places)
    row = equal_information.posefield_row(result, name)
    own, ours = (clip_distances(result, listed) for listed in (found, result.of(row, places)))
    takes = np.array(result.takes)[places]
    return MethodSummary(
        name,
        len(found),
        len(result.clips) - len(found),
        motion_errors.mean(found),
        equal_information.clustered_standard_error(own, takes),
        float((own - ours).mean()),
        equal_information.clustered_standard_error(own - ours, takes),
        result.curves,
        result.has_positions,
    )


def sigma_ratio(result: EvaluationResult) -> float:
    """Return the mean of squared error over squared sigma."""
    squared = np.array([error.mean_squared_error for error in result.of(OURS, result.asked(OURS))])
    return float(np.mean(squared / np.square(result.sigma)))


def joint_sigma_ratios(result: EvaluationResult) -> dict[str, float]:
    """Return the mean of squared error over squared sigma of each joint.

    Empty for clips of curves alone, whose only joint rests.
    """
    if not result.has_positions:
        return {}
    squared = np.stack([error.joints for error in result.of(OURS, result.asked(OURS))])
    ratios = np.mean(squared / np.square(result.joint_sigma), axis=0)
    return dict(zip(result.joints, ratios.tolist(), strict=True))


def facts(result: EvaluationResult) -> dict[str, Any]:
    """Return the figures of a result as JSON values."""
    held = {} if result.flags is None else {"support": result.flags.facts()}
    contacts = held_out_contacts.mean_facts(result.contacts) if result.contacts else None
    takes = take_summary.facts(result.variation)
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
        **({"feet": feet_summary.facts(result.feet)} if result.feet else {}),
        **({"takes": takes} if takes else {}),
        "equal_information": equal_information.facts(result),
        "methods": methods,
    }


def table(result: EvaluationResult) -> str:
    """Return a result as a table in Markdown under a title."""
    title = (
        f"{result.family}, {result.protocol.replace('_', ' ')}: {len(result.clips)} motions, "
        f"sigma ratio {sigma_ratio(result):.2f}"
    )
    head = [title for title, _ in method_summary.columns(result)]
    rows = [summary.cells() for summary in summarize(result)]
    paired = equal_information.table(result)
    return "\n\n".join(
        [title, markdown_table.markdown_table(head, rows), *([paired] if paired else [])]
    )


def trust_text(result: EvaluationResult) -> list[str]:
    """Return sentences on sigma by joint, on the support flag and on contacts."""
    ratios = joint_sigma_ratios(result)
    flags = [result.flags.text()] if result.flags else []
    if not ratios:
        return [f"sigma ratio by joint: {NOT_APPLICABLE}, the clips have no skeleton", *flags]
    least, most = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    joints = (
        f"sigma ratio by joint: median {np.median(list(ratios.values())):.2f}, "
        f"from {ratios[least]:.2f} ({least}) to {ratios[most]:.2f} ({most})"
    )
    contacts = [held_out_contacts.text(result.contacts)] if result.contacts else []
    return [joints, *flags, *contacts]


def legend(results: Sequence[EvaluationResult]) -> str:
    """Return units, columns and methods of the tables of some results, one per line."""
    listed = dict.fromkeys(
        column for result in results for column in method_summary.columns(result)
    )
    meanings = [f"  {title}: {meaning}" for title, meaning in listed if title != "±"]
    said = dict.fromkeys(text for result in results for text in method_summary.units(result))
    names = dict.fromkeys(name for result in results for name in result.errors)
    definitions = [f"  {name}: {definition(name)}" for name in names]
    return "\n".join(
        [*said, *meanings, "  ±: standard error over takes", "Methods:", *definitions, TOLD]
    )
