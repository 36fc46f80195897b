"""Crowds of walkers: the door, and motions that are made as they are asked for."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from service.motion.card import ModelCard
from service.motion.conventions import Indices
from service.motion.crowd import CrowdClip, Motions, Placement
from service.motion.errors import InvalidField
from service.synthesis.session import Session
from service.synthesis.walk import given, march, plane, stride, wander
from service.synthesis.walk.gait import Gait
from service.synthesis.walk.given import Route
from service.synthesis.walk.march import Plan

# Motions that are made at a time: a few megabytes of poses for ten seconds.
TOGETHER = 50


# Poses that one plan may be of: its own numbers take some hundred bytes each.
MOST_POSES = 50_000_000
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
    if seed < 0:
        raise InvalidField("seed", f"{seed}, expected at least 0")
    if not RATES[0] <= rate <= RATES[1]:
        raise InvalidField("fps", f"{rate:g}, expected {RATES[0]:g} to {RATES[1]:g}")
    if not (math.isfinite(seconds) and seconds > 0.0):
        raise InvalidField("seconds", f"{seconds:g}, expected a time above 0")
    # A millionth of a frame forgives the rounding of seconds * rate.
    frames = math.floor(seconds * rate + 1e-6) + 1
    if count * frames > MOST_POSES:
        raise InvalidField(
            "count", f"{count} characters of {frames} frames, expected {MOST_POSES} poses at most"
        )
    return frames


def crowd(session: Session, plan: Plan) -> CrowdClip:
    """Crowd of a plan, each character with a motion of its own, in the frame that it begins in."""
    characters, frames = plan.phases.shape
    return CrowdClip(
        session.card.skeleton,
        plan.rate,
        frames,
        Placement(plan.roots[:, 0], plan.headings[:, 0]),
        np.arange(characters),
        _batches(session, plan.at_home()),
        _facts(session, plan),
    )


def _facts(session: Session, plan: Plan) -> dict[str, Any]:
    card = session.card
    return {
        "model": f"{card.name}@{session.digest}",
        "performers": [card.performers[who] if who >= 0 else None for who in plan.who],
        "outside_share": _outside(card, plan),
    }


def _outside(card: ModelCard, plan: Plan) -> float:
    """Share of the poses with some control outside its sampled range."""
    low, high = [c.minimum for c in card.controls], [c.maximum for c in card.controls]
    return float(np.mean(np.any((plan.controls < low) | (plan.controls > high), axis=-1)))


def _batches(session: Session, plan: Plan) -> Iterator[Motions]:
    for first in range(0, len(plan.who), TOGETHER):
        yield motions(session, plan, np.arange(first, min(first + TOGETHER, len(plan.who))))


def motions(session: Session, plan: Plan, who: Indices) -> Motions:
    """Motions of some characters (M,) at the finest level, where the plan has them."""
    shape = (len(who), plan.phases.shape[1])
    everyone, frames = (pairs.ravel() for pairs in np.meshgrid(who, range(shape[1]), indexing="ij"))
    posed = march.pose(session, plan, everyone, frames)
    roots = plane.at_height(posed.places, posed.heights).astype(np.float32)
    # A character's bones do not grow as it speeds up: they are those of its mean controls.
    usual = plan.controls[who].mean(axis=1)
    bones = stride.bones(session, usual, stride.labels(session, plan.who[who]))
    return Motions(
        posed.rotations.astype(np.float32).reshape(*shape, *posed.rotations.shape[1:]),
        roots.reshape(*shape, 3),
        bones,
        np.zeros(shape, dtype=np.int64),
    )
