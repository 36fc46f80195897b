"""Tests of answers by provider: their tolerance and its negative control, tags, and a real GPU."""

from dataclasses import replace

import numpy as np
import onnx
import onnxruntime
import pytest
from graphics_card import FAULT
from onnx.reference import ReferenceEvaluator
from onnx.reference.ops.op_gemm import Gemm_7
from onnx.reference.ops.op_matmul import MatMul as FloatMatMul
from onnx.reference.ops.op_one_hot import OneHot as ScalarOneHot

from posefield.inference import graph_ports, providers, session
from posefield.inference.named_model import NamedModel
from posefield.inference.providers import CPU, CUDA
from posefield.model_file import subgraph
from posefield.motion import skeleton
from posefield.registry import shipped_models

FILES = sorted(shipped_models.FOLDER.glob("*.onnx"))
# Computed by the CPU in both parts, so that all of the code runs without a GPU.
BOTH_ON_CPU = replace(CUDA, execution=CPU.execution, device="cpu", options=())
ROWS = 2200


def questions(card, rows=ROWS):
    """Controls (N, d) across the ranges and times (N, 1), s, in float32."""
    own = np.random.default_rng(7)
    low, high = ([getattr(each, end) for each in card.controls] for end in ("minimum", "maximum"))
    times = own.uniform(0.0, card.durations[0], (rows, 1))
    return own.uniform(low, high, (rows, len(low))).astype(np.float32), times.astype(np.float32)


def furthest(card, found, expected):
    """The largest differences of joints, quaternions, durations and sigma, in their tolerances."""

    def joints(answer):
        rotations, root, bones = (answer[name].astype(float) for name in POSE)
        return skeleton.positions(
            card.skeleton.parents, rotations, skeleton.translations(bones, root)
        )

    apart = np.linalg.norm(joints(found) - joints(expected), axis=-1).max()
    names = ("rotations", "duration", "sigma")
    others = (np.abs(found[n].astype(float) - expected[n]).max() for n in names)
    tolerances = np.array([*3 * [providers.TOLERANCE], providers.SIGMA_TOLERANCE])
    return np.array([apart, *others]) / tolerances


POSE = ("rotations", "root_position", "bone_offsets")


def answers(opened, controls, times, level=0):
    names = graph_ports.outputs(opened.card)
    return dict(zip(names, opened.run(controls, times, *names, level=level), strict=True))


class OneHot(ScalarOneHot):
    """The reference's operator, which takes a depth of shape (1,), as the standard allows."""

    op_domain = ""

    def _run(self, indices, depth, values, axis=None):
        return super()._run(indices, np.asarray(depth).reshape(()), values, axis=axis)


def tf32(values):
    """Float32 with the 10 bits of TF32, rounded to the nearest."""
    bits = np.ascontiguousarray(values).view(np.uint32) + np.uint32(0x1000)
    return (bits & np.uint32(0xFFFFE000)).view(np.float32)


class MatMul(FloatMatMul):
    """Products of factors in TF32, as a GPU makes them unless it is told not to."""

    op_domain = ""

    def _run(self, a, b):
        return super()._run(tf32(a), tf32(b))


class Gemm(Gemm_7):
    """As above."""

    op_domain = ""

    def _run(self, a, b, c=None, **given):
        return super()._run(tf32(a), tf32(b), c, **given)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
@pytest.mark.parametrize("level", [0, -1])
def test_another_float32_implementation_is_within_the_tolerance_and_tf32_is_not(file, level):
    opened = session.load(file)
    names, level = graph_ports.outputs(opened.card), level % len(opened.card.levels)
    controls, times = questions(opened.card, 512)
    graph = subgraph.select_outputs(subgraph.fix_level(file.read_bytes(), level), *names)
    feed = {"controls": controls, "time": times}

    def other(*operators):
        engine = ReferenceEvaluator(onnx.load_from_string(graph), new_ops=[OneHot, *operators])
        return dict(zip(names, engine.run(list(names), feed), strict=True))

    ours = answers(opened, controls, times, level)
    assert (furthest(opened.card, other(), ours) < 0.1).all()
    apart = furthest(opened.card, other(MatMul, Gemm), ours)
    assert (apart[:3] > 5.0).all() and (apart[3] > 5.0) == ((file.stem, level) == ("reaching", 0))


def test_both_parts_of_a_split_session_give_the_answers_of_one():
    file = FILES[0]
    plain, split = (
        session.load(file),
        session.load_bytes(file.read_bytes(), "", provider=BOTH_ON_CPU),
    )
    controls, times = questions(plain.card)
    assert split.provider is BOTH_ON_CPU and len(controls) > BOTH_ON_CPU.smallest
    found, expected = answers(split, controls, times), answers(plain, controls, times)
    assert all(np.array_equal(found[name], expected[name]) for name in expected)
    assert split.run_trial() == split.golden


def test_entity_tags_differ_between_providers():
    plain = session.load(FILES[0])
    split = session.load_bytes(FILES[0].read_bytes(), "", provider=BOTH_ON_CPU)
    here = NamedModel("walk", plain).fingerprint
    assert NamedModel("walk", session.load(FILES[0])).fingerprint == here
    # The answer to a large call is part of what the tags are made of, and so is the name.
    assert split.golden.startswith(plain.golden) and len(split.golden) > len(plain.golden)
    named = replace(split, golden=plain.golden)
    assert (
        len({here, NamedModel("walk", split).fingerprint, NamedModel("walk", named).fingerprint})
        == 3
    )


def operators_on_the_cpu(provider):
    """Types of the operators of a shipped model that a session of the provider runs on the CPU."""
    options = onnxruntime.SessionOptions()
    options.add_session_config_entry("session.record_ep_graph_assignment_info", "1")
    graph = subgraph.fix_level(FILES[0].read_bytes(), 0)
    chosen = [(provider.execution, dict(provider.options))]
    opened = onnxruntime.InferenceSession(graph, options, providers=chosen)
    parts = opened.get_provider_graph_assignment_info()
    mine = [part for part in parts if part.ep_name == CPU.execution]
    return {node.op_type for part in mine for node in part.get_nodes()}


COSTLY = {"MatMul", "Exp", "Sqrt", "ReduceSum"}


def test_operators_tell_where_they_run():
    """Negative control of the next."""
    assert operators_on_the_cpu(CPU) >= COSTLY


@pytest.mark.skipif(FAULT is not None, reason="no GPU")
def test_a_gpu_runs_all_costly_operators():
    """onnxruntime runs operators without a kernel for the GPU on the CPU, and those on shapes."""
    assert not operators_on_the_cpu(CUDA) & COSTLY


@pytest.mark.skipif(FAULT is not None, reason="no GPU")
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_answers_of_a_gpu_are_those_of_the_cpu_within_the_tolerance(file):
    plain, gpu = session.load(file), session.load_bytes(file.read_bytes(), "", provider=CUDA)
    controls, times = questions(plain.card)
    for level in range(len(plain.card.levels)):
        found = answers(gpu, controls, times, level)
        apart = furthest(plain.card, found, answers(plain, controls, times, level))
        assert (apart < 1.0).all()
        again = answers(gpu, controls, times, level)
        assert all(np.array_equal(found[name], again[name]) for name in found)
