"""Kinds of bodies of a folder: takes with the same joints, what is proposed for them, and who."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, UpAxis
from posefield.motion.skeleton import Skeleton
from posefield.roles.joint_recognition import RoleGuess
from posefield_train.probe import figure, probe_report
from posefield_train.probe.figure import Figure
from posefield_train.probe.probe_report import ProbeReport
from posefield_train.probe.proposals import Proposal
from posefield_train.source import motion_readers
from posefield_train.source.motion_file import ReadOptions

SAME_BONE = 0.0005
"""Largest difference of a bone's length between files of one performer, m."""
STATED = ("stated by an option of posefield discover",)


@dataclass(frozen=True)
class FileStatements:
    """Statements about all files, which count more than what is proposed.

    metres_per_unit, up: None for what the files or bodies tell. roles: joints by role. rate: frames
    a second of files that state none.
    """

    metres_per_unit: float | None
    up: UpAxis | None
    roles: Mapping[str, str]
    rate: float | None = None


@dataclass(frozen=True)
class BodyKind:
    """Takes with the same joints in the same order.

    report: proposals, with statements in place of guesses. performers: by file. skeleton: of the
    first file. stated: joints by role that were stated.
    """

    joints: tuple[str, ...]
    report: ProbeReport
    performers: Mapping[str, str]
    skeleton: Skeleton
    stated: Mapping[str, str]


def find_kinds(
    folder: Path,
    files: Sequence[str],
    stated: FileStatements,
    report: Callable[[int], None] = lambda _: None,
    figures: Mapping[str, Figure] | None = None,
) -> list[BodyKind]:
    """Return the kinds of bodies of a folder's files, in the order of their first files.

    figures: of files that were read before. Raises InvalidField for files whose unit or up axis is
    neither stated nor told by the bodies.
    """
    groups: dict[tuple[str, ...], list[tuple[str, Figure]]] = {}
    for count, file in enumerate(files, 1):
        own = figures[file] if figures else _measured(folder / file, stated.rate)
        groups.setdefault(tuple(own.names), []).append((file, own))
        report(count)
    return [_kind(folder, joints, group, stated) for joints, group in groups.items()]


def _measured(path: Path, rate: float | None) -> Figure:
    return figure.measure(motion_readers.read(path, ReadOptions(rate=rate))).without_frames()


def _kind(
    folder: Path,
    joints: tuple[str, ...],
    group: Sequence[tuple[str, Figure]],
    stated: FileStatements,
) -> BodyKind:
    files, figures = [file for file, _ in group], [own for _, own in group]
    found = _stated(probe_report.report_of([folder / file for file in files], figures), stated)
    for name, key in (("metres_per_unit", "unit"), ("up", "up")):
        if found.proposed[name].value is None:
            said = "; ".join(found.proposed[name].evidence)
            raise InvalidField(key, f"not told by {files[0]} ({said}), expected a statement")
    unit = float(found.proposed["metres_per_unit"].value)
    names = name_performers(files, [unit * own.bones[1:] for own in figures])
    own = {role: joint for role, joint in stated.roles.items() if joint in joints}
    performers = dict(zip(files, names, strict=True))
    return BodyKind(joints, found, performers, figures[0].file.skeleton, own)


def _stated(found: ProbeReport, stated: FileStatements) -> ProbeReport:
    """Return the report with statements in place of proposals and guesses."""
    values = {"metres_per_unit": stated.metres_per_unit, "up": stated.up, "rate": stated.rate}
    proposed = {
        name: Proposal(value, "certain", STATED)
        for name, value in values.items()
        if value is not None
    }
    roles = {
        role: RoleGuess(joint, 1.0) for role, joint in stated.roles.items() if joint in found.joints
    }
    others = {r: g for r, g in found.guesses.items() if g.joint not in stated.roles.values()}
    return replace(found, proposed=found.proposed | proposed, guesses=others | roles)


def name_performers(files: Sequence[str], bones: Sequence[Floats]) -> list[str]:
    """Return the performer of each file.

    bones: lengths (J - 1,), m, of each file's bones below the root. Files whose lengths agree are
    of one performer, who is named by a word that these files' names share and no other file's has,
    else performer_1 and so on, in the files' order.
    """
    groups = _groups(bones)
    words = [_words(file) for file in files]
    found = [""] * len(files)
    for number, group in enumerate(groups, 1):
        shared = set(words[group[0]]).intersection(*(words[at] for at in group))
        others = {word for at, own in enumerate(words) if at not in group for word in own}
        own = [word for word in words[group[0]] if word in shared - others]
        is_told = len(groups) > 1 and own
        for at in group:
            found[at] = own[0] if is_told else f"performer_{number}"
    return found


def _groups(bones: Sequence[Floats]) -> list[list[int]]:
    """Return the indices of files with equal bones, in the order of their first files."""
    groups: list[list[int]] = []
    for at, own in enumerate(bones):
        for group in groups:
            other = bones[group[0]]
            if own.shape == other.shape and np.abs(own - other).max(initial=0.0) <= SAME_BONE:
                group.append(at)
                break
        else:
            groups.append([at])
    return groups


def _words(file: str) -> list[str]:
    """Return the words of a file's path with a letter, the name's before those of its folders."""
    path = PurePosixPath(file)
    texts = [path.stem, *reversed(path.parent.parts)]
    words = [word for text in texts for word in re.split(r"[^a-z0-9]+", text.lower())]
    return [word for word in words if re.search("[a-z]", word)]
