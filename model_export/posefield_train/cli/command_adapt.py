"""Command `posefield adapt`: a new performer for an existing model."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from posefield.common import atomic_files
from posefield.common.errors import InvalidField
from posefield.common.units import UpAxis
from posefield.console.options import Json, ModelPath, with_option_groups
from posefield.model_file.model_card import PERFORMER
from posefield_train.cli import output_files
from posefield_train.cli.output_files import ProgressPrinter

RootOffset = Literal["replace", "add"]


@dataclass(frozen=True)
class ClipArguments:
    """Files of the new clips, their labels, and the conventions that they are written in."""

    unit: Annotated[
        float, typer.Option(help="length of the files' unit in metres", metavar="METRES")
    ]
    up: Annotated[UpAxis, typer.Option(help="up axis of the files")]
    clips: Annotated[
        list[Path] | None,
        typer.Argument(
            help="motion files of one new performer: one or more, typically up to five; for a "
            "model with curves with a file NAME.curves.csv beside each; CSV files for curves alone",
            metavar="CLIP",
        ),
    ] = None
    table: Annotated[
        Path | None,
        typer.Option(
            help="instead of clips: CSV with columns file, first_frame, last_frame and one column "
            "per control; controls that the model can measure may be omitted; for a model with "
            "curves also column curves"
        ),
    ] = None
    root_offset: Annotated[
        RootOffset | None,
        typer.Option(help="whether root position channels replace the root's OFFSET or add to it"),
    ] = None
    rate: Annotated[
        float | None,
        typer.Option(
            help="frames a second of CSV files, for a model of curves without a skeleton, and of "
            "motion files that state none",
            metavar="FPS",
        ),
    ] = None
    label: Annotated[
        list[str] | None,
        typer.Option(
            help="name of all clips in a further label set of the model; may be repeated",
            metavar="SET=NAME",
        ),
    ] = None


STEPS = 3
"""Steps of an adaptation."""


@with_option_groups
def adapt(
    model: ModelPath,
    files: ClipArguments,
    output: Annotated[Path, typer.Option("--output", "-o", help="output .onnx file")],
    performer: Annotated[str, typer.Option(help="performer's name, used in requests")],
    licence: Annotated[
        str, typer.Option(help="licence of the new clips, with its required attribution")
    ],
    json: Json = False,
) -> None:
    """Add a performer to a model from a few clips.

    The model's training data is not needed.
    """
    from posefield_train.adapt import adapted_file, model_reconstruction, new_clips
    from posefield_train.adapt.adapted_file import NewPerformer
    from posefield_train.source.recipe_sections import Source

    output_files.expect_onnx(output)
    if bool(files.clips) == bool(files.table):
        raise InvalidField("clips", "expected either motion files or --table")
    if not (0.0 < files.unit < float("inf")):
        raise InvalidField("unit", f"{files.unit}, expected a length in metres")
    if files.rate is not None and not (0.0 < files.rate < float("inf")):
        raise InvalidField("rate", f"{files.rate}, expected frames a second above 0")
    if not licence.strip():
        raise InvalidField("licence", "blank, expected a text")
    with ProgressPrinter("adapting", STEPS) as progress:
        progress(f"reading {model}")
        reopened = model_reconstruction.load(model)
        adapted_file.check_name(reopened.card, performer)
        labels = _labels(files.label or [])
        adapted_file.check_labels(reopened.card, labels)
        labels[PERFORMER] = performer
        source = Source(
            metres_per_unit=files.unit,
            up=files.up,
            root_offset=files.root_offset,
            rate=files.rate,
        )
        progress("reading clips")
        if files.table:
            clips = new_clips.examples_of_table(reopened, files.table, source, labels, files.rate)
        else:
            paths = files.clips or []
            clips = new_clips.examples_of_files(reopened, paths, source, labels, files.rate)
        examples, notes = clips
        progress("adapting, and comparing the graph with the reference")
        exported = adapted_file.export_adapted(
            reopened, NewPerformer(performer, examples, licence, notes)
        )
        atomic_files.write(exported.content, output)
        progress("done")
    typer.echo(output_files.format_output(exported, output, json))


def _labels(options: list[str]) -> dict[str, str]:
    """Return names by label set; InvalidField for another form, or a set that is named twice."""
    labels: dict[str, str] = {}
    for text in options:
        name, mark, label = text.partition("=")
        if not (name and mark and label):
            raise InvalidField("label", f"{text!r}, expected SET=NAME")
        if name in labels:
            raise InvalidField("label", f"{name!r} twice, expected once")
        labels[name] = label
    return labels
