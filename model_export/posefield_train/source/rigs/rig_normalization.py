"""Normalization of the skeletons of a family: dummy roots, stretch, rest pose, facing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.motion.clip import Clip
from posefield_train.source.rigs import bone_stretch, dummy_roots, facing, rest_pose
from posefield_train.source.rigs.facing import Facing, FacingError


@dataclass(frozen=True)
class RigSettings:
    """Settings of a recipe.

    stretches: bones may stretch. directed: controls depend on the facing. named: joints that the
    recipe names.
    """

    facing: Facing | None
    stretches: bool
    cyclic: bool
    directed: bool
    roles: Mapping[str, str]
    named: frozenset[str]


class RigError(ValueError):
    """A skeleton that cannot be trained; clip: index of a clip that shows it."""

    def __init__(self, message: str, clip: int = 0) -> None:
        super().__init__(message)
        self.clip = clip


@dataclass(frozen=True)
class RiggedClips:
    """Clips in the basis of their facing, without dummy roots.

    facing: degrees to the left of the root's +z; None for a family without a facing.
    """

    clips: tuple[Clip, ...]
    facing: float | None
    notes: tuple[str, ...]


def normalize(
    clips: Sequence[Clip], performers: Sequence[str], files: Sequence[str], settings: RigSettings
) -> RiggedClips:
    """Return the clips of one skeleton, normalized.

    performers, files: names by clip. Raises RigError for a rest pose without extent, bones that
    stretch, two bodies under one name, and a facing that the motion contradicts.
    """
    names = clips[0].skeleton.names
    count = dummy_roots.count_dummies(clips)
    gone = settings.named & set(names[:count])
    if gone:
        raise RigError(
            f"the recipe names {', '.join(map(repr, sorted(gone)))}, but "
            f"{dummy_roots.describe(names, count)}: name {names[count]!r} instead"
        )
    notes = [dummy_roots.describe(names, count)] if count else []
    clips = [dummy_roots.collapse_roots(clip, count) for clip in clips]
    _check_bones(clips, performers, files, settings.stretches)
    try:
        found = facing.find_facing(clips, settings.facing, settings.roles, settings.cyclic)
    except FacingError as fault:
        raise RigError(str(fault), fault.clip) from fault
    turned = tuple(facing.turn_basis(clip, found.degrees or 0.0) for clip in clips)
    if settings.facing or settings.directed:
        notes += found.notes
    return RiggedClips(turned, found.degrees, tuple(notes))


def _check_bones(
    clips: Sequence[Clip], performers: Sequence[str], files: Sequence[str], stretches: bool
) -> None:
    """Raise RigError for degenerate rest poses, stretch, and two bodies under one name."""
    offsets = np.stack([clip.translations.mean(axis=0) for clip in clips])
    offsets[:, 0] = 0.0
    for index, own in enumerate(offsets):
        if rest_pose.is_degenerate(own):
            raise RigError(
                f"the rest pose is degenerate: all {len(own)} joints lie in one point, expected "
                "bones with a length",
                index,
            )
    stretch = None if stretches else bone_stretch.find_stretch(clips)
    if stretch:
        raise RigError(stretch.sentence(clips[0].skeleton), stretch.clip)
    bodies = rest_pose.find_two_bodies(offsets, performers)
    if bodies:
        raise RigError(bodies.sentence(files), bodies.second)
