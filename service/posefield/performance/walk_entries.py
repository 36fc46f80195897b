"""Walks of a script: their requests, where and in which phase they begin, and their poses."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, PerPoint, PointControls
from posefield.common.value_cache import ValueCache
from posefield.constraints.take_variation import TakeSettings
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.stride import RelativePoses, Strides
from posefield.model_file.model_card import PERFORMER
from posefield.performance import standing_pose
from posefield.performance.joins import Cut
from posefield.performance.passage import RATE, FloorMotion, Passage
from posefield.performance.script import Script, Source
from posefield.performance.standing_pose import StandingPose, Walker, WalkerKey
from posefield.performance.timeline import Timeline
from posefield.performance.walk_plan import WalkPlan
from posefield.performance.walk_request import Disc, WalkRequest
from posefield.question.performance_question import PerformanceQuestion, Walk
from posefield.synthesis import crowd_synthesis, walking_feet
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.crowd_validation import CharacterTakes

CYCLE_FRAMES = 60
"""Default number of frames of a steady cycle."""
FACING_SPEED = 0.4
"""Speed of walks whose body faces one way, if none is said, m/s."""
# Frames between those at which sigma is computed.
SIGMA_STEP = 6


def walk_passage(
    model: Synthesizer, plan: WalkPlan, level: int = 0, take: TakeSettings | None = None
) -> Passage:
    """Return the motion of a plan, at a level of detail; take: None for the prediction.

    Its contacts are probabilities of `walking_feet.foot_contacts`, in their order; its phases are
    those of the plan, wrapped.
    """
    phases = plan.phases % 1.0
    posed = _poses(model, plan.walker, plan.controls, phases, level, take)
    contacts = _contacts(model, plan.walker, plan.controls, phases, level)
    if plan.steps is not None:
        frames = np.arange(len(plan))
        posed = plan.steps.apply((0 * frames, frames), 0 * frames, posed)
        contacts += plan.steps.firm[0, :, None] * (1.0 - contacts)
    roots = plan.places + posed.places * np.exp(1j * plan.headings)
    return Passage(
        floor_plane.turn_roots(posed.rotations, plan.headings),
        floor_plane.at_height(roots, posed.heights),
        contacts,
        _sigmas(model, plan.walker, plan.controls),
        phases,
    )


def cycle_passage(
    model: Synthesizer,
    walker: Walker,
    controls: Annotated[Floats, "controls"],
    frames: int = CYCLE_FRAMES,
    level: int = 0,
    take: TakeSettings | None = None,
) -> Passage:
    """Return one steady cycle at controls (d,), from phase 0, at the origin and heading along z.

    The cycle has `frames` frames, evenly in phase, whatever its duration is.
    """
    rows = np.repeat(controls[None], frames, axis=0)
    phases = np.arange(frames) / frames
    cycle = walker.strides(controls[None], level)
    posed = _poses(model, walker, rows, phases, level, take)
    turned = phases * cycle.turns
    roots = floor_plane.arc_displacement(phases * cycle.travels, turned)
    roots = roots + posed.places * np.exp(1j * turned)
    return Passage(
        floor_plane.turn_roots(posed.rotations, turned),
        floor_plane.at_height(roots, posed.heights),
        _contacts(model, walker, rows, phases, level),
        _sigmas(model, walker, rows),
        phases,
    )


def still(pose: StandingPose) -> Passage:
    """Return three frames of a standing pose, in the frame that travels."""
    root = floor_plane.at_height(np.array([pose.place]), np.array([pose.height]))
    return Passage(
        np.repeat(pose.rotations[None], 3, axis=0),
        np.repeat(root, 3, axis=0),
        np.ones((3, len(pose.legs))),
        np.zeros(3),
    )


def _poses(
    model: Synthesizer,
    walker: Walker,
    controls: PointControls,
    phases: PerPoint,
    level: int,
    take: TakeSettings | None,
) -> RelativePoses:
    """Return the poses (F) at controls (F, d) and at phases (F,)."""
    labels = walker.labels(len(controls))
    if take is None:
        return stride.synthesize_poses(model.session, controls, labels, phases, level)
    count, cycles = len(controls), walker.strides(controls, level)
    takes = CharacterTakes(
        np.full(count, take.seed), np.full(count, take.variety), np.full(count, take.detail)
    )
    times = (phases * cycles.durations)[:, None]
    turned, path, _ = crowd_synthesis.pose_takes(model, takes, controls, times, labels, level)
    return stride.relative_poses(cycles, phases, turned, path)


def _contacts(
    model: Synthesizer,
    walker: Walker,
    controls: PointControls,
    phases: PerPoint,
    level: int,
) -> Annotated[Floats, "frames feet"]:
    """Return the probabilities (F, K) of the feet's contacts; arguments as for `_poses`."""
    card = model.session.card
    feet = walking_feet.foot_contacts(card)
    if not feet:
        return np.zeros((len(controls), 0))
    labels = walker.labels(len(controls))
    probabilities = stride.contact_probabilities(model.session, controls, labels, phases, level)
    return np.clip(probabilities[:, [card.contacts.index(foot) for foot in feet]], 0.0, 1.0)


def _sigmas(
    model: Synthesizer, walker: Walker, controls: PointControls
) -> Annotated[Floats, "frames"]:
    frames = len(controls)
    rows = np.unique(np.append(np.arange(0, frames, SIGMA_STEP), frames - 1))
    labels = walker.labels(len(rows))
    sigmas = model.session.run(controls[rows], None, "sigma", labels=labels)[0].astype(float)
    return np.asarray(np.interp(np.arange(frames), rows, sigmas))


# Cycles by walker, speed and take, of 80 kB each: an edited script has the same walkers again.
KEPT_CYCLES = 64


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


def take_settings(question: PerformanceQuestion) -> TakeSettings | None:
    """Return the take of a script; None for the prediction."""
    take = TakeSettings(question.take, question.variety, question.detail)
    return take if take.seed or take.detail else None


def walk_of(script: Script, index: int) -> tuple[Walk, Source]:
    """Return a walk of a script and its source."""
    walk, source = script.segments[index], script.sources[index]
    if not isinstance(walk, Walk) or source is None:
        raise TypeError(f"segment {index}, expected a walk")
    return walk, source


def request_of(script: Script, walk: Walk, source: Source) -> WalkRequest:
    """Return the walk that a segment asks for."""
    faces = walk.facing is not None
    usual_speed = FACING_SPEED if faces else float(source.gait.rates[:, 0].mean())
    names = {PERFORMER: walk.performer} if walk.performer is not None else {}
    discs = tuple(Disc(*disc.position, disc.radius) for disc in script.question.obstacles)
    along = None if walk.along is None else np.array(walk.along, dtype=np.float64)
    return WalkRequest(
        usual_speed if walk.speed is None else walk.speed,
        along=along,
        to=walk.to,
        seconds=walk.seconds,
        turn=walk.turn,
        speed_over=walk.speed_over,
        labels={**walk.labels, **names},
        controls=walk.controls,
        start=walk.start,
        stop=walk.stop,
        obstacles=discs,
        detour=bool(discs) and walk.along is None and walk.seconds is None and not faces,
        facing=walk.facing,
    )


def _continued(timeline: Timeline, source: Source, request: WalkRequest) -> WalkEntry | None:
    """Return how a walk goes on from one of the same walker; None if it does not."""
    before = timeline.spans[-1] if timeline.spans else None
    if before is None or before.plan is None or before.model != source.model.identity:
        return None
    plan, rolling = before.plan, request.start == "rolling"
    same = plan.walker.is_same(
        standing_pose.find_walker(source.gait, request.labels, request.controls)
    )
    if not (same and rolling and not plan.stops):
        return None
    low, high = source.gait.region.speeds
    speed, turn = plan.exit_rates
    rolling_request = replace(
        request,
        entry_speed=float(np.clip(speed, low, high)),
        entry_turn=turn if request.seconds is not None else None,
    )
    return WalkEntry(rolling_request, plan.end, float(plan.phases[-1] % 1.0), continues=True)


SteadyCycle = tuple[Strides, Passage, complex]
"""One cycle of a walker straight ahead at one speed: its stride, the poses of the model, and the
mean place of the root in the frame that travels."""

_cycles: ValueCache[tuple[WalkerKey, float, int, TakeSettings | None], SteadyCycle] = ValueCache(
    KEPT_CYCLES
)


def _cycle(
    source: Source, walking: Walker, speed: float, level: int, take: TakeSettings | None
) -> SteadyCycle:
    controls = walking.controls(np.clip([speed], *source.gait.region.speeds), np.zeros(1))
    stride = walking.strides(controls)
    frames = max(round(float(stride.durations[0]) * RATE), 8)
    poses = cycle_passage(source.model, walking, controls[0], frames, level, take)
    return stride, poses, complex(walking.mean_offsets(controls)[0])


def find_entry(timeline: Timeline, script: Script, index: int) -> WalkEntry:
    """Return how a walk begins: at the start of the script, or at the phase most like the exit."""
    walk, source = walk_of(script, index)
    request = request_of(script, walk, source)
    if timeline.motion is None:
        beginning = script.question.start
        x, z = beginning.position
        return WalkEntry(request, FloorMotion(beginning.heading, complex(z, x)), 0.0)
    continued = _continued(timeline, source, request)
    if continued is not None:
        return continued
    if walk.join.cut == "end":
        timeline.exits = timeline.exits[-1:]
    walking = standing_pose.find_walker(source.gait, request.labels, request.controls)
    pose = standing_pose.find_standing_pose(walking) if request.start == "standing" else None
    if pose is not None:
        cut = timeline.find_cut(script.adapted(index, still(pose)), range(1))
        begin, at_rest = FloorMotion(0.0, pose.place), replace(cut, motion=FloorMotion())
        return WalkEntry(request, cut.motion.after(begin), 0.0, at_rest)
    speed = request.speed if isinstance(request.speed, float | int) else request.speed[0][1]
    level, take = script.question.level, take_settings(script.question)
    stride, poses, offset = _cycles.find(
        (walking.key, float(speed), level, take),
        lambda: _cycle(source, walking, speed, level, take),
    )
    frames = len(poses)
    cut = timeline.find_cut(script.adapted(index, poses), range(frames))
    phase = cut.entry / frames
    turned = phase * float(stride.turns[0])
    travelled = floor_plane.arc_displacement(phase * stride.travels[0], np.array(turned))
    # The path of a walk is that of the mean root, and runs the way it travels.
    root = complex(travelled + np.exp(1j * turned) * offset)
    local = FloorMotion(turned + float(stride.drifts[0]), root)
    return WalkEntry(request, cut.motion.after(local), phase, replace(cut, motion=FloorMotion()))
