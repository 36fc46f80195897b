"""Breaking changes between two versions of a contract, one line for each.

Every request that was valid must stay valid. Responses must keep their promised fields; new fields
and new values of enumerations are allowed, which clients must tolerate.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from posefield.http.api import contract

Node = Mapping[str, Any]

LEAST = ("minimum", "exclusiveMinimum", "minItems", "minLength", "minProperties")
MOST = ("maximum", "exclusiveMaximum", "maxItems", "maxLength", "maxProperties")
KINDS = ("null", "boolean", "integer", "number", "string", "array", "object")


def changes(old: Node, new: Node) -> list[str]:
    """Breaking changes from one contract to the next, each once."""
    before, after = _Facts(old), _Facts(new)
    found = [f"{fact}: gone" for fact in before.kept - after.kept]
    found += [f"{p} now {w}" for p, w in after.added - before.added if p in before.places]
    return sorted([*found, *_bounds(before, after)])


def _bounds(before: "_Facts", after: "_Facts") -> Iterator[str]:
    """Yield the bounds that became tighter for requests, or looser for answers."""
    for place, name in before.bounds.keys() | after.bounds.keys():
        if place not in before.places & after.places:
            continue
        was, now = (facts.bounds.get((place, name)) for facts in (before, after))
        loose, tight = (was, now) if "(answered)" not in place else (now, was)
        if name == "enum":
            # Clients tolerate other values of an enumeration.
            wrong = tight and not (loose and (loose <= tight or "(answered)" in place))
        else:
            sign = 1 if name in LEAST else -1
            wrong = tight is not None and (loose is None or sign * loose < sign * tight)
        if wrong:
            yield f"{place}: {name} {now} was {was}"


class _Facts:
    """Promises of a contract.

    kept: facts that must stay. added: places, with demands that must not be added there. bounds:
    limits and enumerations of values at places.
    """

    def __init__(self, document: Node) -> None:
        self.document = document
        self.kept: set[str] = set()
        self.added: set[tuple[str, str]] = set()
        self.places: set[str] = set()
        self.bounds: dict[tuple[str, str], Any] = {}
        for path, item in document["paths"].items():
            for method in (m for m in contract.METHODS if m in item):
                self._operation(path, method, item)

    def _operation(self, path: str, method: str, item: Node) -> None:
        operation = item[method]
        nodes = [*item.get("parameters", ()), *operation.get("parameters", ())]
        nodes = [contract.resolve(self.document, node) for node in nodes]
        given = {(node["in"], node["name"]): node for node in nodes}
        forms = given.pop(("path", "format"))["schema"]["enum"] if "{format}" in path else [""]
        for form in forms:
            where = f"{method.upper()} {path.replace('{format}', form)}"
            self.places.add(where)
            self.kept |= {where, f"{where}: operation {operation['operationId']}"}
            security = operation.get("security", self.document.get("security", []))
            if security and {} not in security:
                self.added |= {(where, "needs a key")}
                self.added |= {(where, f"needs the scope {contract.scope_of(security)}")}
            for (_, name), node in given.items():
                self.kept.add(f"{where}: parameter {name}")
                if node.get("required"):
                    self.added.add((where, f"needs parameter {name}"))
                self._schema(node["schema"], f"{where} {name}", "asked")
            if body := contract.resolve(self.document, operation.get("requestBody", {})):
                self.kept.add(f"{where}: a body")
                if body.get("required"):
                    self.added.add((where, "needs a body"))
                self._contents(body, f"{where} body", "asked")
            for status, node in operation["responses"].items():
                answer = contract.resolve(self.document, node)
                self.kept |= {f"{where} {status}: header {h}" for h in answer.get("headers", ())}
                self.kept.add(f"{where}: status {status}")
                self._contents(answer, f"{where} {status} (answered)", "answered")

    def _contents(self, node: Node, place: str, use: str) -> None:
        for media_type, content in node.get("content", {}).items():
            self.kept.add(f"{place}: media type {media_type}")
            self._schema(content.get("schema", {}), f"{place} {media_type}", use)

    def _schema(self, node: Node, place: str, use: str) -> None:
        """Add the facts of a schema; those of one with a name stand under it, once."""
        self.places.add(place)
        whole, name = contract.resolve(self.document, node), node.get("$ref", "").rpartition("/")[2]
        for kind in self._kinds(whole):
            if use == "asked":
                self.kept.add(f"{place}: {kind}")
            else:
                self.added.add((place, f"may be {kind}"))
        if name:
            place = f"{name} ({use})"
            if place in self.places:
                return
            self.places.add(place)
        # Beside properties these say which of them go together.
        if "properties" not in whole and "type" not in whole:
            for part in (*whole.get("oneOf", ()), *whole.get("anyOf", ())):
                self._schema(part, place, use)
        self._values(whole, place)
        required, closed = whole.get("required", ()), whole.get("additionalProperties") is False
        for key in required:
            if use == "asked":
                self.added.add((place, f"needs {key}"))
            else:
                self.kept.add(f"{place}/{key} in each answer")
        if use == "asked" and not closed:
            self.kept.add(f"{place}: other properties")
        for key, value in whole.get("properties", {}).items():
            self.kept.add(f"{place}/{key}")
            self._schema(value, f"{place}/{key}", use)
        if "items" in whole:
            self._schema(whole["items"], f"{place}[]", use)

    def _values(self, schema: Node, place: str) -> None:
        """Add the bounds of a schema's values."""
        for name in (n for n in (*LEAST, *MOST) if n in schema):
            self.bounds[place, name] = schema[name]
        if "pattern" in schema:
            if "(answered)" in place:
                self.kept.add(f"{place}: pattern {schema['pattern']}")
            else:
                self.added.add((place, f"has the pattern {schema['pattern']}"))
        if "enum" in schema or "const" in schema:
            values = {repr(value) for value in schema.get("enum", [schema.get("const")])}
            self.bounds[place, "enum"] = self.bounds.get((place, "enum"), set()) | values

    def _kinds(self, schema: Node) -> set[str]:
        """Types of a schema's values; a number may be whole."""
        parts = [*schema.get("oneOf", ()), *schema.get("anyOf", ())]
        if parts and "type" not in schema and "properties" not in schema:
            whole = (contract.resolve(self.document, part) for part in parts)
            return set().union(*map(self._kinds, whole))
        found = schema.get("type", KINDS)
        kinds = {found} if isinstance(found, str) else {*found}
        return kinds | {"integer"} if "number" in kinds else kinds
