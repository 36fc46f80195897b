"""Tests of request heads: length of the URL, size of the headers, and Host."""

import pytest
from asking import asker

from posefield.common.errors import InvalidField
from posefield.http.api.problems import MAX_DETAIL_LENGTH
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry.model_registry import ModelRegistry


def kind(answer):
    assert answer.headers["content-type"] == "application/problem+json"
    return answer.status_code, answer.json()["type"].rpartition(":")[2]


@pytest.mark.parametrize("path", ["/livez", "/v1/models/reach/pose", "/nowhere"])
def test_a_url_has_a_length(path, ask):
    longest = f"{path}?" + "a" * (8192 - len(path))
    assert kind(ask("GET", longest + "a")) == (414, "url-too-long")
    assert kind(ask("GET", longest))[0] in (400, 404)


def test_headers_have_a_size_and_a_number(ask):
    assert kind(ask("GET", "/livez", headers={"a": "a" * 16_384})) == (431, "head-too-large")
    assert ask("GET", "/livez", headers={"a": "a" * 16_000}).status_code == 200
    many = [(f"a{number}", "") for number in range(101)]
    assert kind(ask("GET", "/livez", headers=many)) == (431, "head-too-large")
    assert ask("GET", "/livez", headers=many[:90]).status_code == 200


def test_a_long_detail_is_cut_and_keeps_both_ends(ask):
    answer = ask("POST", "/v1/models/reach/pose", json={"begin" + "x" * 5000 + "end": 1})
    detail = answer.json()["detail"]
    assert answer.status_code == 400 and len(detail) <= MAX_DETAIL_LENGTH
    assert detail.startswith("beginxxx") and detail.endswith("detail, times")
    assert all(len(error["detail"]) <= MAX_DETAIL_LENGTH for error in answer.json()["errors"])


FOREIGN = ["evil.example:8000", "127.0.0.1.evil.example", "[evil]", "[", ":8000", "a b", "é"]


@pytest.mark.parametrize("host", ["localhost:8000", "LOCALHOST.", "10.0.0.7:8000", "[::1]:8000"])
def test_addresses_and_localhost_are_answered(host, ask):
    assert ask("GET", "/livez", headers={"host": host}).status_code == 200


@pytest.mark.parametrize("host", FOREIGN)
def test_a_name_that_is_not_listed_is_refused(host, ask):
    answer = ask("GET", "/v1/models", headers={"host": host.encode()})
    assert kind(answer) == (421, "unknown-host")
    assert "POSEFIELD_HOSTS" in answer.json()["detail"]


def answers(hosts, host):
    ask = asker(create_app(ModelRegistry({}), Settings(hosts=hosts)))
    return ask("GET", "/livez", headers={"host": host}).status_code == 200


@pytest.mark.parametrize(
    ("hosts", "host", "expected"),
    [
        ("poses.example.com", "localhost", False),
        ("a.example, *.B.example", "c.b.example", True),
        ("*.example.com", "evilexample.com", False),
        ("*", "anything.example", True),
        ("poses.example.com", "10.1.2.3", True),
    ],
)
def test_the_operator_lists_names(hosts, host, expected):
    assert answers(hosts, host) is expected


@pytest.mark.parametrize("hosts", ["https://a.example", "a.example:80", "*a.example"])
def test_what_is_no_name_stops_the_start(hosts):
    with pytest.raises(InvalidField, match="POSEFIELD_HOSTS"):
        create_app(ModelRegistry({}), Settings(hosts=hosts))
