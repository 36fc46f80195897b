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
from posefield.common.units import UP, Booleans, Floats
from posefield.feet import limbs, pelvis, stance_rows, step_rows, two_bone
from posefield.feet.contact_estimates import DECIMALS, STANDING
from posefield.feet.footsteps import ROUNDS
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stance_rows import FootRows, Rows
from posefield.feet.stances import UNEVEN
from posefield.feet.step_rows import StepRows
from posefield.motion.foot_contacts import FootContact

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
    down = stance_rows.tidy(_rows(np.round(likely, DECIMALS) > STANDING), walkers.rate)
    feet, sunk = _grounded_feet(_rows(before), down, tuple(contacts), walkers.rate)
    steps, lowered = _reachable_steps(poses, legs, feet, stance_rows.discipline(down, feet), sunk)
    shift = -(sunk[:, None] + lowered)[..., None] * UP
    targets = _walkers(steps.positions, len(legs))
    turns, after = _placed_legs(poses, legs, shift, targets)
    standing = _walkers(steps.down, len(legs))
    away = np.linalg.norm((after - targets) * (1.0 - UP), axis=-1) * standing
    drift, most = away.max(axis=(1, 2)), lowered.max(axis=1)
    return WalkersFeet(turns, walkers.roots + shift, before, after, standing, drift, most)


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
    paths: Annotated[Floats, "rows frames 3"],
    down: Rows,
    contacts: tuple[FootContact, ...],
    rate: float,
) -> tuple[FootRows, PerWalker]:
    """Return feet whose walkers stand on the floor, and how far each walker is lowered (M,), m."""
    captured = np.tile([own.height for own in contacts], len(paths) // len(contacts))
    above = _median_heights(paths @ UP, down, captured) - captured
    mean = above.reshape(-1, len(contacts)).mean(axis=1)
    sunk = np.sign(mean) * np.maximum(np.abs(mean) - UNEVEN, 0.0)
    own = np.repeat(sunk, len(contacts))
    height = captured + np.clip(above - own, -UNEVEN, UNEVEN)
    grounded = paths - own[:, None, None] * UP
    return stance_rows.foot_rows(grounded, rate, contacts, height), sunk


def _median_heights(
    heights: Annotated[Floats, "rows frames"], down: Rows, usual: Annotated[Floats, "rows"]
) -> Annotated[Floats, "rows"]:
    """Return the median heights (R,), m, of feet that stand; the usual ones of others."""
    ordered = np.sort(np.where(down, heights, np.inf), axis=1)
    count, rows = down.sum(axis=1), np.arange(len(down))
    low, high = ordered[rows, np.maximum(count - 1, 0) // 2], ordered[rows, count // 2]
    return np.where(count > 0, 0.5 * (low + high), usual)


def _reachable_steps(
    poses: LimbPoses, legs: Sequence[Limb], feet: FootRows, down: Rows, sunk: PerWalker
) -> tuple[StepRows, Annotated[Floats, "walkers frames"]]:
    """Return the steps, and how much the pelvis is lowered for them (M, F), m.

    Stances whose leg does not reach are shortened.
    """
    steps = step_rows.plan_paths(feet, down)
    for _ in range(ROUNDS):
        cancellation.check()
        needs = _needs(poses, legs, feet, steps, sunk)
        beyond = pelvis.beyond(needs, np.full(needs.shape, pelvis.MOST))
        shorter = stance_rows.shortened(steps.down, beyond, feet.rate)
        changed = np.flatnonzero((shorter != steps.down).any(axis=1))
        if not len(changed):
            break
        again = step_rows.plan_paths(feet.select(changed), shorter[changed])
        steps.positions[changed], steps.down[changed] = again.positions, again.down
    else:
        needs = _needs(poses, legs, feet, steps, sunk)
    own = list(_walkers(needs, len(legs)).transpose(2, 0, 1))
    most = np.full(own[0].shape, pelvis.MOST)
    return steps, pelvis.lower(own, most, feet.rate, False)


def _needs(
    poses: LimbPoses, legs: Sequence[Limb], feet: FootRows, steps: StepRows, sunk: PerWalker
) -> Annotated[Floats, "rows frames"]:
    """Return how much lower each leg needs the pelvis to be (R, F), m."""
    changes = _walkers(steps.positions - feet.positions, len(legs)) - sunk[:, None, None, None] * UP
    needs = [
        pelvis.need(poses, leg, poses.position(leg.lower) + changes[:, :, foot], sunk[:, None])
        for foot, leg in enumerate(legs)
    ]
    return _rows(np.stack(needs, axis=2))


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
