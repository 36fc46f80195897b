"""What is done of an export, kept in its target until all of it is.

Under `.posefield/` lie `job.json`, which says whose the target is, and one part for each chunk that
is done: a line of what it came to, then its lines of the manifest. When all parts are there they
become `manifest.jsonl`, `skipped.jsonl` where rows were skipped, and last `export.json`, which is
what makes a target complete; then the folder goes. Whoever does this, and how many at once, the
bytes are the same.
"""

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from io import BytesIO
from typing import Any

import orjson

from service.export import layouts, manifest
from service.export.job import Job, Work
from service.export.query import Fault
from service.export.target import STATE, Target
from service.motion.errors import FileError

JOB, PARTS = f"{STATE}/job.json", f"{STATE}/parts"
MANIFEST, SKIPPED, EXPORT = "manifest.jsonl", "skipped.jsonl", "export.json"


@dataclass(frozen=True)
class Part:
    """What a chunk came to, or several: clips and bytes written, clips with a warning, and the
    rows that were skipped."""

    clips: int = 0
    bytes: int = 0
    warned: int = 0
    skipped: list[Fault] = field(default_factory=list)


def begin(target: Target, place: str, job: Job) -> None:
    """Make the target this job's.

    Raises FileError, having touched nothing, where the target is not this job's nor empty.
    """
    if target.read(JOB) is None:
        if not target.empty(but=STATE):
            raise FileError(place, "holds files that are no export's, expected an empty place")
        _claim(target, job)
    _expect(place, job, target.read(JOB))
    target.prepare()


def _claim(target: Target, job: Job) -> None:
    """Say whose the target is, where nobody has."""
    target.prepare()
    target.create(JOB, _json({"job": job.digest, **job.facts()}))


def complete(target: Target, place: str, job: Job) -> dict[str, Any] | None:
    """Facts of the export where it is complete; FileError where it is another job's."""
    content = target.read(EXPORT)
    return None if content is None else _expect(place, job, content)


def whole(target: Target) -> bool:
    """Whether the files that a complete export tells of are still there, as long as they were.

    Archives are believed: nothing says how long they are.
    """
    content = target.read(MANIFEST)
    if content is None:
        return False
    entries = (orjson.loads(line) for line in BytesIO(content))
    loose = (entry for entry in entries if "archive" not in entry)
    return all(target.holds(entry["file"], entry["bytes"]) for entry in loose)


def reopen(target: Target, job: Job) -> None:
    """Make a complete export one of which nothing is done; its files stay until they are made
    again, the same as they were."""
    _claim(target, job)
    target.drop(EXPORT)


def _expect(place: str, job: Job, content: bytes | None) -> dict[str, Any]:
    """Facts of a job or an export, which must be this one's."""
    try:
        found = orjson.loads(content or b"")
        if found["job"] == job.digest:
            return dict(found)
    except (ValueError, LookupError, TypeError) as fault:
        raise FileError(place, f"holds an export whose facts cannot be read: {fault}") from fault
    other = [name for name, fact in job.facts().items() if found.get(name) != fact]
    raise FileError(
        place,
        f"holds another export, whose {', '.join(other)} differ; expected an empty place or the "
        "same export",
    )


def record(target: Target, number: int, part: Part, entries: Iterable[dict[str, Any]]) -> None:
    """Leave the part of a chunk that is done."""
    lines = b"".join(map(manifest.line, [asdict(part), *entries]))
    target.write([(f"{PARTS}/{_name(number)}", lines)])


def done(target: Target, number: int, names: set[str]) -> Part | None:
    """What a chunk came to if it is done, of the names of all parts, and its files are there."""
    if _name(number) not in names:
        return None
    head, _, lines = (target.read(f"{PARTS}/{_name(number)}") or b"").partition(b"\n")
    try:
        part = _part(head)
        entries = [orjson.loads(line) for line in lines.splitlines()]
    except (ValueError, TypeError):
        return None
    return part if all(target.holds(*file) for file in _files(part, entries)) else None


def names(target: Target) -> set[str]:
    """Names of the parts that are there."""
    return target.names(PARTS)


def finish(target: Target, work: Work, chunks: int) -> dict[str, Any] | None:
    """Complete an export all of whose chunks are done; None where some are not.

    Returns the facts of it, also where another did this first.
    """
    try:
        if len(names(target)) == chunks:
            return _finish(target, work, chunks)
    except FileError:
        # Another may have completed it and taken the parts away.
        if (found := complete(target, work.target, work.job)) is None:
            raise
        return found
    return complete(target, work.target, work.job)


def _finish(target: Target, work: Work, chunks: int) -> dict[str, Any]:
    total, job = _total(target, chunks), work.job
    target.stream(MANIFEST, (lines for _, lines in _parts(target, chunks)))
    if total.skipped:
        lines = map(manifest.line, map(asdict, total.skipped))
        target.write([(SKIPPED, b"".join(lines))])
    if total.clips:
        target.write(layouts.find(job.layout).complete(work, _entries(target, chunks)))
    facts = {"job": job.digest, **job.facts(), **asdict(total), "skipped": len(total.skipped)}
    target.write([(EXPORT, _json(facts))])
    target.remove(STATE)
    return facts


def _entries(target: Target, chunks: int) -> Iterator[dict[str, Any]]:
    for _, lines in _parts(target, chunks):
        yield from map(orjson.loads, lines.splitlines())


def _total(target: Target, chunks: int) -> Part:
    parts = [part for part, _ in _parts(target, chunks)]
    return Part(
        sum(part.clips for part in parts),
        sum(part.bytes for part in parts),
        sum(part.warned for part in parts),
        [fault for part in parts for fault in part.skipped],
    )


def _parts(target: Target, chunks: int) -> Iterator[tuple[Part, bytes]]:
    for number in range(chunks):
        path = f"{PARTS}/{_name(number)}"
        if (content := target.read(path)) is None:
            raise FileError(path, "is gone; expected it to stay until the export is complete")
        head, _, lines = content.partition(b"\n")
        yield _part(head), lines


def _part(head: bytes) -> Part:
    plain = orjson.loads(head)
    return Part(**{**plain, "skipped": [Fault(**fault) for fault in plain["skipped"]]})


def _files(part: Part, entries: list[dict[str, Any]]) -> Iterator[tuple[str, int]]:
    """Files of a chunk with their sizes in bytes: one archive, or one a clip."""
    if entries and "archive" in entries[0]:
        yield entries[0]["archive"], part.bytes
    else:
        yield from ((entry["file"], entry["bytes"]) for entry in entries)


def _name(number: int) -> str:
    return f"{number:06d}.jsonl"


def _json(facts: dict[str, Any]) -> bytes:
    return orjson.dumps(facts, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)
