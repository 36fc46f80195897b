"""Command `posefield evaluate`: errors of a recipe's models on held-out motions."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import InvalidField
from posefield.console.options import Json, with_option_groups
from posefield.console.output import as_json
from posefield.console.registration import MAKE, PlainCommand, register
from posefield_train.cli import executors
from posefield_train.cli.executors import Scheduler
from posefield_train.source import data_folder

if TYPE_CHECKING:
    from posefield.console.progress import ProgressBar
    from posefield_train.evaluate.protocol import EvaluationResult, ProgressCallback
    from posefield_train.jobs import Jobs
    from posefield_train.source.ingest import Example
    from posefield_train.source.recipe import Recipe


class Protocol(StrEnum):
    """Evaluation protocols."""

    CLIP = "clip"
    PERFORMER = "performer"


@dataclass(frozen=True)
class EvaluateOptions:
    """Options of an evaluation. protocol: None for all that the recipe allows."""

    protocol: Annotated[
        list[Protocol] | None,
        typer.Option(
            help="hold out clips or performers; may be repeated; default: all",
            metavar="|".join(Protocol),
        ),
    ] = None
    json: Json = False
    json_file: Annotated[
        Path | None,
        typer.Option("--json-file", help="output .json file; --json FILE is the same"),
    ] = None
    scheduler: Scheduler = None
    jobs: Annotated[int | None, typer.Option(help="number of processes; default: one per core")] = (
        None
    )
    resume: Annotated[
        Path | None,
        typer.Option(
            help="folder of finished folds: those of equal data, code and settings are read "
            "instead of computed, and new ones are kept",
            metavar="FOLDER",
        ),
    ] = None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise InvalidField("jobs", f"{self.jobs}, expected 1 or more")

    @contextmanager
    def executor(self) -> "Iterator[Jobs]":
        """Open the executor of the folds."""
        from posefield_train.jobs import FinishedJobs

        with executors.jobs(self.scheduler, self.jobs) as jobs:
            yield FinishedJobs(jobs, self.resume) if self.resume else jobs

    def print(self, text: str) -> None:
        """Print a result for people: on standard error if standard output has the JSON."""
        typer.echo(text, err=self.json)


@with_option_groups
def evaluate(
    recipe: Annotated[
        Path,
        typer.Argument(help="recipe (TOML file or name of a shipped recipe)", metavar="RECIPE"),
    ],
    options: EvaluateOptions,
    data: Annotated[
        Path | None,
        typer.Option(help="folder of the motion data; default: the recipe's folder"),
    ] = None,
) -> None:
    """Measure the errors of a recipe's models on held-out motions.

    A Gaussian process and the mean motion are measured on the same motions. Each fold fits the
    whole model again without the held-out clips.
    """
    recipe_file = data_folder.recipe_file(recipe, data)
    _evaluate(recipe_file, data or recipe_file.parent, options)


class EvaluateCommand(PlainCommand):
    """Command that also accepts `--json FILE`, the form before --json became a flag."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Parse the words of a command line."""
        return super().parse_args(ctx, json_file_words(args))


def json_file_words(words: Sequence[str]) -> list[str]:
    """Return the words with --json-file for a --json that a file follows.

    A word after --json is its file unless it is an option, or the recipe: a TOML file or the name
    of a shipped recipe.
    """
    arguments = list(words)
    for at, (word, after) in enumerate(zip_longest(words, words[1:], fillvalue="-")):
        is_recipe = after.endswith(".toml") or after in data_folder.shipped_names()
        if word.startswith("--json=") or (
            word == "--json" and not after.startswith("-") and not is_recipe
        ):
            arguments[at] = word.replace("--json", "--json-file", 1)
    return arguments


EXAMPLES = [
    "evaluate kick/recipe.toml --json-file kick.json",
    "evaluate cmu_walk --data motion --protocol performer --json",
]


def add(app: typer.Typer) -> None:
    """Add the command to an application."""
    register(app, evaluate, MAKE, EXAMPLES, "evaluate", EvaluateCommand)


def _evaluate(recipe_file: Path, data: Path, options: EvaluateOptions) -> None:
    from posefield_train.evaluate import protocol, summary
    from posefield_train.source import ingest, recipe

    # Errors in the arguments are reported before minutes of work.
    family = recipe.read_accepted(recipe_file)
    examples, _ = ingest.ingest(family, data)
    allowed = protocol.protocols(examples)
    names = [one.value for one in options.protocol or []]
    for name in names:
        if name not in allowed:
            can = ", ".join(allowed)
            raise InvalidField("protocol", f"{name!r}, but {family.name} can only: {can}")
    results = _results(family, examples, names or allowed, options)
    options.print(summary.legend(results))
    first, *rest = map(summary.facts, results)
    figures = as_json({**first, "others": rest})
    if options.json:
        typer.echo(figures)
    if options.json_file:
        atomic_files.write(figures.encode(), options.json_file)


def _results(
    family: "Recipe", examples: "list[Example]", names: list[str], options: EvaluateOptions
) -> "list[EvaluationResult]":
    """Run the protocols and print each result when it is complete."""
    from posefield.console.progress import ProgressBar
    from posefield_train.evaluate import protocol, summary

    counts = [len(protocol.folds_of(examples, name)) for name in names]
    results = []
    with options.executor() as jobs:
        for index, name in enumerate(names):
            before, total = sum(counts[:index]), sum(counts)
            # One bar for all protocols, so that the estimate is that of the command.
            with ProgressBar(f"{family.name}, {name}", total, before) as bar:
                report = _after(bar, before, total)
                results.append(protocol.run_protocol(family, examples, name, jobs, report))
            trust = "\n".join(summary.trust_text(results[-1]))
            options.print(f"{summary.table(results[-1])}\n\n{trust}\n")
    return results


def _after(bar: "ProgressBar", before: int, total: int) -> "ProgressCallback":
    """Return a callback that shows folds after `before` others, of `total`."""
    return lambda done, _: bar.update(before + done, total)
