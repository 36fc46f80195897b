"""Acclaim motion files: a skeleton (ASF), motions of it (AMC), and their conversion to a clip.

The format: Schafer, "Acclaim Skeleton File Definition V1.10" (1994). What has one meaning alone is
read, with notes on what is passed over; anything else that would change the motion is refused.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.errors import AcclaimError
from posefield.common.units import Floats
from posefield.motion import clip, quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.bvh import MAX_POSES, Readable
from posefield_train.source.bvh_hierarchy import MAX_NUMBER, NUMBER, Vector, foreign_encoding, quote

ROOT = "root"
MAX_BONES = 1000
"""Limit of bones, several times those of any character."""
MAX_LINE = 10_000
"""Limit of a line's length, bytes: hundreds of times that of a bone with six numbers."""
MAX_ASF_BYTES, MAX_AMC_BYTES = 4_000_000, 500_000_000
"""Limits of a file's size: several times MAX_BONES, and 45 minutes of 31 joints at 120 frames/s."""
NEEDED = ("units", "root", "bonedata", "hierarchy")
IGNORED = ("version", "name", "namespace", "documentation", "skin")
"""Sections that do not change the motion."""
CHANNELS = ["TX", "TY", "TZ", "RX", "RY", "RZ"]
ANGLES = {"deg": 1.0, "degrees": 1.0, "rad": math.degrees(1.0), "radians": math.degrees(1.0)}
"""Units of angles, degrees."""
MAX_HEADER = 100
"""Limit of lines before the first frame."""
FRAME = re.compile(r"\d{1,9}", re.ASCII)


@dataclass(frozen=True)
class AsfBone:
    """One bone as written, from the end of its parent's bone.

    parent: name of the parent bone, "root" for the first ones. direction, length: in the file's
    unit and global axes. axis: angles, degrees, of the bone's own axes about the fixed X, Y, Z in
    this order. dof: free angles in the order of the motion file's columns, such as "XZ". order: in
    which they turn the bone.
    """

    name: str
    parent: str
    direction: Vector
    length: float
    axis: Vector
    dof: str
    order: str = "XYZ"


@dataclass(frozen=True)
class AsfFile:
    """A skeleton file.

    source: its name. bones: depth first, parents before children. columns: of the root in motion
    files, such as "TX". order: in which its angles turn it. angle: unit of angles, degrees.
    """

    source: str
    bones: tuple[AsfBone, ...]
    columns: tuple[str, ...]
    order: str
    angle: float
    notes: tuple[str, ...]


@dataclass(frozen=True)
class AmcFile:
    """A motion of one skeleton.

    source: the file's name. root (F, 6): position in the file's unit, and angles about X, Y and Z,
    degrees. angles: of each bone by its name (F, k), degrees, in the order of its `dof`.
    """

    source: str
    root: Floats
    angles: dict[str, Floats]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Line:
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


def _read_lines(path: Readable, max_bytes: int) -> Iterator[_Line]:
    """Yield the lines of a file that have words, without comments.

    max_bytes: limit of the file's size, bytes. Any byte is text (Latin-1), since comments have
    paths in the code pages of their authors. Raises AcclaimError if the file cannot be read, is
    larger, or has a line longer than MAX_LINE; lines are read one at a time.
    """
    source, read, number = str(path), 0, 0
    try:
        with path.open("rb") as file:
            while content := file.readline(MAX_LINE + 1):
                read, number = read + len(content), number + 1
                if len(content) > MAX_LINE or read > max_bytes:
                    expected = f"expected at most {MAX_LINE} bytes a line and {max_bytes} in all"
                    raise AcclaimError(source, f"found more bytes than allowed, {expected}", number)
                if number == 1 and (packed := foreign_encoding(content)):
                    message = f"found {packed}, expected plain text"
                    raise AcclaimError(source, message, number)
                text = content.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
                words = tuple(text.partition("#")[0].split())
                if words:
                    yield _Line(source, number, words)
    except OSError as fault:
        raise AcclaimError(source, f"cannot be read: {fault.strerror}") from fault


def read_asf(path: Readable) -> AsfFile:
    """Return the skeleton of a file.

    The root's position is that of the motion, whatever the skeleton says. Raises AcclaimError,
    naming the line, for a file that breaks the grammar, and for what this reader does not know:
    bones that move or stretch, a root that is turned, and turned axes in another order than XYZ.
    """
    sections: dict[str, list[_Line]] = {}
    notes = list[str]()
    section: list[_Line] | None = None
    for line in _read_lines(path, MAX_ASF_BYTES):
        if line.words[0].startswith(":"):
            name = line.words[0][1:].lower()
            if name in sections:
                raise line.unexpected("each section once")
            if name not in (*IGNORED, *NEEDED):
                notes.append(f"section :{name} of the skeleton is unknown: left out")
            section = sections[name] = []
        elif section is None:
            raise line.unexpected("a section, such as :version")
        else:
            section.append(line)
    for name in NEEDED:
        if not sections.get(name):
            raise AcclaimError(str(path), f"found no entry of section :{name}, expected some")
    units = sections["units"]
    angles = [line for line in units if line.words[0].lower() == "angle"]
    if len(angles) != 1 or angles[0].words[-1].lower() not in ANGLES:
        raise (angles or units)[-1].unexpected("angle deg or angle rad, once")
    angle = ANGLES[angles[0].words[-1].lower()]
    root = {line.words[0].lower(): line for line in sections["root"]}

    order, axes = (root.get(key, sections["root"][0]) for key in ("order", "axis"))
    columns = tuple(word.upper() for word in order.words[1:])
    if sorted(columns) != sorted(CHANNELS):
        raise order.unexpected(f"order and {' '.join(CHANNELS)}, each once")
    if len(axes.words) != 2 or sorted(axes.words[1].upper()) != [*"XYZ"]:
        raise axes.unexpected("axis and XYZ, in any order")
    for key in ("position", "orientation"):
        line = root.get(key, sections["root"][0])
        if any(line.numbers(line.words[1:], 3, f"{key} 0 0 0")):
            if key == "orientation":
                raise line.unexpected(f"{key} 0 0 0")
            notes.append("the root's position in the skeleton is replaced by that of the motion")
    drafts = _bone_drafts(sections["bonedata"])
    tree = _tree(sections["hierarchy"], drafts)
    bones = tuple(_bone(drafts[name], name, parent, angle) for name, parent in tree)
    return AsfFile(str(path), bones, columns, axes.words[1].upper(), angle, tuple(notes))


_Draft = dict[str, _Line]
"""Lines of a bone by their keys, from `begin` on."""


def _bone_drafts(lines: Sequence[_Line]) -> dict[str, _Draft]:
    drafts: dict[str, _Draft] = {}
    draft: _Draft = {}
    for line in lines:
        match line.words[0].lower():
            case "begin" if not draft:
                draft = {"begin": line}
            case "end" if draft:
                name = _entry(draft, "name", 1).words[1]
                if name in drafts or name == ROOT:
                    raise line.error(f"found bone {name!r} twice, expected a name of its own")
                drafts[name], draft = draft, {}
            case "id" | "name" | "direction" | "length" | "axis" | "dof" as key if draft:
                draft[key] = line
            case "limits" | "bodymass" | "cofmass" if draft:
                pass
            case word if not draft or not word.startswith("("):
                raise line.unexpected("begin, an entry of a bone, or end")
    if draft:
        raise draft["begin"].error("found a bone without end, expected one")
    if len(drafts) > MAX_BONES:
        raise lines[0].error(f"found {len(drafts)} bones, expected at most {MAX_BONES}")
    return drafts


def _entry(draft: _Draft, key: str, count: int) -> _Line:
    """Return the line of an entry; AcclaimError unless it has `count` words after the key."""
    if key not in draft:
        raise draft["begin"].error(f"found a bone without {key}, expected one")
    if len(draft[key].words) != 1 + count:
        raise draft[key].unexpected(f"{key} and {count} words")
    return draft[key]


def _bone(draft: _Draft, name: str, parent: str, angle: float) -> AsfBone:
    direction, length = _entry(draft, "direction", 3), _entry(draft, "length", 1)
    axis = _entry(draft, "axis", 4)
    order = axis.words[4].upper()
    x, y, z = direction.numbers(direction.words[1:], 3, "direction and three numbers")
    a, b, c = axis.numbers(axis.words[1:4], 3, "axis, three angles and XYZ")
    if sorted(order) != [*"XYZ"] or (order != "XYZ" and any((a, b, c))):
        raise axis.unexpected("axis and three angles in the order XYZ, or zeros in any")
    (size,) = length.numbers(length.words[1:], 1, "length and a number")
    words = draft["dof"].words[1:] if "dof" in draft else ()
    free = "".join(word[1:].upper() for word in words if word.lower().startswith("r"))
    if len(free) != len(words) or not set(free) <= set("XYZ") or len(set(free)) != len(free):
        raise draft["dof"].unexpected("dof and some of rx, ry and rz, each once")
    axes = (angle * a, angle * b, angle * c)
    return AsfBone(name, parent, (x, y, z), size, axes, free, order)


def _tree(lines: Sequence[_Line], drafts: dict[str, _Draft]) -> list[tuple[str, str]]:
    """Return the names of all bones and of their parents, depth first."""
    children: dict[str, list[str]] = {}
    named_bones = {ROOT}
    for line in lines:
        parent, *names = line.words
        if parent.lower() in ("begin", "end") and not names:
            continue
        if parent not in {ROOT, *drafts} or parent in children:
            raise line.unexpected("each bone once with its children")
        for name in names:
            if name not in drafts or name in named_bones:
                raise line.error(f"found child {name!r}, expected a bone that has no parent yet")
            named_bones.add(name)
        children[parent] = names
    ordered, stack = [], [(name, ROOT) for name in reversed(children.get(ROOT, []))]
    while stack:
        name, parent = stack.pop()
        ordered.append((name, parent))
        stack += [(child, name) for child in reversed(children.get(name, []))]
    if lost := sorted(drafts.keys() - {name for name, _ in ordered}):
        raise lines[-1].error(f"found no way from the root to {', '.join(lost)}, expected one")
    return ordered


def read_amc(path: Readable, skeleton: AsfFile) -> AmcFile:
    """Return the motion of a file, which has values for every free angle of the skeleton.

    Raises AcclaimError, naming the line, for a file that breaks the grammar, that belongs to
    another skeleton, or whose frames are not numbered one after another.
    """
    widths = {ROOT: 6, **{bone.name: len(bone.dof) for bone in skeleton.bones if bone.dof}}
    groups = _groups(_read_lines(path, MAX_AMC_BYTES), max(MAX_HEADER, 1 + len(widths)))
    angle, notes = skeleton.angle, list[str]()
    for line in next(groups):
        key = line.words[0].lower()
        if not key.startswith(":"):
            raise line.unexpected("a header such as :DEGREES, then frames")
        angle = ANGLES.get(key[1:], angle)
        if key[1:] not in ("fully-specified", *ANGLES):
            notes.append(f"the header {' '.join(line.words)} is unknown: left out")
    max_frames = MAX_POSES // (len(skeleton.bones) + 1)
    frames: list[Floats] = []
    before = None
    for first, *lines in groups:
        number = int(first.words[0])
        if before is not None and number != before + 1:
            raise first.unexpected(f"frame {before + 1}")
        if len(frames) == max_frames:
            raise first.error(f"found more than {max_frames} frames, expected at most as many")
        values: dict[str, tuple[float, ...]] = {}
        for line in lines:
            name, *words = line.words
            if name not in widths or name in values:
                raise line.unexpected("each bone of the skeleton that moves, once a frame")
            values[name] = line.numbers(words, widths[name], f"{name} and {widths[name]} numbers")
        if lost := sorted(widths.keys() - values.keys()):
            raise first.error(f"found no values of {', '.join(lost)}, expected them in each frame")
        frames.append(np.array([value for name in widths for value in values[name]]))
        before = number
    if not frames:
        raise AcclaimError(str(path), "found no frame, expected at least one")
    splits = np.cumsum([*widths.values()])[:-1]
    columns = dict(zip(widths, np.split(np.stack(frames), splits, axis=1), strict=True))
    root = columns.pop(ROOT)[:, [skeleton.columns.index(name) for name in CHANNELS]]
    root[:, 3:] *= angle
    angles = {name: angle * turns for name, turns in columns.items()}
    return AmcFile(str(path), root, angles, tuple(notes))


def _groups(lines: Iterator[_Line], max_lines: int) -> Iterator[list[_Line]]:
    """Yield the header's lines, then those of each frame, its number first.

    Raises AcclaimError for more than `max_lines` lines in one of them.
    """
    group: list[_Line] = []
    for line in lines:
        if len(line.words) == 1 and FRAME.fullmatch(line.words[0]):
            yield group
            group = []
        elif len(group) == max_lines:
            raise line.unexpected("the number of the next frame")
        group.append(line)
    yield group


def _turns(angles: Floats, axes: str, order: str) -> Floats:
    # The last turn is the outermost.
    outwards = [axis for axis in reversed(order) if axis in axes]
    columns = [axes.index(axis) for axis in outwards]
    return quat.from_euler(np.deg2rad(angles[:, columns]), "".join(outwards))


def to_clip(skeleton: AsfFile, motion: AmcFile, *, metres_per_unit: float, rate: float) -> Clip:
    """Return the motion in metres; the files' axes are kept, and Y is up in those of CMU and HDM05.

    A bone turns about axes of its own: with C for the rotation to these axes and M for the product
    of its free angles, its rotation local to the parent is C M C⁻¹, with all axes parallel to the
    global ones at rest. A joint of the clip stands where its bone begins, so that its offset is the
    bone of its parent, and the bones at the ends become end sites. Neither file states the frame
    rate, frames a second. Raises AcclaimError for a motion of another skeleton, ValueError for a
    unit that is not positive.
    """
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise ValueError(f"metres_per_unit {metres_per_unit}, expected a positive number")
    bones = skeleton.bones
    other = motion.angles.keys() ^ {bone.name for bone in bones if bone.dof}
    if other:
        message = f"only it or {skeleton.source} has angles of {sorted(other)}"
        raise AcclaimError(motion.source, message)
    rotations = [_turns(motion.root[:, 3:], "XYZ", skeleton.order)]
    for bone in bones:
        if bone.dof:
            axes = _turns(np.array([bone.axis]), "XYZ", "XYZ")
            turns = quat.mul(axes, _turns(motion.angles[bone.name], bone.dof, bone.order))
            rotations.append(quat.mul(turns, quat.conj(axes)))
        else:
            rotations.append(np.tile(quat.IDENTITY, (len(motion.root), 1)))
    names = [ROOT, *(bone.name for bone in bones)]
    vectors = {
        bone.name: metres_per_unit * bone.length * np.array(bone.direction) for bone in bones
    }
    parents = [bone.parent for bone in bones]
    leaves = [name for name in names[1:] if name not in parents]
    joints = Skeleton(
        tuple(names),
        (-1, *(names.index(parent) for parent in parents)),
        np.stack([np.zeros(3), *(vectors.get(parent, np.zeros(3)) for parent in parents)]),
        tuple(names.index(name) for name in leaves),
        np.stack([vectors[name] for name in leaves]),
    )
    root_path = metres_per_unit * motion.root[:, :3]
    return clip.assemble(joints, np.stack(rotations, axis=1), root_path, joints.offsets, rate)
