"""Tests of the served contract and the HTML pages: equal for all clients and self-contained."""

import re
from base64 import b64encode
from hashlib import sha256

import pytest
import yaml

from posefield.http import static_page
from posefield.http.api import contract
from posefield.http.api.problems import PROBLEM_KINDS

BUILT = {"/": static_page.VIEWER, "/docs": static_page.DOCS}
NO_ICON = '<link rel="icon" href="data:,"'
ALL = ["/openapi.yaml", "/openapi.json", "/problems", *BUILT]


def test_the_contract_is_served_as_it_is_written(ask, spec):
    written = ask("GET", "/openapi.yaml")
    assert written.content == contract.load_contract().source
    assert yaml.safe_load(written.content) == ask("GET", "/openapi.json").json() == spec


@pytest.mark.parametrize("path", ALL)
@pytest.mark.parametrize("coding", ["identity", "gzip", "zstd"])
def test_a_page_is_not_sent_again(path, coding, ask):
    first = ask("GET", path, headers={"accept-encoding": coding})
    assert first.headers.get("content-encoding", "identity") == coding
    assert first.headers["cache-control"] == "public, no-cache"
    assert first.headers["vary"] == "Accept-Encoding"
    asked = {"accept-encoding": coding, "if-none-match": first.headers["etag"]}
    again = ask("GET", path, headers=asked)
    assert (again.status_code, again.content) == (304, b"")
    for name in ("etag", "cache-control", "vary"):
        assert again.headers[name] == first.headers[name]
    # It would take the place of the page's own in what the browser holds.
    assert "content-security-policy" not in again.headers
    other = {**asked, "accept-encoding": "gzip" if coding == "zstd" else "zstd"}
    assert ask("GET", path, headers=other).status_code == 200


def loads(page: str) -> list[str]:
    """Return the markup that makes a page fetch."""
    return re.findall(r"<link|<iframe|<img|<object|\ssrc=|\son\w+=|\sstyle=|@import", page)


def inline(page: str, tag: str) -> list[str]:
    return re.findall(rf"^\s*<{tag}\b[^>]*>(.*?)</{tag}>", page, re.DOTALL | re.MULTILINE)


def digests(policy: str, tag: str) -> list[str]:
    (sources,) = re.findall(rf"{tag}-src ([^;]+);", policy)
    return re.findall(r"'sha256-([^']+)'", sources)


@pytest.mark.parametrize("path", ["/problems", *BUILT])
def test_a_page_loads_nothing_and_runs_what_stands_in_it(path, ask):
    answer = ask("GET", path)
    policy = answer.headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; ") and "unsafe" not in policy
    assert "http" not in policy and "*" not in policy
    rest = answer.text
    for tag in ("script", "style"):
        texts = inline(answer.text, tag)
        own = [b64encode(sha256(text.encode()).digest()).decode() for text in texts]
        assert digests(policy, tag) == own
        assert len(own) == (0 if (path, tag) == ("/problems", "script") else 1)
        for text in texts:
            rest = rest.replace(text, "")
    assert loads(rest.replace(NO_ICON, "")) == []


def test_what_a_page_would_load_is_seen():
    assert loads('<script src="x"></script><p onclick="x">') == [" src=", " onclick="]


def test_every_kind_of_problem_has_its_place_and_its_remedy(ask):
    page = ask("GET", "/problems").text
    entries = re.findall(
        r'<dt id="(.+?)">(\d+) <code>(.+?)</code></dt>\n<dd>(.+?)\. (.+)</dd>', page
    )
    assert sorted(entry[:4] for entry in entries) == sorted(
        (kind.name, str(kind.status), kind.type, kind.title) for kind in PROBLEM_KINDS
    )
    assert all(remedy.endswith(".") for *_, remedy in entries)


def test_a_page_that_was_not_built_says_how_to_build_it(tmp_path):
    content = static_page.built_page(tmp_path / "index.html")
    assert b"make page" in content and loads(content.decode().replace(NO_ICON, "")) == []
    there = tmp_path / "index.html"
    there.write_bytes(b"built")
    assert static_page.built_page(there) == b"built"
