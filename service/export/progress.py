"""How an export goes, told on standard error: a bar on a terminal, else a line now and then."""

import time
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from service.export.pace import Pace

EVERY = 5.0
"""Seconds between two lines."""


class Show(Protocol):
    """Shows how far it is."""

    def update(self, pace: Pace) -> None:
        """Show it again, where it is time to."""

    def say(self, line: str) -> None:
        """A line that stays."""

    def end(self) -> None:
        """Show nothing more."""


class Bar:
    """A bar with a count, a rate and the time left."""

    def __init__(self, console: Console, pace: Pace) -> None:
        columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[words]}"))
        self._progress = Progress(*columns, console=console, transient=True)
        self._progress.start()
        self._task = self._progress.add_task("", total=pace.total, words="")
        self.update(pace)

    def update(self, pace: Pace) -> None:
        """Show it; the terminal is written to ten times a second at most."""
        done = pace.before + pace.done
        self._progress.update(self._task, completed=done, words=pace.words())

    def say(self, line: str) -> None:
        """A line above the bar."""
        self._progress.console.print(line, markup=False, soft_wrap=True)

    def end(self) -> None:
        """Take the bar away."""
        self._progress.stop()


class Lines:
    """A line every few seconds, for logs."""

    def __init__(self, console: Console, pace: Pace) -> None:
        self._console, self._said = console, time.monotonic()
        if pace.before:
            self.say(f"goes on: {pace.before} of {pace.total} are done")

    def update(self, pace: Pace) -> None:
        """A line, if the last is old."""
        if time.monotonic() - self._said >= EVERY:
            self.say(f"{pace.before + pace.done} of {pace.total}, {pace.words()}")
            self._said = time.monotonic()

    def say(self, line: str) -> None:
        """A line."""
        self._console.print(line, markup=False, soft_wrap=True)

    def end(self) -> None:
        """Nothing: what was said stays."""


def show(pace: Pace) -> Show:
    """What suits standard error."""
    console = Console(stderr=True, highlight=False)
    return Bar(console, pace) if console.is_terminal else Lines(console, pace)
