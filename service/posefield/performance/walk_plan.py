"""Plan of a walk: where a walker is at each frame, its heading, phase of the cycle and controls.

The phase is tied to the distance: it advances by the distance over the length of the model's stride
there. Below the model's slowest speed the controls stay those of the slowest, and time slows down:
feet that stand move no more than in a steady walk, in starts and stops, too.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Frames, PerPoint, PointControls
from posefield.locomotion import stepping
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import Gait
from posefield.locomotion.stepping import Stepping
from posefield.motion import quat
from posefield.performance import step_plan, walk_paths, walk_request
from posefield.performance.passage import RATE, FloorMotion
from posefield.performance.standing_pose import Walker, find_walker
from posefield.performance.step_plan import Course
from posefield.performance.walk_paths import Destination, FloorPath, Radii
from posefield.performance.walk_request import SpeedRamps, WalkNote, WalkRequest
from posefield.question.motion_question import check_number

MAX_SCALING, SHORT_SCALING = 0.06, 0.15
"""Largest changes of the stride length, as shares, with which a walk stops at a phase: of a walk
that is long enough, and of a shorter one."""
SCALED_CYCLES = 2.0
"""Smallest number of cycles before a stop over which strides are scaled, of those there are."""
STEP_REST, STEP_END, LEAST_SWING = 0.35, 0.9, 0.12
"""Time in which a walker stands at a standing end, time until the first or since the last step
there, s, and least part of the cycle in which its foot swings beside the other one."""
BESIDE, NEARING = 0.08, 0.3
"""Distances from a standing end up to which feet are set for it, and from which on they are not,
m."""
SYNTHESISED = "synthesised"
"""First word of the codes of notes about motion that no capture shows."""


def plan_phases(
    walker: Walker,
    distances: Frames,
    ways: Frames,
    phase: float,
    end_kinds: tuple[str, str],
    extra: Frames | float = 0.0,
    stretch: float = 1.0,
) -> tuple[Frames, tuple[bool, bool], list[WalkNote]]:
    """Return the phases (F,) of a walk, without wrapping, which ends are steps, and notes.

    distances: (F,), m. ways: lengths of the stride (F,), m. phase: at the first frame. end_kinds:
    whether the walk begins and ends "standing". A walk that is too short for an opening or a
    closing step begins or ends in double support. extra: phases of each frame (F,) beyond those of
    the way, of turns on planned steps. stretch: cycles over those of the way.
    """
    steps = np.diff(distances) * 0.5 * (1.0 / ways[1:] + 1.0 / ways[:-1])
    gone = stretch * np.pad(np.cumsum(steps + np.broadcast_to(extra, len(ways))[1:]), (1, 0))
    begin, stop = (end == "standing" for end in end_kinds)
    if not (begin or stop):
        return phase + gone, (False, False), []
    poses, frames = step_plan.find_standing_poses([walker]), len(ways)
    stepped = poses is not None and frames > (begin + stop) * STEP_END * RATE
    quiet = poses.passings[0] if poses is not None and stepped else walker.double_supports
    first = phase + _to_nearest(phase, quiet) if begin else phase
    phases, left = first + gone, 0.0
    if stop:
        phases, left = _scaled(phases, _to_nearest(float(phases[-1]), quiet))
    notes = [*_standing_notes(end_kinds, stepped)]
    if poses is None or not stepped:
        return phases, (False, False), [*notes, *_left_notes(left)]
    # The body moves while a foot swings past the other one; before and after, both feet stand.
    supports, times = poses.supports[0], np.arange(frames) / RATE
    ramps = (
        quat.smoothstep(np.clip((t - STEP_REST) / (STEP_END - STEP_REST), 0.0, 1.0))
        for t in (times, times[::-1])
    )
    before, after = (1.0 - ramp for ramp in ramps)
    if begin:
        phases = phases - before * (LEAST_SWING + (first - supports - LEAST_SWING) % 1.0).min()
    if stop:
        end = float(phases[-1])
        phases = phases + after * (LEAST_SWING + (supports - end - LEAST_SWING) % 1.0).min()
    return phases, (begin, stop), notes


def _to_nearest(phase: float, quiet: Annotated[Floats, "phases"]) -> float:
    """Return the signed difference from a phase to the nearest quiet one, in cycles."""
    if not len(quiet):
        return 0.0
    gaps = (quiet - phase + 0.5) % 1.0 - 0.5
    return float(gaps[np.argmin(np.abs(gaps))])


def _scaled(phases: Frames, missing: float) -> tuple[Frames, float]:
    """Return phases whose last cycles advance faster or slower by a share, and what is left.

    The share has the form of a half sine over those cycles, so that it begins and ends with zero.
    """
    # The mean of a half sine is 2 / pi of its largest value, which is the limit.
    mean = MAX_SCALING * 2.0 / np.pi
    cycles = min(max(SCALED_CYCLES, abs(missing) / mean), float(phases[-1] - phases[0]))
    if cycles <= 0.0:
        return phases, missing
    limit = SHORT_SCALING * 2.0 / np.pi * cycles
    done = float(np.clip(missing, -limit, limit))
    progress = np.clip((phases - phases[-1]) / cycles + 1.0, 0.0, 1.0)
    return phases + done * 0.5 * (1.0 - np.cos(np.pi * progress)), missing - done


def _standing_notes(end_kinds: tuple[str, str], stepped: bool) -> Iterator[WalkNote]:
    names = ("start", "begins", "an opening step"), ("stop", "ends", "a closing step")
    for (field, word, step), end in zip(names, end_kinds, strict=True):
        if end != "standing":
            continue
        manner = f"with {step}" if stepped else "by slowing down its slowest stride"
        message = f"the walk {word} standing {manner}, which is synthesised: none was captured"
        yield WalkNote(f"{SYNTHESISED}-{field}", field, message)
        if not stepped:
            message = f"there is no room for {step}: the walk {word} with one foot ahead"
            yield WalkNote("feet-apart", field, message)


def _left_notes(left: float) -> Iterator[WalkNote]:
    """Yield a note on a stop that strides could not be scaled for. left: cycles."""
    if abs(left) > 0.01:
        yield WalkNote(
            "stops-in-mid-stride",
            "stop",
            f"the walk is too short to stop in double support: {100.0 * abs(left):.0f} % of a "
            "cycle are left; a path longer by a quarter of a stride mends it",
        )


PIVOT = 1.3
"""Rate of turning beyond the captured ones, rad/s, that planned steps reach: 40° in each."""
UNSTEPPED = 0.1
"""Rate of turning beyond the captured ones, rad/s, up to which walks have no steps for it."""
SLOWEST_CURVE = 0.25
"""Speed at which the sharpest curves are walked, m/s."""
RADIUS_SHARE = 1.8
"""Curvature that curves to a place may have over the largest at full speed: walkers slow down."""
CURVE_SHARE, CURVE_SPEEDS = 0.95, 24
"""Share of the largest rate of turning in curves, and the number of speeds at which it is known."""
DETOUR_SHARES = (0.1, 0.2, 0.4, 0.7, 1.0, 1.4)
"""Clearances of ways around obstacles that are tried, as shares of the larger radius."""
UNSEEN_PIVOT = 0.2
"""Rate of turning beyond the captured ones that viewers do not see, rad/s: it turns the body by 7°
over a foot that stands for 0.65 s, and captured pelvises turn by 9° in each stride (median)."""
FACING_SPEEDS, STANDS, AT_PLACE = (0.1, 0.6), 0.999, 0.01
"""Of walks with a facing: speeds, m/s, share of the standing pose at rest, least way of a turn."""
FACING_NOTE = "steps to the side, backwards and on the spot are synthesised: none was captured"
# Frames between the points at which controls are solved, and the most points of mean offsets.
STEP, OFFSET_POINTS = 6, 12
TURN_EASING = 1.0
"""Time in which the rate of turning changes from the one at the start to that of the curve, s."""


@dataclass(frozen=True)
class WalkPlan:
    """Plan of a walk in F frames at `RATE`, without poses.

    path: that the root follows in the mean over a cycle. distances: (F,), along it, m. places: (F,)
    and headings: (F,), rad, of the frame that travels with the walker. phases: (F,), of the cycle,
    without wrapping. controls: (F, d). speeds: (F,), m/s. steps: beyond the captured walk; None
    without them. notes: on what is not as captured. stops: whether it ends standing. closes:
    whether with a step that brings the feet beside each other.
    """

    walker: Walker
    path: FloorPath
    distances: Annotated[Floats, "frames"]
    places: Annotated[FloorVectors, "frames"]
    headings: Annotated[Floats, "frames"]
    phases: Annotated[Floats, "frames"]
    controls: Annotated[Floats, "frames controls"]
    speeds: Annotated[Floats, "frames"]
    steps: Stepping | None = None
    notes: tuple[WalkNote, ...] = ()
    stops: bool = False
    closes: bool = False

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.distances)

    def part(self, begin: int, end: int) -> "WalkPlan":
        """Return the frames from `begin` until before `end`, on the same path."""
        names = ("distances", "places", "headings", "phases", "controls", "speeds")
        arrays = {name: getattr(self, name)[begin:end] for name in names}
        return replace(self, **arrays, steps=self.steps and self.steps.part(begin, end))

    @property
    def exit_rates(self) -> tuple[float, float]:
        """Speed, m/s, and rate of turning, rad/s, at the end."""
        speed = float(self.speeds[-1])
        return speed, speed * float(self.path.curvatures[-1])

    @property
    def end(self) -> FloorMotion:
        """Place and heading of the path's end."""
        return FloorMotion(float(self.path.headings[-1]), self.path.end)


def plan_walk(
    gait: Gait,
    request: WalkRequest,
    start: FloorMotion | None,
    phase: float,
    stretch: float = 1.0,
) -> WalkPlan:
    """Return the plan of a walk.

    start: place and heading where it begins; None to begin at the first waypoint of `along`, or at
    the origin. phase: of the cycle at the first frame, moved to a double support for a walk that
    begins standing. stretch: cycles over those that the strides take. Raises InvalidField, with the
    field of the request, for a walk that the model cannot do.
    """
    walker = find_walker(gait, request.labels, request.controls)
    if request.facing is not None:
        return _plan_facing(walker, request, start or FloorMotion(), request.facing)
    path, distances, notes = _route(gait, request, start)
    walk_request.check_clear(path, request.obstacles)
    frames, speeds = len(distances), np.gradient(distances, 1.0 / RATE)
    knots = np.unique(np.append(np.arange(0, frames, STEP), frames - 1))
    rates, pivots = _rates(gait, request, path, distances[knots], speeds[knots])
    knot_controls = walker.controls(*rates)
    controls = _between(frames, knots, knot_controls)
    done = walker.strides(knot_controls)
    ways = _between(frames, knots, np.abs(done.travels))
    centres, headings = path.at(distances)
    slowest = gait.region.speeds[0]
    turned = np.interp(np.arange(frames), knots, rates[1]) * np.minimum(speeds / slowest, 1.0)
    beyond = np.gradient(headings) * RATE - turned
    pivoted = bool(np.abs(beyond).max() > UNSTEPPED)
    extra = _stepping_cadences(speeds / ways, beyond) / RATE if pivoted else 0.0
    end_kinds = (request.start, request.stop)
    phases, step_ends, phase_notes = plan_phases(
        walker, distances, ways, phase, end_kinds, extra, stretch
    )
    poses = step_plan.find_standing_poses([walker]) if pivoted or any(step_ends) else None
    drifts, offsets = _between(frames, knots, done.drifts), _offsets(walker, controls)
    steps = None
    if poses is not None:
        cadences = np.gradient(phases) * RATE
        turns = _between(frames, knots, done.turns)
        moving = cadences > step_plan.QUIET
        course = Course(phases, moving, cadences, speeds.astype(complex), beyond, ways, turns)
        anchors = centres + _nearing(centres, distances, step_ends)
        placed = step_plan.place_feet(poses, 0, (centres, headings, anchors), course, slowest, RATE)
        steps = step_plan.stepping_of(walker, poses, [placed])
        drifts = (1.0 - placed.shares) * drifts
        offsets = offsets + placed.shares * (poses.points[0] - offsets)
    faced = headings - drifts
    origins = centres - np.exp(1j * faced) * offsets
    fields = walker, path, distances, origins, faced, phases, controls, speeds, steps
    all_notes = *notes, *pivots, *phase_notes
    return WalkPlan(*fields, all_notes, request.stop == "standing", step_ends[1])


def _nearing(
    centres: Annotated[FloorVectors, "frames"], distances: Frames, step_ends: tuple[bool, bool]
) -> Annotated[FloorVectors, "frames"]:
    """Return the ways (F,), m, from points of a path to its standing ends, near to these."""
    half = 0.5 * float(distances[-1] - distances[0])
    near, far = min(BESIDE, 0.5 * half), max(min(NEARING, half), 1e-9)
    ways = np.zeros(len(centres), complex)
    for frame, end in zip((0, -1), step_ends, strict=True):
        if end:
            gaps = np.abs(distances - distances[frame])
            share = 1.0 - quat.smoothstep(np.clip((gaps - near) / (far - near), 0.0, 1.0))
            ways += share * (centres[frame] - centres)
    return ways


def _stepping_cadences(walked: Frames, beyond: Frames) -> Frames:
    """Return the cadences (F,), 1/s, of steps that turn, besides those of the walk (F,), 1/s.

    beyond: rates of turning that no captured walk has (F,), rad/s.
    """
    turned = np.abs(beyond) / stepping.TURN_OF_CYCLE
    power = stepping.POWER
    return np.asarray((walked**power + turned**power) ** (1.0 / power) - walked)


def _plan_facing(
    walker: Walker, request: WalkRequest, start: FloorMotion, facing: float
) -> WalkPlan:
    """Return the plan of a walk whose body turns to a heading, rad, and keeps it to its place."""
    (strider,), goal = step_plan.find_striders([walker]), _destination(request)
    if strider.poses is None:
        message = "given for a model without two feet that step in turn"
        raise InvalidField("facing", f"{message}, expected a walk")
    curve = walk_request.check_speeds(request.speed, request.speed_over, FACING_SPEEDS)
    headings = step_plan.turn_on_the_spot(start.turn, facing, RATE)
    gap, gone = goal.place - start.shift, np.zeros(1)
    path = FloorPath(start.shift, np.full(3, headings[-1]), 1e-6)
    if abs(gap) > AT_PLACE or len(headings) == 1:
        onward = FloorMotion(float(np.angle(gap)), start.shift)
        path = walk_paths.to_place(onward, goal, Radii(1.0, 1.0))
        ramps, scale = SpeedRamps(0.0, 0.0, request.acceleration), request.speed_over
        gone = walk_request.distances_over_length(curve, scale, path.length, ramps)
    walk_request.check_clear(path, request.obstacles)
    distances = np.pad(gone, (len(headings), round(step_plan.LAST_STEPS * RATE)), "edge")
    headings = np.pad(headings, (0, len(distances) - len(headings)), "edge")
    body = path.at(distances)[0], headings
    plan = step_plan.plan_steps(strider, body, 0.0, RATE)
    steps = step_plan.stepping_of(walker, strider.poses, [plan])
    controls = walker.controls(plan.speeds, plan.turning)
    speeds = np.gradient(distances) * RATE
    note = WalkNote(f"{SYNTHESISED}-steps", "facing", FACING_NOTE)
    fields = walker, path, distances, plan.points, plan.headings, plan.phases, controls, speeds
    end = int(np.flatnonzero(plan.shares < STANDS)[-1]) + 2
    return WalkPlan(*fields, steps, (note,), True, True).part(0, end)


def _route(
    gait: Gait, request: WalkRequest, start: FloorMotion | None
) -> tuple[FloorPath, Annotated[Floats, "frames"], list[WalkNote]]:
    """Return the path of a walk, the distances (F,), m, at its frames, and notes."""
    limits = gait.region.speeds
    curve = walk_request.check_speeds(request.speed, request.speed_over, limits)
    first = 0.0 if request.start == "standing" else request.entry_speed
    last = 0.0 if request.stop == "standing" else None
    ramps = SpeedRamps(first, last, request.acceleration)
    if request.seconds is not None:
        scale, seconds = request.speed_over, request.seconds
        gone = walk_request.distances_over_time(curve, scale, seconds, ramps)
        turns = _turns(request, gone, limits[0])
        return walk_paths.turning(start or FloorMotion(), gone, turns), gone, []
    path, notes = _path(gait, request, start, curve[1])
    bent = np.abs(path.curvatures).max() > 0.1
    slower = (path.distances, curve_speeds(gait, path)) if bent else None
    scale, length = request.speed_over, path.length
    gone = walk_request.distances_over_length(curve, scale, length, ramps, slower)
    return path, gone, notes


def curve_speeds(gait: Gait, path: FloorPath) -> PerPoint:
    """Return the largest speeds (K,), m/s, at which the curves of a path are walked."""
    speeds = np.linspace(*gait.region.speeds, CURVE_SPEEDS)
    right, left = _turning_limits(gait, speeds)
    # The smallest radius of each speed; below the slowest one the limit of the slowest holds.
    curvatures = path.curvatures
    limits = np.empty(len(curvatures))
    for side, rates in ((1.0, left), (-1.0, -right)):
        sharpest = np.minimum.accumulate(CURVE_SHARE * rates / speeds)
        sharp = np.maximum(side * curvatures, 1e-9)
        walked = np.interp(-sharp, -sharpest, speeds)
        slow = np.clip(CURVE_SHARE * rates[0] / sharp, SLOWEST_CURVE, speeds[0])
        chosen = np.where(sharp > sharpest[0], slow, walked)
        limits = np.where(side * curvatures >= 0.0, chosen, limits)
    return limits


def _turns(
    request: WalkRequest, gone: Annotated[Floats, "frames"], slowest: float
) -> Annotated[Floats, "frames"]:
    """Return the changes of heading (F,), rad, of a curve of rates over time.

    gone: (F,), m. Below the slowest speed, m/s, the rate falls in proportion to the speed.
    """
    turn = 0.0 if request.turn is None else request.turn
    times = np.arange(len(gone)) / RATE
    rates = np.interp(times, *walk_request.check_curve("turn", turn))
    if request.entry_turn is not None:
        left = np.clip(times / TURN_EASING, 0.0, 1.0)
        change = request.entry_turn - rates[0]
        rates += change * 0.5 * (1.0 + np.cos(np.pi * left))
    shares = np.minimum(np.diff(gone) * RATE / slowest, 1.0)
    return np.pad(np.cumsum(0.5 * (rates[1:] + rates[:-1]) * shares) / RATE, (1, 0))


def _path(
    gait: Gait, request: WalkRequest, start: FloorMotion | None, speeds: PerPoint
) -> tuple[FloorPath, list[WalkNote]]:
    """Return the path of a walk that is not given by its duration, and notes."""
    if request.along is not None:
        points = np.asarray(request.along, dtype=float)
        return walk_paths.through(points, start, request.end), []
    begin, radii = start or FloorMotion(), _radii(gait, speeds)
    path = walk_paths.to_place(begin, _destination(request), radii)
    if not request.detour or walk_request.is_clear(path, request.obstacles):
        return path, []
    around = _around(request, begin, radii)
    longer = around.length - path.length
    message = f"leads around obstacles and is {longer:.2f} m longer than without them"
    return around, [WalkNote("detour", "obstacles", message)]


def _around(request: WalkRequest, begin: FloorMotion, radii: Radii) -> FloorPath:
    goal, count = _destination(request), len(request.obstacles)
    if count > walk_request.MAX_DISCS:
        message = f"{count}, expected at most {walk_request.MAX_DISCS} with a detour"
        raise InvalidField("obstacles", message)
    for share in DETOUR_SHARES:
        clearance = share * radii.larger
        corners = walk_request.way_around(begin.shift, goal.place, request.obstacles, clearance)
        if corners:
            path = walk_paths.along_corners(begin, corners, goal)
            if walk_request.is_clear(path, request.obstacles) and radii.allow(path.curvatures):
                return path
    raise InvalidField(
        "obstacles",
        "no way around them was found, expected more room for curves with a radius of "
        f"{radii.larger:.1f} m: a lower speed, or waypoints in along",
    )


def _destination(request: WalkRequest) -> Destination:
    if request.to is None:
        end = request.end or FloorMotion()
        return Destination("end", end.shift, end.turn)
    x, z = (check_number(f"to/{i}", value) for i, value in enumerate(request.to))
    return Destination("to", complex(z, x), None)


def _radii(gait: Gait, speeds: PerPoint) -> Radii:
    """Return the smallest radii, m, of curves at all of the speeds (K,) of a curve."""
    curve_speeds = np.linspace(speeds.min(), speeds.max(), 9)
    right, left = _turning_limits(gait, curve_speeds)
    return Radii(
        float((curve_speeds / left).max()) / RADIUS_SHARE,
        float((curve_speeds / -right).max()) / RADIUS_SHARE,
    )


def _turning_limits(gait: Gait, speeds: PerPoint) -> tuple[PerPoint, PerPoint]:
    right, left = gait.region.turning(speeds)
    return right - PIVOT, left + PIVOT


def _rates(
    gait: Gait, request: WalkRequest, path: FloorPath, gone: PerPoint, speeds: PerPoint
) -> tuple[tuple[PerPoint, PerPoint], list[WalkNote]]:
    """Return the speeds, m/s, and rates of turning, rad/s, of the controls after distances (K,), m.

    Raises InvalidField for a sharper turn than the model can walk.
    """
    low, high = gait.region.speeds
    paced = np.clip(speeds, low, high)
    curvatures = np.interp(gone, path.distances, path.curvatures)
    turning = np.minimum(speeds, high) * curvatures
    right, left = _turning_limits(gait, paced)
    beyond = np.maximum(turning - left, right - turning)
    # Refusals show four decimals.
    if beyond.max() > 1e-4:
        at = int(np.argmax(beyond))
        point = path.at(gone[at : at + 1])[0][0]
        raise InvalidField(
            _field(request, path, float(gone[at])),
            f"at x {point.imag:.2f} m, z {point.real:.2f} m it turns by {turning[at]:.4f} rad/s, "
            f"expected {right[at]:.4f} to {left[at]:.4f} rad/s at {paced[at]:.2f} m/s; positive is "
            "left. A wider turn or a lower speed mends it",
        )
    walked = np.clip(paced * curvatures, *gait.region.turning(paced))
    pivots = turning - walked * np.minimum(speeds / low, 1.0)
    return (paced, walked), _notes(request, path, gone, pivots)


def _notes(
    request: WalkRequest, path: FloorPath, gone: PerPoint, pivots: PerPoint
) -> list[WalkNote]:
    at = int(np.argmax(np.abs(pivots)))
    if abs(pivots[at]) < UNSEEN_PIVOT:
        return []
    message = (
        f"turns by up to {abs(pivots[at]):.2f} rad/s more than captured walkers do at this speed: "
        "on planned steps, which are synthesised"
    )
    return [WalkNote("turns-beyond-captured", _field(request, path, float(gone[at])), message)]


def _field(request: WalkRequest, path: FloorPath, gone: float) -> str:
    """Return the field of the request that leads through the place after some metres."""
    if request.along is not None:
        nearest = walk_paths.nearest_waypoint(path, np.asarray(request.along, dtype=float), gone)
        return f"along/{nearest}"
    if request.seconds is not None:
        return "turn"
    return "to" if request.to is not None else "end"


def _between(frames: int, knots: Floats, values: Floats) -> Floats:
    """Return values (K, ...) of frames `knots` at all frames, by linear interpolation."""
    all_frames = np.arange(frames)
    if values.ndim == 1:
        return np.interp(all_frames, knots, values)
    return np.column_stack([np.interp(all_frames, knots, column) for column in values.T])


def _offsets(walker: Walker, controls: PointControls) -> Annotated[FloorVectors, "frames"]:
    """Return the mean offsets (F,) of the root over a cycle at controls (F, d)."""
    frames = len(controls)
    rows = np.unique(np.linspace(0, frames - 1, min(frames, OFFSET_POINTS)).round().astype(int))
    offsets = walker.mean_offsets(controls[rows])
    return np.asarray(np.interp(np.arange(frames), rows, offsets))
