"""The procedural family at the paper's size, trained once for all rows."""

import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from model_export import export, ingest, recipe, train
from model_export.export import Exported
from model_export.ingest import Example
from model_export.sample import write
from model_export.train import Trained
from service.motion.conventions import Floats


@dataclass(frozen=True)
class Family:
    """vectors (N, T, 3 + 3 J): pose vectors of the aligned clips, and numbers (N, T, D) those of
    them that vary; offsets (N, J, 3); seconds that training took."""

    examples: list[Example]
    trained: Trained
    exported: Exported
    vectors: Floats
    numbers: Floats
    offsets: Floats
    seconds: float

    @property
    def parents(self) -> tuple[int, ...]:
        """The skeleton's tree."""
        return self.trained.skeleton.parents


def make(folder: Path) -> Family:
    """Family of 92 clips, 100 frames and 94 degrees of freedom, trained by its own recipe."""
    shutil.rmtree(folder, ignore_errors=True)
    path = write.family(folder / "reaching")
    start = time.perf_counter()
    own = recipe.read(path)
    examples, notes = ingest.ingest(own, path.parent)
    trained = train.train(own, examples, lambda _: None)
    exported = export.export(own, trained, notes)
    seconds = time.perf_counter() - start
    offsets = np.stack([example.offsets for example in examples])
    aligned = trained.aligned
    vectors = trained.tensor.chart.numbers(aligned.rotations, aligned.root_path)
    return Family(
        examples,
        trained,
        exported,
        vectors,
        vectors[..., np.ptp(vectors, axis=(0, 1)) > 1e-9],
        offsets,
        seconds,
    )
