"""Report of a performance from its timeline."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from posefield.common.units import round_micrometres
from posefield.constraints.gauss_newton import MISS_TOLERANCE
from posefield.locomotion import floor_plane
from posefield.performance.joins.join_quality import JoinFacts
from posefield.performance.passages.passage import RATE
from posefield.performance.script import Script
from posefield.performance.timeline import Composed, MadeJoin, Span
from posefield.performance.walks import path_following
from posefield.question.performance_report import (
    JoinReport,
    PathReport,
    PerformanceReport,
    ScriptWarning,
    SegmentReport,
)
from posefield.question.results import ConstraintResult, FeetResult


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
    return PerformanceReport(
        script.identities,
        script.character.identity,
        round_micrometres((len(composed.motion) - 1) / RATE),
        frames,
        round_micrometres(sigma),
        all(span.supported for span in timeline.spans),
        _segments(composed),
        tuple(_join(composed, *pair) for pair in zip(timeline.joins, joins, strict=True)),
        feet,
        tuple(warnings),
    )


def _segments(composed: Composed) -> tuple[SegmentReport, ...]:
    spans = composed.timeline.spans
    ends = [later.begin for _, later in pairwise(spans)] + [len(composed.timeline.done) - 1]
    return tuple(_segment(composed, index, end) for index, end in enumerate(ends))


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
        _result(each, missed[f"/segments/{index}/targets/{number}"])
        for number, each in enumerate(composed.timeline.spans[index].targets)
    )


def _result(each: ConstraintResult, miss: float) -> ConstraintResult:
    return replace(each, miss=round_micrometres(miss), reached=miss <= MISS_TOLERANCE)


def _path(composed: Composed, span: Span) -> PathReport | None:
    """Return how far a walk is from its path; None for other segments and less than a cycle."""
    if span.plan is None:
        return None
    rows = slice(span.first, span.first + len(span.plan))
    done = composed.timeline.done
    if len(done.roots[rows]) < len(span.plan):
        return None
    found = path_following.measure(span.plan, done.roots[rows], done.rotations[rows])
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
