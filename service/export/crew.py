"""Who does the chunks: this process, or several of its children.

A crew is given work and tasks and gives parts as they are done, in any order. It takes no more
tasks ahead than keep everybody busy, so that memory does not grow with their number.
"""

import os
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain, islice

from service.export import chunks, processes
from service.export.chunks import Stop, Stopped, Task
from service.export.job import Work
from service.export.ledger import Part

Crew = Callable[[Work, Iterator[Task], Stopped], Iterator[Part]]
"""Does tasks until there are no more or it should stop; what was done by then is given still."""


def of(workers: int) -> Crew:
    """Crew of so many processes; one is this process."""
    return alone if workers == 1 else partial(_several, workers)


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0))


def alone(work: Work, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
    """Do the tasks here, one after another."""
    for task in tasks:
        if stopped():
            return
        try:
            yield chunks.make(work, task, stopped)
        except Stop:
            return


def _several(workers: int, work: Work, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
    # To begin a process takes as long as a thousand clips: none is begun for nothing.
    first = list(islice(tasks, workers))
    tasks = chain(first, tasks)
    if len(first) < 2:
        return alone(work, tasks, stopped)
    return processes.together(len(first), work, tasks, stopped)
