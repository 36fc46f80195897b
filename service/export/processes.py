"""Children of this process that do chunks, each at the end of a line of its own.

Whoever is at one end notices when the other is gone. A pool of the standard library does not, in
Python 3.11: its processes outlive a parent that was killed, and a parent waits for ever for one
that was killed as it began, where what that is given does not fit into a pipe; a model does not.
"""

import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

from service.export import chunks
from service.export.chunks import Stop, Stopped, Task
from service.export.job import Work
from service.export.ledger import Part
from service.motion.cores import ALONE
from service.motion.errors import MotionError, WorkerDied

PATIENCE = 0.1
"""Seconds until one who waits looks whether to stop."""
LOST = "a process of the export has died; what is done stays, and the same command goes on"


@dataclass(frozen=True)
class _Child:
    process: SpawnProcess
    line: Connection


def together(workers: int, work: Work, tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
    """Do the tasks in so many processes.

    Raises WorkerDied where one of them goes.
    """
    children: list[_Child] = []
    try:
        with _for_children():
            context = multiprocessing.get_context("spawn")
            children += [_begin(context) for _ in range(workers)]
        for child in children:
            child.line.send(work)
        yield from _share_out({child.line for child in children}, tasks, stopped)
    except (EOFError, ConnectionError) as fault:
        # Whoever ended it may be about to end this process too, by a signal to all.
        time.sleep(PATIENCE)
        if not stopped():
            raise WorkerDied(LOST) from fault
    finally:
        for child in children:
            child.line.close()
        for child in children:
            child.process.join()


def _begin(context: SpawnContext) -> _Child:
    ours, its = context.Pipe()
    # A daemon is ended with this process where that cannot wait for it.
    process = context.Process(target=_serve, args=(its,), daemon=True)
    process.start()
    # Or this process would be at both ends.
    its.close()
    return _Child(process, ours)


def _share_out(idle: set[Any], tasks: Iterator[Task], stopped: Stopped) -> Iterator[Part]:
    """Parts of the tasks, given to whoever is idle; the next is at hand before it is wanted."""
    busy: set[Any] = set()
    coming = next(tasks, None)
    while (coming or busy) and not stopped():
        while coming and idle:
            line = idle.pop()
            line.send(coming)
            busy.add(line)
            coming = next(tasks, None)
        for line in connection.wait(busy, PATIENCE):
            busy.remove(line)
            idle.add(line)
            yield from _received(line)
    for line in busy:
        line.send(None)
    for line in busy:
        yield from _received(line)


def _received(line: Any) -> Iterator[Part]:
    """What came of a task: a part, nothing where it was given up, or an error to raise."""
    match line.recv():
        case Part() as part:
            yield part
        case MotionError() as fault:
            raise fault


def _serve(line: Connection) -> None:
    """Do tasks until nobody is at the other end; whatever comes meanwhile says stop."""
    try:
        work: Work = line.recv()
        while True:
            line.send(_outcome(work, line.recv(), line.poll))
    except (EOFError, ConnectionError):
        return


def _outcome(work: Work, task: Task | None, stopped: Stopped) -> Part | MotionError | None:
    # A word to stop that came when the task was done already.
    if task is None:
        return None
    try:
        return chunks.make(work, task, stopped)
    except Stop:
        return None
    except MotionError as fault:
        return fault


@contextmanager
def _for_children() -> Iterator[None]:
    """What processes take over that are begun meanwhile.

    One thread each: there is a process for each core. And no ear for Ctrl-C, which a terminal sends
    to all of them: the parent alone decides what comes of it.
    """
    # Else begun with the first child, and then it lets Ctrl-C through again.
    resource_tracker.ensure_running()
    before = {name: os.environ.get(name) for name in ALONE}
    os.environ.update(ALONE)
    heard = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, heard)
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
