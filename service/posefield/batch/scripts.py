"""Performances of many scripts: as members of an archive, or as files with a manifest.

Scripts are JSON files of a folder, or lines of JSON Lines. An archive takes the files in sequence;
every script is planned before the first is made, so that one that cannot be performed refuses the
whole archive.

A target contains `performances/NAME.FORMAT` and `manifest.jsonl`, one line for each script in its
order: file, checksum, digest of what made it, and report. Until all are made, each finished file
has its line in `.posefield/performances`. A file is made again if it is missing, or if its script,
a model or a version changed.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec
import orjson

from posefield import __version__
from posefield.batch import checkpoint, process_pool, tables
from posefield.batch.job import (
    MANIFEST,
    VERSIONED_PACKAGES,
    ExportedFile,
    exported_file,
    manifest_line,
)
from posefield.batch.rows import Row
from posefield.batch.target import (
    STATE_FOLDER,
    ExportTarget,
    WrittenFile,
    is_intact,
    open_target,
    put_file,
    read_lines,
)
from posefield.characters import delivery
from posefield.characters.user_character import UserCharacter
from posefield.common import cancellation
from posefield.common.errors import FileError, InvalidField, QueryError
from posefield.encode import formats
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder
from posefield.model import MAX_FRAMES
from posefield.performance import composition
from posefield.performance.script import Script, resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import NamedScript, PerformanceLayout
from posefield.question.performance_report import PerformanceAnswer
from posefield.registry import model_registry
from posefield.registry.model_registry import ModelRegistry

Entry = dict[str, Any]
ScriptRow = Row[NamedScript]
LINES = ".jsonl"
MAX_LINE_BYTES = 256 * 1024
MAX_SHOWN_FAULTS = 10


def are_many(path: Path) -> bool:
    """Return whether a path holds many scripts: a folder, or JSON Lines."""
    return path.is_dir() or path.suffix == LINES


def read_scripts(path: Path) -> tuple[ScriptRow, ...]:
    """Return the scripts of a path, in the order of the lines or of the names.

    A script in a folder is named after its file; one in a line by `name`, else by its number.
    Raises FileError for a path that cannot be read, and InvalidField, which lists the scripts at
    fault, for invalid scripts, equal names, or no script.
    """
    rows: dict[str, ScriptRow] = {}
    faults: list[str] = []
    for location, name, content in _contents(path):
        try:
            if len(content) > MAX_LINE_BYTES:
                raise InvalidField("", f"{len(content)} bytes, expected at most {MAX_LINE_BYTES}")
            script = json_decoding.decode_question(NamedScript, content)
            row = Row(script.name or name, "", script, location)
            if row.name in rows:
                other = rows[row.name].place
                raise InvalidField("name", f"{row.name!r} is that of {other}, expected another")
            rows[row.name] = row
        except QueryError as error:
            faults.append(f"{location}: {error}")
    if faults:
        raise faulty_scripts(faults)
    if not rows:
        raise InvalidField("scripts", f"{path} has no script, expected at least one")
    return tuple(rows.values())


def faulty_scripts(faults: list[str]) -> InvalidField:
    """Return the error for invalid scripts, with the first of their faults."""
    listed = "".join(f"\n  {fault}" for fault in faults[:MAX_SHOWN_FAULTS])
    more = len(faults) - MAX_SHOWN_FAULTS
    rest = f"\n  and {more} more" if more > 0 else ""
    return InvalidField("scripts", f"{len(faults)} that cannot be performed:{listed}{rest}")


def _contents(path: Path) -> Iterator[tuple[str, str, bytes]]:
    """Yield place, default name and content of each script."""
    try:
        if path.is_dir():
            for file in sorted(path.glob("*.json")):
                yield file.name, file.stem, file.read_bytes()
            return
        with path.open("rb") as lines:
            for number, line in enumerate(tables.read_rows(path, lines.readline), start=1):
                if line.strip():
                    yield f"{path.name}:{number}", f"{number:06d}", line
    except OSError as fault:
        raise FileError(path, f"{fault.strerror}, expected scripts in JSON") from fault


@dataclass(frozen=True)
class PerformanceFormat:
    """Files of performances: their format, and the layout of USD files.

    character: of a user, that moves instead of those of the scripts.
    """

    encoder: ClipEncoder
    layout: PerformanceLayout = "whole"
    character: UserCharacter | None = None

    def file(self, script: Script, frames: int) -> tuple[PerformanceAnswer, bytes]:
        """Return the performance of a script of at most so many frames, and its file."""
        question = script.question
        if self.character is None:
            encode = formats.performance_encoder(self.encoder, self.layout)
            convention = self.encoder.convention(question.unit, question.up, question.body)
            answer = composition.perform(script, frames)
            return answer, encode(answer, convention)
        order = delivery.deliver(self.character, self.encoder, question)
        answer = composition.perform(script, frames)
        answer = order.performance(answer, script.character.roles)
        return answer, order.encode(answer)

    def check(self, script: Script) -> None:
        """Raise InvalidField for a script whose performance a file of the format cannot hold."""
        question, character = script.question, script.character
        if self.character is None:
            self.encoder.convention(question.unit, question.up, question.body)
            self.encoder.check_body(character.skeleton, character.roles)
        else:
            order = delivery.deliver(self.character, self.encoder, question)
            order.check_layout(self.layout)
            order.check(question, character.skeleton, character.roles)


@dataclass(frozen=True)
class ArchivedScript:
    """A planned script.

    name: of its file, without extension. frames: largest number of them. warned: whether its plan
    has a warning.
    """

    name: str
    script: Script
    frames: int
    warned: bool


@dataclass(frozen=True)
class PerformanceOrder:
    """Planned scripts, and the format of their files."""

    scripts: Sequence[ArchivedScript]
    format: PerformanceFormat

    @property
    def warnings(self) -> list[str]:
        """Warning with the number of scripts that have some; the manifest has those of each."""
        count, total = sum(planned.warned for planned in self.scripts), len(self.scripts)
        return [f"{count} of {total} performances have warnings"] if count else []

    def files(self) -> Iterator[ExportedFile]:
        """Yield the file of each performance, which is made when it is requested."""
        for planned in self.scripts:
            cancellation.check()
            path = f"{planned.name}.{self.format.encoder.extension}"
            # No name for the answer: it is not in memory while the next one is made.
            yield exported_file(
                planned.name, path, *self.format.file(planned.script, planned.frames)
            )


FOLDER = "performances"
PARTS = f"{STATE_FOLDER}/performances"
MARK = f"{STATE_FOLDER}/performances.json"
"""File of a target whose performances are not finished."""


@dataclass(frozen=True)
class PerformanceBatch:
    """Many performances of one format.

    models: files and folders of models besides the shipped ones. target: folder or URL. extension:
    of the files. layout: of USD files; InvalidField for a format without layouts.
    character: that moves instead of those of the scripts.
    """

    models: tuple[Path, ...]
    target: str
    extension: str
    layout: PerformanceLayout = "whole"
    character: UserCharacter | None = None

    def __post_init__(self) -> None:
        formats.performance_encoder(CLIP_ENCODERS[self.extension], self.layout)

    @property
    def format(self) -> PerformanceFormat:
        """Format of the files."""
        return PerformanceFormat(CLIP_ENCODERS[self.extension], self.layout, self.character)


@dataclass(frozen=True)
class BatchOutcome:
    """Result of a batch: the entries of its manifest, and how many were finished before."""

    entries: tuple[Entry, ...]
    before: int

    def facts(self, target: str) -> dict[str, Any]:
        """Return the totals as plain values."""
        return {
            "target": target,
            "performances": len(self.entries),
            "bytes": sum(entry["bytes"] for entry in self.entries),
            "warned": sum(bool(entry["warnings"]) for entry in self.entries),
            "before": self.before,
        }

    @property
    def sentence(self) -> str:
        """Return the totals in a sentence."""
        totals = self.facts("")
        text = f"{totals['performances']} performances, {totals['bytes'] / 1e6:.1f} MB"
        if totals["warned"]:
            text += f", with a warning in the manifest: {totals['warned']}"
        return f"{text}, finished before: {self.before}" if self.before else text


def run(
    batch: PerformanceBatch,
    rows: Sequence[ScriptRow],
    workers: int = 1,
    advance: Callable[[int], None] = lambda count: None,
) -> BatchOutcome:
    """Make the files that are missing, then the manifest.

    advance: called with the number of files that were found or made. Raises InvalidField, which
    lists all scripts at fault before a file is written, or names one whose performance failed;
    FileError if the target cannot be used; WorkerDied. Finished files are kept.
    """
    digests = _checked(batch, rows)
    target = open_target(batch.target)
    entries = _finished(target, batch, rows, digests)
    target.prepare()
    target.create(MARK, b"{}\n")
    advance(len(entries))
    missing = [(row, digests[row.name]) for row in rows if row.name not in entries]
    runner = process_pool.runner(workers, "the same command resumes")
    for entry in runner(partial(make_one, batch), iter(missing), lambda: False):
        entries[entry["name"]] = entry
        advance(1)
    ordered = tuple(entries[row.name] for row in rows)
    put_file(target, MANIFEST, map(manifest_line, ordered))
    target.remove(STATE_FOLDER)
    return BatchOutcome(ordered, len(rows) - len(missing))


def _checked(batch: PerformanceBatch, rows: Sequence[ScriptRow]) -> dict[str, str]:
    """Return the digest of each script with its models; InvalidField for scripts without answer."""
    registry = open_models(batch.models)
    digests: dict[str, str] = {}
    faults: list[str] = []
    for row in rows:
        try:
            script = resolve_script(row.question, registry.find)
            batch.format.check(script)
            digests[row.name] = _digest(batch, script, registry)
        except QueryError as error:
            faults.append(f"{row.place}: {error}")
    if faults:
        raise faulty_scripts(faults)
    return digests


def _digest(batch: PerformanceBatch, script: Script, registry: ModelRegistry) -> str:
    """Return a digest of all that determines the bytes of a performance."""
    choice, character = script.question.character, batch.character
    facts = [
        batch.extension,
        batch.layout,
        __version__,
        *(version(name) for name in VERSIONED_PACKAGES),
        *script.identities,
        "" if choice is None else registry.find(choice.model).identity,
        *([] if character is None else character.facts),
    ]
    content = msgspec.json.encode(script.question)
    return hashlib.sha256(orjson.dumps(facts) + content).hexdigest()


def _finished(
    target: ExportTarget,
    batch: PerformanceBatch,
    rows: Sequence[ScriptRow],
    digests: dict[str, str],
) -> dict[str, Entry]:
    """Return the entries of intact files by name; FileError for a target of something else."""
    try:
        recorded = {entry["name"]: entry for entry in _recorded(target, rows)}
        entries = {
            name: entry
            for name, entry in recorded.items()
            if entry["made_of"] == digests.get(name)
            and is_intact(
                target, WrittenFile(entry["file"], entry["bytes"], entry["sha256"]), verify=False
            )
        }
    except (ValueError, LookupError, TypeError) as error:
        raise FileError(
            batch.target, f"holds another export, expected performances or nothing ({error!r})"
        ) from error
    if target.read(checkpoint.JOB) is not None:
        raise FileError(batch.target, "holds an export of clips, expected performances or nothing")
    if not recorded and target.read(MARK) is None and not target.empty(but=STATE_FOLDER):
        raise FileError(batch.target, "is not empty and has no manifest of performances")
    return entries


def _recorded(target: ExportTarget, rows: Iterable[ScriptRow]) -> Iterator[Entry]:
    """Yield the entries of the manifest, then those of files that were made after it."""
    yield from map(orjson.loads, read_lines(target, MANIFEST))
    files = target.names(PARTS)
    for name in (row.name for row in rows if f"{row.name}.json" in files):
        yield orjson.loads(target.read(f"{PARTS}/{name}.json") or b"")


def make_one(batch: PerformanceBatch, job: tuple[ScriptRow, str]) -> Entry:
    """Write the file of a script and return its entry; QueryError names the script.

    job: the script and the digest of what makes its performance.
    """
    row, digest = job
    try:
        script = resolve_script(row.question, open_models(batch.models).find)
        answer, content = batch.format.file(script, MAX_FRAMES)
    except QueryError as error:
        raise faulty_scripts([f"{row.place}: {error}"]) from error
    path = f"{FOLDER}/{row.name}.{batch.extension}"
    target = open_target(batch.target)
    put_file(target, path, [content])
    entry = {**exported_file(row.name, path, answer, content).entry, "made_of": digest}
    target.write([(f"{PARTS}/{row.name}.json", manifest_line(entry))])
    return entry


@lru_cache(maxsize=1)
def open_models(paths: tuple[Path, ...]) -> ModelRegistry:
    """Return the models, cached so that a process opens them once."""
    return model_registry.with_shipped(paths)
