"""Reader of Acclaim motion files (AMC): the angles of each bone in each frame."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from posefield.common.errors import AcclaimError
from posefield.common.units import Floats
from posefield_train.source.acclaim.acclaim_text import FileLike, Line, read_lines
from posefield_train.source.acclaim.asf_reader import ROOT, AsfFile
from posefield_train.source.bvh.bvh_reader import MAX_POSES

FRAME = re.compile(r"\d{1,9}", re.ASCII)
MAX_BYTES = 500_000_000
"""Limit of a file's size: 45 minutes of 31 joints at 120 frames a second."""

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
    groups = _groups(read_lines(place, MAX_BYTES), most=max(len(HEADER), 1 + len(widths)))
    _check_header(next(groups), str(place))
    most = MAX_POSES // (len(skeleton.bones) + 1)
    frames: list[Floats] = []
    before = None
    for frame in groups:
        number = int(frame[0].words[0])
        if before is not None and number != before + 1:
            raise frame[0].unexpected(f"frame {before + 1}")
        if len(frames) == most:
            raise frame[0].error(f"found more than {most} frames, expected at most as many")
        frames.append(np.array(_values(frame, widths)))
        before = number
    if not frames:
        raise AcclaimError(str(place), "found no frame, expected at least one")
    ends = np.cumsum([*widths.values()])[:-1]
    columns = dict(zip(widths, np.split(np.stack(frames), ends, axis=1), strict=True))
    return AmcFile(str(place), columns.pop(ROOT), columns)


def _groups(lines: Iterator[Line], most: int) -> Iterator[list[Line]]:
    """Yield the header's lines, then those of each frame, its number first.

    Raises AcclaimError for more than `most` lines in one of them.
    """
    own: list[Line] = []
    for line in lines:
        if len(line.words) == 1 and FRAME.fullmatch(line.words[0]):
            yield own
            own = []
        elif len(own) == most:
            raise line.unexpected("the number of the next frame")
        own.append(line)
    yield own


def _check_header(lines: list[Line], source: str) -> None:
    for line in lines:
        if line.words[0].lower() not in HEADER or len(line.words) > 1:
            raise line.unexpected(f"{' and '.join(sorted(HEADER))}, then frames")
    found = {line.words[0].lower() for line in lines}
    if found != HEADER:
        raise AcclaimError(source, f"found the header {sorted(found)}, expected {sorted(HEADER)}")


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
