"""Tests of the memory of long performances."""

import tracemalloc

import pytest
from asking import asker

from posefield.encode.formats import CLIP_ENCODERS
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion
from posefield.registry.model_registry import ModelRegistry

SCRIPT = '{"segments":[{"kind":"walk","model":"cmu_walk","seconds":%d}],"fps":%d}'


@pytest.fixture
def peak(shipped_walk):
    """Return the memory of a walk of some length and rate, for each joint of a frame."""

    def measured(seconds, fps, form):
        content = (SCRIPT % (seconds, fps)).encode()
        question = json_decoding.decode_question(PerformanceQuestion, content)
        encoder = CLIP_ENCODERS[form]
        tracemalloc.start()
        answer = composition.perform(resolve_script(question, lambda name: shipped_walk), 10**6)
        encoder.encode(answer, encoder.convention(None, None))
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found / (len(answer.clip) * (len(answer.clip.skeleton) + 1))

    measured(2, 30, "usdc")
    return measured


@pytest.mark.parametrize("form", ["usda", "usdc", "json", "bvh", "npz"])
def test_memory_of_a_long_performance_is_below_its_estimate(peak, form):
    assert peak(60, 240, form) < CLIP_ENCODERS[form].working


def test_memory_of_a_long_walk_grows_with_its_frames_alone(peak):
    # With the product of frames and stances it would be three times as much.
    assert peak(240, 60, "usdc") < CLIP_ENCODERS["usdc"].working


@pytest.mark.parametrize("form", ["usdc", "npz"])
def test_a_performance_beyond_the_memory_of_an_answer_is_refused_by_its_frames(shipped_walk, form):
    ask = asker(create_app(ModelRegistry({"cmu_walk": shipped_walk}), Settings()))
    headers = {"content-type": "application/json"}
    url = f"/v1/performances.{form}"
    answer = ask("POST", url, content=SCRIPT % (600, 240), headers=headers)
    assert answer.status_code == 422
    expected = "segments: 144001 frames at 240 a second, expected at most 90909"
    assert answer.json()["detail"] == expected
