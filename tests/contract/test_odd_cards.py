"""Fuzzing of cards: every value of a real card is replaced, deleted or duplicated.

Each card is refused with a message that names the value, or the model opens and serves every kind
of request with the poses of its graph.
"""

import copy
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Any

import jsonschema
import pytest
from asking import asker

from posefield.common.errors import ModelError
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.http.readiness import Readiness
from posefield.inference import onnx_runtime
from posefield.inference import session as sessions
from posefield.inference.session import Session
from posefield.model_file import card_check, checked_file, onnx_file
from posefield.registry.model_registry import FixedRegistry, ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer

DEEP = "[" * 300 + "]" * 300
VALUES = ("null", "true", '"x"', "-1", "0", "1e400", "1e300", "1e-300", "[]", "{}", DEEP, "[null]")
HOLE = "hole"
EVERY, SYSTEM = 100, 3
"""Of so many odd cards, one is tried here, and in the system tests."""
ANSWERED = 10
"""Of so many that open there, one is asked."""

Path = tuple[str | int, ...]


def paths(value: Any, path: Path = ()) -> Iterator[Path]:
    """Paths of a value and of all values in it."""
    yield path
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from paths(inner, (*path, key))


def changed(value: Any, path: Path, change: Any) -> Any:
    """A value with another, or with its container changed, at a path."""
    if not path:
        return change(value)
    other = copy.copy(value)
    other[path[0]] = changed(value[path[0]], path[1:], change)
    return other


def without(key: Any) -> Any:
    def change(container: Any) -> Any:
        items = container.items() if isinstance(container, dict) else enumerate(container)
        kept = {k: v for k, v in items if k != key}
        return kept if isinstance(container, dict) else [*kept.values()]

    return change


def odd(plain: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Entries by name with one value of them changed, as JSON."""
    for name, value in plain.items():
        for path in paths(value):
            holed = json.dumps(changed(value, path, lambda _: HOLE))
            for text in VALUES:
                yield name, holed.replace(f'"{HOLE}"', text)
            if path:
                *parent, key = path
                yield name, json.dumps(changed(value, tuple(parent), without(key)))
            if path and isinstance(key, int):
                yield name, json.dumps(changed(value, tuple(parent), lambda c, k=key: [*c, c[k]]))


class Tried:
    """A model that is opened with odd cards, and asked."""

    def __init__(self, content: bytes, spec: dict[str, Any]) -> None:
        self.onnx = onnx_file.check(content)
        self.runtime = onnx_runtime.open_session(content, "whole")
        self.session: Session = sessions.open_bytes(content, "odd.onnx")
        self.models = FixedRegistry(ModelRegistry({}))
        self.ask = asker(create_app(Readiness(self.models), Settings()))
        schema = {"$ref": "#/components/schemas/ModelCard", "components": spec["components"]}
        self.schema = jsonschema.Draft202012Validator(schema)
        self.expected = self.answers(self.session)

    def opened(self, name: str, text: str) -> Session:
        """Session with one entry of the card changed; raises as opening the file does."""
        entries = {**self.onnx.metadata, f"posefield.{name}": text.encode()}
        card = checked_file.decode_card(entries)
        card_check.check_graph(card, self.onnx.shapes, self.onnx.values)
        onnx_runtime.check(self.runtime, card, "odd.onnx")
        return replace(self.session, card=card)

    def get(self, path: str = "", **query: Any) -> Any:
        answer = self.ask("GET", f"/v1/models/odd{path}", params=query)
        assert answer.status_code == 200, f"{path}: {answer.text}"
        return answer.json() if "json" in answer.headers["content-type"] else answer.content

    def post(self, path: str, **body: Any) -> Any:
        answer = self.ask("POST", f"/v1/models/odd{path}", json=body)
        assert answer.status_code == 200, f"{path}: {answer.text}"
        return answer.json()

    def answers(self, session: Session) -> list[Any]:
        """Request each kind of answer of a session; return the parts that the graph decides."""
        card = session.card
        self.models.registry = ModelRegistry({"odd": Synthesizer("odd", session)})
        self.schema.validate(self.get())
        controls = {control.name: control.default for control in card.controls}
        pose = self.get("/pose.json", **controls, time=0, exact="none")
        crowd = self.post("/crowd.json", controls=controls, time=0.1)
        across, along = [*controls][:2]
        sigma = self.get("/sigma.json", across=across, along=along, columns=2, rows=2)
        self._ask_the_rest(card, controls)
        return [pose["rotations"], crowd["rotations"], sigma["sigma"]]

    def _ask_the_rest(self, card: Any, controls: dict[str, float]) -> None:
        who = {"performer": card.performers[0]} if card.performers else {}
        sigmas = self.get("/pose.json", time=0, joint_sigma="true", **who)["trust"]["joint_sigma"]
        assert len(sigmas) == len(card.skeleton)
        self.get("/clip.usdc", level=len(card.levels) - 1, extrapolate="ok")
        if card.roles:
            self.get("/clip.bvh", names="mixamo", **controls)
        near = self.get("/why", **controls)["nearest"]
        assert all(isinstance(one["weight"], float) for one in near)
        assert len(self.get("/suggestions", count=2)["suggestions"]) == 2
        target = {"joint": card.skeleton.names[-1], "position": [0.1, 1.0, 0.3]}
        for at in ("end", "event") if card.event else ("end",):
            self.post("/pose.json", controls=controls, times=[0], targets=[{**target, "at": at}])
        if card.feet and card.root == "travelling":
            self.get("/clip.npz", **controls, feet="stand")
        drawn = card.kriging.covariance != "spherical"
        self.get("/pose.json", **controls, time=0, take=7 * drawn, detail="true")
        if card.cyclic:
            self.get("/crowd.usdc", count=2, seconds=0.5)


LABELLED = pytest.param("labelled_path", marks=pytest.mark.system)


@pytest.fixture(scope="module", params=[LABELLED, "measured_walk_path"])
def tried(request, spec):
    return Tried(request.getfixturevalue(request.param).read_bytes(), spec)


def assert_all_are_refused_or_answer(tried, every, answered):
    own = {k: t for k, t in tried.onnx.metadata.items() if k.startswith("posefield.")}
    plain = {key.removeprefix("posefield."): json.loads(text) for key, text in own.items()}
    counts, wrong = {"refused": 0, "opened": 0}, []
    for name, text in islice(odd(plain), 0, None, every):
        try:
            session = tried.opened(name, text)
        except (ValueError, ModelError) as fault:
            counts["refused"] += 1
            if not re.match(r"(odd\.onnx: )?(its .*|model format .{0,60}, .*)", str(fault)):
                wrong.append(f"{name}: {text[:200]}: says {fault}")
            assert len(str(fault)) < 250
            continue
        counts["opened"] += 1
        if counts["opened"] % answered == 0:
            try:
                assert tried.answers(session) == tried.expected
            except Exception as fault:
                wrong.append(f"{name}: {text[:200]}: {type(fault).__name__}: {fault}")
    assert not wrong
    return counts


def test_some_odd_cards_are_refused_or_answer(tried):
    counts = assert_all_are_refused_or_answer(tried, EVERY, 1)
    assert counts["refused"] > 40 and counts["opened"] > 2


@pytest.mark.system
def test_many_odd_cards_are_refused_or_answer(tried):
    counts = assert_all_are_refused_or_answer(tried, SYSTEM, ANSWERED)
    assert counts["refused"] > 1300 and counts["opened"] > 130


@pytest.mark.parametrize("lost", ["joint_sigma", "examples"])
def test_a_card_that_was_not_checked_fails_when_asked(tried, lost):
    """Negative control of both: the questions do reach the values of the card."""
    card = replace(tried.session.card, **{lost: getattr(tried.session.card, lost)[:-1]})
    with pytest.raises(Exception):  # noqa: B017
        tried.answers(replace(tried.session, card=card))
