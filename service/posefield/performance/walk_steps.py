"""Walks of a script: planned, joined to the segment before, and recorded in the timeline."""

from dataclasses import replace

import numpy as np

from posefield.performance import approach
from posefield.performance.acts.staged_act import StagedAct
from posefield.performance.script import Script
from posefield.performance.timeline import Span, Timeline, check_distance, choose_blend
from posefield.performance.walk_entries import WalkEntry, find_entry, synthesis_settings, walk_of
from posefield.performance.walks import walk_passage, walk_phases, walk_segment
from posefield.performance.walks.walk_segment import WalkPlan


def add_walk(
    timeline: Timeline, script: Script, index: int, ahead: StagedAct | None
) -> StagedAct | None:
    """Go on with a walk; return the act that it leads to with its place, if there is one.

    ahead: act that a walk without an end of its own leads to. Raises InvalidField for a walk that
    the model cannot do.
    """
    entry = find_entry(timeline, script, index)
    if ahead is None:
        _, source = walk_of(script, index)
        plan = walk_segment.plan_walk(source.gait, entry.request, entry.start, entry.phase)
    else:
        plan, ahead = approach.lead_to(timeline, script, index, entry, ahead)
    _add(timeline, script, index, (plan, entry))
    return ahead


def _add(
    timeline: Timeline, script: Script, index: int, planned: tuple[WalkPlan, WalkEntry]
) -> None:
    (own, source), (plan, entry) = walk_of(script, index), planned
    passage = script.adapted(
        index, walk_passage.walk_passage(source.model, plan, synthesis_settings(script.question))
    )
    first = 0
    if entry.continues:
        first = timeline.go_on(passage)
    elif entry.cut is None:
        timeline.begin_with(passage)
    else:
        check_distance(own.join, entry.cut)
        gaits = timeline.spans[-1].kind == "walk" if timeline.spans else False, True
        kind, seconds = choose_blend(own.join, gaits)
        first = timeline.join(index, passage, replace(entry.cut, entry=0), kind, seconds)
    _record(timeline, script, plan, (index, first))


def _record(timeline: Timeline, script: Script, plan: WalkPlan, place: tuple[int, int]) -> None:
    """Add the span of a walk; place: its index, and the frame of its first one."""
    index, first = place
    own, source = walk_of(script, index)
    card, notes = source.model.session.card, [note.message for note in plan.notes]
    for note in plan.notes:
        # How a step is made is told by the notes of the segment alone.
        if note.code.startswith(walk_phases.SYNTHESISED):
            continue
        # Obstacles are those of the whole script; the end of a walk to an act is no field of it.
        if note.field.startswith("obstacles"):
            timeline.warn(f"/{note.field}", note.message)
            continue
        field = "" if note.field == "end" else f"/{note.field}"
        timeline.warn(f"/segments/{index}{field}", note.message)
    controls = dict(zip((c.name for c in card.controls), plan.controls[0].tolist(), strict=True))
    done = timeline.done
    sigma = float(np.sqrt(np.mean(np.square(done.sigmas[first:]))))
    timeline.spans.append(
        Span(
            "walk",
            source.model.identity,
            first,
            first,
            sigma,
            controls,
            phase=float(plan.phases[0] % 1.0),
            plan=plan,
            notes=tuple(notes),
        )
    )
    whole = plan.phases >= plan.phases[-1] - 1.0
    earliest = first + int(np.argmax(whole))
    # A walk that stops is left where it stands.
    timeline.exits = range(len(done) - 1 if own.stop == "standing" else earliest, len(done))
