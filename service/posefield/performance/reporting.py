"""Report of a performance from its timeline."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from posefield.locomotion import floor_plane
from posefield.performance.joins.join_quality import JoinFacts
from posefield.performance.passages.passage import RATE
from posefield.performance.script import Script
from posefield.performance.timeline import Composed, Seam, Span, heading
from posefield.performance.walks import path_following
from posefield.question.performance_report import (
    JoinReport,
    PathReport,
    PerformanceReport,
    ScriptWarning,
    SegmentReport,
)
from posefield.question.results import FeetResult

DECIMALS = 6
MET = 1e-3
"""Largest distance of a joint from a target that is met, m."""


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
        _rounded((len(composed.motion) - 1) / RATE),
        frames,
        _rounded(sigma),
        all(span.supported for span in timeline.spans),
        _segments(composed),
        tuple(_join(composed, *pair) for pair in zip(timeline.seams, joins, strict=True)),
        feet,
        tuple(warnings),
    )


def _segments(composed: Composed) -> tuple[SegmentReport, ...]:
    spans = composed.timeline.spans
    ends = [later.begin for _, later in pairwise(spans)] + [len(composed.timeline.done) - 1]
    return tuple(_segment(composed, span, end) for span, end in zip(spans, ends, strict=True))


def _segment(composed: Composed, span: Span, end: int) -> SegmentReport:
    timeline = composed.timeline
    shift = timeline.begin
    place = complex(floor_plane.project(timeline.done.roots[span.begin]))
    return SegmentReport(
        span.kind,
        span.model,
        _rounded((span.begin - shift) / RATE),
        _rounded((end - shift) / RATE),
        (_rounded(place.imag), _rounded(place.real)),
        _rounded(heading(timeline.done, span.begin)),
        _rounded(span.sigma),
        {name: _rounded(value) for name, value in span.controls.items()},
        None if span.phase is None else _rounded(span.phase),
        None if span.event is None else _rounded((span.event - shift) / RATE),
        span.targets,
        _path(composed, span),
        span.notes,
    )


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
    return PathReport(*map(_rounded, numbers))


def _join(composed: Composed, seam: Seam, facts: JoinFacts) -> JoinReport:
    shift, cut = composed.timeline.begin, seam.cut
    return JoinReport(
        seam.segment,
        _rounded((seam.frame - shift) / RATE),
        _rounded(cut.distance),
        cut.blend,
        _rounded(seam.seconds),
        _rounded(facts.peak),
        _rounded(cut.usual.acceleration),
        facts.hard,
        cut.usual.reference,
    )


def _missed(composed: Composed) -> list[ScriptWarning]:
    """Return a warning for each target that the character misses."""
    targets = zip(composed.timeline.targets, composed.missed, strict=True)
    return [
        ScriptWarning(own.pointer, f"stays {100.0 * miss:.1f} cm from its target: out of reach")
        for own, miss in targets
        if miss > MET
    ]


def _rounded(value: float) -> float:
    return round(float(value), DECIMALS)
