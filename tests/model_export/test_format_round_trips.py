"""Theorem: one performance is the same in every format, and so are the models trained of it."""

from dataclasses import replace

import numpy as np
import pytest
from exported_clips import FORMATS, encoded
from fixture_models import RECIPES, strides_folder

from posefield_train import training
from posefield_train.source import ingest, motion_file, motion_readers

SAME = 1e-5
"""Largest distance of a joint between formats, m: single precision in a chain of joints."""
SAME_MODEL = 5e-5
"""Largest distance of a joint between models, m; 0.0005 m is asked for."""


@pytest.fixture(scope="module")
def whole(examples):
    """Motions of the family with everything that files hold, by their table's rows."""
    return [example.clip for example in examples[:3]]


def reread(folder, clip, ending):
    path = folder / f"a.{ending}"
    path.write_bytes(encoded(clip, ending))
    said = FORMATS[ending]
    file = motion_readers.read(path)
    return motion_file.to_clip(file, metres_per_unit=said.metres_per_unit, up=said.up)


def gap(found, clip):
    """Largest distance of a joint from that of the same name, m."""
    order = [found.skeleton.names.index(name) for name in clip.skeleton.names]
    return np.abs(found.positions()[:, order] - clip.positions()).max()


@pytest.mark.parametrize("ending", FORMATS)
def test_a_performance_is_the_same_in_every_format(tmp_path, whole, ending):
    for clip in whole:
        found = reread(tmp_path, clip, ending)
        assert found.rate == clip.rate and len(found) == len(clip)
        assert gap(found, clip) < SAME
        assert found.skeleton.same_tree(clip.skeleton)
        assert np.abs(found.skeleton.offsets[1:] - clip.translations[0, 1:]).max() < SAME
        moved = replace(clip, translations=clip.translations + 2 * SAME)
        assert gap(found, moved) > SAME


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    """Models of the procedural walk, trained of files in each of three formats."""
    source, recipe = strides_folder(), RECIPES["stroll"]()
    found = {}
    for ending in ("bvh", "usda", "glb"):
        folder = tmp_path_factory.mktemp(ending)
        for path in sorted(source.glob("*.bvh")):
            file = motion_readers.read(path)
            clip = motion_file.to_clip(file, metres_per_unit=1.0, up="y")
            (folder / f"{path.stem}.{ending}").write_bytes(encoded(clip, ending))
        table = (source / "strides.csv").read_text().replace(".bvh", f".{ending}")
        (folder / "strides.csv").write_text(table)
        examples, _ = ingest.ingest(recipe, folder)
        found[ending] = training.train_examples(recipe, examples)
    return found


def answers(model):
    """Joint positions at points between the samples, by the model's own ranges."""
    rng = np.random.default_rng(3)
    controls = np.stack([example.controls for example in model.examples])
    low, high = controls.min(axis=0), controls.max(axis=0)
    points = rng.uniform(low, high, (50, len(low)))
    times = np.tile(np.linspace(0.0, 0.8, 20), (50, 1))
    return model.model.evaluate(points, times).positions(model.skeleton.parents)


@pytest.mark.parametrize("ending", ["usda", "glb"])
def test_training_of_other_formats_gives_the_same_model(models, ending):
    usual, other = answers(models["bvh"]), answers(models[ending])
    assert np.abs(usual - other).max() < SAME_MODEL
    assert np.abs(usual - usual[:, ::-1]).max() > 100 * SAME_MODEL
