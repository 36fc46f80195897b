"""Scaling of an export over Dask workers, and the cost of Dask against a pool of processes.

    python benchmarks/export_cluster.py MODEL [--clips 8192] [--format usdc]

Workers are processes of one thread on this machine, begun before anything is timed; the scheduler
and the client take a part of its cores too. The same clips in the same chunks by all, in turn.
"""

import argparse
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import export
from distributed import LocalCluster
from export import Bench
from rows import Row, table

from posefield.batch import dask_export, process_pool
from posefield.batch.process_pool import Runner

CLIPS, FORM, LAYOUT = export.LONGER * export.CLIPS, "usdc", "folder"
GOAL = 1.6


def rows(model: Path, clips: int = CLIPS, form: str = FORM) -> list[Row]:
    """Two workers against one, and each number of them against as many processes."""
    bench = Bench.of(model, clips, form)
    with ExitStack() as stack:
        runners = {
            "one process": process_pool.run_here,
            "two processes": process_pool.runner(2),
            "one worker": stack.enter_context(_workers(1)),
            "two workers": stack.enter_context(_workers(2)),
        }
        taken = export.in_turn(
            {name: partial(bench.seconds, LAYOUT, runner) for name, runner in runners.items()}
        )
    what = f"export of {clips} clips as {form} by"

    def row(name: str, baseline: str, goal: float | None) -> Row:
        ratio = taken[baseline] / taken[name]
        return Row(f"{what} {name} of Dask", clips / taken[name], "clips/s", baseline, ratio, goal)

    return [
        row("two workers", "one worker", GOAL),
        row("one worker", "one process", None),
        row("two workers", "two processes", None),
    ]


@contextmanager
def _workers(count: int) -> Iterator[Runner]:
    """Yield the runner of `count` Dask workers with one thread each."""
    own = LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=":0")
    with own, dask_export.runner(own.scheduler_address) as runner:
        yield runner


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("--clips", type=int, default=CLIPS)
    parser.add_argument("--format", default=FORM)
    given = parser.parse_args()
    print(table(rows(given.model, given.clips, given.format)))


if __name__ == "__main__":
    main()
