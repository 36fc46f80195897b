"""Server of the Model Context Protocol over standard input and output."""

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

from posefield import __version__
from posefield.agents.toolbox import AgentTool, Toolbox
from posefield.common.errors import MotionError, QueryError

INSTRUCTIONS = (
    "Makes animation of a character from a script: walks along paths, acts such as reaching for a "
    "place, and holds, as one motion in a file (USD, glTF, BVH and others). Metres, seconds, "
    "radians; Y is up, points of the floor are [x, z]. Call list_models, write a script, call "
    "plan_performance until no warning matters, then perform. An act with a target in the world "
    "after a walk without along, to and seconds takes place where the target is met."
)


def serve(box: Toolbox) -> None:
    """Answer the requests on standard input until it ends."""
    anyio.run(_serve, server(box))


def server(box: Toolbox) -> Server[Any]:
    """Return the server of a toolbox. One tool runs at a time; the others wait."""
    turns = CapacityLimiter(1)

    async def list_tools(context: Any, params: Any) -> ListToolsResult:
        return ListToolsResult(tools=[_described(tool) for tool in box.tools.values()])

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


async def _serve(made: Server[Any]) -> None:
    async with stdio_server() as (incoming, outgoing):
        await made.run(incoming, outgoing, made.create_initialization_options())


def _described(tool: AgentTool) -> Tool:
    return Tool(
        name=tool.name,
        description=tool.description,
        input_schema=tool.arguments,
        output_schema=tool.result,
        annotations=ToolAnnotations(
            read_only_hint=not tool.writes, idempotent_hint=True, open_world_hint=False
        ),
    )


def _result(box: Toolbox, name: str, arguments: dict[str, Any]) -> CallToolResult:
    """Return the result of a tool, or what is wrong with its arguments, for the agent to mend."""
    try:
        found = box.call(name, arguments)
    except MotionError as fault:
        text = TextContent(text=error_text(fault))
        return CallToolResult(content=[text], is_error=True)
    text = TextContent(text=orjson.dumps(found).decode())
    return CallToolResult(content=[text], structured_content=found)


def error_text(fault: MotionError) -> str:
    """Return an error in one line, with a JSON pointer to its cause in the arguments."""
    if isinstance(fault, QueryError) and fault.field:
        return f"/{fault}"
    return str(fault)
