"""Plans of the feet of motions whose characters have the same limbs, all at once.

Frames of all motions lie one after another, and so do those of all feet, foot after foot. Nothing
of a motion depends on the others: sums are over its own frames, and products are element by
element.
"""

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np

from posefield.common import cancellation, frame_groups
from posefield.common.frame_groups import FrameGroups, FrameRows
from posefield.common.units import UP, Floats, Frames
from posefield.feet import ball_path, footsteps, limbs, stance_rows
from posefield.feet.footsteps import FeetPlan, Footsteps, Led, PlanRequest
from posefield.feet.limbs import Limb, LimbPoses, Points, Turns, Values
from posefield.feet.stance_rows import DECIMALS, NO_CYCLE, STANDING, SUNK, UNEVEN, FootRows, Runs
from posefield.locomotion import floor_plane
from posefield.motion import quat
from posefield.question.motion_question import LEVEL_FLOOR

# Rounds in which stances are shortened whose leg does not reach.
ROUNDS = 4
# On a slope the feet of a step differ in height: the pelvis is lowered by this length times the
# slope more, m.
STEP = 0.4
# The pelvis is lowered this long before and after it is needed, s, and its way is smoothed with a
# Gaussian that is half as wide.
SPREAD, SMOOTHING = 0.06, 0.03
# It is lowered no more than this, m.
MOST = 0.02

Lowering = Annotated[Floats, "frames"]
PerMotion = Annotated[Floats, "motions"]
FootPaths = Annotated[Floats, "foot_frames 3"]
"""Points of all feet (K N, 3), foot after foot."""


class _Bodies(NamedTuple):
    """Motions (M,) of characters with the same limbs, whose frames (N,) lie one after another.

    poses: of the limbs. rows: grids of the motions. planes, tilts: of the floors of the frames, as
    of `footsteps.floor_planes`. led: what keeps its predicted path. room: how far the predicted
    roots may be raised, and lowered (N,), m.
    """

    requests: Sequence[PlanRequest]
    legs: tuple[Limb, ...]
    poses: LimbPoses
    roots: Annotated[Floats, "frames 3"]
    rows: FrameRows
    planes: Annotated[Floats, "frames 3"]
    tilts: Turns | None
    led: Led
    room: tuple[Frames, Frames]


def plan_motions(requests: Sequence[PlanRequest]) -> list[FeetPlan]:
    """Return where the feet of motions stand, and how low the pelvis must be for that."""
    bodies = [request.character for request in requests]
    kinds = [
        (body.parents, body.legs, body.kept, request.likely is None)
        for body, request in zip(bodies, requests, strict=True)
    ]
    return footsteps.evaluate_by_kind(requests, kinds, _plan_alike)


def _plan_alike(requests: Sequence[PlanRequest]) -> list[FeetPlan]:
    """Return the plans of motions whose characters have the same limbs."""
    character = requests[0].character
    legs, arms = character.legs, character.kept
    groups = frame_groups.of_lengths([request.roots for request in requests])
    rotations = [request.rotations for request in requests]
    roots = np.concatenate([request.roots for request in requests])
    bones = np.stack([request.character.bones for request in requests])
    poses = limbs.evaluate_motions(character.parents, bones, legs + arms, rotations, roots, groups)
    cyclic = np.array([request.cycle is not None for request in requests])
    rows = FrameRows(groups, np.array([request.rate for request in requests], float), cyclic)
    leads = [
        request.led or footsteps.always(len(legs), len(arms), len(request.roots))
        for request in requests
    ]
    led = footsteps.joined(leads)
    floors = footsteps.floor_planes([request.floor for request in requests], groups)
    room = led.room(poses, legs + arms)
    bodies = _Bodies(requests, legs, poses, roots, rows, *floors, led, room)
    feet, down = _feet(bodies)
    above = stance_rows.heights_above(feet.heights, down, feet.height, feet.rows)
    grounded = np.zeros(len(requests))
    if legs:
        # Characters stand as high as their feet do: the ground first. Feet may be uneven, and limbs
        # that keep their ends must reach them.
        mean = above.reshape(len(legs), -1).mean(axis=0)
        lowered = mean - np.clip(mean, -SUNK, UNEVEN)
        lowered = np.clip(lowered, -groups.smallest(room[0]), groups.smallest(room[1]))
        fixed = np.array([request.character.fixed for request in requests])
        grounded = np.where(fixed, 0.0, lowered)
    lowered = np.tile(grounded, len(legs))
    feet = feet._replace(
        heights=feet.heights - lowered[feet.rows.groups.group],
        height=feet.height + np.clip(above - lowered, -SUNK, UNEVEN),
        flat_pitch=ball_path.flat_pitches(feet.arms, down, feet.rows),
    )
    toe_heights = feet.height + _toe_drops(bodies, down, feet.rows)
    stances = ball_path.trimmed(stance_rows.discipline(down, feet), feet)
    if led.feet.any():
        stances = _led_stances(leads, stances, feet)
    followed = _follow(bodies, grounded)
    reachable, paths, lowered = _reachable_steps(bodies, feet, followed, stances)
    rolled, rolled_heights, flats = ball_path.roll(feet, reachable)
    first = feet.rows.flat(reachable.rows, reachable.begins)
    anchors = paths[first] - floor_plane.at_height(rolled[first], rolled_heights[first])
    by_leg = paths.reshape(len(legs), len(roots), 3)
    changes = np.empty(by_leg.shape)
    for change, path, leg in zip(changes, by_leg, legs, strict=True):
        change[:] = path - poses.position(leg.tip)
    before, after = (runs.by_row(len(feet.height)) for runs in (stances, reachable))
    steps = [
        Footsteps(row, anchors[reachable.rows == index], flats[reachable.rows == index])
        for index, row in enumerate(after)
    ]
    plans = []
    for motion, (request, motion_poses) in enumerate(zip(requests, poses.split(), strict=True)):
        frames = slice(groups.starts[motion], groups.starts[motion] + groups.counts[motion])
        # On a given floor: legs that stood as predicted, but do not any more.
        stood = zip(before[motion :: len(requests)], after[motion :: len(requests)], strict=True)
        unreached = [leg for leg, (first, last) in enumerate(stood) if first and not last]
        plans.append(
            FeetPlan(
                request.character,
                request.rate,
                request.cycle,
                tuple(steps[motion :: len(requests)]),
                changes[:, frames],
                (followed + lowered)[frames],
                followed[frames],
                float(grounded[motion]),
                motion_poses,
                leads[motion],
                toe_heights[motion :: len(requests)],
                request.floor,
                () if request.floor == LEVEL_FLOOR else tuple(unreached),
            )
        )
    return plans


def _feet(bodies: _Bodies) -> tuple[FootRows, Runs]:
    """Return the feet as predicted, and their contacts; rows are leg after leg."""
    requests, legs, poses = bodies.requests, bodies.legs, bodies.poses
    counts = np.tile(bodies.rows.groups.counts, len(legs))
    rates, cyclic = np.tile(bodies.rows.rates, len(legs)), np.tile(bodies.rows.cyclic, len(legs))
    rows = FrameRows(FrameGroups(counts), rates, cyclic)
    points, ankles = (
        np.concatenate([np.zeros((0, 3)), *(poses.position(joint) for joint in joints)])
        for joints in ([leg.tip for leg in legs], [leg.lower for leg in legs])
    )
    likely = [request.likely for request in requests if request.likely is not None]
    if likely:
        contacts = [request.contacts[leg] for leg in range(len(legs)) for request in requests]
        probabilities = np.round(np.concatenate(likely).T.ravel(), DECIMALS)
        down = stance_rows.tidy(probabilities > STANDING, rows)
    else:
        motions = [request for _ in legs for request in requests]
        paths = rows.groups.split(points)
        masks = [
            stance_rows.detect(path, motion.rate, motion.cycle)
            for path, motion in zip(paths, motions, strict=True)
        ]
        contacts = [
            stance_rows.statistics(0, path @ UP, motion.rate, mask, motion.cycle is not None)
            for path, motion, mask in zip(paths, motions, masks, strict=True)
        ]
        down = stance_rows.runs(np.concatenate([np.zeros(0, bool), *masks]), rows)
    height, swing, longest_swing, clearance = (
        np.array([getattr(contact, name) for contact in contacts], float)
        for name in ("height", "swing", "longest_swing", "clearance")
    )
    walking = [
        np.zeros(len(request.roots), bool) if request.walking is None else request.walking
        for request in requests
    ]
    ways, factors = np.array([request.cycle or NO_CYCLE for request in requests], complex).T
    feet = FootRows(
        rows,
        floor_plane.project(points),
        points @ UP,
        height,
        swing,
        longest_swing,
        clearance,
        np.tile(ways, len(legs)),
        np.tile(factors, len(legs)),
        np.tile(np.concatenate(walking), len(legs)),
        points - ankles,
        np.zeros(len(height)),
    )
    return feet, down


def _toe_drops(bodies: _Bodies, contacts: Runs, rows: FrameRows) -> Annotated[Floats, "rows"]:
    """Return how far the ends of toes are above the balls of flat feet (R,), m.

    Minus infinity for legs without toes.
    """
    drops = np.full((len(bodies.legs), len(bodies.requests)), -np.inf)
    toes = [np.zeros((0, 3))]
    for leg in bodies.legs:
        toe = np.broadcast_to(leg.toe or (0.0, 0.0, 0.0), bodies.roots.shape)
        toes.append(quat.rotate(bodies.poses.orientation(leg.tip), toe))
    pitches = ball_path.flat_pitches(np.concatenate(toes), contacts, rows)
    for drop, leg, pitch in zip(drops, bodies.legs, pitches.reshape(drops.shape), strict=True):
        if leg.toe is not None:
            drop[:] = math.hypot(*leg.toe) * np.sin(pitch)
    return drops.ravel()


def _led_stances(leads: Sequence[Led], stances: Runs, feet: FootRows) -> Runs:
    """Return the stances that agree with where the feet are led."""
    down, groups = stances.mask(feet.rows), feet.rows.groups
    points = groups.split(floor_plane.at_height(feet.floor, feet.heights))
    for row, standing in enumerate(groups.split(down)):
        exact = np.flatnonzero(leads[row % len(leads)].feet[row // len(leads)])
        rate, contact = float(feet.rows.rates[row]), feet.contact(row)
        footsteps.lead_stances(standing, points[row], rate, contact, exact)
    led = stance_rows.runs(down, feet.rows)
    return led.select(
        ~led.inner(feet.rows) | (led.lengths >= stance_rows.shortest(feet.rows)[led.rows])
    )


def _follow(bodies: _Bodies, grounded: PerMotion) -> Frames:
    """Return how much the roots are lowered so that they follow the floor (N,), m.

    Limbs that keep their ends must reach them; the legs make up for the rest.
    """
    group, (up, down) = bodies.rows.groups.group, bodies.room
    lowered = grounded[group] - footsteps.floor_heights(bodies.planes, bodies.roots)
    high = cover(np.maximum(-lowered - up, 0.0), bodies.rows)
    low = cover(np.maximum(lowered - down, 0.0), bodies.rows)
    stays = [r.character.fixed and not r.character.raised for r in bodies.requests]
    return np.where(np.array(stays)[group], 0.0, lowered + high - low)


def _reachable_steps(
    bodies: _Bodies, feet: FootRows, followed: Frames, stances: Runs
) -> tuple[Runs, FootPaths, Frames]:
    """Return the stances, the paths of feet (K N, 3), m, and how far pelvises are lowered, m.

    feet: predicted, on the ground. followed: how much characters are lowered to the level on which
    they were captured, and with the floors (N,), m. Stances whose leg does not reach are shortened.
    Pelvises are lowered (N,) beyond that.
    """
    count, group = len(bodies.legs), bodies.rows.groups.group
    slopes = np.array([request.floor.slope for request in bodies.requests])
    limit = np.clip(bodies.room[1] - followed, 0.0, (MOST + STEP * slopes)[group])
    limit[np.array([request.character.fixed for request in bodies.requests])[group]] = 0.0
    positions = floor_plane.at_height(feet.floor, feet.heights)
    goal = np.where(bodies.led.feet.ravel()[:, None], positions, np.nan)
    paths = ball_path.plan_paths(feet, stances, goal)
    needs = _needs(bodies, paths, followed)
    for _ in range(ROUNDS):
        cancellation.check()
        beyond = needs > np.tile(limit, count) + 1e-9
        shorter = stance_rows.shortened(stances, beyond, feet.rows)
        lost = stances.mask(feet.rows) & ~shorter.mask(feet.rows)
        rows = np.unique(feet.rows.groups.group[lost])
        if not len(rows):
            break
        changed = np.isin(feet.rows.groups.group, rows)
        paths[changed] = ball_path.plan_paths(
            feet.select(rows), shorter.of_rows(rows), goal[changed]
        )
        needs, stances = _needs(bodies, paths, followed), shorter
    lowered = lower(list(needs.reshape(count, len(limit))), limit, bodies.rows)
    return stances, _on_floors(bodies, paths), lowered


def _on_floors(bodies: _Bodies, paths: FootPaths) -> FootPaths:
    """Return paths of feet (K N, 3), m, on floors at height 0 on those of the motions."""
    planes = np.tile(bodies.planes, (len(bodies.legs), 1))
    return np.asarray(paths + footsteps.floor_heights(planes, paths)[:, None] * UP)


def _needs(bodies: _Bodies, paths: FootPaths, followed: Frames) -> Annotated[Floats, "foot_frames"]:
    """Return how much lower each leg needs the pelvis to be (K N,), m, with its heel lifted."""
    poses, tilts = bodies.poses, bodies.tilts
    needs = [np.zeros(0)]
    balls = _on_floors(bodies, paths).reshape(-1, *bodies.roots.shape)
    for leg, ball in zip(bodies.legs, balls, strict=True):
        arm = poses.position(leg.tip) - poses.position(leg.lower)
        if tilts is not None:
            arm = footsteps.tilted(bodies.planes, tilts, arm)
        hip = poses.position(leg.upper) - followed[:, None] * UP
        if leg.tip == leg.lower:
            reach = limbs.firm_reach(poses, leg)
        else:
            distance = np.linalg.norm(hip - ball + arm, axis=-1)
            # A micrometre of slack, so that rounding lifts no heel.
            reach = limbs.leg_chord(poses, leg, distance) + 1e-6
            lifted = quat.rotate(ball_path.heel_turns(hip - ball, arm, reach), arm)
            # On a slope the pelvis sinks first.
            sloped = np.asarray(bodies.planes[:, 1:].any(axis=1))
            arm = np.where(sloped[:, None], arm, lifted)
        needs.append(need(poses, leg, ball - arm, followed, reach))
    return np.concatenate(needs)


def need(
    poses: LimbPoses,
    leg: Limb,
    target: Points,
    sunk: float | Annotated[Floats, "_"],
    reach: Values,
) -> Values:
    """Return how much lower a leg needs the pelvis to be (F,), m; infinite out of reach.

    target: of the leg's end (F, 3), m. sunk: by how much the pelvis is lowered already, m. reach:
    distance (F,), m, that the leg spans.
    """
    offset = poses.position(leg.upper) - np.asarray(sunk)[..., None] * UP - target
    level = np.sum(np.square(offset * (1.0 - UP)), axis=-1)
    room = np.square(reach) - level
    highest = np.sqrt(np.maximum(room, 0.0))
    return np.where(room < 0.0, np.inf, np.maximum(offset @ UP - highest, 0.0))


def lower(needs: Sequence[Lowering], limit: Lowering, rows: FrameRows) -> Lowering:
    """Return how much the pelvis is lowered (N,), m: smoothly, by `limit` (N,) at most.

    needs: of each leg (N,), m. rows: of the motions, one after another.
    """
    needed = np.minimum(np.max([np.zeros(limit.shape), *needs], axis=0), limit)
    smooth = cover(needed, rows)
    excess = cover(np.maximum(smooth - limit, 0.0), rows)
    return np.maximum(smooth - excess, 0.0)


def cover(needed: Lowering, rows: FrameRows) -> Lowering:
    """Return smooth paths (N,) that are nowhere below the needed ones, which are not negative.

    The largest value of the neighbourhood, smoothed with a kernel that is no wider than that.
    """
    covered = np.zeros(needed.shape)
    if not needed.any():
        return covered
    halves = np.maximum(1, np.round(SPREAD * rows.rates)).astype(np.int64)
    for half in np.unique(halves).tolist():
        same_size = halves == half
        alike, frames = rows.select(np.flatnonzero(same_size)), same_size[rows.groups.group]
        around = range(-half, half + 1)
        kernel = [np.exp(-0.5 * np.square(offset / (SMOOTHING * alike.rates))) for offset in around]
        neighbours = [alike.beside(offset) for offset in around]
        wide = np.max([needed[frames][neighbour] for neighbour in neighbours], axis=0)
        smoothed, total = np.zeros(wide.shape), sum(kernel)
        # Not a matrix product, whose sums could go in another order for more motions.
        for share, neighbour in zip(kernel, neighbours, strict=True):
            smoothed += (share / total)[alike.groups.group] * wide[neighbour]
        covered[frames] = smoothed
    return covered
