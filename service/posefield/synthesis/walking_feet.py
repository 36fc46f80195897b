"""Feet of walking crowds that stand: which crowds, and their motions."""

from dataclasses import replace
from typing import Annotated, Any

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.feet import limb_choice, walkers_feet
from posefield.feet.limb_choice import LimbChoice
from posefield.feet.walkers_feet import Walkers, WalkersFeet
from posefield.inference.session import Session
from posefield.locomotion import crowd_order, locomotion_plan, stride, walking_crowd
from posefield.locomotion.crowd_order import CrowdOrder
from posefield.locomotion.gait import Gait
from posefield.locomotion.level_transitions import LevelSchedule
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.locomotion.walking_crowd import POSES_PER_CALL, MotionMaker, Pairs, PoseMaker
from posefield.model_file.model_card import ModelCard
from posefield.motion.crowd_clip import CrowdClip, Motions, StandingFeet
from posefield.motion.foot_contacts import FootContact
from posefield.synthesis import walking_takes
from posefield.synthesis.synthesizer import NO_DETAIL, Synthesizer
from posefield.synthesis.walking_takes import WalkerTakes

MIN_RATE = 20.0
"""Smallest number of frames a second of a crowd whose feet stand: a contact lasts 0.1 s or more,
and a stance of one frame cannot be told from a touch."""


def build_crowd(model: Synthesizer, gait: Gait, order: CrowdOrder) -> CrowdClip:
    """Return the crowd of an order, whose feet stand or are as predicted.

    Raises InvalidField as `crowd_order.build_crowd` and `walking_takes.of_order` do, and for feet
    that cannot stand.
    """
    takes = walking_takes.of_order(model.session.card, order)
    standing = wants_standing_feet(gait.session.card, order)
    make = _motion_maker(model, takes, standing)
    crowd = crowd_order.build_crowd(model, gait, order, make)
    said: dict[str, Any] = {"feet_stand": standing}
    if takes is not None:
        said["take"] = takes.facts()
    if order.detail and not model.session.card.making.detail:
        said["warnings"] = [NO_DETAIL]
    return replace(crowd, facts={**crowd.facts, **said})


def _motion_maker(model: Synthesizer, takes: WalkerTakes | None, standing: bool) -> MotionMaker:
    """Return what computes motions whose feet stand or are as predicted."""
    make = standing_motions if standing else walking_crowd.motions
    if takes is None:
        return make

    def vary(session: Session, plan: LocomotionPlan, who: Indices, shown: LevelSchedule) -> Motions:
        pose = walking_takes.pose_maker(model, takes, plan, who)
        return make(session, plan, who, shown, pose)

    return vary


def wants_standing_feet(card: ModelCard, order: CrowdOrder) -> bool:
    """Return whether the feet of a crowd are placed.

    Raises InvalidField if they are asked to stand, but the model does not know their contacts, no
    leg leads to them, or the crowd has too few frames a second.
    """
    if order.feet not in (None, "stand"):
        return False
    known, slow = bool(card.feet and foot_contacts(card)), order.fps < MIN_RATE
    legs = known and bool(choose_legs(card).feet)
    if order.feet is None:
        return legs and not slow
    if not known:
        raise InvalidField("feet", "'stand', but this model knows no contacts of feet")
    if not legs:
        raise InvalidField("feet", "'stand', but no two bones lead to a foot of this model")
    if slow:
        raise InvalidField(
            "feet", f"'stand' at {order.fps:g} frames a second, expected {MIN_RATE:g} or more"
        )
    return True


def foot_contacts(card: ModelCard) -> tuple[FootContact, ...]:
    """Return the contacts of feet; a hand's contacts with things are none."""
    return tuple(own for own in card.contacts if own.joint in card.feet)


def choose_legs(card: ModelCard) -> LimbChoice:
    """Return the legs of the feet whose contacts are known; those of the skeleton at rest."""
    skeleton = card.skeleton
    feet = [own.joint for own in foot_contacts(card)]
    return limb_choice.choose_limbs(skeleton.parents, skeleton.offsets, feet, ())


def standing_motions(
    session: Session,
    plan: LocomotionPlan,
    who: Indices,
    shown: LevelSchedule,
    pose: PoseMaker = locomotion_plan.synthesize_poses,
) -> Motions:
    """Return the motions of characters (M,) of the plan with standing feet.

    Arguments as for `walking_crowd.motions`. Stances are planned over each whole motion.
    """
    made = walking_crowd.motions(session, plan, who, shown, pose)
    placed = _placed_feet(session, plan, who, shown, made)
    rotations = made.rotations
    for joint, turns in placed.turns.items():
        rotations[:, :, joint] = turns
    roots = placed.roots.astype(np.float32)
    feet = _describe(session.card, placed, plan.rate)
    return replace(made, rotations=rotations, root_position=roots, feet=feet)


def _placed_feet(
    session: Session, plan: LocomotionPlan, who: Indices, shown: LevelSchedule, made: Motions
) -> WalkersFeet:
    """Return where the feet of predicted motions are placed."""
    card = session.card
    choice = choose_legs(card)
    contacts = [foot_contacts(card)[place] for place in choice.feet]
    places = [card.contacts.index(own) for own in contacts]
    likely = contact_probabilities(session, plan, who, shown)[..., places]
    doubles = (made.bone_offsets, made.rotations, made.root_position)
    bones, rotations, roots = (part.astype(np.float64) for part in doubles)
    walkers = Walkers(card.skeleton.parents, bones, rotations, roots, plan.rate)
    return walkers_feet.stand(walkers, choice.character.legs, contacts, likely)


def contact_probabilities(
    session: Session, plan: LocomotionPlan, who: Annotated[Indices, "motions"], shown: LevelSchedule
) -> Annotated[Floats, "motions frames contacts"]:
    """Return the probabilities (M, F, C) of the contacts of characters (M,) of the plan.

    shown: levels (M, F); where they change, probabilities are blended as the poses are.
    """
    shape = (len(who), plan.phases.shape[1])
    count = shape[0] * shape[1]
    found = np.empty((count, len(session.card.contacts)))
    for rows in (slice(first, first + POSES_PER_CALL) for first in range(0, count, POSES_PER_CALL)):
        character, frame = np.divmod(np.arange(count)[rows], shape[1])
        found[rows] = _blended_contacts(session, plan, (who[character], frame), shown.rows(rows))
    return found.reshape(*shape, -1)


def _blended_contacts(
    session: Session, plan: LocomotionPlan, pairs: Pairs, shown: LevelSchedule
) -> Annotated[Floats, "pairs contacts"]:
    """Return the probabilities of K pairs of a character and a frame."""
    found, shares = _contacts_at_levels(session, plan, pairs, shown.levels), shown.shares
    between = np.flatnonzero(shares < 1.0)
    if len(between):
        some = pairs[0][between], pairs[1][between]
        before = _contacts_at_levels(session, plan, some, shown.previous[between])
        found[between] = before + shares[between, None] * (found[between] - before)
    return found


def _contacts_at_levels(
    session: Session, plan: LocomotionPlan, pairs: Pairs, levels: Indices
) -> Annotated[Floats, "pairs contacts"]:
    """Return the probabilities of K pairs, each at its level (K,)."""
    found = np.empty((len(levels), len(session.card.contacts)))
    for level in np.unique(levels).tolist():
        rows = np.flatnonzero(levels == level)
        pair = pairs[0][rows], pairs[1][rows]
        labels = plan.labels.weights[plan.who[pair[0]]]
        found[rows] = stride.contact_probabilities(
            session, plan.controls[pair], labels, plan.phases[pair], level
        )
    return found


def _describe(card: ModelCard, placed: WalkersFeet, rate: float) -> StandingFeet:
    """Return the facts about the placed feet of motions."""
    before, after = (
        walking_crowd.measure_skate_of_feet(card, paths, rate).mean(axis=1)
        for paths in (placed.before, placed.after)
    )
    return StandingFeet(before, after, placed.drift, placed.lowered)
