"""Walks of a script: where they begin, and how they come to where the next segment begins."""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common import cancellation
from posefield.inference.takes import TakeSettings
from posefield.locomotion import floor_plane
from posefield.model_file.model_card import PERFORMER
from posefield.performance.acts.staged_act import StagedAct
from posefield.performance.joins import cut_search
from posefield.performance.joins.cut_search import Cut
from posefield.performance.passages.passage import RATE, FloorMotion, Passage
from posefield.performance.script import Script, Source
from posefield.performance.timeline import (
    Span,
    Timeline,
    check_distance,
    choose_blend,
    heading,
)
from posefield.performance.walks import walk_passage, walk_segment, walker
from posefield.performance.walks.discs import Disc
from posefield.performance.walks.walk_passage import Manner
from posefield.performance.walks.walk_request import WalkRequest
from posefield.performance.walks.walk_segment import WalkPlan
from posefield.question.performance_question import PerformanceQuestion, Walk

# Times that the end of a walk is moved so that the act after it lies where it should, and the
# smallest shift, m, and turn, rad, for which it is moved once more.
APPROACHES, NEAR, STRAIGHT = 8, 0.01, 0.01
LAST_FRAMES = 3
"""Frames at the end of a walk that tell where an act lies that it goes on into."""
MOST_CHANGED = 0.08
"""Share by which strides are made longer or shorter so that a walk ends in a phase."""
MOVING = 0.05
"""Smallest distance that an act moves in `ENTRY_SECONDS` for it to have a direction, m."""
ENTRY_SECONDS = 0.35
"""Time from the start of an act in which a motion may go on into it, s."""


def manner(question: PerformanceQuestion) -> Manner:
    """Return the level of detail and the take of a script."""
    take = TakeSettings(question.take, question.variety, question.detail)
    return Manner(question.level, take if take.seed or take.detail else None)


def request_of(script: Script, own: Walk, source: Source) -> WalkRequest:
    """Return the walk that a segment asks for."""
    usual = float(source.walks.rates[:, 0].mean())
    names = {PERFORMER: own.performer} if own.performer is not None else {}
    discs = tuple(Disc(*disc.position, disc.radius) for disc in script.question.obstacles)
    along = None if own.along is None else np.array(own.along, dtype=np.float64)
    return WalkRequest(
        usual if own.speed is None else own.speed,
        along=along,
        to=own.to,
        seconds=own.seconds,
        turn=own.turn,
        speed_over=own.speed_over,
        labels={**own.labels, **names},
        controls=own.controls,
        start=own.start,
        stop=own.stop,
        obstacles=discs,
        detour=bool(discs) and own.along is None and own.seconds is None,
    )


def add_walk(timeline: Timeline, script: Script, index: int) -> None:
    """Go on with a walk that has an end of its own.

    Raises InvalidField for a walk that the model cannot do.
    """
    own, source = walk_of(script, index)
    entry = _entry(timeline, script, index, request_of(script, own, source))
    plan = walk_segment.plan_walk(source.walks, entry.request, entry.start, entry.phase)
    _add(timeline, script, index, (plan, entry))


def add_walk_to(timeline: Timeline, script: Script, index: int, staged: StagedAct) -> StagedAct:
    """Go on with a walk that leads to an act, and return the act with its place."""
    own, source = walk_of(script, index)
    entry = _entry(timeline, script, index, request_of(script, own, source))
    plan, placed = _approach(timeline, script, (index, entry), staged)
    _add(timeline, script, index, (plan, entry))
    return placed


def walk_of(script: Script, index: int) -> tuple[Walk, Source]:
    """Return a walk of a script and its source."""
    own, source = script.segments[index], script.sources[index]
    if not isinstance(own, Walk) or source is None:
        raise TypeError(f"segment {index}, expected a walk")
    return own, source


def _add(
    timeline: Timeline, script: Script, index: int, planned: tuple[WalkPlan, "WalkEntry"]
) -> None:
    (own, source), (plan, entry) = walk_of(script, index), planned
    passage = script.adapted(
        index, walk_passage.walk_passage(source.model, plan, manner(script.question))
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


@dataclass(frozen=True)
class WalkEntry:
    """Begin of a walk.

    request: of the walk. start: of its path. phase: of its cycle. cut: into it; None for the first
    segment. continues: whether it goes on from a walk of the same walker, without a join.
    """

    request: WalkRequest
    start: FloorMotion
    phase: float
    cut: Cut | None = None
    continues: bool = False


def _continued(timeline: Timeline, source: Source, request: WalkRequest) -> WalkEntry | None:
    """Return how a walk goes on from one of the same walker; None if it does not."""
    before = timeline.spans[-1] if timeline.spans else None
    if before is None or before.plan is None or before.model != source.model.identity:
        return None
    plan, rolling = before.plan, request.start == "rolling"
    same = plan.walker.is_same(walker.find_walker(source.walks, request.labels, request.controls))
    if not (same and rolling and plan.speeds[-1] > 0.0):
        return None
    low, high = source.walks.region.speeds
    speed, turn = plan.exit_rates
    own = replace(
        request,
        entry_speed=float(np.clip(speed, low, high)),
        entry_turn=turn if request.seconds is not None else None,
    )
    return WalkEntry(own, plan.end, float(plan.phases[-1] % 1.0), continues=True)


def _entry(timeline: Timeline, script: Script, index: int, request: WalkRequest) -> WalkEntry:
    """Return how a walk begins: at the start of the script, or at the phase most like the exit."""
    own, source = walk_of(script, index)
    if timeline.motion is None:
        begun = script.question.start
        x, z = begun.position
        return WalkEntry(request, FloorMotion(begun.heading, complex(z, x)), 0.0)
    continued = _continued(timeline, source, request)
    if continued is not None:
        return continued
    if own.join.cut == "end":
        timeline.exits = timeline.exits[-1:]
    who = walker.find_walker(source.walks, request.labels, request.controls)
    speed = request.speed if isinstance(request.speed, float | int) else request.speed[0][1]
    controls = who.controls(np.clip([speed], *source.walks.region.speeds), np.zeros(1))
    stride = who.strides(controls)
    frames = max(round(float(stride.durations[0]) * RATE), 8)
    cycle = walk_passage.cycle_passage(
        source.model, who, controls[0], frames, manner(script.question)
    )
    cut = timeline.find_cut(script.adapted(index, cycle), range(frames))
    phase = cut.entry / frames
    turned = phase * float(stride.turns[0])
    travelled = floor_plane.arc_displacement(phase * stride.travels[0], np.array(turned))
    offset = who.mean_offsets(controls)[0]
    # The path of a walk is that of the mean root, and runs the way it travels.
    place = complex(travelled + np.exp(1j * turned) * offset)
    local = FloorMotion(turned + float(stride.drifts[0]), place)
    return WalkEntry(request, cut.motion.after(local), phase, replace(cut, motion=FloorMotion()))


def _approach(
    timeline: Timeline,
    script: Script,
    asked: tuple[int, WalkEntry],
    staged: StagedAct,
) -> tuple[WalkPlan, StagedAct]:
    """Return the plan of a walk whose end leads into an act, and the act with its place.

    First the phase of the cycle is found from which the act goes on best; then the walk is made to
    end in it, and its end is moved until the act lies where it should. An act without a heading of
    its own faces the way the walk comes.
    """
    index, entry = asked
    _, source = walk_of(script, index)
    act = script.adapted(staged.segment, staged.act.passage)
    entries = entry_range(act, staged.act.event)
    by = staged.by or staged.facing(float(np.angle(staged.goal - entry.start.shift)))
    end, phase = by.after(_arrival(act)), None
    for _ in range(APPROACHES):
        cancellation.check()
        found = replace(entry.request, **({"end": end} if staged.by else {"to": _point(end)}))
        plan = walk_segment.plan_walk(source.walks, found, entry.start, entry.phase)
        plan = plan if phase is None else _ending_in(plan, phase, timeline.motion is None)
        last = _last_cycle(plan) if phase is None else _last_frames(plan, LAST_FRAMES)
        tail = source.adapted(
            walk_passage.walk_passage(source.model, last, manner(script.question))
        )
        exits = range(0 if phase is None else len(tail) - 1, len(tail))
        cut = cut_search.find_cut(timeline.character.body, tail, act, exits, entries)
        by = staged.by or staged.facing(staged.act.heading + cut.motion.turn)
        if phase is None:
            phase = float(last.phases[cut.exit])
            continue
        away = by.after(cut.motion.inverse())
        if abs(away.shift) < NEAR and abs(away.turn) < STRAIGHT:
            break
        end = away.after(end)
    return plan, replace(staged, by=by)


def _ending_in(plan: WalkPlan, phase: float, free: bool) -> WalkPlan:
    """Return a plan that ends in a phase of the cycle, or as near to it as strides allow.

    free: whether the walk may begin in any phase; strides are made longer or shorter if not.
    """
    gap = (phase - float(plan.phases[-1]) + 0.5) % 1.0 - 0.5
    if free:
        return replace(plan, phases=plan.phases + gap)
    whole = float(plan.phases[-1] - plan.phases[0])
    share = float(np.clip(gap / max(whole, 1e-9), -MOST_CHANGED, MOST_CHANGED))
    return replace(plan, phases=plan.phases[0] + (plan.phases - plan.phases[0]) * (1.0 + share))


def _point(place: FloorMotion) -> tuple[float, float]:
    return place.shift.imag, place.shift.real


def entry_range(act: Passage, event: int | None) -> range:
    """Return the frames of an act at which a motion may go on into it: before its event."""
    last = len(act) - 1 if not event else event
    return range(max(min(round(ENTRY_SECONDS * RATE), last), 1))


def _arrival(act: Passage) -> FloorMotion:
    """Return where a walk should end for an act: at its first root, the way it moves."""
    frames = min(round(ENTRY_SECONDS * RATE), len(act) - 1)
    places = floor_plane.project(act.roots[[0, frames]])
    moved = complex(places[1] - places[0])
    turned = float(np.angle(moved)) if abs(moved) > MOVING else heading(act, 0)
    return FloorMotion(turned, complex(places[0]))


def _last_cycle(plan: WalkPlan) -> WalkPlan:
    """Return the last cycle of a plan."""
    first = int(np.argmax(plan.phases >= plan.phases[-1] - 1.0))
    return _last_frames(plan, len(plan) - first)


def _last_frames(plan: WalkPlan, count: int) -> WalkPlan:
    """Return the last frames of a plan."""
    first = max(len(plan) - count, 0)
    names = ("distances", "places", "headings", "phases", "controls", "speeds")
    return replace(plan, **{name: getattr(plan, name)[first:] for name in names})
