"""Arguments that several commands share, and their conversion."""

from pathlib import Path
from typing import Annotated

import typer

from posefield.common.errors import ModelError, UnknownFormat
from posefield.common.name_suggestion import did_you_mean
from posefield.encode.formats import CLIP_ENCODERS, ClipEncoder
from posefield.registry import model_registry
from posefield.synthesis.synthesizer import Synthesizer

ModelPath = Annotated[Path, typer.Argument(help="model file", metavar="MODEL")]
Json = Annotated[bool, typer.Option("--json", help="print the result as JSON on standard output")]


def open_model(path: Path) -> Synthesizer:
    """Return the model of a file; ModelError for a folder."""
    if path.is_dir():
        raise ModelError(path, "a folder, expected one .onnx file")
    return next(iter(model_registry.load([path]).models.values()))


def encoder_for(path: Path) -> ClipEncoder:
    """Return the encoder for a path's ending; UnknownFormat if there is none."""
    ending = path.suffix.removeprefix(".")
    if ending not in CLIP_ENCODERS:
        hint = did_you_mean(ending, CLIP_ENCODERS)
        known = ", ".join(CLIP_ENCODERS)
        raise UnknownFormat("output", f"{path.name!r} ends in none of {known}{hint}")
    return CLIP_ENCODERS[ending]
