"""Contact labels of captured clips: detected, or from intervals of the table of clips."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Booleans, Floats
from posefield.model_file.model_card import rounded
from posefield.motion import contact_detection, skeleton
from posefield.motion.contact_detection import CLEARANCE, LONG_SWING, FootContact
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
        {index: name for index, name in enumerate(labelled) if name in columns},
        recipe.motion.cyclic,
        recipe.motion.root == "in_place",
    )


def clip_contacts(example: Example, settings: ContactSettings) -> ClipContacts:
    """Return the contacts of one example."""
    clip = example.clip
    steps = max(2, round(RATE * clip.duration))
    shares, rate = np.linspace(0.0, 1.0, steps + 1), steps / clip.duration
    rotations, root_path = time_alignment.resample(clip, shares)
    translations = skeleton.translations(example.offsets, root_path)
    positions = skeleton.positions(clip.skeleton.parents, rotations, translations)
    paths = positions[:, list(settings.joints)]
    contacts = np.zeros(paths.shape[:2], dtype=np.bool_)
    feet = [column for column in range(len(settings.joints)) if column not in settings.columns]
    moving = settings.in_place and feet
    ground = contact_detection.ground_velocity(paths[:, feet], rate) if moving else None
    for column in feet:
        contacts[:, column] = contact_detection.detect_contacts(
            paths[:, column], rate, settings.cyclic, ground
        )
    for column, name in settings.columns.items():
        contacts[:, column] = _table_contacts(example, name, shares, settings.cyclic)
    return ClipContacts(contacts, paths[..., 1], rate)


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
    return np.stack([contacts.at(basis.invert(log, even)) for contacts, log in pairs])


def _table_contacts(
    example: Example, joint: str, shares: Annotated[Floats, "frames"], cyclic: bool
) -> Annotated[Booleans, "frames"]:
    """Return the contacts (F,) of a joint by the table, at shares (F,) of the clip."""
    # The table counts in the clip as it was cut, before its cycle was shifted.
    cut = (shares + example.shift) % 1.0 if cyclic else shares
    spans = example.contacts[joint]
    contacts = np.zeros(len(shares), dtype=np.bool_)
    for first, last in spans:
        contacts |= (cut >= first) & (cut <= last)
    if cyclic:
        contacts[-1] = contacts[0]
    return contacts


USUAL_SWING, USUAL_CLEARANCE = 0.4, 0.05
"""Seconds and metres of a swing where no joint makes a whole one in any clip."""


@dataclass(frozen=True)
class _Swings:
    """Swings of one joint in all clips.

    durations: (M,), s. lifts: (M,), m. height: median height of the joint in its contacts, m; None
    for a joint without contacts.
    """

    durations: Floats
    lifts: Floats
    height: float | None


def contact_statistics(
    clips: Sequence[ClipContacts], joints: Sequence[int], cyclic: bool
) -> tuple[FootContact | None, ...]:
    """Return the statistics of each joint; None for one that has no contact in any clip.

    A joint without a whole swing between two contacts takes the swings of all others.
    """
    swings = [_swings(clips, column, cyclic) for column in range(len(joints))]
    durations = np.concatenate([joint_swings.durations for joint_swings in swings])
    lifts = np.concatenate([joint_swings.lifts for joint_swings in swings])
    if not len(durations):
        durations, lifts = np.array([USUAL_SWING]), np.array([USUAL_CLEARANCE])
    return tuple(
        None
        if joint_swings.height is None
        else _contact(
            joint,
            joint_swings.height,
            joint_swings.durations if len(joint_swings.durations) else durations,
            joint_swings.lifts if len(joint_swings.lifts) else lifts,
        )
        for joint, joint_swings in zip(joints, swings, strict=True)
    )


def without_swings(clips: Sequence[ClipContacts], column: int, cyclic: bool) -> bool:
    """Return True if the joint at a place in the labels makes no whole swing in any clip."""
    return len(_swings(clips, column, cyclic).durations) == 0


def _contact(joint: int, height: float, durations: Floats, lifts: Floats) -> FootContact:
    return FootContact(
        joint,
        rounded(height),
        rounded(np.median(durations)),
        rounded(np.percentile(durations, LONG_SWING)),
        rounded(np.percentile(lifts, CLEARANCE)),
    )


def _swings(clips: Sequence[ClipContacts], column: int, cyclic: bool) -> _Swings:
    durations, lifts, heights = [], [], []
    for clip in clips:
        contacts, height = clip.contacts[:, column], clip.heights[:, column]
        if cyclic:
            contacts, height = contacts[:-1], height[:-1]
        if not contacts.any():
            continue
        standing = float(np.median(height[contacts]))
        heights.append(standing)
        for run in contact_detection.runs(~contacts, cyclic):
            # A swing that the clip cuts has neither its duration nor its height.
            if cyclic or (run[0] > 0 and run[-1] < len(contacts) - 1):
                durations.append(len(run) / clip.rate)
                lifts.append(max(float(height[run].max()) - standing, 0.0))
    median_height = float(np.median(heights)) if heights else None
    return _Swings(np.array(durations), np.array(lifts), median_height)
