"""Clips of models that are trained for the purpose: the procedural family and the real recipes."""

import os
import tempfile
from pathlib import Path

from model_export import export, ingest, recipe, train
from model_export.sample import write
from service.motion.answer import ClipAnswer
from service.synthesis import session
from service.synthesis.question import ClipQuestion
from service.synthesis.synthesizer import Synthesizer

ROOT = Path(__file__).parents[2]
RECIPES = sorted((ROOT / "model_export/recipes").glob("*.toml"))
DATA = Path(os.environ.get("POSEFIELD_DATA", ROOT.parent / "shared/data"))


def answers() -> list[tuple[str, ClipAnswer]]:
    """A clip in the middle of the controls' ranges of each model, by the model's name."""
    with tempfile.TemporaryDirectory() as name:
        family = write.family(Path(name) / "reaching")
        made = [_answer(family, family.parent)]
    # .ci/run looks for these words: there the real clips must not be missing.
    if not DATA.exists():
        print(f"no motion capture in {DATA}: set POSEFIELD_DATA")
        return made
    return made + [_answer(path, DATA) for path in RECIPES]


def _answer(path: Path, data: Path) -> tuple[str, ClipAnswer]:
    own = recipe.read(path)
    examples, notes = ingest.ingest(own, data)
    trained = train.train(own, examples, lambda _: None)
    exported = export.export(own, trained, notes)
    model = Synthesizer(own.name, session.open_bytes(exported.content, own.name))
    controls = {control.name: control.default for control in exported.card.controls}
    return own.name, model.clip(ClipQuestion(controls, 30.0, "refuse"))
