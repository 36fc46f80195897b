"""Server process and worker processes, run by uvicorn through its public interface.

uvicorn writes the head and the body of a response separately, and uvloop makes a system call for
each. On Linux the second one takes a fifth of the CPU time of a pose request over 32 connections,
so writes are coalesced: one system call per connection and iteration of the event loop. See
docs/decisions/0001-http-server.md.
"""

import asyncio
import faulthandler
import logging
import math
import multiprocessing
import os
import resource
import signal
import socket
import sys
import threading
from collections.abc import AsyncIterator, Iterable, Iterator, Sequence
from contextlib import ExitStack, asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import synchronize
from pathlib import Path
from types import FrameType
from typing import Any

import uvicorn
from uvicorn.protocols.http.auto import AutoHTTPProtocol
from uvicorn.supervisors import Multiprocess
from uvicorn.supervisors.multiprocess import Process

from posefield.batch import process_pool
from posefield.common.cancellation import SINGLE_THREAD_ENV
from posefield.common.errors import InvalidField, WorkerDied
from posefield.http import batching, metrics, telemetry
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.http.readiness import Readiness
from posefield.http.request import Service
from posefield.http.request_cycle import App
from posefield.inference.trial_process import DEFAULT_LIMITS, TrialLimits
from posefield.registry.model_registry import ReloadingRegistry, VersionLimits

MAX_BUFFER = 64 * 1024
"""Maximum bytes of the buffer: flow control must see larger amounts."""


class CoalescingProtocol(AutoHTTPProtocol):  # type: ignore[misc, valid-type]
    """uvicorn's HTTP/1.1 protocol with write coalescing."""

    def connection_made(self, transport: Any) -> None:
        """Wrap the transport of a new connection."""
        super().connection_made(CoalescingTransport(transport))

    def on_headers_complete(self) -> None:
        """Start the request, and collect trailers apart from its headers.

        uvicorn would append trailers to the request's headers, after a proxy has checked those.
        """
        super().on_headers_complete()
        self.headers: list[tuple[bytes, bytes]] = []


class CoalescingTransport:
    """A transport that buffers writes until the next iteration of the event loop."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport
        self._call_soon = asyncio.get_running_loop().call_soon
        self._buffer: list[bytes] = []
        self._size = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def write(self, data: bytes) -> None:
        """Buffer data; it is sent in the next iteration or when the buffer exceeds its maximum."""
        if not self._buffer:
            self._call_soon(self._flush)
        self._buffer.append(data)
        self._size += len(data)
        if self._size > MAX_BUFFER:
            self._flush()

    def writelines(self, pieces: Iterable[bytes]) -> None:
        """Buffer pieces of data as by `write`."""
        for piece in pieces:
            self.write(piece)

    def close(self) -> None:
        """Send the buffer, then close the transport."""
        self._flush()
        self._transport.close()

    def _flush(self) -> None:
        buffered, self._buffer, self._size = self._buffer, [], 0
        # A client that has reset its connection closes the transport before the next iteration;
        # uvloop raises an error for a write to a closed one.
        if buffered and not self._transport.is_closing():
            self._transport.writelines(buffered)


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
    first: synchronize.Semaphore | threading.Semaphore

    def write(self) -> None:
        """Write the line unless another process has written it."""
        if self.first.acquire(False):
            sys.stdout.write(f"{self.line}\n")
            sys.stdout.flush()


@asynccontextmanager
async def lifespan(
    service: Service, models: ReloadingRegistry, announcement: StartAnnouncement
) -> AsyncIterator[None]:
    """Run the reload of models, the heartbeat and the SIGTERM handler during the server's life."""
    _drain_on_sigterm(service.readiness, service.settings.drain)
    beat = asyncio.create_task(_heartbeat(service, service.settings.unresponsive))
    with models.watch(service.settings.reload):
        announcement.write()
        yield
    beat.cancel()
    if service.log is not None:
        service.log.flush()
    # A thread that does not stop must not keep the process alive.
    faulthandler.dump_traceback_later(FORCED_EXIT_DELAY, exit=True)


async def _heartbeat(service: Service, unresponsive: int) -> None:
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
        metrics.set_open_requests(service.open)
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


faults = logging.getLogger(__name__)

CPU_QUOTA_FILE = Path("/sys/fs/cgroup/cpu.max")
BACKLOG = 2048
"""Maximum length of the queue of connections to accept."""
SPAWN_TIMEOUT = 86_400
"""Timeout of a disabled health check, s."""


def serve(sources: Sequence[str | Path], settings: Settings) -> None:
    """Serve the models of files, folders and URLs until SIGTERM or SIGINT.

    Raises ModelError, before listening, for a file that cannot be served, InvalidField for an
    unavailable address and WorkerDied if worker processes cannot start.
    """
    # Also needed after uvicorn has returned: it raises the signal that ended it again.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    _raise_open_files()
    source_names = tuple(map(str, sources))
    models = open_models(source_names, settings)
    models.check()
    names = ", ".join(models.registry.models)
    count = settings.workers or usable_processors(CPU_QUOTA_FILE)
    with ExitStack() as stack, suppress(KeyboardInterrupt):
        sockets = _listening_sockets(stack, settings.host, settings.port)
        spawn = multiprocessing.get_context("spawn")
        first = spawn.Semaphore(1) if count > 1 else threading.Semaphore(1)
        announcement = StartAnnouncement(f"posefield: {names} at {_url(sockets[0])}", first)
        if count > 1:
            stack.enter_context(metrics.shared_folder())
            _set_threads()
            tried = frozenset(name.partition("@")[2] for name in models.registry.identities)
            app = partial(
                worker_application, source_names, settings, announcement, TrialLimits(passed=tried)
            )
            WorkerSupervisor(_config(app, settings, count), sockets).run_until_signalled()
        else:
            process_pool.limit_threads()
            app = partial(_application, models, settings, announcement)
            uvicorn.Server(_config(app, settings, 1)).run(sockets)


def worker_application(
    sources: tuple[str, ...],
    settings: Settings,
    announcement: StartAnnouncement,
    limits: TrialLimits,
) -> App:
    """Return the application of a worker process.

    The parent has checked the files at the start. A file that cannot be opened since then is
    reported by `/readyz` and the log, and the other models are served.
    """
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    return _application(open_models(sources, settings, limits), settings, announcement)


def open_models(
    sources: tuple[str, ...], settings: Settings, limits: TrialLimits = DEFAULT_LIMITS
) -> ReloadingRegistry:
    """Open the models of files, folders and URLs; `ReloadingRegistry.check` raises their errors."""
    bounds = VersionLimits(settings.versions, settings.versions_memory)
    return ReloadingRegistry(sources, bounds, limits)


def _application(
    models: ReloadingRegistry, settings: Settings, announcement: StartAnnouncement
) -> App:
    sys.setswitchinterval(batching.SWITCH_INTERVAL)
    log = telemetry.LogBuffer(sys.stderr.fileno()) if settings.log == "on" else None
    background = partial(lifespan, models=models, announcement=announcement)
    return create_app(Readiness(models), settings, log, background)


def _config(app: partial[App], settings: Settings, count: int) -> uvicorn.Config:
    return uvicorn.Config(
        app,
        factory=True,
        # Not "auto", which would silently fall back to the much slower asyncio loop.
        loop="uvloop",
        http=CoalescingProtocol,
        ws="none",
        lifespan="on",
        # The addresses of trusted proxies are not known here.
        proxy_headers=False,
        log_level="error",
        access_log=False,
        server_header=False,
        backlog=BACKLOG,
        workers=count,
        timeout_keep_alive=settings.idle_time,
        timeout_graceful_shutdown=settings.grace,
        timeout_worker_healthcheck=settings.unresponsive or SPAWN_TIMEOUT,
    )


class WorkerSupervisor(Multiprocess):
    """uvicorn's supervisor of workers, with logging and early closing of its sockets.

    shutdown_requested: a signal has requested the shutdown.
    """

    shutdown_requested = False

    def run_until_signalled(self) -> None:
        """Run the workers until a signal; raises WorkerDied if the supervisor ends without one."""
        self.run()
        if not self.shutdown_requested:
            raise WorkerDied("a worker process could not be started; see the log")

    def handle_term(self) -> None:
        """Shut the workers down; they stop listening after draining.

        This process closes its sockets first: an open one would accept connections that no worker
        serves.
        """
        self.shutdown_requested = True
        for listener in self.sockets:
            listener.close()
        super().handle_term()

    def handle_int(self) -> None:
        """Shut the workers down at once; a terminal sends SIGINT to them as well."""
        self.shutdown_requested = True
        super().handle_int()

    def init_processes(self) -> None:
        """Start the workers."""
        with _interrupt_pending():
            super().init_processes()

    def keep_subprocess_alive(self) -> None:
        """Replace and log workers that have ended or do not respond."""
        before = [*self.processes]
        for process in before:
            # The worker has a copy. While this one is open, a worker that ends before it answers a
            # health check is replaced only after POSEFIELD_UNRESPONSIVE seconds.
            process.child_conn.close()
        with _interrupt_pending():
            super().keep_subprocess_alive()
            interrupted = signal.SIGINT in (*self.signal_queue, *signal.sigpending())
        for old, new in zip(before, self.processes, strict=True):
            if old is not new:
                metrics.remove_process(old.pid or 0)
                # Workers that SIGINT has ended are replaced until this process handles it, too.
                if not interrupted:
                    faults.warning("%s; process %d takes its place", _exit_reason(old), new.pid)


@contextmanager
def _interrupt_pending() -> Iterator[None]:
    """Block SIGINT here, and in processes started meanwhile until `worker_application` unblocks it.

    A terminal also sends SIGINT to workers, and one that is still importing would end with a
    traceback.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _exit_reason(process: Process) -> str:
    code = process.exitcode or 0
    how = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
    return f"worker process {process.pid} ended {how}"


def usable_processors(quota: Path) -> int:
    """Return the number of processors for this process, by affinity and cgroup CPU quota.

    quota: path of the file cpu.max.
    """
    allowed = len(os.sched_getaffinity(0))
    try:
        quota_time, period = quota.read_text().split()
        return max(1, min(allowed, math.ceil(int(quota_time) / int(period))))
    except (OSError, ValueError):
        # The file is missing or has the quota "max".
        return allowed


def _listening_sockets(stack: ExitStack, host: str, port: int) -> list[socket.socket]:
    """Return sockets that listen on each address of a host; port 0 takes a free port for all."""
    sockets: list[socket.socket] = []
    kind, passive = socket.SOCK_STREAM, socket.AI_PASSIVE
    try:
        for family, *_, where in socket.getaddrinfo(host or None, port, type=kind, flags=passive):
            address = (where[0], port, *where[2:])
            listener = socket.create_server(address, family=family, backlog=BACKLOG)
            sockets.append(stack.enter_context(listener))
            port = listener.getsockname()[1]
    except OSError as fault:
        reason = (fault.strerror or str(fault)).lower()
        raise InvalidField("address", f"{host}:{port}: {reason}") from fault
    return sockets


def _url(listener: socket.socket) -> str:
    host, port = listener.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def _set_threads() -> None:
    """Set one BLAS thread per worker, unless the environment sets a number of threads."""
    if not SINGLE_THREAD_ENV.keys() & os.environ.keys():
        os.environ.update(SINGLE_THREAD_ENV)


def _raise_open_files() -> None:
    """Raise the limit on open files, and so on connections, to the hard limit."""
    _, hard_limit = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard_limit, hard_limit))
