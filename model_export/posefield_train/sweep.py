"""Training of several recipes in parallel, each on one thread."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from posefield.common.errors import InvalidField, TrainingError
from posefield_train import training
from posefield_train.graph import onnx_export
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.jobs import Jobs, single_threaded
from posefield_train.source import ingest, recipe
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe


@dataclass(frozen=True)
class SweepResult:
    """Result of a recipe: an exported model, or the error that prevented it."""

    name: str
    outcome: ExportedModel | TrainingError


def train_models(paths: Sequence[Path], data: Path | None, jobs: Jobs) -> Iterator[SweepResult]:
    """Yield the models of recipes, named after their files, in the order in which they finish.

    data: folder of the motion data; None for each recipe's own. Raises InvalidField if two files
    have the same name, and RecipeError or BvhError if a recipe or its data cannot be read.
    """
    names = [path.stem for path in paths]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InvalidField("RECIPE", f"{', '.join(twice)} twice, expected names of their own")
    read = [(path, recipe.read_accepted(path)) for path in paths]
    # Data are read when jobs are started, so that few recipes' data are in memory.
    return jobs.run(
        _train_model,
        ((path.stem, family, *ingest.ingest(family, data or path.parent)) for path, family in read),
    )


@single_threaded()
def _train_model(
    name: str, recipe: Recipe, examples: list[Example], notes: list[str]
) -> SweepResult:
    try:
        ingest.check_presets(recipe, examples)
        trained = training.train_examples(recipe, examples, notes=notes)
        return SweepResult(name, onnx_export.export_model(trained))
    except TrainingError as error:
        return SweepResult(name, error)
