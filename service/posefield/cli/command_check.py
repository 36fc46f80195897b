"""The `posefield check` command: defects of a USD character."""

from pathlib import Path
from typing import Annotated

import typer

from posefield.console.arguments import Json
from posefield.console.output import as_json


def check(
    file: Annotated[Path, typer.Argument(help="USD file: usda, usdc, usd or usdz", metavar="FILE")],
    json: Json = False,
) -> None:
    """Find defects of a USD character.

    They are defects that validators accept but some readers fail on.
    """
    from posefield.check import check as find

    findings = find(file)
    if json:
        typer.echo(as_json([vars(finding) for finding in findings]))
    else:
        for finding in findings:
            typer.echo(f"{finding.severity}: {finding.prim}: {finding.message} [{finding.code}]")
        typer.echo(f"{file}: {len(findings)} findings")
    if any(finding.severity == "error" for finding in findings):
        raise typer.Exit(1)
