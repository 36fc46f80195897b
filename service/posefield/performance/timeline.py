"""Motion of a performance as it grows, segment by segment."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Booleans, Floats, RootPath, Rotations
from posefield.motion import quat
from posefield.performance import join_quality, joins
from posefield.performance.join_quality import JoinFacts
from posefield.performance.joins import Blend, Cut
from posefield.performance.limb_targets import WorldTarget
from posefield.performance.passage import RATE, FloorMotion, Passage
from posefield.performance.script import MAX_SECONDS, ScriptCharacter
from posefield.performance.walk_plan import WalkPlan
from posefield.question.performance_question import GivenPose, Join
from posefield.question.performance_report import ScriptWarning, SegmentKind
from posefield.question.results import ConstraintResult

RESAMPLED_AT_ONCE = 4096
"""Frames that are resampled at a time, which takes some ten times their memory."""

VISIBLE = 0.01
"""Distance of a joint from its target, or of a measured control from its value, that a viewer sees,
m: the width of a finger."""


@dataclass(frozen=True)
class Span:
    """A segment that is part of the motion.

    kind: walk, act or hold. begin: frame at which it takes over. first: frame of the motion that is
    the first one of the segment's own, at most `begin`. event: frame. plan: of a walk.
    """

    kind: SegmentKind
    model: str
    begin: int
    first: int
    sigma: float
    controls: dict[str, float] = field(default_factory=dict)
    phase: float | None = None
    event: int | None = None
    targets: tuple[ConstraintResult, ...] = ()
    supported: bool = True
    plan: WalkPlan | None = None
    notes: tuple[str, ...] = ()


@dataclass
class Timeline:
    """A growing motion.

    motion: so far; None before the first segment. exits: frames from which the next segment may go
    on. begin: first frame that belongs to the performance; earlier ones are of the given poses.
    captured: 99th percentile of the captured accelerations of each segment's model, m/s²; empty if
    a card lacks it. usual: largest usual acceleration of the last segment's motion, m/s². misses:
    distances of the targets from their joints, m, when they are met.
    """

    character: ScriptCharacter
    captured: tuple[float, ...] = ()
    motion: Passage | None = None
    exits: range = range(0)
    begin: int = 0
    usual: float = 0.0
    spans: list[Span] = field(default_factory=list)
    joins: list[JoinFacts] = field(default_factory=list)
    targets: list[WorldTarget] = field(default_factory=list)
    misses: tuple[float, ...] = ()
    warnings: list[ScriptWarning] = field(default_factory=list)

    @property
    def done(self) -> Passage:
        """Return the motion so far; ValueError before the first segment."""
        if self.motion is None:
            raise ValueError("no motion, expected a segment before this one")
        return self.motion

    @property
    def performed(self) -> Passage:
        """Return the motion from the first frame of the performance on."""
        return self.done.part(self.begin, len(self.done))

    @property
    def walking(self) -> Annotated[Booleans, "frames"]:
        """Return whether each frame of the performance belongs to a walk (F,)."""
        walking = np.zeros(len(self.performed), bool)
        for span in self.spans:
            walking[max(span.begin - self.begin, 0) :] = span.kind == "walk"
        return walking

    def find_cut(self, after: Passage, entries: range, motion: FloorMotion | None = None) -> Cut:
        """Return the best cut from an exit of the motion to an entry of a passage."""
        return joins.find_cut(self.character.body, self.done, after, self.exits, entries, motion)

    def warn(self, pointer: str, message: str) -> None:
        """Add a warning, once."""
        warning = ScriptWarning(pointer, message)
        if warning not in self.warnings:
            self.warnings.append(warning)

    def begin_with(self, passage: Passage) -> None:
        """Make a placed passage the beginning of the motion."""
        self.motion, self.usual = passage, self._usual(passage)

    def begin_with_given(self, poses: Passage) -> None:
        """Make given poses what the performance goes on from; they have no model."""
        self.motion = poses
        self.usual = join_quality.usual_acceleration(self.character.body, [poses])
        self.begin = len(poses) - 1
        self.exits = range(self.begin, self.begin + 1)

    def _usual(self, passage: Passage) -> float:
        if self.captured:
            return self.captured[len(self.spans)]
        return join_quality.usual_acceleration(self.character.body, [passage])

    def go_on(self, placed: Passage) -> int:
        """Go on with a passage whose first frame is the last one; return its frame.

        What is left between the two, such as the height of another speed's poses, fades.
        """
        last = len(self.done) - 1
        cut = Cut(last, 0, FloorMotion(), 0.0, 0.0)
        acceleration = self._usual(placed)
        self.motion, self.usual = joins.join(self.done, placed, cut, "hermite"), acceleration
        return last

    def join(self, segment: int, placed: Passage, cut: Cut, kind: Blend, seconds: float) -> int:
        """Go on with a placed passage from a cut; return the frame of its own first frame."""
        before, body = self.done, self.character.body
        fits = min(seconds, max(len(placed) - 1 - cut.entry, 0) / RATE)
        joined = joins.join(before, placed, cut, kind, fits)
        self.motion, _ = join_quality.add_steps(body, before, placed, cut, joined)
        acceleration = self._usual(placed)
        self.joins.append(
            JoinFacts(
                cut.distance,
                abs(float(before.roots[cut.exit, 1] - placed.roots[cut.entry, 1])),
                kind,
                max(self.usual, acceleration),
                "captured" if self.captured else "synthesised",
                segment,
                cut.exit,
                fits,
                most_drop=join_quality.most_drop(before, placed, cut, fits),
            )
        )
        self.usual = acceleration
        return cut.exit - cut.entry

    def check_duration(self) -> None:
        """Raise InvalidField, for the segment itself, for a performance that is too long now."""
        seconds = (len(self.done) - 1 - self.begin) / RATE
        if seconds > MAX_SECONDS:
            raise InvalidField(
                "", f"{seconds:.0f} s with this segment, expected {MAX_SECONDS:g} s at most"
            )


def choose_blend(join: Join, gaits: tuple[bool, bool]) -> tuple[Blend, float]:
    """Return the kind and the seconds of a blend.

    gaits: whether the segment before walks, and whether the one after does.
    """
    kind: Blend = ("hermite" if gaits[1] else "dead") if join.blend == "auto" else join.blend
    if kind == "cut":
        return kind, 0.0
    default_seconds = joins.SECONDS["hermite"] if all(gaits) else joins.SECONDS["dead"]
    return kind, default_seconds if join.seconds is None else join.seconds


def check_distance(join: Join, cut: Cut) -> None:
    """Raise InvalidField for a cut of more than the largest distance of a join."""
    if join.most is not None and cut.distance > join.most:
        raise InvalidField(
            "join/most",
            f"poses {cut.distance:.3f} m apart at the cut, expected {join.most:g} m at most",
        )


def from_poses(poses: Sequence[GivenPose], fps: float, character: ScriptCharacter) -> Passage:
    """Return given poses at a frame rate as a passage at `RATE` that ends with the last one.

    Raises InvalidField for poses of another number of joints and for rotations of no length.
    """
    joints = len(character.skeleton)
    for index, pose in enumerate(poses):
        if len(pose.rotations) != joints:
            raise InvalidField(
                f"start/poses/{index}/rotations",
                f"{len(pose.rotations)} rotations, expected {joints}, one for each joint of "
                f"{character.identity}",
            )
    turns = np.array([pose.rotations for pose in poses], dtype=np.float64)
    sizes = np.linalg.norm(turns, axis=-1)
    if not (np.abs(sizes - 1.0) < 0.01).all():
        index = int(np.argmax(np.abs(sizes - 1.0).max(axis=1)))
        raise InvalidField(
            f"start/poses/{index}/rotations", "not of length 1, expected unit quaternions w x y z"
        )
    roots = np.array([pose.root_position for pose in poses], dtype=np.float64)
    if not (np.isfinite(roots).all() and (np.abs(roots) < 1e5).all()):
        raise InvalidField("start/poses", "root positions beyond 100 km, expected nearer ones")
    seconds = (len(poses) - 1) / fps
    times = seconds - np.arange(int(seconds * RATE + 1e-6), -1, -1) / RATE
    rotations, path = resample(quat.unroll(quat.normalize(turns)), roots, fps, times)
    none = np.zeros((len(times), len(character.feet)))
    return Passage(rotations, path, none, np.zeros(len(times)))


def resample(
    rotations: Rotations, roots: RootPath, rate: float, times: Annotated[Floats, "samples"]
) -> tuple[Annotated[Floats, "samples joints 4"], Annotated[Floats, "samples 3"]]:
    """Return rotations (S, J, 4) and roots (S, 3), m, at times (S,), s, of frames at a rate."""
    at = np.clip(times * rate, 0.0, len(roots) - 1.0)
    before = np.minimum(at.astype(np.int64), max(len(roots) - 2, 0))
    after = np.minimum(before + 1, len(roots) - 1)
    share = (at - before)[:, None]
    turned = np.empty((len(at), *rotations.shape[1:]))
    for first in range(0, len(at), RESAMPLED_AT_ONCE):
        rows = slice(first, first + RESAMPLED_AT_ONCE)
        turned[rows] = quat.slerp(rotations[before[rows]], rotations[after[rows]], share[rows])
    return turned, roots[before] + share * (roots[after] - roots[before])
