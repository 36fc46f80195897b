"""Readers of track files, in blocks of rows: SUMO FCD, JuPedSim, CSV and CommonRoad.

Blocks follow the file, so a file of any length is read in the memory of one block.
"""

import csv
import itertools
import math
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Literal
from xml.parsers import expat

import numpy as np

from posefield.common.errors import FileError, InvalidField
from posefield.tracks import track
from posefield.tracks.track import MAX_ANGLE, TrackRows, TrackSet

BLOCK_ROWS = 65_536
"""Rows of a block, which take some 10 MB while they are read."""
CHUNK = 1 << 20
LONGEST_LINE = 100_000
HeadingUnit = Literal["degrees", "radians"]
COLUMNS = ("time", "id", "x", "y")
DATABASE = b"SQLite format 3\0"
GEOGRAPHIC = 0.01
"""Share of the stated speed that people in degrees of longitude and latitude seem to move at."""


@dataclass(frozen=True)
class TrackReading:
    """Conventions of a table that the file does not state.

    heading_unit: of the headings of a table, from east against the clock; they are refused without
    it. y_down: whether y of a table points down, as in images; its angles turn over with it. split:
    time without a sample, s, after which, as after a jump, a person comes back as another leg.
    """

    heading_unit: HeadingUnit | None = None
    y_down: bool = False
    split: float | None = None


DEFAULT_READING = TrackReading()
Row = tuple[str, float, float, float, float, int]
"""Id, time, x, y, angle from east against the clock, rad, not a number without one, and line."""


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
    try:
        rows = reader(path, reading)
        if reading.split is not None:
            rows = _legs(rows, reading.split)
        while batch := list(itertools.islice(rows, BLOCK_ROWS)):
            people, *numbers, lines = zip(*batch, strict=True)
            times, x, y, angles = np.array(numbers, dtype=np.float64)
            points = track.floor_points(x, -y if reading.y_down else y)
            angles = -angles if reading.y_down else angles
            headings = None if np.isnan(angles).all() else track.floor_headings(angles)
            yield TrackRows(people, times, points, headings, np.array(lines, dtype=np.int64))
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    except UnicodeDecodeError as fault:
        raise FileError(path, f"no text in UTF-8: byte {fault.start}") from fault


def _legs(rows: Iterator[Row], longest: float) -> Iterator[Row]:
    """Yield rows whose people have another id after a jump or a longer time without a sample."""
    before: dict[str, tuple[float, float, float, int]] = {}
    for person, time, x, y, angle, line in rows:
        then, east, north, leg = before.get(person, (time, x, y, 1))
        step, distance = time - then, math.hypot(x - east, y - north)
        if step > longest or (step > 0.0 and distance > max(track.JUMP, track.FASTEST * step)):
            leg += 1
        before[person] = time, x, y, leg
        yield track.leg_name(person, leg), time, x, y, angle, line


def _number(path: Path, text: str, name: str, line: int) -> float:
    try:
        return float(text)
    except ValueError as fault:
        raise FileError(path, f"{name} {text[:40]!r}, expected a number", line) from fault


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
        unit = reading.heading_unit
        if len(head) > len(COLUMNS) and unit is None:
            raise FileError(
                path,
                "headings of an unknown unit, expected --heading-unit degrees or radians, counted "
                "from east against the clock",
                1,
            )
        for cells in lines:
            if not cells:
                continue
            if len(cells) != len(head):
                raise FileError(path, f"{len(cells)} cells, expected {len(head)}", lines.line_num)
            line = lines.line_num
            time, x, y, *angles = (
                _number(path, cells[column], head[column], line)
                for column in (0, *range(2, len(head)))
            )
            angle = _angle(path, angles[0], unit, line) if unit and angles else math.nan
            yield cells[1].strip(), time, x, y, angle, line


def _angle(path: Path, value: float, unit: HeadingUnit, line: int) -> float:
    """Return an angle, rad, of a table; FileError for one that cannot be of the unit."""
    if abs(value) > MAX_ANGLE[unit]:
        other = ": degrees?" if unit == "radians" else ""
        raise FileError(
            path, f"heading {value:g} {unit}, expected at most {MAX_ANGLE[unit]:.4g}{other}", line
        )
    return math.radians(value) if unit == "degrees" else value


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
                if len(words) < 4:
                    raise FileError(
                        path, f"{len(words)} columns, expected id, frame, x and y", number
                    )
                frame, x, y = (
                    _number(path, word, name, number)
                    for word, name in zip(words[1:4], ("frame", "x", "y"), strict=True)
                )
                yield words[0], frame / rate, unit * x, unit * y, math.nan, number


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
                "select rowid, frame, id, pos_x, pos_y, ori_x, ori_y from trajectory_data "
                "order by frame, id"
            )
            for line, frame, person, *values in rows:
                if not all(isinstance(value, int | float) for value in (frame, *values)):
                    raise FileError(
                        path, f"values {frame}, {values} in trajectory_data, expected numbers", line
                    )
                x, y, east, north = map(float, values)
                if east or north:
                    axes[person] = [east, north]
                east, north = axes.get(person, (0.0, 0.0))
                angle = math.atan2(north, east) if (east or north) else math.nan
                yield str(person), frame / rate, x, y, angle, line
    except sqlite3.Error as fault:
        raise FileError(path, f"no trajectories of JuPedSim: {fault}") from fault


@dataclass
class _XmlEvents:
    """Parser of XML in chunks, which refuses entities and document types: no bombs."""

    path: Path
    start: Callable[[str, dict[str, str], int], None]
    end: Callable[[str, str], None]
    text: str = ""

    def feed(self) -> Iterator[None]:
        """Parse the file; yield after each chunk."""
        parser = expat.ParserCreate()
        parser.StartElementHandler = lambda name, values: self.start(
            name, values, parser.CurrentLineNumber
        )
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._add
        parser.StartDoctypeDeclHandler = self._refuse
        parser.EntityDeclHandler = self._refuse
        try:
            with self.path.open("rb") as file:
                while chunk := file.read(CHUNK):
                    parser.Parse(chunk)
                    yield
                parser.Parse(b"", True)
                yield
        except expat.ExpatError as fault:
            message = expat.ErrorString(fault.code)
            raise FileError(self.path, f"no XML: {message}", fault.lineno) from fault

    def _add(self, text: str) -> None:
        # Numbers are shorter.
        self.text = (self.text + text)[-200:]

    def _end(self, name: str) -> None:
        self.end(name, self.text.strip())
        self.text = ""

    def _refuse(self, *_: Any) -> None:
        raise FileError(self.path, "a document type or an entity, expected elements alone")


@dataclass
class _SumoReader:
    """Rows of the persons on foot in SUMO's floating car data, as its elements come."""

    path: Path
    rows: list[Row]
    steps: list[tuple[float, float]] = field(default_factory=list)
    last: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    time: float | None = None
    riding: set[str] = field(default_factory=set)
    legs: dict[str, int] = field(default_factory=dict)

    def end(self, name: str, text: str) -> None:
        """Take the end of an element: all is in its attributes."""

    def start(self, name: str, values: dict[str, str], line: int) -> None:
        """Take an element."""
        if name == "timestep":
            self.time = self._value(values, "time", line)
        elif name == "person":
            if self.time is None:
                raise FileError(self.path, "a person outside of a timestep", line)
            if "id" not in values:
                raise FileError(self.path, "a person without id", line)
            person = values["id"]
            if values.get("vehicle"):
                self.riding.add(person)
                return
            if person in self.riding:
                self.riding.remove(person)
                self.legs[person] = self.legs.get(person, 1) + 1
            x, y = (self._value(values, axis, line) for axis in "xy")
            # SUMO counts degrees from north with the clock.
            angle = math.radians(90.0 - self._value(values, "angle", line))
            name = track.leg_name(person, self.legs.get(person, 1))
            self.rows.append((name, self.time, x, y, angle, line))
            if "speed" in values:
                self._check_unit(values, x, y, line)

    def _value(self, values: dict[str, str], name: str, line: int) -> float:
        if name not in values:
            raise FileError(self.path, f"no {name}, expected a number", line)
        return _number(self.path, values[name], name, line)

    def _check_unit(self, values: dict[str, str], x: float, y: float, line: int) -> None:
        """Raise FileError for people who hardly move for their speed: in degrees of the globe."""
        if len(self.steps) > 1000 or abs(x) > 180.0 or abs(y) > 90.0:
            return
        before = self.last.get(values["id"])
        speed = self._value(values, "speed", line)
        if before is not None and self.time is not None and speed > 0.5:
            seconds = self.time - before[0]
            self.steps.append((math.hypot(x - before[1], y - before[2]), speed * seconds))
            if len(self.steps) > 10:
                gone, stated = map(sum, zip(*self.steps, strict=True))
                if gone < GEOGRAPHIC * stated:
                    raise FileError(
                        self.path,
                        f"people move {gone:.3g} where their speeds say {stated:.3g} m: longitude "
                        "and latitude? Expected metres (no --fcd-output.geo)",
                        line,
                    )
        self.last[values["id"]] = (self.time or 0.0, x, y)


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
    state: dict[str, float] = field(default_factory=dict)

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
            self.state[name] = _number(self.path, text, name, self.line)
        elif name == "exact" and above in ("time", "orientation"):
            self.state[above] = _number(self.path, text, above, self.line)
        elif name in ("initialState", "state"):
            if self.kind == "pedestrian":
                if missing := [key for key in ("time", "x", "y") if key not in self.state]:
                    raise FileError(self.path, f"a state without exact {missing[0]}", self.line)
                time, x, y = (self.state[key] for key in ("time", "x", "y"))
                angle = self.state.get("orientation", math.nan)
                self.rows.append((self.person, self.step * time, x, y, angle, self.line))
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

    for _ in _XmlEvents(path, start, lambda name, text: readers[0].end(name, text)).feed():
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
