"""Crowds of walking characters: validation, plans, and motions computed on demand."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices
from posefield.inference.level_selection import Camera, LevelCriteria, NamedModel
from posefield.inference.session import Session
from posefield.locomotion import (
    collision_avoidance,
    floor_plane,
    locomotion_plan,
    stride,
)
from posefield.locomotion.collision_avoidance import RADIUS
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import LevelSchedule, LocomotionPlan
from posefield.locomotion.stride import RelativePoses
from posefield.model_file.model_card import ModelCard
from posefield.motion import contact_detection, curves, quat, skeleton
from posefield.motion.clip import CrowdClip, Motions, Placement
from posefield.question.walk_question import (
    DEFAULT_FOV,
    DEFAULT_HEIGHT,
    DEFAULT_PIXELS,
    WalkQuestion,
)

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
MotionsWithContacts = tuple[Motions, Annotated[Floats, "motions frames contacts"]]
_PoseMaker = Callable[[Indices, Indices, int], RelativePoses]


def plan_random(gait: Gait, count: int, seconds: float, rate: float, seed: int) -> LocomotionPlan:
    """Return a plan of `count` characters on random paths.

    Raises InvalidField for numbers out of range.
    """
    frames = frame_count(count, seconds, rate, seed)
    characters = collision_avoidance.draw_characters(gait, count, seed)
    ways = collision_avoidance.draw_paths(gait, characters, seconds)
    return locomotion_plan.plan_along_paths(
        gait, ways, characters.who, characters.phases, frames, rate
    )


def frame_count(count: int, seconds: float, rate: float, seed: int) -> int:
    """Return the number of frames of each motion; InvalidField for values out of range."""
    if count < 1:
        raise InvalidField("count", f"{count}, expected at least 1 character")
    if not 0 <= seed < SEED_LIMIT:
        raise InvalidField("seed", f"{seed}, expected 0 to less than {SEED_LIMIT}")
    if not FPS_RANGE[0] <= rate <= FPS_RANGE[1]:
        raise InvalidField("fps", f"{rate:g}, expected {FPS_RANGE[0]:g} to {FPS_RANGE[1]:g}")
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InvalidField("seconds", f"{seconds:g}, expected a time above 0")
    pose_count = poses(count, seconds, rate)
    if pose_count > MAX_POSES:
        raise InvalidField("count", f"{pose_count:.3g} poses, expected {MAX_POSES} at most")
    # Tolerance of a millionth of a frame for the rounding of seconds * rate.
    return math.floor(seconds * rate + 1e-6) + 1


def poses(count: int, seconds: float, rate: float) -> float:
    """Return the number of poses of a crowd, or of planned points if these are more."""
    return count * (seconds * max(rate, 1.0 / MAX_PLAN_STEP) + 1.0)


def crowd_of_plan(
    session: Session, plan: LocomotionPlan, levels: LevelSchedule, make: MotionMaker | None = None
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
        _batches(session, plan.relative_to_start(), levels, make or motions),
        _facts(session, plan, levels),
        tuple(curve.name for curve in session.card.curves),
    )


def _facts(session: Session, plan: LocomotionPlan, levels: LevelSchedule) -> dict[str, Any]:
    card = session.card
    counts = np.bincount(levels.levels.ravel(), minlength=len(card.levels))
    low, high = [c.minimum for c in card.controls], [c.maximum for c in card.controls]
    outside = np.any((plan.controls < low) | (plan.controls > high), axis=-1)
    return {
        "model": f"{card.name}@{session.digest}",
        **plan.labels.facts(plan.who),
        "outside_share": float(np.mean(outside)),
        "level_shares": [float(f"{share:.4g}") for share in counts / levels.levels.size],
    }


def _batches(
    session: Session, plan: LocomotionPlan, levels: LevelSchedule, make: MotionMaker
) -> Iterator[Motions]:
    count, frames = plan.phases.shape
    together = max(1, POSES_PER_BATCH // frames)
    for first in range(0, count, together):
        characters = np.arange(first, min(first + together, count))
        yield make(session, plan, characters, levels.select(characters))


def motions(
    session: Session,
    plan: LocomotionPlan,
    characters: Annotated[Indices, "motions"],
    levels: LevelSchedule,
    pose: PoseMaker = locomotion_plan.synthesize_poses,
) -> Motions:
    """Return the motions of characters (M,) of the plan, at their levels of detail.

    pose: computes the poses, which are those of the prediction by default.
    """
    return motions_with_contacts(session, plan, characters, levels, pose)[0]


def motions_with_contacts(
    session: Session,
    plan: LocomotionPlan,
    characters: Annotated[Indices, "motions"],
    levels: LevelSchedule,
    pose: PoseMaker = locomotion_plan.synthesize_poses,
) -> MotionsWithContacts:
    """Return motions as `motions` does, and the probabilities (M, F, C) of the contacts."""
    shape = (len(characters), plan.phases.shape[1])
    count, joints = shape[0] * shape[1], len(session.card.skeleton)
    rotations = np.empty((count, joints, 4), np.float32)
    roots = np.empty((count, 3), np.float32)
    values = np.empty((count, len(session.card.curves)), np.float32)
    likely = np.empty((count, len(session.card.contacts)))
    for rows in (slice(first, first + POSES_PER_CALL) for first in range(0, count, POSES_PER_CALL)):
        character, frame = np.divmod(np.arange(count)[rows], shape[1])
        pose_pairs = partial(pose, session, plan)
        posed = _blended_poses(pose_pairs, (characters[character], frame), levels.rows(rows))
        rotations[rows] = posed.rotations
        roots[rows] = floor_plane.at_height(posed.places, posed.heights)
        if posed.curves is not None:
            values[rows] = curves.clamp(session.card.curves, posed.curves)
        if posed.contacts is not None:
            likely[rows] = posed.contacts
    # Bone lengths must not vary with the speed: they are those at the mean controls.
    mean_controls = plan.controls[characters].mean(axis=1)
    bones = stride.bones(session, mean_controls, plan.labels.weights[plan.who[characters]])
    turns = rotations.reshape(*shape, joints, 4)
    motion_curves = values.reshape(*shape, -1) if values.size else None
    synthesized = Motions(turns, roots.reshape(*shape, 3), bones, levels.levels, motion_curves)
    likely = likely.reshape(*shape, -1)
    if plan.stepping is not None:
        likely += plan.stepping.firm[characters][..., None] * (1.0 - likely)
    return synthesized, likely


def _blended_poses(pose: _PoseMaker, pairs: Pairs, levels: LevelSchedule) -> RelativePoses:
    """Return the poses of K pairs of a character and a frame, blended where levels change.

    levels: levels of the pairs, in arrays (K,).
    """
    after, shares = _at_levels(pose, pairs, levels.levels), levels.shares
    between = np.flatnonzero(shares < 1.0)
    if len(between):
        some = pairs[0][between], pairs[1][between]
        before = _at_levels(pose, some, levels.previous[between])
        for name, blended in after.arrays.items():
            mix = quat.nlerp if name == "rotations" else quat.lerp
            blended[between] = mix(getattr(before, name), blended[between], shares[between])
    return after


def _at_levels(pose: _PoseMaker, pairs: Pairs, levels: Indices) -> RelativePoses:
    by_level = []
    for level in np.unique(levels).tolist():
        rows = np.flatnonzero(levels == level)
        by_level.append((rows, pose(pairs[0][rows], pairs[1][rows], level).arrays))
    if len(by_level) == 1:
        return RelativePoses(**by_level[0][1])
    order = np.argsort(np.concatenate([rows for rows, _ in by_level]))
    names = by_level[0][1]
    return RelativePoses(
        **{name: np.concatenate([arrays[name] for _, arrays in by_level])[order] for name in names}
    )


def measure_foot_skate(
    card: ModelCard, motions: Motions, rate: float
) -> Annotated[Floats, "motions strides"]:
    """Return the mean foot skate (M, strides), m/s, of motions cut into lengths of a mean stride.

    The ground is at the lowest height of each stride, as for captured clips. A remainder at the end
    is ignored, unless the motion is shorter than a stride. Needs a card with feet.
    """
    bones, roots, rotations = (
        values.astype(np.float64)
        for values in (motions.bone_offsets, motions.root_position, motions.rotations)
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
    return contact_detection.mean_skate_speed(
        feet.reshape(len(feet), -1, length, *feet.shape[2:]), rate
    )


def foot_skate_per_clip(gait: Gait, rate: float) -> Annotated[Floats, "clips 1"]:
    """Return the foot skate (N, 1), m/s, of one stride at each captured clip's controls."""
    card = gait.session.card
    controls = np.array(card.examples)
    length = round(float(np.mean(card.durations)) * rate) + 1
    combinations = stride.clip_performers(card)
    nowhere = np.zeros(len(controls))
    origin = floor_plane.project(np.zeros((len(controls), 3)))
    constant = np.repeat(controls[:, None], length, axis=1)
    plan = locomotion_plan.plan_from_controls(
        gait, constant, combinations, nowhere, (origin, nowhere), rate
    )
    finest = locomotion_plan.constant_schedule(0, plan.phases.shape)
    return measure_foot_skate(
        card, motions(gait.session, plan, np.arange(len(controls)), finest), rate
    )


def mean_foot_skate(gait: Gait, rate: float) -> float:
    """Return the mean foot skate of the model's strides, m/s, performers weighted equally."""
    speeds = foot_skate_per_clip(gait, rate)[:, 0]
    moved_by = stride.clip_performers(gait.session.card)
    return float(np.mean([speeds[moved_by == one].mean() for one in np.unique(moved_by)]))


MOST_OVERLAPS = 20
"""Pairs of characters that overlap, the first ones, of which a crowd tells the times."""


def criteria_of(question: WalkQuestion) -> LevelCriteria | None:
    """Return the camera and the limit that choose the levels of detail; None without a camera."""
    if question.camera is None:
        return None
    fov = DEFAULT_FOV if question.fov is None else question.fov
    height = DEFAULT_HEIGHT if question.height is None else question.height
    pixels = DEFAULT_PIXELS if question.pixels is None else question.pixels
    camera = Camera(np.array(question.camera), fov, height)
    return LevelCriteria(camera, pixels, budget=None, previous=None)


def build_crowd(
    model: NamedModel, gait: Gait, question: WalkQuestion, make: MotionMaker | None = None
) -> CrowdClip:
    """Return the crowd of a question, whose motions are computed on demand.

    make: computes the motions, which are as predicted by default. Raises InvalidField for
    parameters that the model or the limits do not permit.
    """
    question.check()
    gait = gait.with_labels(question.labels)
    span = question.seconds, question.fps, question.seed
    plan = plan_random(gait, question.motions or question.count, *span)
    levels = build_schedule(model, plan, question)
    crowd, places = crowd_of_plan(gait.session, plan, levels, make), plan.places
    if question.motions is not None:
        # The characters reuse the motions in turn.
        stands = collision_avoidance.initial_placement(question.count, question.seed)
        motion = np.arange(len(stands)) % len(plan.who)
        crowd = replace(crowd, placement=stands, motion=motion)
    if not collision_avoidance.is_searchable(len(crowd.motion), plan.places.shape[1], plan.rate):
        return crowd
    if question.motions is not None:
        places = _placed(crowd.placement, plan.relative_to_start().places[crowd.motion])
    return replace(crowd, facts={**crowd.facts, **overlap_facts(places, plan.rate)})


def _placed(
    placement: Placement, relative: Annotated[FloorVectors, "characters frames"]
) -> Annotated[FloorVectors, "characters frames"]:
    """Return the places of characters (N, F), m, from those in the frames of their starts."""
    starts = floor_plane.project(placement.positions)[:, None]
    return starts + relative * floor_plane.unit_vectors(placement.headings)[:, None]


def overlap_facts(
    places: Annotated[FloorVectors, "characters frames"], rate: float, names: Sequence[Any] = ()
) -> dict[str, Any]:
    """Return the facts of pairs of characters, by name or number, that overlap, and a warning."""
    overlaps = collision_avoidance.find_overlaps(places, rate)
    if not overlaps:
        return {"overlaps": {"pairs": 0}}
    names = names or range(len(places))
    told = overlaps[:MOST_OVERLAPS]
    first, second = ([names[getattr(o, name)] for o in told] for name in ("first", "second"))
    seconds = [overlap.seconds for overlap in told]
    warning = (
        f"pairs of characters that come nearer than {2.0 * RADIUS:g} m: {len(overlaps)}, the first "
        f"at {seconds[0]:.1f} s ({first[0]} and {second[0]})"
    )
    pairs = {"pairs": len(overlaps), "first": first, "second": second, "seconds": seconds}
    return {"overlaps": pairs, "warnings": [warning]}


def build_schedule(
    model: NamedModel, plan: LocomotionPlan, question: WalkQuestion
) -> LevelSchedule:
    """Return the levels of detail of a plan: those of the question's camera, or one."""
    level, coarsest = question.level or 0, len(model.session.card.levels) - 1
    if not 0 <= level <= coarsest:
        raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
    criteria = criteria_of(question)
    if criteria is None:
        return locomotion_plan.constant_schedule(level, plan.phases.shape)
    roots, pixels = plan.roots + model.rest_position, criteria.pixels
    scale = locomotion_plan.scale(criteria.camera, roots, model.radius)
    return locomotion_plan.schedule_levels(model.level_table, scale, pixels, question.fps)
