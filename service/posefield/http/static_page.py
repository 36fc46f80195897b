"""Static documents: the contract and the HTML pages, created at their first request."""

import re
from base64 import b64encode
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from hashlib import blake2b, sha256
from pathlib import Path

import orjson

from posefield.http import responses
from posefield.http.api import contract
from posefield.http.api.contract import Contract


@dataclass(frozen=True)
class StaticPage:
    """A static document, created at the first request.

    make: returns the content. headers_of: returns the response headers for a content.
    """

    media_type: str
    make: Callable[[], bytes]
    headers_of: Callable[[bytes], Mapping[str, str]] = lambda _: {}

    @cached_property
    def content(self) -> bytes:
        """Content of the document."""
        return self.make()

    @cached_property
    def headers(self) -> Mapping[str, str]:
        """Response headers of the document."""
        return self.headers_of(self.content)

    @cached_property
    def digest(self) -> bytes:
        """Hash of the content, for its entity tag."""
        return blake2b(self.content, digest_size=16).digest()


_PAGES = Path(__file__).with_name("pages")
VIEWER = _PAGES / "viewer/index.html"
DOCS = _PAGES / "docs/index.html"
MODEL_PAGE = _PAGES / "model/index.html"
"""Page that computes with its models; `posefield page` copies its folder."""
PROBLEMS = _PAGES / "problems.html"
NO_SOURCE = "'none'"
"""Sources of a Content-Security-Policy that allow nothing."""


def static_pages(agreed: Contract) -> dict[str, StaticPage]:
    """Return the pages by operationId."""
    return {
        "getContract": StaticPage(contract.MEDIA_TYPE, lambda: agreed.source),
        "getContractJson": StaticPage("application/json", lambda: orjson.dumps(agreed.document)),
        "getDocs": StaticPage("text/html", partial(built_page, DOCS), headers),
        "getProblems": StaticPage("text/html", PROBLEMS.read_bytes, headers),
        "getViewer": StaticPage("text/html", partial(built_page, VIEWER), headers),
    }


def built_page(path: Path) -> bytes:
    """Return the page that `make page` has built; one that says so if it is missing."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return _NOT_BUILT


_NOT_BUILT = b"""\
<!doctype html>
<html lang="en"><title>posefield</title><link rel="icon" href="data:,">
<p>This service was installed from its sources, and this page was not built: <code>make page</code>.
The contract is at <a href="/openapi.yaml">/openapi.yaml</a>.
"""


def headers(content: bytes) -> dict[str, str]:
    """Return the headers of a page, which allow its inline scripts and styles only."""
    hashes: dict[str, list[str]] = {"script": [], "style": []}
    for tag, text in _INLINE.findall(content):
        digest = b64encode(sha256(text).digest()).decode()
        hashes[tag.decode()].append(f"'sha256-{digest}'")
    script, style = (" ".join(hashes[tag]) or NO_SOURCE for tag in hashes)
    return responses.page_headers(script, style)


_INLINE = re.compile(rb"<(script|style)\b[^>]*>(.*?)</\1>", re.DOTALL)
