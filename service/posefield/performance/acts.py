"""Acts of a script: where they take place, and how they go on.

An act takes place at a point of the floor, or where the joint of a target meets it.
"""

import dataclasses
from collections.abc import Iterable

import numpy as np

from posefield.common.errors import InvalidField, OutOfReach
from posefield.common.units import Vector
from posefield.constraints import constraint_solver
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.constraint import PositionConstraint
from posefield.constraints.targets import NO_CONSTRAINTS, JointTarget, from_question
from posefield.locomotion import floor_plane
from posefield.model_file.model_card import Control, ModelCard
from posefield.motion.measures import POSITION_AXES, Measure
from posefield.performance import act_motion, joins
from posefield.performance.act_motion import Act, StagedAct
from posefield.performance.limb_targets import WorldTarget
from posefield.performance.passage import RATE, FloorMotion, scale_heights
from posefield.performance.script import Script, Source
from posefield.performance.timeline import VISIBLE, Span, Timeline, check_distance, choose_blend
from posefield.performance.walk_steps import entries_of, entry_range, target_frames
from posefield.question import motion_question, performance_question
from posefield.question.motion_question import MotionQuestion, Target, replace
from posefield.question.results import split_results
from posefield.synthesis import synthesizer
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.question_validation import ValidatedQuestion

# The first pose moves when targets are met, and the targets in its frame with it: the most rounds,
# and the distance, m, and the angle, rad, from the asked place at which they end.
MAX_ROUNDS, PLACE_TOLERANCE = 16, 1e-5


def act_at(
    model: Synthesizer, question: MotionQuestion, by: FloorMotion, world: Iterable[int] = ()
) -> Act:
    """Return the act of a question in the frame of a segment that `by` places in the world.

    world: indices of the targets whose positions are in the world; the other ones are in the frame
    of the segment. Raises as `act_motion.act_passage` does.
    """
    back, targets = by.inverse(), list(question.targets)
    for index in world:
        position = back.place(np.array(_checked(index, targets[index])))
        targets[index] = _at(targets[index], position)
    return act_motion.act_passage(model, replace(question, targets=tuple(targets)))


def act_from(
    model: Synthesizer,
    question: MotionQuestion,
    position: complex,
    facing: float,
    world: Iterable[int] = (),
    rounds: int = MAX_ROUNDS,
) -> tuple[Act, FloorMotion]:
    """Return the act whose first frame's root is at a place of the floor, and what places it.

    position: forward is its real part, left its imaginary part, m. facing: rad. world: as in
    `act_at`. rounds: largest number of them. Raises InvalidField for targets that move the first
    pose in each round, and as `act_at` does.
    """
    world = tuple(world)
    rest = tuple(target for index, target in enumerate(question.targets) if index not in world)
    free = act_motion.act_passage(model, replace(question, targets=rest))
    if not world:
        return free, free.motion_to(position, facing)
    by = free.motion_to(position, facing)
    trial = replace(question, extrapolate="ok")
    for _ in range(rounds):
        act = act_at(model, trial, by, world)
        start = complex(floor_plane.project(by.place(act.passage.roots[:1]))[0])
        gap, turn = abs(start - position), abs(by.turn + act.heading - facing)
        if max(gap, turn) < PLACE_TOLERANCE:
            return act_at(model, question, by, world), by
        by = act.motion_to(position, facing)
    raise InvalidField(
        "at", f"the targets move the first pose {gap:.3g} m from it, expected targets that do not"
    )


def place_by_target(
    model: Synthesizer, question: MotionQuestion, world: int = 0
) -> tuple[Act, complex]:
    """Return the act that takes place where its target in the world is.

    Second is where on the floor the joint then is, in the frame of the segment.
    world: index of the target whose position is in the world; the other ones are in the frame of
    the segment. The target's height constrains the motion; over the floor the joint stays where the
    motion without that target takes it, so that the motion does not depend on the place. Raises
    OutOfReach for a height that the motion does not reach, unless `extrapolate` is "ok", and as
    `act_motion.act_passage` does.
    """
    target = question.targets[world]
    height = _checked(world, target)[1]
    with_height, point = _expected_position(model, question, world)
    targets = list(question.targets)
    targets[world] = _at(target, np.array([point[0], height, point[2]]))
    with_point = replace(with_height, targets=tuple(targets))
    try:
        act = act_motion.act_passage(model, with_point)
    except OutOfReach as fault:
        if fault.field != f"targets/{world}":
            raise
        raise _out_of_reach(model, question, world, fault.message) from fault
    _, results = split_results(act.trust.targets, len(targets))
    if question.extrapolate != "ok" and not results[world].reached:
        message = synthesizer.miss_warnings(results[world : world + 1])[0]
        raise _out_of_reach(model, question, world, message)
    return act, complex(floor_plane.project(point))


def _at(target: Target, position: Vector) -> Target:
    return replace(target, position=tuple(map(float, position)))


def _checked(index: int, target: Target) -> tuple[float, ...]:
    """Return the position of a target; InvalidField for other than three numbers."""
    if len(target.position) != 3:
        raise InvalidField(
            f"targets/{index}/position", f"{len(target.position)} numbers, expected three"
        )
    return tuple(
        motion_question.check_number(f"targets/{index}/position/{axis}", value)
        for axis, value in enumerate(target.position)
    )


def _expected_position(
    model: Synthesizer, act_question: MotionQuestion, index: int
) -> tuple[MotionQuestion, Vector]:
    """Return the question with the target's height as a control, and where the joint then is.

    The position (3,), m, is that of the motion without this target, at the target's moment.
    """
    without = tuple(target for at, target in enumerate(act_question.targets) if at != index)
    free = replace(act_question, targets=without)
    goal = from_question(model.session.card, model.question(free), act_question).targets[index]
    heights = _heights(model.session.card, act_question, goal)
    free = replace(free, controls={**act_question.controls, **heights})
    question = model.question(free)
    motion = model.solver.solve(question, from_question(model.session.card, question, free))
    return free, _position(model, question, goal, motion)


def _heights(card: ModelCard, question: MotionQuestion, goal: JointTarget) -> dict[str, float]:
    """Return the control that is the height of a target, if there is one that is not given."""
    controls = constraint_solver.controls_from_targets(card, question.controls, (goal,))
    height_controls = {
        c.name for c in card.controls if c.measure and c.measure.quantity == "height"
    }
    return {name: value for name, value in controls.items() if name in height_controls}


def _position(
    model: Synthesizer, question: ValidatedQuestion, goal: JointTarget, motion: ConstrainedMotion
) -> Vector:
    """Return the position (3,), m, of a target's joint at its moment of a motion."""
    at = (goal.moment.share or 0.0) * (motion.scene.reduced.frames - 1)
    if goal.time is not None:
        when = np.array([goal.time])
        at = float(
            model.session.state(question.point, when, question.labels, question.level).frames[0]
        )
    aim = PositionConstraint((goal.name,), goal.moment, (0, 1, 2), np.zeros(3), at)
    return aim.evaluate(motion.scene, motion.numbers)[0]


def _out_of_reach(
    model: Synthesizer, act_question: MotionQuestion, index: int, message: str
) -> OutOfReach:
    """Return the error of a target at a height that is out of reach, with those within it."""
    question = model.question(replace(act_question, targets=()))
    goal = from_question(model.session.card, question, act_question).targets[index]
    card, heights = model.session.card, []
    for controls, labels in zip(card.examples, card.clip_labels, strict=True):
        captured = dataclasses.replace(question, point=np.array([controls]), labels=labels[None])
        motion = model.solver.solve(captured, NO_CONSTRAINTS)
        heights.append(_position(model, captured, goal, motion)[1])
    return OutOfReach(
        f"targets/{index}",
        f"{message}; captured clips have heights of {min(heights):.2f} to {max(heights):.2f} m",
    )


EXIT_SECONDS = 1.5
"""Time before the end of an act in which it may go on into the next segment, s."""


def question_of(script: Script, act: performance_question.Act) -> MotionQuestion:
    """Return the question of an act to its model, with its targets as they are in the script."""
    performance = script.question
    targets = tuple(
        Target(joint=target.joint, position=target.position, time=target.time, at=target.at)
        for target in act.targets
    )
    return MotionQuestion(
        controls=act.controls,
        extrapolate=performance.extrapolate,
        performer=act.performer,
        labels=act.labels,
        level=performance.level,
        exact=act.exact,
        targets=targets,
        take=performance.take,
        variety=performance.variety,
        detail=performance.detail,
    )


def act_of(script: Script, index: int) -> tuple[performance_question.Act, Source]:
    """Return an act of a script and its source."""
    act, source = script.segments[index], script.sources[index]
    if not isinstance(act, performance_question.Act) or source is None:
        raise TypeError(f"segment {index}, expected an act")
    return act, source


def world_targets(act: performance_question.Act) -> list[int]:
    """Return the indices of the targets of an act whose positions are in the world."""
    return [index for index, target in enumerate(act.targets) if target.frame == "world"]


def stage_after_walk(script: Script, index: int) -> StagedAct:
    """Return an act that says where it takes place, for a walk that leads there.

    Raises as `act_from` and `place_by_target` do.
    """
    segment, source = act_of(script, index)
    question, world = question_of(script, segment), world_targets(segment)
    if segment.at is None:
        free, point = place_by_target(source.model, question, world[0])
        goal = complex(floor_plane.project(np.array(segment.targets[world[0]].position)))

        def facing(angle: float) -> FloorMotion:
            return free.motion_to(goal, angle, point)

        by = None if segment.facing is None else facing(segment.facing)
        return StagedAct(index, free, by, goal, facing)
    goal = complex(segment.at[1], segment.at[0])
    if segment.facing is None and not world:
        act = act_motion.act_passage(source.model, question)
        return StagedAct(index, act, None, goal, lambda angle: act.motion_to(goal, angle))
    if segment.facing is None:
        raise InvalidField("facing", "none, expected one: the act has a place and a target")
    return StagedAct(index, *act_from(source.model, question, goal, segment.facing, world))


def stage_at_join(timeline: Timeline, script: Script, index: int) -> StagedAct:
    """Return an act that takes place where it says, or where the motion before it ends."""
    segment, source = act_of(script, index)
    question, world = question_of(script, segment), world_targets(segment)
    if segment.at is not None:
        goal = complex(segment.at[1], segment.at[0])
        facing = script.question.start.heading if segment.facing is None else segment.facing
        return StagedAct(index, *act_from(source.model, question, goal, facing, world))
    if segment.facing is not None:
        raise InvalidField("facing", f"{segment.facing:g} without at, expected with at only")
    if timeline.motion is None:
        x, z = script.question.start.position
        heading = script.question.start.heading
        return StagedAct(index, *act_from(source.model, question, complex(z, x), heading, world))
    question = _going_on(timeline, script, index, question)
    if not world:
        return StagedAct(index, act_motion.act_passage(source.model, question), None)
    rest = tuple(target for number, target in enumerate(question.targets) if number not in world)
    free = act_motion.act_passage(source.model, replace(question, targets=rest))
    entries = entry_range(len(free.passage), free.event)
    cut = timeline.find_cut(script.adapted(index, free.passage), entries)
    return StagedAct(index, act_at(source.model, question, cut.motion, world), cut.motion)


def _going_on(
    timeline: Timeline, script: Script, index: int, question: MotionQuestion
) -> MotionQuestion:
    """Return the question of an act with the first pose's controls of the pose it goes on from.

    They are measured as in training, on the bones of the character, and kept within the captured
    ranges. Controls that the script gives, as such or by a target of their joint, stay.
    """
    segment, source = act_of(script, index)
    measures = _open_measures(segment, source.model.session.card)
    if not measures:
        return question
    free = act_motion.act_passage(source.model, replace(question, targets=()))
    exit_frame = timeline.exits[-1]
    if len(timeline.exits) > 1:
        entries = entry_range(len(free.passage), free.event)
        exit_frame = timeline.find_cut(script.adapted(index, free.passage), entries).exit
    pose = timeline.done.part(exit_frame, exit_frame + 1)
    by = free.motion_to(complex(floor_plane.project(pose.roots[0])), pose.heading()).inverse()
    points = by.place(joins.positions(script.character.body, pose, 0, 1)[0])
    points = scale_heights(points, 1.0 / source.share)
    controls = {
        control.name: float(np.clip(point.mean(), control.minimum, control.maximum))
        for control, measure in measures
        for point in [points[list(measure.joints), POSITION_AXES[measure.quantity]]]
    }
    # The user is not told of controls that only the engine chose.
    policy = question.extrapolate if segment.controls or segment.targets else "ok"
    return replace(question, controls={**question.controls, **controls}, extrapolate=policy)


def _open_measures(act: performance_question.Act, card: ModelCard) -> list[tuple[Control, Measure]]:
    """Return the controls that are measured in the first pose and that an act leaves open."""
    names, joints_of_targets = card.skeleton.names, {target.joint for target in act.targets}
    return [
        (control, control.measure)
        for control in card.controls
        if control.measure is not None
        and control.measure.at == "start"
        and control.name not in act.controls
        and joints_of_targets.isdisjoint(names[joint] for joint in control.measure.joints)
    ]


def add_act(timeline: Timeline, script: Script, staged: StagedAct) -> None:
    """Go on with an act."""
    index, act = staged.segment, staged.act
    segment, _ = act_of(script, index)
    passage = script.adapted(index, act.passage) if staged.adapted is None else staged.adapted
    if timeline.motion is None:
        by = staged.by or FloorMotion()
        timeline.begin_with(passage.placed(by))
        first, begin = 0, 0
    else:
        entries = (
            range(1) if segment.join.cut == "end" else entries_of(script, staged, len(passage))
        )
        if segment.join.cut == "end":
            timeline.exits = timeline.exits[-1:]
        cut = timeline.find_cut(passage, entries, staged.by)
        check_distance(segment.join, cut)
        by = cut.motion
        gaits = timeline.spans[-1].kind == "walk" if timeline.spans else False, False
        kind, seconds = choose_blend(segment.join, gaits)
        first = timeline.join(index, passage.placed(by), cut, kind, seconds)
        begin = cut.exit
    _record(timeline, script, staged, (first, begin, by))


def _record(
    timeline: Timeline, script: Script, staged: StagedAct, placement: tuple[int, int, FloorMotion]
) -> None:
    """Add the span of an act.

    placement: frame of its own first one, of its begin, and its motion.
    """
    (first, begin, by), act, index = placement, staged.act, staged.segment
    frames = [first + frame for frame in target_frames(script, staged)]
    segment, source = act_of(script, index)
    trust, done = act.trust, timeline.done
    # An act that is entered after its event, as a return is, has no event of its own.
    event = None if act.event is None or first + act.event <= begin else first + act.event
    _, results = split_results(trust.targets, len(segment.targets))
    # How far its limbs stay from targets is said of the character of the performance.
    unseen = [
        *synthesizer.miss_warnings(results),
        *(
            deviation.sentence
            for deviation in trust.deviations
            if deviation.control not in segment.controls
            or (deviation.unit == "m" and abs(deviation.given - deviation.asked) < VISIBLE)
        ),
    ]
    for sentence in trust.warnings:
        if sentence not in unseen:
            timeline.warn(f"/segments/{index}", sentence)
    timeline.spans.append(
        Span(
            "act",
            source.model.identity,
            begin,
            first,
            trust.sigma,
            dict(trust.controls),
            event=event,
            targets=results,
            supported=trust.supported,
            notes=source.match.notes,
        )
    )
    last = len(done) - 1
    earliest = max(begin + 1, last - round(EXIT_SECONDS * RATE), event or 0, *frames)
    timeline.exits = range(min(earliest, last), last + 1)
    for number, (target, frame) in enumerate(zip(segment.targets, frames, strict=True)):
        pointer = f"/segments/{index}/targets/{number}"
        position = np.array(target.position, dtype=np.float64)
        if target.frame == "segment":
            position = by.place(position)
        joint = source.model.session.card.skeleton.names.index(target.joint)
        timeline.targets.append(WorldTarget(joint, position, frame, frame, pointer))
