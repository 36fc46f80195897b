"""Compression of tables: principal components of rows, integers of 16 bits, and one text of all."""

import gzip
from base64 import b64encode
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
import orjson

from posefield.common.units import Floats, Singles

COMPRESSION = 6
"""Level of gzip; 9 takes ten times as long for one percent."""
LARGEST = 32_767
"""Largest integer of a block."""
BATCH = 500
"""Rows of which intermediate arrays are held at a time."""


@dataclass(frozen=True)
class Block:
    """Numbers (rows, columns) as integers times the step of their column."""

    name: str
    integers: Annotated[npt.NDArray[np.int16], "rows columns"]
    steps: Annotated[Floats, "columns"]

    @property
    def numbers(self) -> Annotated[Singles, "rows columns"]:
        """The numbers, as a reader has them."""
        return np.asarray(self.integers * self.steps, np.float32)

    @property
    def content(self) -> bytes:
        """The integers, column by column: all low bytes, then all high ones.

        The high bytes are nearly all equal, which gzip shortens.
        """
        pairs = np.ascontiguousarray(self.integers.T, dtype="<i2").view(np.uint8).reshape(-1, 2)
        return bytes(pairs.T.tobytes())

    @property
    def head(self) -> dict[str, object]:
        """Name, shape and steps, for a reader of the content."""
        rows, columns = self.integers.shape
        steps = [float(np.float32(step)) for step in self.steps]
        return {"name": self.name, "rows": rows, "columns": columns, "steps": steps}


def block(
    name: str, numbers: Annotated[Floats | Singles, "rows columns"], step: Floats | float = 0.0
) -> Block:
    """Return a block of numbers.

    step: of each column or of all, made larger where the largest number needs it.
    """
    least = np.abs(numbers).max(axis=0) / LARGEST
    steps = np.maximum(np.maximum(least, step), np.finfo(np.float32).tiny).astype(float)
    return Block(name, np.rint(numbers / steps).astype(np.int16), steps)


@dataclass(frozen=True)
class Components:
    """Mean row (W,) and orthonormal components (R, W) of rows (N, W)."""

    mean: Annotated[Singles, "numbers"]
    basis: Annotated[Singles, "rank numbers"]

    def coefficients(
        self, rows: Annotated[Singles, "rows numbers"]
    ) -> Annotated[Singles, "rows rank"]:
        """Return the coefficients (N, R) of rows (N, W)."""
        return np.asarray((rows - self.mean) @ self.basis.T, np.float32)

    def distances(self, rows: Annotated[Singles, "rows numbers"]) -> Annotated[Floats, "rows"]:
        """Return the squared distances (N,) of rows (N, W) from the components."""
        found = np.empty(len(rows))
        for part in (slice(at, at + BATCH) for at in range(0, len(rows), BATCH)):
            gaps = rows[part] - self.mean
            found[part] = np.sum(np.square(gaps), axis=1)
            found[part] -= np.sum(np.square(gaps @ self.basis.T), axis=1)
        return found


def robust_components(
    rows: Annotated[Singles, "rows numbers"], least: float, count: int
) -> Components:
    """Return the components of some of many rows (N, W), among them those that others miss.

    From `count` even rows first; then the `count` rows furthest from their components are added.
    """
    even = np.linspace(0, len(rows) - 1, min(count, len(rows))).astype(int)
    first = components(rows[even], least)
    furthest = np.argsort(first.distances(rows), kind="stable")[-count:]
    return components(rows[np.union1d(even, furthest)], least)


def components(rows: Annotated[Singles, "rows numbers"], least: float) -> Components:
    """Return the components of rows (N, W) along which a row lies at least `least` off the mean.

    From the eigenvectors of the products of rows (N, N), since rows are long.
    """
    mean = rows.mean(axis=0)
    centred = (rows - mean).astype(float)
    squares, turns = np.linalg.eigh(centred @ centred.T)
    sizes = np.sqrt(np.maximum(squares, np.finfo(float).tiny))
    far = np.abs(turns * sizes).max(axis=0) >= least
    # At least one component, since a block has a column.
    far[-1] = True
    basis = (turns[:, far] / sizes[far]).T @ centred
    return Components(mean, basis[::-1].astype(np.float32))


def pack(tables: Mapping[str, Any], parts: Iterable[bytes]) -> str:
    """Return tables and binary parts as base64 of gzip, the same for the same content.

    Four bytes with the length of the tables, little-endian; the tables as JSON; the parts.
    clients/viewer/src/offline/read.ts reads it.
    """
    head = orjson.dumps(tables)
    content = [len(head).to_bytes(4, "little"), head, *parts]
    return b64encode(gzip.compress(b"".join(content), COMPRESSION, mtime=0)).decode()
