"""The page that each problem's answer links to."""

import json
from xml.etree.ElementTree import Element

from service.web import problems
from service.web.pages import html
from service.web.pages.html import code, element, link
from service.web.pages.texts import TEXTS, Text
from service.web.problems import Kind
from service.web.service import Page

TITLE = "Problems"
INTRODUCTION = """
Every error of this service is one JSON document of the media type `application/problem+json`
([RFC 9457](https://www.rfc-editor.org/rfc/rfc9457)). Its `type` is stable and one of those below:
programs should look at it, and at nothing else. `detail` is for people and may change, `instance`
is the id of the request, under which the service's log has it, and `errors` says where in the
request the fault lies: a `pointer` into the body or the name of a `parameter`.
"""


def page() -> Page:
    """Each kind of problem, by status."""
    kinds = sorted(TEXTS, key=lambda kind: kind.status)
    body = element(
        "main",
        element("h1", TITLE),
        element("p", "What is asked how: ", link("/docs", "/docs"), "."),
        html.markdown(INTRODUCTION),
        *(_article(kind, TEXTS[kind]) for kind in kinds),
    )
    return html.page(TITLE, _aside(kinds), body, class_="split")


def _aside(kinds: list[Kind]) -> Element:
    entries = (element("li", link(f"#{k.name}", f"{k.status} {k.name}")) for k in kinds)
    return element("nav", element("strong", TITLE), element("ul", *entries))


def _article(kind: Kind, text: Text) -> Element:
    return element(
        "article",
        element("h3", f"{kind.status} ", code(kind.type)),
        element("p", element("strong", kind.title)),
        html.markdown(text.comes),
        element("h4", "What to do"),
        html.markdown(text.remedy),
        element("h4", "Example"),
        html.block(json.dumps(example(kind), indent=2)),
        id=kind.name,
    )


def example(kind: Kind) -> dict[str, object]:
    """A problem of that kind, as it is sent."""
    text = TEXTS[kind]
    # Models say of a field what is wrong, and not once more which it is.
    said = text.detail.partition(": ")[2] if kind in problems.TABLE.values() else text.detail
    errors = [{**text.place, "detail": said}] if text.place else []
    return problems.document(kind, text.detail, "3f9c0b7a5d21", errors)
