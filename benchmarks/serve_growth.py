"""Growth of the service's memory over a million requests.

    make build/models/reaching.onnx && .venv/bin/python benchmarks/serve_growth.py [MODEL]

Poses by wrk over 32 connections, no two questions of ten thousand alike; usual settings, the log
and metrics among them. Resident memory is taken after each hundred thousand, and what it is after
the first of them is where growth begins: until then buffers and tables reach their size.
"""

import sys
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
from rows import Row, table
from serve import MODEL, TOGETHER, pose_questions
from serve_load import Load, get, run
from serve_process import posefield

from posefield.inference import session

TOTAL, STEP = 1_000_000, 100_000
SECONDS = 4.0
"""Of each run of wrk, several of which make a step."""
FLAT = 1.0
"""MB: one byte a request."""


def rows(model: Path, total: int = TOTAL) -> list[Row]:
    """Return the growth of memory, in all and per request."""
    counts, sizes = measured(model, total)
    slope = np.polyfit(counts[1:], sizes[1:], 1)[0] * 1e6
    note = (
        f"after {counts[1]:,} requests, {sizes[1]:.1f} MB; slope {slope:.2f} bytes a request; MB "
        f"at each step: {', '.join(f'{size:.1f}' for size in sizes)}"
    )
    grown = sizes[-1] - sizes[1]
    return [Row(f"memory grown after {counts[-1]:,} requests", grown, "MB", note, None, FLAT)]


def measured(model: Path, total: int) -> tuple[list[int], list[float]]:
    """Requests answered until then, and resident memory, MB, before the first and at each step."""
    questions = pose_questions(session.load(model).card.controls)
    path = f"/v1/models/{model.stem}/pose"
    query = tuple(get(f"{path}?{urlencode(question)}") for question in questions)
    with posefield(model) as ours:
        counts, sizes, done = [0], [ours.resident()], 0
        while done < total:
            done += run(ours, Load(query, TOGETHER, SECONDS)).requests
            if done >= len(counts) * total * STEP // TOTAL:
                counts.append(done)
                sizes.append(ours.resident())
    return counts, sizes


if __name__ == "__main__":
    print(table(rows(Path(sys.argv[1]) if sys.argv[1:] else MODEL)))
