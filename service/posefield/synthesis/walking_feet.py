"""Feet of walking crowds that stand: which crowds, and their motions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Annotated, Any, TypeVar

import numpy as np

from posefield.common import cancellation, frame_groups
from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.constraints import take_variation
from posefield.feet import body_plans, foot_placement, footsteps
from posefield.feet.footsteps import Character, PlanRequest
from posefield.inference.onnx_runtime import CONTACTS
from posefield.inference.session import Session
from posefield.kriging import random_field
from posefield.locomotion import locomotion_plan, stride, walking_crowd
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import LevelSchedule, LocomotionPlan
from posefield.locomotion.stride import RelativePoses
from posefield.locomotion.walking_crowd import MotionsWithContacts, PoseMaker
from posefield.model_file.model_card import ModelCard
from posefield.motion import hinges, skeleton
from posefield.motion.clip import CrowdClip, Motions, StandingFeet
from posefield.motion.contact_detection import FootContact
from posefield.question.motion_question import MAX_TAKE
from posefield.question.walk_question import WalkerTake, WalkQuestion
from posefield.synthesis.synthesizer import NO_DETAIL, Synthesizer

KNOT_SECONDS = 0.2
"""Interval between points of a path at which deviations are computed, s, with lines between: a
character changes its speed over seconds."""
MadeMotions = TypeVar("MadeMotions", Motions, MotionsWithContacts)


@dataclass(frozen=True)
class WalkerTakes:
    """Takes of N distinct motions of a walking crowd.

    take: as in the question. seeds (N,): 0 for the prediction. variety: size of the deviations.
    detail: whether details are added.
    """

    take: WalkerTake
    seeds: Annotated[Indices, "motions"]
    variety: float
    detail: bool


@dataclass(frozen=True)
class _Deviations:
    """Deviations of chosen characters (M,) of a plan, all in its frames.

    coefficients: (M, F, r3), uncorrelated. details: (M, T, r1); None without.
    """

    chosen: Annotated[Indices, "motions"]
    coefficients: Annotated[Floats, "motions frames modes"]
    details: Annotated[Floats, "motions canonical freedoms"] | None

    def detail_rows(
        self, rows: Annotated[Indices, "poses"], frames: Annotated[Floats, "poses"]
    ) -> Annotated[Floats, "poses freedoms"]:
        """Return the details (K, r1) of characters by row (K,) at canonical frames (K,)."""
        if self.details is None:
            return np.zeros((len(rows), 1))
        before = np.minimum(frames.astype(np.int64), self.details.shape[1] - 2)
        share = (frames - before)[:, None]
        first, second = self.details[rows, before], self.details[rows, before + 1]
        return np.asarray((1.0 - share) * first + share * second)


def of_question(card: ModelCard, question: WalkQuestion) -> WalkerTakes | None:
    """Return the takes of a question, or None for the prediction.

    Detail is off for a model whose file has none. Raises InvalidField for a seed or a variety out
    of range, and for a model without takes.
    """
    take, count = question.take, question.motions or question.count
    if take != "index" and not 0 <= take <= MAX_TAKE:
        raise InvalidField("take", f"{take}, expected 'index' or 0 to {MAX_TAKE}")
    if not 0.0 <= question.variety <= 1.0:
        raise InvalidField("variety", f"{question.variety:g}, expected 0 to 1")
    if take:
        random_field.check_features(card.kriging, take)
    detail = question.detail and bool(card.making.detail)
    if not (take or detail):
        return None
    seeds = 1 + np.arange(count) if take == "index" else np.full(count, take)
    return WalkerTakes(take, seeds, question.variety, detail)


def pose_maker(
    model: Synthesizer, takes: WalkerTakes, plan: LocomotionPlan, walkers: Indices
) -> PoseMaker:
    """Return what computes poses of takes of characters (M,) of a plan, in ascending order."""
    deviations = _deviations(model, takes, plan, walkers)

    def pose(
        session: Session, plan: LocomotionPlan, walkers: Indices, frames: Indices, level: int
    ) -> RelativePoses:
        relative = _relative_poses(model, deviations, plan, (walkers, frames), level)
        return locomotion_plan.place_poses(plan, (walkers, frames), relative)

    return pose


def _deviations(
    model: Synthesizer, takes: WalkerTakes, plan: LocomotionPlan, walkers: Indices
) -> _Deviations:
    seeds = takes.seeds[walkers]
    coefficients = deviations_along(model, plan, walkers, seeds, KNOT_SECONDS)
    details = model.solver.variation.details(seeds) if takes.detail else None
    return _Deviations(walkers, takes.variety * coefficients, details)


def deviations_along(
    model: Synthesizer,
    plan: LocomotionPlan,
    walkers: Annotated[Indices, "motions"],
    seeds: Annotated[Indices, "motions"],
    interval: float,
) -> Annotated[Floats, "motions frames modes"]:
    """Return uncorrelated deviations (M, F, r3) of takes along the paths of characters (M,).

    seeds: (M,). interval: that of the points at which they are computed, s, with lines between.
    """
    frames = plan.controls.shape[1]
    knots = np.append(np.arange(0, frames - 1, max(1, int(interval * plan.rate))), frames - 1)
    labels = plan.labels.weights[plan.who[walkers]]
    deviations = model.solver.variation.along_paths(plan.controls[walkers][:, knots], labels, seeds)
    positions = np.interp(np.arange(frames), knots, np.arange(len(knots)))
    before = np.minimum(positions.astype(np.int64), max(len(knots) - 2, 0))
    after, share = np.minimum(before + 1, len(knots) - 1), (positions - before)[:, None]
    return np.asarray((1.0 - share) * deviations[:, before] + share * deviations[:, after])


def _relative_poses(
    model: Synthesizer,
    deviations: _Deviations,
    plan: LocomotionPlan,
    pair: tuple[Indices, Indices],
    level: int,
) -> RelativePoses:
    """Return K poses relative to the travel, of pairs of a character (K,) and a frame (K,)."""
    labels, phases = plan.labels.weights[plan.who[pair[0]]], plan.phases[pair]
    controls = plan.controls[pair]
    corrector = model.solver.corrector(level)
    rows = np.searchsorted(deviations.chosen, pair[0])
    card = model.session.card
    counts = len(card.curves), len(card.contacts)
    shapes = ((len(card.skeleton), 4), (3,), *((count,) for count in counts))
    posed = [np.empty((len(phases), *shape)) for shape in shapes]
    names = ("way", "coefficients", "frame", *[CONTACTS] * bool(card.contacts))
    strides = []
    limits = hinges.from_card(card.hinges)
    for batch in stride.batches(len(phases)):
        cancellation.check()
        inputs = controls[batch], phases[batch][:, None]
        answers = model.session.run(*inputs, *names, labels=labels[batch], level=level, phases=True)
        travel, coefficients, canonical, *contacts = (array.astype(float) for array in answers)
        strides.append(stride.unit_strides(model.session, travel, coefficients, level))
        frames = canonical[:, 0]
        deviations_of_batch = deviations.coefficients[rows[batch], pair[1][batch]]
        changes = take_variation.change_coefficients(corrector, deviations_of_batch)
        predicted = corrector.reduced.moves_of_coefficients(coefficients, frames)
        coefficients[:, : changes.shape[1]] += changes
        moves = corrector.reduced.moves_of_coefficients(coefficients, frames)
        moves += deviations.detail_rows(rows[batch], frames)[:, : moves.shape[1]]
        turns, path, values = corrector.reduced.poses_of_moves(moves)
        gone = (frames / (corrector.reduced.frames - 1))[:, None] * travel
        poses = *skeleton.add_travel(turns, path, gone), values
        if len(limits):
            turns = corrector.reduced.joint_turns(predicted, limits.joints)
            poses = limits.within(poses[0], limits.turn_angles(turns)), *poses[1:]
        for column, values in zip(posed, (*poses, *contacts), strict=False):
            column[batch] = values.reshape(column[batch].shape)
    rotations, roots, *rest = posed
    cycles = stride.Strides._make(map(np.concatenate, zip(*strides, strict=True)))
    relative = stride.relative_poses(cycles, phases, rotations, roots)
    curves, likely = (array if array.shape[1] else None for array in rest)
    return replace(relative, curves=curves, contacts=likely)


MIN_RATE = 20.0
"""Smallest number of frames a second of a crowd whose feet stand: a contact lasts 0.1 s or more,
and a stance of one frame cannot be told from a touch."""


def build_crowd(model: Synthesizer, gait: Gait, question: WalkQuestion) -> CrowdClip:
    """Return the crowd of a question, whose feet stand or are as predicted.

    Raises InvalidField as `walking_crowd.build_crowd` and `of_question` do, and for feet
    that cannot stand.
    """
    card, motions = model.session.card, walking_crowd.motions
    takes, facts = of_question(card, question), facts_of(card, question)
    make = with_takes(standing_motions if facts["feet_stand"] else motions, model, takes)
    crowd = walking_crowd.build_crowd(model, gait, question, make)
    facts = {**crowd.facts, **facts}
    if question.detail and not card.making.detail:
        facts["warnings"] = [*crowd.facts.get("warnings", ()), NO_DETAIL]
    return replace(crowd, facts=facts)


def facts_of(card: ModelCard, question: WalkQuestion) -> dict[str, Any]:
    """Return whether the feet of a question's crowd stand, and its takes if there are any."""
    facts: dict[str, Any] = {"feet_stand": wants_standing_feet(card, question)}
    if (takes := of_question(card, question)) is not None:
        facts["take"] = {"seed": takes.take, "variety": takes.variety, "detail": takes.detail}
    return facts


def with_takes(
    make: Callable[..., MadeMotions], model: Synthesizer, takes: WalkerTakes | None
) -> Callable[..., MadeMotions]:
    """Return a function of motions, such as `standing_motions`, with the poses of takes."""
    if takes is None:
        return make

    def vary(
        session: Session, plan: LocomotionPlan, walkers: Indices, schedule: LevelSchedule
    ) -> MadeMotions:
        pose = pose_maker(model, takes, plan, walkers)
        return make(session, plan, walkers, schedule, pose)

    return vary


def wants_standing_feet(card: ModelCard, question: WalkQuestion) -> bool:
    """Return whether the feet of a crowd are placed.

    Raises InvalidField if they are asked to stand, but the model does not know their contacts, no
    leg leads to them, or the crowd has too few frames a second.
    """
    if question.feet not in (None, "stand"):
        return False
    knows_contacts, slow = bool(card.feet and foot_contacts(card)), question.fps < MIN_RATE
    legs = knows_contacts and bool(choose_legs(card)[1])
    if question.feet is None:
        return legs and not slow
    if not knows_contacts:
        raise InvalidField("feet", "'stand', but this model knows no contacts of feet")
    if not legs:
        raise InvalidField("feet", "'stand', but no two bones lead to a foot of this model")
    if slow:
        raise InvalidField(
            "feet", f"'stand' at {question.fps:g} frames a second, expected {MIN_RATE:g} or more"
        )
    return True


def foot_contacts(card: ModelCard) -> tuple[FootContact, ...]:
    """Return the contacts of feet; a hand's contacts with things are none."""
    return tuple(contact for contact in card.contacts if contact.joint in card.feet)


def choose_legs(card: ModelCard) -> tuple[Character, tuple[int, ...]]:
    """Return the character at rest, and the indices of the feet with known contacts and legs."""
    skeleton = card.skeleton
    feet = [contact.joint for contact in foot_contacts(card)]
    return footsteps.choose_limbs(
        skeleton.parents, skeleton.offsets, feet, (), card.hinges, skeleton.tips
    )[:2]


def standing_motions(
    session: Session,
    plan: LocomotionPlan,
    walkers: Indices,
    schedule: LevelSchedule,
    pose: PoseMaker = locomotion_plan.synthesize_poses,
) -> Motions:
    """Return the motions of characters (M,) of the plan with standing feet.

    Arguments as for `walking_crowd.motions`. Stances are planned over each whole motion.
    """
    predicted = walking_crowd.motions_with_contacts(session, plan, walkers, schedule, pose)
    return stand(session.card, plan.rate, [predicted])[0]


def stand(card: ModelCard, rate: float, groups: Sequence[MotionsWithContacts]) -> list[Motions]:
    """Return groups of motions with standing feet; each has the same bytes as if it were alone."""
    character, feet = choose_legs(card)
    contacts = [foot_contacts(card)[index] for index in feet]
    columns = [card.contacts.index(contact) for contact in contacts]
    requests = [
        PlanRequest(replace(character, bones=bones), rotations, roots, rate, contacts, likely)
        for motions, probabilities in groups
        for bones, rotations, roots, likely in zip(
            motions.bone_offsets.astype(np.float64),
            motions.rotations,
            motions.root_position.astype(np.float64),
            probabilities[..., columns],
            strict=True,
        )
    ]
    plans = body_plans.plan_motions(requests)
    # The rotations of the legs are written into those of the motions.
    rotations = np.concatenate([turns for motions, _ in groups for turns in motions.rotations])
    placed = foot_placement.place_grids(plans, rotations)
    frames_of_groups = frame_groups.FrameGroups(
        np.array([motions.levels.size for motions, _ in groups])
    )
    parts = (frames_of_groups.split(array) for array in (rotations, *placed))
    standing, walkers = [], iter(plans)
    for (motions, _), *arrays in zip(groups, *parts, strict=True):
        shape = motions.levels.shape
        turns, shift, before, after = (array.reshape(*shape, *array.shape[1:]) for array in arrays)
        skate_before, skate = (
            walking_crowd.measure_skate_of_feet(card, paths, rate).mean(axis=1)
            for paths in (before, after)
        )
        planned = list(islice(walkers, len(motions.levels)))
        facts = StandingFeet(
            skate_before,
            skate,
            np.array(foot_placement.largest_drifts(planned, list(after))),
            np.array([(plan.lowered - plan.followed).max() for plan in planned]),
        )
        roots = (motions.root_position + shift).astype(np.float32)
        standing.append(replace(motions, rotations=turns, root_position=roots, feet=facts))
    return standing
