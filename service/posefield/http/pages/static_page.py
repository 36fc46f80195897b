"""Static documents, created at their first request."""

from base64 import b64encode
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b, sha256
from html.parser import HTMLParser
from pathlib import Path

from posefield.http.middleware import security_headers


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


_PAGES = Path(__file__).parent
VIEWER = _PAGES / "viewer/index.html"
VIEWER_SCRIPT = _PAGES / "viewer/crowd-webgpu.js"
DOCS = _PAGES / "docs/index.html"
NO_SOURCE = "'none'"
"""Sources of a Content-Security-Policy that allow nothing."""


def built_page(path: Path) -> bytes:
    """Return the page that `make page` has built; a page of instructions if it is missing."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        from posefield.http.pages import templates

        return templates.render("missing.html", title="posefield").encode()


def viewer_script(path: Path) -> bytes:
    """Return the script beside the viewer that `make page` has built; one that fails if missing."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return b'throw new Error("not built: run make page");\n'


def headers(content: bytes, loads_scripts: bool = False) -> dict[str, str]:
    """Return the headers of a page, which allow its inline scripts and styles only.

    loads_scripts: whether a page with scripts may load others of its own origin.
    """
    found = _InlineTextParser()
    found.feed(content.decode())
    found.close()
    script = found.sources("script")
    if loads_scripts and script != NO_SOURCE:
        script = f"'self' {script}"
    return security_headers.page_headers(script, found.sources("style"))


class _InlineTextParser(HTMLParser):
    """Parser that collects the texts of a page's inline scripts and styles."""

    def __init__(self) -> None:
        super().__init__()
        self._texts: dict[str, list[str]] = {"script": [], "style": []}
        self._within: list[str] | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._within = self._texts.get(tag)
        if self._within is not None:
            self._within.append("")

    def handle_endtag(self, tag: str) -> None:
        self._within = None

    def handle_data(self, data: str) -> None:
        if self._within is not None:
            self._within[-1] += data

    def sources(self, tag: str) -> str:
        """Return the hashes of a tag's texts as sources of a Content-Security-Policy."""
        digests = (b64encode(sha256(text.encode()).digest()).decode() for text in self._texts[tag])
        return " ".join(f"'sha256-{digest}'" for digest in digests) or NO_SOURCE
