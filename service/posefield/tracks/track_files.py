"""Readers of track files, in blocks of rows: SUMO FCD, JuPedSim, CSV and CommonRoad.

Blocks follow the file, so a file of any length is read in the memory of one block.
"""

import csv
import itertools
import math
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Literal
from xml.parsers import expat

import numpy as np

from posefield.common.errors import FileError, InvalidField
from posefield.tracks import track
from posefield.tracks.track import TrackRows, TrackSet

BLOCK_ROWS = 16_384
"""Rows of a block, which take some 3 MB while they are read."""
CHUNK = 1 << 20
LONGEST_LINE = 100_000
HeadingUnit = Literal["degrees", "radians"]
COLUMNS = ("time", "id", "x", "y")
DATABASE = b"SQLite format 3\0"
MOST_JUMPS = 10
"""Jumps of a person one after the other that are no jumps: the unit is another."""


@dataclass(frozen=True)
class TrackReading:
    """Conventions of a file that it does not state.

    heading_unit: of the headings of a table, from east against the clock; they are refused without
    it. y_down: whether y points down, as in images; angles turn over with it. split: time without a
    sample, s, after which, as after a jump, a person comes back as another leg.
    """

    heading_unit: HeadingUnit | None = None
    y_down: bool = False
    split: float | None = None


DEFAULT_READING = TrackReading()
Row = tuple[str, float, float, float, float, int, str]
"""Id, time, x, y, angle from east against the clock, rad, not a number without one, line, and what
is wrong with a cell, which leaves no number; empty if all are right."""


def read_tracks(
    path: Path, reading: TrackReading = DEFAULT_READING, skip_bad: bool = False
) -> TrackSet:
    """Return the tracks of a file. skip_bad: as of `track.group`.

    Raises FileError for a file that is none, and as `track.group` does.
    """
    return track.group(row_blocks(path, reading), path, skip_bad)


def row_blocks(path: Path, reading: TrackReading = DEFAULT_READING) -> Iterator[TrackRows]:
    """Yield the rows of a track file in blocks of at most `BLOCK_ROWS`.

    The format follows from the ending: xml (SUMO FCD, or CommonRoad by its root element), sqlite
    (JuPedSim), txt (JuPedSim) or csv. Raises FileError, with the line where there is one.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise InvalidField("trajectories", f"{path.name!r} ends in none of {', '.join(READERS)}")
    if reading.heading_unit and reader is not _table_rows:
        text = f"{reading.heading_unit!r}, expected none: {path.suffix} files state it"
        raise InvalidField("heading_unit", text)
    try:
        rows = reader(path, reading)
        if reading.split is not None:
            rows = _legs(path, rows, reading.split)
        while batch := list(itertools.islice(rows, BLOCK_ROWS)):
            people, *numbers, lines, texts = zip(*batch, strict=True)
            if "" in people:
                raise FileError(path, "a person without id", lines[people.index("")])
            times, x, y, angles = np.array(numbers, dtype=np.float64)
            points = track.floor_points(x, -y if reading.y_down else y)
            headings = track.floor_headings(-angles if reading.y_down else angles)
            pairs = zip(reversed(people), reversed(texts), strict=True)
            faults = {person: fault for person, fault in pairs if fault}
            yield TrackRows(people, times, points, headings, np.array(lines, np.int64), faults)
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    except UnicodeDecodeError as fault:
        raise FileError(path, f"no text in UTF-8: byte {fault.start}") from fault


def _legs(path: Path, rows: Iterator[Row], longest: float) -> Iterator[Row]:
    """Yield rows whose people have another id after a jump or a longer time without a sample."""
    before: dict[str, tuple[float, float, float, int, int]] = {}
    for person, time, x, y, angle, line, fault in rows:
        then, east, north, leg, jumps = before.get(person, (time, x, y, 1, 0))
        step, distance = time - then, math.hypot(x - east, y - north)
        jumped = step > 0.0 and distance > max(track.JUMP, track.FASTEST * step)
        jumps = jumps + 1 if jumped else 0
        if jumps == MOST_JUMPS:
            text = f"person {person!r}: {jumps} jumps one after the other"
            raise FileError(path, f"{text}: {track.unit_question(distance / step)}", line)
        leg += jumped or step > longest
        before[person] = time, x, y, leg, jumps
        yield track.leg_name(person, leg), time, x, y, angle, line, fault


def _number(path: Path, text: str, name: str, line: int) -> float:
    try:
        return float(text)
    except ValueError as fault:
        raise FileError(path, f"{name} {text[:40]!r}, expected a number", line) from fault


def _numbers(names: Sequence[str], cells: Sequence[Any]) -> tuple[list[float], str]:
    """Return the numbers of cells, and what is wrong if one is none; not a number each, then."""
    numbers = list[float]()
    with suppress(TypeError, ValueError):
        numbers += map(float, cells)
    finite = [*map(math.isfinite, numbers), len(numbers) == len(cells)]
    if False in finite[: len(names)]:
        at = finite.index(False)
        fault = f"{names[at]} {str(cells[at])[:40]!r}, expected a number"
    elif len(cells) != len(names):
        fault = f"{len(cells)} numbers, expected {', '.join(names)}"
    else:
        return numbers, ""
    return [math.nan] * len(names), fault


def _table_rows(path: Path, reading: TrackReading) -> Iterator[Row]:
    """Yield the rows of a table with the columns time, id, x, y and maybe heading."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        lines = csv.reader(_lines(path, file))
        head = [name.strip() for name in next(lines, [])]
        if tuple(head) not in (COLUMNS, (*COLUMNS, "heading")):
            raise FileError(
                path,
                f"columns {', '.join(head)[:80] or 'none'}, expected time,id,x,y or "
                "time,id,x,y,heading",
                1,
            )
        headed, unit = len(head) > len(COLUMNS), reading.heading_unit
        if headed and unit is None:
            raise FileError(
                path,
                "headings of an unknown unit, expected --heading-unit degrees or radians, counted "
                "from east against the clock",
                1,
            )
        if unit and not headed:
            raise InvalidField("heading_unit", f"{unit!r}, but {path.name} has no column heading")
        names, size = (head[0], *head[2:]), math.radians(1.0) if unit == "degrees" else 1.0
        for cells in lines:
            if cells:
                person = cells.pop(1).strip() if len(cells) > 1 else ""
                (time, x, y, *angles), fault = _numbers(names, cells)
                angle = size * angles[0] if angles else math.nan
                yield person, time, x, y, angle, lines.line_num, fault


def _lines(path: Path, file: IO[str]) -> Iterator[str]:
    """Yield the lines of a text, none longer than `LONGEST_LINE`."""
    number = 0
    while line := file.readline(LONGEST_LINE):
        number += 1
        if len(line) == LONGEST_LINE:
            raise FileError(path, f"{LONGEST_LINE} characters or more in a line", number)
        yield line


def _jupedsim_text_rows(path: Path, reading: TrackReading) -> Iterator[Row]:
    """Yield the rows of a text with `# framerate:` and columns id, frame, x, y, m."""
    rate, unit = None, 1.0
    with path.open(encoding="utf-8-sig") as file:
        for number, line in enumerate(_lines(path, file), 1):
            words = line.split()
            if line.startswith("#"):
                name, _, value = line.lstrip("# ").partition(":")
                if name.strip().lower() == "framerate":
                    rate = _number(path, (value.split() or [""])[0], "framerate", number)
                if "x/cm" in line.lower():
                    unit = 0.01
            elif words:
                if rate is None or not 0.0 < rate < math.inf:
                    raise FileError(
                        path, f"frame rate {rate}, expected '# framerate:' above 0", number
                    )
                (frame, x, y), fault = _numbers(("frame", "x", "y"), words[1:4])
                yield words[0], frame / rate, unit * x, unit * y, math.nan, number, fault


def _jupedsim_rows(path: Path, reading: TrackReading) -> Iterator[Row]:
    """Yield the rows of a database: `trajectory_data` at `metadata.fps` frames a second."""
    with path.open("rb") as file:
        if file.read(len(DATABASE)) != DATABASE:
            raise FileError(path, "no SQLite database, expected one that JuPedSim wrote")
    try:
        uri = f"{path.resolve().as_uri()}?mode=ro&immutable=1"
        with closing(sqlite3.connect(uri, uri=True)) as database:
            stated = database.execute("select value from metadata where key = 'fps'").fetchone()
            rate = _number(path, str(stated[0]) if stated else "none", "metadata fps", 1)
            if not 0.0 < rate < math.inf:
                raise FileError(path, f"metadata fps {rate:g}, expected a number above 0")
            # The first frame is written before anybody is turned: its orientation is the next one.
            turned = "select id, min(frame), ori_x, ori_y from trajectory_data "
            turned += "where ori_x != 0 or ori_y != 0 group by id"
            axes = {person: axis for person, _, *axis in database.execute(turned)}
            rows = database.execute(
                "select rowid, id, frame, pos_x, pos_y, ori_x, ori_y from trajectory_data "
                "order by frame, id"
            )
            names = "frame", "pos_x", "pos_y", "ori_x", "ori_y"
            for line, person, *cells in rows:
                (frame, x, y, *axis), fault = _numbers(names, cells)
                if not fault and any(axis):
                    axes[person] = axis
                east, north = axes.get(person, (0.0, 0.0))
                angle = math.atan2(north, east) if (east or north) else math.nan
                yield str(person), frame / rate, x, y, angle, line, fault
    except sqlite3.Error as error:
        raise FileError(path, f"no trajectories of JuPedSim: {error}") from error


def _parse(
    path: Path, start: Callable[[str, dict[str, str], int], None], end: Callable[[str, str], None]
) -> Iterator[None]:
    """Parse XML, and yield after each chunk; entities and document types are refused: no bombs."""
    parser, texts = expat.ParserCreate(), list[str]()

    def finish(name: str) -> None:
        end(name, "".join(texts).strip())
        texts.clear()

    def refuse(*_: Any) -> None:
        raise FileError(path, "a document type or an entity, expected elements alone")

    parser.buffer_text = True
    parser.StartElementHandler = lambda name, values: start(name, values, parser.CurrentLineNumber)
    parser.EndElementHandler = finish
    # Numbers are shorter.
    parser.CharacterDataHandler = lambda text: texts.append(text[-200:])
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        with path.open("rb") as file:
            while chunk := file.read(CHUNK):
                parser.Parse(chunk)
                yield
            parser.Parse(b"", True)
            yield
    except expat.ExpatError as fault:
        message = expat.ErrorString(fault.code)
        raise FileError(path, f"no XML: {message}", fault.lineno) from fault


@dataclass
class _SumoReader:
    """Rows of the persons on foot in SUMO's floating car data, as its elements come."""

    path: Path
    rows: list[Row]
    time: float | None = None
    riding: set[str] = field(default_factory=set)
    legs: dict[str, int] = field(default_factory=dict)

    def end(self, name: str, text: str) -> None:
        """Take the end of an element: all is in its attributes."""

    def start(self, name: str, values: dict[str, str], line: int) -> None:
        """Take an element."""
        if name == "timestep":
            self.time = _number(self.path, values.get("time", ""), "time", line)
        elif name == "person":
            if self.time is None:
                raise FileError(self.path, "a person outside of a timestep", line)
            person = values.get("id", "")
            if values.get("vehicle"):
                self.riding.add(person)
                return
            if person in self.riding:
                self.riding.remove(person)
                self.legs[person] = self.legs.get(person, 1) + 1
            names = "x", "y", "angle"
            (x, y, angle), fault = _numbers(names, [values.get(name, "") for name in names])
            # SUMO counts degrees from north with the clock.
            row = self.time, x, y, math.radians(90.0 - angle), line, fault
            self.rows.append((track.leg_name(person, self.legs.get(person, 1)), *row))


@dataclass
class _CommonRoadReader:
    """Rows of the pedestrians of a CommonRoad scenario, as its elements come."""

    path: Path
    rows: list[Row]
    step: float = math.nan
    person: str = ""
    kind: str = ""
    line: int = 0
    elements: list[str] = field(default_factory=list)
    state: dict[str, str] = field(default_factory=dict)

    def start(self, name: str, values: dict[str, str], line: int) -> None:
        """Take an element."""
        self.elements.append(name)
        self.line = line
        if name == "commonRoad":
            self.step = _number(self.path, values.get("timeStepSize", ""), "timeStepSize", line)
        elif name == "dynamicObstacle":
            self.person, self.kind = values.get("id", ""), ""

    def end(self, name: str, text: str) -> None:
        """Take the end of an element, and its text."""
        self.elements.pop()
        above = self.elements[-1] if self.elements else ""
        if name == "type" and above == "dynamicObstacle":
            self.kind = text
        elif (above, name) in (("point", "x"), ("point", "y")):
            self.state[name] = text
        elif name == "exact" and above in ("time", "orientation"):
            self.state[above] = text
        elif name in ("initialState", "state"):
            if self.kind == "pedestrian":
                names = "time", "x", "y", *(["orientation"] * ("orientation" in self.state))
                cells = [self.state.get(name, "none exact") for name in names]
                (time, *numbers), fault = _numbers(names, cells)
                x, y, angle = numbers if len(numbers) > 2 else (*numbers, math.nan)
                self.rows.append((self.person, self.step * time, x, y, angle, self.line, fault))
            self.state = {}


ROOTS: dict[str, Callable[[Path, list[Row]], _SumoReader | _CommonRoadReader]] = {
    "fcd-export": _SumoReader,
    "commonRoad": _CommonRoadReader,
}
"""Readers of XML by its root element."""


def _xml_rows(path: Path, reading: TrackReading) -> Iterator[Row]:
    """Yield the rows of people in SUMO's floating car data or a CommonRoad scenario."""
    rows: list[Row] = []
    readers: list[_SumoReader | _CommonRoadReader] = []

    def start(name: str, values: dict[str, str], line: int) -> None:
        if not readers:
            if name not in ROOTS:
                expected = " or ".join(map(repr, ROOTS))
                raise FileError(path, f"root element {name!r}, expected {expected}", line)
            readers.append(ROOTS[name](path, rows))
        readers[0].start(name, values, line)

    for _ in _parse(path, start, lambda name, text: readers[0].end(name, text)):
        yield from rows
        rows.clear()


READERS: dict[str, Callable[[Path, TrackReading], Iterator[Row]]] = {
    ".xml": _xml_rows,
    ".sqlite": _jupedsim_rows,
    ".sqlite3": _jupedsim_rows,
    ".db": _jupedsim_rows,
    ".txt": _jupedsim_text_rows,
    ".csv": _table_rows,
}
"""Readers by the ending of a file."""
