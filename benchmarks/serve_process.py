"""Servers as processes of their own on the first core, and what they take of the machine."""

import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

HERE = Path(__file__).parent
POSEFIELD = Path(sys.executable).with_name("posefield")
PATIENCE = 60.0
LISTENING = "0A"
"""State of a socket in /proc/net/tcp."""


@dataclass(frozen=True)
class Server:
    """A server that answers at a URL; process: the one that was started."""

    name: str
    url: str
    process: int

    def processor(self) -> float:
        """Seconds that it and all its descendants have computed."""
        return sum(_seconds(process) for process in _family(self.process))

    def resident(self) -> float:
        """Resident memory of all of them, MB."""
        return sum(resident(process) for process in _family(self.process))


@contextmanager
def posefield(*paths: Path, **environ: str) -> Iterator[Server]:
    """Our own service with its usual settings; its log goes to a file, as it would."""
    port = free_port()
    command = [POSEFIELD, "serve", *paths]
    environment = {"POSEFIELD_PORT": str(port), **environ}
    with started("posefield", command, port, "/readyz", environment) as server:
        yield server


@contextmanager
def bare(model: Path) -> Iterator[Server]:
    """The handler that does nothing but ask the model and write JSON."""
    port = free_port()
    with started("bare", [sys.executable, HERE / "serve_bare.py", model, str(port)], port) as it:
        yield it


@contextmanager
def started(
    name: str,
    command: Sequence[str | Path],
    port: int,
    path: str | None = None,
    environ: dict[str, str] | None = None,
    folder: Path | None = None,
) -> Iterator[Server]:
    """A server of a command, once it answers at a path, or listens; what it says is in
    build/serve/NAME.log, which stays where something fails."""
    log = HERE.parent / f"build/serve/{name}.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    core = {min(os.sched_getaffinity(0))}
    with log.open("wb") as log_file:
        child = subprocess.Popen(
            command,
            env={**os.environ, **(environ or {})},
            cwd=folder,
            stdout=log_file,
            stderr=log_file,
            start_new_session=True,
            preexec_fn=lambda: os.sched_setaffinity(0, core),
        )
    url = f"http://127.0.0.1:{port}"
    try:
        _wait(child, port, path, log)
        yield Server(name, url, child.pid)
        log.unlink()
    finally:
        _end(child)


def free_port() -> int:
    """Return a free TCP port."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def resident(process: int) -> float:
    """Resident memory of a process, MB."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def command(process: int) -> bytes:
    """Return the command line of a process, its words apart by null bytes; empty if it has gone."""
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:
        return b""


def children(process: int) -> list[int]:
    """Processes that a process has started, from any of its threads."""
    processes = []
    for thread in Path(f"/proc/{process}/task").iterdir():
        try:
            processes += [int(word) for word in (thread / "children").read_text().split()]
        except (FileNotFoundError, ProcessLookupError):
            continue
    return processes


def accepts(process: int, port: int) -> bool:
    """Return whether the event loop of a process waits for connections at an IPv4 port."""
    sockets = {
        f"socket:[{fields[9]}]"
        for fields in map(str.split, Path("/proc/net/tcp").read_text().splitlines()[1:])
        if fields[1].endswith(f":{port:04X}") and fields[3] == LISTENING
    }
    try:
        descriptors = Path(f"/proc/{process}/fd").iterdir()
        listening = {fd.name for fd in descriptors if str(fd.readlink()) in sockets}
        watched = "".join(fd.read_text() for fd in Path(f"/proc/{process}/fdinfo").iterdir())
    except (FileNotFoundError, ProcessLookupError):
        return False
    # Files that an epoll instance watches.
    return bool(listening & set(re.findall(r"^tfd:\s+(\d+)", watched, re.MULTILINE)))


def _family(process: int) -> Iterator[int]:
    yield process
    for child in children(process):
        yield from _family(child)


def _seconds(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return sum(int(ticks) for ticks in fields[11:13]) / os.sysconf("SC_CLK_TCK")


def _wait(child: subprocess.Popen[bytes], port: int, path: str | None, log: Path) -> None:
    end = time.monotonic() + PATIENCE
    while not _answers(port, path):
        if child.poll() is not None or time.monotonic() > end:
            sys.exit(f"{path} does not answer:\n{log.read_text()[-3000:]}")
        time.sleep(0.05)


def _answers(port: int, path: str | None) -> bool:
    try:
        if path is None:
            socket.create_connection(("127.0.0.1", port), timeout=5).close()
            return True
        return httpx.get(f"http://127.0.0.1:{port}{path}", timeout=5).status_code < 400
    except (OSError, httpx.TransportError):
        return False


def _end(child: subprocess.Popen[bytes]) -> None:
    if child.poll() is not None:
        sys.exit(f"{child.args} ended by itself, with {child.returncode}")
    child.terminate()
    try:
        child.wait(20)
    except subprocess.TimeoutExpired:
        # Some of them do not end by themselves, nor do their workers.
        os.killpg(child.pid, 9)
        child.wait(20)
