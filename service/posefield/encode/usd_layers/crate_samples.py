"""Time samples of a binary USD layer, written behind the values that usd-core wrote.

usd-core writes a layer with a sample for each attribute. The offset that leads from an attribute to
its times and samples then leads to others behind all other values, of any number, as the format
allows (pxr/usd/sdf/crateFile.cpp, `Write(TimeSamples)`). Equal samples are stored once, as usd-core
does; a loop's last sample is its first.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.units import Indices, Singles
from posefield.encode.usd_layers.crate_values import ALIGNMENT, COUNT, JUMP, OFFSET_BITS

ONE_TIME = COUNT.pack(1) + bytes(8)
"""Times of a single sample at time code 0."""
PROBED_NUMBERS = 8
"""Count of leading numbers of a sample whose sum is compared before whole samples are."""


@dataclass(frozen=True)
class SamplesPlace:
    """The place of an attribute's time samples in a layer.

    jump: position of the offset that leads to them. times, sample: descriptions of a list of times
    and of a sample, without their offsets.
    """

    jump: int
    times: int
    sample: int

    def add(self, values: bytearray, times: int, rows: Singles) -> None:
        """Append samples (F, ...) to values; times: offset of their times."""
        samples = _append_samples(values, rows)
        start = len(values)
        JUMP.pack_into(values, self.jump, start - self.jump)
        values += COUNT.pack(self.times | times) + JUMP.pack(JUMP.size) + COUNT.pack(len(rows))
        values += (samples.astype(np.uint64) | np.uint64(self.sample)).tobytes()


def add_times(values: bytearray, frames: int) -> int:
    """Append the time codes 0 to frames - 1 to values; return their offset."""
    offset = len(values)
    values += COUNT.pack(frames) + np.arange(frames, dtype=np.float64).tobytes()
    return offset


def find_place(values: bytes, row: Singles) -> SamplesPlace | None:
    """Return the place of an attribute with one sample (1, ...); None for another layout."""
    array = values.find(COUNT.pack(row.shape[1]) + row.tobytes())
    if array < 0:
        return None
    # The descriptions: of the times, an offset to the next byte, a count of one, of the sample.
    listed = JUMP.pack(JUMP.size) + COUNT.pack(1) + array.to_bytes(OFFSET_BITS // 8, "little")
    after = values.find(listed)
    if after < 0:
        return None
    (times,) = COUNT.unpack_from(values, after - COUNT.size)
    (sample,) = COUNT.unpack_from(values, after + JUMP.size + COUNT.size)
    # The first attribute of a layer has the times beside it, others refer to these.
    for between in (b"", ONE_TIME):
        jump = after - COUNT.size - len(between) - JUMP.size
        if values[jump : after - COUNT.size] == JUMP.pack(JUMP.size + len(between)) + between:
            return SamplesPlace(jump, _without_offset(times), _without_offset(sample))
    return None


def _without_offset(description: int) -> int:
    return description >> OFFSET_BITS << OFFSET_BITS


def _append_samples(values: bytearray, rows: Singles) -> Indices:
    """Append the distinct rows (F, N, ...) as arrays of N; return the offset of each row (F,)."""
    contents = np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), -1)
    repeats, which = repeated_rows(rows), np.arange(len(rows))
    if repeats is not None:
        distinct, which = np.unique(repeats, return_inverse=True)
        contents = contents[distinct]
    size = COUNT.size + contents.shape[1]
    block = np.empty((len(contents), size + -size % ALIGNMENT), np.uint8)
    block[:, : COUNT.size] = np.frombuffer(COUNT.pack(rows.shape[1]), np.uint8)
    block[:, COUNT.size : size] = contents
    block[:, size:] = 0
    values += bytes(-len(values) % ALIGNMENT)
    offset = len(values)
    values += block.data
    found: Indices = offset + which * block.shape[1]
    return found


def repeated_rows(rows: Singles) -> Indices | None:
    """Return for each row (F, ...) the index of the first equal row; None if all rows differ.

    Rows are compared by their first numbers, then by sums of a few numbers, and in full only if
    some of these are equal.
    """
    flat = rows.reshape(len(rows), -1)
    if _all_distinct(flat[:, 0]):
        return None
    probes = np.add.reduce(flat[:, :PROBED_NUMBERS], axis=1)
    if _all_distinct(probes):
        return None
    first = dict[Any, int]()
    alike = [first.setdefault(each, index) for index, each in enumerate(probes.tolist())]
    if not np.array_equal(rows, rows[alike]):
        first = {}
        alike = [first.setdefault(row.tobytes(), index) for index, row in enumerate(rows)]
    return np.array(alike) if len(first) < len(rows) else None


def _all_distinct(numbers: Singles) -> bool:
    ordered = np.sort(numbers)
    return not np.count_nonzero(ordered[1:] == ordered[:-1])
