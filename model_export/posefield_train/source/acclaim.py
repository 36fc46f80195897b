"""Acclaim motion files: a skeleton (ASF), motions of it (AMC), and their conversion to a clip."""

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import IO, Literal, Protocol

import numpy as np

from posefield.common.errors import AcclaimError
from posefield.common.units import Floats
from posefield.motion import clip, quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.bvh import MAX_POSES
from posefield_train.source.bvh_hierarchy import MAX_NUMBER, NUMBER, quote

MAX_LINE = 10_000
"""Limit of a line's length, bytes: hundreds of times that of a bone with six numbers."""


class FileLike(Protocol):
    """A pathlib.Path, or a member of an archive."""

    def open(self, mode: Literal["rb"]) -> IO[bytes]:
        """Open the file to be read as bytes."""


@dataclass(frozen=True)
class Line:
    """Words of one line. source: the file's name. number: of the line, from 1."""

    source: str
    number: int
    words: tuple[str, ...]

    def error(self, message: str) -> AcclaimError:
        """Return an error that names the file and this line."""
        return AcclaimError(self.source, message, self.number)

    def unexpected(self, expected: str) -> AcclaimError:
        """Return an error with the line as found and as expected."""
        return self.error(f"found {quote(' '.join(self.words))}, expected {expected}")

    def numbers(self, words: Sequence[str], count: int, expected: str) -> tuple[float, ...]:
        """Return words as finite numbers; AcclaimError unless there are `count` of them."""
        if len(words) != count or not all(NUMBER.fullmatch(word) for word in words):
            raise self.unexpected(expected)
        values = tuple(map(float, words))
        if not all(math.isfinite(value) and abs(value) <= MAX_NUMBER for value in values):
            raise self.unexpected(f"numbers of at most {MAX_NUMBER:g}")
        return values


def read_lines(place: FileLike, most: int) -> Iterator[Line]:
    """Yield the lines of a file that have words, without comments.

    most: limit of the file's size, bytes. Any byte is text (Latin-1), since comments have paths in
    the code pages of their authors. Raises AcclaimError if the file cannot be read, is larger, or
    has a line longer than MAX_LINE; lines are read one at a time.
    """
    source, read, number = str(place), 0, 0
    try:
        with place.open("rb") as file:
            while content := file.readline(MAX_LINE + 1):
                read, number = read + len(content), number + 1
                if len(content) > MAX_LINE or read > most:
                    expected = f"expected at most {MAX_LINE} bytes a line and {most} in all"
                    raise AcclaimError(source, f"found more bytes than allowed, {expected}", number)
                words = tuple(content.decode("latin-1").partition("#")[0].split())
                if words:
                    yield Line(source, number, words)
    except OSError as fault:
        raise AcclaimError(source, f"cannot be read: {fault.strerror}") from fault


ROOT = "root"
MAX_BONES = 1000
"""Limit of bones, several times those of any character."""

MAX_ASF_BYTES = 4_000_000
"""Limit of a file's size: several times that of MAX_BONES bones."""

Vector = tuple[float, float, float]
IGNORED = {"version", "name", "documentation", "skin"}
"""Sections that do not change the motion."""


@dataclass(frozen=True)
class AsfBone:
    """One bone as written, from the end of its parent's bone.

    parent: name of the parent bone, "root" for the first ones. direction, length: in the file's
    unit and global axes. axis: angles, degrees, of the bone's own axes about the fixed X, Y, Z in
    this order. dof: free angles in the order of the motion file's columns, such as "XZ".
    """

    name: str
    parent: str
    direction: Vector
    length: float
    axis: Vector
    dof: str


@dataclass(frozen=True)
class AsfFile:
    """A skeleton file. source: its name. bones: depth first, parents before children."""

    source: str
    bones: tuple[AsfBone, ...]


@dataclass
class _Draft:
    """Entries of a bone before its `end`. line: of its `begin`."""

    line: Line
    words: dict[str, Line] = field(default_factory=dict)


def read_asf(place: FileLike) -> AsfFile:
    """Return the skeleton of a file.

    Raises AcclaimError, naming the line, for a file that breaks the grammar, and for what this
    reader does not know: angles in radians, bones that move or stretch, a root that is not at the
    origin, and axes in another order than XYZ.
    """
    source, sections = str(place), _sections(read_lines(place, MAX_ASF_BYTES))
    for name in ("units", "root", "bonedata", "hierarchy"):
        if not sections.get(name):
            raise AcclaimError(source, f"found no entry of section :{name}, expected some")
    _check_units(sections["units"])
    _check_root(sections["root"])
    drafts = _drafts(sections["bonedata"])
    bones = [_bone(drafts[name], name, parent) for name, parent in _tree(sections, drafts)]
    return AsfFile(source, tuple(bones))


def _sections(lines: Iterable[Line]) -> dict[str, list[Line]]:
    """Return the lines of each section; the words after its keyword are its first line."""
    sections: dict[str, list[Line]] = {}
    own: list[Line] | None = None
    for line in lines:
        if not line.words[0].startswith(":"):
            if own is None:
                raise line.unexpected("a section, such as :version")
            own.append(line)
            continue
        name = line.words[0][1:].lower()
        known = {*IGNORED, "units", "root", "bonedata", "hierarchy"}
        if name not in known or name in sections:
            raise line.unexpected(f"each of the sections {', '.join(sorted(known))} once")
        own = sections[name] = []
    return sections


def _check_units(lines: list[Line]) -> None:
    angles = [line for line in lines if line.words[0].lower() == "angle"]
    if len(angles) != 1 or angles[0].words[1:] != ("deg",):
        raise (angles or lines)[-1].unexpected("angle deg, once")


def _check_root(lines: list[Line]) -> None:
    """Raise AcclaimError for a root whose motion would be interpreted otherwise."""
    expected = {
        "order": ("TX", "TY", "TZ", "RX", "RY", "RZ"),
        "axis": ("XYZ",),
    }
    found = {line.words[0].lower(): line for line in lines}
    for key, words in expected.items():
        line = found.get(key, lines[0])
        if tuple(word.upper() for word in line.words[1:]) != words:
            raise line.unexpected(f"{key} {' '.join(words)}")
    for key in ("position", "orientation"):
        line = found.get(key, lines[0])
        if any(line.numbers(line.words[1:], 3, f"{key} 0 0 0")):
            raise line.unexpected(f"{key} 0 0 0")


def _drafts(lines: list[Line]) -> dict[str, _Draft]:
    """Return the bones between `begin` and `end` by their names."""
    drafts: dict[str, _Draft] = {}
    own: _Draft | None = None
    for line in lines:
        match line.words[0].lower():
            case "begin" if own is None:
                own = _Draft(line)
            case "end" if own is not None:
                name = _entry(own, "name", 1).words[1]
                if name in drafts or name == ROOT:
                    raise line.error(f"found bone {name!r} twice, expected a name of its own")
                drafts[name], own = own, None
            case "id" | "name" | "direction" | "length" | "axis" | "dof" as key if own is not None:
                own.words[key] = line
            case word if own is not None and (word == "limits" or word.startswith("(")):
                pass
            case "bodymass" | "cofmass" if own is not None:
                pass
            case _:
                raise line.unexpected("begin, an entry of a bone, or end")
    if own is not None:
        raise own.line.error("found a bone without end, expected one")
    if len(drafts) > MAX_BONES:
        raise lines[0].error(f"found {len(drafts)} bones, expected at most {MAX_BONES}")
    return drafts


def _entry(draft: _Draft, key: str, count: int) -> Line:
    """Return the line of an entry; AcclaimError unless it has `count` words after the key."""
    line = draft.words.get(key)
    if line is None:
        raise draft.line.error(f"found a bone without {key}, expected one")
    if len(line.words) != 1 + count:
        raise line.unexpected(f"{key} and {count} words")
    return line


def _bone(draft: _Draft, name: str, parent: str) -> AsfBone:
    direction, length = _entry(draft, "direction", 3), _entry(draft, "length", 1)
    axis = _entry(draft, "axis", 4)
    if axis.words[4].upper() != "XYZ":
        raise axis.unexpected("axis and three angles in the order XYZ")
    x, y, z = direction.numbers(direction.words[1:], 3, "direction and three numbers")
    a, b, c = axis.numbers(axis.words[1:4], 3, "axis, three angles and XYZ")
    (size,) = length.numbers(length.words[1:], 1, "length and a number")
    return AsfBone(name, parent, (x, y, z), size, (a, b, c), _dof(draft))


def _dof(draft: _Draft) -> str:
    """Return the free angles of a bone, such as "XZ"; they must be in the order of its axes."""
    line = draft.words.get("dof")
    if line is None:
        return ""
    free = "".join(word[1:].upper() for word in line.words[1:] if word.lower().startswith("r"))
    ordered = all("XYZ".find(a) < "XYZ".find(b) for a, b in pairwise(free))
    if len(free) != len(line.words) - 1 or not set(free) <= set("XYZ") or not ordered:
        raise line.unexpected("dof and some of rx, ry and rz, in this order")
    return free


def _tree(sections: dict[str, list[Line]], drafts: dict[str, _Draft]) -> list[tuple[str, str]]:
    """Return the names of all bones and of their parents, depth first."""
    children: dict[str, list[str]] = {}
    seen = {ROOT}
    lines = sections["hierarchy"]
    for line in lines:
        parent, *names = line.words
        if parent.lower() in ("begin", "end") and not names:
            continue
        if parent not in {ROOT, *drafts} or parent in children:
            raise line.unexpected("each bone once with its children")
        for name in names:
            if name not in drafts or name in seen:
                raise line.error(f"found child {name!r}, expected a bone that has no parent yet")
            seen.add(name)
        children[parent] = names
    ordered, ahead = [], [(name, ROOT) for name in reversed(children.get(ROOT, []))]
    while ahead:
        name, parent = ahead.pop()
        ordered.append((name, parent))
        ahead += [(child, name) for child in reversed(children.get(name, []))]
    if lost := sorted(drafts.keys() - {name for name, _ in ordered}):
        raise lines[-1].error(f"found no way from the root to {', '.join(lost)}, expected one")
    return ordered


FRAME = re.compile(r"\d{1,9}", re.ASCII)
MAX_AMC_BYTES = 500_000_000
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
    groups = _groups(read_lines(place, MAX_AMC_BYTES), most=max(len(HEADER), 1 + len(widths)))
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


def to_clip(skeleton: AsfFile, motion: AmcFile, *, metres_per_unit: float, rate: float) -> Clip:
    """Return the motion in metres; the files' axes are kept, and Y is up in those of CMU and HDM05.

    Neither file states the frame rate, frames a second. Raises AcclaimError for a motion of another
    skeleton, ValueError for a unit that is not positive.
    """
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise ValueError(f"metres_per_unit {metres_per_unit}, expected a positive number")
    moving = {bone.name for bone in skeleton.bones if bone.dof}
    if motion.angles.keys() != moving:
        other = sorted(motion.angles.keys() ^ moving)
        raise AcclaimError(motion.source, f"only it or {skeleton.source} has angles of {other}")
    root = quat.from_euler(np.deg2rad(motion.root[:, 5:2:-1]), "ZYX")
    turned = [root, *(_rotations(bone, motion) for bone in skeleton.bones)]
    joints = _joints(skeleton, metres_per_unit)
    path = metres_per_unit * motion.root[:, :3]
    return clip.assemble(joints, np.stack(turned, axis=1), path, joints.offsets, rate)


def _rotations(bone: AsfBone, motion: AmcFile) -> Floats:
    """Return the rotations (F, 4) of a bone local to its parent."""
    if not bone.dof:
        return np.tile(quat.IDENTITY, (len(motion), 1))
    own = quat.from_euler(np.deg2rad(np.array(bone.axis)[::-1]), "ZYX")
    free = quat.from_euler(np.deg2rad(motion.angles[bone.name][:, ::-1]), bone.dof[::-1])
    return quat.mul(quat.mul(own, free), quat.conj(own))


def _joints(skeleton: AsfFile, metres_per_unit: float) -> Skeleton:
    """Return the root and a joint at the start of each bone, m."""
    names = [ROOT, *(bone.name for bone in skeleton.bones)]
    vectors = {
        bone.name: metres_per_unit * bone.length * np.array(bone.direction)
        for bone in skeleton.bones
    }
    parents = [bone.parent for bone in skeleton.bones]
    leaves = [name for name in names[1:] if name not in parents]
    return Skeleton(
        tuple(names),
        (-1, *(names.index(parent) for parent in parents)),
        np.stack([np.zeros(3), *(vectors.get(parent, np.zeros(3)) for parent in parents)]),
        tuple(names.index(name) for name in leaves),
        np.stack([vectors[name] for name in leaves]),
    )
