"""What is asked of the service on behalf of a scene."""

from dataclasses import dataclass

from . import preferences, session, sliders
from .without_blender import cards, faults, rates, service
from .without_blender.cards import Card
from .without_blender.clips import Question
from .without_blender.service import Service


@dataclass(frozen=True)
class Picked:
    """A model that a scene may take. models: all of the service, empty where it was not asked."""

    name: str
    card: Card
    models: tuple[tuple[str, str], ...] = ()


def refresh(context, scene) -> None:
    """Ask which models there are, and for the card of the picked one, or the first."""
    take(scene, found(preferences.service(context).in_all(), scene))


def found(asked: Service, scene) -> Picked:
    """The scene's model as the service has it now, or the first; nothing is changed."""
    models = service.models(asked)
    known = [name for name, _ in models]
    own = scene.posefield
    if not known:
        raise faults.Unintelligible(f"the service at {asked.address} has no models")
    name = own.model_name if own.model_name in known else known[0]
    return Picked(name, cards.get(asked, name), models)


def pick(context, scene) -> None:
    """Ask for the card of the model that was just picked; what is wrong shows in the panel."""
    name = scene.posefield.model_name
    try:
        take(scene, Picked(name, cards.get(preferences.service(context), name)))
        session.current.tell()
    except faults.Fault as fault:
        session.current.card = None
        session.current.tell(str(fault), failed=True)


def take(scene, picked: Picked) -> None:
    """Make sliders of a card; at their defaults, unless the scene had this model's before."""
    own = scene.posefield
    fresh = not _has(scene, picked)
    session.current.card = picked.card
    session.current.models = picked.models or session.current.models
    sliders.make(picked.card)
    own.model_name = own.sliders_of = picked.name
    if fresh:
        # Sliders come last: where the clip follows them, what they ask is what counts.
        own.performer_name, own.level_number, own.loop = "", 0, False
        sliders.reset(scene, picked.card)


def _has(scene, picked: Picked) -> bool:
    return scene.posefield.sliders_of == picked.name


def card_of(scene) -> Card:
    """Card of the scene's model; Fault where it is not known."""
    card = session.current.card
    if card is None or scene.posefield.sliders_of != scene.posefield.model_name:
        raise faults.Fault("no model is picked: refresh, and pick one")
    name = scene.posefield.model_name
    if name not in (card.identity, card.identity.partition("@")[0]):
        raise faults.Fault(f"the sliders are those of {card.identity}: refresh")
    return card


def question(scene) -> Question:
    """What the panel asks for."""
    return question_of(scene, Picked(scene.posefield.model_name, card_of(scene)), {})


def question_of(scene, picked: Picked, others: dict[str, float]) -> Question:
    """What the panel would ask for if it had taken the model, but with others for some controls."""
    card, own, had = picked.card, scene.posefield, _has(scene, picked)
    if had and own.loop and not card.cyclic:
        raise faults.Fault(f"{card.name} is no cycle, and cannot be a loop")
    return Question(
        model=card.identity,
        controls=(_values(scene, card) if had else card.defaults) | others,
        fps=fps(scene),
        performer=(own.performer_name or None) if had else None,
        level=own.level_number if had else 0,
        root=own.root,
        loop=had and own.loop,
    )


def _values(scene, card: Card) -> dict[str, float]:
    if session.current.card is None:
        # What a file kept of its sliders can be read once they are made.
        sliders.make(card)
    return sliders.values(scene, card)


def fps(scene) -> float:
    """Frames a second that are asked for."""
    if scene.posefield.rate == "SCENE":
        return rates.rate(scene.render.fps, scene.render.fps_base)
    return rates.shortest(scene.posefield.fps)
