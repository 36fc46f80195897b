"""Tests of the report of a performance in files: the same facts in each format."""

import io
import json

import numpy as np
import pytest
from pxr import Sdf

from posefield.encode.formats import CLIP_ENCODERS
from posefield.inference import session
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis.synthesizer import Synthesizer

MAX_FRAMES = 1000
SCRIPT = {
    "segments": [
        {"kind": "walk", "model": "walk", "seconds": 2.0, "stop": "standing"},
        {"kind": "hold", "seconds": 0.5},
        {"kind": "walk", "model": "walk", "to": [0.5, 6.0], "start": "standing"},
    ]
}


@pytest.fixture(scope="module")
def answer(walk_path):
    walk = Synthesizer("walk", session.load(walk_path))
    asked = json_decoding.decode_question(PerformanceQuestion, json.dumps(SCRIPT).encode())
    return composition.perform(resolve_script(asked, lambda _: walk), MAX_FRAMES)


def encoded(answer, name):
    encoder = CLIP_ENCODERS[name]
    return encoder.encode(answer, encoder.convention(None, None, None))


def plain(value, like):
    """Return metadata of USD with dictionaries that stand for lists as lists, as in a pattern."""
    if isinstance(like, dict):
        assert value.keys() == like.keys()
        return {key: plain(value[key], like[key]) for key in like}
    if isinstance(like, list) and isinstance(value, dict):
        assert list(value) == sorted(str(index) for index in range(len(like)))
        return [plain(value[str(index)], each) for index, each in enumerate(like)]
    return list(value) if isinstance(like, list) else value


@pytest.mark.parametrize("name", ["usda", "usdc"])
def test_the_metadata_of_usd_is_the_report(answer, name, tmp_path):
    path = tmp_path / f"performance.{name}"
    path.write_bytes(encoded(answer, name))
    found = Sdf.Layer.FindOrOpen(str(path)).customLayerData["posefield"]
    report = json.loads(json.dumps(answer.trust.document()))
    assert plain(found, report) == report
    assert [each["kind"] for each in report["segments"]] == ["walk", "hold", "walk"]
    assert report["joins"] and report["feet"]["stances"] and report["warnings"]


def test_archives_and_json_have_the_report(answer):
    report = json.loads(json.dumps(answer.trust.document()))
    with np.load(io.BytesIO(encoded(answer, "npz"))) as found:
        assert json.loads(str(found["trust"])) == report
    assert json.loads(encoded(answer, "json"))["trust"] == report
