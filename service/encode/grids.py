"""Sigma over two controls as a table: the grid itself, or a row for each of its points."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from service.encode import tables
from service.encode.arrow import arrow
from service.encode.media import ARROW, JSON, MSGPACK, NPZ
from service.encode.tables import Table
from service.motion.answer import SigmaGrid


def table(grid: SigmaGrid) -> Table:
    """The values of both axes, and sigma, inside and supported (rows, columns)."""
    arrays = {
        "across_values": grid.across.values,
        "along_values": grid.along.values,
        "sigma": tables.single(grid.sigma),
        "inside": grid.inside,
        "supported": grid.supported,
    }
    return Table({}, _facts(grid), arrays)


def points(grid: SigmaGrid) -> Table:
    """The same as R C rows, those of one value along behind one another."""
    across, along = np.meshgrid(grid.across.values, grid.along.values)
    columns = {
        "across_values": across.ravel(),
        "along_values": along.ravel(),
        "sigma": tables.single(grid.sigma).ravel(),
        "inside": grid.inside.ravel(),
        "supported": grid.supported.ravel(),
    }
    return Table(columns, _facts(grid))


def _facts(grid: SigmaGrid) -> dict[str, Any]:
    across, along = grid.across.control, grid.along.control
    return {
        "model": grid.model,
        "across": across.name,
        "along": along.name,
        "controls": grid.controls,
        "performer": grid.performer,
        "units": {"across": across.unit, "along": along.unit, "sigma": "metre"},
    }


@dataclass(frozen=True)
class GridEncoder:
    """How one format of a grid is named and made."""

    extension: str
    media_type: str
    encode: Callable[[SigmaGrid], bytes]


GRID_ENCODERS = {
    encoder.extension: encoder
    for encoder in (
        GridEncoder("json", JSON, lambda grid: tables.json(table(grid))),
        GridEncoder("msgpack", MSGPACK, lambda grid: tables.msgpack(table(grid))),
        GridEncoder("npz", NPZ, lambda grid: tables.npz(table(grid))),
        GridEncoder("arrow", ARROW, lambda grid: arrow(points(grid))),
    )
}
