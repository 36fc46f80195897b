"""Clips of trained models: the procedural family and the real recipes."""

import os
import tempfile
from functools import cache
from pathlib import Path

import environment
from families import quadruped_walk, sample_walk

import posefield_train
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.graph import onnx_export
from posefield_train.sample import sample_files
from posefield_train.source import recipe
from posefield_train.source.recipe import Recipe

ROOT = environment.ROOT
RECIPES = sorted((ROOT / "model_export/posefield_train/recipes").glob("*.toml"))
DATA = Path(os.environ.get("POSEFIELD_DATA", ROOT.parent / "shared/data"))


def answers() -> list[tuple[str, ClipAnswer]]:
    """A clip in the middle of the controls' ranges of each model, by the model's name."""
    made = [middle(), _middle(quadruped()[0])]
    # .ci/run looks for these words: there the real clips must not be missing.
    if not DATA.exists():
        print(f"no motion capture in {DATA}: set POSEFIELD_DATA")
        return made
    return made + [_middle(_trained(path, DATA)[0]) for path in RECIPES]


def middle() -> tuple[str, ClipAnswer]:
    """Clip in the middle of the procedural family, by the model's name."""
    return _middle(family()[0])


@cache
def family() -> tuple[Synthesizer, bytes]:
    """Model of the procedural family, and its file's content."""
    with tempfile.TemporaryDirectory() as name:
        path = sample_files.write_family(Path(name) / "reaching")
        return _trained(path, path.parent)


@cache
def quadruped() -> tuple[Synthesizer, bytes]:
    """Model of the procedural quadruped, and its file's content."""
    with tempfile.TemporaryDirectory() as folder:
        path = sample_files.write_folder(Path(folder) / "quadruped", quadruped_walk.files())
        return _trained(path, path.parent)


@cache
def real(name: str) -> bytes | None:
    """File of the model of a recipe for real motion; None where there is none of it."""
    if not DATA.exists():
        print(f"no motion capture in {DATA}: set POSEFIELD_DATA")
        return None
    return _trained(ROOT / f"model_export/posefield_train/recipes/{name}.toml", DATA)[1]


@cache
def walk() -> bytes:
    """File of the model of the procedural walk."""
    with tempfile.TemporaryDirectory() as name:
        sample_walk.write_walk(Path(name))
        return _of(sample_walk.recipe(), Path(name))[1]


@cache
def styled_walk() -> bytes:
    """File of the model of the procedural walk in several styles."""
    with tempfile.TemporaryDirectory() as name:
        sample_walk.write_styled_walk(Path(name))
        return _of(sample_walk.styled_recipe(), Path(name))[1]


@cache
def _trained(path: Path, data: Path) -> tuple[Synthesizer, bytes]:
    return _of(recipe.read(path), data)


def _of(own: Recipe, data: Path) -> tuple[Synthesizer, bytes]:
    exported = onnx_export.export_model(posefield_train.train(own, data))
    model = Synthesizer(own.name, session.open_bytes(exported.content, own.name))
    return model, exported.content


def _middle(model: Synthesizer) -> tuple[str, ClipAnswer]:
    controls = {control.name: control.default for control in model.session.card.controls}
    return model.name, clips.synthesize_clip(
        model, ClipQuestion(controls=controls, fps=30.0, extrapolate="refuse")
    )
