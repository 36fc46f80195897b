"""Progress messages of a command on standard error."""

import time
from itertools import pairwise

import typer


class ProgressPrinter:
    """Callback that prints each step with its start time."""

    def __init__(self) -> None:
        self._begun: list[tuple[str, float]] = []

    def __call__(self, step: str) -> None:
        self._begun.append((step, time.perf_counter()))
        typer.echo(f"{self._begun[-1][1] - self._begun[0][1]:6.1f} s  {step}", err=True)

    @property
    def finished(self) -> list[tuple[str, float]]:
        """Return the completed steps and their durations, s."""
        return [(step, end - start) for (step, start), (_, end) in pairwise(self._begun)]
