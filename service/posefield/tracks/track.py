"""Tracks of pedestrians over the floor, and what makes one unusable.

Files have x east and y north, m, in a right-handed frame with z up. This project has Y up, so a
point (x, y) is X = x, Z = -y, and an angle that counts from east against the clock is a heading of
a quarter turn more. `floor_points` and `floor_headings` are the only places where this is known.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from posefield.common.errors import FileError
from posefield.common.units import Floats, Indices
from posefield.locomotion.floor_plane import FloorVectors

MAX_PEOPLE = 100_000
"""Most people of one file."""
FASTEST = 12.0
"""Speed beyond which no person runs, m/s: a faster step is a jump if it is longer than `JUMP`."""
JUMP = 0.5
"""Shortest jump, m."""
FARTHEST = 1e5
"""Largest coordinate, m: a float32, as of tables and renderers, has 8 mm here."""
MAX_SECONDS = 1e10
"""Largest time stamp, s: clocks that count from 1970 are at 2e9, and a float64 has 2e-6 s here."""
SLOWEST = 1e-4
"""Speed that is exceeded in a file unless all stand, m/s."""
MIRRORED, FOLLOWED, MOVING = 0.9, 0.5, 0.5
"""Agreement of headings with the mirrored direction of travel from which on, and that with the
direction itself up to which, y points down; speed from which on directions count, m/s."""


def leg_name(person: str, leg: int) -> str:
    """Return the id of a person who comes back: that of the first leg is the id itself."""
    return person if leg == 1 else f"{person}~{leg}"


def floor_points(
    x: Annotated[Floats, "rows"], y: Annotated[Floats, "rows"]
) -> Annotated[FloorVectors, "rows"]:
    """Return floor points (R,) of coordinates east and north (R,), m."""
    return -y + 1j * x


def floor_headings(angles: Annotated[Floats, "rows"]) -> Annotated[Floats, "rows"]:
    """Return headings (R,), rad, of angles from east against the clock (R,), rad."""
    return angles + 0.5 * np.pi


@dataclass(frozen=True)
class Track:
    """Track of one person.

    person: id in the file. times: (S,), s, ascending, as in the file. points: (S,), over the floor,
    m. headings: (S,), rad; None where the file has none. lines: (S,), in the file, from 1, or rows
    of a table; empty for arrays. fault: what is wrong with the first sample without numbers.
    """

    person: str
    times: Annotated[Floats, "samples"]
    points: Annotated[FloorVectors, "samples"]
    headings: Annotated[Floats, "samples"] | None = None
    lines: Annotated[Indices, "rows"] | Sequence[int] = ()
    fault: str = ""

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.times)


class TrackProblem(NamedTuple):
    """First sample of a track that cannot be used, why, the column that is at fault, and advice."""

    sample: int
    message: str
    column: str = "positions"
    advice: str = "--skip-bad leaves such people out"


@dataclass(frozen=True)
class TrackSet:
    """Tracks of a file. skipped: reason by id of the people who were left out."""

    tracks: tuple[Track, ...]
    skipped: dict[str, str]


@dataclass(frozen=True)
class TrackRows:
    """Block of R rows of a file, in its order.

    people: ids (R,). times: (R,), s. points: (R,), m. headings: (R,), rad. lines: (R,), of the
    file, from 1. faults: by id, what is wrong with the first row of a person without numbers.
    """

    people: Sequence[str]
    times: Annotated[Floats, "rows"]
    points: Annotated[FloorVectors, "rows"]
    headings: Annotated[Floats, "rows"]
    lines: Annotated[Indices, "rows"]
    faults: Mapping[str, str]


def group(blocks: Iterable[TrackRows], path: Path, skip_bad: bool = False) -> TrackSet:
    """Return the tracks of the rows of a file, in the order in which people appear.

    skip_bad: whether people with unusable tracks are left out, and told. Raises FileError, with the
    line, for the first unusable track otherwise, and for too many people or none.
    """
    rows: dict[str, list[tuple[TrackRows, Indices]]] = {}
    faults: dict[str, str] = {}
    for block in blocks:
        faults = {**block.faults, **faults}
        numbers: dict[str, int] = {}
        whose = np.array([numbers.setdefault(person, len(numbers)) for person in block.people])
        order = np.argsort(whose, kind="stable")
        stops = np.searchsorted(whose[order], np.arange(len(numbers)), "right")
        for person, indices in zip(numbers, np.split(order, stops[:-1]), strict=True):
            rows.setdefault(person, []).append((block, indices))
        if len(rows) > MAX_PEOPLE:
            raise FileError(path, f"more than {MAX_PEOPLE} people, expected at most as many")
    joined = (_joined(person, rows[person], faults.get(person, "")) for person in rows)
    tracks = check(joined, path, skip_bad)
    check_file(path, len(rows), tracks.skipped, sums(tracks.tracks))
    return tracks


def check_file(
    path: Path, people: int, skipped: Mapping[str, str], totals: Annotated[FloorVectors, "5"]
) -> None:
    """Raise FileError if all people are skipped, and as of `find_file_problem`."""
    if not people:
        raise FileError(path, "no person in it, expected one or more")
    if people == len(skipped):
        name, why = next(iter(skipped.items()))
        raise FileError(path, f"no usable person among {people}, the first {name!r}: {why}")
    if problem := find_file_problem(totals):
        raise FileError(path, problem)


def check(tracks: Iterable[Track], path: Path, skip_bad: bool = False) -> TrackSet:
    """Return the usable tracks among some of a file; none may be.

    skip_bad: as of `group`. Raises FileError, with the line, for the first unusable one otherwise.
    """
    usable, skipped = [], {}
    for track in tracks:
        problem = find_problem(track)
        if problem is None:
            usable.append(track)
            continue
        line = int(track.lines[problem.sample])
        if not skip_bad:
            texts = filter(None, (problem.message, problem.advice))
            raise FileError(path, f"person {track.person!r}: {'; '.join(texts)}", line)
        skipped[track.person] = f"line {line}: {problem.message}"
    return TrackSet(tuple(usable), skipped)


def _joined(person: str, pieces: Sequence[tuple[TrackRows, Indices]], fault: str) -> Track:
    times, points, headings, lines = (
        np.concatenate([getattr(block, name)[rows] for block, rows in pieces])
        for name in ("times", "points", "headings", "lines")
    )
    headed = None if np.isnan(headings).all() else headings
    return Track(person, times, points, headed, lines, fault)


def find_problem(track: Track) -> TrackProblem | None:
    """Return what makes a track unusable; None if nothing does."""
    columns = [track.times, track.points.real, track.points.imag]
    columns += [] if track.headings is None else [track.headings]
    finite = np.isfinite(columns).all(axis=0)
    if not finite.all():
        at = int(np.argmin(finite))
        return TrackProblem(at, track.fault or "a value that is no number, expected finite ones")
    if track.headings is not None:
        angles, turn = np.abs(track.headings - 0.5 * np.pi), 2.0 * np.pi + 0.01
        if angles.max() > turn:
            at = int(np.argmax(angles > turn))
            text = f"heading {angles[at]:g} radians, {np.degrees(angles[at]):g} degrees"
            return TrackProblem(at, f"{text}, expected at most one turn", "headings")
    far = np.maximum(np.abs(track.points.real), np.abs(track.points.imag))
    if far.max() > FARTHEST:
        at = int(np.argmax(far))
        text = f"{far[at]:g} m from the origin, expected at most {FARTHEST:g} m"
        return TrackProblem(at, f"{text}: subtract the origin of the map", advice="")
    if np.abs(track.times).max() > MAX_SECONDS:
        at = int(np.argmax(np.abs(track.times)))
        text = f"time {track.times[at]:g} s, expected at most {MAX_SECONDS:g} s"
        return TrackProblem(at, text, "times")
    if len(track) < 2:
        return TrackProblem(0, "one sample, expected two or more", "times")
    steps = np.diff(track.times)
    if steps.min() <= 0.0:
        at = int(np.argmax(steps <= 0.0)) + 1
        time, before = track.times[at], track.times[at - 1]
        if steps[at - 1] == 0.0:
            text = f"twice at time {time:g} s, expected one sample at a time"
        else:
            text = f"time goes back from {before:g} s to {time:g} s, expected ascending times"
        return TrackProblem(at, text, "times")
    ways = np.abs(np.diff(track.points))
    jumps = ways > np.maximum(JUMP, FASTEST * steps)
    if jumps.any():
        at, advice = int(np.argmax(jumps)), "--split parts a person there, --skip-bad leaves it out"
        text = f"jumps {ways[at]:.2f} m in {steps[at]:g} s at {track.times[at + 1]:g} s"
        text += f", expected at most {FASTEST:g} m/s"
        if jumps.mean() > 0.5 and len(jumps) > 2:
            text += f", as in {jumps.sum()} of {len(jumps)} steps: "
            text, advice = text + unit_question(float(np.median(ways / steps))), ""
        return TrackProblem(at + 1, text, advice=advice)
    return None


def unit_question(speed: float) -> str:
    """Return what a median speed beyond that of walkers, m/s, says about the units of a file."""
    near = [unit for unit, size in (("centi", 100.0), ("milli", 1e3)) if 0.5 < speed / size < 2.5]
    guess = f"are they in {near[0]}metres?" if near else "in what unit are they?"
    return f"x and y have to be in m, and times in s: at {speed:.0f} m/s, {guess}"


def sums(tracks: Iterable[Track]) -> Annotated[FloorVectors, "5"]:
    """Return sums of headings from the direction of travel, from its mirror, and their number; and
    the number of steps that move, and of those at more than `SLOWEST`.

    Sums of parts of a file add up to that of the file.
    """
    totals = np.zeros(5, complex)
    for track in tracks:
        ways, steps = np.diff(track.points), np.diff(track.times)
        totals[3:] += np.count_nonzero(ways), np.count_nonzero(np.abs(ways) > SLOWEST * steps)
        if track.headings is not None:
            moving = np.abs(ways) > MOVING * steps
            ways = ways[moving]
            faces = np.exp(1j * track.headings[:-1][moving]) / np.abs(ways)
            totals[:3] += (faces @ np.conj(ways), -faces @ ways, len(ways))
    return totals


def find_file_problem(totals: Annotated[FloorVectors, "5"]) -> str | None:
    """Return what is wrong with a file as a whole; None if nothing is. totals: as of `sums`.

    Headings agree with travel only if y is turned over, or all who move crawl.
    """
    agreement, opposite = np.abs(totals[:2] / max(abs(totals[2]), 1.0)).tolist()
    if opposite > MIRRORED and agreement < FOLLOWED:
        return (
            f"headings agree with the mirrored direction of travel ({opposite:.2f}) and not with "
            f"the direction itself ({agreement:.2f}), expected angles from x to y: is one of both "
            "turned over?"
        )
    if totals[3] and not totals[4]:
        return f"all move at less than {SLOWEST:g} m/s: are x and y longitude and latitude, not m?"
    return None
