"""Progress messages of a command on standard error."""

import time
from collections.abc import Sequence
from itertools import pairwise
from types import TracebackType
from typing import Self

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
        self._bar.print(f"{spent:6.1f} s  {step}{self._rest(spent)}")

    def _rest(self, spent: float) -> str:
        """Return the estimate of the rest as text; empty without one, and for a few seconds."""
        finished = len(self._begun) - 1
        before, after = sum(self._expected[:finished]), sum(self._expected[finished:])
        left = spent * after / before if before else 0.0
        return f" (about {_rounded(left)} left)" if left >= SHORTEST else ""

    @property
    def finished(self) -> list[tuple[str, float]]:
        """Return the completed steps and their durations, s."""
        return [(step, end - start) for (step, start), (_, end) in pairwise(self._begun)]
