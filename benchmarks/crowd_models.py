"""Models that crowds are measured with, open as the service has them."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory

from family import Family
from threadpoolctl import threadpool_limits

from posefield.inference import session
from posefield.locomotion import gait
from posefield.locomotion.gait import Gait
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train import train
from posefield_train.graph import onnx_export
from posefield_train.sample import sample_walk
from posefield_train.source import ingest, recipe, shipped_recipes
from posefield_train.source.recipe import Recipe

WALK = shipped_recipes.FOLDER / "cmu_walk.toml"
BESIDE = Path(__file__).parents[2] / "shared" / "data"


def reaching(made: Family) -> Synthesizer:
    """The procedural family's model."""
    return Synthesizer("reaching", session.open_bytes(made.exported.content, "reaching.onnx"))


def walks() -> dict[str, Gait]:
    """The procedural walk, and that of the motion capture where it is present."""
    with TemporaryDirectory() as folder:
        found = {
            "procedural walk": _walk(sample_walk.recipe(), sample_walk.write_walk(Path(folder)))
        }
    data = Path(os.environ.get("POSEFIELD_DATA", BESIDE))
    if (data / "cmu_walk.zip").exists() or (data / "cmu_walk").exists():
        found["CMU walk"] = _walk(recipe.read(WALK), data)
    return found


def _walk(own: Recipe, folder: Path) -> Gait:
    with threadpool_limits(limits=1):
        examples, notes = ingest.ingest(own, folder)
        trained = train.train(own, examples, lambda _: None)
        content = onnx_export.export_model(own, trained, notes).content
    return gait.fit_gait(session.open_bytes(content, f"{own.name}.onnx"))
