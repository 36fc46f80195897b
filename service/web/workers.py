"""Several processes that answer on the same sockets, and one that keeps them alive.

uvicorn's own go on accepting while they end, and leave what they accept unanswered.
"""

import logging
import math
import os
import pickle
import selectors
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from service.motion.cores import ALONE
from service.motion.errors import WorkerDied
from service.web import draining, listening
from service.web.settings import Settings

log = logging.getLogger(__name__)

QUOTA = Path("/sys/fs/cgroup/cpu.max")
STEADY = 10.0
"""Seconds after which a process that dies has not died of its start."""
TRIES = 5
"""Starts in a row that may fail as long as no other process answers."""
LONGEST = 30.0
"""Seconds between two starts at most."""
MARGIN = 5.0
"""Seconds that a process gets to end beyond what its requests get."""


@dataclass(frozen=True)
class Work:
    """What each process is to answer for, how, and the sockets that all of them listen on.

    again: whether it takes the place of the last one that died, with what can still be opened.
    """

    places: tuple[str, ...]
    settings: Settings
    sockets: list[socket.socket]
    again: bool = False


@dataclass(frozen=True)
class Hooks:
    """What is to be done for each process: environ gives what its environment has besides that of
    this process, by the number that it and its successors have; ended is told its process id."""

    environ: Callable[[int], Mapping[str, str]] = lambda number: {}
    ended: Callable[[int], None] = lambda process: None


def keep(count: int, work: Work, listens: Callable[[Sequence[str]], None], hooks: Hooks) -> None:
    """Keep so many processes answering until told to end; then end them, and return.

    listens: told the models' names once all do. Raises what kept the first start from succeeding,
    and WorkerDied where processes could not be started again.
    """
    Keeper([Worker(number) for number in range(count)], work, listens, hooks).run()


def processors() -> int:
    """How many this process may use, by its affinity and its container's quota."""
    allowed = len(os.sched_getaffinity(0))
    try:
        quota, period = QUOTA.read_text().split()
        return max(1, min(allowed, math.ceil(int(quota) / int(period))))
    except (OSError, ValueError):
        # No such file, or "max".
        return allowed


@dataclass
class Worker:
    """A process, or its place while there is none. reader: what it says, faults among it; due: when
    to start it, failures: starts in a row that came to nothing."""

    number: int
    process: subprocess.Popen[bytes] | None = None
    channel: socket.socket | None = None
    reader: Any = None
    fault: Exception | None = None
    started: float = 0.0
    due: float = 0.0
    failures: int = 0
    listens: bool = False


@dataclass
class Keeper:
    """Starts processes, starts those again that die, and ends them all when told to."""

    workers: list[Worker]
    work: Work
    listens: Callable[[Sequence[str]], None]
    hooks: Hooks
    told: int = 0
    announced: bool = False
    fault: Exception | None = None
    selector: selectors.BaseSelector = field(default_factory=selectors.DefaultSelector)

    def run(self) -> None:
        """As `keep`."""
        with self._bell():
            while not (self.told or self.fault):
                now = time.monotonic()
                gaps = [worker for worker in self.workers if worker.process is None]
                for worker in gaps:
                    if worker.due <= now:
                        self._start(worker)
                dues = [worker.due for worker in gaps if worker.due > now]
                self._wait(min(dues) - now if dues else None)
            self._end()
        if self.fault:
            raise self.fault

    @contextmanager
    def _bell(self) -> Iterator[None]:
        """Signals end whatever is being waited for."""
        ears, mouth = socket.socketpair()
        mouth.setblocking(False)
        self.selector.register(ears, selectors.EVENT_READ)
        before = {one: signal.signal(one, self._tell) for one in (signal.SIGTERM, signal.SIGINT)}
        former = signal.set_wakeup_fd(mouth.fileno())
        try:
            with ears, mouth, self.selector:
                yield
        finally:
            signal.set_wakeup_fd(former)
            for one, handler in before.items():
                signal.signal(one, handler)

    def _tell(self, number: int, frame: FrameType | None) -> None:
        self.told += 1

    def _wait(self, seconds: float | None) -> None:
        for key, _ in self.selector.select(seconds):
            if key.data is None:
                key.fileobj.recv(64)  # type: ignore[union-attr]  # the bell
            else:
                self._hear(key.data)

    def _start(self, worker: Worker) -> None:
        here, there = socket.socketpair()
        descriptors = [there.fileno(), *(own.fileno() for own in self.work.sockets)]
        words = [sys.executable, "-P", "-m", "service.web.worker", *map(str, descriptors)]
        # What the operator says of threads, by whichever name, counts more than what is usual.
        usual = {} if ALONE.keys() & os.environ.keys() else ALONE
        worker.process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            env={**usual, **os.environ, **self.hooks.environ(worker.number)},
            pass_fds=descriptors,
            # Ctrl-C reaches them through this process alone.
            process_group=0,
        )
        there.close()
        worker.channel, worker.reader, worker.fault = here, here.makefile("rb"), None
        worker.started = time.monotonic()
        self.selector.register(here, selectors.EVENT_READ, worker)
        # While another answers for what has been broken since, this one waits for its repair.
        again = self.announced and not any(other.listens for other in self.workers)
        with suppress(OSError):
            here.sendall(pickle.dumps((self.work.places, self.work.settings, again)))

    def _hear(self, worker: Worker) -> None:
        try:
            said = pickle.load(worker.reader)
        except (EOFError, OSError, pickle.UnpicklingError):
            self._bury(worker)
            return
        if isinstance(said, Exception):
            worker.fault = said
            return
        worker.listens = True
        if not self.announced and all(worker.listens for worker in self.workers):
            self.announced = True
            self.listens(said)

    def _bury(self, worker: Worker) -> None:
        """Note that a process has ended, and when to start another."""
        assert worker.process and worker.channel
        self.selector.unregister(worker.channel)
        worker.reader.close()
        worker.channel.close()
        code = worker.process.wait()
        self.hooks.ended(worker.process.pid)
        lived = time.monotonic() - worker.started
        worker.failures = 0 if worker.listens and lived > STEADY else worker.failures + 1
        worker.process, worker.listens = None, False
        if not self.told:
            self._mend(worker, worker.fault or WorkerDied(_epitaph(worker.number, code)))

    def _mend(self, worker: Worker, fault: Exception) -> None:
        alone = not any(other.listens for other in self.workers)
        if not self.announced or (alone and worker.failures >= TRIES):
            self.fault = self.fault or fault
            return
        pause = min(LONGEST, 0.1 * 2**worker.failures) if worker.failures else 0.0
        worker.due = time.monotonic() + pause
        log.warning("%s; another is started in %.1f s", fault, pause)

    def _end(self) -> None:
        """End all processes in order, those that take too long at once."""
        given_up = any(worker.failures >= TRIES for worker in self.workers)
        listening.close(self.work.sockets)
        settings, sent = self.work.settings, 0
        until = time.monotonic() + settings.drain + draining.LINGER + settings.grace + MARGIN
        while (alive := self._alive()) and (left := until - time.monotonic()) > 0.0:
            if sent < min(2, self.told or 1):
                sent += 1
                for process in alive:
                    process.terminate()
            self._wait(left)
        for process in self._alive():
            log.error("process %d was killed: its time was over", process.pid)
            process.kill()
            process.wait()
        if given_up and not self.fault:
            self.fault = WorkerDied("a worker process could not be started again")

    def _alive(self) -> list[subprocess.Popen[bytes]]:
        return [worker.process for worker in self.workers if worker.process]


def _epitaph(number: int, code: int) -> str:
    how = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
    return f"worker process {number} ended {how}"
