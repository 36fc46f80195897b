"""Times of several functions, measured alternately on one thread."""

import time
from collections.abc import Callable, Mapping
from statistics import median

from threadpoolctl import threadpool_limits


def in_turn(
    runs: Mapping[str, Callable[[], object]], rounds: int, repeats: int
) -> dict[str, float]:
    """Return the median seconds per call of each function.

    Every round times each function once, for `repeats` calls, so that a change of the machine's
    speed affects all of them. Each is called once beforehand to fill caches and compile.
    """
    timings: dict[str, list[float]] = {name: [] for name in runs}
    with threadpool_limits(limits=1):
        for run in runs.values():
            run()
        for _ in range(rounds):
            for name, run in runs.items():
                start = time.perf_counter()
                for _ in range(repeats):
                    run()
                timings[name].append((time.perf_counter() - start) / repeats)
    return {name: median(times) for name, times in timings.items()}
