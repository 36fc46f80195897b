"""Cuts of long recordings by hand, and the found clips that agree with them."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from posefield_train.discover.motion_features import Span
from posefield_train.discover.recordings import Recording

SAME_MOTION = 0.5
"""Least common time of a found clip and a cut, as a share of the time of both together."""


@dataclass(frozen=True)
class HandCut:
    """A clip that was cut by hand. frames: first and last one, both included."""

    action: str
    performer: str
    file: str
    frames: tuple[int, int]
    span: Span


def read(folder: Path, recordings: Sequence[Recording]) -> list[HandCut]:
    """Return the cuts of truth.csv. folder: that of the table, and of the recordings below bvh."""
    files = [recording.file for recording in recordings]
    cuts = []
    for row in records(folder / "truth.csv"):
        recording = files.index(row["file"])
        frames = int(row["first_frame"]), int(row["last_frame"])
        span = Span(recording, *(at / recordings[recording].rate for at in frames))
        cuts.append(HandCut(row["action"], row["performer"], row["file"], frames, span))
    return cuts


def records(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV table."""
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def shared(one: Span, other: Span) -> float:
    """Return the common time as a share of the time of both together."""
    if one.recording != other.recording:
        return 0.0
    common = min(one.end, other.end) - max(one.start, other.start)
    return common / (max(one.end, other.end) - min(one.start, other.start))


def is_right(span: Span, cuts: Sequence[Span]) -> bool:
    """Return whether a found clip is one of the cuts."""
    return any(shared(span, cut) >= SAME_MOTION for cut in cuts)


def same_cuts(span: Span, cuts: Sequence[HandCut]) -> list[HandCut]:
    """Return the cuts that a found clip is."""
    return [cut for cut in cuts if shared(span, cut.span) >= SAME_MOTION]
