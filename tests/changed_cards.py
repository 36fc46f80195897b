"""Models whose cards have other entries, for tests."""

from dataclasses import replace

from posefield.motion.measures import Measure
from posefield.synthesis.synthesizer import Synthesizer


def with_card(model, **changed):
    """The model with other entries of its card."""
    card = replace(model.session.card, **changed)
    return Synthesizer(model.name, replace(model.session, card=card))


def measured_reach(model, feet="ToeBase"):
    """The reaching model with feet and no contacts, the height of its right hand measured."""
    names = model.session.card.skeleton.names
    measure = Measure("height", (names.index("RightHand"),), "end")
    controls = tuple(
        replace(control, measure=measure) if control.name == "target_height" else control
        for control in model.session.card.controls
    )
    ends = tuple(names.index(side + feet) for side in ("Left", "Right"))
    return with_card(model, controls=controls, feet=ends, contacts=())
