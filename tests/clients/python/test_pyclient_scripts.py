"""Tests of scripts and performances: documents of the builders, and their requests."""

import zipfile

import msgspec
import numpy as np
import pytest
from posefield_client import Client, Script
from posefield_client.errors import WrongQuestion
from requests_of import body, request

from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion

HAND = {"joint": "rhand", "position": np.array([0.4, 1.6, 4.6]), "at": "event"}
WHOLE = (
    Script()
    .walk(
        "cmu_walk", along=np.array([[0, 2], [0.5, 4]]), speed=[(0, 0.9), (3, 1.4)], start="standing"
    )
    .act("grab", targets=[HAND], target_height=np.float32(1.5), exact="target_height")
    .hold(0.5, joint="rhand", look_at=(0, 1.6, 6))
    .act("grab_return", join={"seconds": 0.4})
    .walk(seconds=3, turn=0.2, labels={"style": {"angry": 0.5, "happy": 0.5}})
)
DOCUMENT = {
    "segments": [
        {
            "kind": "walk",
            "model": "cmu_walk",
            "along": [[0, 2], [0.5, 4]],
            "speed": [[0, 0.9], [3, 1.4]],
            "start": "standing",
        },
        {
            "kind": "act",
            "model": "grab",
            "controls": {"target_height": 1.5},
            "exact": ["target_height"],
            "targets": [{"joint": "rhand", "position": [0.4, 1.6, 4.6], "at": "event"}],
        },
        {"kind": "hold", "seconds": 0.5, "joint": "rhand", "look_at": [0, 1.6, 6]},
        {"kind": "act", "model": "grab_return", "join": {"seconds": 0.4}},
        {
            "kind": "walk",
            "model": "cmu_walk",
            "seconds": 3,
            "turn": 0.2,
            "labels": {"style": {"angry": 0.5, "happy": 0.5}},
        },
    ]
}
CLIENT = Client("http://127.0.0.1:1")


def test_builders_make_the_document_of_the_contract():
    assert WHOLE.document() == DOCUMENT
    assert body(CLIENT.performance(WHOLE)) == DOCUMENT
    assert body(CLIENT.performance(DOCUMENT)) == DOCUMENT


def test_the_service_reads_what_builders_make():
    """Contract: the service's own type accepts every field, and says the same."""
    asked = CLIENT.performance(WHOLE, fps=60, start={"position": (1, 2)}, feet="as_predicted")
    question = json_decoding.decode_question(PerformanceQuestion, request(asked, "glb").body)
    assert question.fps == 60 and question.start.position == (1, 2)
    assert [each.__struct_config__.tag for each in question.segments] == [
        *("walk", "act", "hold", "act", "walk")
    ]
    assert question.segments[1].targets[0].position == (0.4, 1.6, 4.6)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: Script().walk(seconds=1), "a walk without a model, expected one in the first"),
        (lambda: Script().hold(float("nan")), "seconds is nan, expected a finite number"),
        (lambda: request(CLIENT.performance(WHOLE), "usd"), "format 'usd', expected one of"),
    ],
)
def test_a_wrong_script_is_not_sent(ask, message):
    with pytest.raises(WrongQuestion) as caught:
        ask()
    assert str(caught.value).startswith(message)


def test_a_performance_is_planned_and_saved(address, tmp_path):
    script = Script().walk("walk", to=(0, 2)).walk(seconds=1, turn=0.3)
    with Client(address) as client:
        performance = client.performance(script, fps=24)
        numbers = performance.numbers
        planned = client.plan(script, fps=24)
        saved = performance.save(tmp_path / "performance.usdc")
    assert msgspec.structs.replace(numbers.trust, feet=planned.feet) == planned
    assert numbers.rotations.shape == (planned.frames, len(numbers.names), 4)
    assert [each.kind for each in planned.segments] == ["walk", "walk"]
    assert saved.path.read_bytes().startswith(b"PXR-USDC") and saved.duration == planned.duration
    assert "2 segments" in repr(numbers) and repr(performance) == "Motion(2 segments)"


def test_many_performances_are_saved_with_their_reports(address, tmp_path):
    script = Script().walk("walk", seconds=1)
    with Client(address) as client:
        planned = client.plan(script)
        packed = client.performances([script, {"name": "b", **script.document()}], "bvh")
        saved = packed.save(tmp_path / "many.zip")
        alone = client.performance(script).content("bvh")
    assert repr(packed) == "Saving(2 performances as bvh)"
    assert [entry.file for entry in saved.entries] == ["performance-000000.bvh", "b.bvh"]
    assert saved.entries[1].segments == planned.segments
    with zipfile.ZipFile(saved.path) as archive:
        assert archive.read("b.bvh") == alone
