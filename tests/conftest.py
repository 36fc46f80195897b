"""What many tests need: random numbers from one seed, and a small model really trained."""

import os
import shutil
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import stores

from model_export import export, ingest, recipe, train
from model_export.export import Exported
from model_export.ingest import Example
from model_export.recipe import Recipe
from model_export.sample import stroll, write
from model_export.train import Trained
from service import cli


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> Iterator[str]:
    """Address of an object store's server."""
    with stores.serving(tmp_path_factory.mktemp("store") / "said") as address:
        yield address


@pytest.fixture
def store_environment(store, monkeypatch) -> None:
    """The environment that says where the store is and who asks."""
    for name, value in stores.told(store).items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers from a fixed seed."""
    return np.random.Generator(np.random.PCG64(0))


@pytest.fixture(scope="session")
def reaching_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The whole procedural family on disk; its recipe is recipe.toml."""
    folder = tmp_path_factory.mktemp("reaching") / "family"
    write.family(folder)
    return folder


@pytest.fixture(scope="session")
def small_recipe(reaching_folder: Path) -> Recipe:
    """A recipe of every clip of the family at few frames, which trains in a few seconds."""
    whole = recipe.read(reaching_folder / "recipe.toml")
    motion = whole.motion.model_copy(update={"frames": 40})
    return whole.model_copy(update={"motion": motion})


@pytest.fixture(scope="session")
def examples(small_recipe: Recipe, reaching_folder: Path) -> list[Example]:
    """The family's clips, every second one."""
    return ingest.ingest(small_recipe, reaching_folder)[0][::2]


@pytest.fixture(scope="session")
def trained(small_recipe: Recipe, examples: list[Example]) -> Trained:
    """A small model of the procedural family."""
    return train.train(small_recipe, examples, lambda _: None)


@pytest.fixture(scope="session")
def exported(small_recipe: Recipe, trained: Trained) -> Exported:
    """The small model with its levels of detail and its file's content."""
    return export.export(small_recipe, trained, [])


@pytest.fixture(scope="session")
def model_path(exported: Exported, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small model as a file, reaching.onnx."""
    path = tmp_path_factory.mktemp("models") / "reaching.onnx"
    path.write_bytes(exported.content)
    return path


@pytest.fixture(scope="session")
def labelled_recipe(small_recipe: Recipe) -> Recipe:
    """The small recipe with its three performers told apart, and little to choose from."""
    told = {"label": "performer", "covariance": "matern52", "drift": 1}
    kriging = small_recipe.kriging.model_copy(update=told)
    return small_recipe.model_copy(update={"kriging": kriging})


@pytest.fixture(scope="session")
def labelled(labelled_recipe: Recipe, examples: list[Example]) -> Trained:
    """A small model of the procedural family that knows its performers."""
    return train.train(labelled_recipe, examples, lambda _: None)


@pytest.fixture(scope="session")
def labelled_exported(labelled_recipe: Recipe, labelled: Trained) -> Exported:
    """The model that knows its performers with its levels of detail and its file's content."""
    return export.export(labelled_recipe, labelled, [])


@pytest.fixture(scope="session")
def labelled_path(labelled_exported: Exported, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model that knows its performers as a file, labelled.onnx."""
    path = tmp_path_factory.mktemp("models") / "labelled.onnx"
    path.write_bytes(labelled_exported.content)
    return path


@pytest.fixture(scope="session")
def strides(tmp_path_factory: pytest.TempPathFactory) -> list[Example]:
    """Strides of the procedural walk."""
    folder = stroll.write(tmp_path_factory.mktemp("strides"))
    return ingest.ingest(stroll.recipe(), folder)[0]


@pytest.fixture(scope="session")
def walk_path(strides: list[Example], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small model of the procedural walk as a file, stroll.onnx."""
    trained = train.train(stroll.recipe(), strides, lambda _: None)
    path = tmp_path_factory.mktemp("walk") / "stroll.onnx"
    path.write_bytes(export.export(stroll.recipe(), trained, []).content)
    return path


@pytest.fixture(scope="session")
def measured_walk_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The procedural walk with its speed and turn measured as a file, measured.onnx."""
    asked = [
        {"name": name, "auto": {"quantity": name}, "description": name}
        for name in ("speed", "turn")
    ]
    own = Recipe.model_validate({**tomllib.loads(stroll.TOML), "controls": asked})
    found, _ = ingest.ingest(own, stroll.write(tmp_path_factory.mktemp("measured")))
    trained = train.train(own, found, lambda _: None)
    path = tmp_path_factory.mktemp("models") / "measured.onnx"
    path.write_bytes(export.export(own, trained, []).content)
    return path


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of the real motion capture: POSEFIELD_DATA, or shared/data beside the checkout."""
    beside = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("POSEFIELD_DATA", beside))
    if not (folder / "hdm05_reach.zip").exists() and not (folder / "hdm05_reach").exists():
        pytest.skip(f"no motion capture in {folder}: set POSEFIELD_DATA")
    return folder


@pytest.fixture
def posefield(monkeypatch, capsys):
    """Function that runs the command in this process; gives exit code, output and errors."""

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["posefield", *map(str, words)])
        capsys.readouterr()
        try:
            cli.main()
            code = 0
        except SystemExit as ending:
            code = ending.code or 0
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


@pytest.fixture(scope="session")
def models(labelled_path, walk_path, tmp_path_factory) -> Path:
    """Folder with models under the names that the examples use: one that knows performers, and one
    of a gait."""
    folder = tmp_path_factory.mktemp("models")
    shutil.copy(labelled_path, folder / "reach.onnx")
    shutil.copy(walk_path, folder / "walk.onnx")
    return folder
