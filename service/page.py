"""`posefield page`: the page and a model as a folder that works without a service.

Poses are then made in the browser, by onnxruntime-web, which the image leaves out.
"""

import gzip
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import orjson
import typer

from service.motion import files
from service.motion.errors import FileError
from service.synthesis import session

WEB = Path(__file__).with_name("web")
PAGE, OFFLINE = WEB / "viewer/index.html", WEB / "offline"
PARTS = ("offline.js", "ort-wasm-simd-threaded.mjs", "ort-wasm-simd-threaded.wasm.gz")
_HEAD, _PRESSED = b"<head>", ".gz"


def page(
    model: Annotated[Path, typer.Argument(help="a model file", metavar="MODEL")],
    output: Annotated[Path, typer.Option("--output", "-o", help="folder")],
    json: Annotated[bool, typer.Option("--json", help="answer as JSON")] = False,
) -> None:
    """Write the page with a model in it, for any host of static files."""
    content = session.read(model)
    opened = session.open_bytes(content, str(model))
    identity = f"{model.stem}@{opened.digest}"
    written = write(_files(model.name, content, identity), output)
    if json:
        plain = {"folder": str(output), "model": identity, "files": written}
        typer.echo(orjson.dumps(plain, option=orjson.OPT_INDENT_2).decode())
        return
    size = sum(written.values()) / 1e6
    typer.echo(
        f"{output}: {identity}, {len(written)} files, {size:.1f} MB; any web server shows it:"
    )
    typer.echo(f"  python3 -m http.server --directory {output}")


def write(contents: Iterator[tuple[str, bytes]], folder: Path) -> dict[str, int]:
    """Write files by their names, each whole, and give their sizes; FileError where it fails."""
    sizes = {}
    for name, content in contents:
        files.write(content, folder / name)
        sizes[name] = len(content)
    return sizes


def _files(name: str, model: bytes, identity: str) -> Iterator[tuple[str, bytes]]:
    """What the folder holds; the page comes last, so that it never names what is not there."""
    shown = _marked(_read(PAGE), name, identity)
    for part in PARTS:
        content = _read(OFFLINE / part)
        plain = gzip.decompress(content) if part.endswith(_PRESSED) else content
        yield part.removesuffix(_PRESSED), plain
    yield name, model
    yield PAGE.name, shown


def _marked(content: bytes, model: str, identity: str) -> bytes:
    """The page, which looks for this mark before it asks a service."""
    told = f'data-identity="{escape(identity)}"'
    mark = f'<meta name="posefield-model" content="{escape(quote(model))}" {told}>'
    before, head, after = content.partition(_HEAD)
    return before + head + mark.encode() + after


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as fault:
        said = f"cannot be read: {fault.strerror}; in a copy of the sources `make page` builds it"
        raise FileError(path, said) from fault
