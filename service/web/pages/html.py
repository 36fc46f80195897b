"""HTML that stands alone: nothing is loaded, no script runs, and all text is escaped."""

from base64 import b64encode
from collections.abc import Sequence
from copy import copy
from functools import cache
from hashlib import sha256
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from markdown_it import MarkdownIt

from service.web.service import Page

MEDIA_TYPE = "text/html"
Content = str | Element

_MARKDOWN = MarkdownIt("commonmark", {"html": False, "xhtmlOut": True})
_STYLE = Path(__file__).with_name("style.css").read_text().strip()
_DIGEST = b64encode(sha256(_STYLE.encode()).digest()).decode()
HEADERS = {
    "Content-Security-Policy": f"default-src 'none'; style-src 'sha256-{_DIGEST}'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
}


def page(title: str, *content: Content, **attributes: str) -> Page:
    """A whole page; attributes: of its body."""
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", name="color-scheme", content="light dark"),
        element("title", title),
        element("style", _STYLE),
    )
    root = element("html", head, element("body", *content, **attributes), lang="en")
    text = ElementTree.tostring(root, encoding="unicode", method="html")
    return Page(f"<!doctype html>\n{text}\n".encode(), MEDIA_TYPE, HEADERS)


def element(tag: str, *content: Content, **attributes: str) -> Element:
    """An element; an attribute's name may end in _ where Python has it already."""
    made = Element(tag, {name.rstrip("_"): value for name, value in attributes.items()})
    for each in content:
        if isinstance(each, Element):
            made.append(each)
        elif len(made):
            made[-1].tail = (made[-1].tail or "") + each
        else:
            made.text = (made.text or "") + each
    return made


def markdown(text: str) -> Element:
    """What CommonMark says, in a box of its own; HTML in it is text."""
    return copy(_parsed(text))


@cache
def _parsed(text: str) -> Element:
    """Much is said of many operations."""
    return ElementTree.fromstring(f'<div class="said">{_MARKDOWN.render(text)}</div>')


def inline(text: str) -> Element:
    """One paragraph of CommonMark, within a line."""
    return ElementTree.fromstring(f"<span>{_MARKDOWN.renderInline(text)}</span>")


def code(text: str) -> Element:
    """Text of a program."""
    return element("code", text)


def block(text: str) -> Element:
    """Lines of a program."""
    return element("pre", code(text))


def link(target: str, *content: Content) -> Element:
    """A link to another place, of this page or another."""
    return element("a", *content, href=target)


def table(names: tuple[str, ...], rows: Sequence[Sequence[Content]]) -> Element:
    """A table with a head, that scrolls where it is too wide."""
    head = element("thead", element("tr", *(element("th", name) for name in names)))
    body = element("tbody", *(element("tr", *(element("td", c) for c in row)) for row in rows))
    return element("div", element("table", head, body), class_="wide")
