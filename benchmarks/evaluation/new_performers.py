"""Error reduction by the name of a performer, and by a few clips of a new performer."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from evaluation.methods import ADAPTATION_COUNTS, ASKED_OPEN, NO_PERFORMER
from posefield.common.units import Floats, Indices
from posefield.kriging.support import half_ranges
from posefield_train.adapt import adaptation, canonical_clips
from posefield_train.evaluate import predictions, summary
from posefield_train.evaluate.motion_errors import ComparedMotion
from posefield_train.evaluate.predictions import OURS, Queries
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_points
from posefield_train.report.significant_digits import round_number
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.source.recipe_sections import PERFORMER
from posefield_train.training import train_examples

MIN_OTHER_TAKES = 3
"""Fewest other takes of the performer for which a clip is predicted."""


def predict_unnamed(
    recipe: Recipe, trained: TrainedModel, clips: Sequence[Example], queries: Queries
) -> dict[str, list[ComparedMotion]]:
    """Return answers without performers: of a model trained without them, and of the same model.

    shown: examples of the training. Empty if the model does not distinguish performers.
    """
    if PERFORMER not in trained.model.bank.labels:
        return {}
    rest = [
        {name: label for name, label in labels.items() if name != PERFORMER}
        for labels in queries.labels
    ]
    unnamed = replace(queries, labels=rest)
    alone = [name for name in recipe.kriging.label if name != PERFORMER]
    kriging = recipe.kriging.model_copy(update={"label": alone})
    plain = recipe.model_copy(update={"kriging": kriging})
    untold = train_examples(plain, clips)
    return {
        NO_PERFORMER: predictions.predict_posefield(untold, unnamed),
        ASKED_OPEN: predictions.predict_posefield(trained, unnamed),
    }


def predict_adapted(
    recipe: Recipe, trained: TrainedModel, held_out: Sequence[Example]
) -> dict[str, list[ComparedMotion | None]]:
    """Return the motions of held-out clips by models adapted with some of the others.

    None if there are too few others. Empty if the model does not distinguish performers.
    """
    if PERFORMER not in trained.model.bank.labels:
        return {}
    if len(np.unique(sample_points.recording_numbers(held_out))) <= MIN_OTHER_TAKES:
        return {name: [None] * len(held_out) for name in ADAPTATION_COUNTS}
    adaptable = canonical_clips.adaptable(trained)
    return {
        name: _motions(recipe, trained, adaptable, held_out, count)
        for name, count in ADAPTATION_COUNTS.items()
    }


def _motions(
    recipe: Recipe,
    trained: TrainedModel,
    adaptable: canonical_clips.AdaptableModel,
    held_out: Sequence[Example],
    count: int,
) -> list[ComparedMotion | None]:
    models: dict[tuple[int, ...], TrainedModel] = {}
    motions: list[ComparedMotion | None] = []
    for index, example in enumerate(held_out):
        indices = choose_clips(held_out, index, count)
        if indices not in models:
            adapted = adaptation.adapt(
                adaptable, [held_out[i] for i in indices], example.row.performer
            )
            models[indices] = replace(trained, model=adapted.model)
        queries = Queries(example.controls[None], [example.row.labels])
        motions += predictions.predict_posefield(models[indices], queries)
    return motions


def choose_clips(held_out: Sequence[Example], index: int, count: int) -> tuple[int, ...]:
    """Return the indices of `count` clips to adapt with, from different takes than the asked one.

    The first is the nearest to the mean of the controls; each further one is the farthest from
    those before it. Fewer if there are fewer takes.
    """
    takes, points = sample_points.recording_numbers(held_out), _points(held_out)
    chosen: list[int] = []
    while len(chosen) < count:
        left = _other_takes(takes, [index, *chosen])
        if not len(left):
            break
        if chosen:
            distances = np.linalg.norm(points[left, None] - points[chosen], axis=-1).min(axis=1)
        else:
            distances = -np.linalg.norm(points[left] - points[left].mean(axis=0), axis=-1)
        # Rounded, so that rounding errors do not decide ties.
        chosen.append(int(left[np.argmax(np.round(distances, 9))]))
    return tuple(sorted(chosen))


def _other_takes(takes: Indices, timings: list[int]) -> Indices:
    return np.flatnonzero(~np.isin(takes, takes[timings]))


def _points(held_out: Sequence[Example]) -> Floats:
    """Return the controls (k, d) in half-ranges of these clips."""
    controls = np.stack([example.controls for example in held_out])
    low, high = controls.min(axis=0), controls.max(axis=0)
    return half_ranges(controls, low, np.where(high > low, high, low + 1.0))


def facts(results: Sequence[EvaluationResult]) -> dict[str, Any]:
    """Return the error reduction by performer names and by clips of new performers.

    Empty unless both protocols were run on a model that distinguishes performers.
    """
    by_name = {result.protocol: result for result in results}
    clips, rest = (by_name.get(f"leave_one_{unit}_out") for unit in ("clip", "performer"))
    if not clips or not rest or ASKED_OPEN not in clips.errors:
        return {}
    everyone = clips.predicted(ASKED_OPEN)
    known_performer, unnamed = (
        _mean_distance(clips, name, everyone) for name in (OURS, ASKED_OPEN)
    )
    figures: dict[str, Any] = {"named_nearer": round_number(1.0 - known_performer / unnamed)}
    for name in ADAPTATION_COUNTS:
        if predicted := rest.predicted(name):
            adapted, none = (_mean_distance(rest, row, predicted) for row in (name, OURS))
            distance = _mean_distance(clips, OURS, predicted)
            figures[name] = {
                "clips": len(predicted),
                "relative_cm": summary.centimetres(adapted),
                "shown_none_cm": summary.centimetres(none),
                "shown_all_cm": summary.centimetres(distance),
                "farther_than_all": round_number(adapted / distance - 1.0),
            }
    return figures


def _mean_distance(result: EvaluationResult, name: str, clips: Sequence[int]) -> float:
    return float(summary.clip_distances(result, result.of(name, clips)).mean())
