"""Prints what posefield is measured by and writes build/bench.json.

    make bench
    .venv/bin/python benchmarks/bench.py --record

With --record it also writes the files of docs/results/speed that the page on speed is made of; run
docs/generate.py afterwards.

Needs wrk, which Debian has. Every ratio compares two things timed in turn in this one run; a row's
baseline says in words what it is compared with. Medians, one thread inside onnxruntime; the whole
call of a crowd takes one for each core.
"""

import shutil
import sys
from pathlib import Path

import client
import clips_http
import crowd
import crowd_usd
import exact
import export
import export_formats
import export_usd
import family
import newcomer
import runtime
import serve
import serve_growth
import serve_models
import serve_rivals
from paper import bench_rows, markdown, measurement
from rows import record, table, write

ROOT = Path(__file__).parents[1]


def main() -> None:
    """Measure, print, write."""
    shutil.rmtree(ROOT / "build/bench", ignore_errors=True)
    trained_family = family.make(ROOT / "build/bench/reaching")
    table1 = measurement.of(trained_family, measurement.POINTS, rounds=7)
    print(markdown.text(table1), end="\n\n")
    model = ROOT / "build/bench/reaching.onnx"
    model.write_bytes(trained_family.exported.content)
    tables = {
        "training": [
            *bench_rows.library_rows(trained_family),
            *runtime.rows(trained_family),
            *exact.rows(trained_family),
            *newcomer.rows(ROOT, from_nothing="--no-install" not in sys.argv),
        ],
        "crowds": [*crowd.rows(trained_family), *crowd_usd.rows()],
        "files": [
            *export_formats.rows(trained_family),
            *export.rows(model),
        ],
        "layers": export_usd.rows(),
        "requests": [
            *clips_http.rows(trained_family),
            *serve.rows(model),
            *serve_rivals.rows(model),
            *serve_models.rows(model),
            *serve_growth.rows(model),
            *client.rows(model),
        ],
    }
    rows = [row for table_rows in tables.values() for row in table_rows]
    print(table(rows))
    tables["training"] = [*bench_rows.rows(table1), *tables["training"]]
    write([*bench_rows.rows(table1), *rows], ROOT / "build/bench.json")
    if "--record" in sys.argv:
        record(tables, "python benchmarks/bench.py --record", ROOT / "docs/results/speed")


if __name__ == "__main__":
    main()
