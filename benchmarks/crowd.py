"""Crowds: how long poses take, what bounds them, and what levels of detail are worth.

OPENBLAS_NUM_THREADS=1 .venv/bin/python benchmarks/crowd.py
"""

import tempfile
from pathlib import Path

import crowd_bounds
import crowd_models
import crowd_poses
import crowd_rivals
import crowd_walk
from rows import Row, table

from model_export.evaluate import table1_family
from model_export.evaluate.table1_family import Family


def rows(made: Family) -> list[Row]:
    """Poses of the procedural family, rivals of the same crowd, and crowds that walk."""
    model = crowd_models.reaching(made)
    return [
        *crowd_poses.rows(model),
        *crowd_bounds.rows(made, model),
        *crowd_rivals.rows(made, model),
        *crowd_walk.rows(crowd_models.walks()),
    ]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        print(table(rows(table1_family.make(Path(folder) / "reaching"))))
