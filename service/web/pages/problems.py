"""The page at `/problems`, target of the Link header of each problem."""

import json

from service.web import problems
from service.web.pages import templates
from service.web.pages.texts import TEXTS
from service.web.problems import Kind


def content() -> bytes:
    """Return the HTML of the page: all kinds of problems, sorted by status."""
    kinds = sorted(TEXTS, key=lambda kind: kind.status)
    listed = [
        {"kind": kind, "text": TEXTS[kind], "example": json.dumps(example(kind), indent=2)}
        for kind in kinds
    ]
    return templates.render("problems.html", title="Problems", problems=listed).encode()


def example(kind: Kind) -> dict[str, object]:
    """Return an example of a problem document of a kind."""
    text = TEXTS[kind]
    # Details of a QueryError begin with the field's name, which `errors` omits.
    named = kind in (*problems.TABLE.values(), problems.BAD_PARAMETER, problems.BAD_BODY)
    said = text.detail.partition(": ")[2] if named else text.detail
    errors = [{**text.place, "detail": said}] if text.place else []
    return problems.document(kind, text.detail, "3f9c0b7a5d21", errors)
