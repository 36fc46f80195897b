"""Feet of clips that stand, planned over the whole motion."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
from msgspec import structs

from posefield.common.units import UP, Floats
from posefield.constraints.targets import NO_CONSTRAINTS
from posefield.feet import body_plans, foot_placement, footsteps, limbs
from posefield.feet.footsteps import FeetPlan, PlanRequest
from posefield.feet.stance_rows import Cycle
from posefield.inference.onnx_runtime import CONTACTS
from posefield.locomotion import floor_plane
from posefield.locomotion.stride import Strides
from posefield.model_file.model_card import ModelCard
from posefield.motion import measures
from posefield.motion.contact_detection import FootContact
from posefield.motion.measures import MeasuredMotion
from posefield.question.motion_question import LEVEL_FLOOR
from posefield.question.results import FeetResult, StanceResult, round_micrometres
from posefield.synthesis.clip_draft import ClipDraft
from posefield.synthesis.synthesizer import Synthesizer

# Frames a second of the grid of a plan, and the smallest and largest number of its steps.
RATE, FEWEST, MOST = 60.0, 8, 600
UNREACHED = "does not stand: its leg does not reach the floor"


def set_plan(draft: ClipDraft, strides: Strides, duration: float, cyclic: bool) -> None:
    """Set the times of the plan of a motion (G,), s, and the floor motion of a cycle.

    The times of a cycle lack its last frame.
    """
    if cyclic:
        turn = float(strides.turns[0])
        gap = floor_plane.arc_displacement(strides.travels, strides.turns)[0]
        start, factor = strides.starts[0], complex(np.exp(1j * turn))
        draft.cycle = Cycle(complex(start + gap - factor * start), factor)
    steps = min(max(round(duration * RATE), FEWEST), MOST)
    draft.plan_times = np.arange(float(steps + (not cyclic))) * (duration / steps)


def stand(model: Synthesizer, drafts: Sequence[ClipDraft]) -> None:
    """Make the feet of answers stand, and put the facts about them into their trust.

    Each has the bytes that it has alone.
    """
    card = model.session.card
    contacts = [contact for contact in card.contacts if contact.joint in card.feet]
    feet = [contact.joint for contact in contacts] if contacts else list(card.feet)
    placed, requests = [], []
    for draft in drafts:
        answer, ground = draft.answer, draft.question.ground
        constraints = draft.constraints or NO_CONSTRAINTS
        measured = [measure for _, measure, _ in constraints.controls]
        moments = [target.moment for target in constraints.targets]
        exact_joints = {joint for measure in measured + moments for joint in measure.joints}
        character, planted, left_out = footsteps.choose_limbs(
            card.skeleton.parents,
            answer.bone_offsets,
            feet,
            exact_joints,
            card.hinges,
            card.skeleton.tips,
        )
        if planted:
            # A trunk may follow the floor where no constraint is on a height.
            raised = not moments and not any(
                measure.quantity == "height" or measure.at in ("highest", "lowest")
                for measure in measured
            )
            chosen = [contacts[index] for index in planted] if contacts else []
            rate = (len(draft.plan_times) - (draft.cycle is None)) / answer.trust.duration
            placed.append(draft)
            requests.append(
                PlanRequest(
                    replace(character, raised=raised),
                    *draft.plan_poses,
                    rate,
                    chosen,
                    _probabilities(model, draft, chosen) if chosen else None,
                    draft.cycle,
                    floor=ground,
                )
            )
        left = tuple(f"{card.skeleton.names[foot]} {why}" for foot, why in left_out)
        unplaced = FeetResult(
            (), 0, 0.0, 0.0, 0.0, 0.0, 0.0, left, None if ground == LEVEL_FLOOR else ground
        )
        draft.answer = replace(answer, trust=structs.replace(answer.trust, feet=unplaced))
    if not placed:
        return
    plans = body_plans.plan_motions(requests)
    frames = foot_placement.place_motions(
        plans,
        [draft.answer.times for draft in placed],
        [draft.answer.rotations for draft in placed],
        [draft.answer.root_position for draft in placed],
    )
    results = describe(plans, card.skeleton.names)
    for draft, plan, (rotations, roots), result in zip(placed, plans, frames, results, strict=True):
        trust = draft.answer.trust
        left = trust.feet.left if trust.feet else ()
        facts = structs.replace(
            trust,
            feet=structs.replace(result, left=left + result.left),
            measured=_measured(card, draft, plan),
        )
        draft.answer = replace(draft.answer, rotations=rotations, root_position=roots, trust=facts)


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
        foot_placement.mean_skate_speeds([before for before, _ in paths], rates),
        foot_placement.mean_skate_speeds(level, rates),
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
            None if plan.floor == LEVEL_FLOOR else plan.floor,
        )
        for plan, before, after, drift in zip(plans, *skates, drifts, strict=True)
    ]


def _stances(plan: FeetPlan, names: Sequence[str]) -> tuple[StanceResult, ...]:
    """Return the stances, from when the joint is in its place: the foot is flat."""
    return tuple(
        StanceResult(
            names[leg.tip],
            round_micrometres(min(flat, stance.stop - 1) / plan.rate),
            round_micrometres((stance.stop - 1) / plan.rate),
            tuple(map(round_micrometres, anchor)),
        )
        for leg, steps in zip(plan.character.legs, plan.steps, strict=True)
        for stance, anchor, flat in zip(
            steps.stances, steps.anchors.tolist(), steps.flats.tolist(), strict=True
        )
    )


def _swings(plan: FeetPlan) -> int:
    """Return the number of swings of all feet: the gaps between stances, which do not touch."""
    count, swings = len(plan.lowered), 0
    for steps in plan.steps:
        standing = sum(map(len, steps.stances))
        if plan.cycle is not None:
            swings += max(len(steps.stances), 1) * (standing < count)
        else:
            at_ends = [(stance.start == 0) + (stance.stop == count) for stance in steps.stances]
            swings += len(steps.stances) + 1 - sum(at_ends)
    return swings


def _probabilities(
    model: Synthesizer, draft: ClipDraft, feet: Sequence[FootContact]
) -> Annotated[Floats, "frames feet"]:
    """Return the probabilities (G, K) of the contacts of feet at the times of the plan."""
    question, times = draft.validated, draft.plan_times
    if draft.motion is not None:
        times = times * (draft.motion.state.duration / draft.motion.duration)
    (likely,) = model.session.run(
        question.point, times[None], CONTACTS, labels=question.labels, level=question.level
    )
    joints = [contact.joint for contact in model.session.card.contacts]
    return likely[0][:, [joints.index(foot.joint) for foot in feet]].astype(np.float64)


def _measured(card: ModelCard, draft: ClipDraft, plan: FeetPlan) -> dict[str, float]:
    """Return the measured controls of an answer, changed as the placing of the feet changes them.

    Controls that constrain it stay.
    """
    answer, before = draft.answer, draft.plan_poses
    constrained = {name for name, _, _ in draft.constraints.controls} if draft.constraints else ()
    values = dict(answer.trust.measured)
    moving = [
        (control.name, control.measure)
        for control in card.controls
        if control.measure and control.measure.joints and not control.measure.is_body_measure
    ]
    moving = [pair for pair in moving if pair[0] in values and pair[0] not in constrained]
    if not moving:
        return values
    bones, parents = answer.bone_offsets, card.skeleton.parents
    times = np.arange(len(plan.lowered)) / plan.rate
    joints = sorted({0, *(joint for _, measure in moving for joint in measure.joints)})
    after = foot_placement.place_feet(plan, times, *before, joints)
    # The joints that are measured alone: the whole skeleton takes a fifth of the feet's time.
    positions = []
    for rotations, roots in (before, after):
        posed = limbs.evaluate_joints(parents, bones, joints, rotations, roots)
        positions.append(np.stack([posed.position(joint) for joint in joints], axis=1))
    # Measures of a motion need no parents; measures of a body are left out above.
    measured_bones, no_parents = bones[joints], (-1,) * len(joints)
    for name, measure in moving:
        frame = (measure.share or 0.0) * (len(times) - 1)
        local = replace(measure, joints=tuple(joints.index(joint) for joint in measure.joints))
        old, new = (
            measures.evaluate(
                local,
                MeasuredMotion(
                    path, answer.trust.duration, np.zeros(3), no_parents, measured_bones, frame
                ),
            )
            for path in positions
        )
        values[name] += new - old
    return values
