"""Tests of reopening a model file without its data: equal to the trained model."""

import json
from dataclasses import replace

import numpy as np
import onnx
import pytest
from model_files import written

from posefield.common.errors import ModelError
from posefield_train.adapt import canonical_clips, model_reconstruction
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.kriging_bank import ConstantModel

# What float32 may cost, m.
SAME = 1e-5


@pytest.fixture(scope="module")
def content(labelled_path):
    return labelled_path.read_bytes()


@pytest.fixture(scope="module")
def reopened(content):
    return model_reconstruction.reconstruct(content, "labelled.onnx")


def asked(model, count=200):
    """Return controls, times and labels within the samples' ranges; some without a performer."""
    rng = np.random.Generator(np.random.PCG64(8))
    controls = rng.uniform(model.bank.low, model.bank.high, (count, len(model.bank.low)))
    performers = model.bank.label_count
    labels = np.eye(performers + 1, performers)[rng.integers(0, performers + 1, count)]
    return controls, rng.uniform(0.0, 1.2, (count, 3)), labels


def farthest(one, other, parents):
    """Largest distance between the joints of two models' answers to the same questions, m."""
    question = asked(one)
    own, its = (model.evaluate(*question).positions(parents) for model in (one, other))
    return float(np.linalg.norm(own - its, axis=-1).max())


def test_a_reopened_model_answers_as_the_trained_one(labelled_exported, reopened):
    trained, own = labelled_exported.model, reopened.adaptable
    parents = own.skeleton.parents
    assert farthest(trained, own.model, parents) < SAME
    question = asked(trained)
    expected, found = trained.evaluate(*question), own.model.evaluate(*question)
    assert np.abs(found.sigma / expected.sigma - 1.0).max() < 1e-4
    assert np.abs(found.duration / expected.duration - 1.0).max() < 1e-6
    assert np.abs(trained.timing.correction).max() > 0.01
    assert np.abs(own.model.timing.correction - trained.timing.correction).max() < 1e-6
    # Negative control: one sample of one clip, moved by a hundredth of what samples differ by.
    bank, reduced = own.model.bank, own.model.decoder.reduced
    values = reduced.bases[2].copy()
    values[3] += 0.01 * np.ptp(values, axis=0)
    pose = universal_kriging.solve(bank.pose.hyper, bank.pose.samples, values)
    other = replace(own.model, bank=replace(bank, pose=pose))
    assert farthest(trained, other, parents) > 10 * SAME


def test_what_the_fields_were_laid_through_comes_back(labelled, reopened):
    """Dual weights alone do not tell: a wrong nugget answers alike everywhere but there."""
    bank = reopened.adaptable.model.bank
    for name, field in bank.other_models.items():
        # Values of a quantity that the controls explain in part are shrunk to their mean.
        expected = labelled.model.bank.sample_values(name)
        scale = np.ptp(expected, axis=0).max()
        assert np.abs(bank.sample_values(name) - expected).max() < 1e-4 * scale
        assert isinstance(field, ConstantModel) == (name not in reopened.card.making.fields)
    fields = {n: (3.0 * v[0], *v[1:]) for n, v in reopened.card.making.fields.items()}
    wrong = wrong_nuggets(reopened, fields)
    known = labelled.model.bank
    gaps = [np.abs(wrong[name] - known.sample_values(name)).max() for name in fields]
    assert max(gaps) > 1e-3


def wrong_nuggets(reopened, fields):
    """Values at the samples that would come of other nuggets."""
    bank = reopened.adaptable.model.bank
    found = {}
    for name in fields:
        field = bank.other_models[name]
        hyper = replace(field.hyper, nugget=fields[name][0])
        found[name] = universal_kriging.values(hyper, field.samples, field.dual)
    return found


def test_what_is_known_is_what_training_knows(labelled_recipe, labelled, reopened):
    expected, found = canonical_clips.adaptable(labelled), reopened.adaptable
    assert np.array_equal(found.joint_weights, expected.joint_weights)
    assert np.array_equal(found.groups, expected.groups)
    assert found.truncation == pytest.approx(expected.truncation, rel=1e-3)
    assert (found.in_phase, found.in_place) == (expected.in_phase, expected.in_place)
    assert len(found.landmarks) == 0


def rewritten(content, change):
    """The file with its metadata changed."""
    model = onnx.load_from_string(content)
    entries = {p.key: p.value for p in model.metadata_props}
    change(entries)
    for entry in model.metadata_props:
        entry.value = entries[entry.key]
    return written(model)


def test_a_field_whose_making_is_missing_is_named(content):
    def change(entries):
        entries["posefield.making"] = entries["posefield.making"].replace("warp", "woof")

    with pytest.raises(ModelError, match="does not say what its field 'warp' is made with"):
        model_reconstruction.reconstruct(rewritten(content, change), "odd.onnx")


def test_a_card_of_another_graph_is_refused(content):
    def change(entries):
        examples = json.loads(entries["posefield.examples"])
        # The range stays, and so does the median.
        hip_heights = sorted(example[1] for example in examples)
        other = next(example for example in examples if example[1] == hip_heights[-2])
        other[1] = 0.5 * (hip_heights[-3] + hip_heights[-2])
        entries["posefield.examples"] = json.dumps(examples)

    with pytest.raises(ModelError, match="lists other samples than its graph holds"):
        model_reconstruction.reconstruct(rewritten(content, change), "odd.onnx")
