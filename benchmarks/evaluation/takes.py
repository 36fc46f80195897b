"""Takes of the service for held-out clips, compared with the captured motion."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec import structs

from evaluation import field_statistics, standing_feet
from evaluation.field_statistics import FieldStatistics
from evaluation.foot_quality import FootQuality
from evaluation.standing_feet import MeasuredJoints
from posefield.constraints.take_variation import TakeSettings, TakeVariation
from posefield.inference import session
from posefield.kriging import random_field
from posefield.motion.clip import Clip, assemble
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.report.significant_digits import round_number
from posefield_train.source.ingest import Example

RATE = 30.0
"""Frames a second: a clip's default. Motions are stored at about 30 to 55 frames a second, so that
acceleration at higher rates is that of the interpolation.
"""
FIRST_SEED = 1
"""Seed of the first held-out clip; each has its own, since clips of one seed vary alike."""


@dataclass(frozen=True)
class TakeAnswer:
    """Measures of a held-out clip: as captured, predicted, and as a take.

    predicted: with feet as predicted. take, sliding: with standing feet, and with feet as
    predicted. unlimited: `sliding` with all time functions varied, a negative control; None for
    cycles, of which all are. detailed: the prediction with detail. detailed_take: the take with
    detail, with standing feet. Both are None for models without detail.
    """

    captured: FootQuality
    predicted: FootQuality
    take: FootQuality
    sliding: FootQuality
    unlimited: FootQuality | None
    detailed: FootQuality | None
    detailed_take: FootQuality | None


@dataclass(frozen=True)
class TakeResults:
    """Takes of the held-out clips of a fold, and the random fields that its model draws them of.

    fields: None for a covariance that no takes can be drawn of, and for few samples. clips is empty
    for such a covariance, and without feet that can stand.
    """

    clips: Sequence[TakeAnswer]
    fields: FieldStatistics | None


def take_results(
    name: str, file: bytes, held_out: Sequence[Example], indices: Sequence[int]
) -> TakeResults:
    """Return the takes of a model file for held-out clips, whose indices are `places`."""
    model = Synthesizer(name, session.open_bytes(file, name))
    card = model.session.card
    seeds = [FIRST_SEED + index for index in indices]
    fields = field_statistics.measure(model.session.kriging_weights, seeds[0])
    joints = standing_feet.measured_joints(card)
    if joints is None or not random_field.has_features(card.kriging):
        return TakeResults((), fields)
    answers = [
        _take_answer(_Asked(model, example, seed), joints)
        for example, seed in zip(held_out, seeds, strict=True)
    ]
    return TakeResults(answers, fields)


@dataclass(frozen=True)
class _Asked:
    """A model, a held-out clip, and the seed of its take."""

    model: Synthesizer
    example: Example
    seed: int

    @property
    def plain(self) -> ClipQuestion:
        """Return the question for the prediction, with feet as predicted."""
        return standing_feet.question(self.model, self.example, RATE)

    @property
    def taken(self) -> ClipQuestion:
        """Return the question for the take, with feet as predicted."""
        return structs.replace(self.plain, take=self.seed)


def _take_answer(task: _Asked, joints: MeasuredJoints) -> TakeAnswer:
    model, timings = task.model, task.taken
    standing = structs.replace(timings, feet="stand")
    has_detail = bool(model.session.card.making.detail)

    def measured(question: ClipQuestion) -> FootQuality:
        return joints.measure(clips.synthesize_clip(model, question).clip, RATE)

    def detailed(question: ClipQuestion) -> FootQuality | None:
        return measured(structs.replace(question, detail=True)) if has_detail else None

    cyclic = model.session.card.cyclic
    return TakeAnswer(
        joints.measure(task.example.captured or task.example.clip, RATE),
        measured(task.plain),
        measured(standing),
        measured(timings),
        None if cyclic else joints.measure(_unlimited(model, timings), RATE),
        detailed(task.plain),
        detailed(standing),
    )


def _unlimited(model: Synthesizer, clip_question: ClipQuestion) -> Clip:
    """Return a take that varies all time functions of a motion without cycle."""
    question, solver = model.question(clip_question), model.solver
    corrector, card = solver.corrector(question.level), model.session.card
    state = model.session.state(question.point, np.zeros(1), question.labels, question.level)
    variation = TakeVariation(model.session, len(corrector.reduced.core))
    settings = TakeSettings(clip_question.take, clip_question.variety, detail=False)
    corrected = variation.vary(corrector, corrector.predict(state), question, settings)
    times = np.arange(0.0, corrected.duration, 1.0 / clip_question.fps)
    trust = structs.replace(model.constrained_trust(clip_question, question, corrected), targets=())
    (answer,) = solver.poses([(question, corrected, times, trust)])
    return assemble(
        card.skeleton,
        answer.rotations,
        answer.root_position,
        answer.bone_offsets,
        clip_question.fps,
    )


MEASURES: dict[str, Callable[[FootQuality], float]] = {
    "acceleration": lambda quality: quality.acceleration,
    "skate": lambda quality: quality.skate,
    "weighted_skate": lambda quality: quality.weighted_skate,
}
"""Measures that are given as a ratio of means over clips."""
ANSWERS = ("predicted", "take", "sliding", "unlimited", "detailed", "detailed_take")
"""Answers that are compared with the captured clips, as `TakeAnswer` names them."""
PLAIN = {"detailed": "predicted", "detailed_take": "take"}
"""Answers in place of those with detail, of a fold whose model has none."""


def facts(clips: Sequence[TakeAnswer], fields: Sequence[FieldStatistics]) -> dict[str, Any]:
    """Return the figures by name, ratios all of them; empty without takes.

    clips: of all folds; empty without feet that can stand. fields: of each fold's model; empty for
    models of few samples. Ranges are the least and the greatest of the bins of distance, each the
    mean over folds. In `controls` are the negative controls of the fields.
    """
    return (_field_facts(fields) if fields else {}) | (_clip_facts(clips) if clips else {})


def _field_facts(fields: Sequence[FieldStatistics]) -> dict[str, Any]:
    def mean(name: str) -> float:
        return round_number(np.mean([getattr(one, name) for one in fields]))

    def least_and_most(name: str) -> list[float]:
        bins = np.mean([getattr(one, name) for one in fields], axis=0)
        return [round_number(bins.min()), round_number(bins.max())]

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
    def ratio(name: str, value: Callable[[FootQuality], float]) -> float:
        captured = float(np.mean([value(one.captured) for one in clips]))
        answers = [getattr(one, name) or getattr(one, PLAIN.get(name, name)) for one in clips]
        return round_number(np.mean([value(one) for one in answers]) / max(captured, 1e-9))

    names = [name for name in ANSWERS if any(getattr(one, name) is not None for one in clips)]
    ratios = {key: {name: ratio(name, value) for name in names} for key, value in MEASURES.items()}
    return {"clips": len(clips), "frames_per_second": RATE, **ratios}
