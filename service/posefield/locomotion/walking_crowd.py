"""Crowds of walking characters: validation, plans, and motions computed on demand."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.inference.session import Session
from posefield.locomotion import (
    floor_plane,
    level_transitions,
    locomotion_plan,
    random_paths,
    stride,
)
from posefield.locomotion import routes as given
from posefield.locomotion.gait import Gait
from posefield.locomotion.level_transitions import LevelSchedule
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.locomotion.routes import Route
from posefield.locomotion.stride import RelativePoses
from posefield.model_file.model_card import ModelCard
from posefield.motion import blend, curves, foot_skate, skeleton
from posefield.motion.crowd_clip import CrowdClip, Motions, Placement

# Poses of one batch of motions: 8 MB at 31 joints, or one longer motion.
POSES_PER_BATCH = 8_000
# Poses computed at once in double precision: 25 MB at 31 joints.
POSES_PER_CALL = 16_000


# Largest number of poses of one plan, which takes a few hundred bytes for each.
MAX_POSES = 20_000_000
# Longest interval between planned points of a path, s, for crowds with few frames a second.
MAX_PLAN_STEP = 0.05
SEED_LIMIT = 2**63
Pairs = tuple[Indices, Indices]
"""Indices of characters (K,) and frames (K,)."""
FPS_RANGE = (1.0, 1000.0)
MotionMaker = Callable[[Session, LocomotionPlan, Indices, LevelSchedule], Motions]
"""Computes the motions of characters (M,) of a plan, as `motions` does."""
PoseMaker = Callable[[Session, LocomotionPlan, Indices, Indices, int], RelativePoses]
"""Computes poses of a plan, as `locomotion_plan.synthesize_poses` does."""
_PoseMaker = Callable[[Indices, Indices, int], RelativePoses]


def plan_random(gait: Gait, count: int, seconds: float, rate: float, seed: int) -> LocomotionPlan:
    """Return a plan of `count` characters on random paths.

    Raises InvalidField for numbers out of range.
    """
    frames = _frames(count, seconds, rate, seed)
    characters = random_paths.draw_characters(gait, count, seed)
    ways = random_paths.draw_paths(gait, characters, seconds)
    return locomotion_plan.plan_along_paths(
        gait, ways, characters.who, characters.phases, frames, rate
    )


def plan_routes(
    gait: Gait, routes: Sequence[Route], seconds: float, rate: float, seed: int
) -> LocomotionPlan:
    """Return a plan of characters that follow routes; performers and phases depend on the seed.

    Raises InvalidField as `plan_random` and `given.paths_through` do, and for a route that is too
    short.
    """
    frames = _frames(len(routes), seconds, rate, seed)
    characters = random_paths.draw_characters(gait, len(routes), seed)
    ways = given.paths_through(gait, routes)
    return locomotion_plan.plan_along_paths(
        gait, ways, characters.who, characters.phases, frames, rate
    )


def _frames(count: int, seconds: float, rate: float, seed: int) -> int:
    if count < 1:
        raise InvalidField("count", f"{count}, expected at least 1 character")
    if not 0 <= seed < SEED_LIMIT:
        raise InvalidField("seed", f"{seed}, expected 0 to less than {SEED_LIMIT}")
    if not FPS_RANGE[0] <= rate <= FPS_RANGE[1]:
        raise InvalidField("fps", f"{rate:g}, expected {FPS_RANGE[0]:g} to {FPS_RANGE[1]:g}")
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InvalidField("seconds", f"{seconds:g}, expected a time above 0")
    most = poses(count, seconds, rate)
    if most > MAX_POSES:
        raise InvalidField("count", f"{most:.3g} poses, expected {MAX_POSES} at most")
    return frames(seconds, rate)


def frames(seconds: float, rate: float) -> int:
    """Return the number of frames of a motion of this length, s."""
    # Tolerance of a millionth of a frame for the rounding of seconds * rate.
    return math.floor(seconds * rate + 1e-6) + 1


def poses(count: int, seconds: float, rate: float) -> float:
    """Return the number of poses of a crowd, or of planned points if these are more."""
    return count * (seconds * max(rate, 1.0 / MAX_PLAN_STEP) + 1.0)


def build_crowd(
    session: Session, plan: LocomotionPlan, shown: LevelSchedule, make: MotionMaker | None = None
) -> CrowdClip:
    """Return the crowd of a plan, each character with its own motion in the frame of its start.

    make: computes the motions; `motions` by default.
    """
    characters, frames = plan.phases.shape
    return CrowdClip(
        session.card.skeleton,
        plan.rate,
        frames,
        Placement(plan.roots[:, 0], plan.headings[:, 0]),
        np.arange(characters),
        _batches(session, plan.relative_to_start(), shown, make or motions),
        {**_facts(session, plan), "level_shares": _level_shares(session, shown)},
        tuple(curve.name for curve in session.card.curves),
    )


def share_motions(
    session: Session,
    plan: LocomotionPlan,
    shown: LevelSchedule,
    stands: Placement,
    make: MotionMaker | None = None,
) -> CrowdClip:
    """Return a crowd at given placements, whose characters reuse the plan's motions in turn."""
    one_each = build_crowd(session, plan, shown, make)
    return replace(one_each, placement=stands, motion=np.arange(len(stands)) % len(plan.who))


def _facts(session: Session, plan: LocomotionPlan) -> dict[str, Any]:
    card = session.card
    return {
        "model": f"{card.name}@{session.digest}",
        **plan.labels.facts(plan.who),
        "outside_share": _outside_share(card, plan),
    }


def _level_shares(session: Session, shown: LevelSchedule) -> list[float]:
    """Return the share of the poses that has each level."""
    counts = np.bincount(shown.levels.ravel(), minlength=len(session.card.levels))
    return [float(f"{share:.4g}") for share in counts / shown.levels.size]


def _outside_share(card: ModelCard, plan: LocomotionPlan) -> float:
    """Return the share of the poses with some control outside its sampled range."""
    low, high = [c.minimum for c in card.controls], [c.maximum for c in card.controls]
    return float(np.mean(np.any((plan.controls < low) | (plan.controls > high), axis=-1)))


def _batches(
    session: Session, plan: LocomotionPlan, shown: LevelSchedule, make: MotionMaker
) -> Iterator[Motions]:
    count, frames = plan.phases.shape
    together = max(1, POSES_PER_BATCH // frames)
    for first in range(0, count, together):
        who = np.arange(first, min(first + together, count))
        yield make(session, plan, who, shown.select(who))


def motions(
    session: Session,
    plan: LocomotionPlan,
    who: Annotated[Indices, "motions"],
    shown: LevelSchedule,
    pose: PoseMaker = locomotion_plan.synthesize_poses,
) -> Motions:
    """Return the motions of characters (M,) of the plan, at their levels of detail.

    pose: computes the poses, which are those of the prediction by default.
    """
    shape = (len(who), plan.phases.shape[1])
    count, joints = shape[0] * shape[1], len(session.card.skeleton)
    rotations = np.empty((count, joints, 4), np.float32)
    roots = np.empty((count, 3), np.float32)
    values = np.empty((count, len(session.card.curves)), np.float32)
    for rows in (slice(first, first + POSES_PER_CALL) for first in range(0, count, POSES_PER_CALL)):
        character, frame = np.divmod(np.arange(count)[rows], shape[1])
        own_pose = partial(pose, session, plan)
        posed = _blended_poses(session.card, own_pose, (who[character], frame), shown.rows(rows))
        rotations[rows] = posed.rotations
        roots[rows] = floor_plane.at_height(posed.places, posed.heights)
        if posed.curves is not None:
            values[rows] = curves.clamp(session.card.curves, posed.curves)
    # Bone lengths must not vary with the speed: they are those at the mean controls.
    usual = plan.controls[who].mean(axis=1)
    bones = stride.bones(session, usual, plan.labels.weights[plan.who[who]])
    turns = rotations.reshape(*shape, joints, 4)
    own_curves = values.reshape(*shape, -1) if values.size else None
    return Motions(turns, roots.reshape(*shape, 3), bones, shown.levels, own_curves)


def _blended_poses(
    card: ModelCard, pose: _PoseMaker, pairs: Pairs, shown: LevelSchedule
) -> RelativePoses:
    """Return the poses of K pairs of a character and a frame, blended where levels change.

    shown: levels of the pairs, in arrays (K,).
    """
    after, shares = _at_levels(card, pose, pairs, shown.levels), shown.shares
    between = np.flatnonzero(shares < 1.0)
    if len(between):
        some = pairs[0][between], pairs[1][between]
        before = _at_levels(card, pose, some, shown.previous[between])
        for name, whole in after.arrays.items():
            mix = blend.nlerp if name == "rotations" else blend.lerp
            whole[between] = mix(getattr(before, name), whole[between], shares[between])
    return after


def _at_levels(card: ModelCard, pose: _PoseMaker, pairs: Pairs, levels: Indices) -> RelativePoses:
    joints, channels, count = len(card.skeleton), len(card.curves), len(levels)
    poses = RelativePoses(
        np.empty((count, joints, 4)),
        np.empty(count),
        np.empty(count, dtype=complex),
        np.empty((count, channels)) if channels else None,
    )
    for level in np.unique(levels).tolist():
        rows = np.flatnonzero(levels == level)
        own = pose(pairs[0][rows], pairs[1][rows], level)
        for name, whole in poses.arrays.items():
            whole[rows] = getattr(own, name)
    return poses


def measure_foot_skate(
    card: ModelCard, motions: Motions, rate: float
) -> Annotated[Floats, "motions strides"]:
    """Return the mean foot skate (M, strides), m/s, of motions cut into lengths of a mean stride.

    The ground is at the lowest height of each stride, as for captured clips. A remainder at the end
    is ignored, unless the motion is shorter than a stride. Needs a card with feet.
    """
    bones, roots, rotations = (
        part.astype(np.float64)
        for part in (motions.bone_offsets, motions.root_position, motions.rotations)
    )
    local = skeleton.translations(bones, roots)
    joints = skeleton.positions(card.skeleton.parents, rotations, local)
    return measure_skate_of_feet(card, joints[:, :, list(card.feet)], rate)


def measure_skate_of_feet(
    card: ModelCard, feet: Annotated[Floats, "motions frames feet 3"], rate: float
) -> Annotated[Floats, "motions strides"]:
    """Return the foot skate of `measure_foot_skate` for paths of feet (M, F, K, 3), m."""
    frames = feet.shape[1]
    length = min(round(float(np.mean(card.durations)) * rate) + 1, frames)
    feet = feet[:, : frames // length * length]
    return foot_skate.mean_skate_speed(feet.reshape(len(feet), -1, length, *feet.shape[2:]), rate)


def foot_skate_per_clip(gait: Gait, rate: float) -> Annotated[Floats, "clips 1"]:
    """Return the foot skate (N, 1), m/s, of one stride at each captured clip's controls."""
    card = gait.session.card
    controls = np.array(card.examples)
    length = round(float(np.mean(card.durations)) * rate) + 1
    who = stride.clip_performers(card)
    nowhere = np.zeros(len(controls))
    origin = floor_plane.project(np.zeros((len(controls), 3)))
    held = np.repeat(controls[:, None], length, axis=1)
    plan = locomotion_plan.plan_from_controls(gait, held, who, nowhere, (origin, nowhere), rate)
    finest = level_transitions.constant_schedule(0, plan.phases.shape)
    return measure_foot_skate(
        card, motions(gait.session, plan, np.arange(len(controls)), finest), rate
    )


def mean_foot_skate(gait: Gait, rate: float) -> float:
    """Return the mean foot skate of the model's strides, m/s, performers weighted equally."""
    speeds = foot_skate_per_clip(gait, rate)[:, 0]
    moved_by = stride.clip_performers(gait.session.card)
    return float(np.mean([speeds[moved_by == one].mean() for one in np.unique(moved_by)]))
