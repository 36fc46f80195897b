"""Predictions without a performer, and of a model adapted to a new performer with a few clips."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.kriging.kriging_model import half_ranges
from posefield_train.adapt import adaptation, canonical_clips
from posefield_train.evaluate import methods
from posefield_train.evaluate.compared_motion import Motion
from posefield_train.evaluate.methods import Asked
from posefield_train.graph.trained_model import Trained
from posefield_train.kriging import sample_points
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

NOBODY = "posefield_no_performer"
SHOWN = {"posefield_adapt_1": 1, "posefield_adapt_3": 3, "posefield_adapt_5": 5}
"""Number of clips that each method adapts with."""
FEWEST = 3
"""Fewest other takes of the performer for which a clip is predicted."""


def unnamed(recipe: Recipe, trained: Trained, asked: Asked) -> dict[str, list[Motion]]:
    """Return the answers without performers; empty if the model does not distinguish them."""
    if not trained.model.bank.performers:
        return {}
    nobody = [""] * len(asked.performers)
    return {NOBODY: methods.ours(recipe, trained, replace(asked, performers=nobody))}


def adapted(
    recipe: Recipe, trained: Trained, held: Sequence[Example]
) -> dict[str, list[Motion | None]]:
    """Return the motions of held-out clips by models adapted with some of the others.

    None if there are too few others. Empty if the model does not distinguish performers.
    """
    if not trained.model.bank.performers:
        return {}
    if len(np.unique(sample_points.takes(held))) <= FEWEST:
        return {name: [None] * len(held) for name in SHOWN}
    known = canonical_clips.known(recipe, trained)
    return {name: _motions(recipe, trained, known, held, count) for name, count in SHOWN.items()}


def _motions(
    recipe: Recipe,
    trained: Trained,
    known: canonical_clips.Known,
    held: Sequence[Example],
    count: int,
) -> list[Motion | None]:
    models: dict[tuple[int, ...], Trained] = {}
    found: list[Motion | None] = []
    for place, example in enumerate(held):
        shown = choose(held, place, count)
        if shown not in models:
            own = adaptation.adapt(known, [held[i] for i in shown], example.row.performer)
            models[shown] = replace(trained, model=own.model)
        asked = Asked(example.controls[None], [example.row.performer])
        found += methods.ours(recipe, models[shown], asked)
    return found


def choose(held: Sequence[Example], asked: int, count: int) -> tuple[int, ...]:
    """Return the indices of `count` clips to adapt with, from different takes than the asked one.

    The first is the nearest to the mean of the controls; each further one is the farthest from
    those before it. Fewer if there are fewer takes.
    """
    takes, points = sample_points.takes(held), _points(held)
    chosen: list[int] = []
    while len(chosen) < count:
        left = _others(takes, [asked, *chosen])
        if not len(left):
            break
        if chosen:
            apart = np.linalg.norm(points[left, None] - points[chosen], axis=-1).min(axis=1)
        else:
            apart = -np.linalg.norm(points[left] - points[left].mean(axis=0), axis=-1)
        # Rounded, so that rounding errors do not decide ties.
        chosen.append(int(left[np.argmax(np.round(apart, 9))]))
    return tuple(sorted(chosen))


def _others(takes: Indices, taken: list[int]) -> Indices:
    return np.flatnonzero(~np.isin(takes, takes[taken]))


def _points(held: Sequence[Example]) -> Floats:
    """Return the controls (k, d) in half-ranges of these clips."""
    controls = np.stack([example.controls for example in held])
    low, high = controls.min(axis=0), controls.max(axis=0)
    return half_ranges(controls, low, np.where(high > low, high, low + 1.0))
