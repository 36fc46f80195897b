"""Tests of a whole performance of trained models: walk, grab, hold, return, walk."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from posefield.encode.formats import CLIP_ENCODERS
from posefield.inference import session
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question.json_decoding import decode_question
from posefield.question.performance_question import PerformanceQuestion
from posefield.registry import model_registry, shipped_models
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train import train
from posefield_train.graph import onnx_export
from posefield_train.source import ingest, recipe

pytestmark = pytest.mark.system

RECIPES = Path(recipe.__file__).parents[1] / "recipes"
TARGET = [1.0, 1.65, 5.0]
# Peak accelerations of captured walking, m/s², and skate, m/s, that performances stay below.
PEAK, SKATE = 16.0, 0.08


def segments(**walk):
    """Return the segments of the example; walk: fields of its first walk."""
    return [
        {"kind": "walk", "model": "cmu_walk", "speed": 1.1, **walk},
        {
            "kind": "act",
            "model": "hdm05_grab_high",
            "targets": [{"joint": "rhand", "position": TARGET, "at": "event"}],
        },
        {"kind": "hold", "seconds": 0.5},
        {"kind": "act", "model": "hdm05_grab_return"},
        {"kind": "walk", "model": "cmu_walk", "seconds": 2.0},
    ]


@pytest.fixture(scope="module")
def library(real_data):
    """The shipped models, and those of the reach and its return."""
    found = dict(model_registry.load([shipped_models.FOLDER]).models)
    for name in ("hdm05_grab_high", "hdm05_grab_return"):
        own = recipe.read(RECIPES / f"{name}.toml")
        examples, notes = ingest.ingest(own, real_data)
        trained = train.train(own, examples, lambda _: None)
        content = onnx_export.export_model(own, trained, notes).content
        found[name] = Synthesizer(name, session.open_bytes(content, name))
    return ModelRegistry(found)


def perform(library, script):
    question = decode_question(PerformanceQuestion, json.dumps(script).encode())
    return composition.perform(resolve_script(question, library.find), 10_000)


@pytest.fixture(scope="module")
def whole(library):
    return perform(library, {"segments": segments(), "fps": 60})


def hand(answer):
    """Return the positions (F, 3), m, of the hand."""
    clip = answer.clip
    return clip.positions()[:, clip.skeleton.names.index("rhand")]


def test_the_hand_is_at_its_target_from_the_event_to_the_end_of_the_hold(whole):
    _, act, hold, *_ = whole.trust.segments
    first, last = round(60 * act.event), round(60 * hold.ends)
    away = np.linalg.norm(hand(whole)[first : last + 1] - TARGET, axis=-1)
    assert hold.ends - act.event == pytest.approx(0.5, abs=0.02)
    assert away.max() < 1e-3
    assert np.linalg.norm(hand(whole)[first - 30] - TARGET) > 0.1


def test_feet_stand_and_no_join_is_hard(whole):
    report = whole.trust
    assert [join.hard for join in report.joins] == [False] * 3
    assert max(join.peak for join in report.joins) < PEAK
    assert report.feet.skate < SKATE
    assert report.feet.skate_before > report.feet.skate
    assert report.feet.lowered <= 0.05 + 1e-9
    assert report.warnings == ()


def test_the_same_script_gives_the_same_bytes(library, whole):
    again = perform(library, {"segments": segments(), "fps": 60})
    encode = CLIP_ENCODERS["usdc"].encode
    assert encode(again) == encode(whole)
    other = perform(library, {"segments": segments(speed=1.2), "fps": 60})
    assert encode(other) != encode(whole)


def test_another_character_still_reaches(library):
    """The walker's arms are not those of the reach: the arm bends to the target, or it is said."""
    script = {"segments": segments(), "fps": 60, "character": {"model": "cmu_walk"}}
    answer = perform(library, script)
    act, hold = answer.trust.segments[1:3]
    rows = slice(round(60 * act.event), round(60 * hold.ends) + 1)
    names = answer.clip.skeleton.names
    path = answer.clip.positions()[rows, names.index("RightHand")]
    said = [w for w in answer.trust.script_warnings if w.pointer == "/segments/1/targets/0"]
    missed = np.linalg.norm(path - TARGET, axis=-1).max()
    assert missed < 1e-3 or said


def test_a_performance_goes_on_from_the_frames_of_another(library):
    first = perform(library, {"segments": [segments(seconds=2.0)[0]], "fps": 30})
    poses = [
        {"rotations": turns.tolist(), "root_position": root.tolist()}
        for turns, root in zip(first.clip.rotations[-3:], first.clip.root_path[-3:], strict=True)
    ]
    walk = {"kind": "walk", "model": "cmu_walk", "seconds": 2.0, "speed": 1.1}
    later = perform(library, {"segments": [walk], "fps": 30, "start": {"poses": poses}})
    both = np.concatenate([first.clip.root_path[-3:], later.clip.root_path[1:4]])
    assert np.allclose(later.clip.root_path[0], first.clip.root_path[-1], atol=0.02)
    steps = np.linalg.norm(np.diff(both[:, [0, 2]], axis=0), axis=-1) * 30.0
    assert steps == pytest.approx(np.full(5, 1.1), rel=0.35)
    elsewhere = replace(first.clip, translations=first.clip.translations + 1.0)
    assert not np.allclose(later.clip.root_path[0], elsewhere.root_path[-1], atol=0.02)
