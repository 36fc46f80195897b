"""Crowds of tracks longer than memory: a file for each group of people, in a folder.

A file of tracks is read once, block by block, and its rows are sorted into a spool file for each
part. A part is then made from its own rows alone, on the clock of all, by any process. So memory
does not grow with the number of people, and a part has the same bytes whichever process makes it.

Beside each part is a record of what it was made from. A run makes the parts whose record differs or
is missing, so the same command resumes after a kill.
"""

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib.metadata import version
from os.path import getsize
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from msgspec import structs

from posefield import __version__
from posefield.batch.job import VERSIONED_PACKAGES
from posefield.batch.process_pool import Runner, run_here
from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField
from posefield.encode import crowd_formats
from posefield.inference import session
from posefield.model_file import checked_file
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis.synthesizer import Synthesizer
from posefield.tracks import track, track_crowd, track_files
from posefield.tracks.track import MAX_PEOPLE, Track, TrackRows
from posefield.tracks.track_files import TrackReading

MANIFEST = "manifest.json"
ROW = np.dtype(
    [
        *(("person", "<i4"), ("line", "<i8")),
        *(("time", "<f8"), ("point", "<c16"), ("heading", "<f8")),
    ]
)
"""Row of a spool file."""


@dataclass(frozen=True)
class PartsJob:
    """Crowd of a file of tracks in parts.

    model, tracks: files. identity: of the model (name@contenthash). people: of each part. folder,
    endings: of the files of a part. question, reading: as of a crowd in one file. skip_bad: whether
    unusable tracks are left out and told.
    """

    model: Path
    identity: str
    tracks: Path
    folder: Path
    endings: tuple[str, ...]
    people: int
    question: WalkQuestion
    reading: TrackReading
    skip_bad: bool = False

    def __post_init__(self) -> None:
        self.question.check()
        if self.people < 1:
            raise InvalidField("people_per_file", f"{self.people}, expected 1 person or more")


@dataclass(frozen=True)
class TrackShard:
    """Rows of the people of one part.

    index: of the part. spool: file of its rows. begin: time of the first frame of all parts, s.
    names: ids of its people, in their order. faults: of some of them, as of `TrackRows`.
    """

    index: int
    spool: Path
    begin: float
    names: tuple[str, ...]
    faults: dict[str, str]


@dataclass
class _Spools:
    """Spool files of the parts. numbers: of the people, by id. faults: as of `TrackRows`."""

    job: PartsJob
    folder: Path
    numbers: dict[str, int] = field(default_factory=dict)
    faults: dict[str, str] = field(default_factory=dict)

    def add(self, block: TrackRows) -> None:
        """Sort the rows of a block into the files of their parts."""
        for person in dict.fromkeys(block.people):
            self.numbers.setdefault(person, len(self.numbers))
        if len(self.numbers) > MAX_PEOPLE:
            raise FileError(self.job.tracks, f"more than {MAX_PEOPLE} people, expected fewer")
        self.faults = {**block.faults, **self.faults}
        rows = np.empty(len(block.people), ROW)
        rows["person"] = [self.numbers[person] for person in block.people]
        rows["line"], rows["time"], rows["point"] = block.lines, block.times, block.points
        rows["heading"] = block.headings
        indices = rows["person"] // self.job.people
        for index in np.unique(indices).tolist():
            with self.file(index).open("ab") as file:
                file.write(rows[indices == index].tobytes())

    def file(self, index: int) -> Path:
        """Return the spool file of a part."""
        return self.folder / f"{index:05}.rows"

    def shards(self) -> list[TrackShard]:
        """Return the rows of the parts, whose clock begins with the first usable track.

        Raises FileError as `track.group` does.
        """
        path, names, size = self.job.tracks, list(self.numbers), self.job.people
        shards = []
        for index, first in enumerate(range(0, len(names), size)):
            some = tuple(names[first : first + size])
            faults = {name: self.faults[name] for name in some if name in self.faults}
            shards.append(TrackShard(index, self.file(index), np.inf, some, faults))
        begins, totals, skipped = [np.inf], np.zeros(5, complex), dict[str, str]()
        for shard in shards:
            checked = track.check(_tracks(self.job, shard), path, self.job.skip_bad)
            begins += [float(person.times[0]) for person in checked.tracks]
            totals += track.sums(checked.tracks)
            skipped |= checked.skipped
        track.check_file(path, len(names), skipped, totals)
        return [replace(shard, begin=min(begins)) for shard in shards]


def write(
    job: PartsJob,
    runner: Runner = run_here,
    progress: Callable[[int], Callable[[int], None]] = lambda total: lambda count: None,
) -> dict[str, Any]:
    """Write the parts of a crowd and a manifest, and return it as plain values.

    progress: takes the number of parts; what it returns, that of parts finished since. Raises
    FileError and InvalidField as `track.group` and `crowd_formats.write` do; WorkerDied.
    """
    with atomic_files.temporary_folder(job.folder / "rows") as folder:
        spools = _Spools(job, folder)
        for block in track_files.row_blocks(job.tracks, job.reading):
            spools.add(block)
        shards = spools.shards()
        advance, records = progress(len(shards)), []
        tasks = ((job, shard) for shard in shards)
        for record in runner(write_part, tasks, lambda: False):
            records.append(record)
            advance(1)
    records.sort(key=lambda record: record["part"])
    if not any(record["people"] for record in records):
        raise InvalidField("trajectories", "all shorter than two frames, expected longer ones")
    manifest = {
        "people": len(spools.numbers),
        "begin": shards[0].begin,
        "fps": job.question.fps,
        "skipped": {person: why for record in records for person, why in record["skipped"].items()},
        "parts": records,
    }
    content = orjson.dumps(manifest, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)
    atomic_files.write(content, job.folder / MANIFEST)
    return manifest


def write_part(task: tuple[PartsJob, TrackShard]) -> dict[str, Any]:
    """Write one part unless it is there, and return its record; without people it has no file."""
    job, shard = task
    paths = [job.folder / f"{shard.index:05}.{ending}" for ending in job.endings]
    record_path = job.folder / f"{shard.index:05}.json"
    digest = _digest(job, shard)
    if all(path.is_file() for path in (*paths, record_path)):
        record: dict[str, Any] = orjson.loads(record_path.read_bytes())
        if record["made_from"] == digest and record["bytes"] == sum(map(getsize, paths)):
            return record
    tracks = track.check(_tracks(job, shard), job.tracks, job.skip_bad)
    model = _open(job.model, job.identity)
    question = structs.replace(job.question, count=max(1, len(tracks.tracks)))
    crowd = track_crowd.find_people(model, model.gait, question, tracks.tracks, shard.begin)
    record = {
        "part": shard.index,
        "file": None,
        "bytes": 0,
        "people": [],
        "frames": crowd.frames,
        "warnings": [],
        "excess": [],
        "skipped": {**tracks.skipped, **crowd.skipped},
        "made_from": digest,
    }
    if crowd.people:
        clip = track_crowd.crowd_clip(crowd)
        crowd_formats.write_files(clip, paths, question, model.session.card.roles)
        excess = [round(limit.excess, 3) for limit in crowd.limits]
        record |= {name: clip.facts[name] for name in ("people", "path_error_cm", "warnings")}
        # Lines about pairs of people come before those about one.
        record["excess"] = [0.0] * (len(record["warnings"]) - len(excess)) + excess
        names = [path.name for path in paths]
        record |= {"file": names[0], "files": names, "bytes": sum(map(getsize, paths))}
    for path in [] if crowd.people else paths:
        path.unlink(missing_ok=True)
    atomic_files.write(orjson.dumps(record), record_path)
    return record


def _tracks(job: PartsJob, shard: TrackShard) -> Iterator[Track]:
    """Yield the tracks of a part, in the order of its people."""
    rows = np.fromfile(shard.spool, ROW)
    rows = rows[np.argsort(rows["person"], kind="stable")]
    stops = np.searchsorted(
        rows["person"], shard.index * job.people + np.arange(len(shard.names)), "right"
    )
    for name, some in zip(shard.names, np.split(rows, stops[:-1]), strict=True):
        times, points, angles, lines = (
            some[column].copy() for column in ("time", "point", "heading", "line")
        )
        headings, fault = None if np.isnan(angles).all() else angles, shard.faults.get(name, "")
        yield Track(name, times, points, headings, lines, fault)


@lru_cache(maxsize=1)
def _open(path: Path, identity: str) -> Synthesizer:
    """Return a model, which a process opens once; FileError if its file has changed."""
    content = checked_file.read(path)
    name, _, digest = identity.partition("@")
    if checked_file.digest(content) != digest:
        raise FileError(path, "changed while parts were written, expected the same model")
    return Synthesizer(name, session.open_bytes(content, identity))


def _digest(job: PartsJob, shard: TrackShard) -> str:
    """Return the digest of all that determines the bytes of a part."""
    facts = {
        "model": job.identity,
        "endings": job.endings,
        "question": structs.asdict(job.question),
        "skip_bad": job.skip_bad,
        "begin": shard.begin,
        "names": shard.names,
        "faults": shard.faults,
        "versions": [__version__, *map(version, VERSIONED_PACKAGES)],
    }
    hashed = hashlib.sha256(orjson.dumps(facts, option=orjson.OPT_SORT_KEYS))
    hashed.update(shard.spool.read_bytes())
    return hashed.hexdigest()
