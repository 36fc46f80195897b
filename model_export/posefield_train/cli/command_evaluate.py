"""Command `posefield evaluate`: errors of a recipe's models on held-out motions."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from posefield.common import atomic_files
from posefield.common.errors import InvalidField
from posefield.console.arguments import Json
from posefield.console.output import as_json
from posefield.console.question_options import with_option_groups
from posefield.console.registration import MAKE, PlainCommand, register
from posefield_train.cli import executors, output_files
from posefield_train.cli.executors import Scheduler
from posefield_train.source import shipped_recipes

if TYPE_CHECKING:
    from posefield.console.progress import ProgressBar
    from posefield_train.evaluate.learning_curves import Learning
    from posefield_train.evaluate.protocol import EvaluationResult, ProgressCallback
    from posefield_train.evaluate.support_flags import SupportFlags
    from posefield_train.parallel.jobs import Jobs
    from posefield_train.source.ingest import Example
    from posefield_train.source.recipe import Recipe


class Protocol(StrEnum):
    """Evaluation protocols."""

    CLIP = "clip"
    PERFORMER = "performer"
    TRUTH = "truth"


@dataclass(frozen=True)
class EvaluateOptions:
    """Options of an evaluation. protocol: None for all that the recipe allows."""

    protocol: Annotated[
        list[Protocol] | None,
        typer.Option(
            help="hold out clips or performers, or compare with the noise-free truth; may be "
            "repeated; default: all",
            metavar="|".join(Protocol),
        ),
    ] = None
    report: Annotated[Path | None, typer.Option(help="output .html report")] = None
    json: Json = False
    json_file: Annotated[
        Path | None,
        typer.Option("--json-file", help="output .json file; --json FILE is the same"),
    ] = None
    joined: Annotated[
        Path | None,
        typer.Option(
            help="another recipe: measure the share of the gap between both families that the "
            "support flag detects",
            metavar="RECIPE",
        ),
    ] = None
    learning: Annotated[
        bool,
        typer.Option(
            "--learning",
            help="compare the errors after suggested and after random captures, for the "
            "procedural family",
        ),
    ] = False
    scheduler: Scheduler = None
    jobs: Annotated[int | None, typer.Option(help="number of processes; default: one per core")] = (
        None
    )
    resume: Annotated[
        Path | None,
        typer.Option(
            help="folder of finished folds: those of equal data, code and settings are read "
            "instead of computed, and new ones are kept; it holds pickles, use your own only",
            metavar="FOLDER",
        ),
    ] = None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise InvalidField("jobs", f"{self.jobs}, expected 1 or more")

    @contextmanager
    def executor(self) -> "Iterator[Jobs]":
        """Open the executor of the folds."""
        from posefield_train.parallel.finished_jobs import FinishedJobs

        with executors.jobs(self.scheduler, self.jobs) as own:
            yield FinishedJobs(own, self.resume) if self.resume else own

    @property
    def protocols(self) -> list[str]:
        """Names of the wanted protocols; empty for all that the recipe allows."""
        return [one.value for one in self.protocol or []]

    def print(self, text: str) -> None:
        """Print a result for people: on standard error if standard output has the JSON."""
        typer.echo(text, err=self.json)


@with_option_groups
def evaluate(
    recipe: Annotated[
        Path,
        typer.Argument(help="recipe (TOML file or name of a shipped recipe)", metavar="RECIPE"),
    ],
    wanted: EvaluateOptions,
    data: Annotated[
        Path | None,
        typer.Option(help="folder of the motion data; default: the recipe's folder"),
    ] = None,
) -> None:
    """Measure the errors of a recipe's models on held-out motions.

    Other methods are measured on the same motions. Each fold fits the whole model again without the
    held-out clips.
    """
    output_files.expect_html(wanted.report)
    recipe_file = shipped_recipes.file_of(recipe, data)
    _evaluate(recipe_file, data or recipe_file.parent, wanted)


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
    found = list(words)
    for at, (word, after) in enumerate(zip_longest(words, words[1:], fillvalue="-")):
        is_recipe = after.endswith(".toml") or after in shipped_recipes.names()
        if word.startswith("--json=") or (
            word == "--json" and not after.startswith("-") and not is_recipe
        ):
            found[at] = word.replace("--json", "--json-file", 1)
    return found


EXAMPLES = [
    "evaluate kick/recipe.toml --report kick.html",
    "evaluate cmu_walk --data motion --protocol performer --json",
]


def add(app: typer.Typer) -> None:
    """Add the command to an application."""
    register(app, evaluate, MAKE, EXAMPLES, "evaluate", EvaluateCommand)


@dataclass(frozen=True)
class _Family:
    """A recipe and its examples."""

    recipe: "Recipe"
    examples: "list[Example]"


def _evaluate(recipe_file: Path, data: Path, wanted: EvaluateOptions) -> None:
    from posefield_train.evaluate.summary import evaluation_summary

    # Errors in the arguments are reported before minutes of work.
    own = _family(recipe_file, data, wanted)
    other = _joined(own, data, wanted)
    results = _protocols(own, wanted)
    wanted.print(evaluation_summary.legend(results))
    curve = _learning(wanted)
    more = _extra_results(own, other, results, curve, wanted)
    first, *others = map(evaluation_summary.facts, results)
    found = as_json({**first, **more, "others": others})
    if wanted.json:
        typer.echo(found)
    if wanted.json_file:
        atomic_files.write(found.encode(), wanted.json_file)
    if wanted.report:
        from posefield_train.evaluate.pages import evaluation_page

        atomic_files.write(
            evaluation_page.html(own.recipe.description, results, curve), wanted.report
        )


def _family(recipe_file: Path, data: Path, wanted: EvaluateOptions) -> _Family:
    """Read a recipe's family. Raises InvalidField for options that it does not allow."""
    from posefield_train.evaluate import protocol
    from posefield_train.source import ingest, recipe

    own = recipe.read_accepted(recipe_file)
    if wanted.learning and not own.truth:
        raise InvalidField("learning", f"{own.name} has no truth, expected the procedural family")
    examples, _ = ingest.ingest(own, data)
    can = protocol.protocols(own, examples)
    for name in wanted.protocols:
        if name not in can:
            raise InvalidField("protocol", f"{name!r}, but {own.name} can only: {', '.join(can)}")
    return _Family(own, examples)


@dataclass(frozen=True)
class _JoinedFamily:
    """Name of a joined family, and the support flags of both families together."""

    name: str
    flags: "SupportFlags"


def _joined(own: _Family, data: Path, wanted: EvaluateOptions) -> _JoinedFamily | None:
    """Return None if no other family is named."""
    from posefield_train.evaluate import support_flags
    from posefield_train.source import ingest, recipe

    if not wanted.joined:
        return None
    other = recipe.read_accepted(wanted.joined)
    examples, _ = ingest.ingest(other, data)
    return _JoinedFamily(
        other.name, support_flags.measure_joined(own.recipe, own.examples, other, examples)
    )


def _protocols(own: _Family, wanted: EvaluateOptions) -> "list[EvaluationResult]":
    """Run the protocols and print each result when it is complete."""
    from posefield.console.progress import ProgressBar
    from posefield_train.evaluate import corrections, protocol
    from posefield_train.evaluate.footing import feet_summary
    from posefield_train.evaluate.summary import evaluation_summary, performer_summary
    from posefield_train.evaluate.variation import take_summary

    names = wanted.protocols or protocol.protocols(own.recipe, own.examples)
    counts = [protocol.count_jobs(own.examples, name) for name in names]
    results = []
    with wanted.executor() as jobs:
        for place, name in enumerate(names):
            before, total = sum(counts[:place]), sum(counts)
            # One bar for all protocols, so that the estimate is that of the command.
            with ProgressBar(f"{own.recipe.name}, {name}", total, before) as bar:
                results.append(
                    protocol.run_protocol(
                        own.recipe, own.examples, name, jobs, _after(bar, before, total)
                    )
                )
            trust = "\n".join(evaluation_summary.trust_text(results[-1]))
            wanted.print(f"{evaluation_summary.table(results[-1])}\n\n{trust}\n")
            if results[-1].corrections:
                wanted.print(f"{corrections.table(results[-1])}\n")
            if results[-1].feet:
                wanted.print(f"{feet_summary.table(results[-1].feet)}\n")
            if told := take_summary.table(results[-1].variation):
                wanted.print(f"{told}\n")
    for text in performer_summary.performer_text(results):
        wanted.print(text)
    return results


def _after(bar: "ProgressBar", before: int, total: int) -> "ProgressCallback":
    """Return a callback that shows folds after `before` others, of `total`."""
    return lambda done, _: bar.update(before + done, total)


def _extra_results(
    own: _Family,
    other: _JoinedFamily | None,
    results: "list[EvaluationResult]",
    curve: "Learning | None",
    wanted: EvaluateOptions,
) -> dict[str, Any]:
    """Print and return the results for a joined family, for performers and for suggested clips."""
    from posefield_train.evaluate import learning_curves
    from posefield_train.evaluate.summary import performer_summary

    more: dict[str, Any] = {}
    if other:
        wanted.print(f"\n{own.recipe.name} and {other.name} joined, {other.flags.text()}")
        more["joined"] = {"family": other.name, "support": other.flags.facts()}
    if named := performer_summary.performer_facts(results):
        more["performers"] = named
    if curve:
        more["learning"] = learning_curves.facts(curve)
        wanted.print(f"\n{learning_curves.table(curve)}")
    return more


def _learning(wanted: EvaluateOptions) -> "Learning | None":
    """Measure the learning curves; None if they are not wanted."""
    from posefield.console.progress import ProgressBar
    from posefield_train.evaluate import learning_curves

    if not wanted.learning:
        return None
    with wanted.executor() as jobs, ProgressBar("learning") as bar:
        return learning_curves.measure_curves(jobs, bar.update)
