"""The contract as a page: operations by tag, how to ask each by curl, and schemas."""

import json
import shlex
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from service.web import contract
from service.web.contract import Contract, Operation
from service.web.pages import html, schemas
from service.web.pages.html import Content, code, element, link
from service.web.service import Page

SERVER = "http://127.0.0.1:8000"
EXAMPLES = Path(contract.__file__).with_name("examples")
Document = Mapping[str, Any]


def page(agreed: Contract) -> Page:
    """The whole contract."""
    info = agreed.document["info"]
    title = f"{info['title']} {info['version']}"
    return html.page(title, _aside(agreed, title), _main(agreed, title), class_="split")


def _by_tag(agreed: Contract) -> Iterator[tuple[Document, list[Operation]]]:
    """Tags in the contract's order, each with its operations."""
    for tag in agreed.document["tags"]:
        own = [o for o in agreed.operations if tag["name"] in _node(agreed, o)["tags"]]
        yield tag, own


def _node(agreed: Contract, operation: Operation) -> Document:
    node: Document = agreed.document["paths"][operation.path][operation.method.lower()]
    return node


def _aside(agreed: Contract, title: str) -> Element:
    parts: list[Content] = [link("#top", element("strong", title))]
    for tag, operations in _by_tag(agreed):
        entries = (element("li", link(f"#{o.id}", *_line(o, short=True))) for o in operations)
        parts += [element("h2", link(f"#tag-{tag['name']}", tag["name"])), element("ul", *entries)]
    more = link("#schemas", "schemas"), link("/problems", "problems")
    return element("nav", *parts, element("h2", *more[:1]), element("h2", *more[1:]))


def _line(operation: Operation, short: bool = False) -> tuple[Content, ...]:
    method = element("span", operation.method, class_=f"method {operation.method.lower()}")
    path = operation.path.removeprefix("/v1/models") or "/v1/models" if short else operation.path
    return method, path if short else code(path)


def _main(agreed: Contract, title: str) -> Element:
    info = agreed.document["info"]
    parts: list[Content] = [
        element("h1", title),
        element("p", info["summary"], class_="quiet"),
        element("p", *_places()),
        html.markdown(info["description"]),
    ]
    for tag, operations in _by_tag(agreed):
        parts.append(element("h2", tag["name"], id=f"tag-{tag['name']}"))
        parts.append(element("p", tag["description"], class_="quiet"))
        parts += (_operation(agreed, operation) for operation in operations)
    parts.append(element("h2", "schemas", id="schemas"))
    found = agreed.document["components"]["schemas"]
    parts += (schemas.article(name, schema) for name, schema in found.items())
    return element("main", *parts, id="top")


def _places() -> tuple[Content, ...]:
    yaml, plain = link("/openapi.yaml", "/openapi.yaml"), link("/openapi.json", "/openapi.json")
    return "The same for programs: ", yaml, ", ", plain, ". What errors mean: ", _problems(), "."


def _problems() -> Element:
    return link("/problems", "/problems")


def _operation(agreed: Contract, operation: Operation) -> Element:
    node = _node(agreed, operation)
    parts: list[Content] = [element("h3", *_line(operation))]
    parts.append(element("p", element("strong", node["summary"]), *_scope(operation)))
    if "description" in node:
        parts.append(html.markdown(node["description"]))
    parts.append(html.block(_curl(operation)))
    if parameters := _parameters(agreed, operation):
        parts += [element("h4", "Parameters"), parameters]
    if "requestBody" in node:
        parts += [element("h4", "Body"), *_body(agreed, node["requestBody"])]
    parts += [element("h4", "Answers"), *_answers(agreed, node["responses"])]
    return element("article", *parts, id=operation.id)


def _scope(operation: Operation) -> tuple[Content, ...]:
    scope = operation.scope
    return (" ", element("span", f"scope {scope}", class_="tag")) if scope else ()


def _parameters(agreed: Contract, operation: Operation) -> Element | None:
    item = agreed.document["paths"][operation.path]
    given = [*item.get("parameters", ()), *_node(agreed, operation).get("parameters", ())]
    found = [contract.resolve(agreed.document, each) for each in given]
    rows = [(_named(p), element("span", *schemas.words(p["schema"])), _said(p)) for p in found]
    return html.table(("Name", "Value", ""), rows) if rows else None


def _named(parameter: Document) -> Element:
    tags = [parameter["in"], *(["needed"] if parameter.get("required") else [])]
    marks = (element("span", tag, class_="tag") for tag in tags)
    return element("span", code(parameter["name"]), " ", *marks)


def _said(node: Document) -> Content:
    return html.markdown(node["description"]) if "description" in node else ""


def _body(agreed: Contract, node: Document) -> Iterator[Content]:
    body = contract.resolve(agreed.document, node)
    if "description" in body:
        yield html.markdown(body["description"])
    yield element("ul", *_contents(body))


def _contents(node: Document) -> Iterator[Element]:
    """Media types of a body or an answer, and what they hold."""
    for media_type, content in node.get("content", {}).items():
        yield element("li", code(media_type), " ", *schemas.words(content.get("schema", {})))


def _answers(agreed: Contract, responses: Document) -> Iterator[Content]:
    found = {s: contract.resolve(agreed.document, node) for s, node in responses.items()}
    for status, node in found.items():
        if status.startswith("2"):
            yield element("p", code(status), " ", schemas.said(node))
            yield element("ul", *_contents(node))
            yield from _headers(agreed, node)
    others = [(code(s), html.markdown(n["description"])) for s, n in found.items() if s[0] != "2"]
    heading = element("summary", ", ".join(s for s in found if not s.startswith("2")))
    yield element("details", heading, html.table(("Status", ""), others))


def _headers(agreed: Contract, node: Document) -> Iterator[Content]:
    found = {
        name: contract.resolve(agreed.document, header)
        for name, header in node.get("headers", {}).items()
    }
    rows = [(code(n), _said(header)) for n, header in found.items()]
    yield element("details", element("summary", "headers"), html.table(("Header", ""), rows))


def _curl(operation: Operation) -> str:
    """The example beside the contract, as a command."""
    request = json.loads((EXAMPLES / operation.id / "request.json").read_bytes())
    words = ["curl", SERVER + request["path"]]
    for name, value in request.get("headers", {}).items():
        words += ["--header", f"{name}: {value}"]
    if "body" in request:
        words += ["--json", json.dumps(request["body"])]
    return shlex.join(words + _output(operation))


def _output(operation: Operation) -> list[str]:
    """Where to keep what no terminal shows."""
    ending = operation.path.rpartition("/")[2].partition(".")[2]
    if any(t.startswith(("text/", "application/json")) for t in operation.media_types):
        return []
    return ["--output", f"reach.{ending}"] if ending else ["--remote-header-name", "--remote-name"]
