"""Answers of the service with feet as predicted and with standing feet, for held-out clips."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from evaluation import foot_quality
from evaluation.foot_quality import FootQuality
from posefield.feet import footsteps
from posefield.inference import session
from posefield.model_file.model_card import ModelCard
from posefield.motion.clip import Clip
from posefield.question.motion_question import ClipQuestion, FeetMode, LabelValue
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.evaluate import motion_errors
from posefield_train.report.significant_digits import round_number
from posefield_train.source.ingest import Example

NO_LIMIT = 1e6
"""Duration of a swing, s, that none exceeds."""
NAMES = ("predicted", "standing", "locked")
"""Answers that are compared with captured clips."""
RATIOS: dict[str, Callable[[FootQuality], float]] = {
    "skate": lambda quality: quality.skate,
    "weighted_skate": lambda quality: quality.weighted_skate,
    "acceleration": lambda quality: quality.acceleration,
    "first_frames": lambda quality: quality.first,
    "last_frames": lambda quality: quality.last,
    "knee_peak": lambda quality: quality.knee_peak,
    "knee_mean": lambda quality: quality.knee_mean,
}
"""Measures that are given as a ratio of means over clips."""


@dataclass(frozen=True)
class FeetAnswer:
    """Measures of one held-out clip: as captured, as predicted, and with standing feet.

    locked: with feet that keep their places in contacts, whose swings are as predicted, neither
    shortened nor lifted as captured ones; a negative control of the rules of swings.
    predicted_error, standing_error: mean relative distance from the captured clip after time
    warping, m. lowered: largest distance by which the pelvis was lowered, m.
    """

    captured: FootQuality
    predicted: FootQuality
    standing: FootQuality
    locked: FootQuality
    predicted_error: float
    standing_error: float
    lowered: float


def feet_answers(name: str, file: bytes, held_out: Sequence[Example]) -> list[FeetAnswer]:
    """Return the answers of a model file for held-out clips, with their labels known.

    Empty for a model whose feet do not stand: in place, without feet, or without legs.
    """
    model = Synthesizer(name, session.open_bytes(file, name))
    joints = measured_joints(model.session.card)
    if joints is None:
        return []
    locked = _without_swing_rules(model)
    return [_feet_answer(model, locked, example, joints) for example in held_out]


@dataclass(frozen=True)
class MeasuredJoints:
    """Indices of the joints that `foot_quality` measures: feet and knees, one for each leg."""

    feet: tuple[int, ...]
    knees: tuple[int, ...]

    def measure(self, clip: Clip, rate: float) -> FootQuality:
        """Return the measures of a clip at a frame rate."""
        return foot_quality.measure(clip, rate, self.feet, self.knees)


def measured_joints(card: ModelCard) -> MeasuredJoints | None:
    """Return the feet and knees of a character whose feet can stand, else None.

    Feet stand in motions that travel, at the ends of legs.
    """
    skeleton = card.skeleton
    legs = footsteps.choose_limbs(skeleton.parents, skeleton.offsets, card.feet, ())[0].legs
    if not legs or card.root != "travelling":
        return None
    return MeasuredJoints(tuple(leg.tip for leg in legs), tuple(leg.middle for leg in legs))


def _feet_answer(
    model: Synthesizer, locked: Synthesizer, example: Example, joints: MeasuredJoints
) -> FeetAnswer:
    clip = example.captured or example.clip
    rate = min(foot_quality.HIGHEST_RATE, clip.rate)
    standing_question = question(model, example, rate, "stand")
    predicted = clips.synthesize_clip(model, question(model, example, rate))
    standing = clips.synthesize_clip(model, standing_question)
    report = standing.trust.feet
    return FeetAnswer(
        joints.measure(clip, rate),
        joints.measure(predicted.clip, rate),
        joints.measure(standing.clip, rate),
        joints.measure(clips.synthesize_clip(locked, standing_question).clip, rate),
        _relative_distance(predicted.clip, clip),
        _relative_distance(standing.clip, clip),
        report.lowered if report else 0.0,
    )


def _relative_distance(clip: Clip, captured: Clip) -> float:
    """Return the mean distance of a clip from a captured one after time warping, m."""
    one, other = (motion_errors.motion_of_clip(motion, None) for motion in (clip, captured))
    return motion_errors.compare_motions(one, other, ()).relative.mean


def _without_swing_rules(model: Synthesizer) -> Synthesizer:
    """Return the model without the captured swings' durations and clearance."""
    card = model.session.card
    free = tuple(
        replace(contact, longest_swing=NO_LIMIT, clearance=0.0) for contact in card.contacts
    )
    return Synthesizer(model.name, replace(model.session, card=replace(card, contacts=free)))


def question(
    model: Synthesizer, example: Example, rate: float, feet: FeetMode = "as_predicted"
) -> ClipQuestion:
    """Return the question for a held-out clip, at a frame rate and without targets."""
    card = model.session.card
    label_names = {label_set.name: set(label_set.names) for label_set in card.labels}
    labels: dict[str, LabelValue] = {
        name: value
        for name, value in example.row.labels.items()
        if value in label_names.get(name, ())
    }
    controls = {
        control.name: float(value)
        for control, value in zip(card.controls, example.controls, strict=True)
    }
    return ClipQuestion(
        controls=controls, labels=labels, extrapolate="ok", exact="none", fps=rate, feet=feet
    )


def facts(answers: Sequence[FeetAnswer]) -> dict[str, Any]:
    """Return the figures by name: centimetres, centimetres a second, ratios; empty without feet."""
    if not answers:
        return {}
    figures: dict[str, Any] = {
        "clips": len(answers),
        "captured_skate_cm_per_s": _centimetres([one.captured.skate for one in answers]),
        "predicted_error_cm": _centimetres([one.predicted_error for one in answers]),
        "standing_error_cm": _centimetres([one.standing_error for one in answers]),
        "lowered_worst_cm": round_number(100.0 * max(one.lowered for one in answers)),
        "lowest_cm": {
            name: round_number(100.0 * min(getattr(one, name).lowest for one in answers))
            for name in ("captured", *NAMES)
        },
    }
    for key, value in RATIOS.items():
        captured = max(float(np.mean([value(one.captured) for one in answers])), 1e-9)
        figures[key] = {
            name: round_number(np.mean([value(getattr(one, name)) for one in answers]) / captured)
            for name in NAMES
        }
    for name in NAMES:
        peaks = [getattr(one, name).peak / max(one.captured.peak, 1e-9) for one in answers]
        figures.setdefault("peak", {})[name] = round_number(np.mean(peaks))
        figures.setdefault("worst_peak", {})[name] = round_number(max(peaks))
    return figures


def _centimetres(metres: Sequence[float]) -> float:
    return round_number(100.0 * float(np.mean(metres)))
