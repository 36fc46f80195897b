"""Files of curves: CSV with a column `frame` and one for each curve, or files of motions."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import PurePosixPath

import numpy as np

from posefield.common.errors import RecipeError, did_you_mean
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.curves import Curve, CurveValues
from posefield.motion.skeleton import Skeleton
from posefield_train.source import clip_table, motion_readers
from posefield_train.source.clip_table import ClipRow, ClipTable
from posefield_train.source.control_sources import Curves
from posefield_train.source.data_folder import FileLocation
from posefield_train.source.motion_file import ReadOptions

FRAME = "frame"
TIMECODE, COUNT = "Timecode", "BlendShapeCount"
"""First columns of Live Link Face, which writes a row for each frame that it has."""
RESTING_JOINT = "Root"
"""Name of the only joint of clips without a skeleton."""


def _open(row: ClipRow, rate: float | None) -> ClipTable:
    """Return the table of a row's curves; of a file of motions the weights of blend shapes."""
    file = row.curve_file
    if PurePosixPath(file.name).suffix.lower() not in motion_readers.SUFFIXES:
        return _expect_frames(clip_table.open_table(file), rate)
    curves = motion_readers.read(file, ReadOptions(rate, row.animation)).curves
    columns = {name: map(repr, values.tolist()) for name, values in curves.items()}
    cells = zip(*columns.values(), strict=True)
    numbered = ((str(frame), *values) for frame, values in enumerate(cells))
    records = [dict(zip((FRAME, *columns), values, strict=True)) for values in numbered]
    return _expect_frames(ClipTable(str(file), list(enumerate(records))))


def find_curves(keys: Curves, rows: Sequence[ClipRow], rate: float | None) -> tuple[Curve, ...]:
    """Return the curves of the files of rows, which are those of the first one.

    rate: of the recipe, frames a second. Raises RecipeError for keys of an unknown curve, and for a
    file without curves.
    """
    first = _open(rows[0], rate)
    names = keys.names or [name for name in first.columns if name != FRAME]
    if not names:
        raise RecipeError(first.name, f"found no column beside {FRAME!r}, expected curves", 1)
    for name in keys.of:
        if name not in names:
            text = f"curves.of.{name}{did_you_mean(name, names)}, expected one of {names}"
            raise RecipeError(first.name, text, 1)
    return tuple(map(keys.curve, names))


def read(row: ClipRow, keys: Curves, curves: tuple[Curve, ...], rate: float | None) -> CurveValues:
    """Return the curves of a row.

    Raises RecipeError for a missing column or frame, and for a cell that is not a number within the
    curve's range.
    """
    table = _open(row, rate)
    _expect_columns(table, [curve.name for curve in curves], keys)
    return _values(table, curves)


def read_known(file: FileLocation, curves: tuple[Curve, ...]) -> tuple[CurveValues, list[str]]:
    """Return the curves of a trained model from a file, and the names of its other columns.

    Raises RecipeError for a missing column or frame, and for a cell that is not a number within the
    curve's range.
    """
    table, names = _expect_frames(clip_table.open_table(file)), [curve.name for curve in curves]
    missing = [name for name in names if name not in table.columns]
    if missing:
        hint = did_you_mean(missing[0], table.columns)
        raise RecipeError(table.name, f"found no curves {missing}{hint}, expected {names}", 1)
    unused = [name for name in table.columns if name not in (FRAME, *names)]
    return _values(table, curves), unused


def with_curves(clip: Clip, curves: CurveValues, row: ClipRow) -> Clip:
    """Return a clip of all frames of a motion file with its curves.

    Raises RecipeError for another number of frames.
    """
    if len(curves.values) != len(clip):
        raise row.error(
            f"{row.curve_file} has {len(curves.values)} frames of curves and {row.file} has "
            f"{len(clip)} frames, expected as many"
        )
    return replace(clip, curves=curves)


def resting_clip(curves: CurveValues, rate: float) -> Clip:
    """Return a clip of curves on one joint that rests at the origin."""
    frames, nothing = len(curves.values), np.zeros((1, 3))
    joints = Skeleton((RESTING_JOINT,), (-1,), nothing, (), np.zeros((0, 3)))
    rotations = np.tile(quat.IDENTITY, (frames, 1, 1))
    return Clip(joints, rotations, np.zeros((frames, 1, 3)), rate, curves)


def _expect_frames(table: ClipTable, rate: float | None = None) -> ClipTable:
    """Return a table of curves; RecipeError unless its column of frames counts 0, 1, 2, …

    rate: frames a second, by which the time codes of Live Link Face count frames; None leaves them.
    """
    if table.columns[:2] == [TIMECODE, COUNT]:
        return _numbered(table, rate)
    table.require({FRAME: "number of the frame, from 0"})
    numbers = [(line, table.frame(line, record, FRAME)) for line, record in table.records]
    for (_, before), (line, frame) in pairwise([(0, -1), *numbers]):
        if frame != before + 1:
            at = f"after {before}" if before >= 0 else "first"
            raise RecipeError(table.name, f"frame {frame} {at}, expected {before + 1}", line)
    return table


def _numbered(table: ClipTable, rate: float | None) -> ClipTable:
    """Return a table of Live Link Face with numbers of frames in place of time codes.

    Raises RecipeError for a time code that is none, and where frames are missing.
    """
    codes = [_seconds(table, line, record[TIMECODE], rate) for line, record in table.records]
    records = []
    for number, (line, record) in enumerate(table.records):
        if number and rate and abs((codes[number] - codes[number - 1]) * rate - 1.0) > 0.5:
            raise RecipeError(
                table.name,
                f"{TIMECODE} {record[TIMECODE]} lies {codes[number] - codes[number - 1]:.3f} s "
                f"behind the one before, expected one frame of {rate:g} a second",
                line,
            )
        cells = {name: cell for name, cell in record.items() if name not in (TIMECODE, COUNT)}
        records.append((line, {FRAME: str(number), **cells}))
    return ClipTable(table.name, records)


def _seconds(table: ClipTable, line: int, code: str, rate: float | None) -> float:
    """Return the time, s, of a code of hours, minutes, seconds and frames."""
    parts = code.split(":")
    try:
        hours, minutes, seconds, frames = map(float, parts)
    except ValueError:
        expected = f"{TIMECODE} {code!r}, expected hours:minutes:seconds:frames"
        raise RecipeError(table.name, expected, line) from None
    return 3600.0 * hours + 60.0 * minutes + seconds + frames / (rate or 60.0)


def _expect_columns(table: ClipTable, names: Sequence[str], keys: Curves) -> None:
    columns = [name for name in table.columns if name != FRAME]
    missing = [name for name in names if name not in columns]
    # Columns beside those that the recipe names are not curves of the family.
    more = [] if keys.names else [name for name in columns if name not in names]
    if missing or more:
        hint = did_you_mean(missing[0], columns) if missing else ""
        faults = [f"no curves {missing}{hint}"] * bool(missing)
        faults += [f"curves {more} that the first clip lacks"] * bool(more)
        raise RecipeError(table.name, f"found {' and '.join(faults)}, expected {list(names)}", 1)


def _values(table: ClipTable, curves: tuple[Curve, ...]) -> CurveValues:
    columns = []
    for curve in curves:
        values = [(line, table.number(line, record, curve.name)) for line, record in table.records]
        for line, value in values:
            if not curve.minimum <= value <= curve.maximum:
                raise RecipeError(
                    table.name,
                    f"column {curve.name!r}: {value:g}, expected {curve.minimum:g} to "
                    f"{curve.maximum:g} (curves.range)",
                    line,
                )
        columns.append([value for _, value in values])
    return CurveValues(curves, np.stack(columns, axis=-1))
