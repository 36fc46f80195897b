"""Tests of the GPU benchmark: its code on the CPU, and its message on a machine without a GPU."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import gpu
import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.inference import graph_ports, onnx_runtime, session
from posefield.inference.providers import CPU, CUDA, CallSizes
from posefield.registry import shipped_models

ROOT = Path(__file__).parents[2]
# The row of the GPU, computed by the CPU in smaller calls.
SMALL = replace(
    CUDA,
    execution=CPU.execution,
    device="cpu",
    calls=CallSizes(512, 512, 1, walking=512, timed=512),
    options=(),
)


@pytest.fixture(scope="module")
def walk():
    return session.load(shipped_models.FOLDER / "cmu_walk.onnx")


@pytest.mark.parametrize("level", [0, 3])
def test_bound_calls_give_the_answers_of_the_service(walk, level):
    asked = gpu.questions(walk.card, 1100)
    calls = gpu.bound_calls(walk, level, SMALL, asked, 512)
    names, sizes = graph_ports.outputs(walk.card), [367, 367, 366]
    parts = np.split(np.arange(1100), np.cumsum(sizes)[:-1])
    assert len(calls) == len(parts)
    for call, rows in zip(calls, parts, strict=True):
        call.run()
        own = (asked["controls"][rows], asked["time"][rows])
        expected = dict(zip(names, walk.run(*own, *names, level=level), strict=True))
        found = call.copied()
        assert found.keys() == expected.keys()
        assert all(np.array_equal(found[name], expected[name]) for name in names)


def test_a_call_that_runs_again_has_the_answers_of_its_own_questions(walk):
    """Outputs are reused; calls of other rows, the negative control, have other answers."""
    asked = gpu.questions(walk.card, 1024)
    calls = gpu.bound_calls(walk, 0, SMALL, asked, 512)
    for call in (*calls, *calls):
        call.run()
    first, second = (call.copied()["rotations"].copy() for call in calls)
    calls[0].run()
    assert np.array_equal(calls[0].copied()["rotations"], first)
    assert not np.array_equal(first, second)


def test_the_whole_measurement_runs(walk):
    found = gpu.measured_rows(walk, SMALL, poses=1500, rounds=1)
    names = [row.name for row in gpu.open_rows()]
    assert [row.name for row in found] == names
    values = dict(zip(names, (row.value for row in found), strict=True))
    largest = values.pop("a quaternion's number, largest difference from the CPU")
    # Calls of other sizes round differently.
    assert 0.0 <= largest < 1e-5
    values.pop("smallest call that the GPU computes faster")
    assert all(value > 0.0 for value in values.values())


def test_rows_without_a_gpu_are_open():
    found = gpu.open_rows()
    assert {row.value for row in found} == {row.met for row in found} == {None}
    assert [row.goal for row in found if row.unit == "ms"].count(16.7) == 2


def test_without_a_gpu_the_benchmark_says_so_and_ends_well():
    try:
        onnx_runtime.require_provider(CUDA)
    except InvalidField as fault:
        reason = str(fault)
    else:
        pytest.skip("a GPU computes here")
    before = (ROOT / "docs/results/speed/gpu.json").read_bytes()
    command = [sys.executable, ROOT / "benchmarks/gpu.py", "--record"]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ, check=True)
    assert done.stdout.splitlines() == ["no GPU", reason]
    # A record of a machine with a GPU stays.
    assert (ROOT / "docs/results/speed/gpu.json").read_bytes() == before
