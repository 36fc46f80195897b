"""Performances of many scripts as files with a manifest; the same command resumes.

The folder contains `performances/NAME.FORMAT` and `manifest.jsonl`, one line for each script in its
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
from posefield.batch import checkpoint, manifest
from posefield.batch.job import VERSIONED_PACKAGES
from posefield.batch.scripts import performance_archive, script_pool, script_rows
from posefield.batch.scripts.script_rows import ScriptRow
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
from posefield.common.errors import FileError, QueryError
from posefield.encode import performance_files
from posefield.encode.formats import CLIP_ENCODERS
from posefield.encode.performance_files import PerformanceEncoder
from posefield.performance import composition
from posefield.performance.script import Script, resolve_script
from posefield.question.performance_batch_question import PerformanceLayout
from posefield.question.performance_report import PerformanceAnswer
from posefield.registry import shipped_models
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.frame_times import MAX_POSES

MAX_FRAMES = 10 * MAX_POSES
FOLDER = "performances"
MANIFEST, PARTS = "manifest.jsonl", f"{STATE_FOLDER}/performances"
MARK = f"{STATE_FOLDER}/performances.json"
"""File of a target whose performances are not finished."""
Entry = dict[str, Any]


@dataclass(frozen=True)
class PerformanceBatch:
    """Many performances of one format.

    models: files and folders of models besides the shipped ones. place: folder or URL. form:
    extension of the files. layout: of USD files; InvalidField for a form without layouts.
    character: that moves instead of those of the scripts.
    """

    models: tuple[Path, ...]
    place: str
    form: str
    layout: PerformanceLayout = "whole"
    character: UserCharacter | None = None

    def __post_init__(self) -> None:
        performance_files.encoder(CLIP_ENCODERS[self.form], self.layout)

    def file(self, script: Script) -> tuple[PerformanceAnswer, bytes]:
        """Return the performance of a script, and its file."""
        form, question = CLIP_ENCODERS[self.form], script.question
        if self.character is None:
            convention = form.convention(question.unit, question.up, question.body)
            answer = composition.perform(script, MAX_FRAMES)
            return answer, self.encode(answer, convention)
        order = delivery.deliver(self.character, form, question)
        made = order.performance(composition.perform(script, MAX_FRAMES), script.character.roles)
        return made, order.encode(made)

    def check(self, script: Script) -> None:
        """Raise InvalidField for what a file of the form cannot hold."""
        form, question, own = CLIP_ENCODERS[self.form], script.question, script.character
        if self.character is None:
            form.convention(question.unit, question.up, question.body)
        else:
            order = delivery.deliver(self.character, form, question)
            order.check_layout(self.layout)
            order.check(question, own.skeleton, own.roles)

    @property
    def encode(self) -> PerformanceEncoder:
        """Return the function that encodes a performance."""
        return performance_files.encoder(CLIP_ENCODERS[self.form], self.layout)


@dataclass(frozen=True)
class BatchOutcome:
    """Result of a batch: the entries of its manifest, and how many were finished before."""

    entries: tuple[Entry, ...]
    before: int

    def facts(self, place: str) -> dict[str, Any]:
        """Return the totals as plain values."""
        return {
            "target": place,
            "performances": len(self.entries),
            "bytes": sum(entry["bytes"] for entry in self.entries),
            "warned": sum(bool(entry["warnings"]) for entry in self.entries),
            "before": self.before,
        }

    @property
    def sentence(self) -> str:
        """Return the totals in a sentence."""
        found = self.facts("")
        text = f"{found['performances']} performances, {found['bytes'] / 1e6:.1f} MB"
        if found["warned"]:
            text += f", with a warning in the manifest: {found['warned']}"
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
    target = open_target(batch.place)
    found = _finished(target, batch, rows, digests)
    target.prepare()
    target.create(MARK, b"{}\n")
    advance(len(found))
    left = [(row, digests[row.name]) for row in rows if row.name not in found]
    for entry in script_pool.results(partial(make_one, batch), left, workers):
        found[entry["name"]] = entry
        advance(1)
    entries = tuple(found[row.name] for row in rows)
    put_file(target, MANIFEST, map(manifest.line, entries))
    target.remove(STATE_FOLDER)
    return BatchOutcome(entries, len(rows) - len(left))


def _checked(batch: PerformanceBatch, rows: Sequence[ScriptRow]) -> dict[str, str]:
    """Return the digest of each script with its models; InvalidField for scripts without answer."""
    registry = open_models(batch.models)
    digests: dict[str, str] = {}
    faults: list[str] = []
    for row in rows:
        try:
            script = resolve_script(row.script, registry.find)
            batch.check(script)
            digests[row.name] = _digest(batch, script, registry)
        except QueryError as fault:
            faults.append(f"{row.place}: {fault}")
    if faults:
        raise script_rows.faulty_scripts(faults)
    return digests


def _digest(batch: PerformanceBatch, script: Script, registry: ModelRegistry) -> str:
    """Return a digest of all that determines the bytes of a performance."""
    chosen, whom = script.question.character, batch.character
    facts = [
        batch.form,
        batch.layout,
        __version__,
        *(version(name) for name in VERSIONED_PACKAGES),
        *script.identities,
        "" if chosen is None else registry.find(chosen.model).identity,
        *([] if whom is None else whom.facts),
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
        known = {entry["name"]: entry for entry in _recorded(target, rows)}
        found = {
            name: entry
            for name, entry in known.items()
            if entry["made_of"] == digests.get(name)
            and is_intact(target, WrittenFile(*_written(entry)), verify=False)
        }
    except (ValueError, LookupError, TypeError) as fault:
        raise FileError(
            batch.place, f"holds another export, expected performances or nothing ({fault!r})"
        ) from fault
    if target.read(checkpoint.JOB) is not None:
        raise FileError(batch.place, "holds an export of clips, expected performances or nothing")
    if not known and target.read(MARK) is None and not target.empty(but=STATE_FOLDER):
        raise FileError(batch.place, "is not empty and has no manifest of performances")
    return found


def _recorded(target: ExportTarget, rows: Iterable[ScriptRow]) -> Iterator[Entry]:
    """Yield the entries of the manifest, then those of files that were made after it."""
    yield from map(orjson.loads, read_lines(target, MANIFEST))
    parts = target.names(PARTS)
    for name in (row.name for row in rows if f"{row.name}.json" in parts):
        yield orjson.loads(target.read(f"{PARTS}/{name}.json") or b"")


def _written(entry: Entry) -> tuple[str, int, str]:
    return entry["file"], entry["bytes"], entry["sha256"]


def make_one(batch: PerformanceBatch, job: tuple[ScriptRow, str]) -> Entry:
    """Write the file of a script and return its entry; QueryError names the script.

    job: the script and the digest of what makes its performance.
    """
    row, digest = job
    script = row.script
    try:
        answer, content = batch.file(resolve_script(script, open_models(batch.models).find))
    except QueryError as fault:
        raise script_rows.faulty_scripts([f"{row.place}: {fault}"]) from fault
    path = f"{FOLDER}/{row.name}.{batch.form}"
    target = open_target(batch.place)
    put_file(target, path, [content])
    entry = {
        **performance_archive.entry(row.name, path, content, answer),
        "made_of": digest,
    }
    target.write([(f"{PARTS}/{row.name}.json", manifest.line(entry))])
    return entry


@lru_cache(maxsize=1)
def open_models(places: tuple[Path, ...]) -> ModelRegistry:
    """Return the models, cached so that a process opens them once."""
    return shipped_models.with_shipped(places)
