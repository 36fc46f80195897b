"""Models with controls that are measured on the motion; the procedural recipes have none."""

from dataclasses import replace
from pathlib import Path

from posefield.motion.measures import Measure
from posefield.registry import model_registry
from posefield.synthesis.synthesizer import Synthesizer

HAND = "RightHand"


def reaching(path: Path) -> Synthesizer:
    """The model of a file of the reaching family, `target_height` measured at the hand's end."""
    (found,) = model_registry.load([path]).models.values()
    card = found.session.card
    own = Measure("height", (card.skeleton.names.index(HAND),), "end")
    controls = tuple(
        replace(control, measure=own) if control.name == "target_height" else control
        for control in card.controls
    )
    return Synthesizer("reach", replace(found.session, card=replace(card, controls=controls)))
