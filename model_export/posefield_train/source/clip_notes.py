"""Notes on assumptions about motion files: one line for what is the same in many files."""

from collections.abc import Mapping, Sequence

import numpy as np

from posefield_train.source.clip_table import ClipRow
from posefield_train.source.motion_files.motion_file import MotionFile

BVH = "BVH"
RIGID_TOLERANCE = 1e-4
"""Bones that stretch by less than this are taken as rigid without a note, m."""


def stretch_notes(rows: Sequence[ClipRow], stretches: Sequence[float]) -> list[str]:
    """Return the note on bones that stretch, with the worst clip; none if all are rigid.

    stretches: largest change of a bone's length in the clip of each row, m.
    """
    worst = int(np.argmax(stretches))
    count = int(np.sum(np.asarray(stretches) > RIGID_TOLERANCE))
    if not count:
        return []
    most = f"bones stretch by up to {stretches[worst]:.4f} m"
    if count == 1:
        return [f"{rows[worst].place}: {most}; their mean is kept"]
    return [
        f"{count} of {len(rows)} clips: {most}, the most in {rows[worst].place}; their mean is kept"
    ]


def offset_notes(files: Mapping[str, MotionFile]) -> list[str]:
    """Return the note on the interpretation of root OFFSETs that are not zero; none if all are.

    files: motion files by place; those of other formats than BVH have no OFFSET.
    """
    moved = {
        place: tuple(file.skeleton.offsets[0].tolist())
        for place, file in files.items()
        if file.format == BVH and file.skeleton.offsets[0].any()
    }
    if not moved:
        return []
    place, offset = next(iter(moved.items()))
    which = "" if len(moved) == 1 else f"{len(moved)} of {len(files)} files, the first of them "
    return [
        f"{which}{place}: the root's OFFSET is {offset} and has position channels, which were "
        "taken to replace it; say so as source.root_offset"
    ]


def reader_notes(files: Mapping[str, MotionFile]) -> list[str]:
    """Return the notes of readers on what they assumed, each of several files once.

    files: motion files by place.
    """
    found: dict[str, list[str]] = {}
    for place, file in files.items():
        for note in file.notes:
            found.setdefault(note, []).append(place)
    return [
        note if len(places) == 1 else f"{len(places)} of {len(files)} files: {note}"
        for note, places in found.items()
    ]
