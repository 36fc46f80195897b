"""Command `posefield train`: one or several recipes to models."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from posefield.common import atomic_files
from posefield.common.errors import InvalidField, TrainingError
from posefield.console.options import Json, with_option_groups
from posefield.console.output import as_json
from posefield_train.cli import executors, output_files
from posefield_train.cli.executors import ExecutorOptions
from posefield_train.cli.output_files import ProgressPrinter
from posefield_train.source import data_folder

if TYPE_CHECKING:
    from posefield_train.graph.onnx_export import ExportedModel
    from posefield_train.graph.trained_model import TrainedModel


STEPS, REPORT_STEPS = 5, 7
"""Steps of a training, without and with its report."""


@with_option_groups
def train_command(
    recipes: Annotated[
        list[Path],
        typer.Argument(
            help="recipes (TOML files or names of shipped recipes), one or more", metavar="RECIPE"
        ),
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="output .onnx file; for several recipes, a folder"),
    ],
    executor: ExecutorOptions,
    data: Annotated[
        Path | None,
        typer.Option(help="folder of the motion data; default: the recipe's folder"),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            help="output .html report of the training; a .json file is written next to it"
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Train the model of each recipe, one .onnx file each."""
    output_files.expect_html(report)
    recipe_files = [data_folder.recipe_file(recipe, data) for recipe in recipes]
    if len(recipe_files) == 1:
        _train(recipe_files[0], data, output, executor, report, json)
    elif report:
        raise InvalidField("report", "of several recipes, expected none")
    elif executor.resume:
        raise InvalidField("resume", "of several recipes, expected none")
    else:
        _sweep(recipe_files, data, output, executor, json)


def _train(
    recipe_file: Path,
    data: Path | None,
    output: Path,
    executor: ExecutorOptions,
    report: Path | None,
    json: bool,
) -> None:
    # SciPy and onnx take a second to import, and other commands do not need them.
    from posefield_train import training
    from posefield_train.source import ingest

    output_files.expect_onnx(output)
    recipe = training.read_recipe(recipe_file)
    steps = REPORT_STEPS if report else STEPS
    with executors.parts(executor) as jobs, ProgressPrinter("training", steps) as progress:
        progress(f"reading {recipe_file}")
        examples, notes = ingest.ingest(recipe, data or recipe_file.parent)
        clips = len(examples)
        share = min(max((clips - SMALL) / (LARGE - SMALL), 0.0), 1.0)
        pairs = zip(STEP_SECONDS_PER_CLIP[SMALL], STEP_SECONDS_PER_CLIP[LARGE], strict=True)
        seconds = [clips * ((1.0 - share) * few + share * many) for few, many in pairs]
        progress.expect([*seconds, *(REPORT_SECONDS if report else ())])
        ingest.check_presets(recipe, examples)
        trained = training.train_examples(recipe, examples, progress, jobs, notes)
        progress("writing the graph and comparing it with the reference")
        exported = training.export(trained, output)
        if report:
            _write_report(trained, exported, progress, report)
        progress("done")
    typer.echo(output_files.format_output(exported, output, json))


# Processor seconds of each step of a training of the procedural family, a clip: measured at 92
# clips, and at 2,000. Their ratios estimate the time of other families and machines.
SMALL, LARGE = 92, 2_000
STEP_SECONDS_PER_CLIP = {
    SMALL: (0.017, 0.014, 0.001, 0.012, 0.027),
    LARGE: (0.022, 0.018, 0.003, 0.030, 0.022),
}
# Of measuring the levels and drawing the report, of any number of clips.
REPORT_SECONDS = (0.2, 3.0)


def _write_report(
    trained: "TrainedModel",
    exported: "ExportedModel",
    progress: ProgressPrinter,
    path: Path,
) -> None:
    # matplotlib takes a second to import, and only the report needs it.
    from posefield_train.report import levels_of_detail, training_report

    progress("measuring levels of detail")
    levels = levels_of_detail.time_levels(exported)
    progress("drawing the report")
    rendered = training_report.render(trained, exported, levels, progress.finished)
    atomic_files.write(rendered.html, path)
    atomic_files.write(rendered.json, path.with_suffix(".json"))


def _sweep(
    recipe_files: list[Path], data: Path | None, folder: Path, executor: ExecutorOptions, json: bool
) -> None:
    from posefield.console.progress import ProgressBar
    from posefield_train import sweep

    if folder.suffix == ".onnx":
        raise InvalidField("output", f"{folder.name!r}, expected a folder for several models")
    summaries, failed = [], []
    with (
        executors.jobs(executor.scheduler, executor.jobs) as jobs,
        ProgressBar("models", len(recipe_files)) as bar,
    ):
        for result in sweep.train_models(recipe_files, data, jobs):
            bar.advance(1)
            if isinstance(result.outcome, TrainingError):
                failed.append(result.name)
                bar.print(f"{result.name}: {result.outcome}")
                continue
            path = folder / f"{result.name}.onnx"
            atomic_files.write(result.outcome.content, path)
            summaries.append(output_files.facts(result.outcome, path))
            if json:
                bar.print(output_files.summary(result.outcome, path))
            else:
                typer.echo(output_files.summary(result.outcome, path))
    if json:
        typer.echo(as_json(sorted(summaries, key=lambda facts: str(facts["file"]))))
    if failed:
        raise TrainingError(f"{', '.join(sorted(failed))} of {len(recipe_files)} made no model")
