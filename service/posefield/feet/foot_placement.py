"""Frames of a motion with the feet placed where the plan says."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames, RootPath, Rotations
from posefield.common.units import UP, Booleans, Floats
from posefield.feet import limbs, two_bone
from posefield.feet.ball_path import Footsteps
from posefield.feet.footsteps import FeetPlan
from posefield.feet.stances import Cycle
from posefield.locomotion import floor_plane
from posefield.motion import quat, skeleton


@dataclass(frozen=True)
class PlacedFrames:
    """Frames whose feet are placed: rotations (S, J, 4) and roots (S, 3), m."""

    rotations: Rotations
    roots: RootPath


@dataclass(frozen=True)
class FootPaths:
    """Paths of K feet (F, K, 3), m, over the grid of a plan: predicted and placed."""

    before: Annotated[Floats, "frames feet 3"]
    after: Annotated[Floats, "frames feet 3"]


def place_feet(
    plan: FeetPlan,
    times: Frames,
    rotations: Rotations,
    roots: RootPath,
    joints: Collection[int] | None = None,
) -> PlacedFrames:
    """Return the frames at times (S,), s, with the feet where the plan says.

    rotations (S, J, 4) and roots (S, 3), m: predicted poses at these times, of the motion that was
    planned. joints: those whose positions are needed; limbs without any of them are not turned.
    None for all.
    """
    body, at = plan.character, times * plan.rate
    poses = limbs.evaluate_poses(body.parents, body.bones, body.limbs, rotations, roots)
    shift = _shift(plan, at)
    turned = rotations.copy()
    above = None if joints is None else _joints_above(body.parents, joints)
    for index, (limb, target) in enumerate(_targets(plan, poses, at, shift)):
        if above is not None and limb.upper not in above:
            continue
        found = two_bone.solve(poses, limb, two_bone.reach(poses, limb, shift, target))
        found.apply(limb, turned)
        if index < len(body.legs) and not plan.floor.is_level:
            # The foot is tilted as the floor is, in the axes of the ankle.
            own = poses.orientation(limb.lower)
            tilt = quat.mul(quat.conj(own), quat.mul(plan.floor.tilt, own))
            turned[:, limb.lower] = quat.mul(found.lower, tilt)
    return PlacedFrames(turned, roots + shift)


def _joints_above(parents: tuple[int, ...], joints: Collection[int]) -> set[int]:
    """Return the joints whose rotations move some joints."""
    return {above for joint in joints for above in skeleton.joint_chain(parents, joint)[:-1]}


def foot_paths(plan: FeetPlan) -> FootPaths:
    """Return the paths of the planted feet over the grid of the plan."""
    poses, legs = plan.poses, plan.character.legs
    at = np.arange(float(len(plan.lowered)))
    shift = _shift(plan, at)
    before, after = np.empty((2, len(at), len(legs), 3))
    for foot, (leg, target) in enumerate(list(_targets(plan, poses, at, shift))[: len(legs)]):
        upper = poses.position(leg.upper) + shift
        arm = _foot_arm(plan, poses, leg)
        before[:, foot] = poses.position(leg.tip)
        after[:, foot] = upper + two_bone.reach(poses, leg, shift, target) + arm
    return FootPaths(before, after)


def _shift(plan: FeetPlan, at: Frames) -> RootPath:
    """Return the movement (S, 3), m, of the root at fractional frames (S,)."""
    found: RootPath = -_interpolate(_extended(plan.lowered, plan.cycle), at)[:, None] * UP
    return found


def _targets(
    plan: FeetPlan, poses: limbs.LimbPoses, at: Frames, shift: RootPath
) -> Iterator[tuple[limbs.Limb, RootPath]]:
    """Yield each limb with the target (S, 3), m, of its end, the legs first."""
    body = plan.character
    for leg, steps, change in zip(body.legs, plan.steps, plan.changes, strict=True):
        moved = _interpolate(_extended_path(change, plan.cycle), at)
        path = poses.position(leg.tip) + moved
        yield leg, _anchored(steps, plan, at, path) - _foot_arm(plan, poses, leg)
    for limb, share in zip(body.kept, plan.led.limbs, strict=True):
        # Where it is not led, the end moves with the root.
        free = 1.0 - np.clip(_interpolate(_extended(share, plan.cycle), at), 0.0, 1.0)
        yield limb, poses.position(limb.lower) + free[:, None] * shift


def _foot_arm(plan: FeetPlan, poses: limbs.LimbPoses, leg: limbs.Limb) -> RootPath:
    """Return the vectors (S, 3), m, from the ankle to the joint that stands."""
    arm = poses.position(leg.tip) - poses.position(leg.lower)
    return arm if plan.floor.is_level else plan.floor.tilted(arm)


def _anchored(steps: Footsteps, plan: FeetPlan, at: Frames, path: RootPath) -> RootPath:
    """Return the path (S, 3), m, exactly at its anchor in each stance."""
    count, found = plan.changes.shape[1], path.copy()
    for stance, anchor in zip(steps.stances, steps.anchors, strict=True):
        found[_within(at, stance.begin, stance.end - 1)] = anchor
        if plan.cycle is not None and stance.end > count:
            earlier = _moved(anchor, plan.cycle, -1)
            found[_within(at, stance.begin - count, stance.end - 1 - count)] = earlier
        if plan.cycle is not None and stance.begin == 0:
            later = _moved(anchor, plan.cycle, 1)
            found[_within(at, count, stance.end - 1 + count)] = later
    return found


def _within(at: Frames, first: int, last: int) -> Annotated[Booleans, "frames"]:
    found: Booleans = (at >= first - 1e-9) & (at <= last + 1e-9)
    return found


def _moved(point: Floats, cycle: Cycle, cycles: int) -> Floats:
    """Return a point (3,), m, one cycle later or earlier."""
    floor = floor_plane.project(point)
    if cycles > 0:
        floor = cycle.way + cycle.factor * floor
    else:
        floor = np.conj(cycle.factor) * (floor - cycle.way)
    return floor_plane.at_height(floor, point @ UP)


def _extended_path(change: RootPath, cycle: Cycle | None) -> Annotated[Floats, "_ 3"]:
    """Return changes (F + 3, 3) with those of one frame before and of two after."""
    if cycle is None:
        return _extended(change, None)
    floor = floor_plane.project(change)
    own = np.concatenate([np.conj(cycle.factor) * floor[-1:], floor, cycle.factor * floor[:2]])
    return floor_plane.at_height(own, _extended(change @ UP, cycle))


def _extended(values: Floats, cycle: Cycle | None) -> Floats:
    """Return values (F + 3, ...) with those of one frame before and of two after."""
    if cycle is None:
        return np.concatenate([values[:1], values, values[-1:], values[-1:]])
    return np.concatenate([values[-1:], values, values[:1], values[1:2]])


def _interpolate(values: Floats, at: Frames) -> Floats:
    """Return values at fractional frames (S,): cubic Hermite, slopes by central differences.

    values: (F + 3, ...), from frame -1 on.
    """
    before = np.clip(np.floor(at + 1e-9).astype(np.int64), 0, len(values) - 4)
    share = np.clip(at - before, 0.0, 1.0).reshape(-1, *(1 for _ in values.shape[1:]))
    a, b, c, d = (values[before + offset] for offset in range(4))
    found: Floats = b + 0.5 * share * (
        c - a + share * (2.0 * a - 5.0 * b + 4.0 * c - d + share * (3.0 * (b - c) + d - a))
    )
    return found
