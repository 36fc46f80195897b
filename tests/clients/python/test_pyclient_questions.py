"""Tests of the client's requests and of arrays in its answers."""

import subprocess
import sys
from functools import partial
from urllib.parse import parse_qsl, urlsplit

import anyio
import httpx
import msgspec
import numpy as np
import posefield_client
import pytest
from posefield_client import AsyncClient, Client, Floor, Target, generated, numbers
from posefield_client.errors import WrongQuestion
from posefield_client.numbers import Pose, SigmaGrid
from posefield_client.wire import Reply
from requests_of import CLIENT, request, sent

M = CLIENT.model("m")
HAND = {"joint": "mixamorig:Hand", "position": np.array([0.5, -1e-7, 2]), "at": "end"}
FOOT = Target(joint="Foot", position=(0.0, 0.0, 1.0), time=0.25)
MANY = {f"control_{number:04}": number for number in range(400)}
"""More controls than a link takes."""


def query(asked):
    """Return the parameters of the request of a pose, or of a clip or a walk as USD."""
    if callable(asked):
        return parse_qsl(sent(asked).url.query.decode())
    return parse_qsl(urlsplit(request(asked, "usdc").target).query)


def test_controls_by_keyword_and_by_mapping_are_the_same():
    expected = [("turn", "1"), ("time", "0")]
    assert query(lambda client: client.model("m").pose(0, turn=1)) == expected
    assert query(lambda client: client.model("m").pose(0, controls={"turn": 1})) == expected


@pytest.mark.parametrize(
    ("value", "text"),
    [(1e22, "1" + "0" * 22), (1e-7, "0.0000001"), (-2.5e-9, "-0.0000000025"), (0.1, "0.1")],
)
def test_no_number_has_an_exponent(value, text):
    assert query(M.clip(turn=value)) == [("turn", text)]
    assert query(M.crowd_walk(camera=(value, 0, 0))) == [("camera", f"{text},0,0")]


def test_a_clip_in_a_query():
    floor = Floor(height=0.1, slope_x=0, slope_z=-1e-7)
    options = {"feet": "stand", "floor": floor, "take": 7, "variety": 0.5, "detail": True}
    asked = M.clip(targets=[HAND, FOOT], exact=["a", "b"], loop=False, **options, a=1, end=None)
    assert sorted(query(asked)) == [
        ("a", "1"),
        ("detail", "true"),
        ("exact", "a,b"),
        ("feet", "stand"),
        ("floor", "0.1,0,-0.0000001"),
        ("loop", "false"),
        ("take", "7"),
        ("target", "Foot@0.25:0.0,0.0,1.0"),
        ("target", "mixamorig:Hand@end:0.5,-0.0000001,2.0"),
        ("variety", "0.5"),
    ]
    assert query(M.clip(exact="a")) == query(M.clip(exact=["a"])) == [("exact", "a")]
    assert query(M.clip(floor=np.float64(-0.5))) == [("floor", "-0.5")]


def test_a_long_question_goes_by_post():
    asked = sent(
        lambda client: client.model("m").pose(0, controls=MANY, targets=[HAND, FOOT], exact="none")
    )
    assert (asked.method, asked.url.path) == ("POST", "/v1/models/m/pose.msgpack")
    assert asked.headers["Content-Type"] == "application/json"
    assert msgspec.json.decode(asked.content) == {
        "controls": MANY,
        "times": [0],
        "exact": "none",
        "targets": [
            {"joint": "mixamorig:Hand", "position": [0.5, -1e-7, 2], "at": "end"},
            {"joint": "Foot", "position": [0, 0, 1], "time": 0.25},
        ],
    }


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: M.pose(float("nan"), a=1), "times is nan, expected a finite number"),
        (lambda: M.clips([{"controls": {}, "end": float("nan")}], "glb"), "end is nan"),
        (lambda: M.clip(a=1).content("fbx"), "format 'fbx', expected one of usd"),
        (
            lambda: request(M.clip(targets=[{**HAND, "time": 0}]), "usdc"),
            "expected one of time and at",
        ),
    ],
)
def test_a_question_that_json_cannot_hold_is_not_sent(ask, message):
    with pytest.raises(WrongQuestion, match=message):
        ask()


@pytest.mark.parametrize("name", ["", "..", "a/b", "a@b", "Reach", "reach@0123", "x" * 65])
def test_names_that_no_model_has(name):
    with pytest.raises(WrongQuestion, match="expected a name or name@hash"):
        CLIENT.model(name)


def packed(answer):
    def array(value):
        return {"dtype": value.dtype.str, "shape": value.shape, "data": value.tobytes()}

    return Reply(200, {}, msgspec.msgpack.encode(answer, enc_hook=array))


GRID = {
    **dict.fromkeys(("model", "across", "along"), "x"),
    "controls": {},
    "units": {},
    "performer": None,
    "across_values": np.zeros(2),
    "along_values": np.zeros(3),
    "sigma": np.zeros((3, 2), "f4"),
    "inside": np.ones((3, 2), bool),
}
TRUST = dict.fromkeys(("level", "sigma", "duration"), 0) | {"warnings": [], "controls": {}}
POSE = {
    "trust": {"model": "m", "performer": None, **TRUST},
    "times": np.zeros(2, "f8"),
    "rotations": np.zeros((2, 5, 4), "f4"),
    "root_position": np.zeros((2, 3), "f4"),
    "bone_offsets": np.zeros((5, 3), "f4"),
}


@pytest.mark.parametrize(
    "wrong",
    [
        {"dtype": "<f4", "shape": [2]},
        {"dtype": "<f4", "shape": [3, 2], "data": bytes(8)},
        np.ones((2, 3), "f4"),
    ],
)
def test_an_array_that_is_none_is_refused(wrong):
    read = numbers.decoder(SigmaGrid)
    assert read(packed(GRID)).supported is None
    assert read(packed(GRID | {"supported": np.eye(3, 2) > 0})).supported.tolist()[0] == [
        True,
        False,
    ]
    with pytest.raises((ValueError, TypeError)):
        read(packed(GRID | {"sigma": wrong}))


@pytest.mark.parametrize(
    "wrong",
    [
        {"times": np.zeros(3)},
        {"rotations": np.zeros((2, 5, 3), "f4")},
        {"curves": np.zeros((3, 1), "f4")},
    ],
)
def test_arrays_that_do_not_fit_each_other_are_no_answer(wrong):
    read = numbers.decoder(Pose)
    assert read(packed(POSE)).rotations.shape == (2, 5, 4)
    with pytest.raises(ValueError, match="has the shape"):
        read(packed(POSE | wrong))


def test_a_card_is_asked_for_once(address):
    with Client(address) as client:
        model = client.model("reach")
        assert model.card is model.card
        assert list(model.controls) == [control.name for control in model.card.controls]
        assert client.model(model.card.identity).card.identity == model.card.identity


def test_answers_of_newer_and_older_services_are_read(address):
    card = httpx.get(f"{address}/v1/models/reach").json()
    newer = msgspec.convert({**card, "mood": "good"}, generated.ModelCard)
    older = {key: value for key, value in card.items() if key not in ("left_out", "event")}
    then = msgspec.convert(older, generated.ModelCard)
    assert (len(newer.left_out), then.left_out, then.event) == (len(newer.examples), (), None)
    assert then.controls == newer.controls


ALONE = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"posefield", "posefield_train", "pyarrow"}:
            raise ImportError("hidden: " + name)
sys.meta_path.insert(0, Hidden())
"""


@pytest.mark.parametrize("name", ["posefield_client", "posefield"])
def test_it_needs_nothing_of_the_service(name):
    command = [sys.executable, "-W", "error", "-c", f"{ALONE}import {name}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode == 0) is (name == posefield_client.__name__), done.stderr


def test_an_unknown_control_is_refused_at_the_call(address):
    with Client(address) as client:
        model = client.model("reach")
        for ask in (model.clip, partial(model.crowd, 0.0)):
            with pytest.raises(WrongQuestion, match=r"turm: no such control.*did you mean 'turn'"):
                ask(turm=1.0)
        clip = model.clip(turn=1.0)
        assert clip.trust == clip.numbers.trust and clip.trust.controls["turn"] == 1.0


def test_the_client_that_awaits_refuses_it_once_it_has_the_card(address):
    async def ask():
        async with AsyncClient(address) as client:
            model = client.model("reach")
            await model.card
            with pytest.raises(WrongQuestion, match="turm: no such control"):
                model.clip(turm=1.0)

    anyio.run(ask)
