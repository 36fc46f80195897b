"""Progress of commands that are usually short: shown once they have taken two seconds."""

import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from posefield.console.progress import ProgressBar

Item = TypeVar("Item")

DELAY = 2.0
"""Seconds before anything is shown."""


class LateProgress(ExitStack):
    """Progress bar of `total` units of work that begins after `delay` seconds; else nothing.

    interval: seconds between two lines where standard error is not a terminal; None for those of
    ProgressBar.
    """

    def __init__(
        self,
        label: str,
        total: int | None = None,
        delay: float = DELAY,
        interval: float | None = None,
    ) -> None:
        super().__init__()
        self._label, self._total, self._interval = label, total, interval
        self._end = time.monotonic() + delay
        self._bar: ProgressBar | None = None

    def update(self, done: int, total: int | None = None) -> None:
        """Show the number of finished units, and a new total if one is given."""
        self._total = self._total if total is None else total
        if self._bar is None and time.monotonic() < self._end:
            return
        self._shown().update(done, self._total)

    def count(self, items: Iterable[Item]) -> Iterator[Item]:
        """Yield the items; each counts as finished when the next one is taken."""
        for done, item in enumerate(items):
            self.update(done)
            yield item

    def _shown(self) -> "ProgressBar":
        if self._bar is None:
            # Importing rich takes 0.1 s, which short commands must not spend.
            from posefield.console.progress import INTERVAL, ProgressBar

            interval = INTERVAL if self._interval is None else self._interval
            made = ProgressBar(self._label, self._total, interval=interval)
            self._bar = self.enter_context(made)
        return self._bar
