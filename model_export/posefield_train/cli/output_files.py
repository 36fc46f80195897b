"""Output files of commands: their names, and the summary that is printed."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from posefield.common.errors import InvalidField
from posefield.console.output import as_json

if TYPE_CHECKING:
    from posefield_train.graph.onnx_export import ExportedModel


MAX_NOTES = 12
"""Notes that a summary shows; the model file holds all of them."""


def expect_onnx(output: Path) -> None:
    """Raise InvalidField for a model file without the suffix .onnx."""
    if output.suffix != ".onnx":
        raise InvalidField("output", f"{output.name!r}, expected a name that ends in .onnx")


def expect_html(report: Path | None) -> None:
    """Raise InvalidField for a report without the suffix .html."""
    if report and report.suffix != ".html":
        raise InvalidField("report", f"{report.name!r}, expected a name that ends in .html")


def format_output(exported: "ExportedModel", output: Path, json: bool) -> str:
    """Return the output of a command that wrote a model, as JSON or text."""
    return as_json(facts(exported, output)) if json else summary(exported, output)


def facts(exported: "ExportedModel", output: Path) -> dict[str, Any]:
    """Return the summary of a written model as JSON values."""
    card = exported.card
    return {
        "file": str(output),
        "bytes": len(exported.content),
        "clips": card.provenance["clips"],
        "ranks": list(card.levels[0].ranks),
        **card.diagnostics,
    }


def summary(exported: "ExportedModel", output: Path) -> str:
    """Return the summary of a written model as text."""
    found = facts(exported, output)
    notes = [f"note: {note}" for note in found["notes"][:MAX_NOTES]]
    if len(found["notes"]) > MAX_NOTES:
        others = len(found["notes"]) - MAX_NOTES
        notes.append(f"note: {others} further notes: posefield inspect {output}")
    return "\n".join(
        [
            *notes,
            f"{output}: {found['bytes'] / 1000:.1f} kB from {found['clips']} clips, "
            f"ranks {found['ranks']} of {found['tensor']}",
            f"truncation costs {100 * found['truncation_rms_m']:.2f} cm, a clip left out lies "
            f"{100 * found['leave_one_out_rms_m']:.2f} cm away (root mean square over joints)",
            f"onnxruntime differs from the reference by at most {100 * found['parity_m']:.5f} cm",
        ]
    )


def tell_files(what: str, said: Sequence[tuple[str, str]]) -> None:
    """Print a line for each of a bounded number of files to standard error."""
    for file, reason in said[:MAX_NOTES]:
        typer.echo(f"{what}: {file}: {reason}", err=True)
    if len(said) > MAX_NOTES:
        typer.echo(f"{what}: {len(said) - MAX_NOTES} further files: see --json", err=True)
