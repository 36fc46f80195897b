"""Holds of a script: the character comes to rest and stays as it is."""

from dataclasses import replace

import numpy as np

from posefield.performance.acts import hold_segment
from posefield.performance.acts.hold_segment import HeldBody
from posefield.performance.joins.blends import concatenate
from posefield.performance.script import Script
from posefield.performance.timeline import Span, Timeline
from posefield.question.performance_question import Hold

LOOKS_ASIDE = np.radians(2.0)
"""Angle by which the gaze may stay beside its point without a warning, rad."""


def add_hold(timeline: Timeline, script: Script, index: int) -> None:
    """Go on with a hold; an act before it stops at its event.

    Raises InvalidField for a joint that cannot be held, and for a point that cannot be looked at.
    """
    own = script.segments[index]
    if not isinstance(own, Hold):
        raise TypeError(f"segment {index}, expected a hold")
    _come_to_rest(timeline)
    before = timeline.done
    asked = hold_segment.Hold(
        own.seconds, own.joint or _held_joint(timeline, script), own.look_at, script.question.take
    )
    held = hold_segment.hold_passage(before, asked, _body(script))
    if held.miss > LOOKS_ASIDE:
        timeline.warn(
            f"/segments/{index}/look_at",
            f"the head looks {np.degrees(held.miss):.0f} degrees beside the point",
        )
    begin = len(before) - 1
    timeline.motion = concatenate(before, held.passage)
    model = timeline.spans[-1].model if timeline.spans else script.character.identity
    sigma = float(before.sigmas[-1])
    timeline.spans.append(Span("hold", model, begin, begin, sigma))
    # A target that holds at the begin of a hold holds until its end.
    last = len(timeline.done) - 1
    timeline.targets = [
        replace(each, end=last) if each.end == begin else each for each in timeline.targets
    ]
    timeline.exits = range(last, last + 1)


def _come_to_rest(timeline: Timeline) -> None:
    """End the motion at its last event, at rest; what happens at that frame happens later."""
    done, span = timeline.done, timeline.spans[-1] if timeline.spans else None
    if span is not None and span.kind == "hold":
        return
    last = len(done) - 1 if span is None or span.event is None else span.event
    rested = hold_segment.come_to_rest(done.part(0, last + 1))
    later = len(rested) - 1
    timeline.motion = rested
    if span is not None and span.event == last:
        timeline.spans[-1] = replace(span, event=later)
    timeline.targets = [
        replace(own, begin=later, end=later) if own.begin == last else own
        for own in timeline.targets
    ]


def _held_joint(timeline: Timeline, script: Script) -> str | None:
    """Return the joint of the event that the hold begins with, such as the hand of a reach."""
    index = len(timeline.spans) - 1
    source = script.sources[index] if index >= 0 else None
    event = None if source is None else source.model.session.card.event
    if event is None or timeline.spans[-1].kind != "act":
        return None
    return script.character.skeleton.names[event.joint]


def _body(script: Script) -> HeldBody:
    character = script.character
    names = character.skeleton.names
    joints = {role: names.index(joint) for role, joint in character.roles.items()}
    return HeldBody(names, character.skeleton.parents, character.bones, joints, character.facing)
