"""What is asked of the service on behalf of a scene."""

from . import preferences, session, sliders
from .without_blender import cards, faults, rates, service
from .without_blender.cards import Card
from .without_blender.clips import Question


def refresh(context, scene) -> None:
    """Ask which models there are, and for the card of the picked one, or the first."""
    asked = preferences.service(context)
    models = service.models(asked)
    known = [name for name, _ in models]
    own = scene.posefield
    if not known:
        raise faults.Unintelligible(f"the service at {asked.address} has no models")
    name = own.model_name if own.model_name in known else known[0]
    card = cards.get(asked, name)
    session.current.models = models
    take(scene, name, card)


def pick(context, scene) -> None:
    """Ask for the card of the model that was just picked; what is wrong shows in the panel."""
    name = scene.posefield.model_name
    try:
        take(scene, name, cards.get(preferences.service(context), name))
        session.current.tell()
    except faults.Fault as fault:
        session.current.card = None
        session.current.tell(str(fault), failed=True)


def take(scene, name: str, card: Card) -> None:
    """Make sliders of a card; at their defaults, unless the scene had this model's before."""
    own = scene.posefield
    fresh = own.sliders_of != name
    session.current.card = card
    sliders.make(card)
    own.model_name = own.sliders_of = name
    if fresh:
        sliders.reset(scene, card)
        own.performer_name, own.level_number, own.loop = "", 0, False


def card_of(scene) -> Card:
    """Card of the scene's model; Fault where it is not known."""
    card = session.current.card
    if card is None or scene.posefield.sliders_of != scene.posefield.model_name:
        raise faults.Fault("no model is picked: refresh, and pick one")
    name = scene.posefield.model_name
    if name not in (card.identity, card.identity.partition("@")[0]):
        raise faults.Fault(f"the sliders are those of {card.identity}: refresh")
    return card


def question(scene, others: dict[str, float] | None = None) -> Question:
    """What the panel asks for, but with other values for some controls."""
    card, own = card_of(scene), scene.posefield
    if own.loop and not card.cyclic:
        raise faults.Fault(f"{card.name} is no cycle, and cannot be a loop")
    return Question(
        model=card.identity,
        controls=sliders.values(scene, card) | (others or {}),
        fps=fps(scene),
        performer=own.performer_name or None,
        level=own.level_number,
        root=own.root,
        loop=own.loop,
    )


def fps(scene) -> float:
    """Frames a second that are asked for."""
    if scene.posefield.rate == "SCENE":
        return rates.rate(scene.render.fps, scene.render.fps_base)
    return rates.shortest(scene.posefield.fps)
