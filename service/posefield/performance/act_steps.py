"""Acts and holds of a script: where they take place, and how they go on."""

import numpy as np

from posefield.common.errors import InvalidField
from posefield.performance.acts import act_placement, act_segment
from posefield.performance.acts.staged_act import StagedAct
from posefield.performance.approach import entries_of, entry_range, target_frames
from posefield.performance.passages.limb_targets import WorldTarget
from posefield.performance.passages.passage import RATE, FloorMotion
from posefield.performance.script import Script, Source
from posefield.performance.timeline import Span, Timeline, check_distance, choose_blend
from posefield.question import performance_question
from posefield.question.motion_question import MotionQuestion, Target, replace
from posefield.question.results import split_results
from posefield.synthesis import synthesizer

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


def has_place(own: performance_question.Act) -> bool:
    """Return whether an act says where it takes place, so that a walk can lead there."""
    return own.at is not None or bool(world_targets(own))


def stage_after_walk(script: Script, index: int) -> StagedAct:
    """Return an act that says where it takes place, for a walk that leads there.

    Raises as `act_placement` does.
    """
    own, source = act_of(script, index)
    asked, world = question_of(script, own), world_targets(own)
    if own.at is None:
        free = act_placement.place_by_target(source.model, asked, world[0])
        turned = StagedAct(index, free.act, None, free.goal, lambda angle: free.facing(angle).by)
        return turned if own.facing is None else turned.faced(own.facing)
    goal = complex(own.at[1], own.at[0])
    if own.facing is None and not world:
        act = act_segment.act_passage(source.model, asked)
        return StagedAct(index, act, None, goal, lambda angle: act.motion_to(goal, angle))
    if own.facing is None:
        raise InvalidField("facing", "none, expected one: the act has a place and a target")
    found = act_placement.act_from(source.model, asked, goal, own.facing, world)
    return StagedAct(index, found.act, found.by)


def stage_at_join(timeline: Timeline, script: Script, index: int) -> StagedAct:
    """Return an act that takes place where it says, or where the motion before it ends."""
    own, source = act_of(script, index)
    asked, world = question_of(script, own), world_targets(own)
    if own.at is not None:
        goal = complex(own.at[1], own.at[0])
        facing = script.question.start.heading if own.facing is None else own.facing
        found = act_placement.act_from(source.model, asked, goal, facing, world)
        return StagedAct(index, found.act, found.by)
    if own.facing is not None:
        raise InvalidField("facing", f"{own.facing:g} without at, expected with at only")
    if timeline.motion is None:
        x, z = script.question.start.position
        heading = script.question.start.heading
        found = act_placement.act_from(source.model, asked, complex(z, x), heading, world)
        return StagedAct(index, found.act, found.by)
    if not world:
        return StagedAct(index, act_segment.act_passage(source.model, asked), None)
    rest = tuple(each for place, each in enumerate(asked.targets) if place not in world)
    free = act_segment.act_passage(source.model, replace(asked, targets=rest))
    own_entries = entry_range(len(free.passage), free.event)
    cut = timeline.find_cut(script.adapted(index, free.passage), own_entries)
    return StagedAct(
        index, act_placement.act_at(source.model, asked, cut.motion, world), cut.motion
    )


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
