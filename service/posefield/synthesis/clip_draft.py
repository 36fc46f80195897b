"""Drafts of clips: their validation, the times of their frames, and the trust of these.

Frames are played at a constant rate. A moment of an event or a target between two of them would be
seen in neither, so the motion is played up to half a frame earlier or later there, and eases from
one such moment to the next: at each, and at its ends, it has its own speed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
from msgspec import structs

from posefield.common.errors import InvalidField, QueryError
from posefield.common.units import Floats, Frames
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.gauss_newton import MISS_TOLERANCE
from posefield.constraints.targets import NO_CONSTRAINTS, ConstraintSet, JointTarget
from posefield.feet.stance_rows import Cycle
from posefield.locomotion.stride import Strides
from posefield.model_file.model_card import ModelCard
from posefield.motion import skeleton
from posefield.motion.quat import smoothstep
from posefield.motion.skeleton import Skeleton
from posefield.question import motion_question
from posefield.question.motion_question import (
    LEVEL_FLOOR,
    ClipQuestion,
    Floor,
    check_number,
    check_range,
)
from posefield.question.results import (
    BrokenLimit,
    ConstraintResult,
    FeetResult,
    PoseAnswer,
    Trust,
    round_micrometres,
    split_results,
)
from posefield.robots.robot import Robot
from posefield.robots.robot_motion import LIMIT_TOLERANCE, RobotMotion
from posefield.synthesis import synthesizer
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.question_validation import ValidatedQuestion

FPS_RANGE = (1.0, 1000.0)
# Limits of a floor: height, m, which keeps micrometres of single precision in files, and rise for
# each metre, up to which legs reach the steps of a walk.
HIGHEST, STEEPEST = 10.0, 0.3


@dataclass(eq=False, repr=False)
class ClipDraft:
    """A clip in the making; each stage of the synthesis sets what it computes.

    question: as received. frame_limit: largest number of frames. error: that of the first stage
    that cannot be done. rate: frames a second. validated, skeleton (with the requested names),
    constraints, stands (whether feet are placed) and is_robot (whether a robot's limits are kept,
    and its soles stand): of the validation. unlimited: the robot's motion as predicted. motion:
    corrected motion; None for the prediction. target_times: of the targets in the motion, s. times:
    of the frames in it (F,), s. duration: as it is played, s. strides: cycle or line of the root,
    where the path of the root is changed or feet stand. answer: the poses of the frames.

    Of the plan of standing feet: its times (G,), s, over the whole motion; rotations (G, J, 4) and
    root positions (G, 3), m, at them; and the floor motion of a cycle, None for a motion without.
    """

    question: ClipQuestion
    frame_limit: int
    error: QueryError | None = None
    rate: float = field(init=False)
    validated: ValidatedQuestion = field(init=False)
    skeleton: Skeleton = field(init=False)
    constraints: ConstraintSet | None = None
    stands: bool = False
    is_robot: bool = False
    unlimited: RobotMotion | None = None
    motion: ConstrainedMotion | None = None
    target_times: Sequence[float] = ()
    times: Floats = field(init=False)
    duration: float = field(init=False)
    strides: Strides | None = None
    answer: PoseAnswer[np.float64] = field(init=False)
    plan_times: Floats = field(default_factory=lambda: np.empty(0))
    plan_poses: tuple[Floats, Floats] = field(init=False)
    cycle: Cycle | None = None

    def validate(self, model: Synthesizer) -> None:
        """Set what is known before the duration of the clip is.

        Raises InvalidField and OutsideSamples as `clips.synthesize_clip` does.
        """
        question, card = self.question, model.session.card
        self.rate = check_number("fps", question.fps)
        check_range("fps", self.rate, *FPS_RANGE, "frames a second")
        self.validated = model.question(question)
        if question.loop and not card.cyclic:
            raise InvalidField(
                "loop", "true, expected false: this model's last pose does not lead into its first"
            )
        own_names = question.names == "own"
        self.skeleton = card.skeleton if own_names else model.skeleton(question.names)
        self.constraints = model.constraints(self.validated, question)
        self.is_robot = card.robot is not None and keeps_to_robot(card, question)
        self.stands = not self.is_robot and wants_standing_feet(card, question)

    def set_times(self, model: Synthesizer, duration: float) -> None:
        """Set the times of the frames of a clip that lasts `duration` seconds.

        A loop's times lack the last frame, which equals the first. Raises InvalidField for more
        frames than the limit.
        """
        moments, rate = self._moments(model, duration), self.rate
        self.duration = duration
        if self.question.loop:
            time_window(self.question, duration)
            steps = max(1, round(duration * rate))
            self.times, frames = np.arange(steps) * duration / steps, steps + 1
            inner = [time for time in moments if 0 < round(time * steps / duration) < steps]
            if inner:
                played = playback(steps / duration, 0.0, duration, inner)
                self.times = played.times(float(self.times[-1]))
        else:
            start = min(max(check_number("start", self.question.start), 0.0), duration)
            if moments:
                played = playback(rate, start, duration, moments)
                self.duration = played.duration
            # Clients read the duration of the motion from poses, as it is played from clips, and
            # may round it to single precision.
            last = time_window(self.question, max(duration, self.duration))[1]
            if last * (1.0 + motion_question.FLOAT32_EPSILON) >= min(duration, self.duration):
                last = self.duration
            if moments:
                times = played.times(last)
            else:
                times = start + np.arange(math.floor((last - start) * rate + ROUNDING) + 1) / rate
            self.times = np.minimum(times, duration)
            frames = len(self.times)
        if frames > self.frame_limit:
            raise InvalidField("fps", f"{frames} frames, expected at most {self.frame_limit}")

    def _moments(self, model: Synthesizer, duration: float) -> list[float]:
        """Return the times, s, that are those of frames, and set those of targets.

        A cycle keeps its speed but for its targets; of another motion with a target or an event,
        the event and the end are among them.
        """
        card, targets = model.session.card, self.constraints.targets if self.constraints else ()
        if self.motion is not None and targets:
            self.target_times = model.solver.target_times(self.validated, self.motion, targets)
        moments, event = list(self.target_times), card.event
        if card.cyclic or not (targets or event):
            return moments
        if event is not None and 0.0 < event.share < 1.0:
            motion = self.motion or model.solver.solve(self.validated, NO_CONSTRAINTS)
            frame = np.array([event.share * (card.frames - 1)])
            moments += model.solver.times(self.validated, motion, frame).tolist()
        # Less than half a frame before the end, the first pose is the only one.
        if (duration - max(check_number("start", self.question.start), 0.0)) * self.rate > 0.5:
            moments.append(duration)
        return moments

    @property
    def shifts(self) -> Floats:
        """Return by how much each frame (F,) is earlier in the motion than in the clip, s."""
        return np.asarray(self.question.start + np.arange(len(self.times)) / self.rate - self.times)


def time_window(question: ClipQuestion, duration: float) -> tuple[float, float]:
    """Return start and end, s, of a clip of at most `duration` seconds.

    Raises InvalidField for values out of range, and for a loop with a start or an end.
    """
    last = duration
    if question.end is not None:
        end = check_number("end", question.end)
        last = motion_question.check_rounded_range("end", end, 0.0, duration, "s")
    start = check_number("start", question.start)
    start = motion_question.check_rounded_range("start", start, 0.0, last, "s")
    if question.loop and (start > 0.0 or question.end is not None):
        name, value = ("start", start) if start > 0.0 else ("end", last)
        raise InvalidField(name, f"{value:g} s with loop, expected none: a loop is a whole cycle")
    return start, last


def largest_frame_count(model: Synthesizer, question: ClipQuestion) -> float:
    """Return an upper bound of the number of frames of a clip, known before its synthesis.

    NaN where a field of the question is, which the synthesis refuses.
    """
    last = model.durations[1] if question.end is None else question.end
    # A clip that ends on a frame may be longer by half a frame.
    return (last - question.start) * question.fps + 1.5


def is_predicted(model: Synthesizer, question: ClipQuestion) -> bool:
    """Return whether a clip is the model's prediction, without constraints or standing feet.

    Raises as `wants_standing_feet` does.
    """
    card = model.session.card
    if model.measures or question.has_constraints:
        return False
    if card.robot is not None and keeps_to_robot(card, question):
        return False
    return not wants_standing_feet(card, question)


def keeps_to_robot(card: ModelCard, question: ClipQuestion) -> bool:
    """Return whether joints of a robot keep their limits and its soles, where known, stand.

    Raises InvalidField if feet are asked to stand without common stances, and for a floor.
    """
    if question.feet == "as_predicted":
        return False
    if question.feet == "stand" and not card.soles:
        raise InvalidField("feet", "'stand', but the gaits of this robot have no stances in common")
    if question.ground != LEVEL_FLOOR:
        raise InvalidField("floor", "other than 0, expected 0: robots stand as they were recorded")
    return True


def wants_standing_feet(card: ModelCard, question: ClipQuestion) -> bool:
    """Return whether the feet of a clip are placed.

    Raises InvalidField if they are asked to stand, but the model has no feet on the ground, and for
    a floor on which they cannot stand.
    """
    travels = card.root == "travelling"
    if question.feet == "stand" and not card.feet:
        raise InvalidField("feet", "'stand', but this model's recipe names no feet")
    if question.feet == "stand" and not travels:
        raise InvalidField("feet", "'stand', but the root of this model's motions stays in place")
    if question.feet is None:
        stands = bool(travels and card.feet and card.contacts)
    else:
        stands = question.feet == "stand"
    if question.floor != 0.0 and question.ground != LEVEL_FLOOR:
        _check_floor(question, stands)
    return stands


def _check_floor(question: ClipQuestion, stands: bool) -> None:
    """Raise InvalidField for a floor beyond the limits, and for one without standing feet."""
    floor = question.ground
    height = "floor/height" if isinstance(question.floor, Floor) else "floor"
    check_range(height, check_number(height, floor.height), -HIGHEST, HIGHEST, "m")
    for name in ("slope_x", "slope_z"):
        check_number(f"floor/{name}", getattr(floor, name))
    if not floor.slope <= STEEPEST:
        raise InvalidField(
            "floor",
            f"rises by {floor.slope:g} m for each metre, expected at most {STEEPEST:g}: legs reach "
            "no further",
        )
    if not stands:
        reason = (
            "as asked" if question.feet else "as this model's are unless feet=stand is asked for"
        )
        raise InvalidField(
            "floor", f"other than 0, but feet are as predicted, {reason}; expected feet that stand"
        )
    if not floor.is_level and (question.loop or question.root == "in_place"):
        name = "loop" if question.loop else "root=in_place"
        raise InvalidField(
            "floor",
            f"with a slope and {name}, expected a level floor: what climbs ends at another height",
        )


# Tolerance for the rounding of products of times and rates, in frames.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Playback:
    """Times of a motion over the times at which it is played.

    rate: frames a second. start: time of a frame, s. knots: of moments on frames and of the ends
    (K,), in frames from the start. shifts: by which these are later in the motion (K,), s.
    """

    rate: float
    start: float
    knots: Annotated[Floats, "knots"]
    shifts: Annotated[Floats, "knots"]

    @property
    def duration(self) -> float:
        """Time at which the end of the motion is played, s."""
        return self.start + float(self.knots[-1]) / self.rate

    def times(self, last: float) -> Frames:
        """Return the times (F,) in the motion, s, of the frames from the start until `last`, s."""
        frames = np.arange(math.floor((last - self.start) * self.rate + ROUNDING) + 1)
        after = np.clip(np.searchsorted(self.knots, frames), 1, len(self.knots) - 1)
        length = self.knots[after] - self.knots[after - 1]
        share = smoothstep(np.clip((frames - self.knots[after - 1]) / length, 0.0, 1.0))
        before, step = self.shifts[after - 1], self.shifts[after] - self.shifts[after - 1]
        # At a knot the sum with its share of one would round.
        shifts = np.where(frames == self.knots[after], self.shifts[after], before + share * step)
        return np.asarray(self.start + frames / self.rate + shifts)

    def stretch(self, times: Frames) -> float:
        """Return the largest distance of times (F,) of frames from when they are played, s."""
        frames = np.arange(len(times)) / self.rate
        return round_micrometres(np.abs(self.start + frames - times).max())


def playback(rate: float, start: float, duration: float, moments: Sequence[float]) -> Playback:
    """Return the playback of a motion with a frame at `start`, s, in which moments have frames.

    rate: frames a second. duration: of the motion, s. moments: s; of two with the same nearest
    frame the first has it, and one whose nearest frame is before the motion has none.
    """
    begin, end = -start * rate, (duration - start) * rate
    shifts = {}
    for moment in reversed(moments):
        frame = round((moment - start) * rate)
        if frame >= begin - ROUNDING:
            shifts[float(frame)] = moment - start - frame / rate
    if not any(abs(knot - begin) < ROUNDING for knot in shifts):
        shifts[begin] = 0.0
    # The end plays at its own time, unless it is a moment or one before it has the last frame.
    if len(shifts) == 1 or (duration not in moments and max(shifts) < end - ROUNDING):
        shifts[end] = 0.0
    knots, sizes = zip(*sorted(shifts.items()), strict=True)
    return Playback(rate, start, np.array(knots), np.array(sizes))


def of_frames(model: Synthesizer, draft: ClipDraft) -> Trust:
    """Return the trust of a draft's answer, whose root still travels, as its frames show it."""
    trust = draft.answer.trust
    if draft.target_times:
        trust = _with_targets(model, draft, trust)
    shifts = draft.shifts
    if draft.question.loop:
        # It is played in whole steps; the duration of its trust is the motion's.
        stretch = max(np.abs(shifts).max(), abs(len(shifts) / draft.rate - trust.duration))
        return structs.replace(trust, stretch=round_micrometres(stretch) or None)
    stretch = round_micrometres(np.abs(shifts).max())
    if not stretch and abs(draft.duration - trust.duration) * draft.rate < ROUNDING:
        return trust
    feet = trust.feet and _at_frames(draft, trust.feet)
    return structs.replace(trust, duration=draft.duration, stretch=stretch or None, feet=feet)


def with_limits(trust: Trust, motion: RobotMotion, robot: Robot) -> Trust:
    """Return the trust with the hinges of a robot that turn beyond their limits, and warnings."""
    excess = motion.beyond_limits(robot)
    limits = []
    for hinge in np.flatnonzero(excess.max(axis=0) > LIMIT_TOLERANCE).tolist():
        frame = int(excess[:, hinge].argmax())
        low, high = robot.ranges[hinge].tolist()
        time, angle = round(frame / motion.rate, 6), round(float(motion.angles[frame, hinge]), 6)
        limits.append(BrokenLimit(robot.hinges[hinge], time, angle, (low, high)))
    warnings = (*trust.warnings, *(limit.sentence for limit in limits))
    return structs.replace(trust, limits=tuple(limits), warnings=warnings)


def _at_frames(draft: ClipDraft, feet: FeetResult) -> FeetResult:
    """Return feet with the times of their stances in the clip instead of in the motion."""

    def played(time: float) -> float:
        return round_micrometres(time + np.interp(time, draft.times, draft.shifts))

    stances = tuple(
        replace(stance, begin=played(stance.begin), end=played(stance.end))
        for stance in feet.stances
    )
    return structs.replace(feet, stances=stances)


def _with_targets(model: Synthesizer, draft: ClipDraft, trust: Trust) -> Trust:
    """Return the trust with the misses of targets in the frames nearest to their moments.

    A target at a moment without a frame, before or after those of the clip, has its miss in the
    motion.
    """
    answer, targets = draft.answer, draft.constraints.targets if draft.constraints else ()
    controls, solved = split_results(trust.targets, len(targets))
    gaps = np.abs(np.subtract.outer(draft.target_times, draft.times))
    frames = gaps.argmin(axis=1)
    positions = skeleton.positions(
        model.session.card.skeleton.parents,
        answer.rotations[frames],
        skeleton.translations(answer.bone_offsets, answer.root_position[frames]),
    )
    shown = tuple(
        result if gap * draft.rate > 0.5 + ROUNDING else _result(target, result, pose)
        for target, result, gap, pose in zip(
            targets, solved, gaps.min(axis=1), positions, strict=True
        )
    )
    misses = synthesizer.miss_warnings(solved)
    warnings = [sentence for sentence in trust.warnings if sentence not in misses]
    if draft.question.extrapolate != "ok":
        warnings += synthesizer.miss_warnings(shown)
    return structs.replace(trust, targets=(*controls, *shown), warnings=tuple(warnings))


def _result(
    target: JointTarget, solved: ConstraintResult, pose: Annotated[Floats, "joints 3"]
) -> ConstraintResult:
    """Return the result of a target in a frame with joints at positions (J, 3), m."""
    away = pose[list(target.moment.joints)].mean(axis=0) - target.position
    miss = float(np.linalg.norm(away))
    return replace(solved, miss=miss, reached=miss <= MISS_TOLERANCE)
