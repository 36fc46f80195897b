"""Holds: a character stops and stays in its pose for a time, such as with a hand at a shelf.

After an act that has an event, such as the grasp of a reach, it stops at the event; else at the end
of the motion so far, which slows down first. Targets that are met when it begins stay met until its
end.
"""

from dataclasses import replace

import numpy as np

from posefield.common.errors import InvalidField
from posefield.feet.stance_rows import STANDING
from posefield.motion import skeleton
from posefield.performance import held_pose
from posefield.performance.limb_targets import WorldTarget
from posefield.performance.passage import RATE, concatenate
from posefield.performance.script import Script
from posefield.performance.timeline import Span, Timeline
from posefield.question.performance_question import Hold

LOOKS_ASIDE = np.radians(15.0)
"""Angle by which the head may stay beside its point without a warning, rad: eyes alone look as far
aside (Stahl, "Amplitude of human head movements associated with horizontal saccades", 1999)."""


def add_hold(timeline: Timeline, script: Script, index: int) -> None:
    """Add a hold to the motion; an act before it stops at its event.

    Raises InvalidField for a joint that cannot be held, for a point that cannot be looked at, and
    for an act before it that has a target after its event.
    """
    hold = script.segments[index]
    if not isinstance(hold, Hold):
        raise TypeError(f"segment {index}, expected a hold")
    _come_to_rest(timeline)
    before = timeline.done
    joint = hold.joint or _held_joint(timeline, script)
    character = script.character
    body = held_pose.body_of(
        character.skeleton,
        character.roles,
        character.bones,
        character.facing,
        character.body.hinges,
    )
    passage, miss = held_pose.hold_passage(
        before, body, hold.seconds, joint, hold.look_at, script.question.take
    )
    if miss > LOOKS_ASIDE:
        timeline.warn(
            f"/segments/{index}/look_at",
            f"the head looks {np.degrees(miss):.0f} degrees beside the point",
        )
    begin = len(before) - 1
    timeline.motion = concatenate(before, passage)
    model = timeline.spans[-1].model if timeline.spans else script.character.identity
    sigma = float(before.sigmas[-1])
    timeline.spans.append(Span("hold", model, begin, begin, sigma))
    # A target that holds at the begin of a hold holds until its end.
    last = len(timeline.done) - 1
    timeline.targets = [
        replace(target, end=last) if target.end == begin else target for target in timeline.targets
    ]
    timeline.targets += _held_place(timeline, script, joint, range(begin, last + 1), index)
    timeline.exits = range(last, last + 1)


def _held_place(
    timeline: Timeline, script: Script, joint: str | None, frames: range, index: int
) -> list[WorldTarget]:
    """Return the place of the joint that is held as a target, so that feet are planned around it.

    Empty for a joint that stays anyway: one with a target there, or of a foot that stands.
    """
    body, character = script.character.body, script.character
    if joint is None:
        return []
    index_of_joint = character.skeleton.names.index(joint)
    above = skeleton.joint_chain(body.parents, index_of_joint)
    standing = timeline.done.contacts[frames.start] > STANDING
    legs = zip(body.legs, standing.tolist(), strict=True)
    targets = [target for target in timeline.targets if target.end == frames[-1]]
    if any(down and leg.lower in above for leg, down in legs) or index_of_joint in {
        target.joint for target in targets
    }:
        return []
    pose = timeline.done.part(frames.start, frames.start + 1)
    translations = skeleton.translations(body.bones, pose.roots)
    position = skeleton.positions(body.parents, pose.rotations, translations)[0, index_of_joint]
    return [WorldTarget(index_of_joint, position, frames[0], frames[-1], f"/segments/{index}")]


def _come_to_rest(timeline: Timeline) -> None:
    """End the motion at its last event, at rest; targets near it are met later."""
    done, span = timeline.done, timeline.spans[-1] if timeline.spans else None
    if span is not None and span.kind == "hold":
        return
    last = len(done) - 1 if span is None or span.event is None else span.event
    late = next((target for target in timeline.targets if target.begin > last), None)
    if late is not None:
        raise InvalidField(
            "",
            f"stops the act before it at its event, {(late.begin - last) / RATE:.2f} s before the "
            f"moment of the target {late.pointer}, expected targets until the event",
        )
    rested = held_pose.come_to_rest(done.part(0, last + 1))
    later = len(rested) - 1
    timeline.motion = rested
    if span is not None and span.event == last:
        timeline.spans[-1] = replace(span, event=later)
    timeline.targets = [
        replace(
            target,
            begin=held_pose.rest_frame(last + 1, target.begin),
            end=held_pose.rest_frame(last + 1, target.end),
        )
        for target in timeline.targets
    ]


def _held_joint(timeline: Timeline, script: Script) -> str | None:
    """Return the joint of the event that the hold begins with, such as the hand of a reach."""
    index = len(timeline.spans) - 1
    source = script.sources[index] if index >= 0 else None
    event = None if source is None else source.model.session.card.event
    if event is None or timeline.spans[-1].kind != "act":
        return None
    return script.character.skeleton.names[event.joint]
