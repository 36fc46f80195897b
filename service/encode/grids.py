"""Sigma grids as tables: the grid itself, or one row per point."""

from typing import Any

import numpy as np

from service.encode import tables
from service.encode.tables import Table
from service.motion.answer import SigmaGrid


def table(grid: SigmaGrid) -> Table:
    """Return the values of both axes, with sigma, inside and supported (R, C) as arrays."""
    arrays = {
        "across_values": grid.across.values,
        "along_values": grid.along.values,
        "sigma": tables.single(grid.sigma),
        "inside": grid.inside,
        "supported": grid.supported,
    }
    return Table({}, _facts(grid), arrays)


def points(grid: SigmaGrid) -> Table:
    """Return the grid as a table of R C rows, ordered by `along`, then `across`."""
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
