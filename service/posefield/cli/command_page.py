"""The `posefield page` command: a page without a service, which computes with its models."""

import shutil
from base64 import b64encode
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import orjson
import typer

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField
from posefield.console.options import Json, open_model
from posefield.console.output import as_json
from posefield.encode import glb
from posefield.registry import model_registry

LIST = "models.json"


def page(
    models: Annotated[
        list[Path], typer.Argument(help="model files, or names of shipped models", metavar="MODEL")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="new folder, or that of an earlier page")
    ],
    json: Json = False,
) -> None:
    """Write a web page that computes motions itself, for any static host.

    It has sliders, a clip, walkers that are steered and a download, and loads nothing from
    elsewhere. Browsers open it through http or https, not from a file.
    """
    # Its server is needed by few commands.
    from posefield.http.static_page import MODEL_PAGE

    if not MODEL_PAGE.exists():
        raise FileError(MODEL_PAGE, "is missing: build it with make page")
    if output.exists() and any(output.iterdir()) and not (output / LIST).exists():
        raise FileError(output, "has files, but no page of this command; expected a new folder")
    opened = [open_model(model_registry.file_or_shipped(model)) for model in models]
    names = [model.name for model in opened]
    if repeated := next((name for name in names if names.count(name) > 1), None):
        raise InvalidField("models", f"two with the name {repeated}, expected one of each")
    shutil.copytree(MODEL_PAGE.parent, output, dirs_exist_ok=True)
    folder = output / "models"
    folder.mkdir(exist_ok=True)
    entries = []
    for model in opened:
        skin = glb.character_glb(model.session.card.skeleton, model.identity)
        files = {"model": f"{model.name}.onnx", "character": f"{model.name}.glb"}
        contents = {"model": model.session.content, "character": skin}
        for kind, content in contents.items():
            atomic_files.write(content, folder / files[kind])
        entries.append(
            {"name": model.name, "root": model.rest_position.tolist()}
            | {kind: f"models/{name}" for kind, name in files.items()}
            | {"integrity": {kind: integrity(content) for kind, content in contents.items()}}
        )
    atomic_files.write(orjson.dumps(entries), output / LIST)
    size = sum(path.stat().st_size for path in output.rglob("*") if path.is_file())
    facts = {"page": str(output / "index.html"), "models": len(entries), "bytes": size}
    written = f"{facts['page']}: {len(entries)} models, {size / 1e6:.1f} MB; serve the folder"
    typer.echo(as_json(facts) if json else written)


def integrity(content: bytes) -> str:
    """Return a checksum in the form in which browsers verify it."""
    return f"sha256-{b64encode(sha256(content).digest()).decode()}"
