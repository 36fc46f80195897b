"""Walks of a script: planned, joined to the segment before, and recorded in the timeline.

A walk that leads to an act ends in the phase and in the place from which the act goes on. Where an
act lies is known from one cycle of the walk: in the frame that travels with the walker a pose
hardly depends on the path. So the end of the path follows from the place of the act in closed form,
and a second plan is already within a centimetre.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.units import Floats
from posefield.feet.footsteps import Character
from posefield.locomotion import floor_plane
from posefield.performance import joins, walk_entries, walk_plan
from posefield.performance.act_motion import StagedAct
from posefield.performance.joins import Cut
from posefield.performance.passage import RATE, FloorMotion, Passage
from posefield.performance.script import Script
from posefield.performance.timeline import Span, Timeline, check_distance, choose_blend
from posefield.performance.walk_entries import WalkEntry, find_entry, take_settings, walk_of
from posefield.performance.walk_plan import WalkPlan
from posefield.question.performance_question import Act

# Plans that are made so that the act after a walk lies where it should, and the smallest shift, m,
# and turn, rad, for which one more is made.
APPROACHES, NEAR, STRAIGHT = 8, 0.01, 0.01
MOST_CHANGED = 0.08
"""Share by which strides are made longer or shorter so that a walk ends in a phase."""
BENT, LINE_SHARE = 1e-6, 0.3
"""Curvature from which on a path is no line, 1/m, and the part of a curve that is taken for one."""
MOVING = 0.05
"""Smallest distance that an act moves in `ENTRY_SECONDS` for it to have a direction, m."""
ENTRY_SECONDS = 0.35
"""Time from the start of an act in which a motion may go on into it, s."""


@dataclass(frozen=True)
class LastCycle:
    """Last cycle of a walk, and an act that goes on from one of its frames.

    plan: of the cycle. poses: of the character. entries: frames of the act.
    """

    character: Character
    plan: WalkPlan
    poses: Passage
    act: Passage
    entries: range

    @property
    def exits(self) -> range:
        """Frames from which the act may go on: the last one of a walk that ends standing."""
        return range(len(self.poses) - 1 if self.plan.closes else 0, len(self.poses))

    def find_cut(self, runs: Sequence[range]) -> Cut:
        """Return the best cut from frames of the cycle; of equal ones the first."""
        cuts = [
            joins.find_cut(self.character, self.poses, self.act, exits, self.entries)
            for exits in runs
        ]
        return min(cuts, key=lambda cut: round(cut.cost / joins.GRAIN))

    def lies(self, cut: Cut) -> FloorMotion:
        """Return where the act lies in the frame that travels with the walker at the exit."""
        return _travelling(self.plan, cut.exit).inverse().after(cut.motion)

    def reachable(self, plan: WalkPlan, free: bool) -> list[range]:
        """Return the frames in whose phases another plan can end, in runs; the nearest if none."""
        gaps = np.abs(_gaps(self.plan.phases, plan))
        limit = np.inf if free else MOST_CHANGED * float(plan.phases[-1] - plan.phases[0])
        near = gaps <= max(limit, float(gaps.min()))
        edges = np.flatnonzero(np.diff(near, prepend=False, append=False)).tolist()
        return [range(*edge) for edge in zip(edges[::2], edges[1::2], strict=True)]


def lead_to(
    timeline: Timeline, script: Script, index: int, entry: WalkEntry, staged: StagedAct
) -> tuple[WalkPlan, StagedAct]:
    """Return the plan of a walk whose end leads into an act, and the act with its place.

    A first plan tells from which phase of the cycle the act goes on best, and where the act then
    lies; the next ones end in it, or in the best of those that their strides can be changed to, so
    that the act lies where it should. An act without a heading of its own faces the way the walk
    comes.
    """
    by = staged.by or staged.facing(float(np.angle(staged.goal - entry.start.shift)))
    act = script.adapted(staged.segment, staged.act.passage)
    plan = _plan_to(script, index, entry, by.after(_arrival(act)), staged)
    entries = entries_of(script, staged, len(act))
    cycle = _last_cycle(script, index, plan, (act, entries))
    # A walk that begins standing begins in its own phase.
    free = timeline.motion is None and entry.request.start == "rolling"
    cut = cycle.find_cut([cycle.exits])
    for _ in range(APPROACHES):
        cancellation.check()
        # The end of the path in the frame that travels with the walker there.
        trail = _travelling(plan, -1).inverse().after(plan.end)
        rest = cycle.lies(cut).inverse().after(trail)
        by = staged.by or staged.facing(staged.act.heading + _turn(plan, rest, by, staged.goal))
        end = by.after(rest)
        plan = _plan_to(script, index, entry, end, staged)
        if plan.closes:
            # Where a walk stands depends on the foot that closes.
            cycle = _last_cycle(script, index, plan, (act, entries))
        runs = [cycle.exits] if plan.closes else cycle.reachable(plan, free)
        if plan.closes or not any(cut.exit in run for run in runs):
            cut = cycle.find_cut(runs)
        act_place = _travelling(plan, -1).after(cycle.lies(cut))
        by = staged.by or staged.facing(staged.act.heading + act_place.turn)
        away = by.after(act_place.inverse())
        if abs(away.shift) < NEAR and abs(away.turn) < STRAIGHT:
            break
    if not plan.closes:
        gap = float(_gaps(cycle.plan.phases[cut.exit : cut.exit + 1], plan)[0])
        cycles = max(float(plan.phases[-1] - plan.phases[0]), 1e-9)
        stretch = 1.0 + float(np.clip(gap / cycles, -MOST_CHANGED, MOST_CHANGED))
        # A walk that may not begin in another phase has longer or shorter strides.
        entry, stretch = (
            (replace(entry, phase=entry.phase + gap), 1.0) if free else (entry, stretch)
        )
        plan = _plan_to(script, index, entry, end, staged, stretch)
    return plan, replace(staged, by=by, adapted=act)


def _turn(plan: WalkPlan, rest: FloorMotion, by: FloorMotion, goal: complex) -> float:
    """Return the turn of an act at a goal, rad, for which a path like that of a plan faces it.

    rest: end of the path in the frame of the act. by: places the act with another turn. The path
    ends with a line, which turns about its begin when its end moves: it is the tangent from there
    to the circle about the goal on which the path ends.
    """
    bent = np.flatnonzero(np.abs(plan.path.curvatures) > BENT)
    begins = plan.path.distances[bent[-1]] if len(bent) else 0.0
    line = max(plan.path.length - float(begins), LINE_SHARE * plan.path.length)
    begin = plan.end.shift - line * np.exp(1j * plan.end.turn)
    away = goal - begin
    point = np.exp(-1j * by.turn) * (goal - by.shift)
    aside = (np.exp(-1j * rest.turn) * (rest.shift - point)).imag
    heading = np.angle(away) + np.arcsin(np.clip(aside / max(abs(away), 1e-9), -1.0, 1.0))
    return float(heading - rest.turn)


def _plan_to(
    script: Script,
    index: int,
    entry: WalkEntry,
    end: FloorMotion,
    staged: StagedAct,
    stretch: float = 1.0,
) -> WalkPlan:
    """Return the plan of a walk to a place; with the heading there of an act that has one."""
    _, source = walk_of(script, index)
    goal = {"end": end} if staged.by else {"to": (end.shift.imag, end.shift.real)}
    request = replace(entry.request, **goal)
    return walk_plan.plan_walk(source.gait, request, entry.start, entry.phase, stretch)


def _last_cycle(
    script: Script, index: int, plan: WalkPlan, act: tuple[Passage, range]
) -> LastCycle:
    """Return the last cycle of a plan for an act with the frames at which it may be entered."""
    _, source = walk_of(script, index)
    last = plan.part(int(np.argmax(plan.phases >= plan.phases[-1] - 1.0)), len(plan))
    poses = source.adapted(_walked(script, index, last))
    return LastCycle(script.character.body, last, poses, *act)


def _walked(script: Script, index: int, plan: WalkPlan) -> Passage:
    _, source = walk_of(script, index)
    question = script.question
    return walk_entries.walk_passage(source.model, plan, question.level, take_settings(question))


def _travelling(plan: WalkPlan, frame: int) -> FloorMotion:
    """Return the frame that travels with the walker."""
    return FloorMotion(float(plan.headings[frame]), complex(plan.places[frame]))


def _gaps(phases: Annotated[Floats, "frames"], plan: WalkPlan) -> Annotated[Floats, "frames"]:
    """Return signed differences (F,) of phases from that in which a plan ends, in cycles."""
    gaps: Floats = (phases - plan.phases[-1] + 0.5) % 1.0 - 0.5
    return gaps


def entry_range(frames: int, event: int | None) -> range:
    """Return the frames of an act at which a motion may go on into it: before its event."""
    last = event or frames - 1
    return range(max(min(round(ENTRY_SECONDS * RATE), last), 1))


def entries_of(script: Script, staged: StagedAct, frames: int) -> range:
    """Return the frames at which a motion may go on into an act, so that no target is cut off."""
    stop = entry_range(frames, staged.act.event).stop
    return range(min([stop, *(frame + 1 for frame in target_frames(script, staged))]))


def target_frames(script: Script, staged: StagedAct) -> list[int]:
    """Return the frames of an act at which its targets hold; none for a motion without targets."""
    act, source = script.segments[staged.segment], script.sources[staged.segment]
    if not isinstance(act, Act) or source is None:
        return []
    skeleton = source.model.session.card.skeleton
    return [
        staged.act.frame_of(target.when, skeleton.parents, skeleton.names.index(target.joint))
        for target in act.targets
    ]


def _arrival(act: Passage) -> FloorMotion:
    """Return where a walk should end for an act: at its first root, the way it moves."""
    frames = min(round(ENTRY_SECONDS * RATE), len(act) - 1)
    roots = floor_plane.project(act.roots[[0, frames]])
    direction = complex(roots[1] - roots[0])
    turned = float(np.angle(direction)) if abs(direction) > MOVING else act.heading(0)
    return FloorMotion(turned, complex(roots[0]))


def add_walk(
    timeline: Timeline, script: Script, index: int, staged: StagedAct | None
) -> StagedAct | None:
    """Go on with a walk; return the act that it leads to with its place, if there is one.

    staged: act that a walk without an end of its own leads to. Raises InvalidField for a walk that
    the model cannot do.
    """
    entry = find_entry(timeline, script, index)
    walk, source = walk_of(script, index)
    if staged is None:
        plan = walk_plan.plan_walk(source.gait, entry.request, entry.start, entry.phase)
    else:
        plan, staged = lead_to(timeline, script, index, entry, staged)
    passage = script.adapted(index, _walked(script, index, plan))
    first = 0
    if entry.continues:
        first = timeline.go_on(passage)
    elif entry.cut is None:
        timeline.begin_with(passage)
    else:
        check_distance(walk.join, entry.cut)
        gaits = timeline.spans[-1].kind == "walk" if timeline.spans else False, True
        kind, seconds = choose_blend(walk.join, gaits)
        first = timeline.join(index, passage, replace(entry.cut, entry=0), kind, seconds)
    _record(timeline, script, plan, index, first)
    return staged


def _record(timeline: Timeline, script: Script, plan: WalkPlan, index: int, first: int) -> None:
    """Add the span of a walk; first: the frame of its first one."""
    walk, source = walk_of(script, index)
    card, notes = source.model.session.card, [note.message for note in plan.notes]
    for note in plan.notes:
        # How a step is made is told by the notes of the segment alone.
        if note.code.startswith(walk_plan.SYNTHESISED):
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
    last_cycle = plan.phases >= plan.phases[-1] - 1.0
    earliest = first + int(np.argmax(last_cycle))
    # A walk that stops is left where it stands.
    timeline.exits = range(len(done) - 1 if walk.stop == "standing" else earliest, len(done))
