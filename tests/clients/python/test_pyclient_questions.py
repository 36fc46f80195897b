"""Tests of the client's requests: parameters, serialisation and local validation."""

import subprocess
import sys
from urllib.parse import parse_qsl, urlsplit

import httpx
import msgspec
import numpy as np
import posefield_client
import pytest
from posefield_client import (
    Camera,
    Client,
    Floor,
    NamedClipQuestion,
    Target,
    files,
    generated,
    numbers,
    questions,
)
from posefield_client.errors import WrongQuestion
from posefield_client.wire import Reply

NOWHERE = Client("http://127.0.0.1:1")


NAN = NamedClipQuestion(controls={}, end=float("nan"))
AT_NAN = {"position": (0.0, float("nan"), 0.0), "fov": 1.0, "height": 10.0}


def target(call):
    return call.request.target


def test_controls_by_keyword_and_by_mapping_are_the_same():
    assert target(questions.pose("m", 0, turn=1)) == target(
        questions.pose("m", 0, controls={"turn": 1})
    )


def test_labels_are_a_parameter_each_and_weights_a_list():
    labels = {"style": {"angry": 0.75, "happy": 0.25}, "performer": "kim"}
    found = target(questions.pose("m", 0, labels=labels))
    style, who = (("label", text) for text in ("style=angry:0.75,happy:0.25", "performer=kim"))
    assert parse_qsl(urlsplit(found).query) == [("time", "0"), style, who]
    assert parse_qsl(urlsplit(target(questions.suggest("m", labels=labels))).query) == [style, who]
    walk = files.walk("m", count=3, labels=labels).request("usdc").target
    assert parse_qsl(urlsplit(walk).query) == [("count", "3"), style, who]
    stood = files.walk("m", feet="stand").request("usdc").target
    assert parse_qsl(urlsplit(stood).query) == [("feet", "stand")]
    asked = questions.why("m", labels=labels, nearest=3)
    assert [*parse_qsl(urlsplit(target(asked)).query)][-2:] == [style, who]
    body = msgspec.json.decode(files.crowd("m", 0, labels=labels).request("npz").body)
    assert body["labels"] == labels


def test_names_that_are_no_python_words():
    asked = questions.pose("m", 0, controls={"hip height/left": 1, "größe": 2})
    assert target(asked).endswith("?hip+height%2Fleft=1&gr%C3%B6%C3%9Fe=2&time=0")


@pytest.mark.parametrize("name", ["model", "times", "self", "clips", "format"])
def test_a_control_may_be_called_what_a_parameter_is(name):
    assert f"{name}=1" in files.clip("m", **{name: 1}).request("usdc").target


@pytest.mark.parametrize("one", [0.5, np.float64(0.5), np.float32(0.5), np.array(0.5)])
def test_a_number_of_any_kind(one):
    assert target(questions.pose("m", one, turn=0.5)).endswith("pose.msgpack?turn=0.5&time=0.5")


@pytest.mark.parametrize("many", [[0, 0.5], (0, 0.5), np.array([0, 0.5]), np.array([0, 0.5], "f4")])
def test_times_of_any_kind(many):
    shown = target(questions.pose("m", many, turn=np.int64(3)))
    assert shown.replace("0.0", "0").endswith("pose.msgpack?turn=3&time=0&time=0.5")


@pytest.mark.parametrize(
    ("value", "said"),
    [(1e22, "1" + "0" * 22), (1e-7, "0.0000001"), (-2.5e-9, "-0.0000000025"), (0.1, "0.1")],
)
def test_no_number_has_an_exponent(value, said):
    assert target(questions.pose("m", 0, turn=value)).endswith(f"?turn={said}&time=0")
    seen = files.walk("m", camera=(value, 0, 0)).request("usda").target
    assert seen.endswith(f"?camera={said}%2C0%2C0")


def test_numbers_of_numpy_are_taken_everywhere():
    clip = {"controls": {"a": np.float32(1)}, "fps": np.float32(30), "name": np.str_("x")}
    body = msgspec.json.decode(files.clips("m", [clip], "glb").request("zip").body)
    assert body["clips"] == [{"controls": {"a": 1}, "fps": 30, "name": "x"}]
    camera = {"position": np.zeros(3), "fov": np.float32(1), "height": 10}
    crowd = files.crowd("m", 0, performer=np.array(["p", "q"]), camera=camera)
    body = msgspec.json.decode(crowd.request("npz").body)
    assert body["performer"] == ["p", "q"]
    assert body["camera"] == {"position": [0, 0, 0], "fov": 1, "height": 10}


HAND = {"joint": "mixamorig:Hand", "position": np.array([0.5, -1e-7, 2]), "at": "end"}
FOOT = Target(joint="Foot", position=(0, 0, 1), time=0.25)


def test_targets_and_exact_controls_in_a_query():
    asked = files.clip("m", targets=[HAND, FOOT], exact=["a", "b"], feet="stand", a=1)
    assert parse_qsl(urlsplit(asked.request("bvh").target).query) == [
        ("a", "1"),
        ("exact", "a,b"),
        ("target", "mixamorig:Hand@end:0.5,-0.0000001,2.0"),
        ("target", "Foot@0.25:0.0,0.0,1.0"),
        ("feet", "stand"),
    ]
    assert target(questions.pose("m", 0, exact="a")) == target(questions.pose("m", 0, exact=["a"]))


PLANE = {"height": 0.1, "slope_x": 0, "slope_z": np.float64(-1e-7)}


@pytest.mark.parametrize(
    ("floor", "text"),
    [
        (0.2, "0.2"),
        (np.float64(-0.5), "-0.5"),
        (PLANE, "0.1,0.0,-0.0000001"),
        (Floor(height=0.1, slope_x=0.0, slope_z=-1e-7), "0.1,0.0,-0.0000001"),
    ],
)
def test_floors(floor, text):
    asked = files.clip("m", floor=floor).request("bvh")
    assert parse_qsl(urlsplit(asked.target).query) == [("floor", text)]
    (sent,) = msgspec.json.decode(
        files.clips("m", [{"controls": {}, "floor": floor}], "usdc").request("zip").body
    )["clips"]
    plain = floor if np.isscalar(floor) else {"height": 0.1, "slope_x": 0.0, "slope_z": -1e-7}
    assert sent == {"controls": {}, "floor": plain}


@pytest.mark.parametrize("floor", [{"height": 1}, "0.2", {**PLANE, "slope": 0}, [0, 0, 0]])
def test_a_floor_that_is_none_is_refused(floor):
    with pytest.raises(WrongQuestion, match=r"floor: .*expected a height"):
        files.clip("m", floor=floor)


def test_takes_and_detail():
    asked = files.clip("m", take=7, variety=0.5, detail=True, a=1)
    assert parse_qsl(urlsplit(asked.request("bvh").target).query) == [
        ("a", "1"),
        ("take", "7"),
        ("variety", "0.5"),
        ("detail", "true"),
    ]
    assert target(questions.pose("m", 0, take=7)) != target(questions.pose("m", 0))
    crowd = files.crowd("m", 0, take=np.array([3, 8]), variety=[0.5, 1.0], detail=True)
    body = msgspec.json.decode(crowd.request("npz").body)
    assert (body["take"], body["variety"], body["detail"]) == ([3, 8], [0.5, 1.0], True)
    assert msgspec.json.decode(files.crowd("m", 0, take="index").request("npz").body) == {
        "controls": {},
        "time": 0,
        "take": "index",
    }


def test_takes_of_a_walking_crowd():
    asked = files.walk("m", count=3, take="index", variety=0.5, detail=True)
    assert parse_qsl(urlsplit(asked.request("usdz").target).query) == [
        ("count", "3"),
        ("take", "index"),
        ("variety", "0.5"),
        ("detail", "true"),
    ]


def test_targets_and_exact_controls_in_a_body():
    # More than a line takes.
    many = {f"control_{number:04}": number for number in range(400)}
    asked = questions.pose("m", 0, controls=many, targets=[HAND, FOOT], exact="none")
    assert asked.request.operation.method == "POST"
    expected = {
        "controls": many,
        "times": [0],
        "exact": "none",
        "targets": [
            {"joint": "mixamorig:Hand", "position": [0.5, -1e-7, 2], "at": "end"},
            {"joint": "Foot", "position": [0, 0, 1], "time": 0.25},
        ],
    }
    assert msgspec.json.decode(asked.request.body) == expected
    clip = {"controls": many, "targets": [HAND, FOOT], "exact": "none", "feet": "as_predicted"}
    (sent,) = msgspec.json.decode(files.clips("m", [clip], "usdc").request("zip").body)["clips"]
    del expected["times"]
    assert sent == {**expected, "feet": "as_predicted"}


@pytest.mark.parametrize(
    ("targets", "said"),
    [
        ([{"joint": "Hand", "position": [0, 1, 2]}], "target 0: expected one of time and at"),
        ([HAND, {**HAND, "time": 0}], "target 1: expected one of time and at"),
        ([{**HAND, "position": [0, 1]}], "target 0: .*length 3"),
        ([{**HAND, "position": [0, 1, float("nan")]}], "position is nan, expected a finite"),
        ([{**HAND, "at": "soon"}], "target 0: Invalid enum value 'soon'"),
        ([{**HAND, "when": 1}], "target 0: .*unknown field `when`"),
    ],
)
def test_targets_that_are_none(targets, said):
    with pytest.raises(WrongQuestion, match=said):
        questions.pose("m", 0, targets=targets)


def test_a_long_question_goes_by_post():
    short, long = (questions.pose("m", [0.123] * n, turn=1).request for n in (100, 1000))
    assert (short.operation.method, long.operation.method) == ("GET", "POST")
    assert msgspec.json.decode(long.body) == {"controls": {"turn": 1}, "times": [0.123] * 1000}


def test_what_is_not_said_is_not_sent():
    asked = files.clips("m", [NamedClipQuestion(controls={"a": 1})], "usdc").request("zip")
    assert msgspec.json.decode(asked.body) == {"format": "usdc", "clips": [{"controls": {"a": 1}}]}
    asked = files.crowd("m", 0, a=[1, 2], camera=Camera(position=(0, 1, 2), fov=1, height=10))
    assert msgspec.json.decode(asked.request("npz").body) == {
        "controls": {"a": [1, 2]},
        "time": 0,
        "camera": {"position": [0, 1, 2], "fov": 1, "height": 10},
    }


def test_truths_are_said_as_the_contract_says_them():
    assert files.clip("m", loop=True).request("glb").target.endswith("/clip.glb?loop=true")


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda m: m.pose(float("nan"), a=1), "times"),
        (lambda m: m.pose([0, float("inf")], a=1), "times"),
        (lambda m: m.pose(np.array([0, np.nan]), a=1), "times"),
        (lambda m: m.pose("0", a=1), "times"),
        (lambda m: m.pose(0, a="1"), "a is '1'"),
        (lambda m: m.pose(0, a=True), "a is True"),
        (lambda m: m.pose(0, a=None), "a is None"),
        (lambda m: m.pose(0, controls={"a": 1}, a=2), "given twice: a"),
        (lambda m: m.clip(end=float("nan")), "end is nan"),
        (lambda m: m.clip(fps=np.float32("inf")), "fps"),
        (lambda m: m.crowd([0, np.nan], a=1), "time"),
        (lambda m: m.crowd([0, 1], a=["x", "y"]), "a holds"),
        (lambda m: m.clips([], "fbx"), "format 'fbx', expected one of usda"),
        (lambda m: m.clips([{"controls": {}, "frames": 3}], "glb"), "clip 0: .*frames"),
        (lambda m: m.clips([{"controls": {"a": "x"}}], "glb"), "a is 'x'"),
        (lambda m: m.clip(a=1).content("fbx"), "format 'fbx'"),
        (lambda m: m.clips([{"controls": {}, "end": float("nan")}], "glb"), "end is nan"),
        (lambda m: m.clips([NAN], "glb").content("zip"), "end is nan"),
        (lambda m: m.crowd(0, camera=AT_NAN).content("npz"), "position is nan"),
        (lambda m: m.crowd(0, camera=Camera(**AT_NAN)).content("npz"), "position is nan"),
        (lambda m: m.crowd([[0, 1], [2]], a=1), "time holds lists of several lengths"),
        (lambda m: m.pose(np.zeros((2, 2)), a=1), "times has 2 axes"),
        (lambda m: m.pose(0, a=10**400), "expected a finite number"),
        (lambda m: m.crowd([0, 1], a=[10**400, 0]), "a holds"),
        (lambda m: m.crowd(0, a=1, camera={"fov": {1}}), "fov is {1}"),
    ],
)
def test_what_cannot_be_asked_is_not(ask, said):
    with pytest.raises(WrongQuestion, match=said):
        ask(NOWHERE.model("m"))


@pytest.mark.parametrize("name", ["", "..", "a/b", "a@b", "Reach", "reach@0123", "x" * 65])
def test_names_that_no_model_has(name):
    with pytest.raises(WrongQuestion, match="expected a name or name@hash"):
        NOWHERE.model(name)


@pytest.mark.parametrize(
    "packed",
    [
        [1, 2],
        {"dtype": "<f4", "shape": [2]},
        {"dtype": "<f4", "shape": [3], "data": bytes(8)},
        {"dtype": "<f4", "shape": [2], "data": bytes(7)},
        {"dtype": "O", "shape": [1], "data": bytes(8)},
        {"dtype": "fish", "shape": [1], "data": bytes(8)},
        {"dtype": "<f4", "shape": "x", "data": bytes(8)},
    ],
)
def test_an_array_that_is_none_is_refused(packed):
    grid = dict.fromkeys(("model", "across", "along"), "x") | {"controls": {}, "units": {}}
    arrays = dict.fromkeys(("across_values", "along_values", "sigma", "inside"), packed)
    whole = msgspec.msgpack.encode({**grid, "performer": None, **arrays})
    with pytest.raises((ValueError, TypeError)):
        numbers.grid(Reply(200, {}, whole))


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


def test_an_older_service_does_not_say_whether_a_grid_is_supported():
    assert numbers.grid(packed(GRID)).supported is None
    newer = numbers.grid(packed(GRID | {"supported": np.eye(3, 2) > 0}))
    assert newer.supported.tolist() == [[True, False], [False, True], [False, False]]
    for wrong in (np.ones((2, 3), bool), np.ones((3, 2), "f4")):
        with pytest.raises(ValueError, match=r"has the shape|is of float32"):
            numbers.grid(packed(GRID | {"supported": wrong}))


POSE = {
    "trust": {
        "model": "m",
        "controls": {},
        "performer": None,
        "level": 0,
        "sigma": 0.0,
        "duration": 1.0,
        "warnings": [],
    },
    "times": np.zeros(2, "f8"),
    "rotations": np.zeros((2, 5, 4), "f4"),
    "root_position": np.zeros((2, 3), "f4"),
    "bone_offsets": np.zeros((5, 3), "f4"),
}


def packed(pose):
    def map_of(found):
        return {"dtype": found.dtype.str, "shape": found.shape, "data": found.tobytes()}

    return Reply(200, {}, msgspec.msgpack.encode(pose, enc_hook=map_of))


@pytest.mark.parametrize(
    "wrong",
    [
        {"times": np.zeros(3)},
        {"rotations": np.zeros((2, 5, 3), "f4")},
        {"rotations": np.zeros((2, 4, 4), "f4")},
        {"rotations": np.zeros((2, 5, 4), "i4")},
        {"root_position": np.zeros((1, 2, 3), "f4")},
        {"bone_offsets": np.zeros(15, "f4")},
    ],
)
def test_arrays_that_do_not_fit_each_other_are_no_answer(wrong):
    assert numbers.pose(packed(POSE)).rotations.shape == (2, 5, 4)
    with pytest.raises(ValueError, match=r"has the shape|is of int32"):
        numbers.pose(packed(POSE | wrong))


def test_arrays_cannot_be_written_to(address, controls):
    with Client(address) as client:
        pose = client.model("reach").pose([0, 0.1], **controls)
    assert pose.rotations.dtype == np.float32
    with pytest.raises(ValueError, match="read-only"):
        pose.rotations[0] = 0


def test_a_card_is_asked_for_once_and_again_where_that_is_wanted(address):
    with Client(address) as client:
        model = client.model("reach")
        assert model.card is model.card
        assert model.read_card() == model.card
        assert list(model.controls) == [control.name for control in model.card.controls]
        assert client.model(model.card.identity).card.identity == model.card.identity


def test_what_a_newer_service_adds_is_passed_over_and_what_an_older_lacks_is_empty():
    entry = {"name": "m", "identity": "m@0", "versions": [], "description": "", "mood": "good"}
    content = msgspec.json.encode({"models": [entry], "total": 1})
    assert questions.models().read(Reply(200, {}, content))[0].name == "m"
    said = b'{"status": "live"}'
    assert msgspec.json.decode(said, type=generated.Liveness).contract is None


def test_cards_of_older_services_are_read(address):
    card = httpx.get(f"{address}/v1/models/reach").json()
    now = questions.card("reach").read(Reply(200, {}, msgspec.json.encode(card)))
    older = {key: value for key, value in card.items() if key not in ("left_out", "event")}
    then = questions.card("reach").read(Reply(200, {}, msgspec.json.encode(older)))
    assert (len(now.left_out), then.left_out, then.event) == (len(now.examples), (), None)
    assert then.controls == now.controls


ALONE = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"posefield", "posefield_train", "pyarrow"}:
            raise ImportError("hidden: " + name)
sys.meta_path.insert(0, Hidden())
"""


def python(code):
    command = [sys.executable, "-W", "error", "-c", ALONE + code]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_it_needs_nothing_of_the_service_nor_pyarrow():
    done = python("import posefield_client; print(posefield_client.CONTRACT)")
    assert (done.returncode, done.stdout.strip()) == (0, posefield_client.CONTRACT), done.stderr


def test_without_pyarrow_a_table_says_what_to_install():
    done = python("from posefield_client import tables; tables.read(None)")
    assert "pip install posefield-client[arrow]" in done.stderr


def test_what_is_hidden_cannot_be_imported():
    """Negative control of the two above."""
    assert "hidden: posefield" in python("import posefield").stderr
