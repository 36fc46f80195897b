"""Long takes of a folder: joints with a role, in leg lengths, with Y up."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from posefield.common.errors import FileError, MotionFileError
from posefield.common.units import Floats, UpAxis
from posefield.motion import skeleton
from posefield.roles.joint_recognition import RoleGuess
from posefield_train.probe import figure, proposals
from posefield_train.source import motion_readers
from posefield_train.source.motion_files import clip_conversion
from posefield_train.source.motion_files.motion_file import MotionFile, ReadOptions

LEG = ("UpperLeg", "LowerLeg", "Foot")
SEARCHED = frozenset(
    {"hips", "neck", "head"}
    | {
        side + role
        for side in ("left", "right")
        for role in (*LEG, "Toes", "UpperArm", "LowerArm", "Hand")
    }
)
"""Roles whose places are kept."""
NEEDED = ("hips", *(side + role for side in ("left", "right") for role in LEG))
"""Roles without which a take cannot be searched."""
MOST_FRAMES = 5_000_000
"""Frames of all takes together, which take 2 GB: eleven hours at 120 frames a second."""
MOST_FIGURES = 50
"""Bodies of one kind that tell the up axis."""


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


@dataclass(frozen=True)
class Stated:
    """Statements about all files.

    up: axis; None for that which each file or body tells. roles: joints by role, which count more
    than those that are recognised. rate: frames a second of files that state none.
    """

    up: UpAxis | None = None
    roles: Mapping[str, str] = field(default_factory=dict)
    rate: float | None = None


def read_takes(
    folder: Path, stated: Stated | None = None, report: Callable[[int], None] = lambda _: None
) -> ReadTakes:
    """Return the takes of all motion files below a folder.

    report: called with the number of files that are read. A file that cannot be read or searched is
    refused with its reason; FileError if none is left.
    """
    if not folder.is_dir():
        raise FileError(folder, "not a folder, expected one with motion files")
    bodies, refused, frames = [], dict[str, str](), 0
    known = stated or Stated()
    for count, path in enumerate(motion_readers.find_files(folder), 1):
        name = path.relative_to(folder).as_posix()
        try:
            file = motion_readers.read(path, ReadOptions(rate=known.rate))
            bodies.append(_body(name, file, known))
            frames += len(bodies[-1].take)
        except (MotionFileError, UnusableTake) as fault:
            refused[name] = str(fault)
        if frames > MOST_FRAMES:
            raise FileError(
                folder,
                f"found more than {MOST_FRAMES} frames, expected a smaller part of the files",
            )
        report(count)
    takes = _turned(bodies, known.up, refused)
    if not takes:
        first = next(iter(refused.items()), None)
        said = f"such as {first[0]}: {first[1]}" if first else "it has no motion files"
        raise FileError(folder, f"no take that can be searched; {said}")
    return ReadTakes(tuple(takes), refused)


class UnusableTake(ValueError):
    """A take that is read, but cannot be searched."""


@dataclass(frozen=True)
class Body:
    """A take before its up axis is known. joints: names of all, which bodies of one kind share.
    figure: its measurements, without the frames of the file.
    """

    take: Take
    joints: tuple[str, ...]
    figure: figure.Figure


def _body(name: str, file: MotionFile, stated: Stated) -> Body:
    if file.rate is None:
        raise UnusableTake(f"{file.format} states no frame rate: say it with --rate")
    measured = _with_roles(figure.measure(file), stated.roles)
    lacking = _lacking(measured)
    if lacking:
        raise UnusableTake(
            f"no joint for {', '.join(lacking)}, expected a body with two legs; roles can be stated"
        )
    leg = measured.leg_length()
    if not leg:
        raise UnusableTake("the legs have no length, expected bones from hip to foot")
    joints = file.skeleton
    positions = skeleton.positions(joints.parents, file.rotations, file.translations)
    index = {joint: at for at, joint in enumerate(joints.names)}
    places = {
        role: positions[:, index[joint]] / leg
        for role, joint in measured.sure_roles.items()
        if role in SEARCHED
    }
    first = replace(file, rotations=file.rotations[:1], translations=file.translations[:1])
    light = replace(measured, file=first)
    return Body(Take(name, file.rate, places), tuple(measured.names), light)


def _turned(bodies: list[Body], up: UpAxis | None, refused: dict[str, str]) -> list[Take]:
    """Return the takes with Y up, which those of one kind of body have in common.

    Takes whose up axis is unclear are added to those that were refused.
    """
    axes: dict[tuple[str, ...], UpAxis | None] = {}
    reasons: dict[tuple[str, ...], str] = {}
    found = []
    for body in bodies:
        if body.joints not in axes:
            alike = [other.figure for other in bodies if other.joints == body.joints]
            proposal = proposals.propose_up(alike[:MOST_FIGURES])
            clear = proposal.confidence != "low"
            axes[body.joints] = up or (proposal.value if clear else None)
            reasons[body.joints] = "; ".join(proposal.evidence)
        axis = axes[body.joints]
        if axis is None:
            said = f"its up axis is unclear ({reasons[body.joints]}): say it with --up"
            refused[body.take.file] = said
            continue
        places = {r: clip_conversion.to_y_up(own, axis) for r, own in body.take.places.items()}
        found.append(replace(body.take, places=places))
    return found


def _with_roles(measured: figure.Figure, roles: Mapping[str, str]) -> figure.Figure:
    """Return the figure with stated roles in place of those that were recognised."""
    unknown = sorted(set(roles.values()) - set(measured.names))
    if unknown:
        raise UnusableTake(f"no joint {', '.join(map(repr, unknown))}, which the roles name")
    certain = {role: RoleGuess(joint, 1.0) for role, joint in roles.items()}
    others = {r: g for r, g in measured.guesses.items() if g.joint not in roles.values()}
    return replace(measured, guesses=others | certain)


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
