"""Several recipes trained beside each other, each on one thread."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from joblib import Parallel, cpu_count, delayed, parallel_config

from model_export import export, ingest, recipe, threads, train
from model_export.export import Exported
from model_export.ingest import Example
from model_export.recipe import Recipe
from service.motion.errors import InvalidField, TrainingError


@dataclass(frozen=True)
class Made:
    """What came of a recipe: a model, or why there is none."""

    name: str
    found: Exported | TrainingError


def models(paths: Sequence[Path], data: Path | None, jobs: int | None) -> Iterator[Made]:
    """Models of recipes, named like their files, in the order that they are done in.

    data: folder of the motion data; each recipe's own for none. jobs: processes, where joblib was
    not told of a cluster; one a core for none. Raises InvalidField for two files of one name, and
    RecipeError or BvhError where a recipe cannot be followed.
    """
    names = [path.stem for path in paths]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InvalidField("RECIPE", f"{', '.join(twice)} twice, expected names of their own")
    read = [(path, recipe.read(path)) for path in paths]
    parallel = Parallel(
        n_jobs=min(jobs or cpu_count(), len(paths)), return_as="generator_unordered"
    )
    # Data are read when there is room for them.
    yield from parallel(
        delayed(_model)(path.stem, own, *ingest.ingest(own, data or path.parent))
        for path, own in read
    )


def _model(name: str, own: Recipe, examples: list[Example], notes: list[str]) -> Made:
    with parallel_config(backend="sequential"), threads.one():
        try:
            trained = train.train(own, examples, lambda _: None)
            return Made(name, export.export(own, trained, notes))
        except TrainingError as fault:
            return Made(name, fault)
