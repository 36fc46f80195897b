"""Tables of found clips: strides, and motions like an example, and roles that a search is given."""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from posefield.common.errors import FileError, InvalidField, RecipeError
from posefield.common.units import Floats
from posefield.motion.joint_roles import ROLES
from posefield_train.discover import family_search, motion_features
from posefield_train.discover.motion_features import Span, StillRecordings
from posefield_train.discover.recordings import Recording
from posefield_train.source import clip_table, data_folder

SMOOTHING = 0.1
"""Duration of the moving mean, s."""
HYSTERESIS, LEAST = 0.25, 0.08
"""Least swing between two extrema, and least distance of the feet at one, leg lengths."""
SHORTEST, LONGEST = 0.5, 2.6
"""Durations of a stride, s."""
EARLIEST, LATEST = 0.25, 0.75
"""Share of a stride within which the right foot is most forward."""
LEAST_TRAVEL = 0.4
"""Least way of the hips as a share of the swing of the feet."""
WAY_STEP = 0.1
"""Time between two places of which the way of the hips is measured, s."""


@dataclass(frozen=True)
class Stride:
    """Frames of a stride; both show the left foot most forward.

    travel: way of the hips as a share of the swing of the feet, half of it where feet that stand
    carry the body.
    """

    first: int
    last: int
    travel: float

    @property
    def travels(self) -> bool:
        """Return whether the body goes on; a kick or a step in place swings the feet too."""
        return self.travel >= LEAST_TRAVEL


def find_strides(recording: Recording) -> list[Stride]:
    """Return the strides of a recording, in order, those in place too; two in a row share a frame.

    Within them no joint leaps.
    """
    # Distance (F,) by which the left foot is before the right, leg lengths, smooth.
    angles, across = recording.headings(), recording.across("Foot")
    lead = across[:, 2] * np.cos(angles) + across[:, 0] * np.sin(angles)
    signal = moving_mean(lead, round(SMOOTHING * recording.rate))
    extrema = alternating_extrema(signal)
    strides = []
    for (first, kind), (middle, _), (last, _) in zip(
        extrema, extrema[1:], extrema[2:], strict=False
    ):
        share = (middle - first) / (last - first)
        is_far = min(signal[first], -signal[middle], signal[last]) > LEAST
        lasts = SHORTEST <= (last - first) / recording.rate <= LONGEST
        is_one = lasts and EARLIEST <= share <= LATEST and recording.is_whole(first, last)
        if kind > 0 and is_far and is_one:
            swing = signal[first] + signal[last] - 2.0 * signal[middle]
            # Horizontal way of the hips, leg lengths.
            step = max(1, round(WAY_STEP * recording.rate))
            hips = recording.places["hips"][first : last + 1 : step, [0, 2]]
            distance = float(np.linalg.norm(np.diff(hips, axis=0), axis=1).sum())
            strides.append(Stride(first, last, distance / swing))
    return strides


def moving_mean(values: Floats, frames: int) -> Floats:
    """Return the mean (F,) of a window of an odd number of frames; the ends are held."""
    half = max(frames, 1) // 2
    padded = np.concatenate([[0.0], np.cumsum(np.pad(values, half, mode="edge"))])
    return np.asarray((padded[2 * half + 1 :] - padded[: -2 * half - 1]) / (2 * half + 1))


def alternating_extrema(values: Floats) -> list[tuple[int, int]]:
    """Return the extrema of a signal (F,): index and sign, 1 of a maximum, -1 of a minimum.

    An extremum counts once the signal left it by HYSTERESIS; then the search for the opposite one
    begins. The first and the last frame are no extrema.
    """
    extrema: list[tuple[int, int]] = []
    low = high = 0
    sign = 0
    for at, value in enumerate(values):
        high = at if value > values[high] else high
        low = at if value < values[low] else low
        if sign >= 0 and value < values[high] - HYSTERESIS:
            extrema += [(high, 1)] if high > 0 else []
            sign, low = -1, at
        elif sign <= 0 and value > values[low] + HYSTERESIS:
            extrema += [(low, -1)] if low > 0 else []
            sign, high = 1, at
    return extrema


EXAMPLE = re.compile(r"(.+):(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)")
SHORTEST_EXAMPLE, SHORTEST_ROW = 0.6, 0.2
"""Durations of the shortest example, and of the shortest row of a table, s: a match lasts half as
long as its example at least."""
MOST_ROLES_BYTES = 128_000


Verdict = Literal["true", "false", "rejected"]


Examples = tuple[Sequence[Span], Sequence[Span]]
"""Parts of recordings that a person accepted, one or more, and that were rejected."""


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
    pairs = [(recording, one) for recording in recordings for one in find_strides(recording)]
    clips = [
        _clip(recording, "stride", one.first, one.last) for recording, one in pairs if one.travels
    ]
    return clips, len(pairs) - len(clips)


def like(
    recordings: Sequence[Recording], examples: Examples, name: str, count: int
) -> list[FoundClip]:
    """Return the examples, the clips that are like them, the best first, and the rejected ones.

    Raises InvalidField for recordings in which nothing moves.
    """
    accepted, rejected = examples
    try:
        corpus = motion_features.build_corpus(recordings)
    except StillRecordings as fault:
        raise InvalidField("like", str(fault)) from fault
    matches = family_search.find_like(corpus, accepted, count, rejected)
    rows: list[tuple[Span, float | None, Verdict]] = [
        *((span, 0.0, "true") for span in accepted),
        *((match.span, match.cost, "false") for match in matches),
        *((span, None, "rejected") for span in rejected),
    ]
    clips = []
    for span, cost, verdict in rows:
        first, last = corpus.frames(span)
        clips.append(_clip(recordings[span.recording], name, first, last, cost, verdict))
    return clips


def table(clips: Sequence[FoundClip]) -> bytes:
    """Return the table as CSV."""
    rows: list[Sequence[object]] = [COLUMNS]
    for clip in clips:
        cost = "" if clip.cost is None else f"{clip.cost:.4f}"
        frames = (clip.first_frame, clip.last_frame, f"{clip.seconds:.3f}")
        rows.append((clip.file, clip.name, clip.recording, *frames, cost, clip.accepted))
    return clip_table.csv_text(rows).encode()


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
    match = EXAMPLE.fullmatch(text)
    if match is None:
        raise InvalidField("like", f"{text!r}, expected FILE:START-END in seconds, or TABLE.csv")
    seconds = float(match[2]), float(match[3])
    return [_span(recordings, match[1], seconds, SHORTEST_EXAMPLE)], []


def _reviewed(recordings: Sequence[Recording], path: Path) -> Examples:
    """Return the rows of a table that a person accepted or rejected."""
    cells = clip_table.open_table(path)
    cells.require(dict.fromkeys(("file", "first_frame", "last_frame", "accepted"), "discover"))
    spans: dict[str, list[Span]] = {"true": [], "rejected": [], "false": []}
    rates = {recording.file: recording.rate for recording in recordings}
    for line, record in cells.records:
        if record["accepted"] not in spans:
            verdicts = ", ".join(spans)
            raise RecipeError(
                cells.name, f"accepted {record['accepted']!r}, expected one of {verdicts}", line
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
    return spans["true"], spans["rejected"]


def _span(
    recordings: Sequence[Recording],
    file: str,
    seconds_range: tuple[float, float],
    shortest: float,
) -> Span:
    """Return a part of a recording, s; InvalidField if the recording is unknown or lacks it."""
    start, end = seconds_range
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
    files = ", ".join(recording.file for recording in recordings[:5])
    raise InvalidField(
        "like", f"file {file!r}, expected a recording of the folder, such as {files}"
    )


def read_roles(path: Path) -> dict[str, str]:
    """Return the table [roles] of a TOML file, such as a recipe, which may be a draft.

    Raises FileError for a file without it, an unknown role, and a joint with two roles.
    """
    content = data_folder.read(path, MOST_ROLES_BYTES, "a TOML file with roles")
    try:
        tables = tomllib.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as fault:
        raise FileError(path, f"not TOML: {fault}") from fault
    roles = tables.get("roles")
    if not isinstance(roles, dict) or not all(isinstance(one, str) for one in roles.values()):
        raise FileError(path, "no table [roles] of joints by role")
    unknown = sorted(set(roles) - set(ROLES))
    if unknown:
        raise FileError(path, f"unknown roles {unknown}, expected some of {', '.join(ROLES)}")
    if len(set(roles.values())) < len(roles):
        raise FileError(path, "a joint with two roles, expected one each")
    return roles
