"""Single-file HTML pages with inline scripts and styles, allowed by hash in their headers."""

from base64 import b64encode
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path

from service.web import browser

_WEB = Path(__file__).parents[1]
VIEWER = _WEB / "viewer/index.html"
DOCS = _WEB / "docs/index.html"


def built(path: Path) -> bytes:
    """Return the page that `make page` has built; a page of instructions if it is missing."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        from service.web.pages import templates

        return templates.render("missing.html", title="posefield").encode()


def headers(content: bytes) -> dict[str, str]:
    """Return the headers of a page, which allow its inline scripts and styles only."""
    found = _Inline()
    found.feed(content.decode())
    found.close()
    return browser.page(found.sources("script"), found.sources("style"))


class _Inline(HTMLParser):
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
        return " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"
