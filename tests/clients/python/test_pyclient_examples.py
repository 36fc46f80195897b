"""The examples beside the contract: the client asks as they do, waiting or not, and is answered."""

import asyncio
import json
import re
from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

import httpx
import numpy as np
import pytest
from asking import contains, listening
from posefield_client import NOTHING, AsyncClient, Client, asking
from posefield_client.files import CLIP, CLIPS, CROWD, WALK
from posefield_client.generated import OPERATIONS

from service.synthesis import library
from service.web.app import create_app
from service.web.settings import Settings

EXAMPLES = Path(__file__).parents[3] / "api/examples"

# What the client does not ask for, and why.
ANY_FORMAT = "negotiates what the paths that end in a format answer with"
WRAPPED = "the same numbers as MessagePack, which is read into arrays"
ENGINES = "spoken by clients of the Open Inference Protocol"
NOT_ASKED = {
    **dict.fromkeys([f"get{what}" for what in ("Pose", "Clip", "Crowd", "Sigma")], ANY_FORMAT),
    **dict.fromkeys([f"query{what}" for what in ("Pose", "Clip", "Crowd", "Sigma")], ANY_FORMAT),
    "queryClips": ANY_FORMAT,
    **{
        f"{ask}{what}{ending}": WRAPPED
        for ask in ("get", "query")
        for what in ("Pose", "Sigma")
        for ending in ("Json", "Npz", "Arrow")
    },
    **{name: ENGINES for name, asked in OPERATIONS.items() if asked.path.startswith("/v2")},
    **dict.fromkeys(["getViewer", "getDocs", "getProblems", "getContract"], "for people to read"),
    "getMetrics": "for Prometheus",
    "getContractJson": "asked by itself where an answer is none of the contract",
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


def clip(ending):
    return lambda client, r: model(client, r).clip(**words(r)).content(ending)


def walk(ending):
    def ask(client, r):
        given = words(r)
        if "camera" in given:
            given["camera"] = [float(each) for each in given["camera"].split(",")]
        return model(client, r).crowd_walk(**given).content(ending)

    return ask


CALLS = {
    "listModels": lambda client, r: client.models(),
    "getLiveness": lambda client, r: client.live(),
    "getReadiness": lambda client, r: client.ready(),
    "getModel": lambda client, r: model(client, r).card,
    "getPoseMsgpack": lambda client, r: model(client, r).pose(**words(r)),
    "queryPoseMsgpack": lambda client, r: model(client, r).pose(**words(r)),
    "getWhy": lambda client, r: model(client, r).why(**words(r)),
    "queryWhy": lambda client, r: model(client, r).why(**words(r)),
    "getSuggestions": lambda client, r: model(client, r).suggest(**words(r)),
    "getSigmaMsgpack": lambda client, r: model(client, r).sigma(**words(r)),
    "querySigmaMsgpack": lambda client, r: model(client, r).sigma(**words(r)),
    "queryCrowdMsgpack": lambda client, r: model(client, r).crowd(**words(r)).numbers,
    "queryCrowdArrow": lambda client, r: model(client, r).crowd(**words(r)).table(),
    "getClipMsgpack": lambda client, r: model(client, r).clip(**words(r)).numbers,
    **{f"getClip{end.capitalize()}": clip(end) for end in CLIP if end != "msgpack"},
    **{f"queryClip{end.capitalize()}": clip(end) for end in CLIP},
    **{f"getCrowd{end.capitalize()}": walk(end) for end in WALK},
    **{
        f"queryCrowd{end.capitalize()}": lambda client, r, end=end: (
            model(client, r).crowd(**words(r)).content(end)
        )
        for end in CROWD
        if end in ("json", "npz")
    },
    **{
        f"queryClips{end.capitalize()}": lambda client, r, end=end: (
            model(client, r).clips(**words(r)).content(end)
        )
        for end in CLIPS
    },
}


class Recorder:
    """The service, and the requests that it was sent."""

    def __init__(self, app):
        self.app = app
        self.asked = []

    async def __call__(self, scope, receive, send):
        message = await receive()
        target = (scope["raw_path"] + b"?" + scope["query_string"]).decode().rstrip("?")
        self.asked.append((scope["method"], target, message.get("body", b"")))
        queue = [message]

        async def again():
            return queue.pop() if queue else await receive()

        await self.app(scope, again, send)


@pytest.fixture(scope="module")
def recorder(models):
    return Recorder(create_app(library.load([models]), Settings()))


@pytest.fixture(scope="module")
def place(recorder):
    with listening(recorder) as address:
        yield address


def read(name, part):
    return json.loads((EXAMPLES / name / f"{part}.json").read_bytes())


def by_waiting(place, call, request):
    with Client(place, cache=NOTHING) as client:
        return call(client, request)


def by_awaiting(place, call, request):
    async def ask():
        async with AsyncClient(place, cache=NOTHING) as client:
            return await call(client, request)

    return asyncio.run(ask())


def test_every_operation_is_asked_for_or_there_is_a_reason():
    assert set(CALLS) | set(NOT_ASKED) == set(OPERATIONS)
    assert not set(CALLS) & set(NOT_ASKED)


@pytest.mark.parametrize("ask", [by_waiting, by_awaiting])
@pytest.mark.parametrize("name", CALLS)
def test_it_is_asked_as_in_the_example_and_answered(name, ask, place, recorder, monkeypatch):
    # The client takes POST where a line would be too long; here any is.
    if name.startswith("query"):
        monkeypatch.setattr(asking, "LONGEST", 0)
    request = read(name, "request")
    recorder.asked.clear()
    found = ask(place, CALLS[name], request)
    (sent,) = recorder.asked
    assert alike(*sent) == alike(
        request["method"], request["path"], json.dumps(request.get("body", "")).encode()
    )

    as_promised(name, request, found, place)


def as_promised(name, request, found, place):
    """What the client gives is the example's body, or for a file what the service sends."""
    if isinstance(found, bytes):
        sent = httpx.request(request["method"], place + request["path"], json=request.get("body"))
        assert found == sent.content
    elif name in SHOWN_BY_TABLES:
        assert table_of(found) == SHOWN_BY_TABLES[name]
    else:
        # Of arrays the example of the same question in JSON says what is in them.
        expected = read(name.replace("Msgpack", "Json"), "response")["body"]
        whole = {"models": plain(found)} if name == "listModels" else plain(found)
        assert contains(whole, expected)


SHOWN_BY_TABLES = {"getClipMsgpack": (25.0, 13), "queryCrowdArrow": ["levels", 2]}


def table_of(found):
    """What is told of a clip's numbers, or of a table."""
    if hasattr(found, "rate"):
        return found.rate, len(found.times)
    return ["levels" if "levels" in found.column_names else found.column_names, found.num_rows]


def test_another_answer_would_be_seen():
    """Negative control of `contains`."""
    whole = {"models": [{"name": "reach", "versions": []}]}
    assert contains(whole, {"models": [{"name": "reach"}]})
    assert not contains(whole, {"models": [{"name": "walk"}]})
    assert not contains(whole, {"models": []})
    assert not contains(whole, {"total": 1})


def alike(method, target, body):
    """What a request says, in whatever order."""
    path, _, query = target.partition("?")
    said = sorted((name, value(text)) for name, text in parse_qsl(query))
    content = json.loads(body) if body.strip(b'"') else None
    return method, path, said, content


@pytest.mark.parametrize("name", CALLS)
def test_both_clients_are_told_the_same(name, place):
    request = read(name, "request")
    waited = by_waiting(place, CALLS[name], request)
    awaited = by_awaiting(place, CALLS[name], request)
    assert plain(waited) == plain(awaited)


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
