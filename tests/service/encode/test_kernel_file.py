"""Tests of the kernel table: a valid file from which the answers of the model can be computed."""

import json
from pathlib import Path

import numpy as np
import pytest

from posefield.encode import kernel_file
from posefield.inference import session
from posefield.motion import quat, skeleton
from posefield.motion.rotation_charts import CHARTS

SHIPPED = Path(session.__file__).parents[1] / "shipped"
QUESTIONS = 40
# Metres that a joint may be away from the service's.
PLACES = 1e-4
CORRELATIONS = {
    "gaussian": lambda s, a: np.exp(-s),
    "matern52": lambda s, a: (1.0 + a + s / 3.0) * np.exp(-a),
}


@pytest.fixture(scope="module", params=["cmu_walk", "reaching"])
def own(request):
    """A shipped model."""
    return session.load(SHIPPED / f"{request.param}.onnx")


@pytest.fixture
def content(own):
    """Its kernel table."""
    return kernel_file.kernel_table(own.content, own.card, "model@0")


def parsed(content):
    """Return the arrays, the facts and the places of a safetensors file, read by its rules."""
    size = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + size])
    facts = header.pop("__metadata__")
    data = content[8 + size :]
    arrays, places = {}, []
    for name, each in header.items():
        assert each["dtype"] == "F32"
        start, end = each["data_offsets"]
        places.append((start, end))
        arrays[name] = np.frombuffer(data[start:end], "<f4").reshape(each["shape"]).astype(float)
    return arrays, facts, [(8 + size) % 8, places, len(data)]


def basis(table, facts, controls, labels):
    """Return labels, one, scaled controls and covariances (N, p + 1 + d + n)."""
    scaled = table["control_gain"] * controls + table["control_shift"]
    apart = (table["control_scales"] * scaled)[:, :, None] - table["samples"]
    squared = np.sum(np.square(apart), axis=1)
    near = CORRELATIONS[facts["covariance"]](squared, np.sqrt(squared))
    sets = table.get("label_correlations", []), table.get("label_samples", [])
    for kept, whose in zip(*sets, strict=True):
        near = near * (kept + (1.0 - kept) * labels[:, whose.astype(int)])
    return np.hstack([labels, np.ones((len(controls), 1)), scaled, near])


def positions(own, table, facts, level, asked):
    """Return joint positions (N, J, 3) as the kernel computes them, in float64.

    asked: controls (N, d), weights of labels (N, p), shares of the clip (N,).
    """
    controls, labels, shares = asked
    weights, pose = table[f"weights_{level}"], table[f"pose_{level}"]
    values = basis(table, facts, controls, labels)[:, : len(weights)] @ weights
    widths = [3 * (facts["cyclic"] == "true"), len(table["offset_directions"]), 1]
    ends = np.cumsum([*widths, len(table["warp_still"])])
    travel, bones, _, logs, coefficients = np.split(values, ends, axis=1)
    increments = np.exp(logs + table["warp_still"])
    increments /= increments.sum(axis=1, keepdims=True)
    hinges = np.maximum(shares[:, None] - table["warp_breaks"], 0.0)
    powers = np.hstack([hinges[:, :1], hinges[:, 1:2] ** 2, hinges[:, 2:] ** 3])
    frames = np.sum(powers * (increments @ table["warp_form"].T), axis=1)
    time = table[f"time_{level}"]
    rows = np.array([[np.interp(f, np.arange(len(time)), c) for c in time.T] for f in frames])
    motion = (coefficients @ table[f"core_{level}"]).reshape(len(rows), time.shape[1], -1)
    numbers = pose[0] + np.einsum("nj,nji->ni", rows, motion) @ pose[1:]
    products = numbers[:, 3:].reshape(len(rows), -1, 4)
    squares = np.sum(np.square(products), axis=2, keepdims=True)
    real, factor = CHARTS[facts["chart"]].terms(squares)
    rotations = table["mean_rotations"] * real + products * factor
    offsets = table["offset_mean"] + bones @ table["offset_directions"]
    offsets = offsets.reshape(len(rows), -1, 3)
    offsets[:, 0] = numbers[:, :3]
    if travel.size:
        gone = (frames / (len(time) - 1))[:, None] * travel
        offsets[:, 0] += gone[:, :2] @ np.eye(3)[[0, 2]]
        turn = quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), gone[:, 2])
        rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    return skeleton.positions(own.card.skeleton.parents, rotations, offsets)


def questions(own):
    """Return random controls, weights of labels and shares of the clip."""
    random = np.random.default_rng(3)
    controls = random.uniform(*own.card.sampled_ranges, (QUESTIONS, len(own.card.controls)))
    labels = own.card.clip_labels[random.integers(0, len(own.card.examples), QUESTIONS)]
    return controls.astype(np.float32), 0.8 * labels, random.uniform(0.0, 1.0, QUESTIONS)


def answers(own, level, asked):
    """Return joint positions (N, J, 3) of the service's answers."""
    controls, labels, shares = asked
    durations = own.durations(controls, labels=labels, level=level)
    outputs = ("rotations", "root_position", "bone_offsets")
    times = (shares * durations)[:, None]
    found = own.run(controls, times, *outputs, labels=labels, level=level)
    translations = skeleton.translations(found[2], found[1])
    return skeleton.positions(own.card.skeleton.parents, found[0], translations)[:, 0]


@pytest.mark.parametrize("level", range(4))
def test_the_table_gives_the_answers_of_the_model(level, own, content):
    table, facts, _ = parsed(content)
    asked = questions(own)
    expected = answers(own, level, asked)
    assert np.abs(positions(own, table, facts, level, asked) - expected).max() < PLACES
    # Negative control: the pose a hundredth larger.
    pose = 1.01 * table[f"pose_{level}"]
    wrong = positions(own, table | {f"pose_{level}": pose}, facts, level, asked)
    assert np.abs(wrong - expected).max() > PLACES


def test_the_durations_are_those_of_the_model(own, content):
    table, facts, _ = parsed(content)
    controls, labels, _ = questions(own)
    column = 3 * (facts["cyclic"] == "true") + len(table["offset_directions"])
    logs = basis(table, facts, controls, labels) @ table["weights_0"][:, column]
    law = np.log(np.maximum(controls, table["duration_floor"])) @ table["duration_exponents"]
    expected = own.durations(controls, labels=labels)
    np.testing.assert_allclose(np.exp(logs + law), expected, rtol=1e-5)
    # Negative control: logarithms a hundredth larger.
    assert not np.allclose(np.exp(1.01 * (logs + law)), expected, rtol=1e-5)


def test_it_is_a_safetensors_file(own, content):
    arrays, facts, (offset, places, size) = parsed(content)
    assert facts["model"] == "model@0"
    assert facts["covariance"] == own.card.kriging.covariance
    # Arrays follow each other without gaps, and are aligned.
    assert offset == 0
    assert [start for start, _ in places] == [0, *(end for _, end in places[:-1])]
    assert places[-1][1] == size
    assert len(own.card.levels) == sum(name.startswith("weights_") for name in arrays)
    assert content == kernel_file.kernel_table(own.content, own.card, "model@0")


def test_a_table_names_a_constant_that_the_graph_has_not(own):
    with pytest.raises(KeyError, match="squared_scales"):
        kernel_file.arrays({}, own.card)
