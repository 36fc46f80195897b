"""JSON Schema as people read it: a few words for a type, a table for an object."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element

from service.web.pages.html import Content, block, code, element, inline, link, markdown, table

Schema = Mapping[str, Any]

_BOUNDS = {
    "minimum": "≥ {}",
    "exclusiveMinimum": "> {}",
    "maximum": "≤ {}",
    "exclusiveMaximum": "< {}",
    "minItems": "at least {}",
    "maxItems": "at most {}",
    "minLength": "at least {} characters",
    "maxLength": "at most {} characters",
    "pattern": "like {}",
    "default": "by default {}",
}


def article(name: str, schema: Schema) -> Element:
    """A schema of the contract under a heading of its own."""
    parts: list[Content] = [element("h3", code(name))]
    if "description" in schema:
        parts.append(markdown(schema["description"]))
    if "properties" in schema:
        parts.append(_properties(schema))
    else:
        parts.append(element("p", *words(schema)))
    if "example" in schema:
        parts.append(block(json.dumps(schema["example"], indent=2)))
    return element("article", *parts, id=anchor(name))


def anchor(name: str) -> str:
    """Where on the page a schema stands."""
    return f"schema-{name}"


def words(schema: Schema) -> list[Content]:
    """What a value may be."""
    return [*_kind(schema), *_bounds(schema)]


def _properties(schema: Schema) -> Element:
    needed = schema.get("required", ())
    rows = [
        (_named(name, name in needed), element("span", *words(each)), said(each))
        for name, each in schema["properties"].items()
    ]
    return table(("Field", "Value", ""), rows)


def _named(name: str, needed: bool) -> Element:
    mark = (" ", element("span", "needed", class_="tag")) if needed else ()
    return element("span", code(name), *mark)


def said(node: Schema) -> Content:
    """The description of a property, parameter or header."""
    text = " ".join(node.get("description", "").split())
    return inline(text) if text else ""


def _kind(schema: Schema) -> list[Content]:
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return [link(f"#{anchor(name)}", name)]
    for several in ("oneOf", "anyOf", "allOf"):
        if several in schema and "properties" not in schema:
            return _joined([words(each) for each in schema[several]], " or ")
    if "const" in schema:
        return [code(json.dumps(schema["const"]))]
    if "enum" in schema:
        return _joined([[code(json.dumps(value))] for value in schema["enum"]], ", ")
    return _typed(schema)


def _typed(schema: Schema) -> list[Content]:
    given = schema.get("type", "anything")
    kinds: Sequence[str] = [given] if isinstance(given, str) else given
    return _joined([_one(kind, schema) for kind in kinds], " or ")


def _one(kind: str, schema: Schema) -> list[Content]:
    if kind == "array" and "items" in schema:
        return ["list of ", *words(schema["items"])]
    if kind == "object" and isinstance(schema.get("additionalProperties"), Mapping):
        return ["object of ", *words(schema["additionalProperties"])]
    if schema.get("format") == "binary":
        return ["bytes"]
    return [kind]


def _joined(parts: Iterable[Iterable[Content]], between: str) -> list[Content]:
    return [each for part in parts for each in (between, *part)][1:]


def _bounds(schema: Schema) -> Iterator[Content]:
    for name, form in _BOUNDS.items():
        if name in schema and schema[name] is not None:
            value = schema[name] if name == "pattern" else json.dumps(schema[name])
            before, _, after = form.partition("{}")
            yield f", {before}"
            yield code(value)
            yield after
