"""The `page` command: the web page and a model as a folder for static hosting.

Poses are then computed in the browser, by onnxruntime-web, which the container image leaves out.
"""

import gzip
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
import orjson
import typer

from posefield.common import atomic_files
from posefield.common.errors import FileError
from posefield.console.arguments import Json, ModelPath
from posefield.console.late_progress import LateProgress
from posefield.console.output import as_json
from posefield.encode import character_file
from posefield.inference import session
from posefield.inference.session import Session
from posefield.kriging import support
from posefield.model_file import checked_file, model_card, subgraph

PAGES_FOLDER = Path(__file__).parents[1] / "http/pages"
OFFLINE_FILES = ("offline.js", "ort-wasm-simd-threaded.mjs", "ort-wasm-simd-threaded.wasm.gz")
MODEL_TABLES = "model.json"
"""File of the model's card and of the numbers that tell whether a point is supported."""
CHARACTER = "character.glb"
"""File of the model's character at rest, which the page draws."""
_HEAD, _PRESSED = b"<head>", ".gz"


def page(
    model: ModelPath,
    output: Annotated[Path, typer.Option("--output", "-o", help="output folder")],
    json: Json = False,
) -> None:
    """Write the viewer page with a model, for static web hosting."""
    content = checked_file.read(model)
    opened = session.load_bytes(content, str(model))
    identity = f"{model.stem}@{opened.digest}"
    with LateProgress("files", len(opened.card.levels) + 1) as bar:
        model_files = dict(bar.count(browser_files(content, opened, identity)))
    written = write_files(page_files(model_files, identity), output)
    if json:
        plain = {"folder": str(output), "model": identity, "files": written}
        typer.echo(as_json(plain))
        return
    size = sum(written.values()) / 1e6
    typer.echo(
        f"{output}: {identity}, {len(written)} files, {size:.1f} MB; any web server shows it:"
    )
    typer.echo(f"  python3 -m http.server --directory {output}")


def write_files(contents: Iterator[tuple[str, bytes]], folder: Path) -> dict[str, int]:
    """Write files by name, each atomically, and return their sizes in bytes.

    Raises FileError if a file cannot be written.
    """
    sizes = {}
    for name, content in contents:
        atomic_files.write(content, folder / name)
        sizes[name] = len(content)
    return sizes


def browser_files(content: bytes, opened: Session, identity: str) -> Iterator[tuple[str, bytes]]:
    """Yield names and contents of the files that a browser needs to run a model.

    The graph of each level has no defaults, and the tables hold what a browser cannot read from it.
    """
    card = opened.card
    for level in range(len(card.levels)):
        graph = subgraph.require_inputs(subgraph.fix_level(content, level))
        yield f"level-{level}.onnx", graph
    yield CHARACTER, character_file.character_glb(card.skeleton, identity)
    tables = {
        "card": {"identity": identity, **model_card.plain_values(card)},
        "support": support.fit_support(np.array(card.examples)).table(),
    }
    yield MODEL_TABLES, orjson.dumps(tables)


def page_files(
    model_files: Mapping[str, bytes], identity: str, web: Path = PAGES_FOLDER
) -> Iterator[tuple[str, bytes]]:
    """Yield names and contents of the folder's files; the page itself is last.

    The page refers to the other files. model_files: contents by name. web: folder of the built page
    and its parts. Raises FileError if one of them is missing.
    """
    page = web / "viewer/index.html"
    shown = _with_model_mark(_read(page), MODEL_TABLES, identity)
    for part in OFFLINE_FILES:
        content = _read(web / "offline" / part)
        plain = gzip.decompress(content) if part.endswith(_PRESSED) else content
        yield part.removesuffix(_PRESSED), plain
    yield from model_files.items()
    yield page.name, shown


def _with_model_mark(content: bytes, model: str, identity: str) -> bytes:
    """Return the page with the mark that makes it use the model instead of a service."""
    # Imported here, since other commands need no Jinja.
    from posefield.http.pages import templates

    mark = templates.render("model.html", model=model, identity=identity)
    before, head, after = content.partition(_HEAD)
    return before + head + mark.encode() + after


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as fault:
        said = f"cannot be read: {fault.strerror}; in a copy of the sources `make page` builds it"
        raise FileError(path, said) from fault
