"""Report of a performance from its timeline, and how well its walks follow their paths."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from posefield.common.units import Floats, RootPath, Rotations, round_micrometres
from posefield.constraints.gauss_newton import MISS_TOLERANCE
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import quat
from posefield.performance.join_quality import JoinFacts
from posefield.performance.passage import RATE
from posefield.performance.script import Script
from posefield.performance.timeline import Composed, MadeJoin, Span
from posefield.performance.walk_plan import WalkPlan
from posefield.question.performance_report import (
    JoinReport,
    PathReport,
    PerformanceReport,
    ScriptWarning,
    SegmentReport,
)
from posefield.question.results import ConstraintResult, FeetResult


@dataclass(frozen=True)
class PathErrors:
    """Root mean squares of the errors of a walk, each error a mean over one cycle of phase.

    lateral, along: of the root across and along the path, m. heading: of the direction of travel,
    rad. facing: of the root's heading relative to the path about its own mean, rad. speed: m/s.
    cycles: number of whole cycles; without one, all errors are zero.
    """

    lateral: float
    along: float
    heading: float
    facing: float
    speed: float
    cycles: float


def path_errors(plan: WalkPlan, roots: RootPath, rotations: Rotations) -> PathErrors:
    """Return the errors of a finished motion of F frames against its plan.

    roots: (F, 3), m, and rotations: (F, J, 4), in the plan's place.
    """
    cycles = float(plan.phases[-1] - plan.phases[0])
    if cycles < 1.0:
        return PathErrors(0.0, 0.0, 0.0, 0.0, 0.0, cycles)
    centres, tangents = plan.path.at(plan.distances)
    own = floor_plane.project(roots)
    off = _means(plan.phases, (own - centres) * np.exp(-1j * tangents))
    travel = _travel(plan, own)
    asked = _travel(plan, centres)
    forward = floor_plane.project(quat.rotate(rotations[:, 0], np.array([0.0, 0.0, 1.0])))
    facing = _means(plan.phases, np.unwrap(np.angle(forward)) - tangents)
    return PathErrors(
        _rms(off.imag),
        _rms(off.real),
        _rms(np.angle(travel / asked)),
        _rms(facing - facing.mean()),
        _rms(np.abs(travel) - np.abs(asked)),
        cycles,
    )


def _travel(
    plan: WalkPlan, places: Annotated[FloorVectors, "frames"]
) -> Annotated[FloorVectors, "means"]:
    """Return velocities (M,) from one cycle's beginning to its end, m/s."""
    begins, ends, times = _cycles(plan.phases)
    at = np.arange(len(places))
    moved = np.interp(ends, at, places) - np.interp(begins, at, places)
    return np.asarray(moved / times)


def _means(
    phases: Annotated[Floats, "frames"], values: Annotated[Floats | FloorVectors, "frames"]
) -> Annotated[Any, "means"]:
    """Return the means (M,) of values over one cycle of phase that begins at each frame."""
    begins, ends, _ = _cycles(phases)
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(phases)
    sums, at = np.pad(np.cumsum(steps), (1, 0)), np.arange(len(values))
    return np.asarray(np.interp(ends, at, sums) - np.interp(begins, at, sums))


def _cycles(
    phases: Annotated[Floats, "frames"],
) -> tuple[Annotated[Floats, "means"], Annotated[Floats, "means"], Annotated[Floats, "means"]]:
    """Return frames (M,) at which cycles begin and end, and their durations, s."""
    begins = np.flatnonzero(phases <= phases[-1] - 1.0)
    ends = np.interp(phases[begins] + 1.0, phases, np.arange(len(phases)))
    return begins.astype(float), ends, (ends - begins) / RATE


def _rms(values: Annotated[Floats, "means"]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def report(
    script: Script,
    composed: Composed,
    joins: Sequence[JoinFacts],
    frames: int,
    feet: FeetResult | None,
) -> PerformanceReport:
    """Return the report of a performance.

    joins: judged, in order. frames: of its clip. feet: None as predicted.
    """
    timeline = composed.timeline
    sigma = float(np.sqrt(np.mean(np.square(composed.motion.sigmas))))
    warnings = [*timeline.warnings, *_missed(composed)]
    ends = [later.begin for _, later in pairwise(timeline.spans)] + [len(timeline.done) - 1]
    return PerformanceReport(
        script.identities,
        script.character.identity,
        round_micrometres((len(composed.motion) - 1) / RATE),
        frames,
        round_micrometres(sigma),
        all(span.supported for span in timeline.spans),
        tuple(_segment(composed, index, end) for index, end in enumerate(ends)),
        tuple(_join(composed, *pair) for pair in zip(timeline.joins, joins, strict=True)),
        tuple(warnings),
        feet,
    )


def _segment(composed: Composed, index: int, end: int) -> SegmentReport:
    timeline, span = composed.timeline, composed.timeline.spans[index]
    shift = timeline.begin
    place = complex(floor_plane.project(timeline.done.roots[span.begin]))
    return SegmentReport(
        span.kind,
        span.model,
        round_micrometres((span.begin - shift) / RATE),
        round_micrometres((end - shift) / RATE),
        (round_micrometres(place.imag), round_micrometres(place.real)),
        round_micrometres(timeline.done.heading(span.begin)),
        round_micrometres(span.sigma),
        {name: round_micrometres(value) for name, value in span.controls.items()},
        None if span.phase is None else round_micrometres(span.phase),
        None if span.event is None else round_micrometres((span.event - shift) / RATE),
        _results(composed, index),
        _path(composed, span),
        span.notes,
    )


def _results(composed: Composed, index: int) -> tuple[ConstraintResult, ...]:
    """Return how far the character stays from the targets of a segment."""
    targets = zip(composed.timeline.targets, composed.missed, strict=True)
    missed = {own.pointer: miss for own, miss in targets}
    return tuple(
        replace(each, miss=round_micrometres(miss), reached=miss <= MISS_TOLERANCE)
        for number, each in enumerate(composed.timeline.spans[index].targets)
        for miss in [missed[f"/segments/{index}/targets/{number}"]]
    )


def _path(composed: Composed, span: Span) -> PathReport | None:
    """Return how far a walk is from its path; None for other segments and less than a cycle."""
    if span.plan is None:
        return None
    rows = slice(span.first, span.first + len(span.plan))
    done = composed.timeline.done
    if len(done.roots[rows]) < len(span.plan):
        return None
    found = path_errors(span.plan, done.roots[rows], done.rotations[rows])
    if found.cycles < 1.0:
        return None
    numbers = (found.lateral, found.along, found.heading, found.speed)
    return PathReport(*map(round_micrometres, numbers))


def _join(composed: Composed, made: MadeJoin, facts: JoinFacts) -> JoinReport:
    shift, cut = composed.timeline.begin, made.cut
    return JoinReport(
        made.segment,
        round_micrometres((made.frame - shift) / RATE),
        round_micrometres(cut.distance),
        cut.blend,
        round_micrometres(made.seconds),
        round_micrometres(facts.peak),
        round_micrometres(cut.usual.acceleration),
        facts.hard,
        cut.usual.reference,
    )


def _missed(composed: Composed) -> list[ScriptWarning]:
    """Return a warning for each target that the character misses."""
    targets = zip(composed.timeline.targets, composed.missed, strict=True)
    return [
        ScriptWarning(own.pointer, f"stays {100.0 * miss:.1f} cm from its target: out of reach")
        for own, miss in targets
        if miss > MISS_TOLERANCE
    ]
