"""Trained models of the fixtures, each built once and cached by `fixture_cache`."""

import csv
import functools
import re
import tomllib
import zlib
from pathlib import Path

import fixture_cache
import numpy as np
from families import face_files, sample_walk

import posefield_train
from posefield.common.units import Floats
from posefield_train import training
from posefield_train.graph import onnx_export
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.sample import sample_files
from posefield_train.source import data_folder, ingest, recipe
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe


def family() -> Path:
    """Return the folder of the whole procedural family; its recipe is recipe.toml."""
    return fixture_cache.path("family", sample_files.write_family)


@functools.cache
def small_recipe() -> Recipe:
    """Return the recipe of the family at few frames, which trains in a few seconds."""
    whole = recipe.read(family() / "recipe.toml")
    motion = whole.motion.model_copy(update={"frames": 40})
    return whole.model_copy(update={"motion": motion})


@functools.cache
def labelled_recipe() -> Recipe:
    """Return the small recipe with its three performers told apart, and one kernel to fit."""
    told = {"label": ["performer"], "covariance": "matern52", "drift": 1}
    kriging = small_recipe().kriging.model_copy(update=told)
    return small_recipe().model_copy(update={"kriging": kriging})


@functools.cache
def measured_recipe() -> Recipe:
    """Return the recipe of the procedural walk with its speed and turn measured."""
    measured = [
        {"name": name, "auto": {"quantity": name}, "description": name}
        for name in ("speed", "turn")
    ]
    return Recipe.model_validate({**tomllib.loads(sample_walk.RECIPE_TEXT), "controls": measured})


def face() -> Path:
    """Return the folder of the procedural face; its recipe is recipe.toml."""
    return fixture_cache.path("face", face_files.write_family)


@functools.cache
def face_recipe() -> Recipe:
    """Return the recipe of the procedural face, which trains in a second."""
    return recipe.read(face() / "recipe.toml")


@functools.cache
def curves_recipe() -> Recipe:
    """Return the recipe of the face's curves without its skeleton."""
    whole = face_recipe().model_dump(by_alias=True, exclude_unset=True)
    clips = {**whole["clips"], "file": "curves"}
    alone = {**whole, "name": "curves", "clips": clips, "curves": {"rate": 60.0}}
    return Recipe.model_validate(alone)


@functools.cache
def treading_recipe() -> Recipe:
    """Return the recipe of the procedural walk with the pressure of both soles as curves."""
    whole = tomllib.loads(sample_walk.RECIPE_TEXT)
    curves = {"suffix": ".curves.csv", "range": [0.0, 1.0]}
    return Recipe.model_validate({**whole, "name": "treading", "curves": curves})


RECIPES = {
    "treading": treading_recipe,
    "reaching": small_recipe,
    "labelled": labelled_recipe,
    "stroll": sample_walk.recipe,
    "measured": measured_recipe,
    "styled": sample_walk.styled_recipe,
    "face": face_recipe,
    "curves": curves_recipe,
}


def strides_folder() -> Path:
    """Return the folder of the procedural walk's strides and the table strides.csv."""
    return fixture_cache.path("strides", _write_strides)


@functools.cache
def reaches() -> list[Example]:
    """Return every second clip of the family."""
    return fixture_cache.value("reaches", lambda: ingest.ingest(small_recipe(), family())[0][::2])


def examples(model: str) -> list[Example]:
    """Return the clips that a model is trained on."""
    if model in ("reaching", "labelled"):
        return reaches()
    if model in ("face", "curves"):
        return ingest.ingest(RECIPES[model](), face())[0]
    folder = styled_folder() if model == "styled" else strides_folder()
    return ingest.ingest(RECIPES[model](), folder)[0]


@functools.cache
def trained(model: str) -> TrainedModel:
    """Return a small model, trained."""
    return fixture_cache.value(
        f"{model}-trained",
        lambda: training.train_examples(RECIPES[model](), examples(model)),
    )


@functools.cache
def exported(model: str) -> ExportedModel:
    """Return a small model with its levels of detail and the content of its file."""
    return fixture_cache.value(
        f"{model}-exported", lambda: onnx_export.export_model(trained(model))
    )


def captured(name: str, data: Path) -> tuple[Recipe, TrainedModel, ExportedModel]:
    """Return a shipped recipe, and what its training makes of motion capture in a folder."""
    own = recipe.read(data_folder.RECIPES / f"{name}.toml")

    def build() -> tuple[TrainedModel, ExportedModel]:
        made = posefield_train.train(own, data)
        return made, onnx_export.export_model(made)

    place = zlib.crc32(str(data.resolve()).encode())
    return own, *fixture_cache.value(f"{name}-{place}", build)


def styled_folder() -> Path:
    """Return the folder of the strides in several styles and the table strides.csv."""
    return fixture_cache.path("styles", _write_styles)


def _write_styles(folder: Path) -> None:
    folder.mkdir()
    sample_walk.write_styled_walk(folder)


def _write_strides(folder: Path) -> None:
    folder.mkdir()
    sample_walk.write_walk(folder)
    with (folder / "strides.csv").open(newline="") as table:
        for row in csv.DictReader(table):
            _write_soles(folder / row["file"], float(row["haste"]) / 3.6)


SOLES = {"soleLeft": 0.3, "soleRight": 0.8}
"""Curves of the procedural walk: the phase of the stride at which each sole presses most."""


def sole_pressure(phases: Floats, speed: float) -> Floats:
    """Return the pressure (F, 2) of both soles at phases (F,) of a stride at a speed, m/s."""
    peaks = np.array(list(SOLES.values()))
    return (0.1 + 0.4 * speed / 1.5) * (1.0 + np.cos(2.0 * np.pi * (phases[:, None] - peaks)))


def _write_soles(motion: Path, speed: float) -> None:
    """Write the curves of a stride beside its motion file."""
    frames = int(re.search(r"Frames: (\d+)", motion.read_text())[1])
    values = sole_pressure(np.linspace(0.0, 1.0, frames), speed)
    lines = [f"frame,{','.join(SOLES)}"]
    lines += [f"{frame},{left:.6f},{right:.6f}" for frame, (left, right) in enumerate(values)]
    motion.with_suffix(".curves.csv").write_text("\n".join(lines) + "\n")
