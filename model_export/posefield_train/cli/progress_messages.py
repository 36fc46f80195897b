"""Progress messages of a command on standard error."""

import time
from itertools import pairwise
from types import TracebackType
from typing import Self


class ProgressPrinter:
    """Callback that prints each step with its start time, above a bar on a terminal.

    label, total: of the work, as of a ProgressBar; a step that only says that all is done does not
    count.
    """

    def __init__(self, label: str, total: int) -> None:
        # Importing rich takes 0.1 s, which other commands must not spend.
        from posefield.console.progress import ProgressBar

        self._begun: list[tuple[str, float]] = []
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

    def __call__(self, step: str) -> None:
        self._bar.describe(f"{self._label}: {step}")
        self._bar.update(len(self._begun))
        self._begun.append((step, time.perf_counter()))
        self._bar.print(f"{self._begun[-1][1] - self._begun[0][1]:6.1f} s  {step}")

    @property
    def finished(self) -> list[tuple[str, float]]:
        """Return the completed steps and their durations, s."""
        return [(step, end - start) for (step, start), (_, end) in pairwise(self._begun)]
