"""Tests of scripts and performances: what the builders make, what is refused before it is sent."""

import zipfile
from pathlib import Path

import msgspec
import numpy as np
import pytest
from posefield_client import AsyncClient, Client, Script, errors, notebook, performances
from posefield_client.errors import WrongQuestion
from posefield_client.generated import Hold, Join, PlacedTarget, Walk

from posefield.question import json_decoding
from posefield.question.performance_batch_question import PerformancesQuestion
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


def body(script, **options):
    return msgspec.json.decode(performances.performance(script, **options).request("usdc").body)


def test_builders_make_the_document_of_the_contract():
    assert WHOLE.document() == DOCUMENT
    assert body(WHOLE) == DOCUMENT
    assert body(DOCUMENT) == DOCUMENT


def test_the_service_reads_what_builders_make():
    """Contract: the service's own type accepts every field, and says the same."""
    asked = performances.performance(WHOLE, fps=60, start={"position": (1, 2)}, feet="as_predicted")
    question = json_decoding.decode_question(PerformanceQuestion, asked.request("glb").body)
    assert question.fps == 60 and question.start.position == (1, 2)
    assert [each.__struct_config__.tag for each in question.segments] == [
        *("walk", "act", "hold", "act", "walk")
    ]
    assert question.segments[1].targets[0].position == (0.4, 1.6, 4.6)


def test_a_script_is_never_changed():
    begun = Script().walk("a", seconds=1)
    assert begun.walk(seconds=2) != begun.hold(1)
    assert len(begun.segments) == 1 and begun == Script().walk("a", seconds=1)


def test_parts_may_be_structs_of_the_contract():
    target = PlacedTarget(joint="rhand", position=(0.0, 1.0, 2.0), time=0.5)
    made = Script().act("grab", targets=[target], join=Join(blend="cut"), at=(0, 1), facing=0.5)
    (said,) = made.document()["segments"]
    assert said["targets"] == [{"joint": "rhand", "position": [0, 1, 2], "time": 0.5}]
    assert said["join"] == {"blend": "cut"} and said["at"] == [0, 1] and said["facing"] == 0.5
    same = Script((Walk(model="a", seconds=1.0), Hold(seconds=2.0)))
    assert same == Script().walk("a", seconds=1).hold(2)


def test_options_go_with_the_script():
    options = {"fps": 50, "take": 3, "detail": True, "unit": "cm", "up": "z", "names": "vrm"}
    discs = [{"position": (1, 2), "radius": 0.5}]
    found = body(WHOLE, **options, obstacles=discs, character={"model": "cmu_walk"})
    assert found == {
        **DOCUMENT,
        **options,
        "obstacles": [{"position": [1, 2], "radius": 0.5}],
        "character": {"model": "cmu_walk"},
    }
    with pytest.raises(WrongQuestion, match="given twice: fps"):
        body({**DOCUMENT, "fps": 24}, fps=30)


def test_a_plan_is_asked_for_without_poses():
    asked = performances.plan(WHOLE, fps=25).request
    assert (asked.operation.method, asked.target) == ("POST", "/v1/performances?plan=true")
    assert msgspec.json.decode(asked.body) == {**DOCUMENT, "fps": 25}


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: Script().walk(seconds=1), "a walk without a model, expected one in the first"),
        (lambda: Script().walk("No Name", seconds=1), "model 'No Name', expected a name"),
        (
            lambda: Script().hold(1).act("a", targets=[{"joint": "b", "position": (0, 0, 0)}]),
            "segment 1, target 0: expected one of time and at",
        ),
        (
            lambda: Script().walk("a", start="running"),
            "segment 0: Invalid enum value 'running' - at `$.start`",
        ),
        (lambda: Script().walk("a", to=(0, 1, 2)), "segment 0: Expected `array` of length 2"),
        (lambda: Script().walk("a", spede=1, seconds="1"), "segment 0: Expected `float"),
        (lambda: Script().walk("a", sped="fast"), "sped (did you mean 'speed'?) is 'fast', exp"),
        (lambda: Script().hold(float("nan")), "seconds is nan, expected a finite number"),
        (lambda: body({}), "a script without segments, expected at least one"),
        (lambda: body([]), "script is a list, expected a Script or a mapping with segments"),
        (
            lambda: body({"segments": [{"kind": "hold", "second": 1}]}),
            "segment 0: Object contains unknown field `second`",
        ),
        (
            lambda: body({**DOCUMENT, "obstacle": []}),
            "script: Object contains unknown field `obstacle` (did you mean 'obstacles'?)",
        ),
        (
            lambda: performances.performance(WHOLE).request("usd"),
            "format 'usd' (did you mean 'usdz'?)",
        ),
    ],
)
def test_what_cannot_be_is_not_sent(ask, said):
    with pytest.raises(WrongQuestion) as caught:
        ask()
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize("kind", [Client, AsyncClient])
def test_a_performance_says_its_segments(kind):
    begun = "Async" if kind is AsyncClient else ""
    shown = "walk cmu_walk, act grab, hold 0.5 s, act grab_return, walk cmu_walk"
    made = kind("http://127.0.0.1:9").performance(WHOLE)
    assert repr(made) == f"{begun}Performance(Script({shown}))"


def test_a_performance_is_shown_and_saved(address, tmp_path):
    script = Script().walk("walk", to=(0, 2)).walk(seconds=1, turn=0.3)
    with Client(address) as client:
        made = client.performance(script, fps=24)
        numbers = made.numbers
        planned = client.plan(script, fps=24)
        saved = made.save(tmp_path / "made.usdc")
        html = made._repr_html_()
    assert msgspec.structs.replace(numbers.trust, feet=planned.feet) == planned
    assert numbers.rotations.shape == (planned.frames, len(numbers.names), 4)
    assert [each.kind for each in planned.segments] == ["walk", "walk"]
    assert saved.path.read_bytes().startswith(b"PXR-USDC") and saved.duration == planned.duration
    assert html == notebook.picture(numbers) and "2 segments" in repr(numbers)


def test_the_service_points_at_the_part_of_a_script(address):
    script = Script().walk("walk", seconds=1).act("reech")
    with Client(address) as client, pytest.raises(errors.Unanswerable) as caught:
        client.plan(script)
    assert caught.value.errors[0].pointer == "/segments/1/model"


def test_a_layout_is_a_parameter():
    script = Script().walk("a", seconds=1)
    asked = performances.performance(script, layout="segments").request("usdc")
    assert asked.target == "/v1/performances.usdc?layout=segments"
    assert asked.body == performances.performance(script).request("usdc").body


def test_an_unknown_option_is_refused():
    script = Script().walk("a", seconds=1)
    with pytest.raises(WrongQuestion, match=r"option 'fpss' \(did you mean 'fps'\?\), expected"):
        performances.performance(script, fpss=30)
    with pytest.raises(WrongQuestion, match="option 'unit', expected some of character, start"):
        performances.plan(script, unit="cm")


def test_an_archive_has_named_scripts():
    script = Script().walk("a", seconds=1)
    named = {"name": "left", "fps": 24, **script.document()}
    asked = performances.performances([script, named], "usdc", layout="segments").request("tar")
    assert asked.target == "/v1/performances/batch.tar"
    body = msgspec.json.decode(asked.body)
    assert body == {
        "format": "usdc",
        "layout": "segments",
        "scripts": [script.document(), named],
    }
    question = json_decoding.decode_question(PerformancesQuestion, asked.body)
    assert [each.name for each in question.scripts] == [None, "left"]


def test_archives_that_cannot_be_are_refused():
    script = Script().walk("a", seconds=1)
    with pytest.raises(WrongQuestion, match=r"format 'usd' \(did you mean 'usdz'\?\), expected"):
        performances.performances([script], "usd")
    with pytest.raises(WrongQuestion, match=r"script 1: script: .*did you mean 'name'"):
        performances.performances([script, {"nam": "b", **script.document()}], "usdc")
    with pytest.raises(WrongQuestion, match="script 0: a script without segments"):
        performances.performances([{"name": "b"}], "usdc")
    with pytest.raises(WrongQuestion, match=r"ends in none of \.zip, \.tar"):
        performances.performances([script], "usdc").ending(Path("many.usdc"))


def test_many_performances_are_saved_with_their_reports(address, tmp_path):
    script = Script().walk("walk", seconds=1)
    told = []
    with Client(address) as client:
        planned = client.plan(script)
        packed = client.performances([script, {"name": "b", **script.document()}], "bvh")
        saved = packed.save(tmp_path / "many.zip", progress=told.append)
        alone = client.performance(script).content("bvh")
    assert repr(packed) == "Saving(2 performances as bvh)"
    assert [entry.file for entry in saved.entries] == ["performance-000000.bvh", "b.bvh"]
    assert saved.entries[1].segments == planned.segments
    assert (told[-1].files, told[-1].count) == (2, 2)
    with zipfile.ZipFile(saved.path) as found:
        assert found.read("b.bvh") == alone
