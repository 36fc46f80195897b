"""Comparison of the request types with the contract's schemas."""

import msgspec
import pytest

from posefield.http.api import contract
from posefield.question.model_question import SigmaQuestion, SuggestQuestion, WhyQuestion
from posefield.question.motion_question import (
    ClipsQuestion,
    FileQuestion,
    NamedClipQuestion,
    PoseQuestion,
)
from posefield.question.text_decoding import parameters
from posefield.question.walk_question import WalkQuestion

SCHEMAS = {
    "PoseQuestion": PoseQuestion,
    "ClipQuestion": FileQuestion,
    "NamedClipQuestion": NamedClipQuestion,
    "ClipsQuestion": ClipsQuestion,
    "SigmaQuestion": SigmaQuestion,
    "WhyQuestion": WhyQuestion,
}
AGREED = contract.load_contract()


def resolved(node):
    return contract.resolve(AGREED.document, node)


def kinds(schema, resolve):
    """JSON types that a schema allows; an enumeration's are those of its values."""
    schema = resolve(schema)
    parts = schema.get("anyOf", schema.get("oneOf"))
    if parts and "type" not in schema:
        return set().union(*(kinds(part, resolve) for part in parts))
    if "type" not in schema and "enum" in schema:
        return {"null" if value is None else "string" for value in schema["enum"]}
    found = schema["type"]
    return {*found} if isinstance(found, list) else {found}


def choices(schema, resolve):
    schema = resolve(schema)
    own = {value for value in schema.get("enum", ()) if value is not None}
    parts = schema.get("anyOf", schema.get("oneOf", ()))
    return own.union(*(choices(part, resolve) for part in parts))


def made(form):
    """Schema of a type, and what resolves its references."""
    document = msgspec.json.schema(form)

    def resolve(node):
        while "$ref" in node:
            node = document["$defs"][node["$ref"].removeprefix("#/$defs/")]
        return node

    return resolve(document), resolve


def compare(name, form):
    """Yield the differences between a schema of the contract and a type."""
    agreed, (own, resolve) = AGREED.document["components"]["schemas"][name], made(form)
    yield from agreed["properties"].keys() ^ own["properties"].keys()
    yield from set(agreed["required"]) ^ set(own["required"])
    if agreed["additionalProperties"] or own["additionalProperties"]:
        yield "additionalProperties"
    for field in agreed["properties"].keys() & own["properties"].keys():
        theirs, ours = agreed["properties"][field], own["properties"][field]
        if kinds(theirs, resolved) != kinds(ours, resolve):
            yield f"{field}: {kinds(theirs, resolved)}, {kinds(ours, resolve)}"
        # The formats are the encoders', which no question knows.
        if field != "format" and choices(theirs, resolved) != choices(ours, resolve):
            yield f"{field}: {choices(theirs, resolved)}, {choices(ours, resolve)}"
        defaults = [resolved(theirs).get("default") or None, ours.get("default") or None]
        if field not in own["required"] and defaults[0] != defaults[1]:
            yield f"{field}: defaults {defaults}"


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_type_is_its_schema(name):
    assert list(compare(name, SCHEMAS[name])) == []


def test_a_field_more_or_another_default_would_be_noticed():
    class Wider(WhyQuestion, frozen=True, kw_only=True):
        """A question with a field and a default of its own."""

        more: int = 3
        nearest: int = 11

    assert sorted(compare("WhyQuestion", Wider)) == ["more", "nearest: defaults [10, 11]"]


FORMS = {
    "/v1/models/{model}/pose": PoseQuestion,
    "/v1/models/{model}/clip": FileQuestion,
    "/v1/models/{model}/sigma": SigmaQuestion,
    "/v1/models/{model}/why": WhyQuestion,
    "/v1/models/{model}/suggestions": SuggestQuestion,
    "/v1/models/{model}/crowd": WalkQuestion,
}


@pytest.mark.parametrize("path", FORMS)
def test_the_parameters_of_a_url_are_the_fields(path):
    (operation,) = (o for o in AGREED.operations if (o.path, o.method) == (path, "GET"))
    form = FORMS[path]
    assert operation.query == parameters(form).keys()
    assert operation.open_query == ("controls" in form.__struct_fields__)
