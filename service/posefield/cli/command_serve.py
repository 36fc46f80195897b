"""The `posefield serve`, `key`, `mcp` and `demo` commands: the service, keys, agents, a first look.

The files of the demo are fetched over HTTP from a service in a process of its own, so that each
line that is printed is an address that `curl` can ask for as well.
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
from typing import Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import FileError, MotionError, WorkerDied
from posefield.console.options import Json
from posefield.console.output import as_json
from posefield.registry import model_registry


def serve(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            help="model files, folders with model files, or URLs of object stores; "
            "default: the models that ship with posefield",
            metavar="MODEL",
            show_default=False,
        ),
    ] = None,
    host: Annotated[
        str | None, typer.Option(help="IP address; default: POSEFIELD_HOST, else 127.0.0.1")
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="TCP port; default: POSEFIELD_PORT, else 8000")
    ] = None,
) -> None:
    """Serve models over HTTP until interrupted.

    Without MODEL it serves the models that ship with posefield: a walk, which the page at / shows
    first, and acts of captured people.
    """
    from posefield.http import server
    from posefield.http.api import settings

    server.serve(
        model_registry.or_shipped(sources or ()), settings.read_settings(host=host, port=port)
    )


def key(
    name: Annotated[str, typer.Argument(help="name of the key's owner in the log", metavar="NAME")],
    model: Annotated[
        list[str] | None,
        typer.Option(help="model that the key may read; may be repeated; default: all models"),
    ] = None,
    metrics: Annotated[
        bool, typer.Option("--metrics", help="allow the key to read /metrics as well")
    ] = False,
    json: Json = False,
) -> None:
    """Create an API key.

    Prints the line for POSEFIELD_KEYS_FILE on standard output and the key on standard error. The
    key is not stored.
    """
    from posefield.http.access import api_keys

    scopes = [f"read:{one}" for one in model or ["*"]] + ["metrics"] * metrics
    secret = api_keys.generate_key()
    line = api_keys.key_line(name, scopes, secret)
    if json:
        typer.echo(as_json({"key": secret, "line": line}))
        return
    typer.echo(line)
    typer.echo(f"the key of {name}, which is kept nowhere: {secret}", err=True)


def mcp(
    sources: Annotated[
        list[Path] | None,
        typer.Argument(
            help="model files, or folders of them, besides the shipped ones",
            metavar="MODEL",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="folder that files are written to")
    ] = Path(),
    schema: Annotated[
        bool, typer.Option("--schema", help="print the JSON Schema of scripts and exit")
    ] = False,
) -> None:
    """Serve tools to an agent, over standard input and output.

    They list models, plan performances and write them to files. The protocol is the Model Context
    Protocol (MCP).
    """
    from posefield.http.api import contract

    if schema:
        typer.echo(as_json(contract.script_schema()))
        return
    # Imported here because mcp is an optional extra.
    from posefield import mcp as server

    if not output.is_dir():
        raise FileError(output, "no folder, expected one to write files to")
    server.serve(server.Toolbox(model_registry.with_shipped(sources or ()), output.resolve()))


SPEEDS = (0.8, 1.2, 1.6)
"""Speeds of the walks, m/s, within what the shipped walk was learnt from."""
FORMATS = ("usdc", "glb", "bvh")
ACTS = {"reach": "grab_high", "put_down": "deposit_floor", "kick": "kick", "squat": "squat"}
"""Names of the files of acts, and their models."""
FILES = {
    **{
        f"walk_{speed}.{kind}": f"models/cmu_walk/clip.{kind}?speed={speed}&turn=0"
        for speed in SPEEDS
        for kind in FORMATS
    },
    "crowd.usdc": "models/cmu_walk/crowd.usdc?count=50&seconds=8",
    **{
        f"{act}.{kind}": f"models/hdm05_{model}/clip.{kind}"
        for act, model in ACTS.items()
        for kind in ("usdc", "glb")
    },
    "performance.usdc": "performances.usdc",
}
"""Questions to the service, below /v1, by the names of the files with their answers."""
SCRIPT = b"""{"segments": [
  {"kind": "walk", "model": "cmu_walk", "speed": 1.1},
  {"kind": "act", "model": "hdm05_grab_high",
   "targets": [{"joint": "rhand", "position": [0.3, 1.65, 4.0], "at": "event"}]},
  {"kind": "hold", "seconds": 0.6, "joint": "rhand"},
  {"kind": "act", "model": "hdm05_grab_return"},
  {"kind": "walk", "model": "cmu_walk", "seconds": 4, "speed": 1.1}]}"""
"""Body of the question for a performance: a walk, a reach for a place, and the walk on."""

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
    before = {number: signal.signal(number, lambda *_: sys.exit(0)) for number in STOP_SIGNALS}
    try:
        _show(output, port, browser, once)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _show(output: Path, port: int, browser: bool, once: bool) -> None:
    with _served(port) as (service, address):
        for name, question in FILES.items():
            script = SCRIPT if question.startswith("performances") else None
            content = _fetch(f"{address}/v1/{question}", script)
            atomic_files.write(content, output / name)
            typer.echo(f"  {output / name}  {len(content):,} bytes  /v1/{question}")
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
    environment = {
        name: text for name, text in os.environ.items() if not name.startswith("POSEFIELD_")
    }
    quiet = {**environment, "POSEFIELD_LOG": "off", "POSEFIELD_WORKERS": "1"}
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


def _fetch(url: str, body: bytes | None) -> bytes:
    """Return an answer's body; MotionError, with the service's words, if it refuses.

    body: JSON of a POST, None for a GET.
    """
    # A proxy of the environment cannot reach this machine's own address.
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        request = urllib.request.Request(url, body, {"Content-Type": "application/json"})
        with opener.open(request, timeout=ANSWER_TIMEOUT) as answer:
            content: bytes = answer.read()
            return content
    except urllib.error.HTTPError as refusal:
        with refusal:
            raise MotionError(f"{url}: {refusal.read().decode()}") from refusal


def _has_desktop() -> bool:
    """Return True if a browser would have a window; one of the terminal would take the terminal."""
    variables = ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform == "darwin" or any(os.environ.get(name) for name in variables)
