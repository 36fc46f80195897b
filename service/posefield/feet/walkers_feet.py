"""Feet of many walkers at once: planned over their whole motions, and placed.

The rules are those of `footsteps` and `foot_placement`; the frames of the motions are the grid of
the plan, so no path is interpolated. Walkers do not depend on each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, TypeVar

import numpy as np
import numpy.typing as npt

from posefield.common import cancellation
from posefield.common.frame_groups import FrameGroups, FrameRows
from posefield.common.units import UP, Booleans, Floats
from posefield.feet import ball_path, limbs, stance_rows, two_bone
from posefield.feet.body_plans import ROUNDS
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stance_rows import DECIMALS, STANDING, FootRows, Runs
from posefield.feet.stances import UNEVEN
from posefield.locomotion import floor_plane
from posefield.motion.contact_detection import FootContact

Scalar = TypeVar("Scalar", np.float64, np.bool_)
PerWalker = Annotated[Floats, "walkers"]
FeetPaths = Annotated[Floats, "walkers frames feet 3"]


@dataclass(frozen=True)
class Walkers:
    """Motions of M walkers with one skeleton, at F frames.

    parents: of the joints. bones: (M, J, 3), m. rotations: (M, F, J, 4). roots: (M, F, 3), m. rate:
    frames a second.
    """

    parents: tuple[int, ...]
    bones: Annotated[Floats, "walkers joints 3"]
    rotations: Annotated[Floats, "walkers frames joints 4"]
    roots: Annotated[Floats, "walkers frames 3"]
    rate: float


@dataclass(frozen=True)
class WalkersFeet:
    """Changes of motions that make feet stand, and facts about the feet.

    turns: rotations (M, F, 4) of the joints of the legs. roots: (M, F, 3), m. before, after: paths
    of the K feet (M, F, K, 3), m. down: when they stand (M, F, K). drift: largest distance of a
    standing foot from its place (M,), m. lowered: largest distance by which the pelvis was lowered
    so that legs reach (M,), m.
    """

    turns: dict[int, Annotated[Floats, "walkers frames 4"]]
    roots: Annotated[Floats, "walkers frames 3"]
    before: Annotated[Floats, "walkers frames feet 3"]
    after: Annotated[Floats, "walkers frames feet 3"]
    down: Annotated[Booleans, "walkers frames feet"]
    drift: PerWalker
    lowered: PerWalker


def stand(
    walkers: Walkers,
    legs: Sequence[Limb],
    contacts: Sequence[FootContact],
    likely: Annotated[Floats, "walkers frames feet"],
) -> WalkersFeet:
    """Return what makes feet stand where their contacts are likely.

    legs: of the K feet that are placed. contacts: their statistics. likely: probabilities (M, F, K)
    of their contacts.
    """
    poses = limbs.evaluate_poses(
        walkers.parents, walkers.bones, legs, walkers.rotations, walkers.roots
    )
    before = np.stack([poses.position(leg.tip) for leg in legs], axis=2)
    rows = _frame_rows(likely.shape, walkers.rate)
    down = stance_rows.tidy((np.round(_rows(likely), DECIMALS) > STANDING).ravel(), rows)
    feet, sunk = _grounded_feet(_rows(before).reshape(-1, 3), down, tuple(contacts), rows)
    found = stance_rows.discipline(down, feet)
    paths, found, lowered = _reachable_steps(poses, legs, feet, found, sunk)
    shift = -(sunk[:, None] + lowered)[..., None] * UP
    targets = _walkers(paths.reshape(-1, likely.shape[1], 3), len(legs))
    turns, after = _placed_legs(poses, legs, shift, targets)
    standing = _walkers(found.mask(rows).reshape(-1, likely.shape[1]), len(legs))
    away = np.linalg.norm((after - targets) * (1.0 - UP), axis=-1) * standing
    drift, most = away.max(axis=(1, 2)), lowered.max(axis=1)
    return WalkersFeet(turns, walkers.roots + shift, before, after, standing, drift, most)


def _frame_rows(shape: tuple[int, ...], rate: float) -> FrameRows:
    """Return the rows of feet of walkers (M, F, K)."""
    walkers, frames, feet = shape
    count = walkers * feet
    groups = FrameGroups(np.full(count, frames))
    return FrameRows(groups, np.full(count, rate), np.zeros(count, bool))


def _rows(
    values: Annotated[npt.NDArray[Scalar], "walkers frames feet ..."],
) -> Annotated[npt.NDArray[Scalar], "rows ..."]:
    """Return values of feet (M, F, K, ...) by row (M K, F, ...)."""
    turned = np.swapaxes(values, 1, 2)
    return turned.reshape(-1, *turned.shape[2:])


def _walkers(
    rows: Annotated[npt.NDArray[Scalar], "rows ..."], feet: int
) -> Annotated[npt.NDArray[Scalar], "walkers ..."]:
    """Return values of rows (M K, F, ...) by walker (M, F, K, ...)."""
    return np.swapaxes(rows.reshape(-1, feet, *rows.shape[1:]), 1, 2)


def _grounded_feet(
    paths: Annotated[Floats, "all_frames 3"],
    down: Runs,
    contacts: tuple[FootContact, ...],
    rows: FrameRows,
) -> tuple[FootRows, PerWalker]:
    """Return feet whose walkers stand on the floor, and how far each walker is lowered (M,), m."""
    count = len(rows.counts)
    captured, swing, longest, clearance = (
        np.tile([getattr(own, name) for own in contacts], count // len(contacts))
        for name in ("height", "swing", "longest_swing", "clearance")
    )
    above = stance_rows.heights_above(paths @ UP, down, captured, rows)
    mean = above.reshape(-1, len(contacts)).mean(axis=1)
    sunk = np.sign(mean) * np.maximum(np.abs(mean) - UNEVEN, 0.0)
    own = np.repeat(sunk, len(contacts))
    height = captured + np.clip(above - own, -UNEVEN, UNEVEN)
    heights = paths @ UP - own[rows.groups.group]
    still = np.zeros(count, np.complex128)
    walking = np.zeros(len(paths), bool)
    floor = floor_plane.project(paths)
    return FootRows(
        rows, floor, heights, height, swing, longest, clearance, still, still + 1.0, walking
    ), sunk


def _reachable_steps(
    poses: LimbPoses, legs: Sequence[Limb], feet: FootRows, found: Runs, sunk: PerWalker
) -> tuple[Annotated[Floats, "all_frames 3"], Runs, Annotated[Floats, "walkers frames"]]:
    """Return the paths, the stances, and how much the pelvis is lowered for them (M, F), m.

    Stances whose leg does not reach are shortened.
    """
    paths = _plan_paths(feet, found)
    needs = _needs(poses, legs, feet, paths, sunk)
    for _ in range(ROUNDS):
        cancellation.check()
        beyond = two_bone.beyond(needs, np.full(needs.shape, two_bone.MOST))
        shorter = stance_rows.shortened(found, beyond, feet.rows)
        rows = stance_rows.changed_rows(found, shorter, feet.rows)
        if not len(rows):
            break
        own = np.isin(feet.rows.groups.group, rows)
        paths[own] = _plan_paths(feet.select(rows), shorter.of_rows(rows))
        needs, found = _needs(poses, legs, feet, paths, sunk), shorter
    walkers, frames = poses.positions.shape[:2]
    each = needs.reshape(walkers, len(legs), frames).swapaxes(0, 1).reshape(len(legs), -1)
    grids = _frame_rows((walkers, frames, 1), float(feet.rows.rates[0]))
    most = np.full(walkers * frames, two_bone.MOST)
    return paths, found, two_bone.lower(list(each), most, grids).reshape(walkers, frames)


def _plan_paths(feet: FootRows, found: Runs) -> Annotated[Floats, "all_frames 3"]:
    """Return the paths of feet, each at the mean of its predicted places in a stance."""
    free = np.full((len(feet.floor), 3), np.nan)
    longer = ball_path.held(feet, found, np.zeros(len(feet.floor), bool))
    return ball_path.plan_paths(feet, found, free, ball_path.mean_places(feet, longer))


def _needs(
    poses: LimbPoses,
    legs: Sequence[Limb],
    feet: FootRows,
    paths: Annotated[Floats, "all_frames 3"],
    sunk: PerWalker,
) -> Annotated[Floats, "all_frames"]:
    """Return how much lower each leg needs the pelvis to be (R F,), m."""
    frames = poses.positions.shape[1]
    moved = (paths - feet.positions).reshape(-1, frames, 3)
    changes = _walkers(moved, len(legs)) - sunk[:, None, None, None] * UP
    needs = [
        two_bone.need(poses, leg, poses.position(leg.lower) + changes[:, :, foot], sunk[:, None])
        for foot, leg in enumerate(legs)
    ]
    return _rows(np.stack(needs, axis=2)).ravel()


def _placed_legs(
    poses: LimbPoses,
    legs: Sequence[Limb],
    shift: Annotated[Floats, "walkers frames 3"],
    targets: FeetPaths,
) -> tuple[dict[int, Annotated[Floats, "walkers frames 4"]], FeetPaths]:
    """Return rotations of legs that bring feet to their targets, and where the feet come."""
    turns: dict[int, Annotated[Floats, "walkers frames 4"]] = {}
    after = np.empty(targets.shape)
    for foot, leg in enumerate(legs):
        cancellation.check()
        arm = poses.position(leg.tip) - poses.position(leg.lower)
        end = two_bone.reach(poses, leg, shift, targets[:, :, foot] - arm)
        found = two_bone.solve(poses, leg, end)
        turns |= {leg.upper: found.upper, leg.middle: found.middle, leg.lower: found.lower}
        after[:, :, foot] = poses.position(leg.upper) + shift + end + arm
    return turns, after
