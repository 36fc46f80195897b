"""Memory of models in use beside its estimate, in a process that opens many."""

import subprocess
import sys

import pytest

from posefield.inference import session
from posefield.registry import model_registry

USE = """
import gc
import resource
import sys
from pathlib import Path

import numpy as np

from posefield.inference import onnx_runtime, session
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer


def used():
    made = Synthesizer("model", session.open_bytes(content, ""))
    opened = made.session
    points, no = onnx_runtime.default_controls(opened.card), np.zeros((1, 1))
    labels = np.zeros((1, sum(opened.card.label_counts)))
    for level in range(len(opened.card.levels)):
        opened.run(points, no, *onnx_runtime.all_outputs(opened.card), level=level)
        opened.run(points, no, *onnx_runtime.outputs(opened.card), level=level)
        opened.run(points, None, "duration", level=level)
        inner = ("coefficients", "frame", "way")[: 2 + opened.card.cyclic]
        opened.run(points, no, *inner, labels=labels, level=level)
        controls = {each.name: each.default for each in opened.card.controls}
        clips.synthesize_clip(made, ClipQuestion(controls=controls, level=level))
    return made


def resident():
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


content = Path(sys.argv[1]).read_bytes()
kept = [used()]
before = resident()
kept += [used() for _ in range(4)]
print((resident() - before) / 4)
"""


@pytest.mark.parametrize("name", ["reaching", "cmu_walk"])
def test_models_take_about_the_memory_that_is_estimated(name):
    file = model_registry.SHIPPED_FOLDER / f"{name}.onnx"
    done = subprocess.run(
        [sys.executable, "-c", USE, file], capture_output=True, text=True, check=True
    )
    taken, estimated = float(done.stdout), session.load(file).memory
    assert 0.4 * estimated < taken < 1.5 * estimated
    # The estimate without regard to levels would not do.
    assert taken > 1.5 * (session.BASE_MEMORY + 12 * file.stat().st_size)
