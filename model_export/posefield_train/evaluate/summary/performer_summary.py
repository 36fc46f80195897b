"""Error reduction by names of performers, and by clips of new performers."""

from collections.abc import Sequence
from typing import Any

from posefield_train.evaluate.methods import ASKED_OPEN, OURS
from posefield_train.evaluate.new_performers import ADAPTATION_COUNTS
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.evaluate.summary import evaluation_summary
from posefield_train.evaluate.summary.method_summary import centimetres
from posefield_train.report.drawing import significant_digits


def performer_facts(results: Sequence[EvaluationResult]) -> dict[str, Any]:
    """Return the error reduction by performer names and by clips of new performers.

    Empty unless both protocols were run on a model that distinguishes performers.
    """
    by_name = {result.protocol: result for result in results}
    clips, others = (by_name.get(f"leave_one_{held}_out") for held in ("clip", "performer"))
    if not clips or not others or ASKED_OPEN not in clips.errors:
        return {}
    everyone = clips.asked(ASKED_OPEN)
    named, unnamed = (_mean_distance(clips, name, everyone) for name in (OURS, ASKED_OPEN))
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
    own, none = (_mean_distance(others, one, places) for one in (name, OURS))
    whole = _mean_distance(clips, OURS, places)
    return {
        "clips": len(places),
        "relative_cm" if clips.has_positions else "curves_cm": centimetres(own),
        "shown_none_cm": centimetres(none),
        "shown_all_cm": centimetres(whole),
        "farther_than_all": significant_digits.round_number(own / whole - 1.0),
    }


def _mean_distance(result: EvaluationResult, name: str, places: Sequence[int]) -> float:
    return float(evaluation_summary.clip_distances(result, result.of(name, places)).mean())


def _adapted_cm(facts: dict[str, Any]) -> float:
    found: float = facts["relative_cm"] if "relative_cm" in facts else facts["curves_cm"]
    return found


def performer_text(results: Sequence[EvaluationResult]) -> list[str]:
    """Return the performer facts, a sentence each."""
    found = performer_facts(results)
    if not found:
        return []
    return [
        f"with the performer's name the error is {100 * found['named_nearer']:.1f} % smaller",
        *(
            f"{name}: {_adapted_cm(one):.2f} cm on {one['clips']} clips; without clips of the "
            f"performer {one['shown_none_cm']:.2f} cm; trained with all other clips "
            f"{one['shown_all_cm']:.2f} cm ({100 * one['farther_than_all']:+.1f} %)"
            for name in ADAPTATION_COUNTS
            if (one := found.get(name))
        ),
    ]
