"""Pages generated from data: the contract, the recipe schema, client READMEs and results."""

import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import measured_tables
import yaml
from page_parts import code, page, table
from result_tables import ORIGINS, REMARKS, TABLES

ROOT = Path(__file__).resolve().parents[1]
SCHEMA = ROOT / "model_export/posefield_train/recipes/recipe.schema.json"
CLIENTS = {
    "python": ("Python client", "## How it is made"),
    "typescript": ("TypeScript client", "## Development"),
    "runtime": ("A model in your program", "## Development"),
}
"""Title of each client's page, and the heading of its README that is for its developers."""
METHODS = ("get", "post")
API_INTRO = """\
The contract is `api/openapi.yaml` (OpenAPI 3.1), version {version}. A running service shows it:

| address | content |
|---|---|
| `/docs` | the contract as a page; each operation can be tried |
| `/openapi.yaml`, `/openapi.json` | the contract |
| `/problems` | every error, with its remedy; also [here](problems.md) |

```sh
curl -s http://127.0.0.1:8000/openapi.json -o openapi.json
curl -s http://127.0.0.1:8000/v1/models
```"""
RECIPE_INTRO = """\
All keys of a recipe, from its JSON schema, `recipe.schema.json` in the folder of the shipped
recipes (`model_export/posefield_train/recipes`). [Recipes](../guide/recipes.md) explains them.
Unknown keys are errors."""
SPECIAL_SECTIONS = {
    "ControlColumn": "[[controls]] from a column",
    "ControlMeasured": "[[controls]] measured",
    "Auto": "auto of a control",
}
"""Headings of sections that their place in a recipe does not tell."""
KEY_HELP = {
    "name": "name in questions: lower case letters, digits and underscores",
    "column": "column of the table that holds the value",
    "unit": "unit of the values, as text",
    "description": "one sentence for people",
    "auto": "measurement, with the keys of *auto of a control*",
}


@cache
def contract() -> dict[str, Any]:
    """Return the HTTP contract."""
    found: dict[str, Any] = yaml.safe_load((ROOT / "api/openapi.yaml").read_text(encoding="utf-8"))
    return found


def api() -> str:
    """Return the page of the HTTP API: its conventions, operations and parameters."""
    found = contract()
    parts = [API_INTRO.format(version=found["info"]["version"]), "## Conventions"]
    parts.append(found["info"]["description"].strip())
    for tag in found["tags"]:
        rows = list(_operations(found, tag["name"]))
        if rows:
            parts += [f"## {tag['name'].capitalize()}", tag["description"] + "."]
            parts.append(table(("request", "operation", "purpose"), rows))
    parts += ["## Parameters", table(("parameter", "in", "meaning"), _parameters(found))]
    return page("HTTP API", "api/openapi.yaml", parts)


def _operations(found: dict[str, Any], tag: str) -> Iterator[tuple[str, str, str]]:
    for path, item in found["paths"].items():
        for method in METHODS:
            operation = item.get(method)
            if operation and tag in operation["tags"]:
                request = code(f"{method.upper()} {path}")
                yield request, code(operation["operationId"]), operation["summary"]


def _parameters(found: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    for parameter in found["components"]["parameters"].values():
        text = schema_text(found, parameter) or schema_text(found, parameter.get("schema", {}))
        yield code(parameter["name"]), parameter["in"], text


def schema_text(found: dict[str, Any], schema: dict[str, Any]) -> str:
    """Return the description of a schema or parameter, or of the schema that it refers to."""
    while "description" not in schema and "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        schema = found["components"]["schemas"][name]
    return str(schema.get("description", ""))


def recipe_keys() -> str:
    """Return the page of all keys of a recipe."""
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    headings = dict(_headings(schema, schema, "")) | SPECIAL_SECTIONS
    parts = [RECIPE_INTRO, "## Top level", _keys(schema, headings)]
    for name in headings:
        section = schema["$defs"][name]
        parts += [f"## {headings[name]}", section["description"].strip(), _keys(section, headings)]
    return page("Recipe keys", "recipe.schema.json", parts)


def _headings(schema: dict[str, Any], part: dict[str, Any], path: str) -> Iterator[tuple[str, str]]:
    """Yield name and TOML heading of each section below a part of the schema, `[clips.where]`."""
    for key, value in part["properties"].items():
        text, inner = json.dumps(value), f"{path}.{key}".strip(".")
        if value.get("type") == "object":
            inner += ".NAME"
        is_list = value.get("type") == "array" or '"type": "array"' in text
        for name in re.findall(r'"#/\$defs/(\w+)"', text):
            yield name, f"[[{inner}]]" if is_list else f"[{inner}]"
            yield from _headings(schema, schema["$defs"][name], inner)


def _keys(schema: dict[str, Any], headings: dict[str, str]) -> str:
    required = schema.get("required", [])
    rows = []
    for name, value in schema["properties"].items():
        text = value.get("description") or KEY_HELP.get(name) or _section(value, headings)
        if not text:
            raise SystemExit(f"the recipe key {name} of {schema['title']} has no description")
        rows.append((code(name), _value(value), _default(name, value, required), text))
    return table(("key", "value", "default", "meaning"), rows)


def _section(value: dict[str, Any], headings: dict[str, str]) -> str:
    """Return the heading of the section that a key holds; empty for plain values."""
    names = re.findall(r'"#/\$defs/(\w+)"', json.dumps(value))
    return ", ".join(f"section {code(headings[name])}" for name in names)


def _value(value: dict[str, Any]) -> str:
    if "const" in value:
        return code(json.dumps(value["const"]))
    if "enum" in value:
        return ", ".join(code(json.dumps(each)) for each in value["enum"])
    if "anyOf" in value:
        kinds = [_value(each) for each in value["anyOf"] if each.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    if value.get("type") == "array":
        return f"list of {_value(value['items'])}" if "items" in value else "list"
    kind = str(value.get("type", "section"))
    low, high = value.get("minimum"), value.get("maximum")
    return f"{kind}, {low} to {high}" if None not in (low, high) else kind


def _default(name: str, value: dict[str, Any], required: list[str]) -> str:
    if name in required:
        return "required"
    default = value.get("default")
    return code(json.dumps(default)) if default not in (None, [], {}) else ""


def client(name: str) -> str:
    """Return the page of a client: its README for users, with links of this site."""
    title, last = CLIENTS[name]
    readme = (ROOT / f"clients/{name}/README.md").read_text(encoding="utf-8")
    body = readme.partition("\n")[2].partition(last)[0].strip()
    body = body.replace("](../../README.md)", "](../index.md)")
    return page(title, f"clients/{name}/README.md", [body])


def results(name: str) -> str:
    """Return a page of measured results."""
    found = json.loads((ROOT / f"docs/results/{name}.json").read_text(encoding="utf-8"))
    parts = [found["intro"], f"Measured: {found['measured']}. Machine: {found['machine']}."]
    missing = [
        part["title"] for part in found["tables"] if not measured_tables.exists(part["from"])
    ]
    if missing:
        parts.append(f"Not measured with this version: {', '.join(missing)}.")
    for part in found["tables"]:
        if part["title"] not in missing:
            parts += _result(part)
    return page(found["title"], f"docs/results/{name}.json", parts)


def _result(described: dict[str, Any]) -> Iterator[str]:
    name = described["from"]
    yield f"## {described['title']}"
    if described["about"]:
        yield described["about"]
    if name in ORIGINS:
        yield measured_tables.origin(ORIGINS[name])
    yield table(*TABLES[name]())
    made = [REMARKS[name]()] if name in REMARKS else []
    if remarks := [*made, *described["remarks"]]:
        yield "\n".join(f"- {remark}" for remark in remarks)
