"""Tables of found clips, and the example and the roles that a search is given."""

import csv
import io
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from posefield.common.errors import FileError, InvalidField, RecipeError
from posefield.motion.joint_roles import ROLES
from posefield_train.discover import family_search, motion_features, stride_detection
from posefield_train.discover.family_search import SHORTEST, Family
from posefield_train.discover.motion_features import JoinedFeatures, Span, StillRecordings
from posefield_train.discover.recordings import Recording
from posefield_train.source import clip_table, data_folder

EXAMPLE = re.compile(r"(.+):(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)")
SHORTEST_EXAMPLE, SHORTEST_ROW = 0.6, 0.2
"""Durations of the shortest example, and of the shortest row of a table, s: a match lasts half as
long as its example at least."""
MOST_ROLES_BYTES = 128_000


Verdict = Literal["true", "false", "rejected"]


@dataclass(frozen=True)
class Examples:
    """Parts of recordings that a person accepted, one or more, and rejected."""

    accepted: tuple[Span, ...]
    rejected: tuple[Span, ...] = ()


@dataclass(frozen=True)
class FoundClip:
    """A row of the table.

    file: below the folder. first_frame, last_frame: inclusive. seconds: duration. cost: of a match,
    None for a stride. accepted: by a person; "false" until then. recording: without the ending,
    that of the original of which the file may be a copy.
    """

    file: str
    name: str
    first_frame: int
    last_frame: int
    seconds: float
    cost: float | None = None
    accepted: Verdict = "false"
    recording: str = ""


COLUMNS = ("file", "name", "recording", "first_frame", "last_frame", "seconds", "cost", "accepted")


def strides(recordings: Sequence[Recording]) -> tuple[list[FoundClip], int]:
    """Return the strides of all recordings, in their order, and how many more do not travel."""
    every = [
        (recording, one)
        for recording in recordings
        for one in stride_detection.find_strides(recording)
    ]
    found = [
        _clip(recording, "stride", one.first, one.last) for recording, one in every if one.travels
    ]
    return found, len(every) - len(found)


def like(
    recordings: Sequence[Recording], examples: "Examples", name: str, most: int
) -> list[FoundClip]:
    """Return the examples, the clips that are like them, the best first, and the rejected ones.

    Raises InvalidField for recordings in which nothing moves.
    """
    try:
        corpus = motion_features.build_corpus(recordings)
    except StillRecordings as fault:
        raise InvalidField("like", str(fault)) from fault
    matches = family_search.find_like(corpus, examples.accepted, most, examples.rejected)
    rows: list[tuple[Span, float | None, Verdict]] = [
        *((span, 0.0, "true") for span in examples.accepted),
        *((match.span, match.cost, "false") for match in matches),
        *((span, None, "rejected") for span in examples.rejected),
    ]
    found = []
    for span, cost, accepted in rows:
        first, last = (
            corpus.frame(span.recording, span.start),
            corpus.frame(span.recording, span.end),
        )
        found.append(_clip(recordings[span.recording], name, first, last, cost, accepted))
    return found


def table(clips: Sequence[FoundClip]) -> bytes:
    """Return the table as CSV."""
    lines = io.StringIO(newline="")
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(COLUMNS)
    for one in clips:
        cost = "" if one.cost is None else f"{one.cost:.4f}"
        frames = (one.first_frame, one.last_frame, f"{one.seconds:.3f}")
        writer.writerow([one.file, one.name, one.recording, *frames, cost, one.accepted])
    return lines.getvalue().encode()


def _clip(
    recording: Recording,
    name: str,
    first: int,
    last: int,
    cost: float | None = None,
    accepted: Verdict = "false",
) -> FoundClip:
    seconds = (last - first) / recording.rate
    return FoundClip(
        recording.file, name, first, last, seconds, cost, accepted, recording.original_name
    )


def parse_examples(recordings: Sequence[Recording], text: str) -> Examples:
    """Return the example "FILE:START-END", or those of a table "TABLE.csv" of a former search.

    Of a table, rows count whose cell `accepted` is true or rejected. Raises InvalidField for an
    example that is none, RecipeError for a table that cannot be read.
    """
    if text.endswith(".csv"):
        return _reviewed(recordings, Path(text))
    parts = EXAMPLE.fullmatch(text)
    if parts is None:
        raise InvalidField("like", f"{text!r}, expected FILE:START-END in seconds, or TABLE.csv")
    return Examples(
        (_span(recordings, parts[1], (float(parts[2]), float(parts[3])), SHORTEST_EXAMPLE),)
    )


def _reviewed(recordings: Sequence[Recording], path: Path) -> Examples:
    """Return the rows of a table that a person accepted or rejected."""
    cells = clip_table.open_table(path)
    cells.require(dict.fromkeys(("file", "first_frame", "last_frame", "accepted"), "discover"))
    spans: dict[str, list[Span]] = {"true": [], "rejected": [], "false": []}
    rates = {recording.file: recording.rate for recording in recordings}
    for line, record in cells.records:
        if record["accepted"] not in spans:
            known = ", ".join(spans)
            raise RecipeError(
                cells.name, f"accepted {record['accepted']!r}, expected one of {known}", line
            )
        if record["accepted"] == "false":
            continue
        rate = rates.get(record["file"], 1.0)
        first = cells.frame(line, record, "first_frame") / rate
        last = cells.frame(line, record, "last_frame") / rate
        spans[record["accepted"]].append(
            _span(recordings, record["file"], (first, last), SHORTEST_ROW)
        )
    if not spans["true"]:
        raise InvalidField("like", f"{path}: no row is accepted, expected one or more")
    return Examples(tuple(spans["true"]), tuple(spans["rejected"]))


def _span(
    recordings: Sequence[Recording], file: str, part: tuple[float, float], shortest: float
) -> Span:
    """Return a part of a recording, s; InvalidField if the recording is unknown or lacks it."""
    start, end = part
    for index, recording in enumerate(recordings):
        if recording.file == file:
            seconds = (len(recording) - 1) / recording.rate
            if end > seconds or end - start < shortest:
                raise InvalidField(
                    "like",
                    f"{start:g} to {end:g} s, expected {shortest:g} s or more between 0 "
                    f"and {seconds:.2f} s of {recording.file}",
                )
            return Span(index, start, end)
    known = ", ".join(recording.file for recording in recordings[:5])
    raise InvalidField(
        "like", f"file {file!r}, expected a recording of the folder, such as {known}"
    )


def read_roles(path: Path) -> dict[str, str]:
    """Return the table [roles] of a TOML file, such as a recipe, which may be a draft.

    Raises FileError for a file without it, an unknown role, and a joint with two roles.
    """
    content = data_folder.read(path, MOST_ROLES_BYTES, "a TOML file with roles")
    try:
        found = tomllib.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as fault:
        raise FileError(path, f"not TOML: {fault}") from fault
    roles = found.get("roles")
    if not isinstance(roles, dict) or not all(isinstance(one, str) for one in roles.values()):
        raise FileError(path, "no table [roles] of joints by role")
    unknown = sorted(set(roles) - set(ROLES))
    if unknown:
        raise FileError(path, f"unknown roles {unknown}, expected some of {', '.join(ROLES)}")
    if len(set(roles.values())) < len(roles):
        raise FileError(path, "a joint with two roles, expected one each")
    return roles


MOST_WITHIN = 0.2
"""Variance between the clips of a family as a share of that of all recordings, from which on they
are too different."""
LEAST_SHARED = 0.5
"""Share of the variance of a family that its mean motion has, below which there is no motion that
the clips have in common."""


@dataclass(frozen=True)
class FamilyQuality:
    """Likeness of the clips of a family, and their common motion.

    within: mean variance between the clips at the same part of the motion. motion: variance of
    their mean over time; both as shares of the variance of all recordings. seconds: median
    duration.
    """

    within: float
    motion: float
    seconds: float

    @property
    def shared(self) -> float:
        """Return the share of the variance that the mean motion has."""
        return self.motion / (self.motion + self.within)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why the family is not offered; empty if it is."""
        found = []
        if self.seconds < SHORTEST:
            found.append(f"{self.seconds:.1f} s long, expected {SHORTEST:g} s or more")
        if self.within > MOST_WITHIN:
            found.append(
                f"clips differ by {self.within:.0%} of all motion, expected at most "
                f"{MOST_WITHIN:.0%}"
            )
        if self.shared < LEAST_SHARED:
            found.append(
                f"{self.shared:.0%} of its motion is common to the clips, expected "
                f"{LEAST_SHARED:.0%} or more"
            )
        return tuple(found)


def assess(joined: JoinedFeatures, family: Family) -> FamilyQuality:
    """Return the quality of a family, whose clips are aligned to its example."""
    query = joined.clip(family.example)
    members = []
    for member in family.members:
        clip = joined.clip(member.span)
        apart = np.linalg.norm(query[:, None] - clip, axis=-1)
        members.append(clip[motion_features.align(apart)])
    aligned = np.stack(members)
    mean = aligned.mean(axis=0)
    within = float(np.square(aligned - mean).sum(axis=-1).mean())
    motion = float(np.square(mean - mean.mean(axis=0)).sum(axis=-1).mean())
    whole = joined.variance
    return FamilyQuality(within / whole, motion / whole, family.seconds)
