"""HTML rendering of the templates in `templates/` by Jinja, which escapes every value."""

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markdown_it import MarkdownIt

FOLDER = Path(__file__).with_name("templates")

_MARKDOWN = MarkdownIt("commonmark", {"html": False})


def render(name: str, **values: object) -> str:
    """Return the HTML of a template.

    Raises jinja2.UndefinedError for a name in the template without a value.
    """
    return _environment().get_template(name).render(values)


@cache
def _environment() -> Environment:
    loader = FileSystemLoader(FOLDER)
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters["markdown"] = _inline
    return environment


def _inline(text: str) -> str:
    """Return one paragraph of CommonMark as HTML; HTML in the text is escaped."""
    rendered: str = _MARKDOWN.renderInline(text)
    return rendered
