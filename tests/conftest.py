"""Shared fixtures: random numbers with a fixed seed, and small trained models.

Heavy modules are imported in the fixtures that need them, so that other tests start fast.
"""

from __future__ import annotations

import os
import shutil
import sys
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import shape_checks

if TYPE_CHECKING:
    import numpy as np

    from posefield_train.graph.onnx_export import ExportedModel
    from posefield_train.graph.trained_model import TrainedModel
    from posefield_train.source.ingest import Example
    from posefield_train.source.recipe import Recipe

# Before any module of the project is imported.
shape_checks.install()

# Coverage measures pytest-xdist's workers, but not their child processes: some of these are killed
# while they would write their data.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.pop("COVERAGE_PROCESS_CONFIG", None)

SLOW = {"address", "full_family", "real_data", "store"}
"""Fixtures whose tests belong to the system ring: a service, the training of the whole family as a
command, real motion capture, and an object store."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that samples the tests."""
    parser.addoption(
        "--tenth", action="store_true", help="run a tenth of the tests, always the same"
    )


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests of the slow fixtures as `system`, before pytest selects by mark."""
    for item in items:
        if SLOW.intersection(getattr(item, "fixturenames", ())):
            item.add_marker(pytest.mark.system)
    if config.getoption("--tenth"):
        # By a checksum of their names, so that every machine and every run takes the same ones.
        items[:] = [item for item in items if zlib.crc32(item.nodeid.encode()) % 10 == 0]


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """Check array shapes in the first calls of each function of the test that begins."""
    shape_checks.begin_test()


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> Iterator[str]:
    """Yield the address of an object store's server."""
    import stores

    with stores.serving(tmp_path_factory.mktemp("store") / "said") as address:
        yield address


@pytest.fixture
def store_environment(store, monkeypatch) -> None:
    """Set the environment variables of the store's address and credentials."""
    import stores

    for name, value in stores.told(store).items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def rng() -> np.random.Generator:
    """Return a random number generator with a fixed seed."""
    import numpy as np

    return np.random.Generator(np.random.PCG64(0))


@pytest.fixture(scope="session")
def dist(tmp_path_factory) -> Path:
    """Return a folder with the wheels and sdists of this checkout."""
    import wheels

    folder: Path = tmp_path_factory.mktemp("dist")
    wheels.build(folder)
    return folder


@pytest.fixture(scope="session")
def models_trained():
    """Return the module `fixture_models`, which imports the training packages."""
    import fixture_models

    return fixture_models


@pytest.fixture(scope="session")
def reaching_folder(models_trained) -> Path:
    """Return the folder of the whole procedural family; its recipe is recipe.toml."""
    return models_trained.family()


@pytest.fixture(scope="session")
def small_recipe(models_trained) -> Recipe:
    """Return a recipe of all clips of the family with few frames; it trains in seconds."""
    return models_trained.small_recipe()


@pytest.fixture(scope="session")
def examples(models_trained) -> list[Example]:
    """Return every second clip of the family."""
    return models_trained.examples("reaching")


@pytest.fixture(scope="session")
def trained(models_trained) -> TrainedModel:
    """Return a small model of the procedural family."""
    return models_trained.trained("reaching")


@pytest.fixture(scope="session")
def exported(models_trained) -> ExportedModel:
    """Return the small model with its levels of detail and the content of its file."""
    return models_trained.exported("reaching")


@pytest.fixture(scope="session")
def model_file(tmp_path_factory) -> Callable[[str], Path]:
    """Return a function from the name of a trained model to a copy of its file."""

    def copied(name: str) -> Path:
        import fixture_cache

        path = tmp_path_factory.mktemp("models") / f"{name}.onnx"
        shutil.copy(fixture_cache.model(name), path)
        return path

    return copied


@pytest.fixture(scope="session")
def model_path(model_file) -> Path:
    """Return the path of the small model's file, reaching.onnx."""
    return model_file("reaching")


@pytest.fixture(scope="session")
def labelled_recipe(models_trained) -> Recipe:
    """Return the small recipe with its three performers as labels, and one kernel to fit."""
    return models_trained.labelled_recipe()


@pytest.fixture(scope="session")
def labelled(models_trained) -> TrainedModel:
    """Return a small model of the procedural family with performers."""
    return models_trained.trained("labelled")


@pytest.fixture(scope="session")
def labelled_exported(models_trained) -> ExportedModel:
    """Return the model with performers, its levels of detail and the content of its file."""
    return models_trained.exported("labelled")


@pytest.fixture(scope="session")
def labelled_path(model_file) -> Path:
    """Return the path of the file of the model with performers, labelled.onnx."""
    return model_file("labelled")


@pytest.fixture(scope="session")
def strides(models_trained) -> list[Example]:
    """Return strides of the procedural walk."""
    return models_trained.examples("stroll")


@pytest.fixture(scope="session")
def walk_path(model_file) -> Path:
    """Return the path of a small model of the procedural walk, stroll.onnx."""
    return model_file("stroll")


@pytest.fixture(scope="session")
def measured_walk_path(model_file) -> Path:
    """Return the path of a model of the walk with measured speed and turn, measured.onnx."""
    return model_file("measured")


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Return the folder of real motion capture: POSEFIELD_DATA, or shared/data beside the checkout.

    Skips the test if the folder has no data.
    """
    beside = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("POSEFIELD_DATA", beside))
    if not (folder / "hdm05_reach.zip").exists() and not (folder / "hdm05_reach").exists():
        pytest.skip(f"no motion capture in {folder}: set POSEFIELD_DATA")
    return folder


@pytest.fixture
def posefield(monkeypatch, capsys):
    """Return a function that runs `posefield` here, and returns exit code, output and errors."""

    def run(*words):
        from posefield import cli

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
def styled_path(model_file) -> Path:
    """Return the path of the file of the walk with performers and styles, styled.onnx."""
    return model_file("styled")


@pytest.fixture(scope="session")
def models(labelled_path, walk_path, tmp_path_factory) -> Path:
    """Return a folder with the models of the examples: reach, with performers, and walk, a gait."""
    folder = tmp_path_factory.mktemp("models")
    shutil.copy(labelled_path, folder / "reach.onnx")
    shutil.copy(walk_path, folder / "walk.onnx")
    return folder


@pytest.fixture(scope="session")
def shipped_walk():
    """The shipped model of walks, whose skeleton has roles."""
    from posefield.registry import model_registry

    return model_registry.with_shipped([]).find("cmu_walk")
