"""Long recordings of a folder: joints with a role, in leg lengths, with Y up."""

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, pairwise
from pathlib import Path, PurePosixPath

import numpy as np

from posefield.common.errors import FileError
from posefield.common.units import Floats, Positions, UpAxis
from posefield.motion import skeleton
from posefield.roles.joint_recognition import NEEDED, RoleGuess
from posefield_train.probe import proposals
from posefield_train.probe.proposals import MOST_WHOLE, Proposal
from posefield_train.source import frame_faults, motion_file, motion_readers, recording_groups
from posefield_train.source.frame_faults import NO_FAULTS, FrameFaults
from posefield_train.source.motion_file import MotionFile, ReadOptions
from posefield_train.source.motion_readers import MotionFiles
from posefield_train.source.skeleton_checks import ADULT_LEG, OTHER_UNIT

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
"""Roles whose places are compared, as far as all recordings have them."""


def find_copies(
    files: Sequence[str], positions: Sequence[Mapping[str, Floats]]
) -> dict[str, tuple[str, str]]:
    """Return the original of each recording that is a copy, and why it is one, by file.

    files: of the recordings. positions: (F, 3) by role of each, leg lengths, Y up.
    """
    if len(files) < 2:
        return {}
    shared = [role for role in COMPARED if all(role in by_role for by_role in positions)]
    roles = [role for role in shared if _counterpart(role) in shared]
    motions = [_motion(by_role, roles) for by_role in positions]
    swapped = tuple(roles.index(_counterpart(role)) for role in roles)
    pairs = recording_groups.find_pairs(motions, swapped)
    originals = recording_groups.connected(files, pairs)
    notes: dict[str, str] = {}
    # Relations to the original itself come first.
    original_indices = {files.index(file) for file in originals}
    for pair in sorted(
        pairs, key=lambda by_role: not {by_role.first, by_role.second} & original_indices
    ):
        relation = f"{files[pair.second]} {pair.relation} {files[pair.first]}"
        for at in (pair.first, pair.second):
            if files[at] != originals[at]:
                notes.setdefault(files[at], f"{relation}: both are one recording")
    copies = dict(zip(files, originals, strict=True))
    return {file: (copies[file], note) for file, note in notes.items()}


def _motion(positions: Mapping[str, Floats], roles: Sequence[str]) -> Positions:
    """Return positions (F, J, 3) of an adult of the usual size, m."""
    return np.stack([ADULT_LEG * positions[role] for role in roles], axis=1)


def _counterpart(role: str) -> str:
    for side, other in (("left", "right"), ("right", "left")):
        if role.startswith(side):
            return other + role.removeprefix(side)
    return role


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
MOST_FRAMES = 5_000_000
"""Frames of all recordings together, which take 2 GB: eleven hours at 120 frames a second."""
FEWEST_FRAMES = 2


@dataclass(frozen=True)
class Recording:
    """A motion file as recorded.

    file: its path below the folder. rate: frames a second. places: positions (F, 3) by role, in
    leg lengths, Y up; a rest pose before the motion is replaced by the frame after it. faults: of
    the frames. copy_of: file of the first recording of the same motion; None for an original.
    """

    file: str
    rate: float
    places: dict[str, Floats]
    faults: FrameFaults = NO_FAULTS
    copy_of: str | None = None

    def __len__(self) -> int:
        return len(self.places["hips"])

    @property
    def original(self) -> str:
        """Return the file of which this one is a copy, or itself."""
        return self.copy_of or self.file

    @property
    def original_name(self) -> str:
        """Return the name of the original, its file without the ending."""
        return PurePosixPath(self.original).with_suffix("").as_posix()

    @property
    def first(self) -> int:
        """Return the first frame of the motion."""
        return int(self.faults.rests_first)

    def is_whole(self, first: int, last: int) -> bool:
        """Return whether no joint leaps between two frames."""
        return not any(first <= leap.frame < last for leap in self.faults.leaps)

    def across(self, role: str) -> Floats:
        """Return the vectors (F, 3) from the right to the left joint of a role."""
        return np.asarray(self.places[f"left{role}"] - self.places[f"right{role}"])

    def headings(self) -> Floats:
        """Return the angles (F,) to which the hips face, rad, to the left of +z, unwrapped."""
        across = self.across("UpperLeg")
        # Forward is left turned by a quarter: x to z, and z to -x.
        return np.unwrap(np.arctan2(-across[:, 2], across[:, 0]))


@dataclass(frozen=True)
class ReadRecordings:
    """Recordings of a folder in the order of their names, and the files that were left out.

    refused: reason by file. notes: by file, on frames that were left out, and on copies. figures:
    of the recordings' bodies, by file.
    """

    recordings: tuple[Recording, ...]
    refused: dict[str, str]
    notes: dict[str, list[str]]
    figures: dict[str, proposals.Figure]


@dataclass(frozen=True)
class FileStatements:
    """Statements about all files, which count more than what is proposed.

    metres_per_unit, up: None for what the files or bodies tell. roles: joints by role, which count
    more than those that are recognised. rate: frames a second of files that state none.
    """

    metres_per_unit: float | None = None
    up: UpAxis | None = None
    roles: Mapping[str, str] = field(default_factory=dict)
    rate: float | None = None


def read_recordings(
    folder: Path,
    stated: FileStatements | None = None,
    report: Callable[[int], None] = lambda _: None,
    files: MotionFiles | None = None,
) -> ReadRecordings:
    """Return the recordings of all motion files below a folder.

    report: called with the number of files that are read. files: keep what is read. A file that
    cannot be read or searched is refused with its reason; FileError if none is left.
    """
    if not folder.is_dir():
        raise FileError(folder, "not a folder, expected one with motion files")
    refused_paths = motion_readers.find_refused(folder)
    refused = {path.relative_to(folder).as_posix(): hint for path, hint in refused_paths.items()}
    bodies, frames = list[Body](), 0
    statements = stated or FileStatements()
    read = motion_readers.read if files is None else files.read
    measured: Counter[tuple[str, ...]] = Counter()
    for count, path in enumerate(motion_readers.find_files(folder), 1):
        name = path.relative_to(folder).as_posix()
        try:
            body = _body(name, read(path, ReadOptions(rate=statements.rate)), statements)
            frames += len(body.recording)
            measured[body.joints] += 1
            if measured[body.joints] > MOST_WHOLE:
                body = replace(body, figure=body.figure.with_few_frames())
            bodies.append(body)
        except FileError as fault:
            refused[name] = motion_readers.reason(fault, path)
        except UnusableRecording as fault:
            refused[name] = str(fault)
        if frames > MOST_FRAMES:
            raise FileError(
                folder,
                f"found more than {MOST_FRAMES} frames, expected a smaller part of the files",
            )
        report(count)
    same_unit = _of_one_unit(bodies, refused)
    recordings, notes = _with_originals(_turned(same_unit, statements.up, refused))
    if not recordings:
        first = next(iter(refused.items()), None)
        hint = f"such as {first[0]}: {first[1]}" if first else "it has no motion files"
        raise FileError(folder, f"no recording that can be searched; {hint}")
    figures = {body.recording.file: body.figure for body in same_unit}
    for file, figure in figures.items():
        if figure.file.notes:
            notes[file] = [*figure.file.notes, *notes.get(file, [])]
    return ReadRecordings(tuple(recordings), refused, notes, figures)


class UnusableRecording(ValueError):
    """A recording that is read, but cannot be searched."""


@dataclass(frozen=True)
class Body:
    """A recording before its up axis is known.

    joints: names of all, which bodies of one kind share. figure: its measurements, without the
    frames of the file. leg: length in the file's unit. up: axis that the file or the body tells.
    """

    recording: Recording
    joints: tuple[str, ...]
    figure: proposals.Figure
    leg: float
    up: Proposal


def _body(name: str, file: MotionFile, stated: FileStatements) -> Body:
    if len(file) < FEWEST_FRAMES:
        raise UnusableRecording(f"found {len(file)} frame, expected a motion")
    if file.rate is None:
        raise UnusableRecording(f"{file.format} states no frame rate: say it with --rate")
    measured, roles = proposals.measure(file), stated.roles
    unknown = sorted(set(roles.values()) - set(measured.names))
    if unknown:
        raise UnusableRecording(f"no joint {', '.join(map(repr, unknown))}, which the roles name")
    # Stated roles in place of those that were recognised.
    certain = {role: RoleGuess(joint, 1.0) for role, joint in roles.items()}
    recognised = {r: g for r, g in measured.guesses.items() if g.joint not in roles.values()}
    measured = replace(measured, guesses=recognised | certain)
    lacking = []
    for role in NEEDED:
        guess = measured.guesses.get(role)
        if guess is None:
            lacking.append(role)
        elif not guess.is_sure:
            lacking.append(f"{role} ({guess.joint}? {'; '.join(guess.reasons)})")
    if lacking:
        raise UnusableRecording(
            f"no joint for {', '.join(lacking)}, expected a body with two legs; roles can be stated"
        )
    leg = measured.leg_length()
    if not leg:
        raise UnusableRecording("the legs have no length, expected bones from hip to foot")
    joints = file.skeleton
    positions = skeleton.positions(joints.parents, file.rotations, file.translations)
    index = {joint: at for at, joint in enumerate(joints.names)}
    searched = {
        role: index[joint_name]
        for role, joint_name in measured.sure_roles.items()
        if role in SEARCHED
    }
    columns = list(searched.values())
    searched_positions, rest = (
        positions[:, columns] / leg,
        joints.at_rest(joints.offsets)[columns] / leg,
    )
    faults = frame_faults.find_faults(ADULT_LEG * searched_positions, file.rate, ADULT_LEG * rest)
    if faults.rests_first:
        searched_positions[0] = searched_positions[1]
    positions_by_role = {
        role: np.ascontiguousarray(searched_positions[:, at]) for at, role in enumerate(searched)
    }
    recording = Recording(name, file.rate, positions_by_role, faults)
    up = proposals.propose_up([measured])
    return Body(recording, tuple(measured.names), measured.without_frames(), leg, up)


def _of_one_unit(bodies: Sequence[Body], refused: dict[str, str]) -> list[Body]:
    """Return the bodies whose legs are as long as those of most with the same joints.

    Files in another unit are added to those that were refused.
    """
    kinds: dict[tuple[str, ...], list[Body]] = {}
    for body in bodies:
        kinds.setdefault(body.joints, []).append(body)
    files = set[str]()
    for alike in kinds.values():
        # Groups between whose legs the lengths leap.
        lengths = sorted({body.leg for body in alike})
        tops = [low for low, high in pairwise(lengths) if high > OTHER_UNIT * low]
        groups: dict[int, list[Body]] = {}
        for body in alike:
            groups.setdefault(bisect_left(tops, body.leg), []).append(body)
        largest = max(groups.values(), key=len)
        files.update(body.recording.file for body in largest)
        for body in chain.from_iterable(group for group in groups.values() if group is not largest):
            refused[body.recording.file] = (
                f"its legs are {body.leg:.4g} units long, those of {largest[0].recording.file} and "
                f"most files with its joints {largest[0].leg:.4g}: search files of one unit "
                "together"
            )
    return [body for body in bodies if body.recording.file in files]


def _with_originals(
    recordings: Sequence[Recording],
) -> tuple[list[Recording], dict[str, list[str]]]:
    """Return the recordings with the originals of which they are copies, and notes by file."""
    files = [recording.file for recording in recordings]
    copies = find_copies(files, [recording.places for recording in recordings])
    resolved, notes = [], {}
    for recording in recordings:
        joints = list(recording.places)
        sentences = frame_faults.describe(recording.faults, joints, recording.rate, left_out=True)
        original, note = copies.get(recording.file, (None, ""))
        if note:
            sentences += [note]
        if sentences:
            notes[recording.file] = sentences
        resolved.append(replace(recording, copy_of=original))
    return resolved, notes


def _turned(bodies: list[Body], up: UpAxis | None, refused: dict[str, str]) -> list[Recording]:
    """Return the recordings with Y up, which those of one kind of body have in common.

    Recordings whose up axis is unclear are added to those that were refused.
    """
    axes: dict[tuple[str, ...], UpAxis | None] = {}
    reasons: dict[tuple[str, ...], str] = {}
    upright = []
    for body in bodies:
        if body.joints not in axes:
            alike = [other.figure for other in bodies if other.joints == body.joints]
            proposal = proposals.propose_up(alike[:MOST_WHOLE])
            clear = proposal.confidence != "low"
            axes[body.joints] = up or (proposal.value if clear else None)
            reasons[body.joints] = "; ".join(proposal.evidence)
        axis = axes[body.joints]
        if axis is None:
            reason = f"its up axis is unclear ({reasons[body.joints]}): say it with --up"
            refused[body.recording.file] = reason
            continue
        own_axis = body.up.value if body.up.confidence in ("certain", "high") else axis
        if up is None and own_axis != axis:
            refused[body.recording.file] = (
                f"its up axis is {own_axis}, that of most files with its joints {axis}: search "
                "files of one up axis together"
            )
            continue
        positions = {
            r: motion_file.to_y_up(vectors, axis) for r, vectors in body.recording.places.items()
        }
        upright.append(replace(body.recording, places=positions))
    return upright
