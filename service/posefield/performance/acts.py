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
from posefield.constraints.targets import NO_CONSTRAINTS, JointTarget
from posefield.locomotion import floor_plane
from posefield.model_file.model_card import ModelCard
from posefield.performance import act_motion
from posefield.performance.act_motion import Act, StagedAct
from posefield.performance.limb_targets import WorldTarget
from posefield.performance.passage import RATE, FloorMotion
from posefield.performance.script import Script, Source
from posefield.performance.timeline import Span, Timeline, check_distance, choose_blend
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
    model: Synthesizer, asked: MotionQuestion, by: FloorMotion, world: Iterable[int] = ()
) -> Act:
    """Return the act of a question in the frame of a segment that `by` places in the world.

    world: indices of the targets whose positions are in the world; the other ones are in the frame
    of the segment. Raises as `act_motion.act_passage` does.
    """
    back, moved = by.inverse(), list(asked.targets)
    for index in world:
        found = back.place(np.array(_checked(index, moved[index])))
        moved[index] = _at(moved[index], found)
    return act_motion.act_passage(model, replace(asked, targets=tuple(moved)))


def act_from(
    model: Synthesizer,
    asked: MotionQuestion,
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
    rest = tuple(own for index, own in enumerate(asked.targets) if index not in world)
    free = act_motion.act_passage(model, replace(asked, targets=rest))
    if not world:
        return free, free.motion_to(position, facing)
    by = free.motion_to(position, facing)
    trial = replace(asked, extrapolate="ok")
    for _ in range(rounds):
        found = act_at(model, trial, by, world)
        start = complex(floor_plane.project(by.place(found.passage.roots[:1]))[0])
        gap, turn = abs(start - position), abs(by.turn + found.heading - facing)
        if max(gap, turn) < PLACE_TOLERANCE:
            return act_at(model, asked, by, world), by
        by = found.motion_to(position, facing)
    raise InvalidField(
        "at", f"the targets move the first pose {gap:.3g} m from it, expected targets that do not"
    )


def place_by_target(
    model: Synthesizer, asked: MotionQuestion, world: int = 0
) -> tuple[Act, complex]:
    """Return the act that takes place where its target in the world is.

    Second is where on the floor the joint then is, in the frame of the segment.
    world: index of the target whose position is in the world; the other ones are in the frame of
    the segment. The target's height constrains the motion; over the floor the joint stays where the
    motion without that target takes it, so that the motion does not depend on the place. Raises
    OutOfReach for a height that the motion does not reach, unless `extrapolate` is "ok", and as
    `act_motion.act_passage` does.
    """
    target = asked.targets[world]
    height = _checked(world, target)[1]
    given, point = _expected_position(model, asked, world)
    moved = list(asked.targets)
    moved[world] = _at(target, np.array([point[0], height, point[2]]))
    own = replace(given, targets=tuple(moved))
    try:
        act = act_motion.act_passage(model, own)
    except OutOfReach as fault:
        if fault.field != f"targets/{world}":
            raise
        raise _out_of_reach(model, asked, world, fault.message) from fault
    _, results = split_results(act.trust.targets, len(moved))
    if asked.extrapolate != "ok" and not results[world].reached:
        said = synthesizer.miss_warnings(results[world : world + 1])[0]
        raise _out_of_reach(model, asked, world, said)
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
    model: Synthesizer, asked: MotionQuestion, index: int
) -> tuple[MotionQuestion, Vector]:
    """Return the question with the target's height as a control, and where the joint then is.

    The position (3,), m, is that of the motion without this target, at the target's moment.
    """
    without = tuple(own for at, own in enumerate(asked.targets) if at != index)
    free = replace(asked, targets=without)
    goal = model.solver.constraints(model.question(free), asked).targets[index]
    heights = _heights(model.session.card, asked, goal)
    free = replace(free, controls={**asked.controls, **heights})
    question = model.question(free)
    held = model.solver.solve(question, model.solver.constraints(question, free))
    return free, _position(model, question, goal, held)


def _heights(card: ModelCard, asked: MotionQuestion, goal: JointTarget) -> dict[str, float]:
    """Return the control that is the height of a target, if there is one that is not given."""
    found = constraint_solver.controls_from_targets(card, asked.controls, (goal,))
    own = {c.name for c in card.controls if c.measure and c.measure.quantity == "height"}
    return {name: value for name, value in found.items() if name in own}


def _position(
    model: Synthesizer, question: ValidatedQuestion, goal: JointTarget, held: ConstrainedMotion
) -> Vector:
    """Return the position (3,), m, of a target's joint at its moment of a motion."""
    at = (goal.moment.share or 0.0) * (held.scene.reduced.frames - 1)
    if goal.time is not None:
        when = np.array([goal.time])
        at = float(
            model.session.state(question.point, when, question.labels, question.level).frames[0]
        )
    aim = PositionConstraint((goal.name,), goal.moment, (0, 1, 2), np.zeros(3), at)
    return aim.evaluate(held.scene, held.numbers)[0]


def _out_of_reach(
    model: Synthesizer, asked: MotionQuestion, index: int, message: str
) -> OutOfReach:
    """Return the error of a target at a height that is out of reach, with those within it."""
    question = model.question(replace(asked, targets=()))
    goal = model.solver.constraints(question, asked).targets[index]
    card, heights = model.session.card, []
    for controls, labels in zip(card.examples, card.clip_labels, strict=True):
        own = dataclasses.replace(question, point=np.array([controls]), labels=labels[None])
        held = model.solver.solve(own, NO_CONSTRAINTS)
        heights.append(_position(model, own, goal, held)[1])
    return OutOfReach(
        f"targets/{index}",
        f"{message}; captured clips have heights of {min(heights):.2f} to {max(heights):.2f} m",
    )


EXIT_SECONDS = 1.5
"""Time before the end of an act in which it may go on into the next segment, s."""


def question_of(script: Script, own: performance_question.Act) -> MotionQuestion:
    """Return the question of an act to its model, with its targets as they are in the script."""
    asked = script.question
    targets = tuple(
        Target(joint=each.joint, position=each.position, time=each.time, at=each.at)
        for each in own.targets
    )
    return MotionQuestion(
        controls=own.controls,
        extrapolate=asked.extrapolate,
        performer=own.performer,
        labels=own.labels,
        level=asked.level,
        exact=own.exact,
        targets=targets,
        take=asked.take,
        variety=asked.variety,
        detail=asked.detail,
    )


def act_of(script: Script, index: int) -> tuple[performance_question.Act, Source]:
    """Return an act of a script and its source."""
    own, source = script.segments[index], script.sources[index]
    if not isinstance(own, performance_question.Act) or source is None:
        raise TypeError(f"segment {index}, expected an act")
    return own, source


def world_targets(own: performance_question.Act) -> list[int]:
    """Return the indices of the targets of an act whose positions are in the world."""
    return [place for place, each in enumerate(own.targets) if each.frame == "world"]


def stage_after_walk(script: Script, index: int) -> StagedAct:
    """Return an act that says where it takes place, for a walk that leads there.

    Raises as `act_from` and `place_by_target` do.
    """
    own, source = act_of(script, index)
    asked, world = question_of(script, own), world_targets(own)
    if own.at is None:
        free, point = place_by_target(source.model, asked, world[0])
        goal = complex(floor_plane.project(np.array(own.targets[world[0]].position)))

        def facing(angle: float) -> FloorMotion:
            return free.motion_to(goal, angle, point)

        by = None if own.facing is None else facing(own.facing)
        return StagedAct(index, free, by, goal, facing)
    goal = complex(own.at[1], own.at[0])
    if own.facing is None and not world:
        act = act_motion.act_passage(source.model, asked)
        return StagedAct(index, act, None, goal, lambda angle: act.motion_to(goal, angle))
    if own.facing is None:
        raise InvalidField("facing", "none, expected one: the act has a place and a target")
    return StagedAct(index, *act_from(source.model, asked, goal, own.facing, world))


def stage_at_join(timeline: Timeline, script: Script, index: int) -> StagedAct:
    """Return an act that takes place where it says, or where the motion before it ends."""
    own, source = act_of(script, index)
    asked, world = question_of(script, own), world_targets(own)
    if own.at is not None:
        goal = complex(own.at[1], own.at[0])
        facing = script.question.start.heading if own.facing is None else own.facing
        return StagedAct(index, *act_from(source.model, asked, goal, facing, world))
    if own.facing is not None:
        raise InvalidField("facing", f"{own.facing:g} without at, expected with at only")
    if timeline.motion is None:
        x, z = script.question.start.position
        heading = script.question.start.heading
        return StagedAct(index, *act_from(source.model, asked, complex(z, x), heading, world))
    if not world:
        return StagedAct(index, act_motion.act_passage(source.model, asked), None)
    rest = tuple(each for place, each in enumerate(asked.targets) if place not in world)
    free = act_motion.act_passage(source.model, replace(asked, targets=rest))
    own_entries = entry_range(len(free.passage), free.event)
    cut = timeline.find_cut(script.adapted(index, free.passage), own_entries)
    return StagedAct(index, act_at(source.model, asked, cut.motion, world), cut.motion)


def add_act(timeline: Timeline, script: Script, staged: StagedAct) -> None:
    """Go on with an act."""
    index, act = staged.segment, staged.act
    own, _ = act_of(script, index)
    passage = script.adapted(index, act.passage) if staged.adapted is None else staged.adapted
    if timeline.motion is None:
        by = staged.by or FloorMotion()
        timeline.begin_with(passage.placed(by))
        first, begin = 0, 0
    else:
        entries = range(1) if own.join.cut == "end" else entries_of(script, staged, len(passage))
        if own.join.cut == "end":
            timeline.exits = timeline.exits[-1:]
        cut = timeline.find_cut(passage, entries, staged.by)
        check_distance(own.join, cut)
        by = cut.motion
        gaits = timeline.spans[-1].kind == "walk" if timeline.spans else False, False
        kind, seconds = choose_blend(own.join, gaits)
        first = timeline.join(index, passage.placed(by), cut, kind, seconds)
        begin = cut.exit
    _record(timeline, script, staged, (first, begin, by))


def _record(
    timeline: Timeline, script: Script, staged: StagedAct, place: tuple[int, int, FloorMotion]
) -> None:
    """Add the span of an act. place: frame of its own first one, of its begin, and its motion."""
    (first, begin, by), act, index = place, staged.act, staged.segment
    frames = [first + frame for frame in target_frames(script, staged)]
    own, source = act_of(script, index)
    trust, done = act.trust, timeline.done
    # An act that is entered after its event, as a return is, has no event of its own.
    event = None if act.event is None or first + act.event <= begin else first + act.event
    _, results = split_results(trust.targets, len(own.targets))
    # How far its limbs stay from targets is said of the character of the performance.
    missed = synthesizer.miss_warnings(results)
    for sentence in trust.warnings:
        if sentence not in missed:
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
    for number, (target, frame) in enumerate(zip(own.targets, frames, strict=True)):
        pointer = f"/segments/{index}/targets/{number}"
        position = np.array(target.position, dtype=np.float64)
        if target.frame == "segment":
            position = by.place(position)
        joint = source.model.session.card.skeleton.names.index(target.joint)
        timeline.targets.append(WorldTarget(joint, position, frame, frame, pointer))
