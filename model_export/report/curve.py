"""Levels that a ladder could have had: one below the model's own size at each of many budgets."""

from dataclasses import dataclass, replace

import numpy as np

from model_export import levels
from model_export.levels import Workshop
from model_export.model import Model
from model_export.recipe import Recipe
from model_export.train import Trained
from service.motion import card
from service.motion.card import ModelCard
from service.motion.detail import Level
from service.synthesis import session
from service.synthesis.session import Session

# Budgets from the model's own to so many times them, or the coarsest level's.
POINTS, FARTHEST = 7, 16.0


@dataclass(frozen=True)
class Curve:
    """Levels below a model's own size, the finest first, and how many times the model's budgets
    each may cost; in the opened session they come after that size."""

    times: tuple[float, ...]
    levels: tuple[Level, ...]
    opened: Session


def of(recipe: Recipe, trained: Trained, own_card: ModelCard) -> Curve:
    """Levels by budget, each made alone, and all in one graph."""
    shop, times = levels.workshop(recipe, trained), _times(recipe)
    model = _together([_alone(shop, one) for one in times])
    found = tuple(shop.level(model, number) for number in range(len(times) + 1))
    content = model.onnx(card.dump(replace(own_card, levels=found)), {})
    return Curve(times, found[1:], session.open_bytes(content, "other levels"))


def _times(recipe: Recipe) -> tuple[float, ...]:
    farthest = max([FARTHEST, *(detail.times for detail in recipe.size.details)])
    return tuple(float(f"{times:.3g}") for times in np.geomspace(1.0, farthest, POINTS))


def _alone(shop: Workshop, times: float) -> Model:
    """Model with one level below its own, of all joints."""
    return shop.lowered(shop.model, shop.model.decoder.rungs[0].joints, times)


def _together(models: list[Model]) -> Model:
    """Model with the levels of several models of one size."""
    bank, decoder = models[0].bank, models[0].decoder
    return replace(
        models[0],
        bank=replace(bank, coarse=tuple(model.bank.coarse[0] for model in models)),
        decoder=replace(decoder, coarse=tuple(model.decoder.coarse[0] for model in models)),
    )
