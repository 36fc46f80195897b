"""Checkpoints of an export: finished chunks, recorded in its target until all are finished.

The folder `.posefield/` contains `job.json`, the job of the target, and one part for each finished
chunk: a line of totals, then its lines of the manifest. The parts become `manifest.jsonl`,
`skipped.jsonl` if rows were skipped, and last `export.json`, which marks the target as complete;
then the folder is removed. The bytes are the same for any number of processes and of runs.
"""

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

import orjson

from posefield.batch import layouts
from posefield.batch.job import MANIFEST, ExportJob, WorkerInput, manifest_line
from posefield.batch.rows import RowFault
from posefield.batch.target import (
    STATE_FOLDER,
    ExportTarget,
    WrittenFile,
    is_intact,
    put_file,
    read_lines,
)
from posefield.common.errors import FileError

JOB, PARTS = f"{STATE_FOLDER}/job.json", f"{STATE_FOLDER}/parts"
SKIPPED, EXPORT = "skipped.jsonl", "export.json"


@dataclass(frozen=True)
class ChunkResult:
    """Result of one chunk.

    clips, bytes: number of clips and bytes written. warned: clips with a warning. skipped: faults
    of the rows that were left out. archives: files that contain the clips, in layouts of archives.
    """

    clips: int = 0
    bytes: int = 0
    warned: int = 0
    skipped: list[RowFault] = field(default_factory=list)
    archives: list[WrittenFile] = field(default_factory=list)


def assign_job(target: ExportTarget, work: WorkerInput) -> None:
    """Assign the target to the job of this work.

    Raises FileError, with the target unchanged, if it belongs to another job or is not empty.
    """
    if target.read(JOB) is None:
        if not target.empty(but=STATE_FOLDER):
            raise FileError(work.target, "is not empty and has no manifest of an export")
        _record_job(target, work.job)
    _check_job(work, target.read(JOB))
    target.prepare()


def _record_job(target: ExportTarget, job: ExportJob) -> None:
    target.prepare()
    target.create(JOB, _json({"job": job.digest, **job.facts()}))


def completed_facts(target: ExportTarget, work: WorkerInput) -> dict[str, Any] | None:
    """Return the facts of a complete export, else None; FileError if it is another job's."""
    content = target.read(EXPORT)
    return None if content is None else _check_job(work, content)


def first_damaged_file(target: ExportTarget, facts: dict[str, Any], verify: bool) -> str | None:
    """Return the path of the first missing or changed file of a complete export, or None.

    verify: compare checksums, not only sizes.
    """
    try:
        damaged = (
            file.file for file in _files(target, facts) if not is_intact(target, file, verify)
        )
        return next(damaged, None)
    except (ValueError, LookupError, TypeError):
        return MANIFEST


def _files(target: ExportTarget, facts: dict[str, Any]) -> Iterator[WrittenFile]:
    """Yield every file of a complete export.

    Raises ValueError, LookupError or TypeError for a damaged manifest.
    """
    yield from (WrittenFile(**file) for file in facts["files"])
    clips = 0
    for line in read_lines(target, MANIFEST):
        clips += 1
        entry = orjson.loads(line)
        if "archive" not in entry:
            yield _clip(entry)
    if clips != facts["clips"]:
        raise ValueError


def _clip(entry: dict[str, Any]) -> WrittenFile:
    return WrittenFile(entry["file"], entry["bytes"], entry["sha256"])


def reopen(target: ExportTarget, job: ExportJob) -> None:
    """Reset a complete export to one without finished chunks; its files remain."""
    _record_job(target, job)
    target.drop(EXPORT)


def _check_job(work: WorkerInput, content: bytes | None) -> dict[str, Any]:
    """Return the facts of a job or an export; FileError unless they are this job's."""
    try:
        facts = orjson.loads(content or b"")
        if facts["job"] == work.job.digest:
            return dict(facts)
    except (ValueError, LookupError, TypeError) as fault:
        raise FileError(
            work.target, f"holds an export whose facts cannot be read: {fault}"
        ) from fault
    other = [name for name, fact in work.job.facts().items() if facts.get(name) != fact]
    raise FileError(
        work.target,
        f"holds another export, whose {', '.join(other)} differ; expected an empty folder or the "
        "same export",
    )


def record_chunk(
    target: ExportTarget, number: int, result: ChunkResult, entries: Iterable[dict[str, Any]]
) -> None:
    """Write the part of a finished chunk, with its entries of the manifest."""
    content = b"".join(map(manifest_line, [asdict(result), *entries]))
    target.write([(f"{PARTS}/{_name(number)}", content)])


def finished_chunk(
    target: ExportTarget, number: int, names: set[str], verify: bool = False
) -> ChunkResult | None:
    """Return the part of a chunk if it is listed in `names` and its files are intact, else None.

    verify: compare checksums, not only sizes.
    """
    if _name(number) not in names:
        return None
    head, _, entries = (target.read(f"{PARTS}/{_name(number)}") or b"").partition(b"\n")
    try:
        result = _part(head)
        files = result.archives or [_clip(orjson.loads(line)) for line in entries.splitlines()]
    except (ValueError, LookupError, TypeError):
        return None
    return result if all(is_intact(target, file, verify) for file in files) else None


def names(target: ExportTarget) -> set[str]:
    """Return the names of the present parts."""
    return target.names(PARTS)


def finish(target: ExportTarget, work: WorkerInput, chunks: int) -> dict[str, Any] | None:
    """Complete an export if all of its chunks are finished, and return its facts; else None.

    If another process completed it meanwhile, the facts are the same.
    """
    try:
        if len(names(target)) == chunks:
            return _finish(target, work, chunks)
    except FileError:
        # Another process may have completed it and removed the parts.
        if (facts := completed_facts(target, work)) is None:
            raise
        return facts
    return completed_facts(target, work)


def _finish(target: ExportTarget, work: WorkerInput, chunks: int) -> dict[str, Any]:
    results, job = [result for result, _ in _parts(target, chunks)], work.job
    skipped = [fault for result in results for fault in result.skipped]
    clips = sum(result.clips for result in results)
    files = [archive for result in results for archive in result.archives]
    files.append(put_file(target, MANIFEST, (entries for _, entries in _parts(target, chunks))))
    if skipped:
        files.append(put_file(target, SKIPPED, map(manifest_line, map(asdict, skipped))))
    if clips:
        lines = (line for _, entries in _parts(target, chunks) for line in entries.splitlines())
        about = layouts.find_layout(job.layout).complete(work, map(orjson.loads, lines))
        files += [put_file(target, path, (content,)) for path, content in (*about, *work.about)]
    facts = {
        "job": job.digest,
        **job.facts(),
        "clips": clips,
        "bytes": sum(result.bytes for result in results),
        "warned": sum(result.warned for result in results),
        "skipped": len(skipped),
        "files": list(map(asdict, files)),
    }
    target.write([(EXPORT, _json(facts))])
    target.remove(STATE_FOLDER)
    return facts


def _parts(target: ExportTarget, chunks: int) -> Iterator[tuple[ChunkResult, bytes]]:
    for number in range(chunks):
        path = f"{PARTS}/{_name(number)}"
        if (content := target.read(path)) is None:
            raise FileError(path, "is gone; expected it to stay until the export is complete")
        head, _, entries = content.partition(b"\n")
        yield _part(head), entries


def _part(head: bytes) -> ChunkResult:
    plain = orjson.loads(head)
    skipped = [RowFault(**fault) for fault in plain["skipped"]]
    archives = [WrittenFile(**archive) for archive in plain["archives"]]
    return ChunkResult(**{**plain, "skipped": skipped, "archives": archives})


def _name(number: int) -> str:
    return f"{number:06d}.jsonl"


def _json(facts: dict[str, Any]) -> bytes:
    return orjson.dumps(facts, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)
