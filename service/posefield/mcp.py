"""Server of the Model Context Protocol over standard input and output, and its tools for agents.

The tools list models, plan a performance and write one to a file.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import anyio
import orjson
from anyio import CapacityLimiter, to_thread
from mcp.server.lowlevel import Server
from mcp.server.stdio import stdio_server
from mcp.types import (
    CallToolRequestParams,
    CallToolResult,
    ListToolsResult,
    TextContent,
    Tool,
    ToolAnnotations,
)
from msgspec import Struct

from posefield import __version__
from posefield.common import atomic_files
from posefield.common.errors import InvalidField, MotionError, QueryError, did_you_mean
from posefield.encode.formats import CLIP_ENCODERS, encoder_for
from posefield.http.api import contract
from posefield.performance import composition
from posefield.performance.script import Script, errors_under, resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.poses import MAX_POSES
from posefield.synthesis.synthesizer import Synthesizer

INSTRUCTIONS = (
    "Makes animation of a character from a script: walks along paths, acts such as reaching for a "
    "place, and holds, as one motion in a file (USD, glTF, BVH and others). Metres, seconds, "
    "radians; Y is up, points of the floor are [x, z]. Call list_models, write a script, call "
    "plan_performance until no warning matters, then perform. An act with a target in the world "
    "after a walk without along, to and seconds takes place where the target is met."
)
MAX_FRAMES = 10 * MAX_POSES
FILE_NAME = re.compile(r"[\w-][\w. -]{0,99}", re.ASCII)
"""Names of files that agents may write: no folders, no leading dot."""
Facts = dict[str, Any]


class Nothing(Struct, frozen=True, forbid_unknown_fields=True):
    """Arguments of a tool without any."""


class PlanRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """Arguments of a plan."""

    script: PerformanceQuestion


class FileRequest(Struct, frozen=True, forbid_unknown_fields=True):
    """Arguments of a performance. file: name in the folder of the server."""

    script: PerformanceQuestion
    file: str


@dataclass(frozen=True)
class Toolbox:
    """Models that agents may use, and the folder that files are written to."""

    models: ModelRegistry
    folder: Path

    @cached_property
    def tools(self) -> dict[str, Tool]:
        """Tools by name."""
        return {tool.name: tool for tool in (_list_tool(), _plan_tool(), _perform_tool())}

    def call(self, name: str, arguments: Mapping[str, Any]) -> Facts:
        """Return the result of a tool.

        Raises InvalidField for an unknown tool, QueryError, whose field is a JSON pointer into the
        arguments, and FileError if the file cannot be written.
        """
        if name not in self.tools:
            names = ", ".join(self.tools)
            hint = did_you_mean(name, self.tools)
            raise InvalidField("", f"no tool {name!r}{hint}, expected one of {names}")
        calls = {"list_models": self.list_models, "plan_performance": self.plan}
        return calls.get(name, self.perform)(arguments)

    def list_models(self, arguments: Mapping[str, Any]) -> Facts:
        """Return the models, what segment of a script each can be, and its controls."""
        json_decoding.convert_question(Nothing, arguments)
        return {"models": [_model_facts(model) for model in self.models.models.values()]}

    def plan(self, arguments: Mapping[str, Any]) -> Facts:
        """Return the report of a performance, without its poses."""
        script = self._resolve(json_decoding.convert_question(PlanRequest, arguments).script)
        with errors_under("script"):
            return composition.plan(script, MAX_FRAMES).document()

    def perform(self, arguments: Mapping[str, Any]) -> Facts:
        """Write a performance to a file; return its path and its report."""
        request = json_decoding.convert_question(FileRequest, arguments)
        path = self.folder / _file_name(request.file)
        encoder, question = encoder_for(path), request.script
        with errors_under("script"):
            encoder.check(None)
            convention = encoder.convention(question.unit, question.up, question.body)
        script = self._resolve(question)
        with errors_under("script"):
            answer = composition.perform(script, MAX_FRAMES)
        atomic_files.write(encoder.encode(answer, convention), path)
        return {"file": str(path), **answer.trust.document()}

    def _resolve(self, question: PerformanceQuestion) -> Script:
        with errors_under("script"):
            return resolve_script(question, self.models.find)


def _file_name(name: str) -> str:
    """Return the name of a file; InvalidField unless it is a plain name in a known format."""
    if FILE_NAME.fullmatch(name) is None:
        raise InvalidField("file", f"{name[:100]!r}, expected a name without folders")
    ending = Path(name).suffix[1:]
    if ending not in CLIP_ENCODERS:
        formats = ", ".join(CLIP_ENCODERS)
        hint = did_you_mean(ending, CLIP_ENCODERS)
        raise InvalidField("file", f"{name!r} ends in none of {formats}{hint}")
    return name


def _model_facts(model: Synthesizer) -> Facts:
    card = model.session.card
    walks = card.cyclic and card.root == "travelling"
    kind = "walk" if walks else "none" if card.cyclic else "act"
    controls = [
        {
            "name": control.name,
            "unit": control.unit,
            "minimum": control.minimum,
            "maximum": control.maximum,
            "description": control.description,
        }
        for control in card.controls
    ]
    return {
        "name": model.name,
        "identity": model.identity,
        "description": card.description,
        "segment": kind,
        "seconds": list(card.durations),
        "controls": controls,
        "event": card.event is not None,
        "joints": list(card.skeleton.names),
        "labels": {label_set.name: list(label_set.names) for label_set in card.labels},
    }


def _object(required: Mapping[str, Facts]) -> Facts:
    return {
        "type": "object",
        "properties": dict(required),
        "required": list(required),
        "additionalProperties": False,
    }


def _tool(name: str, description: str, arguments: Facts, result: Facts) -> Tool:
    hints = ToolAnnotations(
        read_only_hint=name != "perform", idempotent_hint=True, open_world_hint=False
    )
    return Tool(
        name=name,
        description=description,
        input_schema=arguments,
        output_schema=result,
        annotations=hints,
    )


def _list_tool() -> Tool:
    text, numbers = {"type": "string"}, {"type": "array", "items": {"type": "number"}}
    texts = {"type": "array", "items": text}
    kind = {
        "type": "string",
        "enum": ["walk", "act", "none"],
        "description": "Kind of segment that the model can be; none for a cycle in place.",
    }
    model = _object(
        {
            "name": text,
            "identity": text,
            "description": text,
            "segment": kind,
            "seconds": {**numbers, "description": "Shortest and longest captured clip."},
            "controls": {"type": "array", "items": {"type": "object"}},
            "event": {"type": "boolean", "description": "Whether targets may be at its event."},
            "joints": texts,
            "labels": {"type": "object", "additionalProperties": texts},
        }
    )
    return _tool(
        "list_models",
        "List the models of motions: their names, whether each is for walks or for acts, their "
        "controls with units and ranges, and the names of their joints. Read this first.",
        _object({}),
        _object({"models": {"type": "array", "items": model}}),
    )


def _plan_tool() -> Tool:
    return _tool(
        "plan_performance",
        "Plan one continuous motion through the segments of a script, without making it: when each "
        "segment begins, how well the joins and targets go, and warnings with pointers into the "
        "script. Errors say what to change.",
        _object({"script": contract.schema("PerformanceQuestion")}),
        contract.schema("PerformanceReport"),
    )


def _perform_tool() -> Tool:
    endings = ", ".join(CLIP_ENCODERS)
    file = {
        "type": "string",
        "pattern": f"^{FILE_NAME.pattern}$",
        "description": f"Name of the file; its ending is one of {endings}. An existing file is "
        "replaced.",
        "examples": ["performance.usdc"],
    }
    report = contract.schema("PerformanceReport")
    path = {"type": "string", "description": "Path of the written file."}
    return _tool(
        "perform",
        "Write one continuous motion through the segments of a script to a file, and return its "
        "path and its report. The same script gives the same bytes.",
        _object({"script": contract.schema("PerformanceQuestion"), "file": file}),
        {
            **report,
            "properties": {"file": path, **report["properties"]},
            "required": ["file", *report["required"]],
        },
    )


def serve(box: Toolbox) -> None:
    """Answer the requests on standard input until it ends."""
    anyio.run(_serve, server(box))


def server(box: Toolbox) -> Server[Any]:
    """Return the server of a toolbox. One tool runs at a time; the others wait."""
    turns = CapacityLimiter(1)

    async def list_tools(context: Any, params: Any) -> ListToolsResult:
        return ListToolsResult(tools=list(box.tools.values()))

    async def call_tool(context: Any, params: CallToolRequestParams) -> CallToolResult:
        arguments = params.arguments or {}
        return await to_thread.run_sync(_result, box, params.name, arguments, limiter=turns)

    return Server(
        "posefield",
        version=__version__,
        instructions=INSTRUCTIONS,
        on_list_tools=list_tools,
        on_call_tool=call_tool,
    )


async def _serve(server: Server[Any]) -> None:
    async with stdio_server() as (incoming, outgoing):
        await server.run(incoming, outgoing, server.create_initialization_options())


def _result(box: Toolbox, name: str, arguments: dict[str, Any]) -> CallToolResult:
    """Return the result of a tool, or what is wrong with its arguments, for the agent to mend."""
    try:
        answer = box.call(name, arguments)
    except MotionError as fault:
        # The field of a QueryError is a JSON pointer to the cause in the arguments.
        pointer = "/" if isinstance(fault, QueryError) and fault.field else ""
        text = TextContent(text=f"{pointer}{fault}")
        return CallToolResult(content=[text], is_error=True)
    text = TextContent(text=orjson.dumps(answer).decode())
    return CallToolResult(content=[text], structured_content=answer)
