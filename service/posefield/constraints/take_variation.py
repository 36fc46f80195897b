"""Takes: other motions for the same question, drawn about the prediction as captured clips vary.

A take is a conditional simulation of the kriged coefficients: a seed stands for one smooth function
of the controls and labels, which is zero at captured clips up to the nugget.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import groupby
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.units import Floats, Indices, PointControls, PointLabels, PointValues, Values
from posefield.common.value_cache import ValueCache
from posefield.constraints.constrained_motion import CYCLE_VARIABLES, ConstrainedMotion
from posefield.constraints.gauss_newton import LevelCorrector
from posefield.inference import reduced_motion
from posefield.inference.session import Session
from posefield.kriging import random_field, support
from posefield.kriging.random_field import ConditionalField, Seeds
from posefield.model_file import onnx_file
from posefield.model_file.model_card import ModelCard
from posefield.question.motion_question import MotionQuestion
from posefield.validation.question_validation import ValidatedQuestion

FIELD_CACHE, DEVIATION_CACHE = 64, 4096
"""Numbers of cached fields, of about 200 kB each, and of deviations at one point, of 300 bytes. A
crowd asks for the same points in every frame.
"""
POINTS_TOGETHER = 512
"""Number of points at which a field is evaluated at once."""
FIELDS_TOGETHER = 8
"""Number of fields that are drawn at once: more of them outgrow a core's cache."""
DURATION_STREAM = 4
"""Stream of a seed for the duration, besides those of `random_field` and `reduced_motion`."""
EVENTFUL_TIMES = 3
"""Time functions of a motion without cycle that a take varies, the first ones. Residuals of further
ones are differences in footing and timing, which are no independent Gaussian numbers.
"""


@dataclass(frozen=True)
class TakeSettings:
    """Deviation of a motion from its prediction.

    seed: of the take; 0 for none. variety: its size; 1 for that of captured clips. detail: whether
    details that no control predicts are added. is_timed: whether a target at a time fixes the
    duration.
    """

    seed: int
    variety: float
    detail: bool
    is_timed: bool = False


_SeedPoint = tuple[int, bytes]


def _seed(seed_point: _SeedPoint) -> int:
    return seed_point[0]


DETAIL_CACHE = 512
"""Number of cached details, of 12 kB each: a crowd asks for the same ones in every frame."""


class TakeVariation:
    """Variation of the motions of one model.

    eventful_times: number of time functions, the first ones, that vary in a motion without cycle.
    """

    def __init__(self, session: Session, eventful_times: int = EVENTFUL_TIMES) -> None:
        self._session = session
        self._eventful_times = eventful_times
        self._field_cached = lru_cache(FIELD_CACHE)(self._field)
        self._deviations_cached = ValueCache[_SeedPoint, Values](DEVIATION_CACHE)
        self._detail_cached = lru_cache(DETAIL_CACHE)(self.details)

    def vary(
        self,
        corrector: LevelCorrector,
        motion: ConstrainedMotion,
        question: ValidatedQuestion,
        take: TakeSettings,
    ) -> ConstrainedMotion:
        """Return a take of a prediction at the controls and labels of its question."""
        if take.seed:
            seeds = np.array([take.seed])
            changes = self.changes(corrector, question.point, question.labels, seeds)
            numbers = motion.numbers + take.variety * changes[0]
            duration_factor = self.duration_factor(take, motion.state.duration)
            motion = replace(motion, numbers=numbers, is_take=True, duration_factor=duration_factor)
        if not take.detail:
            return motion
        detailed = replace(corrector.reduced, detail=self.detail(corrector, take.seed))
        return replace(motion, scene=replace(motion.scene, reduced=detailed))

    def duration_factor(self, take: TakeSettings, predicted: float) -> float:
        """Return the duration of a take over the predicted one, s; 1 for cycles.

        A seed is as slow or as fast at all controls, but no take lasts shorter or longer than
        captured clips, unless the prediction does.
        """
        card = self._session.card
        spread, (shortest, longest) = card.making.repeat_duration, card.durations
        if take.is_timed or not (take.seed and spread):
            return 1.0
        (normal,) = random_field.normals(take.seed, DURATION_STREAM, 1, 1)[0]
        factor = math.exp(take.variety * spread * normal)
        limits = min(shortest / predicted, 1.0), max(longest / predicted, 1.0)
        return min(max(factor, limits[0]), limits[1])

    def changes(
        self,
        corrector: LevelCorrector,
        controls: PointControls,
        labels: PointLabels,
        seeds: Annotated[Indices, "points"],
    ) -> Annotated[Floats, "points variables"]:
        """Return the changes (B, numbers) of motions at controls (B, d) and labels (B, p).

        seeds (B,): of their takes; zero changes nothing.
        """
        deviations = self.deviations(controls, labels, seeds)
        card, (times, freedoms, modes) = self._session.card, corrector.reduced.core.shape
        # A coarser level has the leading coefficients, and these have the leading part of the root.
        count = min(modes, corrector.spread.residuals.shape[1])
        motions = deviations[:, :count] @ corrector.spread.residuals.T
        if not card.cyclic:
            motions.reshape(-1, times, freedoms)[:, self._eventful_times :] = 0.0
            return motions
        # Files of earlier versions have no joint root; their cycles last and travel as predicted.
        root = np.array(card.making.take_root or np.zeros((CYCLE_VARIABLES, deviations.shape[1])))
        return np.hstack([motions, deviations @ root.T])

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
        limited = np.asarray(self._session.bounds.limit(controls), np.float64)
        points = support.half_ranges(limited, *self._session.card.sampled_ranges)
        names = np.broadcast_to(labels[:, None], (*points.shape[:2], labels.shape[1]))
        points = np.concatenate([points, names], axis=-1)
        values = np.zeros((*points.shape[:2], self._count))
        varied = np.flatnonzero(seeds)
        for first in range(0, len(varied), FIELDS_TOGETHER):
            cancellation.check()
            some = varied[first : first + FIELDS_TOGETHER]
            fields = random_field.simulate(self._session.kriging_weights, seeds[some], self._count)
            values[some] = self._root_of_sill * fields.evaluate(points[some])
        return values[..., : self._session.card.levels[0].ranks[2]]

    def details(self, seeds: Seeds) -> Annotated[Floats, "*seeds frames freedoms"]:
        """Return the details (..., T, r1) of seeds (...,), at the finest level."""
        card = self._session.card
        return reduced_motion.sample(reduced_motion.deviations(card), card.frames, seeds)

    def detail(self, corrector: LevelCorrector, seed: int) -> Annotated[Floats, "frames freedoms"]:
        """Return the detail (T, r1) of a seed."""
        return self._detail_cached(seed)[:, : len(corrector.reduced.directions)]

    def deviations(
        self, controls: PointControls, labels: PointLabels, seeds: Annotated[Indices, "points"]
    ) -> PointValues:
        """Return the deviations (B, m) of takes at controls (B, d) and labels (B, p).

        They are uncorrelated, each with the variance of sigma, m²: of the coefficients of the
        finest level, and of a cycle's duration and travel. Zero for seeds (B,) of zero.
        """
        limited = np.asarray(self._session.bounds.limit(controls), np.float64)
        points = support.half_ranges(limited, *self._session.card.sampled_ranges)
        rows = np.hstack([points, labels])
        values = np.zeros((len(rows), self._count))
        varied = np.flatnonzero(seeds).tolist()
        # As bytes, whose hash is computed once.
        keys = [(int(seeds[row]), rows[row].tobytes()) for row in varied]
        if keys:
            values[varied] = self._deviations_cached.find_all(keys, self._deviations)
        return values

    def _deviations(self, seed_points: Sequence[_SeedPoint]) -> list[Values]:
        """Return the deviations (m,) at points of seeds, each as it is alone."""
        by_point: dict[_SeedPoint, Values] = {}
        # Takes of one seed come one after another, while its field is in the cache.
        for seed, some in groupby(sorted(seed_points, key=_seed), key=_seed):
            of_seed = list(some)
            for first in range(0, len(of_seed), POINTS_TOGETHER):
                cancellation.check()
                batch = of_seed[first : first + POINTS_TOGETHER]
                points = np.array([np.frombuffer(point) for _, point in batch])
                values = self._root_of_sill * self._field_cached(seed).evaluate_each(points)
                # Copied: a part of an array would keep the whole in memory.
                by_point.update(zip(batch, map(np.copy, values), strict=True))
        return [by_point[seed_point] for seed_point in seed_points]

    @property
    def _count(self) -> int:
        card = self._session.card
        return card.levels[0].ranks[2] + len(card.beside)

    def _field(self, seed: int) -> ConditionalField:
        return random_field.simulate(self._session.kriging_weights, seed, self._count)

    @cached_property
    def _root_of_sill(self) -> float:
        sill = onnx_file.initializers(self._session.content)["sill"]
        return float(np.sqrt(sill.item()))


def change_coefficients(
    corrector: LevelCorrector, deviations: Annotated[Floats, "points values"]
) -> Annotated[Floats, "points modes"]:
    """Return the changes (B, r3) of a level's coefficients by deviations (B, m) of the finest."""
    root = corrector.spread.coefficients
    # A coarser level has the leading coefficients, and these have the leading part of the root.
    return np.asarray(deviations[:, : len(root)] @ root.T)


def settings(card: ModelCard, question: MotionQuestion) -> TakeSettings | None:
    """Return the take of a question, or None for the prediction."""
    take = TakeSettings(
        question.take,
        question.variety,
        question.detail and bool(card.making.detail),
        any(not isinstance(target.when, str) for target in question.targets),
    )
    return take if take.seed or take.detail else None
