"""Tests of the client with the contract's examples.

The asynchronous client is the same code, see test_pyclient_generated.
"""

import json
import re
from urllib.parse import parse_qsl, urlsplit

import contract_examples
import httpx
import numpy as np
import pytest
from asking import contains, listening
from contract_examples import CASES
from posefield_client import Client
from posefield_client.generated import OPERATIONS

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry import model_registry

CLIP, CLIPS, CROWD, WALK = (
    OPERATIONS[f"{name}InFormat"].formats
    for name in ("getClip", "queryClips", "queryCrowd", "getCrowd")
)
PERFORMANCE, ARCHIVES = (
    OPERATIONS[f"query{name}InFormat"].formats for name in ("Performance", "Performances")
)

# What the client does not ask for, and why.
ANY_FORMAT = "negotiates the formats that end other paths"
WRAPPED = "the same numbers as MessagePack, which is read into arrays"
NOT_ASKED = {
    **{
        (f"{ask}{noun}", None): ANY_FORMAT
        for ask in ("get", "query")
        for noun in ("Pose", "Clip", "Crowd", "Sigma")
    },
    ("queryClips", None): ANY_FORMAT,
    ("queryPerformances", None): ANY_FORMAT,
    **{
        (f"{ask}{noun}InFormat", form): WRAPPED
        for ask in ("get", "query")
        for noun in ("Pose", "Sigma")
        for form in ("json", "npz", "arrow")
    },
    **{
        (name, None): "for people to read"
        for name in (
            "getViewer",
            "getDocs",
            "getProblems",
            "getContract",
            "getContractJson",
        )
    },
    ("getContract", None): "is in `generated`",
    ("getContractJson", None): "is in `generated`",
    ("getMetrics", None): "for Prometheus",
}


def model(client, request):
    return client.model(urlsplit(request["path"]).path.split("/")[3])


def words(request):
    """Arguments as the example says them, in the query or in the body."""
    if "body" in request:
        return dict(request["body"])
    given = {}
    for name, text in parse_qsl(urlsplit(request["path"]).query):
        given.setdefault(name, []).append(value(text))
    times = {"times": given.pop("time")} if "time" in given else {}
    targets = [target(words) for words in given.pop("target", ())]
    held = {"targets": targets} if targets else {}
    return {name: values[0] for name, values in given.items()} | times | held


def target(words):
    """A target as the client is given it, of JOINT@MOMENT:X,Y,Z."""
    joint, moment, place = re.fullmatch("(.+)@(.+):(.+)", words).groups()
    when = "at" if moment.isalpha() else "time"
    return {"joint": joint, "position": json.loads(f"[{place}]"), when: value(moment)}


def value(text):
    """A number as the client is given it, or a word."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def asking(name):
    """A call of a method of a model."""
    return lambda client, r: getattr(model(client, r), name)(**words(r))


def walk(client, r):
    given = words(r)
    if "camera" in given:
        given["camera"] = [float(each) for each in given["camera"].split(",")]
    return model(client, r).crowd_walk(**given)


def files(operation, formats, ask):
    """Calls that get the files of an operation, of each format."""
    return {
        (operation, form): lambda client, r, form=form: ask(client, r).content(form)
        for form in formats
    }


CALLS = {
    ("listModels", None): lambda client, r: client.models(),
    ("listCharacters", None): lambda client, r: client.characters(),
    ("getLiveness", None): lambda client, r: client.live(),
    ("getReadiness", None): lambda client, r: client.ready(),
    ("getModel", None): lambda client, r: model(client, r).card,
    ("getCharacter", None): lambda client, r: model(client, r).character(),
    **{(f"{way}PoseInFormat", "msgpack"): asking("pose") for way in ("get", "query")},
    **{(f"{way}Why", None): asking("why") for way in ("get", "query")},
    ("getSuggestions", None): asking("suggest"),
    **{(f"{way}SigmaInFormat", "msgpack"): asking("sigma") for way in ("get", "query")},
    **files("getClipInFormat", CLIP, asking("clip")),
    **files("queryClipInFormat", CLIP, asking("clip")),
    **files("getCrowdInFormat", WALK, walk),
    **files("queryCrowdInFormat", CROWD, asking("crowd")),
    **files("queryClipsInFormat", CLIPS, asking("clips")),
    ("queryPerformance", None): lambda client, r: client.plan(r["body"]),
    **files("queryPerformanceInFormat", PERFORMANCE, lambda c, r: c.performance(r["body"])),
    **files("queryPerformancesInFormat", ARCHIVES, lambda c, r: c.performances(**r["body"])),
    ("queryPerformanceInFormat", "msgpack"): (
        lambda client, r: client.performance(r["body"]).numbers
    ),
    ("getClipInFormat", "msgpack"): lambda client, r: model(client, r).clip(**words(r)).numbers,
    ("queryCrowdInFormat", "msgpack"): lambda client, r: model(client, r).crowd(**words(r)).numbers,
}
EACH_CALL = pytest.mark.parametrize(
    ("name", "form"), CALLS, ids=["-".join(filter(None, case)) for case in CALLS]
)


# Controls that make the line of a question too long, so that the client asks by POST.
PADDING = {f"padding_{number:03}": 0.0 for number in range(300)}


def padded(name, request):
    """The request of an example with padding where the client would ask by GET without it."""
    if not re.match("query(Pose|Why|Sigma|Clip(?!s))", name):
        return request
    body = request["body"]
    return {**request, "body": {**body, "controls": body.get("controls", {}) | PADDING}}


def unpadded(content):
    """The body of a request as it would be without padding."""
    if b"padding_" not in content:
        return content
    body = json.loads(content)
    for name in PADDING:
        del body["controls"][name]
    return json.dumps(body).encode()


class Recorder:
    """The service, and the requests that it was sent, without their padding."""

    def __init__(self, app):
        self.app = app
        self.asked = []

    async def __call__(self, scope, receive, send):
        content, more = b"", True
        while more:
            message = await receive()
            content, more = content + message.get("body", b""), message.get("more_body", False)
        content = unpadded(content)
        target = (scope["raw_path"] + b"?" + scope["query_string"]).decode().rstrip("?")
        self.asked.append((scope["method"], target, content))
        headers = [each for each in scope["headers"] if each[0] != b"content-length"]
        scope = {**scope, "headers": [*headers, (b"content-length", b"%d" % len(content))]}
        queue = [{"type": "http.request", "body": content, "more_body": False}]

        async def again():
            return queue.pop() if queue else await receive()

        await self.app(scope, again, send)


@pytest.fixture(scope="module")
def recorder(models):
    return Recorder(create_app(model_registry.load([models]), Settings()))


@pytest.fixture(scope="module")
def place(recorder):
    with listening(recorder) as address:
        yield address


def asked(place, call, request):
    with Client(place, cache_bytes=0, checks=False) as client:
        return call(client, request)


def test_every_operation_is_asked_for_or_there_is_a_reason():
    assert set(CALLS) | set(NOT_ASKED) == set(CASES)
    assert not set(CALLS) & set(NOT_ASKED)


@EACH_CALL
def test_it_is_asked_as_in_the_example_and_answered(name, form, place, recorder):
    request = contract_examples.request(name, form)
    recorder.asked.clear()
    found = asked(place, CALLS[name, form], padded(name, request))
    (sent,) = recorder.asked
    assert alike(*sent) == alike(
        request["method"], request["path"], json.dumps(request.get("body", "")).encode()
    )

    as_promised(name, form, request, found, place)


def as_promised(name, form, request, found, place):
    """Assert that the client returns the example's body, or the file that the service sends."""
    if isinstance(found, bytes):
        sent = httpx.request(request["method"], place + request["path"], json=request.get("body"))
        assert found == sent.content
    elif (name, form) == ("getClipInFormat", "msgpack"):
        assert (found.rate, len(found.times)) == (25.0, 13)
    else:
        # Of arrays the example of the same question in JSON says what is in them.
        expected = contract_examples.response(name, form and "json")["body"]
        whole = {WRAPPERS[name]: plain(found)} if name in WRAPPERS else plain(found)
        assert contains(whole, expected)


WRAPPERS = {"listModels": "models", "queryPerformance": "trust"}
"""Keys of documents of which the client returns the only value."""


def test_another_answer_would_be_seen():
    """Negative control of `contains`."""
    whole = {"models": [{"name": "reach", "versions": []}]}
    assert contains(whole, {"models": [{"name": "reach"}]})
    assert not contains(whole, {"models": [{"name": "walk"}]})
    assert not contains(whole, {"models": []})
    assert not contains(whole, {"total": 1})


def alike(method, target, body):
    """Return the content of a request, sorted."""
    path, _, query = target.partition("?")
    said = sorted((name, value(text)) for name, text in parse_qsl(query))
    content = json.loads(body) if body.strip(b'"') else None
    return method, path, said, content


def plain(found):
    """As values that are equal or not."""
    if hasattr(found, "__struct_fields__"):
        return {name: plain(getattr(found, name)) for name in found.__struct_fields__}
    if isinstance(found, tuple):
        return [plain(each) for each in found]
    return found.tolist() if isinstance(found, np.ndarray) else found


def test_another_request_would_be_seen():
    """Negative control of `alike`."""
    said = alike("GET", "/v1/models/reach/pose?turn=20&time=0&time=0.5", b"")
    assert said != alike("GET", "/v1/models/reach/pose?turn=21&time=0&time=0.5", b"")
    assert said != alike("GET", "/v1/models/reach/pose?turn=20&time=0", b"")
    assert alike("POST", "/x", b'{"a": 1}') != alike("POST", "/x", b'{"a": 2}')
