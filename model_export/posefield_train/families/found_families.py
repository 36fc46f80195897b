"""Families of a folder's recordings: similar motions and strides, as rows of tables."""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import numpy as np

from posefield.common.errors import InvalidField, RecipeError
from posefield.common.units import Floats
from posefield.motion.skeleton import Skeleton
from posefield.roles.joint_recognition import RoleGuess
from posefield_train.discover import family_search, found_clips, motion_features
from posefield_train.discover.family_search import FEWEST, FamilyQuality
from posefield_train.discover.motion_features import Corpus
from posefield_train.discover.recordings import FileStatements, Recording
from posefield_train.probe import probe_report, recipe_draft
from posefield_train.probe.probe_report import ProbeReport
from posefield_train.probe.proposals import Figure, Proposal
from posefield_train.source import clip_table, common_topology
from posefield_train.source.common_topology import RoleJoints, TopologyError

SAME_BONE = 0.0005
"""Largest difference of a bone's length between files of one performer, m."""
STATED = ("stated by an option of posefield discover",)


@dataclass(frozen=True)
class BodyKind:
    """Recordings with the same joints in the same order.

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
    figures: Mapping[str, Figure],
    stated: FileStatements,
    report: Callable[[int], None] = lambda _: None,
) -> list[BodyKind]:
    """Return the kinds of bodies of a folder's files, in the order of their first files.

    figures: of the bodies, by file. Raises InvalidField for files whose unit or up axis is neither
    stated nor told by the bodies.
    """
    groups: dict[tuple[str, ...], list[tuple[str, Figure]]] = {}
    for count, (file, figure) in enumerate(figures.items(), 1):
        groups.setdefault(tuple(figure.names), []).append((file, figure))
        report(count)
    return [_kind(folder, joints, group, stated) for joints, group in groups.items()]


def _kind(
    folder: Path,
    joints: tuple[str, ...],
    group: Sequence[tuple[str, Figure]],
    stated: FileStatements,
) -> BodyKind:
    files, figures = [file for file, _ in group], [stated_roles for _, stated_roles in group]
    report = _stated(probe_report.report_of([folder / file for file in files], figures), stated)
    for name, key in (("metres_per_unit", "unit"), ("up", "up")):
        if report.proposed[name].value is None:
            evidence = "; ".join(report.proposed[name].evidence)
            raise InvalidField(key, f"not told by {files[0]} ({evidence}), expected a statement")
    unit = float(report.proposed["metres_per_unit"].value)
    names = name_performers(files, [unit * stated_roles.bones[1:] for stated_roles in figures])
    stated_roles = {role: joint for role, joint in stated.roles.items() if joint in joints}
    performers = dict(zip(files, names, strict=True))
    return BodyKind(joints, report, performers, figures[0].file.skeleton, stated_roles)


def _stated(report: ProbeReport, stated: FileStatements) -> ProbeReport:
    values = {"metres_per_unit": stated.metres_per_unit, "up": stated.up, "rate": stated.rate}
    proposed = {
        name: Proposal(value, "certain", STATED)
        for name, value in values.items()
        if value is not None
    }
    roles = {
        role: RoleGuess(joint, 1.0)
        for role, joint in stated.roles.items()
        if joint in report.joints
    }
    recognised = {r: g for r, g in report.guesses.items() if g.joint not in stated.roles.values()}
    return replace(report, proposed=report.proposed | proposed, guesses=recognised | roles)


def name_performers(files: Sequence[str], bones: Sequence[Floats]) -> list[str]:
    """Return the performer of each file.

    bones: lengths (J - 1,), m, of each file's bones below the root. Files whose lengths agree are
    of one performer, who is named by a word that these files' names share and no other file's has,
    else performer_1 and so on, in the files' order.
    """
    groups = _groups(bones)
    words = [_words(file) for file in files]
    performers = [""] * len(files)
    for number, group in enumerate(groups, 1):
        shared = set(words[group[0]]).intersection(*(words[at] for at in group))
        other_words = {
            word
            for at, unique_words in enumerate(words)
            if at not in group
            for word in unique_words
        }
        unique_words = [word for word in words[group[0]] if word in shared - other_words]
        is_told = len(groups) > 1 and unique_words
        for at in group:
            performers[at] = unique_words[0] if is_told else f"performer_{number}"
    return performers


def _groups(bones: Sequence[Floats]) -> list[list[int]]:
    """Return the indices of files with equal bones, in the order of their first files."""
    groups: list[list[int]] = []
    for at, lengths in enumerate(bones):
        for group in groups:
            other = bones[group[0]]
            if (
                lengths.shape == other.shape
                and np.abs(lengths - other).max(initial=0.0) <= SAME_BONE
            ):
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


SAME_UNIT = 1e-4
"""Largest relative difference of two numbers that state the same unit."""


def can_share(kinds: Sequence[BodyKind]) -> bool:
    """Return whether bodies have all roles of a common topology, and one unit and up axis."""
    units, axes = (
        [kind.report.proposed[key].value for kind in kinds] for key in ("metres_per_unit", "up")
    )
    if max(units) - min(units) > SAME_UNIT * max(units) or len(set(axes)) > 1:
        return False
    try:
        _bodies(kinds)
    except TopologyError:
        return False
    return True


def _bodies(kinds: Sequence[BodyKind]) -> list[RoleJoints]:
    return [
        common_topology.role_joints(
            kind.skeleton, {role: [joint] for role, joint in kind.stated.items()}
        )
        for kind in kinds
    ]


def shared_report(report: ProbeReport, kinds: Sequence[BodyKind]) -> ProbeReport:
    """Return a report on bodies of which a recipe makes one topology.

    report: on those of the most common kind, whose joints become those of the topology.
    """
    names = common_topology.common_topology(_bodies(kinds)).names
    guesses = {
        role: RoleGuess(joint, 1.0) for role, joint in common_topology.model_roles(names).items()
    }
    by_joint = {joint: role for role, joint in report.roles.items()}
    feet = report.proposed["feet"]
    foot_roles = [by_joint[joint] for joint in feet.value if by_joint.get(joint) in names]
    proposed = report.proposed | {
        "feet": replace(feet, value=foot_roles),
        "facing": Proposal(0.0, "certain", ("bodies on the topology of roles face +z",)),
    }
    return replace(report, joints=names, guesses=guesses, proposed=proposed)


def skeleton_lines(kinds: Sequence[BodyKind]) -> list[str]:
    """Return the section [skeleton] of a family's recipe, with its evidence as comments."""
    counts = ", ".join(str(len(kind.joints)) for kind in kinds)
    lines = [
        f"# The files have {len(kinds)} kinds of skeletons, of {counts} joints: clips get the",
        "# joints of the roles that all have, named by their roles.",
        "[skeleton]",
        'topology = "roles"',
    ]
    stated: dict[str, list[str]] = {}
    for kind in kinds:
        for role, joint in kind.stated.items():
            joints_of_role = stated.setdefault(role, [])
            joints_of_role += [] if joint in joints_of_role else [joint]
    if stated:
        lines += ["", f"# {STATED[0]}", "[skeleton.roles]"]
        lines += [f"{role} = {recipe_draft.names(joints)}" for role, joints in stated.items()]
    return [*lines, ""]


COLUMNS = ("file", "first_frame", "last_frame", "performer", "recording", "cost", "accepted")


@dataclass(frozen=True)
class FamilyRow:
    """A clip of a family.

    file: below the folder of the recordings. first_frame, last_frame: inclusive. recording: clips
    of one are left out together. cost: of the match with the example, None for a stride. accepted:
    whether it is trained from.
    """

    file: str
    first_frame: int
    last_frame: int
    performer: str
    recording: str
    cost: float | None = None
    accepted: bool = True

    @property
    def frames(self) -> tuple[str, int, int]:
        """Return the file with the first and the last frame."""
        return self.file, self.first_frame, self.last_frame


def table(rows: Sequence[FamilyRow]) -> bytes:
    """Return the table as CSV."""
    lines: list[Sequence[object]] = [COLUMNS]
    for row in rows:
        cost = "" if row.cost is None else f"{row.cost:.4f}"
        accepted = str(row.accepted).lower()
        lines.append((*row.frames, row.performer, row.recording, cost, accepted))
    return clip_table.csv_text(lines).encode()


def read(path: Path) -> list[FamilyRow]:
    """Return the rows of a table; RecipeError names a cell that cannot be read."""
    cells = clip_table.open_table(path)
    # A folder that an earlier version wrote has recordings in the column `take`.
    column = "take" if "take" in cells.columns else "recording"
    expected = [column if name == "recording" else name for name in COLUMNS]
    cells.require(dict.fromkeys(expected, "the table of a family"))
    rows = []
    for line, record in cells.records:
        if record["accepted"] not in ("true", "false"):
            fault = f"column 'accepted': {record['accepted']!r}, expected true or false"
            raise RecipeError(path, fault, line)
        first, last = (cells.frame(line, record, key) for key in ("first_frame", "last_frame"))
        cost = cells.number(line, record, "cost") if record["cost"] else None
        accepted = record["accepted"] == "true"
        cells_before_cost = (record["file"], first, last, record["performer"], record[column])
        rows.append(FamilyRow(*cells_before_cost, cost, accepted))
    return rows


STRIDE_CLIPS = 5
"""Fewest strides of a family."""


@dataclass(frozen=True)
class FoundFamily:
    """Clips that may be a family.

    kind: motions or strides. rows: the most similar first. example: row that the others are like;
    None for strides. kinds: of the bodies, the most common first. seconds: median duration.
    quality: None for strides. left_out: reason by clip, such as "a.bvh@3.2". reasons: why it is not
    offered.
    """

    kind: str
    rows: tuple[FamilyRow, ...]
    example: FamilyRow | None
    kinds: tuple[BodyKind, ...]
    seconds: float
    quality: FamilyQuality | None
    left_out: Mapping[str, str]
    reasons: tuple[str, ...]


def find_families(
    recordings: Sequence[Recording],
    kinds: Sequence[BodyKind],
    count: int,
    report: Callable[[int], None] = lambda _: None,
) -> list[FoundFamily]:
    """Return the families of recordings, those that are not offered too, and that of strides last.

    count, report: as in `family_search.find_families`.
    """
    corpus = motion_features.build_corpus(recordings)
    joined = motion_features.join_features(corpus)
    families = []
    for family in family_search.find_families(corpus, count, report):
        quality = family_search.assess(joined, family)
        rows = [_row(corpus, member.span, member.cost, kinds) for member in family.members]
        example = _row(corpus, family.example, 0.0, kinds)
        candidate = FoundFamily(
            "motions", tuple(rows), example, (), family.seconds, quality, {}, quality.reasons
        )
        families.append(_of_one_topology(candidate, kinds, recordings))
    strides = _strides(recordings, kinds)
    return families if strides is None else [*families, strides]


def _row(
    corpus: Corpus, span: motion_features.Span, cost: float, kinds: Sequence[BodyKind]
) -> FamilyRow:
    return _clip(corpus.recordings[span.recording], *corpus.frames(span), cost, kinds)


def _clip(
    recording: Recording, first: int, last: int, cost: float | None, kinds: Sequence[BodyKind]
) -> FamilyRow:
    # A mirrored copy swaps the bones of both sides, but its performer is that of the recording.
    original = recording.original
    performer = next(kind.performers[original] for kind in kinds if original in kind.performers)
    return FamilyRow(recording.file, first, last, performer, recording.original_name, cost)


def _strides(recordings: Sequence[Recording], kinds: Sequence[BodyKind]) -> FoundFamily | None:
    pairs = [
        (recording, one)
        for recording in recordings
        for one in found_clips.find_strides(recording)
        if one.travels
    ]
    if len(pairs) < STRIDE_CLIPS:
        return None
    rows = [_clip(recording, one.first, one.last, None, kinds) for recording, one in pairs]
    seconds = sorted((one.last - one.first) / recording.rate for recording, one in pairs)
    family = FoundFamily("strides", tuple(rows), None, (), seconds[len(seconds) // 2], None, {}, ())
    return _of_one_topology(family, kinds, recordings)


def _of_one_topology(
    family: FoundFamily, kinds: Sequence[BodyKind], recordings: Sequence[Recording]
) -> FoundFamily:
    """Return the family with the clips whose bodies share a topology, the others named.

    Without one, the clips of the most common joints remain.
    """
    numbers = {file: at for at, kind in enumerate(kinds) for file in kind.performers}
    by_file = {recording.file: recording for recording in recordings}
    counts = Counter(numbers[row.file] for row in family.rows)
    common = [at for at, _ in counts.most_common()]
    if len(common) > 1 and not can_share([kinds[at] for at in common]):
        common = common[:1]
    rows, left_out = [], {}
    for row in family.rows:
        is_whole = by_file[row.file].is_whole(row.first_frame, row.last_frame)
        if numbers[row.file] in common and is_whole:
            rows.append(row)
        else:
            clip_name = f"{row.file}@{row.first_frame / by_file[row.file].rate:.1f}"
            left_out[clip_name] = (
                "a joint leaps" if not is_whole else "other joints than most clips"
            )
    reasons = family.reasons
    if len(rows) < FEWEST:
        reasons = (*reasons, f"{len(rows)} clips of one skeleton, expected {FEWEST} or more")
    if len({row.recording for row in rows}) < 2:
        reasons = (*reasons, "clips of one recording, expected two recordings or more")
    # Clips in which a joint leaps may have been all of a kind.
    left = {numbers[row.file] for row in rows} or {common[0]}
    shared_kinds = tuple(kinds[at] for at in common if at in left)
    return replace(family, rows=tuple(rows), kinds=shared_kinds, left_out=left_out, reasons=reasons)
