"""Takes that are copies of one recording: whole, cut, mirrored, or continued in another file.

Clips of a take and of its copy tell each other, so that they have to be left out together.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.array_shapes import Positions
from posefield.common.units import Floats
from posefield_train.probe.figure import ADULT_LEG
from posefield_train.source import take_groups

COMPARED = (
    "hips",
    "head",
    "leftLowerLeg",
    "rightLowerLeg",
    "leftFoot",
    "rightFoot",
    "leftLowerArm",
    "rightLowerArm",
    "leftHand",
    "rightHand",
)
"""Roles whose places are compared, as far as all takes have them."""


@dataclass(frozen=True)
class TakeCopy:
    """A take of a recording that another file begins. recording: the first file. note: why."""

    recording: str
    note: str


def find_copies(
    files: Sequence[str], places: Sequence[Mapping[str, Floats]]
) -> dict[str, TakeCopy]:
    """Return the takes that are copies, by file.

    files: of the takes. places: positions (F, 3) by role of each, leg lengths, Y up.
    """
    if len(files) < 2:
        return {}
    known = [role for role in COMPARED if all(role in own for own in places)]
    roles = [role for role in known if _counterpart(role) in known]
    motions = [_motion(own, roles) for own in places]
    swapped = tuple(roles.index(_counterpart(role)) for role in roles)
    pairs = take_groups.find_pairs(motions, swapped)
    recordings = take_groups.connected(files, pairs)
    notes: dict[str, str] = {}
    # Relations to the recording itself come first.
    named = {files.index(file) for file in recordings}
    for pair in sorted(pairs, key=lambda own: not {own.first, own.second} & named):
        said = f"{files[pair.second]} {pair.relation} {files[pair.first]}"
        for at in (pair.first, pair.second):
            if files[at] != recordings[at]:
                notes.setdefault(files[at], f"{said}: both are one take")
    copies = dict(zip(files, recordings, strict=True))
    return {file: TakeCopy(copies[file], note) for file, note in notes.items()}


def _motion(places: Mapping[str, Floats], roles: Sequence[str]) -> Positions:
    """Return positions (F, J, 3) of an adult of the usual size, m."""
    return np.stack([ADULT_LEG * places[role] for role in roles], axis=1)


def _counterpart(role: str) -> str:
    """Return the role on the other side; the role itself in the middle of the body."""
    for side, other in (("left", "right"), ("right", "left")):
        if role.startswith(side):
            return other + role.removeprefix(side)
    return role
