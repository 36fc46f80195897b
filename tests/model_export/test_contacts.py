"""Contacts of a model: labels, their kriging with the weights of the pose, and the graph."""

from dataclasses import replace

import numpy as np
import pytest
from families import sample_walk

from posefield.common.errors import ExportRefused, ModelError
from posefield.inference import onnx_runtime, session
from posefield.inference.onnx_runtime import CONTACTS
from posefield.kriging import kriging_model
from posefield.model_file import model_card
from posefield_train.contacts import contact_labels, contact_model
from posefield_train.graph import onnx_export

# The graph computes in float32; a label rises within one canonical frame.
SINGLE = 1e-4


@pytest.fixture(scope="module")
def walk(models_trained):
    return models_trained.trained("stroll")


@pytest.fixture(scope="module")
def walk_exported(models_trained):
    return models_trained.exported("stroll")


@pytest.fixture(scope="module")
def opened(walk_exported):
    return session.open_bytes(walk_exported.content, "stroll")


@pytest.fixture(scope="module")
def labels(walk, models_trained):
    """Labels (N, T, K) of the strides."""
    asked = contact_labels.settings(models_trained.RECIPES["stroll"](), walk.skeleton.names)
    clips = [contact_labels.clip_contacts(example, asked) for example in walk.examples]
    timing = walk.model.timing
    return contact_labels.canonical_labels(clips, walk.aligned.logs, timing.basis, timing.frames)


def questions(card, count=200):
    """Controls, times and labels at random, some beyond the sampled ranges."""
    rng = np.random.default_rng(5)
    low, high = card.sampled_ranges
    points = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (count, len(low)))
    named = sum(card.label_counts)
    weights = np.eye(named + 1, named)[rng.integers(0, named + 1, count)]
    return points, rng.uniform(0.0, card.durations[0], (count, 4)), weights


def test_the_stance_of_a_procedural_walk_is_labelled_as_contact(labels, walk):
    """Its feet stand for STANCE of a stride, each from the phase at which it lands."""
    phases = np.linspace(0.0, 1.0, labels.shape[1])
    for foot, (_, landing) in enumerate(sample_walk.SIDES.values()):
        since = (phases - landing) % 1.0
        inside = (since > 0.05) & (since < sample_walk.STANCE - 0.05)
        outside = (since > sample_walk.STANCE + 0.08) & (since < 0.92)
        assert labels[:, inside, foot].mean() > 0.99
        assert labels[:, outside, foot].mean() < 0.01
    assert np.array_equal(labels[:, 0], labels[:, -1])


def test_the_statistics_are_those_of_the_walk(walk):
    """A swing lasts 0.4 of a stride of 0.7 to 1.1 s and lifts the foot by 8 cm."""
    for own in walk.contacts.statistics:
        assert own.height == pytest.approx(sample_walk.ANKLE, abs=0.01)
        # A swing that begins and ends gently is in contact for a few frames at both ends.
        swings = (1.0 - sample_walk.STANCE) * walk.aligned.durations
        assert 0.7 * np.median(swings) < own.swing < np.median(swings)
        assert own.swing <= own.longest_swing <= swings.max() + 0.05
        assert own.clearance == pytest.approx(0.08, abs=0.02)


def test_kriged_contacts_are_the_weighted_sum_of_the_clips_labels(walk):
    """Indicator kriging: the weights are those that the poses have."""
    model, pose = walk.model, walk.model.bank.pose
    points = np.array([[0.3, -0.2, 1.0, 0.0], [-0.8, 0.5, 0.0, 0.0]])
    place = np.tile(np.linspace(0.0, model.timing.frames - 1.0, model.timing.frames), (2, 1))
    found = model.contacts.numpy(model.bank.contacts.predict(points), place)
    known = model.contacts.labels(model.bank.contacts.values)
    expected = np.einsum("bn,ntk->btk", pose.weights(points), known)
    assert np.abs(found - np.clip(expected, 0.0, 1.0)).max() < 1e-9
    poses = pose.weights(points) @ pose.values
    assert np.abs(poses - pose.predict(points)).max() < 1e-9
    # Negative control: weights of another point.
    other = np.einsum("bn,ntk->btk", pose.weights(points[::-1]), known)
    assert np.abs(found - np.clip(other, 0.0, 1.0)).max() > 0.05


def test_the_graph_computes_the_contacts_of_the_reference(walk_exported, opened):
    points, times, weights = questions(opened.card)
    inside = opened.bounds.limit(points)
    for level in range(len(opened.card.levels)):
        expected = walk_exported.model.evaluate(inside, times, weights, level).contacts
        (found,) = opened.run(inside, times, CONTACTS, labels=weights, level=level)
        assert found.shape == (*times.shape, 2)
        assert np.abs(found - expected).max() < SINGLE
        assert np.abs(found[::-1] - expected).max() > 0.5


def test_contacts_are_probabilities_beyond_the_sampled_ranges_too(opened):
    points, times, weights = questions(opened.card)
    assert not opened.bounds.is_inside(points)
    names = ("sigma", CONTACTS, "rotations", "duration")
    sigma, found, rotations, duration = opened.run(points, times, *names, labels=weights)
    assert found.shape == (*times.shape, 2) and found.min() >= 0.0 and found.max() <= 1.0
    alone = opened.run(points, times, CONTACTS, labels=weights)[0]
    assert np.array_equal(alone, found)
    others = opened.run(points, times, "sigma", "rotations", "duration", labels=weights)
    for one, other in zip((sigma, rotations, duration), others, strict=True):
        assert np.array_equal(one, other)


def test_left_out_clips_agree_with_their_labels(walk, labels):
    accuracy = walk.contacts.accuracy
    assert accuracy.agreement > 0.97
    assert accuracy.brier < 0.03
    pose, samples = walk.pose.hyper, walk.samples
    left_out = kriging_model.leave_out(pose, samples.points, samples.groups)
    rows = labels.reshape(len(labels), -1)
    straight = [
        1.0 - np.mean((np.clip(rows - left_out @ rows, 0, 1)[i] > 0.5) != rows[i])
        for i in range(len(rows))
    ]
    found = contact_model.left_out_accuracy(labels, labels, pose, samples)
    assert found.agreement == pytest.approx(np.mean(straight))
    # Negative control: labels of other clips agree less.
    mixed = contact_model.left_out_accuracy(np.roll(labels, 9, axis=1), labels, pose, samples)
    assert mixed.agreement < found.agreement - 0.1 and mixed.brier > 2 * found.brier


def test_the_parity_check_refuses_wrong_contacts(walk_exported):
    model, card = walk_exported.model, walk_exported.card
    content = model.onnx(model_card.dump(card), {})
    wrong = replace(model.contacts, values=1.01 * model.contacts.values)
    with pytest.raises(ExportRefused, match="probability of a contact"):
        onnx_export.check_parity(replace(model, contacts=wrong), content, card)


def test_a_card_with_contacts_needs_a_graph_with_them(walk_exported, opened):
    model = walk_exported.model
    bare = replace(model, contacts=None, bank=replace(model.bank, contacts=None))
    with pytest.raises(ModelError, match="constant 'contact_weights' has shape"):
        session.open_bytes(bare.onnx(model_card.dump(walk_exported.card), {}), "odd.onnx")
    # A file as version 0.2.0 wrote it, which lacks both, is served without contacts.
    card = replace(walk_exported.card, contacts=())
    old = session.open_bytes(bare.onnx(model_card.dump(card), {}), "old.onnx")
    points, times, weights = questions(card)
    names = onnx_runtime.outputs(card)
    answers = (one.run(points, times, *names, labels=weights, level=2) for one in (opened, old))
    for own, other in zip(*answers, strict=True):
        assert np.array_equal(own, other)
    assert old.run_trial() == opened.run_trial()
