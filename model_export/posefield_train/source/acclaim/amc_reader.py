"""Reader of Acclaim motion files (AMC): the angles of each bone in each frame."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from posefield.common.errors import AcclaimError
from posefield.common.units import Floats
from posefield_train.source.acclaim.acclaim_text import FileLike, Line, read_lines
from posefield_train.source.acclaim.asf_reader import ROOT, AsfFile
from posefield_train.source.bvh.bvh_reader import MAX_POSES

FRAME = re.compile(r"\d{1,9}", re.ASCII)
HEADER = {":fully-specified", ":degrees"}


@dataclass(frozen=True)
class AmcFile:
    """A motion of one skeleton.

    source: the file's name. root (F, 6): position in the file's unit, and angles about X, Y and Z,
    degrees. angles: of each bone by its name (F, k), degrees, in the order of its `dof`.
    """

    source: str
    root: Floats
    angles: dict[str, Floats]

    def __len__(self) -> int:
        return len(self.root)


def read_amc(place: FileLike, skeleton: AsfFile) -> AmcFile:
    """Return the motion of a file, which has values for every free angle of the skeleton.

    Raises AcclaimError, naming the line, for a file that breaks the grammar, that belongs to
    another skeleton, or whose frames are not numbered one after another.
    """
    widths = {ROOT: 6, **{bone.name: len(bone.dof) for bone in skeleton.bones if bone.dof}}
    most = MAX_POSES // (len(skeleton.bones) + 1)
    frames: list[tuple[float, ...]] = []
    for frame in _frames(read_lines(place)):
        if len(frames) == most:
            raise frame[0].error(f"found more than {most} frames, expected at most as many")
        frames.append(_values(frame, widths))
    if not frames:
        raise AcclaimError(str(place), "found no frame, expected at least one")
    ends = np.cumsum([*widths.values()])[:-1]
    columns = dict(zip(widths, np.split(np.array(frames), ends, axis=1), strict=True))
    return AmcFile(str(place), columns.pop(ROOT), columns)


def _frames(lines: Iterator[Line]) -> Iterator[list[Line]]:
    """Yield the lines of each frame, its number first."""
    header: set[str] = set()
    count = 0

    def frame_of(line: Line) -> int:
        nonlocal count
        count += len(line.words) == 1 and bool(FRAME.fullmatch(line.words[0]))
        return count

    before = None
    for number, group in groupby(lines, frame_of):
        own = list(group)
        if not number:
            header = {line.words[0].lower() for line in own}
            if unknown := [line for line in own if line.words[0].lower() not in HEADER]:
                raise unknown[0].unexpected(f"{' and '.join(sorted(HEADER))}, then frames")
            continue
        if header != HEADER:
            raise own[0].error(f"found the header {sorted(header)}, expected {sorted(HEADER)}")
        index = int(own[0].words[0])
        if before is not None and index != before + 1:
            raise own[0].unexpected(f"frame {before + 1}")
        before = index
        yield own


def _values(frame: list[Line], widths: dict[str, int]) -> tuple[float, ...]:
    """Return the numbers of a frame in the order of `widths`."""
    found: dict[str, tuple[float, ...]] = {}
    for line in frame[1:]:
        name, *words = line.words
        if name not in widths or name in found:
            raise line.unexpected("each bone of the skeleton that moves, once a frame")
        found[name] = line.numbers(words, widths[name], f"{name} and {widths[name]} numbers")
    if lost := sorted(widths.keys() - found.keys()):
        raise frame[0].error(f"found no values of {', '.join(lost)}, expected them in each frame")
    return tuple(value for name in widths for value in found[name])
