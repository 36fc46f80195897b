"""Takes of clips, found from files and motions."""

from collections.abc import Sequence

import numpy as np

from posefield_train.source.takes import joint_sides, shared_frames
from posefield_train.source.takes.shared_frames import ClipPair, Motions


def find_takes(
    files: Sequence[str], named: Sequence[str], motions: Motions, joints: tuple[str, ...]
) -> tuple[list[str], list[str]]:
    """Return the take of each clip, as the place of a file, and notes on clips that were grouped.

    Clips of one file are of one take, and so are clips that share frames, mirror or continue each
    other. files: of each clip. named: names of clips in notes. motions: joint positions (F, J, 3),
    m, of each clip as captured. joints: their names.
    """
    pairs = shared_frames.find_pairs(motions, joint_sides.mirrored_joints(joints))
    apart = [pair for pair in pairs if files[pair.first] != files[pair.second]]
    takes = connected(files, apart)
    return takes, [*_pair_notes(named, apart), *_file_notes(files)]


def connected(files: Sequence[str], pairs: Sequence[ClipPair]) -> list[str]:
    """Return for each clip the first file, by name, of all files that pairs connect.

    files: of each clip. pairs: of indices of clips.
    """
    above = {file: file for file in files}

    def top(file: str) -> str:
        while above[file] != file:
            file = above[file]
        return file

    for pair in pairs:
        low, high = sorted((top(files[pair.first]), top(files[pair.second])))
        above[high] = low
    return [top(file) for file in files]


STATE_TAKES = "clips.take states takes"


def _pair_notes(named: Sequence[str], pairs: Sequence[ClipPair]) -> list[str]:
    """Return a note for each relation of clips of different files."""
    notes = []
    for relation in ("mirrors", "shares frames with", "continues"):
        own = [pair for pair in pairs if pair.relation == relation]
        if not own:
            continue
        clips = len({clip for pair in own for clip in (pair.first, pair.second)})
        second, first = named[own[0].second], named[own[0].first]
        more = f"; {clips} clips have such a counterpart" if clips > 2 else ""
        notes.append(
            f"{second} {relation} {first}{more}: such clips are left out together as one take "
            f"({STATE_TAKES})"
        )
    return notes


def _file_notes(files: Sequence[str]) -> list[str]:
    """Return the note on clips that were cut from one file."""
    _, counts = np.unique(files, return_counts=True)
    if counts.max() == 1 or len(counts) == 1:
        return []
    return [
        f"{counts[counts > 1].sum()} of {len(files)} clips share their file with others: clips of "
        f"one file are left out together as one take ({STATE_TAKES})"
    ]
