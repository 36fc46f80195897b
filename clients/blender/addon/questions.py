"""Requests to the service for a scene."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from . import label_sets, preferences, session, sliders
from .without_blender import cards, faults, rates, service, variation
from .without_blender.cards import Card
from .without_blender.clips import Question
from .without_blender.label_choice import LabelValue
from .without_blender.service import Service
from .without_blender.variation import Variation


@dataclass(frozen=True)
class Picked:
    """A model for a scene. models: all of the service; empty if they were not requested."""

    name: str
    card: Card
    models: tuple[tuple[str, str], ...] = ()


def refresh(context, scene) -> None:
    """Fetch the list of models, and the card of the picked one, or of the first."""
    take(scene, found(preferences.service(context).in_all(), scene))


def found(asked: Service, scene) -> Picked:
    """Return the scene's model as the service has it now, or the first; the scene is unchanged."""
    models = service.models(asked)
    known = [name for name, _ in models]
    own = scene.posefield
    if not known:
        raise faults.Unintelligible(f"the service at {asked.address} has no models")
    name = own.model_name if own.model_name in known else known[0]
    return Picked(name, cards.get(asked, name), models)


def pick(context, scene) -> None:
    """Fetch the card of the model that was picked; errors are shown in the panel."""
    name = scene.posefield.model_name
    try:
        take(scene, Picked(name, cards.get(preferences.service(context), name)))
        session.current.tell()
    except faults.Fault as fault:
        session.current.card = None
        session.current.tell(str(fault), failed=True)


def take(scene, picked: Picked) -> None:
    """Make the sliders of a card, at their defaults unless the scene already used this model."""
    own = scene.posefield
    fresh = not _has(scene, picked)
    session.current.card = picked.card
    session.current.models = picked.models or session.current.models
    sliders.make(picked.card)
    own.model_name = own.sliders_of = picked.name
    label_sets.make(own, picked.card, fresh)
    if fresh:
        # Reset the sliders last, because each change can send a live request.
        own.level_number, own.loop = 0, False
        put_variation(own, Variation())
        sliders.reset(scene, picked.card)


def _has(scene, picked: Picked) -> bool:
    return scene.posefield.sliders_of == picked.name


def card_of(scene) -> Card:
    """Return the card of the scene's model; raise Fault if it is unknown."""
    card = session.current.card
    if card is None or scene.posefield.sliders_of != scene.posefield.model_name:
        raise faults.Fault("no model is picked: refresh, and pick one")
    name = scene.posefield.model_name
    if name not in (card.identity, card.identity.partition("@")[0]):
        raise faults.Fault(f"the sliders are those of {card.identity}: refresh")
    return card


def question(scene) -> Question:
    """Return the panel's request for a clip."""
    return question_of(scene, Picked(scene.posefield.model_name, card_of(scene)), {}, {}, {})


def question_of(
    scene,
    picked: Picked,
    others: dict[str, float],
    labels: dict[str, LabelValue | None],
    varied: Mapping[str, Any],
) -> Question:
    """Return the request for a model with the panel's settings, but for some of them.

    others: controls. labels: by label set. varied: fields of Variation by name.
    """
    card, own, had = picked.card, scene.posefield, _has(scene, picked)
    if had and own.loop and not card.cyclic:
        raise faults.Fault(f"{card.name} is no cycle, and cannot be a loop")
    return Question(
        model=card.identity,
        controls=(_values(scene, card) if had else card.defaults) | others,
        fps=fps(scene),
        labels=_labels(own, had, labels),
        level=own.level_number if had else 0,
        root=own.root,
        loop=had and own.loop,
        variation=_variation(card, variation_of(own) if had else Variation(), varied),
    )


def variation_of(own) -> Variation:
    """Return the take and the feet of the panel's settings."""
    return variation.of_sliders(own.take, own.variety, own.detail, own.feet, own.floor)


def put_variation(own, chosen: Variation) -> None:
    """Set take and feet in the panel; settings that stay are not written, as that asks again."""
    now = variation_of(own)
    if chosen.seed != now.seed:
        own.take = chosen.seed
    if chosen.variety != now.variety:
        own.variety = chosen.variety
    if chosen.detail != now.detail:
        own.detail = chosen.detail
    if chosen.feet != now.feet:
        own.feet = chosen.feet
    if chosen.floor != now.floor:
        own.floor = chosen.floor


def _variation(card: Card, own: Variation, varied: Mapping[str, Any]) -> Variation:
    chosen = replace(own, **varied)
    if chosen.detail and not card.detail:
        raise faults.Fault(f"{card.name} has no details to sample: switch them off")
    return chosen


def _values(scene, card: Card) -> dict[str, float]:
    if session.current.card is None:
        # The sliders' values in a file are readable only after the sliders are made.
        sliders.make(card)
    return sliders.values(scene, card)


def _labels(own, had: bool, others: dict[str, LabelValue | None]) -> dict[str, LabelValue]:
    chosen = (label_sets.values(own) if had else {}) | others
    return {name: value for name, value in chosen.items() if value is not None}


def fps(scene) -> float:
    """Return the requested frames per second."""
    if scene.posefield.rate == "SCENE":
        return rates.rate(scene.render.fps, scene.render.fps_base)
    return rates.shortest(scene.posefield.fps)
