"""Scripts of performances from a folder of JSON files, or from the lines of a JSON Lines file."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from posefield.common.errors import FileError, InvalidField, QueryError
from posefield.question import json_decoding
from posefield.question.performance_batch_question import NamedScript

LINES = ".jsonl"
MAX_LINE_BYTES = 256 * 1024
MAX_SHOWN_FAULTS = 10


@dataclass(frozen=True)
class ScriptRow:
    """A script of many. place: file and line, for messages. name: of its file, without ending."""

    place: str
    name: str
    script: NamedScript


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
    for place, name, content in _contents(path):
        try:
            row = _row(place, name, content)
            if row.name in rows:
                other = rows[row.name].place
                raise InvalidField("name", f"{row.name!r} is that of {other}, expected another")
            rows[row.name] = row
        except QueryError as fault:
            faults.append(f"{place}: {fault}")
    if faults:
        raise faulty_scripts(faults)
    if not rows:
        raise InvalidField("scripts", f"{path} has no script, expected at least one")
    return tuple(rows.values())


def faulty_scripts(faults: list[str]) -> InvalidField:
    """Return the error for invalid scripts, with the first of their faults."""
    shown = "".join(f"\n  {fault}" for fault in faults[:MAX_SHOWN_FAULTS])
    more = len(faults) - MAX_SHOWN_FAULTS
    rest = f"\n  and {more} more" if more > 0 else ""
    return InvalidField("scripts", f"{len(faults)} that cannot be performed:{shown}{rest}")


def _row(place: str, name: str, content: bytes) -> ScriptRow:
    if len(content) > MAX_LINE_BYTES:
        raise InvalidField("", f"{len(content)} bytes, expected at most {MAX_LINE_BYTES}")
    script = json_decoding.decode_question(NamedScript, content)
    return ScriptRow(place, script.name or name, script)


def _contents(path: Path) -> Iterator[tuple[str, str, bytes]]:
    """Yield place, default name and content of each script."""
    try:
        if path.is_dir():
            for file in sorted(path.glob("*.json")):
                yield file.name, file.stem, file.read_bytes()
            return
        for number, line in enumerate(path.read_bytes().splitlines(), 1):
            if line.strip():
                yield f"{path.name}:{number}", f"{number:06d}", line
    except OSError as fault:
        raise FileError(path, f"{fault.strerror}, expected scripts in JSON") from fault
