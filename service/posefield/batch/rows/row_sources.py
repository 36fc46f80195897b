"""Sources of queries: a file, a grid or a sampling.

A file is a table (CSV, Parquet) or objects (JSON Lines), by its ending. It has a column for each
control of the model, and optionally those of `columns.OPTION_KINDS`; the defaults of missing values
come from the command line. `rows` yields a query or a fault for each row, in the source's order.

    source = open_source(SourceOptions(path), Defaults("usdc"), model)
    found = source.survey()
    for row in source.rows(): ...
"""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import orjson
from msgspec import structs, to_builtins

from posefield.batch.rows import (
    columns,
    csv_rows,
    grid_rows,
    jsonl_rows,
    parquet_rows,
    sampled_rows,
    source_files,
)
from posefield.batch.rows.columns import Columns
from posefield.batch.rows.row_blocks import BrokenRow, RowBlock
from posefield.batch.rows.row_query import RowFault, RowSource
from posefield.batch.rows.row_validation import Defaults, RowReader
from posefield.batch.rows.source_files import SourceFile
from posefield.common.errors import InvalidField, UnknownFormat
from posefield.common.name_suggestion import did_you_mean
from posefield.encode.formats import CLIP_ENCODERS
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

METHOD, SEED = "latin", 0


@dataclass(frozen=True)
class SourceOptions:
    """Source options of the command line: exactly one of path, grid and sample.

    path: of a file. grid: NAME=VALUES texts. sample: number of points. method, seed: of a sampling
    only.
    """

    path: Path | None = None
    grid: tuple[str, ...] = ()
    sample: int | None = None
    method: str | None = None
    seed: int | None = None


class _UnparsedRows(Protocol):
    """A source of rows that are not yet parsed."""

    def place(self, number: int, /) -> str: ...
    def blocks(self) -> Iterator[RowBlock | BrokenRow]: ...


READERS: Mapping[str, Callable[[SourceFile, Columns], _UnparsedRows]] = {
    ".csv": csv_rows.read,
    ".jsonl": jsonl_rows.JsonLinesFile,
    ".ndjson": jsonl_rows.JsonLinesFile,
    ".parquet": parquet_rows.read,
}


def open_source(asked: SourceOptions, usual: Defaults, model: Synthesizer) -> RowSource:
    """Return the source of the queries, with defaults for missing values.

    Raises InvalidField, UnknownFormat and OutsideSamples for invalid options, and FileError for a
    file that cannot be read or has a heading that does not fit the model.
    """
    _check_single_source(asked)
    _check_defaults(usual, model)
    found, spec = _unparsed_rows(asked, model)
    digest = _digest({**spec, "format": usual.format, "usual": to_builtins(usual.question)})
    return RowReader(found.blocks, found.place, model, usual, digest)


def points(path: Path, model: Synthesizer) -> list[dict[str, float]]:
    """Return the controls of each row of a file.

    Raises as `open_source` does, and InvalidField for an invalid row.
    """
    rows = open_source(SourceOptions(path), Defaults("usdc"), model).rows()
    found = []
    for row in rows:
        if isinstance(row, RowFault):
            raise InvalidField("candidates", f"{row.place}: {row.message}")
        found.append(dict(row.question.controls))
    return found


def _check_single_source(asked: SourceOptions) -> None:
    given = {
        "a file": asked.path is not None,
        "--grid": bool(asked.grid),
        "--sample": asked.sample is not None,
    }
    if sum(given.values()) != 1:
        found = " and ".join(name for name, there in given.items() if there) or "none"
        raise InvalidField("queries", f"{found}, expected one of {', '.join(given)}")
    for option in ("method", "seed"):
        if getattr(asked, option) is not None and asked.sample is None:
            raise InvalidField(option, "without --sample, expected with it")


def _check_defaults(usual: Defaults, model: Synthesizer) -> None:
    """Validate the defaults alone; rows are validated only in the values that they have."""
    if usual.format not in CLIP_ENCODERS:
        found = f"{usual.format!r}{did_you_mean(usual.format, CLIP_ENCODERS)}"
        raise UnknownFormat("format", f"{found}, expected one of {', '.join(CLIP_ENCODERS)}")
    middle = {control.name: control.default for control in model.session.card.controls}
    clips.check(model, structs.replace(usual.question, controls=middle))


def _unparsed_rows(
    asked: SourceOptions, model: Synthesizer
) -> tuple[_UnparsedRows, dict[str, Any]]:
    """Return the unparsed rows of a source, and their parameters as plain values."""
    card = model.session.card
    known = columns.columns_of(card)
    if asked.path:
        return _file_rows(asked.path, known)
    if asked.grid:
        points = grid_rows.parse_grid(asked.grid, known, card)
        return points, points.spec()
    method, seed = asked.method or METHOD, SEED if asked.seed is None else asked.seed
    count = asked.sample or 0
    sampled_rows.check_sampling(method, count, seed)
    drawn = sampled_rows.SampledPoints(known.controls, card, method, count, seed)
    return drawn, drawn.spec()


def _file_rows(path: Path, known: Columns) -> tuple[_UnparsedRows, dict[str, Any]]:
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise UnknownFormat("queries", f"{path.name!r} ends in none of {', '.join(READERS)}")
    original = source_files.fingerprint(path)
    return reader(original, known), {"file": path.suffix.lower(), "sha256": original.digest}


def _digest(spec: Mapping[str, Any]) -> str:
    return hashlib.sha256(orjson.dumps(spec, option=orjson.OPT_SORT_KEYS)).hexdigest()
