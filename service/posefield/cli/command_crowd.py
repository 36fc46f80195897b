"""The `posefield crowd` command: crowds of walking characters."""

from pathlib import Path
from typing import Annotated

import typer
from msgspec import structs

from posefield.common.errors import InvalidField
from posefield.console.arguments import Json, ModelPath, open_model
from posefield.console.output import as_json
from posefield.console.question_options import with_question_options
from posefield.question.walk_question import WalkQuestion

DEFAULT_COUNT = 500


@with_question_options(WalkQuestion, usual={"seconds": 10.0}, without={"count"})
def crowd(
    model: ModelPath,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="output file: usd, usda, usdc, usdz or npz"),
    ],
    question: WalkQuestion,
    count: Annotated[
        int | None,
        typer.Option(help=f"number of characters, each on its own path; default: {DEFAULT_COUNT}"),
    ] = None,
    paths: Annotated[
        Path | None,
        typer.Option(
            help="instead of random paths: JSON list of routes with waypoints (x, z pairs, m) and "
            "speed (m/s)",
            metavar="FILE",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Write a walking crowd to a file.

    Each character walks on its own path at its own varying speed.
    """
    from posefield.cli import crowd_files
    from posefield.locomotion import crowd_order

    if paths and count is not None:
        raise InvalidField("count", f"{count}, expected none: every path has one character")
    question = structs.replace(question, count=DEFAULT_COUNT if count is None else count)
    asked = crowd_order.from_question(question, crowd_files.routes(paths) if paths else ())
    facts = crowd_files.write_crowd(open_model(model), asked, question, output)
    typer.echo(as_json(facts) if json else crowd_files.report_text(facts))
