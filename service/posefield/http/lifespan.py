"""Background tasks of a server process (ASGI lifespan): reload, heartbeat and draining."""

import asyncio
import faulthandler
import multiprocessing
import signal
import sys
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from multiprocessing.synchronize import Semaphore
from types import FrameType
from typing import Any

from posefield.http.concurrency.readiness import Readiness
from posefield.http.request_cycle import ServerState
from posefield.http.telemetry import metrics
from posefield.registry.model_reload import ReloadingRegistry

HEARTBEAT_INTERVAL = 1.0
"""Period of the heartbeat, s."""
FORCED_EXIT_DELAY = 5
"""Seconds until a process is ended by force after the server has shut down."""


@dataclass(frozen=True)
class StartAnnouncement:
    """Start message on standard output, written by the first process that is ready.

    first: semaphore with value 1, shared by the processes.
    """

    line: str
    first: Semaphore | threading.Semaphore

    def write(self) -> None:
        """Write the line unless another process has written it."""
        if self.first.acquire(False):
            sys.stdout.write(f"{self.line}\n")
            sys.stdout.flush()


@asynccontextmanager
async def lifespan(
    site: ServerState, shelf: ReloadingRegistry, announcement: StartAnnouncement
) -> AsyncIterator[None]:
    """Run the reload of models, the heartbeat and the SIGTERM handler during the server's life."""
    service = site.service
    _drain_on_sigterm(service.readiness, service.settings.drain)
    beat = asyncio.create_task(_heartbeat(site, service.settings.unresponsive))
    with shelf.watch(service.settings.reload):
        announcement.write()
        yield
    beat.cancel()
    service.telling.close()
    # A thread that does not stop must not keep the process alive.
    faulthandler.dump_traceback_later(FORCED_EXIT_DELAY, exit=True)


async def _heartbeat(site: ServerState, unresponsive: int) -> None:
    """Reset the watchdog, update the gauge of open requests and check the parent, once a second.

    A blocked event loop does not reset the watchdog, a C thread that does not need the GIL. After
    `unresponsive` seconds it writes the stacks of all threads to standard error and ends the
    process with exit code 1; the supervisor replaces it. A worker whose parent has died raises
    SIGTERM.
    """
    parent = multiprocessing.parent_process()
    while True:
        if unresponsive:
            faulthandler.dump_traceback_later(unresponsive, exit=True)
        metrics.set_open_requests(site.open)
        if parent is not None and not parent.is_alive():
            signal.raise_signal(signal.SIGTERM)
            return
        await asyncio.sleep(HEARTBEAT_INTERVAL)


def _drain_on_sigterm(readiness: Readiness, seconds: int) -> None:
    """Install a SIGTERM handler that reports not ready, and shuts down `seconds` later.

    A second SIGTERM shuts down at once. SIGINT keeps its handler, which does not wait.
    """
    loop = asyncio.get_running_loop()
    end: Any = signal.getsignal(signal.SIGTERM)

    def drain(number: int, frame: FrameType | None) -> None:
        if readiness.draining or not seconds:
            readiness.draining = True
            end(number, frame)
            return
        readiness.draining = True
        loop.call_soon_threadsafe(loop.call_later, seconds, end, number, None)

    signal.signal(signal.SIGTERM, drain)
