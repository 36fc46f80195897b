"""The `posefield demo` command: the shipped models served, a few files, and the page.

The files are fetched over HTTP from a service in a process of its own, so that each line that is
printed is an address that `curl` or a browser can ask for as well.
"""

import os
import signal
import subprocess
import sys
import urllib.error
import urllib.request
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated, NoReturn

import typer

from posefield.common import atomic_files
from posefield.common.errors import MotionError, WorkerDied

SPEEDS = (0.8, 1.2, 1.6)
"""Speeds of the walks, m/s, within what the shipped walk was learnt from."""
FORMATS = ("usdc", "glb", "bvh")
FILES = {
    **{
        f"walk_{speed}.{kind}": f"cmu_walk/clip.{kind}?speed={speed}&turn=0"
        for speed in SPEEDS
        for kind in FORMATS
    },
    "crowd.usdc": "cmu_walk/crowd.usdc?count=50&seconds=8",
    "reach.usdc": "reaching/clip.usdc?target_height=1.6",
    "reach.glb": "reaching/clip.glb?target_height=1.6",
}
"""Questions to the service, below /v1/models, by the names of the files with their answers."""

ANSWER_TIMEOUT, STOP_TIMEOUT = 60.0, 20.0
"""Seconds for an answer, and for the service's end."""

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def demo(
    output: Annotated[Path, typer.Option("--output", "-o", help="folder for the files")] = Path(
        "posefield-demo"
    ),
    port: Annotated[int, typer.Option(help="TCP port; 0 takes a free one")] = 0,
    browser: Annotated[
        bool, typer.Option(help="open the page in a browser, where there is a desktop")
    ] = True,
    once: Annotated[
        bool, typer.Option("--once", help="end when the files are written, without a browser")
    ] = False,
) -> None:
    """Serve the shipped models, write some clips, and show the page.

    The service listens on this machine only and stays up until Ctrl-C. It takes no settings from
    the environment.
    """
    # Both end the service too, by `_served`. A shell starts commands in the background with SIGINT
    # ignored, and Python keeps it so unless told otherwise.
    before = {number: signal.signal(number, _exit_on_signal) for number in STOP_SIGNALS}
    try:
        _show(output, port, browser, once)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _show(output: Path, port: int, browser: bool, once: bool) -> None:
    with _served(port) as (service, address):
        for name, question in FILES.items():
            content = _fetch(f"{address}/v1/models/{question}")
            atomic_files.write(content, output / name)
            typer.echo(f"  {output / name}  {len(content):,} bytes  /v1/models/{question}")
        typer.echo(f"{len(FILES)} files in {output.resolve()}: USD, glTF and BVH open in Blender")
        if once:
            return
        typer.echo(f"the page: {address}/  the contract: {address}/docs  end with Ctrl-C")
        if browser and _has_desktop():
            webbrowser.open(f"{address}/")
        code = service.wait()
        raise WorkerDied(f"the service of the demo has ended with exit code {code}")


@contextmanager
def _served(port: int) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Yield a service of the shipped models, once it listens, and its address; end it after.

    Raises WorkerDied if it does not start; its message is on standard error.
    """
    command = [sys.executable, "-m", "posefield", "serve", "--host", "127.0.0.1"]
    own = {name: text for name, text in os.environ.items() if not name.startswith("POSEFIELD_")}
    quiet = {**own, "POSEFIELD_LOG": "off", "POSEFIELD_WORKERS": "1"}
    with subprocess.Popen(
        [*command, "--port", str(port)], stdout=subprocess.PIPE, text=True, env=quiet
    ) as service:
        try:
            line = service.stdout.readline() if service.stdout else ""
            if " at http" not in line:
                code = service.wait()
                raise WorkerDied(f"the service of the demo did not start: exit code {code}")
            typer.echo(line.strip())
            yield service, line.split(" at ")[1].strip()
        finally:
            # A second Ctrl-C still ends it at once.
            service.terminate()
            service.wait(timeout=STOP_TIMEOUT)


def _fetch(url: str) -> bytes:
    """Return an answer's body; MotionError, with the service's words, if it refuses."""
    # A proxy of the environment cannot reach this machine's own address.
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(url, timeout=ANSWER_TIMEOUT) as answer:
            content: bytes = answer.read()
            return content
    except urllib.error.HTTPError as refusal:
        with refusal:
            raise MotionError(f"{url}: {refusal.read().decode()}") from refusal


def _exit_on_signal(number: int, frame: FrameType | None) -> NoReturn:
    raise SystemExit(0)


def _has_desktop() -> bool:
    """Return True if a browser would have a window; one of the terminal would take the terminal."""
    given = ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform == "darwin" or any(os.environ.get(name) for name in given)
