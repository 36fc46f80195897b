"""Helpers for tables of queries: files of them, and the queries that a source reads."""

import csv
import json
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from posefield.batch.rows import row_sources
from posefield.batch.rows.columns import OPTION_KINDS
from posefield.batch.rows.row_query import ClipQuery, RowFault
from posefield.batch.rows.row_sources import Defaults, SourceOptions

POINT = {"stature": 1.7, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}
TYPES = {"level": pa.int32(), "name": pa.string(), "format": pa.string()}
TYPES |= {"performer": pa.string(), "extrapolate": pa.string()}
TYPES |= {"names": pa.string(), "root": pa.string(), "loop": pa.bool_()}
TYPES |= {"exact": pa.string(), "targets": pa.string(), "feet": pa.string()}
TYPES |= {"take": pa.int64(), "variety": pa.float64(), "detail": pa.bool_()}


def columns(rows):
    """Controls first, then whatever any row says, in the order of messages in JSON Lines."""
    said = dict.fromkeys(key for row in rows for key in row)
    return [
        *(key for key in said if key not in OPTION_KINDS),
        *(key for key in OPTION_KINDS if key in said),
    ]


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
    made = {
        c: pa.array([r.get(c) for r in rows], TYPES.get(c, pa.float64())) for c in columns(rows)
    }
    pq.write_table(pa.table(made), path)
    return path


def text(path: Path, *lines, end="\n"):
    """CSV of lines below a heading of the controls, or as they are if the first is a heading."""
    path.write_text(end.join([*lines, ""]), newline="")
    return path


def source(model, path=None, usual=None, **asked):
    return row_sources.open_source(SourceOptions(path, **asked), usual or Defaults("usdc"), model)


def rows(model, path=None, usual=None, **asked):
    return list(source(model, path, usual, **asked).rows())


def faults(model, path, usual=None):
    """Places, without the folder, and messages of the faults; the survey's must be the same."""
    opened = source(model, path, usual)
    found = [row for row in opened.rows() if isinstance(row, RowFault)]
    survey = opened.survey()
    assert (survey.faulty, survey.faults) == (len(found), tuple(found[:20]))
    return [(fault.place.removeprefix(f"{path.parent}/"), fault.message) for fault in found]


def asked(found):
    """Names, formats and questions of rows that are all queries."""
    found = list(found)
    assert all(isinstance(row, ClipQuery) for row in found), found
    return [(row.name, row.format, row.question) for row in found]
