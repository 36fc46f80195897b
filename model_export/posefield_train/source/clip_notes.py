"""Notes on assumptions about motion files: one line for what is the same in many files."""

from collections.abc import Mapping, Sequence

import numpy as np

from posefield_train.source import bvh
from posefield_train.source.clip_table import ClipRow

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


def offset_notes(files: Mapping[str, bvh.BvhFile]) -> list[str]:
    """Return the note on the interpretation of root OFFSETs that are not zero; none if all are.

    files: motion files by place.
    """
    moved = {place: file.joints[0] for place, file in files.items() if any(file.joints[0].offset)}
    if not moved:
        return []
    place, root = next(iter(moved.items()))
    which = "" if len(moved) == 1 else f"{len(moved)} of {len(files)} files, the first of them "
    return [
        f"{which}{place}: the root's OFFSET is {root.offset} and has position channels, which were "
        "taken to replace it; say so as source.root_offset"
    ]
