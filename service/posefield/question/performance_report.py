"""Report of a performance: its timeline, joins, contacts, targets and warnings."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import msgspec
from msgspec import Struct

from posefield.question.results import ConstraintResult, FeetResult, SampledClip

SegmentKind = Literal["walk", "act", "hold"]
Reference = Literal["captured", "synthesised"]
"""Motions whose accelerations a join is compared with: captured clips of the models, or motions as
they were synthesised."""


@dataclass(frozen=True)
class ScriptWarning:
    """Warning about a script. pointer: JSON pointer to its cause."""

    pointer: str
    message: str

    @property
    def sentence(self) -> str:
        """Return the warning in one line."""
        return f"{self.pointer}: {self.message}"


class SegmentReport(Struct, frozen=True, omit_defaults=True):
    """A segment in the time of the performance.

    kind: walk, act or hold. model: name@contenthash; empty for a hold. begins, ends: s, without the
    blend into the next segment. place: of the root on the floor where it begins, [x, z], m.
    heading: there, rad. controls: at its begin. sigma: expected distance from a captured clip, m,
    root mean square; of a hold, that of the pose. phase: of the cycle where a walk begins. event:
    time of the event of an act, s. targets: residuals of its targets. notes: on what was chosen.
    path: how far a walk is from its path.
    """

    kind: SegmentKind
    model: str
    begins: float
    ends: float
    place: tuple[float, float]
    heading: float
    sigma: float
    controls: Mapping[str, float] = {}
    phase: float | None = None
    event: float | None = None
    targets: tuple[ConstraintResult, ...] = ()
    path: "PathReport | None" = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PathReport:
    """Deviations of a walk from its path, means over each cycle, root mean square over the walk.

    lateral, along: m. heading: rad. speed: m/s.
    """

    lateral: float
    along: float
    heading: float
    speed: float


@dataclass(frozen=True)
class JoinReport:
    """A join of two segments.

    segment: index of the segment that begins. time: s. distance: of the two motions at the cut, m.
    blend: its kind. seconds: of it. peak: largest acceleration near the join, mean over joints
    relative to the root, m/s². usual: 99th percentile of the same in the motions away from the
    join. hard: whether the join is unlike anything that the motions do. reference: motions that
    `usual` is measured on.
    """

    segment: int
    time: float
    distance: float
    blend: str
    seconds: float
    peak: float
    usual: float
    hard: bool
    reference: Reference


class PerformanceReport(
    Struct, frozen=True, omit_defaults=True, rename={"script_warnings": "warnings"}
):
    """Facts about a performance.

    models: name@contenthash, in the order of the script. character: of the bones. sigma: expected
    distance from captured motion, m, root mean square over frames. supported: whether similar clips
    were captured for all segments. feet: None for feet as predicted. retargeting: report on the
    motion of a user's character; empty for that of the script. stretch: largest distance in time of
    a moment of the motion from its frame, s, which puts events and targets on frames; at most half
    a frame, None for frames at equal times.
    """

    models: tuple[str, ...]
    character: str
    duration: float
    frames: int
    sigma: float
    supported: bool
    segments: tuple[SegmentReport, ...]
    joins: tuple[JoinReport, ...]
    script_warnings: tuple[ScriptWarning, ...]
    feet: FeetResult | None = None
    retargeting: Mapping[str, Any] = {}
    stretch: float | None = None

    @property
    def model(self) -> str:
        """Return the first model, after which files are named."""
        return self.models[0]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return the warnings as sentences."""
        return tuple(warning.sentence for warning in self.script_warnings)

    def document(self) -> dict[str, Any]:
        """Return the Performance (schema of the contract)."""
        return self.facts()

    def facts(self) -> dict[str, Any]:
        """Return the fields that are not empty as plain values, for the metadata of files."""
        facts: dict[str, Any] = msgspec.to_builtins(self)
        return facts


@dataclass(frozen=True)
class HeldJoint:
    """Target of a joint: its position in the world, m, from one time until another, s."""

    joint: str
    begins: float
    ends: float
    position: tuple[float, float, float]


@dataclass(frozen=True)
class PerformanceAnswer(SampledClip):
    """A performance as one clip. held: targets of its joints."""

    trust: PerformanceReport
    held: tuple[HeldJoint, ...] = ()
