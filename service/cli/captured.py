"""The `posefield why` and `posefield suggest` commands: captured clips, and those to add."""

from pathlib import Path
from typing import Annotated

import typer

from service.cli.answers import as_json, tell
from service.cli.arguments import Json, ModelPath, open_model
from service.cli.options import asks
from service.encode import reasons, suggestions
from service.export import queries
from service.question.model_question import SuggestQuestion, WhyQuestion
from service.synthesis.suggest import suggest as find_suggestions
from service.synthesis.why import why as find_reasons


@asks(WhyQuestion)
def why(model: ModelPath, question: WhyQuestion, json: Json = False) -> None:
    """Explain an answer: the captured clips near it, and the weight of each."""
    found = find_reasons(open_model(model), question)
    tell(found)
    typer.echo(as_json(reasons.plain(found)) if json else reasons.text(found))


@asks(SuggestQuestion)
def suggest(
    model: ModelPath,
    question: SuggestQuestion,
    candidates: Annotated[
        Path | None,
        typer.Option(
            help="CSV, Parquet or JSON Lines of points that can be captured", metavar="FILE"
        ),
    ] = None,
    json: Json = False,
) -> None:
    """List the clips to capture next, the most useful first."""
    synthesizer = open_model(model)
    given = queries.points(candidates, synthesizer) if candidates else None
    found = find_suggestions(synthesizer, question, given)
    typer.echo(as_json(suggestions.plain(found)) if json else suggestions.text(found))
