"""Variation of a predicted motion: another take of it, and details that no control predicts."""

from dataclasses import asdict, replace
from functools import lru_cache
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PointControls, PointLabels
from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.constraints.constrained_motion import ConstrainedMotion, LevelCorrector
from posefield.constraints.motion_variables import CYCLE_VARIABLES
from posefield.inference import reduced_motion
from posefield.inference.session import Session
from posefield.inference.takes import EVENTFUL_TIMES, TakeSampler, TakeSettings
from posefield.kriging import random_field
from posefield.model_file.model_card import ModelCard
from posefield.question.motion_question import MotionQuestion
from posefield.question.value_validation import check_take
from posefield.validation.question_validation import ValidatedQuestion

DETAIL_CACHE = 512
"""Number of cached details, of 12 kB each: a crowd asks for the same ones in every frame."""


class TakeVariation:
    """Variation of the motions of one model.

    eventful_times: number of time functions, the first ones, that vary in a motion without cycle.
    """

    def __init__(self, session: Session, eventful_times: int = EVENTFUL_TIMES) -> None:
        self._session = session
        self._eventful_times = eventful_times
        self._sampler = TakeSampler(session)
        self._detail_cached = lru_cache(DETAIL_CACHE)(self._detail)

    def vary(
        self,
        bench: LevelCorrector,
        begun: ConstrainedMotion,
        question: ValidatedQuestion,
        take: TakeSettings,
    ) -> ConstrainedMotion:
        """Return a take of a prediction at the controls and labels of its question."""
        if take.seed:
            seeds = np.array([take.seed])
            changes = self.changes(bench, question.point, question.labels, seeds)
            moved = begun.numbers + take.variety * changes[0]
            scene = replace(begun.scene, predicted=begun.numbers)
            begun = replace(begun, scene=scene, numbers=moved)
        if not take.detail:
            return begun
        detailed = replace(bench.reduced, detail=self.detail(bench, take.seed))
        return replace(begun, scene=replace(begun.scene, reduced=detailed))

    def changes(
        self,
        bench: LevelCorrector,
        controls: PointControls,
        labels: PointLabels,
        seeds: Annotated[Indices, "points"],
    ) -> Annotated[Floats, "points variables"]:
        """Return the changes (B, numbers) of motions at controls (B, d) and labels (B, p).

        seeds (B,): of their takes; zero changes nothing.
        """
        by = self._sampler.deviations(controls, labels, seeds)
        card, (times, freedoms, modes) = self._session.card, bench.reduced.core.shape
        # A coarser level has the leading coefficients, and these have the leading part of the root.
        count = min(modes, bench.spread.residuals.shape[1])
        motions = by[:, :count] @ bench.spread.residuals.T
        if not card.cyclic:
            motions.reshape(-1, times, freedoms)[:, self._eventful_times :] = 0.0
            return motions
        # Files of earlier versions have no joint root; their cycles last and travel as predicted.
        root = np.array(card.making.take_root or np.zeros((CYCLE_VARIABLES, by.shape[1])))
        return np.hstack([motions, by @ root.T])

    def along_paths(
        self,
        controls: Annotated[Floats, "paths points controls"],
        labels: Annotated[Floats, "paths labels"],
        seeds: Annotated[Indices, "paths"],
    ) -> Annotated[Floats, "paths points modes"]:
        """Return deviations (N, B, r3) of a cycle's coefficients along paths of controls (N, B, d).

        They are uncorrelated, each with the variance of sigma: `change_coefficients` correlates
        them. labels (N, p) and seeds (N,): one of each path; zero for seeds of zero.
        """
        modes = self._session.card.levels[0].ranks[2]
        return self._sampler.along(controls, labels, seeds)[..., :modes]

    def details(
        self, seeds: Annotated[Indices, "paths"]
    ) -> Annotated[Floats, "paths frames freedoms"]:
        """Return the details (N, T, r1) of seeds (N,), at the finest level."""
        card = self._session.card
        return reduced_motion.sample(reduced_motion.deviations(card), card.frames, seeds)

    def detail(self, bench: LevelCorrector, seed: int) -> Annotated[Floats, "frames freedoms"]:
        """Return the detail (T, r1) of a seed."""
        return self._detail_cached(seed)[:, : len(bench.reduced.directions)]

    def _detail(self, seed: int) -> Annotated[Floats, "frames freedoms"]:
        card = self._session.card
        return reduced_motion.sample(reduced_motion.deviations(card), card.frames, seed)


def change_coefficients(
    bench: LevelCorrector, by: Annotated[Floats, "points values"]
) -> Annotated[Floats, "points modes"]:
    """Return the changes (B, r3) of a level's coefficients by deviations (B, m) of the finest."""
    root = bench.spread.coefficients
    # A coarser level has the leading coefficients, and these have the leading part of the root.
    return np.asarray(by[:, : len(root)] @ root.T)


def check(card: ModelCard, asked: MotionQuestion) -> None:
    """Raise InvalidField for a seed or a variety out of range, and for a model without takes."""
    check_take(asked.take, asked.variety)
    if asked.take and not random_field.has_features(card.kriging):
        found = card.kriging.covariance
        raise InvalidField("take", f"{asked.take}, but no takes can be drawn of {found} kriging")


def facts(card: ModelCard, asked: MotionQuestion) -> dict[str, float]:
    """Return seed, variety and detail of a take for the answer; empty for the prediction."""
    found = settings(card, asked)
    return {} if found is None else asdict(found)


def settings(card: ModelCard, asked: MotionQuestion) -> TakeSettings | None:
    """Return the take of a question, or None for the prediction."""
    found = TakeSettings(asked.take, asked.variety, asked.detail and bool(card.making.detail))
    return found if found.seed or found.detail else None
