"""The contract as it is served, and its pages: the same for everybody, and standing alone."""

import json
import re
import shlex
import xml.etree.ElementTree as ElementTree
from base64 import b64encode
from hashlib import sha256

import pytest
import yaml
from asking import asker

from service.web import contract, pages
from service.web.access import keys
from service.web.app import create_app
from service.web.contract import Contract
from service.web.pages import docs, html, viewer
from service.web.pages.texts import TEXTS
from service.web.problems import KINDS
from service.web.settings import Settings

HTML = ["/docs", "/problems"]
ALL = ["/openapi.yaml", "/openapi.json", "/", *HTML]


def test_the_contract_is_served_as_it_is_written(ask, spec):
    written = ask("GET", "/openapi.yaml")
    assert written.content == contract.load().source
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


def test_the_tag_is_of_what_the_page_says(app):
    agreed = app.site.service.pages
    changed = contract.parse(contract.load().source.replace(b"clips out", b"clips  out", 1))
    for name, page in pages.made(changed).items():
        assert (page.digest == agreed[name].digest) is (page.content == agreed[name].content)
    assert pages.made(changed)["getDocs"].digest != agreed["getDocs"].digest
    assert pages.made(changed)["getProblems"].digest == agreed["getProblems"].digest


def test_a_closed_service_shows_its_pages_to_everybody(loaded):
    ask = asker(create_app(loaded, Settings(keys=keys.line("one", ["read:*"], keys.make()))))
    assert ask("GET", "/v1/models").status_code == 401
    for path in ALL:
        answer = ask("GET", path)
        assert (answer.status_code, answer.headers["cache-control"]) == (200, "public, no-cache")


def loads(page: str) -> list[str]:
    """What a page would fetch or run."""
    return re.findall(r"<script|<link|<iframe|<img|\ssrc=|\son\w+=|@import|url\(", page)


@pytest.mark.parametrize("path", HTML)
def test_a_page_loads_nothing_and_runs_nothing(path, ask):
    answer = ask("GET", path)
    assert loads(answer.text) == []
    policy = answer.headers["content-security-policy"]
    (style,) = re.findall(r"<style>(.*?)</style>", answer.text, re.DOTALL)
    digest = b64encode(sha256(style.encode()).digest()).decode()
    assert policy.startswith(f"default-src 'none'; style-src 'sha256-{digest}';")
    assert " style=" not in answer.text.partition("</style>")[2]


def test_what_a_page_would_load_is_seen():
    assert loads('<script src="x"></script><p onclick="x">') == ["<script", " src=", " onclick="]


@pytest.mark.parametrize("path", HTML)
def test_every_link_leads_somewhere(path, ask):
    page = ask("GET", path).text
    there = re.findall(r'id="([^"]+)"', page)
    assert len(there) == len(set(there))
    for target in set(re.findall(r'href="([^"]+)"', page)):
        if target.startswith("#"):
            assert target[1:] in there
        elif target.startswith("/"):
            assert ask("GET", target).status_code == 200
        else:
            assert target.startswith("https://www.rfc-editor.org/")


def test_the_docs_show_every_operation_and_schema(ask, spec):
    there = set(re.findall(r'id="([^"]+)"', ask("GET", "/docs").text))
    assert {operation.id for operation in contract.load().operations} <= there
    assert {f"schema-{name}" for name in spec["components"]["schemas"]} <= there


def test_every_curl_line_of_the_docs_is_answered(ask, loaded):
    lines = commands(ask("GET", "/docs").text)
    assert len(lines) == len(contract.load().operations)
    for line in lines:
        method, path, given = understood(shlex.split(line))
        # No two machines need train the same bytes.
        path = path.replace("{version}", loaded.find("reach").session.digest)
        assert ask(method, path, **given).status_code == 200, line


def commands(page):
    return [
        "".join(ElementTree.fromstring(found).itertext())
        for found in re.findall(r"<pre>.*?</pre>", page, re.DOTALL)
        if "<code>curl " in found
    ]


def understood(words):
    """Method, path and content of a curl command."""
    assert words[0] == "curl" and words[1].startswith(docs.SERVER)
    options = dict(zip(words[2::2], words[3::2], strict=False))
    headers = dict([options["--header"].split(": ")]) if "--header" in options else {}
    path, body = words[1].removeprefix(docs.SERVER), options.get("--json")
    if body is None:
        return "GET", path, {"headers": headers}
    return "POST", path, {"headers": headers, "json": json.loads(body)}


def test_what_the_contract_says_is_text(spec):
    said = {"title": "<script>", "description": "<img> & `<b>`"}
    document = {**spec, "info": {**spec["info"], **said}}
    page = docs.page(Contract(b"", document, contract.load().operations)).content.decode()
    assert loads(page) == []
    assert "&lt;script&gt;" in page and "&lt;img&gt; &amp; <code>&lt;b&gt;</code>" in page


def test_markdown_that_is_said_twice_is_not_one_element():
    first, second = html.markdown("*a*"), html.markdown("*a*")
    html.element("p", first, "tail")
    assert second.tail is None


def test_every_kind_of_problem_has_its_text_and_its_place(ask):
    assert set(TEXTS) == set(KINDS)
    page = ask("GET", "/problems").text
    for kind in KINDS:
        assert f'<article id="{kind.name}">' in page
        for part in (kind.type, str(kind.status)):
            assert part in page


@pytest.fixture
def built(tmp_path, monkeypatch):
    """Puts a page where the built one lies."""

    def put(text: str) -> str:
        path = tmp_path / "index.html"
        path.write_text(text)
        monkeypatch.setattr(viewer, "BUILT", path)
        return viewer.page().headers["Content-Security-Policy"]

    return put


def test_the_viewer_runs_what_was_built_and_nothing_else(built):
    one = built("<script type='module' crossorigin>go()</script><style>a { b: c }</style>")
    for tag, content in (("script", "go()"), ("style", "a { b: c }")):
        digest = b64encode(sha256(content.encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}';" in one
    assert "default-src 'none'" in one and "unsafe" not in one
    assert built("<script>go( )</script>").partition("style-src")[0] not in one
    assert "script-src 'none'" in built("<p>nothing")


def test_without_a_built_page_it_says_how_to_build_one(tmp_path, monkeypatch):
    monkeypatch.setattr(viewer, "BUILT", tmp_path / "index.html")
    assert b"make page" in viewer.page().content


def test_the_built_page_is_served_and_loads_nothing(ask):
    answer = ask("GET", "/")
    assert answer.content == viewer.BUILT.read_bytes()
    text = re.sub(
        r"<script\b[^>]*>.*?</script>|<style\b[^>]*>.*?</style>", "", answer.text, flags=re.S
    )
    assert loads(text.replace('<link rel="icon" href="data:,"', "")) == []
    assert " style=" not in text


def test_the_service_says_which_contract_it_speaks(ask, spec):
    assert ask("GET", "/livez").json() == {"status": "live", "contract": spec["info"]["version"]}
