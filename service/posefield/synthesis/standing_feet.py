"""Feet of clips that stand: which clips, and the plan over the whole motion."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import UP, Floats, round_micrometres
from posefield.constraints.targets import ConstraintSet
from posefield.feet import foot_placement, footsteps, limb_choice, limbs, stances
from posefield.feet.footsteps import FeetPlan, SampledMotion
from posefield.feet.limbs import LimbPoses
from posefield.feet.stances import Cycle
from posefield.inference.graph_ports import CONTACTS
from posefield.locomotion import floor_plane
from posefield.locomotion.stride import Strides
from posefield.model_file.model_card import ModelCard
from posefield.motion import foot_skate, measures
from posefield.motion.foot_contacts import FootContact
from posefield.motion.measures import MeasuredMotion
from posefield.question.floor import LEVEL_FLOOR, Floor
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import FeetResult, PoseAnswer, StanceResult
from posefield.question.value_validation import check_number, check_range
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

    poses: at times (S,), s. duration: s. stretch: duration of the prediction over this duration.
    cycle: floor motion of a cycle; None for a motion without cycles.
    """

    poses: Callable[[Floats], PoseAnswer[np.float64]]
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


def stand(
    model: Synthesizer,
    question: ValidatedQuestion,
    goals: ConstraintSet,
    answer: PoseAnswer[np.float64],
    motion: WholeMotion,
    floor: Floor = LEVEL_FLOOR,
) -> PoseAnswer[np.float64]:
    """Return the poses of an answer with standing feet, and with the facts about them in `trust`.

    goals: constraints that the motion meets, which stay met.
    """
    if not floor.is_level:
        # A cycle that climbs does not repeat.
        motion = replace(motion, cycle=None)
    card, times = model.session.card, motion.times
    poses = motion.poses(times)
    known = [own for own in card.contacts if own.joint in card.feet]
    feet = [own.joint for own in known] if known else list(card.feet)
    choice = limb_choice.choose_limbs(
        card.skeleton.parents, answer.bone_offsets, feet, _held_joints(goals)
    )
    left = tuple(f"{card.skeleton.names[foot]} {why}" for foot, why in choice.left)
    if not choice.feet:
        return replace(
            answer, trust=replace(answer.trust, feet=FeetResult(left=left, floor=_told(floor)))
        )
    rate = (len(times) - (motion.cycle is None)) / motion.duration
    sampled = SampledMotion(poses.rotations, poses.root_position, rate, motion.cycle)
    own = [known[place] for place in choice.feet] if known else []
    likely = _probabilities(model, question, own, times * motion.stretch) if known else None
    character = replace(choice.character, raised=_may_rise(goals))
    plan = footsteps.plan_feet(character, sampled, own, likely, floor)
    told = describe(plan, card.skeleton.names)
    told = replace(told, left=left + told.left)
    measured = _measured(card, goals, answer, poses, plan)
    placed = foot_placement.place_feet(plan, answer.times, answer.rotations, answer.root_position)
    trust = replace(answer.trust, feet=told, measured=measured)
    return replace(answer, rotations=placed.rotations, root_position=placed.roots, trust=trust)


def describe(plan: FeetPlan, names: Sequence[str]) -> FeetResult:
    """Return the facts about the placed feet of a whole motion."""
    whole = foot_placement.foot_paths(plan)
    found, swings, drift = [], 0, 0.0
    count, cyclic = len(plan.lowered), plan.cycle is not None
    for foot, (leg, steps) in enumerate(zip(plan.character.legs, plan.steps, strict=True)):
        swings += len(stances.runs(~stances.mask(steps.stances, count), cyclic))
        for stance, anchor in zip(steps.stances, steps.anchors, strict=True):
            frames = np.arange(stance.begin, min(stance.end, count))
            away = (whole.after[frames, foot] - anchor)[:, [0, 2]]
            drift = max(drift, float(np.linalg.norm(away, axis=-1).max()))
            position = tuple(map(round_micrometres, anchor.tolist()))
            begin, end = stance.begin / plan.rate, (stance.end - 1) / plan.rate
            found.append(
                StanceResult(
                    names[leg.tip], round_micrometres(begin), round_micrometres(end), position
                )
            )
    # Feet on a slope are low where they are near it.
    level = whole.after - plan.floor.heights(whole.after)[..., None] * UP
    before, after = (
        float(foot_skate.mean_skate_speed(paths, plan.rate)) for paths in (whole.before, level)
    )
    lowered = float((plan.lowered - plan.followed).max())
    return FeetResult(
        tuple(found),
        swings,
        round_micrometres(before),
        round_micrometres(after),
        round_micrometres(drift),
        round_micrometres(lowered),
        round_micrometres(plan.grounded),
        tuple(f"{names[plan.character.legs[leg].tip]} {UNREACHED}" for leg in plan.unreached),
        _told(plan.floor),
    )


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


def _measured(
    card: ModelCard,
    goals: ConstraintSet,
    answer: PoseAnswer[np.float64],
    before: PoseAnswer[np.float64],
    plan: FeetPlan,
) -> dict[str, float]:
    """Return the measured controls of an answer, changed as the placing of the feet changes them.

    before: the whole motion, on the grid of the plan. Controls that constrain it stay.
    """
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
            (after.rotations, after.roots),
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
