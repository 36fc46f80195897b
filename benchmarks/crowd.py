"""Crowds: how long poses take, what bounds them, and what levels of detail are worth.

OPENBLAS_NUM_THREADS=1 .venv/bin/python benchmarks/crowd.py
"""

import tempfile
from pathlib import Path

import clip_feet
import crowd_bounds
import crowd_distances
import crowd_feet
import crowd_models
import crowd_poses
import crowd_rivals
import crowd_walk
import family
from family import Family
from rows import Row, table


def rows(trained_family: Family) -> list[Row]:
    """Poses of the procedural family, rivals of the same crowd, and walking crowds and clips."""
    model, walks = crowd_models.reaching(trained_family), crowd_models.walks()
    return [
        *crowd_poses.rows(model),
        *crowd_bounds.rows(trained_family, model),
        *crowd_rivals.rows(trained_family, model),
        *crowd_walk.rows(walks),
        *crowd_feet.rows(walks),
        *crowd_distances.rows(walks),
        *clip_feet.rows(walks),
    ]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        print(table(rows(family.make(Path(folder) / "reaching"))))
