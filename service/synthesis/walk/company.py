"""Crowds of walkers: the door, and motions that are made as they are asked for."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from service.motion import blend
from service.motion.card import ModelCard
from service.motion.conventions import Indices
from service.motion.crowd import CrowdClip, Motions, Placement
from service.motion.errors import InvalidField
from service.synthesis.session import Session
from service.synthesis.walk import given, march, plane, stride, wander
from service.synthesis.walk.detail import Detail
from service.synthesis.walk.gait import Gait
from service.synthesis.walk.given import Route
from service.synthesis.walk.march import Plan
from service.synthesis.walk.stride import Poses

# Motions that are made at a time: a few megabytes of poses for ten seconds.
TOGETHER = 50


# Poses that one plan may be of: its own numbers take some hundred bytes each.
MOST_POSES = 20_000_000
# Ways are planned every so often, s, however few frames there are of them.
PLANNED = 0.05
LARGEST_SEED = 2**63
Pairs = tuple[Indices, Indices]
"""Characters (K,) and frames (K,)."""
RATES = (1.0, 1000.0)


def wandering(gait: Gait, count: int, seconds: float, rate: float, seed: int) -> Plan:
    """Plan of characters that wander, each on a way of its own.

    Raises InvalidField for numbers that no crowd can be made of.
    """
    frames = _frames(count, seconds, rate, seed)
    characters = wander.cast(gait, count, seed)
    ways = wander.paths(gait, characters, seconds)
    return march.follow(gait, ways, characters.who, characters.phases, frames, rate)


def following(gait: Gait, routes: Sequence[Route], seconds: float, rate: float, seed: int) -> Plan:
    """Plan of characters that follow routes; the seed says who they are and in which phase.

    Raises InvalidField as `wandering` and `given.through` do, and for a route that ends too soon.
    """
    frames = _frames(len(routes), seconds, rate, seed)
    characters = wander.cast(gait, len(routes), seed)
    ways = given.through(gait, routes)
    return march.follow(gait, ways, characters.who, characters.phases, frames, rate)


def _frames(count: int, seconds: float, rate: float, seed: int) -> int:
    if count < 1:
        raise InvalidField("count", f"{count}, expected at least 1 character")
    if not 0 <= seed < LARGEST_SEED:
        raise InvalidField("seed", f"{seed}, expected 0 to less than {LARGEST_SEED}")
    if not RATES[0] <= rate <= RATES[1]:
        raise InvalidField("fps", f"{rate:g}, expected {RATES[0]:g} to {RATES[1]:g}")
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InvalidField("seconds", f"{seconds:g}, expected a time above 0")
    most = poses(count, seconds, rate)
    if most > MOST_POSES:
        raise InvalidField("count", f"{most:.3g} poses, expected {MOST_POSES} at most")
    # A millionth of a frame forgives the rounding of seconds * rate.
    return math.floor(seconds * rate + 1e-6) + 1


def poses(count: int, seconds: float, rate: float) -> float:
    """How many poses a crowd is of, or what as many take to plan where its frames are few."""
    return count * (seconds * max(rate, 1.0 / PLANNED) + 1.0)


def crowd(session: Session, plan: Plan, shown: Detail) -> CrowdClip:
    """Crowd of a plan, each character with a motion of its own, in the frame that it begins in."""
    characters, frames = plan.phases.shape
    return CrowdClip(
        session.card.skeleton,
        plan.rate,
        frames,
        Placement(plan.roots[:, 0], plan.headings[:, 0]),
        np.arange(characters),
        _batches(session, plan.at_home(), shown),
        {**_facts(session, plan), "level_shares": _shares(session, shown)},
    )


def sharing(session: Session, plan: Plan, shown: Detail, stands: Placement) -> CrowdClip:
    """Crowd of more characters than a plan has, who stand at places of their own and take turns
    with its motions."""
    one_each = crowd(session, plan, shown)
    return replace(one_each, placement=stands, motion=np.arange(len(stands)) % len(plan.who))


def _facts(session: Session, plan: Plan) -> dict[str, Any]:
    card = session.card
    return {
        "model": f"{card.name}@{session.digest}",
        "performers": [card.performers[who] if who >= 0 else None for who in plan.who],
        "outside_share": _outside(card, plan),
    }


def _shares(session: Session, shown: Detail) -> list[float]:
    """Share of the poses that is shown at each level."""
    counts = np.bincount(shown.levels.ravel(), minlength=len(session.card.levels))
    return [float(f"{share:.4g}") for share in counts / shown.levels.size]


def _outside(card: ModelCard, plan: Plan) -> float:
    """Share of the poses with some control outside its sampled range."""
    low, high = [c.minimum for c in card.controls], [c.maximum for c in card.controls]
    return float(np.mean(np.any((plan.controls < low) | (plan.controls > high), axis=-1)))


def _batches(session: Session, plan: Plan, shown: Detail) -> Iterator[Motions]:
    for first in range(0, len(plan.who), TOGETHER):
        who = np.arange(first, min(first + TOGETHER, len(plan.who)))
        yield motions(session, plan, who, shown.of(who))


def motions(session: Session, plan: Plan, who: Indices, shown: Detail) -> Motions:
    """Motions of some characters (M,), where the plan has them, at the levels of their own."""
    shape = (len(who), plan.phases.shape[1])
    pairs = np.meshgrid(who, range(shape[1]), indexing="ij")
    posed = _posed(session, plan, (pairs[0].ravel(), pairs[1].ravel()), shown)
    roots = plane.at_height(posed.places, posed.heights).astype(np.float32)
    # A character's bones do not grow as it speeds up: they are those of its mean controls.
    usual = plan.controls[who].mean(axis=1)
    bones = stride.bones(session, usual, stride.labels(session, plan.who[who]))
    return Motions(
        posed.rotations.astype(np.float32).reshape(*shape, *posed.rotations.shape[1:]),
        roots.reshape(*shape, 3),
        bones,
        shown.levels,
    )


def _posed(session: Session, plan: Plan, pairs: Pairs, shown: Detail) -> Poses:
    """Poses of pairs of characters and frames, mixed where they are between two levels."""
    after, shares = _at_levels(session, plan, pairs, shown.levels.ravel()), shown.shares.ravel()
    between = np.flatnonzero(shares < 1.0)
    if len(between):
        some = pairs[0][between], pairs[1][between]
        before = _at_levels(session, plan, some, shown.before.ravel()[between])
        for name, whole in vars(after).items():
            mix = blend.rotations if name == "rotations" else blend.straight
            whole[between] = mix(getattr(before, name), whole[between], shares[between])
    return after


def _at_levels(session: Session, plan: Plan, pairs: Pairs, levels: Indices) -> Poses:
    joints, count = len(session.card.skeleton), len(levels)
    poses = Poses(np.empty((count, joints, 4)), np.empty(count), np.empty(count, dtype=complex))
    for level in np.unique(levels).tolist():
        rows = np.flatnonzero(levels == level)
        own = march.pose(session, plan, pairs[0][rows], pairs[1][rows], level)
        for name, whole in vars(poses).items():
            whole[rows] = getattr(own, name)
    return poses
