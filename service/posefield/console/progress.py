"""Progress of long commands on standard error: a bar on a terminal, else periodic lines."""

import sys
import time
from datetime import timedelta
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

INTERVAL = 5.0
"""Seconds between two lines where standard error is not a terminal."""


class ProgressBar:
    """Progress bar of `total` units of work; None for an unknown total.

    done: units that were finished before. Where standard error is not a terminal, such as in the
    log of a CI job, it prints a line every `interval` seconds instead. Standard output is not used.
    unequal: units take different times, so that the bar shows the elapsed time and no estimate.
    """

    def __init__(
        self,
        label: str,
        total: int | None = None,
        done: int = 0,
        interval: float = INTERVAL,
        unequal: bool = False,
    ) -> None:
        # isatty() of the file itself: FORCE_COLOR makes rich treat every file as a terminal.
        terminal = sys.stderr.isatty()
        self._console = Console(stderr=True, highlight=False, force_terminal=terminal)
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
        last = TimeElapsedColumn() if unequal else _Estimate()
        self._progress = Progress(
            *columns, last, console=self._console, transient=True, disable=not terminal
        )
        self._task = self._progress.add_task(label, total=total, completed=done)
        self._interval, self._written = interval, time.monotonic()

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def update(self, done: int, total: int | None = None) -> None:
        """Show the number of finished units, and a new total if one is given."""
        self._progress.update(self._task, completed=done, total=total)
        if self._progress.disable and time.monotonic() - self._written >= self._interval:
            (task,) = self._progress.tasks
            self.print(f"{task.description}: {done} of {task.total:.0f}{_estimate(task)}")
            self._written = time.monotonic()

    def describe(self, label: str) -> None:
        """Show another label."""
        self._progress.update(self._task, description=label)

    def advance(self, count: int) -> None:
        """Show that more units are finished."""
        (task,) = self._progress.tasks
        self.update(int(task.completed) + count)

    def print(self, line: str) -> None:
        """Print a line that stays, above the bar."""
        self._console.print(line, markup=False, soft_wrap=True)


class _Estimate(ProgressColumn):
    """Rate and remaining time."""

    max_refresh = 0.5

    def render(self, task: Task) -> Text:
        return Text(_estimate(task).removeprefix(", "))


def _estimate(task: Task) -> str:
    """Return rate and remaining time as text; empty before there is a rate."""
    speed, left = task.speed, task.time_remaining
    if not speed or left is None:
        return ""
    rate = f"{speed:,.0f}" if speed >= 10.0 else f"{speed:.2g}"
    return f", {rate} a second, {timedelta(seconds=round(left))} left"
