"""Tests of the headers for browsers: security headers and CORS."""

import pytest
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app

PAGE = "https://a.example"
ANSWERS = [("GET", "/v1/models", 200), ("GET", "/nowhere", 404), ("GET", "/livez?x=1", 400)]


@pytest.fixture(scope="module")
def reading(loaded):
    """The service where pages of PAGE may read."""
    return asker(create_app(loaded, Settings(origins=PAGE)))


@pytest.mark.parametrize(("method", "path", "status"), ANSWERS)
def test_every_answer_is_data_and_nothing_to_run(method, path, status, ask):
    answer = ask(method, path)
    assert answer.status_code == status
    assert answer.headers["x-content-type-options"] == "nosniff"
    policy = answer.headers["content-security-policy"]
    assert policy == "default-src 'none'; frame-ancestors 'none'"
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"
    assert "strict-transport-security" not in answer.headers


@pytest.mark.parametrize(("method", "path", "status"), ANSWERS)
def test_no_page_may_read_where_none_is_named(method, path, status, ask):
    answer = ask(method, path, headers={"Origin": PAGE})
    assert not [name for name in answer.headers if name.startswith("access-control")]
    assert "Origin" not in answer.headers.get("vary", "")


@pytest.mark.parametrize(("method", "path", "status"), ANSWERS)
def test_a_named_page_may_read_faults_too(method, path, status, reading):
    answer = reading(method, path, headers={"Origin": PAGE})
    assert answer.status_code == status
    assert answer.headers["access-control-allow-origin"] == PAGE
    assert "Origin" in answer.headers["vary"]
    shown = answer.headers["access-control-expose-headers"].split(", ")
    assert {"Content-Encoding", "Content-Disposition", "ETag"} <= set(shown)
    other = reading(method, path, headers={"Origin": "https://b.example"})
    assert "access-control-allow-origin" not in other.headers
    assert "Origin" in other.headers["vary"]


def test_a_browser_that_asks_first_is_told_what_it_may(reading):
    asked = {
        "Origin": PAGE,
        "Access-Control-Request-Method": "POST",
        "Access-Control-Request-Headers": "authorization,content-type",
    }
    answer = reading("OPTIONS", "/v1/models/reach/pose", headers=asked)
    assert answer.status_code == 204
    assert answer.headers["access-control-allow-origin"] == PAGE
    assert "POST" in answer.headers["access-control-allow-methods"]
    assert "Authorization" in answer.headers["access-control-allow-headers"]
    other = reading("OPTIONS", "/v1/models/reach/pose", headers={**asked, "Origin": "https://b.ex"})
    assert "access-control-allow-origin" not in other.headers


def test_a_browser_is_told_before_it_has_to_say_who_asks(loaded):
    """It sends no Authorization with that question."""
    line = f"a {'0' * 64} read:*"
    ask = asker(create_app(loaded, Settings(origins=PAGE, keys=line)))
    asked = {"Origin": PAGE, "Access-Control-Request-Method": "GET"}
    assert ask("OPTIONS", "/v1/models", headers=asked).status_code == 204
    refused = ask("GET", "/v1/models", headers={"Origin": PAGE})
    assert refused.status_code == 401
    assert refused.headers["access-control-allow-origin"] == PAGE
