"""Fair timing: one after the other in every round, on one thread, the median of the rounds."""

import time
from collections.abc import Callable, Mapping
from statistics import median

from threadpoolctl import threadpool_limits


def in_turn(
    runs: Mapping[str, Callable[[], object]], rounds: int, repeats: int
) -> dict[str, float]:
    """Median seconds of a call of each; whatever slows the machine down slows all of them."""
    taken: dict[str, list[float]] = {name: [] for name in runs}
    with threadpool_limits(limits=1):
        for run in runs.values():
            run()
        for _ in range(rounds):
            for name, run in runs.items():
                start = time.perf_counter()
                for _ in range(repeats):
                    run()
                taken[name].append((time.perf_counter() - start) / repeats)
    return {name: median(times) for name, times in taken.items()}
