"""Breaking changes between two versions of a contract, one line for each.

Every request that was valid must stay valid. Responses must keep their promised fields; new fields
and new values of enumerations are allowed, which clients must tolerate.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from posefield.http.api import contract

Node = Mapping[str, Any]

LEAST = ("minimum", "exclusiveMinimum", "minItems", "minLength", "minProperties")
MOST = ("maximum", "exclusiveMaximum", "maxItems", "maxLength", "maxProperties")


def changes(old: Node, new: Node) -> list[str]:
    """Breaking changes from one contract to the next, each once."""
    return sorted(set(_paths(_expanded(old), _expanded(new))))


def _expanded(document: Node) -> Node:
    """The contract with a path for each format in place of a path that ends in `{format}`."""
    paths: dict[str, dict[str, Any]] = {}
    for path, item in document["paths"].items():
        if not path.endswith("{format}"):
            paths[path] = item
            continue
        for method in (m for m in contract.METHODS if m in item):
            given = _given(document, path, method)
            rest = [each for key, each in given.items() if key != ("path", "format")]
            operation = {**item[method], "parameters": rest}
            for form in given["path", "format"]["schema"]["enum"]:
                paths.setdefault(path.replace("{format}", form), {})[method] = operation
    return {**document, "paths": paths}


def _paths(old: Node, new: Node) -> Iterator[str]:
    for path, item in old["paths"].items():
        for method in (m for m in contract.METHODS if m in item):
            where = f"{method.upper()} {path}"
            if method not in new["paths"].get(path, {}):
                yield f"{where}: gone"
            else:
                yield from _Pair(old, new, where).operation(path, method)


@dataclass(frozen=True)
class _Pair:
    """Two contracts, and the operation that is looked at."""

    old: Node
    new: Node
    where: str

    def at(self, place: str) -> "_Pair":
        return replace(self, where=f"{self.where} {place}")

    def operation(self, path: str, method: str) -> Iterator[str]:
        before, after = self.old["paths"][path][method], self.new["paths"][path][method]
        if before["operationId"] != after["operationId"]:
            yield f"{self.where}: operationId changed"
        yield from self._security(_security(self.old, before), _security(self.new, after))
        yield from self._parameters(path, method)
        yield from self._body(before.get("requestBody"), after.get("requestBody"))
        yield from self._responses(before["responses"], after["responses"])

    def _security(self, before: Sequence[Node], after: Sequence[Node]) -> Iterator[str]:
        if {} not in after and (not before or {} in before) and after:
            yield f"{self.where}: needs a key"
        scope = contract.scope_of(before)
        if scope is not None and contract.scope_of(after) not in (scope, None):
            yield f"{self.where}: needs another scope"

    def _parameters(self, path: str, method: str) -> Iterator[str]:
        before, after = _given(self.old, path, method), _given(self.new, path, method)
        for key, found in after.items():
            if found.get("required") and not before.get(key, {}).get("required"):
                yield f"{self.where}: parameter {key[1]} is needed"
        for key, found in before.items():
            if key not in after:
                yield f"{self.where}: parameter {key[1]} is gone"
                continue
            ask = _Values(self.old, self.new, f"{self.where} {key[1]}", asked=True)
            yield from ask.compare(found["schema"], after[key]["schema"])

    def _body(self, before: Node | None, after: Node | None) -> Iterator[str]:
        if before is None or after is None:
            if before is not after:
                yield f"{self.where}: body is {'gone' if after is None else 'needed'}"
            return
        old, new = contract.resolve(self.old, before), contract.resolve(self.new, after)
        if new.get("required") and not old.get("required"):
            yield f"{self.where}: body is needed"
        yield from self.at("body").contents(old, new, asked=True)

    def _responses(self, before: Node, after: Node) -> Iterator[str]:
        for status, node in before.items():
            if status not in after:
                yield f"{self.where}: status {status} is gone"
                continue
            old, new = contract.resolve(self.old, node), contract.resolve(self.new, after[status])
            for name in old.get("headers", {}).keys() - new.get("headers", {}).keys():
                yield f"{self.where} {status}: header {name} is gone"
            yield from self.at(status).contents(old, new, asked=False)

    def contents(self, old: Node, new: Node, asked: bool) -> Iterator[str]:
        there = new.get("content", {})
        for name, content in old.get("content", {}).items():
            if name not in there:
                yield f"{self.where}: media type {name} is gone"
                continue
            values = _Values(self.old, self.new, self.where, asked)
            yield from values.compare(content.get("schema", {}), there[name].get("schema", {}))


@dataclass(frozen=True)
class _Values:
    """Two contracts, and the values that are looked at: those asked with, or those answered."""

    old: Node
    new: Node
    where: str
    asked: bool
    seen: frozenset[tuple[str, str]] = frozenset()

    def compare(self, before: Node, after: Node) -> Iterator[str]:
        """Faults of what was allowed and is not, or of what comes and was not promised."""
        pair = before.get("$ref", ""), after.get("$ref", "")
        if all(pair) and pair in self.seen:
            return
        inner = replace(self, seen=self.seen | {pair})
        if all(pair) and pair[0] == pair[1]:
            # Said once of the schema, and not of each operation that has it.
            name = pair[0].rpartition("/")[2]
            inner = replace(inner, where=f"{name} ({'asked' if self.asked else 'answered'})")
        old, new = _alternatives(self.old, before), _alternatives(self.new, after)
        given, taken = (old, new) if self.asked else (new, old)
        for each in given:
            tried = [list(inner.one(*((each, t) if self.asked else (t, each)))) for t in taken]
            # The alternative that fits best says what is wrong.
            yield from min(tried, key=len)

    def one(self, before: Node, after: Node) -> Iterator[str]:
        given, taken = (before, after) if self.asked else (after, before)
        word = "no longer" if self.asked else "now may be"
        for kind in _types(given) - _types(taken):
            if not (kind == "integer" and "number" in _types(taken)) and _types(taken):
                yield f"{self.where}: {word} {kind}"
        if not _types(given) and _types(taken):
            yield f"{self.where}: {word} of any type"
        if self.asked or not ("enum" in given and "enum" in taken):
            for value in _left(_enumerated(given), _enumerated(taken)):
                yield f"{self.where}: {word} {value}"
        yield from self._bounds(given, taken)
        yield from self._properties(before, after)
        if "items" in before and "items" in after:
            items = replace(self, where=f"{self.where}[]")
            yield from items.compare(before["items"], after["items"])

    def _bounds(self, given: Node, taken: Node) -> Iterator[str]:
        """Bounds of what is taken that what is given need not keep."""
        for name in (n for n in (*LEAST, *MOST) if n in taken):
            sign = 1 if name in LEAST else -1
            if name not in given or sign * given[name] < sign * taken[name]:
                yield f"{self.where}: {name} {taken[name]} was {given.get(name)}"
        if "pattern" in taken and taken["pattern"] != given.get("pattern"):
            yield f"{self.where}: pattern changed"

    def _properties(self, before: Node, after: Node) -> Iterator[str]:
        given, taken = (before, after) if self.asked else (after, before)
        for name in set(taken.get("required", ())) - set(given.get("required", ())):
            yield f"{self.where}/{name}: {'is needed' if self.asked else 'may be missing'}"
        old, new = before.get("properties", {}), after.get("properties", {})
        closed = after.get("additionalProperties") is False
        for name in old.keys() - new.keys():
            if closed or not self.asked:
                yield f"{self.where}/{name}: gone"
        if self.asked and closed and before.get("additionalProperties") is not False:
            yield f"{self.where}: other properties are refused"
        for name in old.keys() & new.keys():
            inner = replace(self, where=f"{self.where}/{name}")
            yield from inner.compare(old[name], new[name])


def _given(document: Node, path: str, method: str) -> dict[tuple[str, str], Node]:
    item = document["paths"][path]
    nodes = [*item.get("parameters", ()), *item[method].get("parameters", ())]
    found = [contract.resolve(document, node) for node in nodes]
    return {(node["in"], node["name"]): node for node in found}


def _security(document: Node, operation: Node) -> Sequence[Node]:
    found: Sequence[Node] = operation.get("security", document.get("security", []))
    return found


def _whole(document: Node, schema: Node) -> Node:
    """A schema with what its $ref leads to."""
    if "$ref" not in schema:
        return schema
    rest = {name: value for name, value in schema.items() if name != "$ref"}
    return {**_whole(document, contract.resolve(document, schema)), **rest}


def _alternatives(document: Node, schema: Node) -> Sequence[Node]:
    whole = _whole(document, schema)
    for name in ("oneOf", "anyOf"):
        # Beside properties these say which of them go together.
        if name in whole and "properties" not in whole and "type" not in whole:
            return [each for part in whole[name] for each in _alternatives(document, part)]
    return [whole]


def _types(schema: Node) -> set[str]:
    given = schema.get("type", [])
    return {given} if isinstance(given, str) else set(given)


def _enumerated(schema: Node) -> Sequence[Any] | None:
    found: Sequence[Any] | None = schema.get("enum")
    return [schema["const"]] if "const" in schema else found


def _left(given: Sequence[Any] | None, taken: Sequence[Any] | None) -> Iterator[str]:
    if taken is not None:
        if given is None:
            yield f"anything but {list(taken)}"
        else:
            yield from (repr(value) for value in given if value not in taken)
