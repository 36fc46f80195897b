"""Distances between answers, and answers half-way between two."""

from dataclasses import replace
from typing import Annotated, Any

import numpy as np

from posefield.answer_table.samples import MOVING, TURNS, Answers
from posefield.common.units import Singles
from posefield.model_file.model_card import ModelCard
from posefield.motion import curves, quat, skeleton


def gaps(card: ModelCard, one: Answers, other: Answers) -> Annotated[Singles, "points"]:
    """Return the largest distance (B,) of a joint in any frame between two sets of answers, m."""
    apart = joint_positions(card, one) - joint_positions(card, other)
    return np.asarray(np.linalg.norm(apart, axis=-1).max(axis=(1, 2)), np.float32)


def curve_gaps(card: ModelCard, one: Answers, other: Answers) -> Annotated[Singles, "points"]:
    """Return the largest difference (B,) of a curve between answers, as a share of its range.

    Zero without curves.
    """
    low, high = curves.limits(card.curves)
    shares = np.abs(one.curves - other.curves) / (high - low)
    return np.asarray(shares.max(axis=(1, 2), initial=0.0), np.float32)


def joint_positions(card: ModelCard, found: Answers) -> Singles:
    """Return the joints (B, F, J, 3) of travelling answers, m."""
    local = skeleton.translations(found.bones.astype(float), found.roots.astype(float))
    return skeleton.positions(card.skeleton.parents, found.rotations.astype(float), local).astype(
        np.float32
    )


def halved(found: Answers) -> Answers:
    """Return the answers with a frame in the middle between two, interpolated linearly."""
    first, then = _cut(found, slice(None, -1)), _cut(found, slice(1, None))
    middle = vars(midway(first, then))
    return replace(found, **{name: _merged(getattr(found, name), middle[name]) for name in MOVING})


def _cut(found: Answers, frames: slice) -> Answers:
    """Return some frames of the answers."""
    return replace(found, **{name: getattr(found, name)[:, frames] for name in MOVING})


def _merged(values: Any, between: Any) -> Any:
    """Return arrays (B, 2F - 1, ...) of frames (B, F, ...) and those between them."""
    out = np.empty((len(values), values.shape[1] + between.shape[1], *values.shape[2:]), np.float32)
    out[:, ::2], out[:, 1::2] = values, between
    return out


def midway(one: Answers, other: Answers) -> Answers:
    """Return the answers half-way between two, by linear interpolation."""
    found: dict[str, Any] = {}
    for name, first in vars(one).items():
        then = getattr(other, name)
        if name in TURNS:
            opposite = np.sum(first * then, axis=-1, keepdims=True) < 0.0
            found[name] = quat.normalize(first + np.where(opposite, -then, then))
        else:
            found[name] = 0.5 * (first + then)
    return Answers(**found)
