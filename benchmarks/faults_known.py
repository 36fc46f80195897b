"""Questions whose right answers are known: made in this process, one at a time, nothing amiss."""

import asyncio
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from urllib.parse import unquote, urlencode, urlsplit

import numpy as np
import onnx
import orjson
from onnx import numpy_helper

from posefield.encode.archives import ARCHIVE_WRITERS
from posefield.encode.formats import CLIP_ENCODERS, CROWD_ENCODERS, GRID_ENCODERS, POSE_ENCODERS
from posefield.http.api.settings import Settings
from posefield.http.app import App, create_app
from posefield.inference import session
from posefield.model_file import checked_file
from posefield.model_file.model_card import Control
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer

FEWER = 4
"""Each so many questions are enough for a model that is there to be replaced."""
JSON = ("Content-Type: application/json",)


@dataclass(frozen=True)
class Answer:
    """HTTP response; headers by their names in lower case."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def problem(self) -> str | None:
        """Type of the problem that it tells of, `unsaid` in an answer to HEAD; none where it is of
        another form than every problem has."""
        if self.headers.get("content-type") != "application/problem+json":
            return None
        return str(orjson.loads(self.body)["type"]) if self.body else "unsaid"

    def is_like(self, other: "Answer") -> bool:
        """Compare byte for byte, except for values unique to each answer."""
        if (self.status, self.headers.get("etag")) != (other.status, other.headers.get("etag")):
            return False
        if self.status >= 400:
            return self.problem == other.problem
        return self.body == other.body


@dataclass(frozen=True)
class Question:
    """A request to a model: what follows the model's name in its URL, header lines, a body."""

    method: str
    rest: str
    headers: tuple[str, ...] = ()
    body: bytes = b""

    def content(self, model: str) -> bytes:
        """As it travels."""
        lines = [
            f"{self.method} /v1/models/{model}{self.rest} HTTP/1.1",
            "Host: localhost",
            *self.headers,
        ]
        if self.body:
            lines.append(f"Content-Length: {len(self.body)}")
        return "\r\n".join([*lines, "", ""]).encode() + self.body


@dataclass(frozen=True)
class Known:
    """A question to a model by its name, or name@hash, and every answer that is right."""

    question: Question
    model: str
    right: tuple[Answer, ...]

    @property
    def content(self) -> bytes:
        """The request as it travels."""
        return self.question.content(self.model)


def other_version(content: bytes) -> bytes:
    """A model file that is asked the same and answers otherwise."""
    model = onnx.load_from_string(content)
    for tensor in model.graph.initializer:
        if tensor.name == "core":
            values = numpy_helper.to_array(tensor) * np.float32(1.01)
            tensor.CopyFrom(numpy_helper.from_array(values, tensor.name))
    # The checksum is the last entry.
    del model.metadata_props[-1]
    return checked_file.append_checksum(bytes(model.SerializeToString()))


def of(names: Sequence[str], contents: Sequence[bytes]) -> list[Known]:
    """Questions to models of some names, each of which may be of any of the contents; to the first
    of them all there are, and also to each of its versions by its hash."""
    sessions = [session.open_bytes(content, "version") for content in contents]
    questions = [*_questions(sessions[0].card.controls)]
    references = []
    for name in names:
        versions = [Synthesizer(name, one) for one in sessions]
        apps = [create_app(ModelRegistry({name: model}), Settings()) for model in versions]
        requests = questions if name == names[0] else questions[::FEWER]
        questions_of_model = [*requests, *_held(requests, name, apps)]
        answers = [
            [asyncio.run(answered(app, q, name)) for app in apps] for q in questions_of_model
        ]
        for question, right in zip(questions_of_model, answers, strict=True):
            assert right[0].status < 500
            references.append(Known(question, name, tuple(right)))
            if name == names[0]:
                pairs = zip(versions, right, strict=True)
                references += [Known(question, model.identity, (one,)) for model, one in pairs]
    return references


async def answered(app: App, question: Question, model: str) -> Answer:
    """Answer of an application in this process."""
    url = urlsplit(f"/v1/models/{model}{question.rest}")
    pairs = [line.split(": ", 1) for line in ("Host: localhost", *question.headers)]
    scope = {
        "type": "http",
        "http_version": "1.1",
        "method": question.method,
        "scheme": "http",
        "path": unquote(url.path),
        "raw_path": url.path.encode(),
        "query_string": url.query.encode(),
        "root_path": "",
        "headers": [(name.lower().encode(), value.encode()) for name, value in pairs],
    }
    sent: list[dict[str, Any]] = []
    query = iter([{"type": "http.request", "body": question.body, "more_body": False}])

    async def receive() -> dict[str, Any]:
        if (message := next(query, None)) is not None:
            return message
        # Nobody hangs up here.
        await asyncio.Event().wait()
        raise AssertionError

    async def send(message: Any) -> None:
        sent.append(message)

    await app(scope, receive, send)
    headers = {name.decode(): value.decode("latin-1") for name, value in sent[0]["headers"]}
    body = b"".join(message.get("body", b"") for message in sent[1:])
    return Answer(sent[0]["status"], headers, b"" if question.method == "HEAD" else body)


def _held(questions: Sequence[Question], name: str, apps: Sequence[App]) -> Iterator[Question]:
    """Some of them by clients that have the answer of the first version already."""
    for question in [q for q in questions if q.method == "GET"][::3]:
        answer = asyncio.run(answered(apps[0], question, name))
        if tag := answer.headers.get("etag"):
            yield replace(question, headers=(*question.headers, f"If-None-Match: {tag}"))


def _questions(controls: Sequence[Control]) -> Iterator[Question]:
    rng = random.Random(1)
    yield from _poses(controls, rng)
    for extension in CLIP_ENCODERS:
        for _ in range(2):
            query = urlencode({**_point(controls, rng), "fps": rng.choice((25, 60))})
            yield Question("GET", f"/clip.{extension}?{query}")
        body = orjson.dumps({"controls": _point(controls, rng), "fps": 30})
        yield Question("POST", f"/clip.{extension}", JSON, body)
    for extension in CROWD_ENCODERS:
        yield Question("POST", f"/crowd.{extension}", JSON, _crowd(controls, rng, 60))
    for pack in ARCHIVE_WRITERS:
        for extension in ("usdc", "glb"):
            yield Question("POST", f"/clips.{pack}", JSON, _clips(controls, rng, extension, 8))
    yield from _grids(controls, rng)
    yield from _refused(controls, rng)


def _poses(controls: Sequence[Control], rng: random.Random) -> Iterator[Question]:
    for _ in range(60):
        query = urlencode({**_point(controls, rng), "time": round(rng.random(), 3)})
        yield Question("GET", f"/pose?{query}")
    for extension in POSE_ENCODERS:
        query = urlencode({**_point(controls, rng), "time": round(rng.random(), 3), "level": 1})
        yield Question("GET", f"/pose.{extension}?{query}")
        times = [round(rng.random(), 3) for _ in range(5)]
        body = orjson.dumps({"controls": _point(controls, rng), "times": times})
        yield Question("POST", f"/pose.{extension}", JSON, body)
    for coding in ("gzip", "zstd"):
        query = urlencode({**_point(controls, rng), "time": 0.5})
        yield Question("GET", f"/pose?{query}", (f"Accept-Encoding: {coding}",))
    query = urlencode({**_point(controls, rng), "time": 0.5})
    yield Question("HEAD", f"/pose?{query}")
    yield Question("GET", f"/pose?{query}", ("Accept: application/vnd.msgpack",))


def _grids(controls: Sequence[Control], rng: random.Random) -> Iterator[Question]:
    point = _point(controls, rng)
    yield Question("POST", "/why", JSON, orjson.dumps({"controls": point}))
    first, second = (control.name for control in controls[:2])
    for extension in GRID_ENCODERS:
        yield Question("GET", f"/sigma.{extension}?{urlencode({'across': first, 'along': second})}")


def _refused(controls: Sequence[Control], rng: random.Random) -> Iterator[Question]:
    """Yield questions that violate the contract, or have no answer."""
    point = _point(controls, rng)
    query = urlencode({**point, "time": 0.1})
    yield Question("GET", f"/pose?{query}&time=nan")
    yield Question("GET", f"/pose?{query}&more=1")
    yield Question("GET", f"/clip.fbx?{query}")
    yield Question("GET", f"/pose?{query}", ("Accept: image/png",))
    yield Question("DELETE", "/pose")
    yield Question("POST", "/pose", JSON, b'{"controls": {"stature": 1e400}, "times": [0]}')
    yield Question("POST", "/pose", JSON, b'{"controls": {')
    yield Question("POST", "/pose", ("Content-Type: text/plain",), b"[]")
    yield Question("POST", "/clip.usdc", JSON, orjson.dumps({"controls": point, "fps": -1}))
    yield Question(
        "POST", "/crowd.arrow", JSON, orjson.dumps({"controls": point, "time": [0, "x"]})
    )
    yield Question("POST", "/clips.zip", JSON, b'{"format": "usdc", "clips": []}')


def _point(controls: Sequence[Control], rng: random.Random) -> dict[str, float]:
    return {c.name: round(rng.uniform(c.minimum, c.maximum), 3) for c in controls}


def _crowd(controls: Sequence[Control], rng: random.Random, count: int) -> bytes:
    points = [_point(controls, rng) for _ in range(count)]
    columns = {c.name: [point[c.name] for point in points] for c in controls}
    return orjson.dumps({"controls": columns, "time": [round(rng.random(), 3) for _ in points]})


def _clips(controls: Sequence[Control], rng: random.Random, extension: str, count: int) -> bytes:
    clips = [{"controls": _point(controls, rng), "fps": 60} for _ in range(count)]
    return orjson.dumps({"format": extension, "clips": clips})
