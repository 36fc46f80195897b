"""The `posefield why` and `posefield suggest` commands: captured clips, and those to add."""

from pathlib import Path
from typing import Annotated

import typer

from posefield.batch import rows
from posefield.console.arguments import Json, ModelPath, open_model
from posefield.console.late_progress import LateProgress
from posefield.console.output import as_json, print_warnings
from posefield.console.question_options import with_question_options
from posefield.encode.tables import model_tables
from posefield.question.model_question import SuggestQuestion, WhyQuestion
from posefield.synthesis.capture_suggestions import suggest as find_suggestions
from posefield.synthesis.explanation import explain_result as find_reasons


@with_question_options(WhyQuestion)
def why(model: ModelPath, question: WhyQuestion, json: Json = False) -> None:
    """Print the captured clips nearest to the controls.

    Each clip has its distance, and its weight in the answer.
    """
    found = find_reasons(open_model(model), question)
    print_warnings(found)
    as_text = model_tables.explanation_text
    typer.echo(as_json(model_tables.explanation(found)) if json else as_text(found))


@with_question_options(SuggestQuestion)
def suggest(
    model: ModelPath,
    question: SuggestQuestion,
    candidates: Annotated[
        Path | None,
        typer.Option(
            help="CSV, Parquet or JSON Lines file with the candidate points; default: points "
            "across the sampled ranges",
            metavar="FILE",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """List the clips to capture next, the most useful first."""
    synthesizer = open_model(model)
    given = rows.points(candidates, synthesizer) if candidates else None
    with LateProgress("points", question.count) as bar:
        found = find_suggestions(synthesizer, question, given, bar.update)
    as_text = model_tables.suggestions_text
    typer.echo(as_json(model_tables.suggestions(found)) if json else as_text(found))
