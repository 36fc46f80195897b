"""Output of commands: files, the summaries that are printed, and progress on standard error."""

import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

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
    figures = facts(exported, output)
    notes = [f"note: {note}" for note in figures["notes"][:MAX_NOTES]]
    if len(figures["notes"]) > MAX_NOTES:
        hidden = len(figures["notes"]) - MAX_NOTES
        notes.append(f"note: {hidden} further notes: posefield inspect {output}")
    return "\n".join(
        [
            *notes,
            f"{output}: {figures['bytes'] / 1000:.1f} kB from {figures['clips']} clips, "
            f"ranks {figures['ranks']} of {figures['tensor']}",
            f"truncation costs {100 * figures['truncation_rms_m']:.2f} cm, a clip left out lies "
            f"{100 * figures['leave_one_out_rms_m']:.2f} cm away (root mean square over joints)",
            f"onnxruntime differs from the reference by at most {100 * figures['parity_m']:.5f} cm",
        ]
    )


def tell_files(what: str, reasons: Sequence[tuple[str, str]]) -> None:
    """Print a line for each of a bounded number of files to standard error."""
    for file, reason in reasons[:MAX_NOTES]:
        typer.echo(f"{what}: {file}: {reason}", err=True)
    if len(reasons) > MAX_NOTES:
        typer.echo(f"{what}: {len(reasons) - MAX_NOTES} further files: see --json", err=True)


SHORTEST = 10.0
"""Estimated rest that is printed, s: a shorter one is over before it was read."""


def _rounded(seconds: float) -> str:
    """Return seconds as text, to ten of them or to whole minutes."""
    minutes = round(seconds / 60.0)
    return f"{10 * round(seconds / 10.0)} s" if seconds < 95.0 else f"{minutes} min"


class ProgressPrinter:
    """Callback that prints each step with its start time, above a bar on a terminal.

    label, total: of the work, as of a ProgressBar; a step that only says that all is done does not
    count.
    """

    def __init__(self, label: str, total: int) -> None:
        # Importing rich takes 0.1 s, which other commands must not spend.
        from posefield.console.progress import ProgressBar

        self._begun: list[tuple[str, float]] = []
        self._expected: tuple[float, ...] = ()
        self._label = label
        self._bar = ProgressBar(label, total, interval=float("inf"), unequal=True)

    def __enter__(self) -> Self:
        self._bar.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._bar.__exit__(kind, error, traceback)

    def expect(self, seconds: Sequence[float]) -> None:
        """Print with each further step how long the rest takes.

        seconds: expected of the steps from the first on, on any machine: those that are finished
        tell how much faster or slower this one is.
        """
        self._expected = tuple(seconds)

    def __call__(self, step: str) -> None:
        self._bar.describe(f"{self._label}: {step}")
        self._bar.update(len(self._begun))
        self._begun.append((step, time.perf_counter()))
        spent = self._begun[-1][1] - self._begun[0][1]
        finished = len(self._begun) - 1
        before, after = sum(self._expected[:finished]), sum(self._expected[finished:])
        left = spent * after / before if before else 0.0
        rest = f" (about {_rounded(left)} left)" if left >= SHORTEST else ""
        self._bar.print(f"{spent:6.1f} s  {step}{rest}")

    @property
    def finished(self) -> list[tuple[str, float]]:
        """Return the completed steps and their durations, s."""
        return [(step, end - start) for (step, start), (_, end) in pairwise(self._begun)]
