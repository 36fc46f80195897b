"""Contact labels of captured clips: detected, or from intervals of the table of clips."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Booleans, Floats
from posefield.motion import contact_detection, skeleton
from posefield_train.align import time_alignment
from posefield_train.align.warp import WarpBasis
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

RATE = 120.0
"""Frames a second at which contacts are detected."""


@dataclass(frozen=True)
class ClipContacts:
    """Contacts of one clip in its own time.

    contacts: (F, K), True in contact. heights: (F, K) of the joints, m. rate: frames a second,
    near RATE.
    """

    contacts: Annotated[Booleans, "frames joints"]
    heights: Annotated[Floats, "frames joints"]
    rate: float

    def at(self, shares: Annotated[Floats, "asked"]) -> Annotated[Floats, "asked joints"]:
        """Return labels (S, K), 0 or 1, at shares (S,) of the clip's duration."""
        frames = np.rint(np.clip(shares, 0.0, 1.0) * (len(self.contacts) - 1)).astype(np.int64)
        return self.contacts[frames].astype(np.float64)


@dataclass(frozen=True)
class ContactSettings:
    """Settings of the labels.

    joints: indices of the labelled joints. columns: name of a joint by its position in `joints`,
    where the table has its contacts; all others are detected. cyclic, in_place: of the motion.
    """

    joints: tuple[int, ...]
    columns: dict[int, str]
    cyclic: bool
    in_place: bool


def settings(recipe: Recipe, names: Sequence[str]) -> ContactSettings:
    """Return the settings of a recipe; names: of the skeleton's joints."""
    columns = recipe.contacts.columns
    labelled = [*recipe.motion.feet, *(name for name in columns if name not in recipe.motion.feet)]
    return ContactSettings(
        tuple(map(names.index, labelled)),
        {place: name for place, name in enumerate(labelled) if name in columns},
        recipe.motion.cyclic,
        recipe.motion.root == "in_place",
    )


def clip_contacts(example: Example, asked: ContactSettings) -> ClipContacts:
    """Return the contacts of one example."""
    clip = example.clip
    steps = max(2, round(RATE * clip.duration))
    shares, rate = np.linspace(0.0, 1.0, steps + 1), steps / clip.duration
    rotations, root_path = time_alignment.resample(clip, shares)
    translations = skeleton.translations(example.offsets, root_path)
    positions = skeleton.positions(clip.skeleton.parents, rotations, translations)
    paths = positions[:, list(asked.joints)]
    found = np.zeros(paths.shape[:2], dtype=np.bool_)
    feet = [place for place in range(len(asked.joints)) if place not in asked.columns]
    moving = asked.in_place and feet
    ground = contact_detection.ground_velocity(paths[:, feet], rate) if moving else None
    for place in feet:
        found[:, place] = contact_detection.detect_contacts(
            paths[:, place], rate, asked.cyclic, ground
        )
    for place, name in asked.columns.items():
        found[:, place] = _table_contacts(example, name, shares, asked.cyclic)
    return ClipContacts(found, paths[..., 1], rate)


def canonical_labels(
    clips: Sequence[ClipContacts],
    logs: Annotated[Floats, "clips knots"],
    basis: WarpBasis,
    frames: int,
) -> Annotated[Floats, "clips {frames} joints"]:
    """Return the labels (N, T, K) of clips at canonical frames.

    logs: log increments (N, knots) of the clips' warps.
    """
    even = np.linspace(0.0, 1.0, frames)
    pairs = zip(clips, logs, strict=True)
    return np.stack([own.at(basis.invert(log, even)) for own, log in pairs])


def _table_contacts(
    example: Example, joint: str, shares: Annotated[Floats, "frames"], cyclic: bool
) -> Annotated[Booleans, "frames"]:
    """Return the contacts (F,) of a joint by the table, at shares (F,) of the clip."""
    # The table counts in the clip as it was cut, before its cycle was shifted.
    cut = (shares + example.shift) % 1.0 if cyclic else shares
    spans = example.contacts[joint]
    found = np.zeros(len(shares), dtype=np.bool_)
    for first, last in spans:
        found |= (cut >= first) & (cut <= last)
    if cyclic:
        found[-1] = found[0]
    return found
