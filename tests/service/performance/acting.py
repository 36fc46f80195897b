"""Places of the joints of acts, for tests."""

from posefield.motion import skeleton
from posefield.performance import holds
from posefield.performance.passage import FloorMotion


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
