"""Variation of a predicted motion: another take of it, and details that no control predicts."""

from dataclasses import replace

import numpy as np

from posefield.common.array_shapes import Values, Variables
from posefield.common.errors import InvalidField
from posefield.constraints.constrained_motion import ConstrainedMotion, LevelCorrector
from posefield.constraints.motion_variables import CYCLE_VARIABLES
from posefield.inference import motion_detail
from posefield.inference.session import Session
from posefield.inference.takes import EVENTFUL_TIMES, TakeSampler, TakeSettings
from posefield.kriging import random_field
from posefield.model_file.model_card import ModelCard
from posefield.question.motion_question import MAX_TAKE, MotionQuestion
from posefield.validation.question_validation import ValidatedQuestion


class TakeVariation:
    """Variation of the motions of one model."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._sampler = TakeSampler(session)

    def vary(
        self,
        bench: LevelCorrector,
        begun: ConstrainedMotion,
        question: ValidatedQuestion,
        take: TakeSettings,
    ) -> ConstrainedMotion:
        """Return a take of a prediction at the controls and labels of its question."""
        if take.seed:
            by = self._sampler.deviations(question.point, question.labels, take.seed)
            moved = begun.numbers + take.variety * self._change(bench, by)
            begun = replace(begun, numbers=moved)
        return self._with_detail(bench, begun, take.seed) if take.detail else begun

    def _change(self, bench: LevelCorrector, by: Values) -> Variables:
        """Return the change of a motion's variables; by (m,): `TakeSampler.deviations`."""
        card, (times, freedoms, modes) = self._session.card, bench.reduced.core.shape
        # A coarser level has the leading coefficients, and these have the leading part of the root.
        count = min(modes, bench.spread.residuals.shape[1])
        motion = (bench.spread.residuals @ by[:count]).reshape(times, freedoms)
        if not card.cyclic:
            motion[EVENTFUL_TIMES:] = 0.0
            return motion.ravel()
        # Files of earlier versions have no joint root; their cycles last and travel as predicted.
        root = np.array(card.making.take_root or np.zeros((CYCLE_VARIABLES, len(by))))
        return np.concatenate([motion.ravel(), root @ by])

    def _with_detail(
        self, bench: LevelCorrector, begun: ConstrainedMotion, seed: int
    ) -> ConstrainedMotion:
        """Return the motion with the detail of a seed in every pose."""
        reduced = bench.reduced
        found = motion_detail.deviations(self._session.card)[:, : len(reduced.directions)]
        sampled = motion_detail.sample(found, reduced.frames, seed)
        scene = replace(begun.scene, reduced=replace(reduced, detail=sampled))
        return replace(begun, scene=scene)


def check(card: ModelCard, asked: MotionQuestion) -> None:
    """Raise InvalidField for a seed or a variety out of range, and for a model without takes."""
    if not 0 <= asked.take <= MAX_TAKE:
        raise InvalidField("take", f"{asked.take}, expected 0 to {MAX_TAKE}")
    if not 0.0 <= asked.variety <= 1.0:
        raise InvalidField("variety", f"{asked.variety:g}, expected 0 to 1")
    if asked.take and not random_field.has_features(card.kriging):
        found = card.kriging.covariance
        raise InvalidField("take", f"{asked.take}, but no takes can be drawn of {found} kriging")


def settings(card: ModelCard, asked: MotionQuestion) -> TakeSettings | None:
    """Return the take of a question, or None for the prediction."""
    found = TakeSettings(asked.take, asked.variety, asked.detail and bool(card.making.detail))
    return found if found.seed or found.detail else None
