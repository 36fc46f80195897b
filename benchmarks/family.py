"""The procedural reaching family at the paper's size, trained once for several benchmarks."""

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import posefield_train
from posefield.common.units import Floats
from posefield_train.graph import onnx_export
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.sample import sample_files
from posefield_train.source import recipe
from posefield_train.source.ingest import Example


@dataclass(frozen=True)
class Family:
    """A trained family of N clips on J joints.

    vectors (N, T, 3 + 3 J): pose vectors of the aligned clips. varies (3 + 3 J,): mask of the
    degrees of freedom that vary. offsets (N, J, 3): bone offsets, m. seconds: training time.
    """

    examples: tuple[Example, ...]
    trained: TrainedModel
    exported: ExportedModel
    vectors: Floats
    varies: Floats
    offsets: Floats
    seconds: float

    @property
    def parents(self) -> tuple[int, ...]:
        """Parent index of each joint."""
        return self.trained.skeleton.parents

    @property
    def samples(self) -> Floats:
        """Controls (N, d) in half-ranges."""
        return self.trained.samples.half_ranges

    @property
    def numbers(self) -> Floats:
        """Pose vectors (N, T, D) of the degrees of freedom that vary."""
        return self.vectors[..., self.varies]


def make(folder: Path) -> Family:
    """Write and train the family of 92 clips, 100 frames and 94 degrees of freedom.

    Training is limited to one thread: the matrices are small, and on a busy machine threads that
    wait for each other take ten times as long.
    """
    path = sample_files.write_family(folder)
    start = time.perf_counter()
    with threadpool_limits(limits=1):
        family_recipe = recipe.read(path)
        trained = posefield_train.train(family_recipe, path.parent)
        exported = onnx_export.export_model(trained)
    return of(trained, exported, time.perf_counter() - start)


def of(trained: TrainedModel, exported: ExportedModel, seconds: float) -> Family:
    """Return the family of a trained and exported model."""
    aligned = trained.aligned
    vectors = trained.tensor.chart.numbers(aligned.rotations, aligned.root_path)
    varies = np.any(trained.tensor.unwhiten != 0.0, axis=1)
    offsets = np.stack([example.offsets for example in trained.examples])
    return Family(trained.examples, trained, exported, vectors, varies, offsets, seconds)
