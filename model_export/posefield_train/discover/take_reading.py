"""Long takes of a folder: joints with a role, in leg lengths, with Y up."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from posefield.common.errors import BvhError, FileError
from posefield.common.units import Floats, UpAxis
from posefield.motion import skeleton
from posefield_train.probe import figure, proposals
from posefield_train.source import bvh
from posefield_train.source.bvh import bvh_conversion


LEG = ("UpperLeg", "LowerLeg", "Foot")
NEEDED = ("hips", *(side + role for side in ("left", "right") for role in LEG))
"""Roles without which a take cannot be searched."""


@dataclass(frozen=True)
class Take:
    """A motion file as recorded.

    file: its path below the folder. rate: frames a second. places: positions (F, 3) by role, in
    leg lengths, Y up.
    """

    file: str
    rate: float
    places: dict[str, Floats]

    def __len__(self) -> int:
        return len(self.places["hips"])

    def across(self, role: str) -> Floats:
        """Return the vectors (F, 3) from the right to the left joint of a role."""
        return np.asarray(self.places[f"left{role}"] - self.places[f"right{role}"])

    def headings(self) -> Floats:
        """Return the angles (F,) to which the hips face, rad, to the left of +z, unwrapped."""
        across = self.across("UpperLeg")
        # Forward is left turned by a quarter: x to z, and z to -x.
        return np.unwrap(np.arctan2(-across[:, 2], across[:, 0]))


@dataclass(frozen=True)
class ReadTakes:
    """Takes of a folder in the order of their names, and the files that were left out.

    refused: reason by file.
    """

    takes: tuple[Take, ...]
    refused: dict[str, str]


def read_takes(
    folder: Path, up: UpAxis | None = None, report: Callable[[int], None] = lambda _: None
) -> ReadTakes:
    """Return the takes of all BVH files below a folder.

    up: axis of all files; None for that which each file's body tells. report: called with the
    number of files that are read. A file that cannot be read or searched is refused with its
    reason; FileError if none is left.
    """
    if not folder.is_dir():
        raise FileError(folder, "not a folder, expected one with BVH files")
    takes, refused = [], dict[str, str]()
    files = motion_files(folder)
    for count, path in enumerate(files, 1):
        name = path.relative_to(folder).as_posix()
        try:
            takes.append(_take(name, bvh.read(path), up))
        except (BvhError, UnusableTake) as fault:
            refused[name] = str(fault)
        report(count)
    if not takes:
        first = next(iter(refused.items()), None)
        said = f"such as {first[0]}: {first[1]}" if first else "it has no BVH files"
        raise FileError(folder, f"no take that can be searched; {said}")
    return ReadTakes(tuple(takes), refused)


def motion_files(folder: Path) -> list[Path]:
    """Return the motion files below a folder, sorted by name."""
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() == ".bvh")


class UnusableTake(ValueError):
    """A take that is read, but cannot be searched."""


def _take(name: str, file: bvh.BvhFile, up: UpAxis | None) -> Take:
    measured = figure.measure(file)
    lacking = _lacking(measured)
    if lacking:
        raise UnusableTake(f"no joint for {', '.join(lacking)}, expected a body with two legs")
    axis = up or _up(measured)
    leg = measured.leg_length()
    if not leg:
        raise UnusableTake("the legs have no length, expected bones from hip to foot")
    rotations, translations = bvh_conversion.local_motion(file)
    parents = tuple(joint.parent for joint in file.joints)
    positions = skeleton.positions(parents, rotations, translations)
    index = {joint.name: at for at, joint in enumerate(file.joints)}
    places = {
        role: bvh_conversion.to_y_up(positions[:, index[joint]], axis) / leg
        for role, joint in measured.sure_roles.items()
    }
    return Take(name, file.rate, places)


def _lacking(measured: figure.Figure) -> list[str]:
    """Return each needed role without a joint that is sure, with the reason."""
    found = []
    for role in NEEDED:
        guess = measured.guesses.get(role)
        if guess is None:
            found.append(role)
        elif not guess.is_sure:
            found.append(f"{role} ({guess.joint}? {'; '.join(guess.reasons)})")
    return found


def _up(measured: figure.Figure) -> UpAxis:
    proposal = proposals.propose_up([measured])
    if proposal.value is None or proposal.confidence == "low":
        evidence = "; ".join(proposal.evidence)
        raise UnusableTake(f"its up axis is unclear ({evidence}): say it with --up")
    axis: UpAxis = proposal.value
    return axis

