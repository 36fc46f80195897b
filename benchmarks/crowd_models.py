"""Models that crowds are measured with, open as the service has them."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory

from family import Family
from threadpoolctl import threadpool_limits

from model_export import export, ingest, recipe, train
from model_export.recipe import Recipe
from model_export.sample import stroll
from service.synthesis import session
from service.synthesis.synthesizer import Synthesizer
from service.synthesis.walk import gait
from service.synthesis.walk.gait import Gait

WALK = Path(recipe.__file__).parent / "recipes" / "cmu_walk.toml"
BESIDE = Path(__file__).parents[2] / "shared" / "data"


def reaching(made: Family) -> Synthesizer:
    """The procedural family's model."""
    return Synthesizer("reaching", session.open_bytes(made.exported.content, "reaching.onnx"))


def walks() -> dict[str, Gait]:
    """The procedural walk, and that of the motion capture where it is present."""
    with TemporaryDirectory() as folder:
        found = {"procedural walk": _walk(stroll.recipe(), stroll.write(Path(folder)))}
    data = Path(os.environ.get("POSEFIELD_DATA", BESIDE))
    if (data / "cmu_walk.zip").exists() or (data / "cmu_walk").exists():
        found["CMU walk"] = _walk(recipe.read(WALK), data)
    return found


def _walk(own: Recipe, folder: Path) -> Gait:
    with threadpool_limits(limits=1):
        examples, notes = ingest.ingest(own, folder)
        trained = train.train(own, examples, lambda _: None)
        content = export.export(own, trained, notes).content
    return gait.of(session.open_bytes(content, f"{own.name}.onnx"))
