"""The `posefield serve` and `posefield key` commands: the service, and keys to it."""

from typing import Annotated

import typer

from posefield.console.arguments import Json
from posefield.console.output import as_json
from posefield.registry import shipped_models


def serve(
    places: Annotated[
        list[str] | None,
        typer.Argument(
            help="model files, folders with model files, or URLs of object stores; "
            "default: the models that ship with posefield",
            metavar="MODEL",
            show_default=False,
        ),
    ] = None,
    host: Annotated[
        str | None, typer.Option(help="IP address; default: POSEFIELD_HOST, else 127.0.0.1")
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="TCP port; default: POSEFIELD_PORT, else 8000")
    ] = None,
) -> None:
    """Serve models over HTTP until interrupted.

    Without PLACES it serves the models that ship with posefield: a walk, which the page at / shows
    first, and a reach.
    """
    from posefield.http import server
    from posefield.http.api import settings

    server.serve(
        shipped_models.or_shipped(places or ()), settings.read_settings(host=host, port=port)
    )


def key(
    name: Annotated[str, typer.Argument(help="name of the key's owner in the log", metavar="NAME")],
    model: Annotated[
        list[str] | None,
        typer.Option(help="model that the key may read; may be repeated; default: all models"),
    ] = None,
    metrics: Annotated[
        bool, typer.Option("--metrics", help="allow the key to read /metrics as well")
    ] = False,
    json: Json = False,
) -> None:
    """Create an API key.

    Prints the line for POSEFIELD_KEYS_FILE on standard output and the key on standard error. The
    key is not stored.
    """
    from posefield.http.access import api_keys

    scopes = [f"read:{one}" for one in model or ["*"]] + ["metrics"] * metrics
    secret = api_keys.generate_key()
    line = api_keys.line(name, scopes, secret)
    if json:
        typer.echo(as_json({"key": secret, "line": line}))
        return
    typer.echo(line)
    typer.echo(f"the key of {name}, which is kept nowhere: {secret}", err=True)
