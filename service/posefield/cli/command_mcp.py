"""The `posefield mcp` command: tools for agents over the Model Context Protocol."""

from pathlib import Path
from typing import Annotated

import typer

from posefield.common.errors import FileError
from posefield.console.output import as_json
from posefield.registry import shipped_models


def mcp(
    places: Annotated[
        list[Path] | None,
        typer.Argument(
            help="model files, or folders of them, besides the shipped ones",
            metavar="MODEL",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="folder that files are written to")
    ] = Path(),
    schema: Annotated[
        bool, typer.Option("--schema", help="print the JSON Schema of scripts and exit")
    ] = False,
) -> None:
    """Serve tools to an agent, over standard input and output.

    They list models, plan performances and write them to files. The protocol is the Model Context
    Protocol (MCP).
    """
    from posefield.http.api import contract

    if schema:
        typer.echo(as_json(contract.script_schema()))
        return
    # Imported here because mcp is an optional extra.
    from posefield import mcp as server

    if not output.is_dir():
        raise FileError(output, "no folder, expected one to write files to")
    server.serve(server.Toolbox(shipped_models.with_shipped(places or ()), output.resolve()))
