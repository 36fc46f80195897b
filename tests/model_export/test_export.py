"""Tests of the model file: results of the reference implementation and reproducible bytes."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest

import posefield_train
from posefield import load
from posefield.common.errors import ExportRefused
from posefield.inference import session
from posefield.inference.onnx_runtime import OUTPUTS
from posefield.motion import quat
from posefield_train.graph import onnx_export
from posefield_train.graph.float_model import ModelOutputs

# The gate's figure, m: float32 against float64.
GATE = 1e-4


def posefield(*words, **environment):
    """Run the command in a process of its own."""
    command = str(Path(sys.executable).parent / "posefield")
    done = subprocess.run(
        [command, *map(str, words)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def full_family(reaching_folder, tmp_path_factory):
    """The file that the whole family gives, as the command line trains it, and what it said."""
    path = tmp_path_factory.mktemp("full") / "reaching.onnx"
    words = ("train", reaching_folder / "recipe.toml", "-o", path, "--json")
    return path, json.loads(posefield(*words))


@pytest.fixture(scope="module")
def quick_recipe(reaching_folder, tmp_path_factory):
    """Path of a recipe of one performer at few frames, which trains in a second."""
    text = (reaching_folder / "recipe.toml").read_text()
    text = re.sub(r"(?s)\[presets\..*?\n\n", "", text)
    head, stature, rest = re.split(r"(?s)(\[\[controls\]\]\nname = \"stature\".*?\n\n)", text)
    assert "stature" in stature
    text = (head + rest).replace("frames = 100", "frames = 16").replace("0.5", "2.0")
    condition = '[clips.where]\nperformer = { among = ["middle"] }\n\n[alignment]\nrounds = 0\n\n'
    path = tmp_path_factory.mktemp("quick") / "quick.toml"
    path.write_text(text.replace("[size]", f"{condition}[size]"))
    return path


@pytest.fixture(scope="module")
def opened(model_path):
    return session.load(model_path)


@pytest.fixture(scope="module")
def asked(exported, opened):
    """Controls (B, d) and times (B, S) all over the model, as the graph sees them."""
    rng = np.random.Generator(np.random.PCG64(5))
    low, high = ([getattr(c, end) for c in opened.card.controls] for end in ("minimum", "maximum"))
    points = rng.uniform(low, high, (50, len(low)))
    durations = exported.model.evaluate(points, np.zeros((50, 1))).duration
    times = rng.uniform(0.0, 1.0, (50, 20)) * durations[:, None]
    return points.astype(np.float32).astype(float), times.astype(np.float32).astype(float)


def made_in_this_process(path, folder):
    recipe = posefield_train.read_recipe(path)
    return onnx_export.export_model(posefield_train.train(recipe, folder)).content


def test_a_model_is_trained_and_opened_in_python(quick_recipe, reaching_folder, tmp_path):
    recipe = posefield_train.read_recipe(quick_recipe)
    model = posefield_train.train(recipe, str(reaching_folder))
    exported = posefield_train.export(model, tmp_path / "quick.onnx")
    clip = load(tmp_path / "quick.onnx").clip(turn=20)
    assert clip.clip.skeleton.names == exported.card.skeleton.names and clip.trust.sigma > 0.0
    with pytest.raises(AttributeError, match="no attribute 'learn'"):
        posefield_train.learn(recipe)


@pytest.mark.system
def test_the_same_data_give_the_same_bytes_in_every_process(
    quick_recipe, reaching_folder, tmp_path
):
    made = []
    for seed in ("1", "4242"):
        path = tmp_path / seed / "quick.onnx"
        words = ("train", quick_recipe, "--data", reaching_folder, "-o", path)
        posefield(*words, PYTHONHASHSEED=seed)
        made.append(path.read_bytes())
    here = [made_in_this_process(quick_recipe, reaching_folder) for _ in range(2)]
    assert {*made, *here} == {here[0]}


def test_the_card_holds_nothing_of_when_and_where_it_was_made(full_family, reaching_folder):
    text = full_family[0].read_bytes()
    assert str(reaching_folder).encode() not in text
    assert str(Path.home()).encode() not in text
    assert not re.search(rb"20\d\d-\d\d-\d\d|tmp", text)


def test_the_whole_family_fits_in_150_kb(full_family):
    path, said = full_family
    assert said["clips"] == 92
    assert said["bytes"] == path.stat().st_size < 150_000
    # Negative control: what is stored without truncation is no such size.
    assert 4 * np.prod(said["tensor"]) > 1_000_000


def test_the_whole_family_costs_what_its_recipe_allows(full_family):
    _, said = full_family
    # The truncation is a share of the leave-one-out error; the recipe's budget is an upper limit.
    assert 0.0015 < said["truncation_rms_m"] <= 0.005 < said["truncation_p99_m"] < 0.02
    assert said["compression"]["stored"] > 40.0 and said["compression"]["core"] > 75.0
    assert said["leave_one_out_rms_m"] < 0.03
    assert 0.0 < said["parity_m"] < GATE
    assert said["notes"] == []


def test_graph_and_reference_agree_at_ten_thousand_points(exported, model_path, opened):
    assert onnx_export.POINTS == 10_000 and onnx_export.PARITY_LIMIT == GATE
    worst = onnx_export.check_parity(exported.model, model_path.read_bytes(), opened.card)
    assert 0.0 < worst < GATE
    assert opened.card.diagnostics["parity_m"] == float(f"{worst:.1e}")


def test_every_output_agrees_with_the_reference(exported, opened, asked):
    expected = exported.model.evaluate(*asked)
    found = ModelOutputs(*opened.run(*asked, *OUTPUTS))
    parents = opened.card.skeleton.parents
    gaps = np.linalg.norm(found.positions(parents) - expected.positions(parents), axis=-1)
    assert gaps.max() < GATE
    # One sign too: q and -q are one rotation, but between frames a client interpolates numbers.
    assert np.abs(found.rotations - expected.rotations).max() < 1e-4
    assert np.abs(found.bone_offsets - expected.bone_offsets).max() < 1e-6
    assert np.abs(found.duration / expected.duration - 1.0).max() < 1e-5
    assert np.abs(found.sigma / expected.sigma - 1.0).max() < 1e-2
    # Negative control: a thousandth of the range of one control is seen at that tolerance.
    low, high = exported.model.bank.low, exported.model.bank.high
    nudged = opened.run(asked[0] + 1e-3 * (high - low) * np.eye(4)[2], asked[1], *OUTPUTS)
    assert (
        np.abs(ModelOutputs(*nudged).positions(parents) - expected.positions(parents)).max() > GATE
    )


def bent(exported, joint, radians):
    """The model with one joint's mean rotation damaged."""
    decoder = exported.model.decoder
    means = decoder.means.copy()
    turn = np.array([0.0, 0.0, radians])
    means[joint] = quat.mul(means[joint], quat.exp(turn))
    chart = replace(decoder.chart, means=means)
    return replace(exported.model, decoder=replace(decoder, chart=chart))


def test_the_gate_refuses_a_bent_joint_and_names_what_it_moves(exported, model_path, opened):
    names, parents = opened.card.skeleton.names, opened.card.skeleton.parents
    arm = names.index("LeftForeArm")
    hanging = {arm}
    for joint, parent in enumerate(parents):
        hanging |= {joint} if parent in hanging else set()
    with pytest.raises(ExportRefused) as caught:
        onnx_export.check_parity(bent(exported, arm, 0.01), model_path.read_bytes(), opened.card)
    found = re.match(r"the graph puts (\w+) ([0-9.]+) cm from", str(caught.value))
    assert names.index(found[1]) in hanging - {arm}
    # A forearm with its hand is some 0.4 m long: a hundredth of a radian moves its end by 0.4 cm.
    assert 0.2 < float(found[2]) < 0.6
    assert "expected at most 0.01 cm" in str(caught.value)
    for control in opened.card.controls:
        assert f"'{control.name}':" in str(caught.value)


@pytest.fixture(scope="module")
def graph(model_path):
    return onnx.load(model_path)


def test_the_file_is_of_the_agreed_versions(graph):
    assert [(o.domain, o.version) for o in graph.opset_import] == [("", 18)]
    assert graph.ir_version == 8
    assert graph.producer_name == "posefield"
    onnx.checker.check_model(graph, full_check=True)


def test_the_ports_are_those_agreed_and_no_others(graph):
    def shapes(ports):
        return {
            p.name: [d.dim_param or d.dim_value for d in p.type.tensor_type.shape.dim]
            for p in ports
        }

    assert shapes(graph.graph.input) == {
        "controls": ["batch", 4],
        "time": ["batch", "steps"],
        "level": [],
    }
    assert shapes(graph.graph.output) == {
        "rotations": ["batch", "steps", 33, 4],
        "root_position": ["batch", "steps", 3],
        "bone_offsets": ["batch", 33, 3],
        "duration": ["batch"],
        "sigma": ["batch"],
        "travel": ["batch", "steps", 3],
    }


def test_the_file_is_self_contained_and_of_plain_operators(graph):
    weights = graph.graph.initializer
    assert weights and all(t.data_location == onnx.TensorProto.DEFAULT for t in weights)
    assert not any(t.external_data for t in weights)
    assert {node.domain for node in graph.graph.node} == {""}
    assert not graph.functions
    kinds = {node.op_type for node in graph.graph.node}
    assert not kinds & {"Loop", "If", "Scan", "Einsum", "RandomUniform", "MatMulInteger"}


def test_onnxruntime_alone_reads_the_metadata(model_path):
    runtime = onnxruntime.InferenceSession(model_path, providers=["CPUExecutionProvider"])
    entries = runtime.get_modelmeta().custom_metadata_map
    card = {k: json.loads(v) for k, v in entries.items() if k.startswith("posefield.")}
    assert card["posefield.format"] == 5
    assert card["posefield.units"] == {
        "length": "m",
        "time": "s",
        "rotation": "quaternion wxyz",
        "up": "+y",
    }
    controls = card["posefield.controls"]
    assert [c["unit"] for c in controls] == ["m", "m", "deg", "m"]
    assert all(c["minimum"] < c["default"] < c["maximum"] for c in controls)
    joints = card["posefield.skeleton"]
    assert len(joints["names"]) == len(joints["parents"]) == len(joints["offsets"]) == 33
    assert card["posefield.provenance"]["licence"] == "CC0-1.0"
    assert re.fullmatch(r"[0-9a-f]{64}", card["posefield.provenance"]["data_sha256"])


def test_quaternions_are_unit_durations_positive_and_sigmas_not_negative(opened, asked):
    out = ModelOutputs(*opened.run(*asked, *OUTPUTS))
    assert np.abs(np.linalg.norm(out.rotations, axis=-1) - 1.0).max() < 1e-5
    assert out.duration.min() > 0.5
    assert out.sigma.min() > 0.0
    assert np.abs(out.bone_offsets[:, 0]).max() < 1e-12
    # Still so far outside, where a straight line in the place of an exponential would fail.
    far = opened.run(asked[0] + 3 * (asked[0] - asked[0].mean(axis=0)), asked[1], *OUTPUTS)
    assert ModelOutputs(*far).duration.min() > 0.0
    assert np.median(ModelOutputs(*far).sigma) > 3 * np.median(out.sigma)
    assert np.abs(np.linalg.norm(far[0], axis=-1) - 1.0).max() < 1e-5


def test_time_ends_with_the_clip(opened, asked):
    points = asked[0]
    durations = opened.run(points, np.zeros((50, 1)), "duration")[0][:, None]
    late = np.hstack([0.0 * durations, durations, durations - 0.1])
    early = np.hstack([0.0 * durations - 7.0, durations + 7.0, durations - 0.2])
    inside, outside = (
        opened.run(points, times, "rotations", "root_position") for times in (late, early)
    )
    for within, beyond in zip(inside, outside, strict=True):
        assert np.array_equal(within[:, :2], beyond[:, :2])
        assert np.abs(within[:, 2] - beyond[:, 2]).max() > 1e-3


def fused_activations(content):
    """Return the activations that onnxruntime-web 1.23 fuses with Gemm, an operator it lacks."""
    graph = onnx.load_from_string(content).graph
    products = {node.output[0] for node in graph.node if node.op_type == "Gemm"}
    activations = ("Relu", "LeakyRelu", "Tanh", "Sigmoid", "Abs", "Elu", "HardSigmoid", "Softplus")
    return [n.name or n.op_type for n in graph.node if n.op_type in activations
            and n.input[0] in products]  # fmt: skip


@pytest.mark.parametrize("name", ["model_path", "labelled_path", "walk_path"])
def test_older_browsers_engines_run_every_level(request, name):
    content = request.getfixturevalue(name).read_bytes()
    assert fused_activations(content) == []
    broken = onnx.load_from_string(content)
    product = next(n for n in broken.graph.node if n.op_type == "Gemm")
    broken.graph.node.add(op_type="Relu", input=[product.output[0]], output=["refused"])
    assert fused_activations(broken.SerializeToString()) == ["Relu"]
