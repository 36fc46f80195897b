"""Measure Table 1 of Mukai & Kuriyama (SCA 2006) again and print it beside the paper's figures.

    python benchmarks/paper/table1.py [--json FILE]

Needs posefield[train] and numba. Takes a few minutes on one thread.
"""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

# Run as a file, Python searches benchmarks/paper; the imports below are relative to benchmarks.
sys.path.insert(0, str(Path(__file__).parents[1]))

from paper import markdown, measurement
from paper.measurement import Table1
from posefield.common import atomic_files
from posefield.common.errors import FileError
from posefield.console.output import as_json


def main(
    json_file: Annotated[
        Path | None, typer.Option("--json", help="JSON file to write", metavar="FILE")
    ] = None,
) -> None:
    """Measure compression, precomputation and time per pose, and print them as Markdown."""
    table = measurement.measure()
    typer.echo(markdown.text(table))
    if json_file:
        try:
            atomic_files.write(as_json(facts(table)).encode(), json_file)
        except FileError as error:
            sys.exit(f"table1: {error}")


def facts(table: Table1) -> dict[str, Any]:
    """Return the table as plain numbers, lists and dictionaries; seconds and metres."""
    return asdict(table)


if __name__ == "__main__":
    typer.run(main)
