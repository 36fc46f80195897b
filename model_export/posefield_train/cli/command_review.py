"""Command `posefield review`: decisions on the families that were found in long takes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from posefield.common.errors import InvalidField
from posefield.console.arguments import Json
from posefield.console.output import as_json
from posefield.console.question_options import with_option_groups

EXAMPLES = [
    "review recipes --accept 1,2 --reject 3 --merge 4,5 --drop 2:bd_1.bvh@33.2",
    "review recipes --decisions recipes/decisions.json",
]


@dataclass(frozen=True)
class DecisionOptions:
    """Decisions, by the numbers of families."""

    accept: Annotated[
        str | None, typer.Option(help="families to train from", metavar="NUMBERS")
    ] = None
    reject: Annotated[
        str | None, typer.Option(help="families that are none", metavar="NUMBERS")
    ] = None
    merge: Annotated[
        list[str] | None,
        typer.Option(help="two families, the second into the first; repeatable", metavar="A,B"),
    ] = None
    drop: Annotated[
        list[str] | None,
        typer.Option(
            help="clip of a family to leave out, by a time within it; repeatable",
            metavar="FAMILY:FILE@SECONDS",
        ),
    ] = None


@with_option_groups
def review(
    folder: Annotated[
        Path, typer.Argument(help="folder that posefield discover wrote", metavar="FOLDER")
    ],
    given: DecisionOptions,
    decisions: Annotated[
        Path | None,
        typer.Option(
            help="JSON file with the decisions, which the page index.html saves", metavar="FILE"
        ),
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="folder of the takes; default: that of the search")
    ] = None,
    json: Json = False,
) -> None:
    """Accept, reject and merge found families, and drop clips.

    posefield train takes the recipes that are accepted. The same decisions again change nothing.
    """
    from posefield_train.families import review as family_decisions
    from posefield_train.families import review as family_review

    if (decisions is None) == (given == DecisionOptions()):
        raise InvalidField("decisions", "expected either --decisions FILE or other decisions")
    found = (
        family_decisions.of_texts(given.accept, given.reject, given.merge or [], given.drop or [])
        if decisions is None
        else family_decisions.read(decisions)
    )
    facts = family_review.apply(folder, found, data)
    if json:
        typer.echo(as_json(facts))
        return
    for one in facts["families"]:
        into = f" into {one['into']}" if one["status"] == "merged" else ""
        typer.echo(f"family {one['number']}: {one['status']}{into}, {one['clips']} clips")
