"""Models of acts for tests, and where the joints of an act are."""

from dataclasses import replace

from posefield.motion import skeleton
from posefield.motion.measures import Measure
from posefield.performance import holds
from posefield.performance.passage import FloorMotion
from posefield.synthesis.synthesizer import Synthesizer


def with_card(model, **changed):
    """The model with other entries of its card."""
    card = replace(model.session.card, **changed)
    return Synthesizer(model.name, replace(model.session, card=card))


def measured_reach(model):
    """The reaching model with feet, and with the height of its right hand measured."""
    names = model.session.card.skeleton.names
    measure = Measure("height", (names.index("RightHand"),), "end")
    controls = tuple(
        replace(control, measure=measure) if control.name == "target_height" else control
        for control in model.session.card.controls
    )
    feet = tuple(names.index(name) for name in ("LeftToeBase", "RightToeBase"))
    return with_card(model, controls=controls, feet=feet, contacts=())


def body(model, bones):
    """The skeleton of a model's character, for holds."""
    card = model.session.card
    return holds.body_of(card.skeleton, card.roles, bones)


def positions(model, passage, bones, by=None):
    """Positions (F, J, 3), m, of a passage that is moved over the floor."""
    own = passage.placed(by or FloorMotion())
    moved = skeleton.translations(bones, own.roots)
    return skeleton.positions(model.session.card.skeleton.parents, own.rotations, moved)


def joint_path(model, act, name, by=None):
    """Path (F, 3), m, of a joint of an act."""
    joint = model.session.card.skeleton.names.index(name)
    return positions(model, act.passage, act.bones, by)[:, joint]
