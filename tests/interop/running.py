"""Servers as context managers."""

import os
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx

PATIENCE = 60.0


@contextmanager
def started(command: Sequence[str | Path], said: Path, **told: str) -> Iterator[None]:
    """A server; what it says goes to a file, and is shown where something fails meanwhile."""
    with said.open("wb") as out:
        child = subprocess.Popen(command, env=os.environ | told, stdout=out, stderr=out)
    try:
        yield
    except BaseException:
        print(said.read_text()[-3000:])
        raise
    finally:
        child.terminate()
        child.wait(30)


def wait(ready: Callable[[], bool]) -> None:
    """Return once it is ready; ignore failed connections until PATIENCE ends."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            if ready():
                return
        except httpx.TransportError:
            pass
        if time.monotonic() > end:
            raise TimeoutError(f"not ready after {PATIENCE:.0f} s")
        time.sleep(0.1)


def ports(count: int) -> list[int]:
    """Return free TCP ports."""
    held = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    found = [each.getsockname()[1] for each in held]
    for each in held:
        each.close()
    return found
