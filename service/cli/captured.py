"""`posefield why` and `posefield suggest`: the clips behind an answer, and those that lack."""

from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import as_json, tell
from service.cli.arguments import (
    Controls,
    Extrapolate,
    Json,
    ModelPath,
    Performer,
    numbers,
    open_model,
)
from service.encode import reasons, suggestions
from service.export import queries
from service.synthesis.suggest import COUNT, SuggestQuestion
from service.synthesis.suggest import suggest as find_suggestions
from service.synthesis.why import NEAREST, WhyQuestion
from service.synthesis.why import why as find_reasons


def why(
    model: ModelPath,
    control: Controls = None,
    extrapolate: Extrapolate = "warn",
    performer: Performer = None,
    nearest: Annotated[int, typer.Option(help="captured clips to list")] = NEAREST,
    json: Json = False,
) -> None:
    """Say what an answer is made of: the captured clips near it, and what each counts for."""
    synthesizer = open_model(model)
    asked = WhyQuestion(numbers(control or []), extrapolate, performer, nearest)
    found = find_reasons(synthesizer, asked)
    tell(found)
    typer.echo(as_json(reasons.plain(found)) if json else reasons.text(found))


def suggest(
    model: ModelPath,
    count: Annotated[int, typer.Option(help="points to list")] = COUNT,
    performer: Annotated[
        str | None,
        typer.Option(help="whose clips alone count as captured; everybody's if not said"),
    ] = None,
    candidates: Annotated[
        Path | None,
        typer.Option(
            help="CSV, Parquet or JSON Lines of points that can be captured", metavar="FILE"
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Say which clips to capture next: where one more would be worth most, the first first."""
    synthesizer = open_model(model)
    given = queries.points(candidates, synthesizer) if candidates else None
    found = find_suggestions(synthesizer, SuggestQuestion(count, performer, given))
    typer.echo(as_json(suggestions.plain(found)) if json else suggestions.text(found))
