"""Tests of HTTP caching: entity tags and lifetimes."""

from dataclasses import replace
from urllib.parse import urlencode

import pytest
import recorded
from asking import asker

from posefield.http import responses
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry.model_registry import ModelRegistry

PURE = ("pose?time=0.25&", "clip.usdc?", "clip.json?", "clip.usda?", "clip.bvh?")


def asked(controls, rest, model="reach"):
    return f"/v1/models/{model}/{rest}{urlencode(controls)}"


@pytest.mark.parametrize("rest", PURE)
def test_what_a_client_has_is_not_sent_again(rest, ask, controls):
    url = asked(controls, rest)
    first = ask("GET", url)
    again = ask("GET", url, headers={"if-none-match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    for name in ("etag", "cache-control", "vary"):
        assert again.headers.get(name) == first.headers.get(name)
    other = ask("GET", url, headers={"if-none-match": '"other"'})
    assert (other.status_code, other.content) == (200, first.content)


@pytest.mark.parametrize(
    ("given", "held"),
    [('"a"', True), ('W/"a"', True), ('"b", "a"', True), ("*", True), ('"b"', False), ("a", False)],
)
def test_an_if_none_match_is_a_list_compared_weakly(given, held):
    assert responses.matches_tag(given, '"a"') is held


def test_a_tag_is_known_without_asking_the_model(loaded, controls):
    model = loaded.find("reach")
    session, calls = recorded.session(model.session)
    ask = asker(create_app(ModelRegistry({"reach": replace(model, session=session)}), Settings()))
    url = asked(controls, "clip.usdc?")
    tag = ask("GET", url).headers["etag"]
    calls.clear()
    assert ask("GET", url, headers={"if-none-match": tag}).status_code == 304
    assert calls == []
    # Negative control: an answer takes calls.
    assert ask("GET", url).status_code == 200
    assert calls != []


def test_tags_differ_wherever_answers_may(ask, controls):
    other = {**controls, "turn": controls["turn"] + 1.0}
    urls = [
        asked(controls, "clip.usdc?"),
        asked(controls, "clip.usdz?"),
        asked(controls, "clip.usda?"),
        asked(other, "clip.usda?"),
        asked(controls, "clip.usda?level=1&"),
        asked(controls, "clip.usda?fps=31&"),
    ]
    gzip = {"accept-encoding": "gzip"}
    tags = [ask("GET", url, headers=gzip).headers["etag"] for url in urls]
    for coding in ("identity", "zstd"):
        tags.append(ask("GET", urls[2], headers={"accept-encoding": coding}).headers["etag"])
    assert len(set(tags)) == len(tags)


def test_a_tag_holds_for_the_name_and_the_hash(ask, loaded, controls):
    identity = loaded.find("reach").identity
    named, hashed = (ask("GET", asked(controls, "clip.bvh?", m)) for m in ("reach", identity))
    assert named.headers["etag"] == hashed.headers["etag"]
    assert named.headers["cache-control"] == "public, no-cache"
    assert hashed.headers["cache-control"] == "public, max-age=31536000, immutable"


def test_tags_follow_from_the_code(tmp_path, monkeypatch):
    before = responses.code_digest()
    assert before == responses.code_digest()
    # Another version of a library, as it would be found before the one that is installed.
    about = tmp_path / "numpy-0.0.0.dist-info" / "METADATA"
    about.parent.mkdir()
    about.write_text("Metadata-Version: 2.1\nName: numpy\nVersion: 0.0.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert responses.code_digest() != before


@pytest.mark.parametrize(
    ("method", "path"),
    [("GET", "/livez"), ("GET", "/nowhere"), ("GET", "/v1/models"), ("POST", "/v1/models/x/pose")],
)
def test_what_is_not_for_keeping_says_so(method, path, ask):
    answer = ask(method, path)
    assert answer.headers["cache-control"] == "no-store"
    assert "etag" not in answer.headers


def test_a_head_is_answered_as_a_get_is(ask, controls):
    url = asked(controls, "clip.usdc?")
    head, whole = ask("HEAD", url), ask("GET", url)
    mine = {"x-request-id"}
    first, second = ({k: v for k, v in a.headers.items() if k not in mine} for a in (head, whole))
    assert (head.status_code, head.content, first) == (200, b"", second)
    held = ask("HEAD", url, headers={"if-none-match": head.headers["etag"]})
    assert held.status_code == 304
