"""Models with controls that are measured on the motion; the procedural recipes have none."""

from dataclasses import replace
from pathlib import Path

from service.motion.measure import Measure
from service.synthesis import library
from service.synthesis.synthesizer import Synthesizer

HAND = "RightHand"


def reaching(path: Path) -> Synthesizer:
    """The model of a file of the reaching family, `target_height` measured at the hand's end."""
    (found,) = library.load([path]).models.values()
    card = found.session.card
    own = Measure("height", (card.skeleton.names.index(HAND),), "end")
    controls = tuple(
        replace(control, measure=own) if control.name == "target_height" else control
        for control in card.controls
    )
    return Synthesizer("reach", replace(found.session, card=replace(card, controls=controls)))
