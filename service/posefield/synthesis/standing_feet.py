"""Feet of clips that stand: which clips, and the plan over the whole motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from msgspec import structs

from posefield.common.errors import InvalidField
from posefield.common.units import UP, Floats, round_micrometres
from posefield.constraints.targets import ConstraintSet
from posefield.feet import body_plans, foot_placement, footsteps, limbs
from posefield.feet.footsteps import FeetPlan, LimbChoice, PlanRequest, SampledMotion
from posefield.feet.limbs import LimbPoses
from posefield.feet.stance_rows import Cycle
from posefield.inference.onnx_runtime import CONTACTS
from posefield.locomotion import floor_plane
from posefield.locomotion.stride import Strides
from posefield.model_file.model_card import ModelCard
from posefield.motion import contact_detection, measures
from posefield.motion.contact_detection import FootContact
from posefield.motion.measures import MeasuredMotion
from posefield.question.floor import LEVEL_FLOOR, Floor
from posefield.question.motion_question import ClipQuestion, check_number, check_range
from posefield.question.results import FeetResult, PoseAnswer, StanceResult
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.question_validation import ValidatedQuestion

# Frames a second of the grid of a plan, and the smallest and largest number of its steps.
RATE, FEWEST, MOST = 60.0, 8, 600
# Limits of a floor: height, m, which keeps micrometres of single precision in files, and rise for
# each metre, up to which legs reach the steps of a walk.
HIGHEST, STEEPEST = 10.0, 0.3


UNREACHED = "does not stand: its leg does not reach the floor"


@dataclass(frozen=True)
class WholeMotion:
    """A motion from its start to its end.

    duration: s. stretch: duration of the prediction over this duration. cycle: floor motion of a
    cycle; None for a motion without cycles.
    """

    duration: float
    stretch: float = 1.0
    cycle: Cycle | None = None

    @property
    def times(self) -> Annotated[Floats, "frames"]:
        """Return times (F,), s, of the grid; a cycle's lack its last frame."""
        steps = min(max(round(self.duration * RATE), FEWEST), MOST)
        found: Floats = np.arange(float(steps + (self.cycle is None))) * (self.duration / steps)
        return found


def wants_standing_feet(card: ModelCard, asked: ClipQuestion) -> bool:
    """Return whether the feet of a clip are placed.

    Raises InvalidField if they are asked to stand, but the model has no feet on the ground, and for
    a floor on which they cannot stand.
    """
    stands = _are_placed(card, asked)
    if asked.ground != LEVEL_FLOOR:
        _check_floor(asked, stands)
    return stands


def _are_placed(card: ModelCard, asked: ClipQuestion) -> bool:
    travels = card.root == "travelling"
    if asked.feet is None:
        return bool(travels and card.feet and card.contacts)
    if asked.feet == "stand" and not card.feet:
        raise InvalidField("feet", "'stand', but this model's recipe names no feet")
    if asked.feet == "stand" and not travels:
        raise InvalidField("feet", "'stand', but the root of this model's motions stays in place")
    return asked.feet == "stand"


def _check_floor(asked: ClipQuestion, stands: bool) -> None:
    """Raise InvalidField for a floor beyond the limits, and for one without standing feet."""
    floor = asked.ground
    height = "floor/height" if isinstance(asked.floor, Floor) else "floor"
    check_range(height, check_number(height, floor.height), -HIGHEST, HIGHEST, "m")
    for name in ("slope_x", "slope_z"):
        check_number(f"floor/{name}", getattr(floor, name))
    if not floor.slope <= STEEPEST:
        raise InvalidField(
            "floor",
            f"rises by {floor.slope:g} m for each metre, expected at most {STEEPEST:g}: legs reach "
            "no further",
        )
    if not stands:
        said = "as asked" if asked.feet else "as this model's are unless feet=stand is asked for"
        raise InvalidField(
            "floor", f"other than 0, but feet are as predicted, {said}; expected feet that stand"
        )
    if not floor.is_level and (asked.loop or asked.root == "in_place"):
        field = "loop" if asked.loop else "root=in_place"
        raise InvalidField(
            "floor",
            f"with a slope and {field}, expected a level floor: what climbs ends at another height",
        )


def cycle_of(way: Strides) -> Cycle:
    """Return the floor motion from the start of a cycle to its end."""
    turn = float(way.turns[0])
    gap = floor_plane.arc_displacement(way.travels, way.turns)[0]
    start = way.starts[0]
    return Cycle(complex(start + gap - np.exp(1j * turn) * start), turn)


@dataclass(frozen=True)
class StandRequest:
    """A motion whose feet stand.

    goals: constraints that the motion meets, which stay met. answer: its poses at the frames that
    are asked for; whole: those at the times of the motion.
    """

    question: ValidatedQuestion
    goals: ConstraintSet
    answer: PoseAnswer[np.float64]
    motion: WholeMotion
    whole: PoseAnswer[np.float64]
    floor: Floor = LEVEL_FLOOR


def stand(model: Synthesizer, requests: Sequence[StandRequest]) -> list[PoseAnswer[np.float64]]:
    """Return the answers with standing feet, and with the facts about them in `trust`.

    Each has the bytes that it has alone.
    """
    card = model.session.card
    known = [own for own in card.contacts if own.joint in card.feet]
    feet = [own.joint for own in known] if known else list(card.feet)
    choices = [
        footsteps.choose_limbs(
            card.skeleton.parents, own.answer.bone_offsets, feet, _held_joints(own.goals)
        )
        for own in requests
    ]
    placed = [place for place, choice in enumerate(choices) if choice.feet]
    plans = body_plans.plan_motions(
        [_plan_request(model, requests[place], choices[place], known) for place in placed]
    )
    answers = [requests[place].answer for place in placed]
    frames = foot_placement.place_motions(
        plans,
        [answer.times for answer in answers],
        [answer.rotations for answer in answers],
        [answer.root_position for answer in answers],
    )
    told = describe(plans, card.skeleton.names)
    found = [_unplaced(card, *own) for own in zip(requests, choices, strict=True)]
    for place, plan, (rotations, roots), facts in zip(placed, plans, frames, told, strict=True):
        answer = found[place]
        left = answer.trust.feet.left if answer.trust.feet else ()
        measured = _measured(card, requests[place], plan)
        trust = structs.replace(
            answer.trust, feet=structs.replace(facts, left=left + facts.left), measured=measured
        )
        found[place] = replace(answer, rotations=rotations, root_position=roots, trust=trust)
    return found


def _unplaced(card: ModelCard, request: StandRequest, choice: LimbChoice) -> PoseAnswer[np.float64]:
    """Return an answer with the feet that are not placed in `trust`, each with the reason."""
    left = tuple(f"{card.skeleton.names[foot]} {why}" for foot, why in choice.left)
    feet = FeetResult((), 0, 0.0, 0.0, 0.0, 0.0, 0.0, left, _told(request.floor))
    return replace(request.answer, trust=structs.replace(request.answer.trust, feet=feet))


def _plan_request(
    model: Synthesizer, request: StandRequest, choice: LimbChoice, known: Sequence[FootContact]
) -> PlanRequest:
    """Return the request for the plan of a motion. known: contacts of the model's feet."""
    motion, times = request.motion, request.motion.times
    rate = (len(times) - (motion.cycle is None)) / motion.duration
    poses = request.whole
    sampled = SampledMotion(poses.rotations, poses.root_position, rate, motion.cycle)
    own = [known[place] for place in choice.feet] if known else []
    likely = _probabilities(model, request.question, own, times * motion.stretch) if known else None
    character = replace(choice.character, raised=_may_rise(request.goals))
    return PlanRequest(character, sampled, own, likely, request.floor)


def describe(plans: Sequence[FeetPlan], names: Sequence[str]) -> list[FeetResult]:
    """Return the facts about the placed feet of whole motions."""
    paths = foot_placement.foot_paths(plans)
    # Feet on a slope are low where they are near it.
    level = [
        after - plan.floor.heights(after)[..., None] * UP
        for plan, (_, after) in zip(plans, paths, strict=True)
    ]
    rates = [plan.rate for plan in plans]
    skates = (
        contact_detection.mean_skate_speeds([before for before, _ in paths], rates),
        contact_detection.mean_skate_speeds(level, rates),
    )
    drifts = foot_placement.largest_drifts(plans, [after for _, after in paths])
    return [
        FeetResult(
            _stances(plan, names),
            _swings(plan),
            round_micrometres(before),
            round_micrometres(after),
            round_micrometres(drift),
            round_micrometres(float((plan.lowered - plan.followed).max())),
            round_micrometres(plan.grounded),
            tuple(f"{names[plan.character.legs[leg].tip]} {UNREACHED}" for leg in plan.unreached),
            _told(plan.floor),
        )
        for plan, before, after, drift in zip(plans, *skates, drifts, strict=True)
    ]


def _stances(plan: FeetPlan, names: Sequence[str]) -> tuple[StanceResult, ...]:
    return tuple(
        StanceResult(
            names[leg.tip],
            round_micrometres(stance.begin / plan.rate),
            round_micrometres((stance.end - 1) / plan.rate),
            tuple(map(round_micrometres, anchor)),
        )
        for leg, steps in zip(plan.character.legs, plan.steps, strict=True)
        for stance, anchor in zip(steps.stances, steps.anchors.tolist(), strict=True)
    )


def _swings(plan: FeetPlan) -> int:
    """Return the number of swings of all feet: the gaps between stances, which do not touch."""
    count, found = len(plan.lowered), 0
    for steps in plan.steps:
        standing = sum(map(len, steps.stances))
        if plan.cycle is not None:
            found += max(len(steps.stances), 1) * (standing < count)
        else:
            ends = [(own.begin == 0) + (own.end == count) for own in steps.stances]
            found += len(steps.stances) + 1 - sum(ends)
    return found


def _told(floor: Floor) -> Floor | None:
    """Return the floor of an answer; None for the level on which motions are captured."""
    return None if floor == LEVEL_FLOOR else floor


def _held_joints(goals: ConstraintSet) -> set[int]:
    """Return the joints whose positions constrain a motion."""
    own = [measure for _, measure, _ in goals.controls] + [goal.moment for goal in goals.targets]
    return {joint for measure in own for joint in measure.joints}


def _may_rise(goals: ConstraintSet) -> bool:
    """Return whether no constraint is on a height, so that a trunk may follow the floor."""
    return not goals.targets and not any(
        measure.quantity == "height" or measure.at in ("highest", "lowest")
        for _, measure, _ in goals.controls
    )


def _probabilities(
    model: Synthesizer,
    question: ValidatedQuestion,
    feet: Sequence[FootContact],
    times: Annotated[Floats, "frames"],
) -> Annotated[Floats, "frames feet"]:
    """Return the probabilities (F, K) of the contacts of feet at times (F,), s."""
    (likely,) = model.session.run(
        question.point, times[None], CONTACTS, labels=question.labels, level=question.level
    )
    joints = [own.joint for own in model.session.card.contacts]
    return likely[0][:, [joints.index(own.joint) for own in feet]].astype(np.float64)


def _measured(card: ModelCard, request: StandRequest, plan: FeetPlan) -> dict[str, float]:
    """Return the measured controls of an answer, changed as the placing of the feet changes them.

    Controls that constrain it stay.
    """
    answer, before, goals = request.answer, request.whole, request.goals
    found, held = dict(answer.trust.measured), {name for name, _, _ in goals.controls}
    moving = [
        (control.name, control.measure)
        for control in card.controls
        if control.measure and control.measure.joints and not control.measure.is_body_measure
    ]
    moving = [pair for pair in moving if pair[0] in found and pair[0] not in held]
    if not moving:
        return found
    bones, parents = answer.bone_offsets, card.skeleton.parents
    times = np.arange(len(plan.lowered)) / plan.rate
    joints = sorted({0, *(joint for _, measure in moving for joint in measure.joints)})
    after = foot_placement.place_feet(plan, times, before.rotations, before.root_position, joints)
    # The joints that are measured alone: the whole skeleton takes a fifth of the feet's time.
    both = [
        _joint_positions(limbs.evaluate_joints(parents, bones, joints, rotations, roots), joints)
        for rotations, roots in (
            (before.rotations, before.root_position),
            after,
        )
    ]
    # Measures of a motion need no parents; measures of a body are left out above.
    own_bones, alone = bones[joints], (-1,) * len(joints)
    for name, measure in moving:
        share = (measure.share or 0.0) * (len(both[0]) - 1)
        own_joints = tuple(joints.index(joint) for joint in measure.joints)
        old, new = (
            measures.evaluate(
                replace(measure, joints=own_joints),
                MeasuredMotion(own, answer.trust.duration, np.zeros(3), alone, own_bones, share),
            )
            for own in both
        )
        found[name] += new - old
    return found


def _joint_positions(
    poses: LimbPoses, joints: Sequence[int]
) -> Annotated[Floats, "frames joints 3"]:
    return np.stack([poses.position(joint) for joint in joints], axis=1)
