"""Helpers for tables of queries: files of them, and the queries that a source reads."""

import csv
import json
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from posefield.batch.rows import DEFAULTS, Row, RowFault, open_source
from posefield.batch.tables import OPTION_COLUMNS
from posefield.common.errors import QueryError
from posefield.question.motion_question import ClipQuestion

POINT = {"stature": 1.7, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}


class Usual(NamedTuple):
    """Values of the command where a row has none."""

    format: str = "usdc"
    question: ClipQuestion = DEFAULTS


TYPES = {"level": pa.int32(), "take": pa.int64(), "loop": pa.bool_(), "detail": pa.bool_()}
WORDS = ("name", "format", "performer", "extrapolate", "names", "root", "exact", "targets", "feet")
TYPES |= dict.fromkeys(WORDS, pa.string())


def columns(rows):
    """Controls first, then whatever any row says."""
    given = dict.fromkeys(key for row in rows for key in row)
    return sorted(given, key=lambda title: title in OPTION_COLUMNS)


def write_csv(path: Path, rows):
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, columns(rows))
        writer.writeheader()
        # repr of a float gives the same float back.
        writer.writerows({k: "" if v is None else v for k, v in row.items()} for row in rows)
    return path


def write_jsonl(path: Path, rows):
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return path


def write_parquet(path: Path, rows):
    table = {
        c: pa.array([r.get(c) for r in rows], TYPES.get(c, pa.float64())) for c in columns(rows)
    }
    pq.write_table(pa.table(table), path)
    return path


def text(path: Path, *lines, end="\n"):
    """File of lines."""
    path.write_text(end.join([*lines, ""]), newline="")
    return path


def source(model, path=None, usual=None, **asked):
    return open_source(model, *(usual or Usual()), path=path, **asked)


def rows(model, path=None, usual=None, **asked):
    """Return the rows of a source; a fault for each that the model cannot answer."""
    opened = source(model, path, usual, **asked)
    return [checked(opened, row) for row in opened.rows()]


def checked(opened, row):
    """Return a row, or its fault."""
    try:
        if isinstance(row, Row):
            opened.check(row)
    except QueryError as fault:
        return RowFault(row.place, str(fault))
    return row


def faults(model, path, usual=None):
    """Return places, without the folder, and messages of the faults."""
    found = [row for row in rows(model, path, usual) if isinstance(row, RowFault)]
    return [(fault.place.removeprefix(f"{path.parent}/"), fault.message) for fault in found]


def asked(found):
    """Return names, formats and questions of rows that are all queries."""
    found = list(found)
    assert all(isinstance(row, Row) for row in found), found
    return [(row.name, row.format, row.question) for row in found]
