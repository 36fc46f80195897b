"""The page to play with, which clients/viewer is built into: one file that stands alone."""

import re
from base64 import b64encode
from hashlib import sha256
from pathlib import Path

from service.web import browser
from service.web.pages import html
from service.web.pages.html import code, element, link
from service.web.service import Page

BUILT = Path(__file__).parents[1] / "viewer/index.html"
_ELEMENTS = r"<{0}\b[^>]*>(.*?)</{0}>"


def page() -> Page:
    """The built page; without one, how to build it.

    A browser runs what stands in the file when the service starts, and nothing else: scripts and
    styles are named by their hashes.
    """
    if not BUILT.exists():
        return _missing()
    content = BUILT.read_bytes()
    headers = browser.page(_hashes(content, "script"), _hashes(content, "style"))
    return Page(content, html.MEDIA_TYPE, headers)


def _hashes(content: bytes, tag: str) -> str:
    """Sources in the words of Content-Security-Policy."""
    found = re.findall(_ELEMENTS.format(tag).encode(), content, re.DOTALL)
    digests = (b64encode(sha256(each).digest()).decode() for each in found)
    return " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"


def _missing() -> Page:
    said = (
        "This service was installed from its sources, and its page was not built: ",
        code("make page"),
    )
    more = "What can be asked is at ", link("/docs", "/docs"), "."
    body = element("main", element("h1", "posefield"), element("p", *said), element("p", *more))
    return html.page("posefield", body)
