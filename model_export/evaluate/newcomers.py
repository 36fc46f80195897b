"""What a performer's name is worth: nobody named, and a performer of whom a few clips are shown."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from model_export import adapt, canonical, samples
from model_export.evaluate import methods
from model_export.evaluate.methods import Asked
from model_export.evaluate.motion import Motion
from model_export.ingest import Example
from model_export.recipe import Recipe
from model_export.train import Trained
from service.motion.conventions import Floats, Indices
from service.motion.field import half_ranges

NOBODY = "posefield_no_performer"
SHOWN = {"posefield_adapt_1": 1, "posefield_adapt_3": 3, "posefield_adapt_5": 5}
"""How many clips of a new performer each method is shown."""
FEWEST = 3
"""A clip is asked for where so many other takes of its performer are there to be shown."""


def unnamed(recipe: Recipe, trained: Trained, asked: Asked) -> dict[str, list[Motion]]:
    """The same questions about nobody in particular, where the model tells performers apart."""
    if not trained.model.bank.performers:
        return {}
    nobody = [""] * len(asked.performers)
    return {NOBODY: methods.ours(recipe, trained, replace(asked, performers=nobody))}


def adapted(
    recipe: Recipe, trained: Trained, held: Sequence[Example]
) -> dict[str, list[Motion | None]]:
    """Motions of a performer's clips, held out, from a model that was shown some of the others.

    None where there are too few others. Nothing where the model tells no performers apart.
    """
    if not trained.model.bank.performers:
        return {}
    if len(np.unique(samples.takes(held))) <= FEWEST:
        return {name: [None] * len(held) for name in SHOWN}
    known = canonical.known(recipe, trained)
    return {name: _motions(recipe, trained, known, held, count) for name, count in SHOWN.items()}


def _motions(
    recipe: Recipe,
    trained: Trained,
    known: canonical.Known,
    held: Sequence[Example],
    count: int,
) -> list[Motion | None]:
    models: dict[tuple[int, ...], Trained] = {}
    found: list[Motion | None] = []
    for place, example in enumerate(held):
        shown = choose(held, place, count)
        if shown not in models:
            own = adapt.adapt(known, [held[i] for i in shown], example.row.performer)
            models[shown] = replace(trained, model=own.model)
        asked = Asked(example.controls[None], [example.row.performer])
        found += methods.ours(recipe, models[shown], asked)
    return found


def choose(held: Sequence[Example], asked: int, count: int) -> tuple[int, ...]:
    """Places of as many clips to be shown, each of a take of its own and none of the asked one's.

    The first is the nearest to the middle of their controls, each further one the farthest from
    those before it. Fewer where there are not as many takes.
    """
    takes, points = samples.takes(held), _points(held)
    chosen: list[int] = []
    while len(chosen) < count:
        left = _others(takes, [asked, *chosen])
        if not len(left):
            break
        if chosen:
            apart = np.linalg.norm(points[left, None] - points[chosen], axis=-1).min(axis=1)
        else:
            apart = -np.linalg.norm(points[left] - points[left].mean(axis=0), axis=-1)
        # Rounded, so that ties are not broken by an ulp.
        chosen.append(int(left[np.argmax(np.round(apart, 9))]))
    return tuple(sorted(chosen))


def _others(takes: Indices, taken: list[int]) -> Indices:
    return np.flatnonzero(~np.isin(takes, takes[taken]))


def _points(held: Sequence[Example]) -> Floats:
    """Controls (k, d) in half-ranges of their own."""
    controls = np.stack([example.controls for example in held])
    low, high = controls.min(axis=0), controls.max(axis=0)
    return half_ranges(controls, low, np.where(high > low, high, low + 1.0))
