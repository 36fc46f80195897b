"""The Open Inference Protocol: what it answers is what onnxruntime answers for the same file."""

import json
import re
from itertools import product

import numpy as np
import onnxruntime
import pytest
from asking import asker

from service import __version__
from service.synthesis import library
from service.synthesis.ports import OUTPUTS
from service.synthesis.synthesizer import Synthesizer
from service.web.app import create_app
from service.web.settings import Settings

PATH = "/v2/models/reach"
TYPES = {"FP32": "<f4", "FP64": "<f8", "INT64": "<i8"}
# The level is a constant in one session and an input in the other: sums in another order, metres.
CLOSE = 2e-5


@pytest.fixture(scope="module")
def graph(models):
    """The model's file in onnxruntime, without anything of ours."""
    return onnxruntime.InferenceSession(models / "reach.onnx", providers=["CPUExecutionProvider"])


@pytest.fixture
def tensors(loaded, rng):
    """Five points with three times each: what the graph takes."""
    card = loaded.find("reach").session.card
    low, high = np.array([[c.minimum, c.maximum] for c in card.controls]).T
    points = low + rng.random((5, len(low))) * (high - low)
    times = np.sort(rng.random((5, 3)) * 0.5, axis=1)
    return {"controls": points.astype(np.float32), "time": times.astype(np.float32)}


def listed(name, tensor, datatype="FP32", flat=True):
    data = tensor.ravel().tolist() if flat else tensor.tolist()
    return {"name": name, "shape": list(tensor.shape), "datatype": datatype, "data": data}


def question(tensors, **more):
    return {"inputs": [listed(name, tensor) for name, tensor in tensors.items()], **more}


def binary(tensors, **more):
    """Body of JSON and bytes, and the header that says where they part."""
    inputs, rest = [], b""
    for name, tensor in tensors.items():
        datatype = next(word for word, kind in TYPES.items() if tensor.dtype == np.dtype(kind))
        content = tensor.tobytes()
        size = {"binary_data_size": len(content)}
        shape = list(tensor.shape)
        inputs.append({"name": name, "shape": shape, "datatype": datatype, "parameters": size})
        rest += content
    head = json.dumps({"inputs": inputs, **more}).encode()
    return {"content": head + rest, "headers": {"Inference-Header-Content-Length": str(len(head))}}


def arrays(answer):
    """Outputs of an answer by name, JSON or binary."""
    assert answer.status_code == 200, answer.text
    length = answer.headers.get("inference-header-content-length")
    head = json.loads(answer.content[: None if length is None else int(length)])
    rest = b"" if length is None else answer.content[int(length) :]
    found = {}
    for output in head["outputs"]:
        size = output.get("parameters", {}).get("binary_data_size")
        assert (size is None) == ("data" in output)
        values = output.get("data") if size is None else np.frombuffer(rest[:size], "<f4")
        rest = rest[size or 0 :]
        found[output["name"]] = np.array(values, np.float32).reshape(output["shape"])
    assert rest == b""
    return found


def close(found, expected):
    """Whether tensors agree; a rotation and its negative are one."""
    return {
        name: bool(min(abs(found[name] - s * expected[name]).max() for s in (1, -1)) < CLOSE)
        if found[name].shape == expected[name].shape
        else False
        for name in expected
    }


def test_the_server_says_what_it_speaks(ask):
    told = {"name": "posefield", "version": __version__, "extensions": ["binary_tensor_data"]}
    assert ask("GET", "/v2").json() == told


def test_the_ports_are_those_of_the_graph(ask, graph, loaded):
    model = ask("GET", PATH).json()
    kinds = {"tensor(float)": "FP32", "tensor(int64)": "INT64"}
    given = [*graph.get_inputs(), *graph.get_overridable_initializers()]
    for said, own in ((model["inputs"], given), (model["outputs"], graph.get_outputs())):
        expected = {
            port.name: (kinds[port.type], [n if isinstance(n, int) else -1 for n in port.shape])
            for port in own
        }
        assert {port["name"]: (port["datatype"], port["shape"]) for port in said} == expected
    assert model["versions"] == [loaded.find("reach").session.digest]


def test_a_model_without_performers_has_no_port_for_them(model_path):
    plain = asker(create_app(library.load([model_path]), Settings()))
    names = [port["name"] for port in plain("GET", "/v2/models/reaching").json()["inputs"]]
    assert names == ["controls", "time", "level"]


def test_answers_are_those_of_onnxruntime(ask, graph, tensors):
    found = arrays(ask("POST", f"{PATH}/infer", json=question(tensors)))
    expected = dict(zip(OUTPUTS, graph.run(list(OUTPUTS), tensors), strict=True))
    assert list(found) == list(OUTPUTS)
    assert all(close(found, expected).values())
    # Negative control: the next level is another answer.
    coarse = graph.run(list(OUTPUTS), {**tensors, "level": np.array(1, np.int64)})
    assert not all(close(found, dict(zip(OUTPUTS, coarse, strict=True))).values())


@pytest.mark.parametrize("axes", [(), (1,)])
def test_performer_and_level_are_inputs_like_others(axes, ask, graph, tensors):
    level = np.full(axes, 1, np.int64)
    labels = np.eye(3, dtype=np.float32)[[0, 1, 2, 0, 1]]
    asked = {**tensors, "performer": labels}
    body = question(asked)
    body["inputs"].append(listed("level", level, "INT64"))
    found = arrays(ask("POST", f"{PATH}/infer", json=body))
    expected = graph.run(list(OUTPUTS), {**asked, "level": np.array(1, np.int64)})
    assert all(close(found, dict(zip(OUTPUTS, expected, strict=True))).values())
    one = arrays(ask("POST", f"{PATH}/infer", json=question({**tensors, "performer": labels[:1]})))
    assert not np.array_equal(one["root_position"][1:], found["root_position"][1:])


def test_all_ways_to_send_a_tensor_are_one(ask, tensors):
    ways = [
        {"json": question(tensors)},
        {"json": {"inputs": [listed(n, t, flat=False) for n, t in tensors.items()]}},
        {"json": {"inputs": [listed(n, t, "FP64") for n, t in tensors.items()]}},
        binary(tensors),
        binary({name: tensor.astype("<f8") for name, tensor in tensors.items()}),
    ]
    first, *others = (ask("POST", f"{PATH}/infer", **way).content for way in ways)
    assert [other == first for other in others] == [True] * len(others)


def test_outputs_come_as_they_are_asked_for(ask, tensors):
    json_only = ask("POST", f"{PATH}/infer", json=question(tensors))
    assert json_only.headers["content-type"] == "application/json"
    outputs = [
        {"name": "sigma"},
        {"name": "rotations", "parameters": {"binary_data": False}},
        {"name": "root_position"},
    ]
    told = {"outputs": outputs, "parameters": {"binary_data_output": True, "priority": 3}}
    mixed = ask("POST", f"{PATH}/infer", json=question(tensors, **told))
    assert mixed.headers["content-type"] == "application/octet-stream"
    found, whole = arrays(mixed), arrays(json_only)
    assert list(found) == ["sigma", "rotations", "root_position"]
    assert all(np.array_equal(found[name], whole[name]) for name in found)
    assert mixed.content.count(b'"data"') == 1


def test_rows_of_many_are_answered_as_they_are_alone(ask, tensors):
    many = {name: np.concatenate([tensor] * 400) for name, tensor in tensors.items()}
    told = {"parameters": {"binary_data_output": True}}
    found = arrays(ask("POST", f"{PATH}/infer", **binary(many, **told)))
    few = arrays(ask("POST", f"{PATH}/infer", **binary(tensors, **told)))
    for name, tensor in found.items():
        assert len(tensor) == 2000
        assert abs(tensor.reshape(400, 5, *tensor.shape[1:]) - few[name]).max() < CLOSE


def test_a_version_is_a_hash_and_an_id_comes_back(ask, loaded, tensors):
    digest = loaded.find("reach").session.digest
    answer = ask("POST", f"{PATH}/versions/{digest}/infer", json=question(tensors, id="a 1"))
    told = {"model_name": "reach", "model_version": digest, "id": "a 1"}
    assert {name: answer.json()[name] for name in told} == told
    assert "id" not in ask("POST", f"{PATH}/infer", json=question(tensors)).json()
    twice = question(tensors, model_name="reach", model_version=digest)
    assert ask("POST", f"{PATH}/infer", json=twice).status_code == 200
    assert ask("GET", f"{PATH}/versions/{digest}").json() == ask("GET", PATH).json()
    assert ask("GET", f"{PATH}@{digest}/ready").json() == {"name": "reach", "ready": True}


def test_it_is_ready_when_the_service_is(ask):
    assert ask("GET", "/v2/health/live").json() == {"live": True}
    assert ask("GET", "/v2/health/ready").json() == {"ready": True}
    answer = asker(create_app(library.Library({}), Settings()))("GET", "/v2/health/ready")
    assert (answer.status_code, answer.json()["error"]) == (503, "there is no model")


def test_all_versions_that_answer_are_listed(loaded, model_path, tensors):
    newest = loaded.find("reach")
    before = Synthesizer("reach", library.load([model_path]).find("reaching").session)
    both = asker(create_app(library.Library({"reach": newest}, (before,)), Settings()))
    digests = [newest.session.digest, before.session.digest]
    assert both("GET", PATH).json()["versions"] == digests
    asked = question(tensors)
    for digest in digests:
        answer = both("POST", f"{PATH}/versions/{digest}/infer", json=asked).json()
        assert answer["model_version"] == digest


def test_what_answers_now_is_kept_by_nobody(ask, loaded):
    versions = f"{PATH}/versions/{loaded.find('reach').session.digest}"
    for path in (PATH, f"{PATH}/ready", versions, f"{versions}/ready"):
        headers = ask("GET", path).headers
        assert (headers["cache-control"], "etag" in headers) == ("no-store", False)


def test_what_lies_outside_the_samples_is_said(ask, tensors):
    assert "parameters" not in ask("POST", f"{PATH}/infer", json=question(tensors)).json()
    tensors["controls"][[1, 3], 2] = 500.0
    said = ask("POST", f"{PATH}/infer", json=question(tensors)).json()["parameters"]["warnings"]
    assert said.startswith("turn of 2 rows lies outside what was sampled, ")


def spoiled(change):
    """A request body in which something is changed."""

    def made(tensors):
        body = question(tensors)
        change(body)
        return {"json": body}

    return made


def put(index, **values):
    return spoiled(lambda body: body["inputs"][index].update(values))


def number(name, place, value):
    def made(tensors):
        tensors[name][place] = value
        return binary(tensors)

    return made


def cut(tensors):
    whole = binary(tensors)
    return {**whole, "content": whole["content"][:-4]}


def more(tensors):
    whole = binary(tensors)
    return {**whole, "content": whole["content"] + b"1234"}


def both(tensors):
    body = question(tensors)
    body["inputs"][0]["parameters"] = {"binary_data_size": 80}
    return {"json": body}


WRONG = [
    # body, status, problem, pointer, words
    (spoiled(lambda b: b.pop("inputs")), 400, "bad-body", "/inputs", "missing"),
    (spoiled(lambda b: b.update(frames=1)), 400, "bad-body", "/frames", "unknown"),
    (spoiled(lambda b: b.update(id=1)), 400, "bad-body", "/id", "str"),
    (spoiled(lambda b: b.update(model_name="walk")), 422, "invalid-field", "/model_name", "as in"),
    (
        spoiled(lambda b: b.update(model_version="1")),
        422,
        "invalid-field",
        "/model_version",
        "expected",
    ),
    (put(0, datatype="FP16"), 400, "bad-body", "/inputs/0/datatype", "FP16"),
    (put(0, shape=[5.5, 4]), 400, "bad-body", "/inputs/0/shape/0", "multiple of 1"),
    (put(0, shape=[-1, 4]), 400, "bad-body", "/inputs/0/shape/0", ">= 0"),
    (put(0, data=[True] * 20), 400, "bad-body", "/inputs/0/data/0", "bool"),
    (put(0, data=["1"] * 20), 400, "bad-body", "/inputs/0/data/0", "str"),
    (put(0, data=[1.0] * 19), 422, "invalid-field", "/inputs/0/data", "[19], expected [5, 4]"),
    (put(0, data=[[1.0] * 5] * 4), 422, "invalid-field", "/inputs/0/data", "[4, 5], expected"),
    (put(0, data=[[1.0], [1.0, 2.0]]), 422, "invalid-field", "/inputs/0/data", "several lengths"),
    (put(0, shape=[4, 5]), 422, "invalid-field", "/inputs/0", "[4, 5], expected [4, 4]"),
    (put(0, shape=[20]), 422, "invalid-field", "/inputs/0", "expected FP32 or FP64 of two axes"),
    (put(0, shape=[0, 4], data=[]), 422, "invalid-field", "/inputs/0", "not empty"),
    (put(1, shape=[15, 1]), 422, "invalid-field", "/inputs/1", "[15, 1], expected [5, 1]"),
    (put(1, shape=[5, 0], data=[]), 422, "invalid-field", "/inputs/1", "not empty"),
    (put(0, datatype="INT64"), 422, "invalid-field", "/inputs/0/data", "expected whole numbers"),
    (put(1, name="times"), 422, "invalid-field", "/inputs/1/name", "'times', expected each of"),
    (put(1, name="controls"), 422, "invalid-field", "/inputs/1/name", "at most once"),
    (spoiled(lambda b: b["inputs"].pop()), 422, "invalid-field", "/inputs", "time: missing"),
    (spoiled(lambda b: b["inputs"][0].pop("data")), 422, "invalid-field", "/inputs/0", "either"),
    (both, 422, "invalid-field", "/inputs/0", "expected either data or binary_data_size"),
    (cut, 422, "invalid-field", "/inputs/1", "56 bytes, expected 60 for shape [5, 3]"),
    (more, 422, "invalid-field", "/inputs", "4 bytes more"),
    (put(1, name="performer"), 422, "invalid-field", "/inputs", "time: missing"),
    (number("controls", (3, 2), np.nan), 422, "invalid-field", "/inputs/0", "[3, 2] is nan deg"),
    (number("controls", (3, 2), 1e30), 422, "invalid-field", "/inputs/0", "[3, 2] is 1e+30 deg"),
    (number("time", (2, 1), -0.5), 422, "invalid-field", "/inputs/1", "[2, 1] is -0.5 s"),
    (
        number("time", (4, 2), 99),
        422,
        "invalid-field",
        "/inputs/1",
        "[4, 2] is 99 s, expected 0 to",
    ),
]


@pytest.fixture
def refuse(ask):
    def asked(status, kind, method, path, **content):
        answer = ask(method, path, **content)
        problem = answer.json()
        assert (answer.status_code, problem["status"]) == (status, status), problem
        assert problem["type"] == f"urn:posefield:problem:{kind}"
        # Clients of the protocol read this member of whatever is refused, and no other.
        assert problem["error"] == problem["detail"]
        return problem

    return asked


@pytest.mark.parametrize(("made", "status", "kind", "pointer", "words"), WRONG)
def test_a_wrong_question_is_pointed_at(made, status, kind, pointer, words, refuse, tensors):
    problem = refuse(status, kind, "POST", f"{PATH}/infer", **made(tensors))
    assert [error["pointer"] for error in problem["errors"]] == [pointer]
    assert words in problem["detail"]


@pytest.mark.parametrize(
    ("name", "tensor", "words"),
    [
        ("level", np.array(9, np.int64), "9, expected 0 to 3"),
        ("level", np.array([0, 1], np.int64), "expected one INT64"),
        ("level", np.array(1, np.float32), "expected one INT64"),
        ("performer", np.ones((2, 3), np.float32), "expected [5, 3] or [1, 3]"),
        ("performer", np.full((1, 3), 2, np.float32), "[0, 0] is 2, expected 0 to 1"),
    ],
)
def test_a_wrong_option_is_pointed_at(name, tensor, words, refuse, tensors):
    given = binary({**tensors, name: tensor})
    problem = refuse(422, "invalid-field", "POST", f"{PATH}/infer", **given)
    assert problem["errors"][0]["pointer"] == "/inputs/2"
    assert words in problem["detail"]


def test_a_wrong_output_is_pointed_at(refuse, tensors):
    for outputs in ([{"name": "pose"}], [{"name": "sigma"}, {"name": "sigma"}]):
        body = question(tensors, outputs=outputs)
        problem = refuse(422, "invalid-field", "POST", f"{PATH}/infer", json=body)
        assert problem["errors"][0]["pointer"] == f"/outputs/{len(outputs) - 1}/name"


def test_controls_beyond_all_sense_are_refused(refuse, loaded):
    known = loaded.find("reach").session.card.controls
    corners = np.array(list(product((-90, 90), repeat=len(known))), np.float32)
    wide = corners * [c.maximum - c.minimum for c in known] + [c.default for c in known]
    asked = {"controls": wide.astype("<f4"), "time": np.zeros((len(wide), 1), "<f4")}
    problem = refuse(422, "outside-samples", "POST", f"{PATH}/infer", **binary(asked))
    assert problem["errors"][0]["pointer"] == "/inputs/0"
    assert re.search(r"row \d+ is so far outside what was sampled that", problem["detail"])


@pytest.mark.parametrize("length", ["-1", "1.5", "x", "9" * 20])
def test_a_length_that_is_none_is_refused(length, refuse, tensors):
    given = binary(tensors)
    given["headers"] = {"Inference-Header-Content-Length": length}
    problem = refuse(400, "bad-parameter", "POST", f"{PATH}/infer", **given)
    assert problem["errors"][0]["parameter"] == "Inference-Header-Content-Length"


def test_a_length_beyond_the_body_is_refused(refuse, tensors):
    given = binary(tensors)
    given["headers"] = {"Inference-Header-Content-Length": "100000"}
    assert (
        "expected 100000 of JSON"
        in refuse(400, "bad-body", "POST", f"{PATH}/infer", **given)["detail"]
    )


@pytest.mark.parametrize("media", ["text/plain", "multipart/form-data"])
def test_another_media_type_is_refused(media, refuse):
    headers = {"content-type": media}
    path = f"{PATH}/infer"
    refuse(415, "unsupported-media-type", "POST", path, content=b"{}", headers=headers)


@pytest.mark.parametrize(
    "path", [f"{PATH}/versions/{'0' * 16}", "/v2/models/nobody/ready", f"{PATH}/versions/1"]
)
def test_an_unknown_version_is_refused(path, refuse):
    refuse(404, "unknown-model", "GET", path)


def test_every_error_under_this_path_has_the_member_and_no_other(refuse, ask):
    refuse(404, "no-such-path", "GET", "/v2/repository/index")
    refuse(405, "method-not-allowed", "GET", f"{PATH}/infer")
    refuse(400, "bad-parameter", "GET", "/v2?verbose=1")
    assert "error" not in ask("GET", "/v1/nothing").json()


def test_limits_are_known_before_anything_is_asked(loaded, tensors):
    few = asker(create_app(loaded, Settings(inference_poses=14, inference_body_limit=3000)))
    answer = few("POST", f"{PATH}/infer", json=question(tensors))
    assert (answer.status_code, answer.json()["error"]) == (
        422,
        "15 poses in all, expected at most 14",
    )
    answer = few("POST", f"{PATH}/infer", content=b" " * 3001)
    assert (answer.status_code, answer.json()["status"]) == (413, 413)
    fitting = {name: tensor[:4] for name, tensor in tensors.items()}
    assert few("POST", f"{PATH}/infer", json=question(fitting)).status_code == 200


def test_as_json_there_are_fewer_poses(refuse, ask, tensors):
    many = {
        "controls": tensors["controls"][:1],
        "time": np.linspace(0, 0.5, 10_001, dtype=np.float32)[None],
    }
    problem = refuse(422, "invalid-field", "POST", f"{PATH}/infer", **binary(many))
    assert problem["detail"] == "10001 poses in all, expected at most 10000"
    told = {"parameters": {"binary_data_output": True}, "outputs": [{"name": "root_position"}]}
    assert ask("POST", f"{PATH}/infer", **binary(many, **told)).status_code == 200
