"""Tests of the memory of long performances."""

import tracemalloc

from posefield.encode.formats import CLIP_ENCODERS
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion

MOST = 180
"""Bytes of a joint in a frame; a plan has 60 frames a second."""


def test_memory_of_a_long_walk_grows_with_its_frames_alone(shipped_walk):
    def peak(seconds, fps):
        script = b'{"segments":[{"kind":"walk","model":"cmu_walk","seconds":%d}],"fps":%d}'
        question = json_decoding.decode_question(PerformanceQuestion, script % (seconds, fps))
        encoder = CLIP_ENCODERS["usdc"]
        tracemalloc.start()
        answer = composition.perform(resolve_script(question, lambda name: shipped_walk), 10**6)
        encoder.encode(answer, encoder.convention(None, None))
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found / (len(answer.clip) * len(answer.clip.skeleton))

    peak(2, 30)
    assert peak(240, 60) < MOST
    assert peak(60, 240) < MOST
