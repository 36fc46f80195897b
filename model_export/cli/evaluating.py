"""`posefield evaluate`: how far a recipe's models lie from motions that they have not seen."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from model_export.cli import outputs, places
from model_export.cli.places import Scheduler
from model_export.cli.progress import bar
from service.cli.answers import as_json
from service.motion import files
from service.motion.errors import InvalidField

if TYPE_CHECKING:
    from model_export.evaluate.flags import Flags
    from model_export.evaluate.learning import Learning
    from model_export.evaluate.protocol import Result
    from model_export.ingest import Example
    from model_export.recipe import Recipe


class Protocol(StrEnum):
    """Ways to ask how good a model is."""

    CLIP = "clip"
    PERFORMER = "performer"
    TRUTH = "truth"


def evaluate(
    recipe_file: Annotated[
        Path | None, typer.Argument(help="a TOML file", metavar="RECIPE", show_default=False)
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="folder of the motion data; the recipe's own if not said")
    ] = None,
    protocol: Annotated[
        list[Protocol] | None,
        typer.Option(help="hold out clips, or performers, or compare with the truth; all that can"),
    ] = None,
    report: Annotated[Path | None, typer.Option(help="the .html file to write")] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="the .json file to write", metavar="FILE")
    ] = None,
    joined: Annotated[
        Path | None,
        typer.Option(help="another recipe: is the gap between both flagged?", metavar="RECIPE"),
    ] = None,
    learning: Annotated[
        bool, typer.Option(help="what suggested clips are worth, on the procedural family")
    ] = False,
    table1: Annotated[bool, typer.Option(help="Table 1 of the paper, measured again")] = False,
    scheduler: Scheduler = None,
) -> None:
    """Measure how far a recipe's models lie from motions they have not seen, beside other methods.

    Everything is fitted anew without what is held out.
    """
    outputs.expect_html(report)
    if table1 and scheduler:
        raise InvalidField("scheduler", "Table 1 is timed on one machine, expected none")
    if table1:
        _table1(json_file)
    elif recipe_file is None:
        raise InvalidField("RECIPE", "missing: expected a recipe, or --table1")
    else:
        asked = [one.value for one in protocol or []]
        wanted = _Wanted(asked, report, json_file, scheduler, joined, learning)
        _evaluate(recipe_file, data or recipe_file.parent, wanted)


def _table1(json_file: Path | None) -> None:
    from model_export.evaluate import table1

    found = table1.measure()
    if json_file:
        files.write(as_json(table1.facts(found)).encode(), json_file)
    typer.echo(table1.text(found))


@dataclass(frozen=True)
class _Wanted:
    """Protocols, all that can for none, what to write, where to work, the recipe of a family that
    is joined to this one, and whether suggested clips are tried out."""

    protocols: list[str]
    report: Path | None
    json_file: Path | None
    scheduler: str | None
    joined: Path | None
    learning: bool


@dataclass(frozen=True)
class _Family:
    """A recipe and what it was read to."""

    recipe: "Recipe"
    examples: "list[Example]"


def _evaluate(recipe_file: Path, data: Path, wanted: _Wanted) -> None:
    from model_export.evaluate import summary

    # What cannot be done is refused before minutes of work.
    own = _family(recipe_file, data, wanted)
    other = _joined(own, data, wanted)
    results = _protocols(own, wanted)
    typer.echo(f"{summary.LEGEND}\n{summary.definitions(results)}")
    curve = _learning(wanted)
    more = _beside(own, other, results, curve)
    first, *others = map(summary.facts, results)
    if wanted.json_file:
        files.write(as_json({**first, **more, "others": others}).encode(), wanted.json_file)
    if wanted.report:
        from model_export.evaluate import render

        files.write(render.html(own.recipe.description, results, curve), wanted.report)


def _family(recipe_file: Path, data: Path, wanted: _Wanted) -> _Family:
    """A recipe's family; InvalidField for what it cannot be asked."""
    from model_export import ingest, recipe
    from model_export.evaluate import protocol

    own = recipe.read(recipe_file)
    if wanted.learning and not own.truth:
        raise InvalidField("learning", f"{own.name} has no truth, expected the procedural family")
    examples, _ = ingest.ingest(own, data)
    can = protocol.protocols(own, examples)
    for name in wanted.protocols:
        if name not in can:
            raise InvalidField("protocol", f"{name!r}, but {own.name} can only: {', '.join(can)}")
    return _Family(own, examples)


@dataclass(frozen=True)
class _Joined:
    """Name of a family joined to the evaluated one, and what is flagged between both."""

    name: str
    flags: "Flags"


def _joined(own: _Family, data: Path, wanted: _Wanted) -> _Joined | None:
    """None where no other family is named."""
    from model_export import ingest, recipe
    from model_export.evaluate import flags

    if not wanted.joined:
        return None
    other = recipe.read(wanted.joined)
    examples, _ = ingest.ingest(other, data)
    return _Joined(other.name, flags.joined(own.recipe, own.examples, other, examples))


def _protocols(own: _Family, wanted: _Wanted) -> "list[Result]":
    """What the protocols found, each told as soon as it is done."""
    from model_export.evaluate import protocol, reach, summary, worth

    can = protocol.protocols(own.recipe, own.examples)
    results = []
    with places.jobs(wanted.scheduler, [own.examples]):
        for name in wanted.protocols or can:
            with bar(name) as progress:
                results.append(protocol.run(own.recipe, own.examples, name, progress))
            trust = "\n".join(summary.trust_said(results[-1]))
            typer.echo(f"{summary.table(results[-1])}\n\n{trust}\n")
            if results[-1].corrections:
                typer.echo(f"{reach.table(results[-1])}\n")
    for said in worth.said(results):
        typer.echo(said)
    return results


def _beside(
    own: _Family, other: _Joined | None, results: "list[Result]", curve: "Learning | None"
) -> dict[str, Any]:
    """What else was measured: of a joined family, of performers, and of suggested clips."""
    from model_export.evaluate import learning, summary, worth

    more: dict[str, Any] = {}
    if other:
        said = summary.flags_said(other.flags)
        typer.echo(f"\n{own.recipe.name} and {other.name} joined, {said}")
        more["joined"] = {"family": other.name, "support": summary.flags_facts(other.flags)}
    if named := worth.facts(results):
        more["performers"] = named
    if curve:
        more["learning"] = learning.facts(curve)
        typer.echo(f"\n{learning.table(curve)}")
    return more


def _learning(wanted: _Wanted) -> "Learning | None":
    """What suggested clips are worth; none where nobody asks."""
    from model_export.evaluate import learning

    if not wanted.learning:
        return None
    with places.jobs(wanted.scheduler), bar("learning") as progress:
        return learning.measure(progress)
