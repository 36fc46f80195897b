"""Reader of Acclaim skeleton files (ASF): bones with directions, lengths and axes.

The format: Schafer, "Acclaim Skeleton File Definition V1.10" (1994). Only what the files of CMU and
HDM05 use is read; anything else that would change the motion is refused.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise

from posefield.common.errors import AcclaimError
from posefield_train.source.acclaim.acclaim_text import FileLike, Line, read_lines

ROOT = "root"
MAX_BONES = 1000
"""Limit of bones, several times those of any character."""

MAX_BYTES = 4_000_000
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
    source, sections = str(place), _sections(read_lines(place, MAX_BYTES))
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
