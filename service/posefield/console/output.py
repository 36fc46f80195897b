"""Output of commands as JSON and text, and progress of those that take longer than usual."""

import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import orjson
import typer

from posefield.question.results import ClipAnswer, Explanation, Trust, band

if TYPE_CHECKING:
    from posefield.console.progress import ProgressBar


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural unless it is one."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def as_json(value: Any) -> str:
    """Return plain values as indented JSON."""
    return orjson.dumps(value, option=orjson.OPT_INDENT_2).decode()


def written_message(path: Path, answer: ClipAnswer, json: bool) -> str:
    """Return the message about a written clip, as JSON or as text."""
    frames = len(answer.clip)
    if json:
        facts = answer.trust.document()
        return as_json({"file": str(path), "frames": frames, "rate": answer.clip.rate, **facts})
    stretch = answer.trust.stretch
    stretched = f", stretched by up to {1000 * stretch:.1f} ms" if stretch else ""
    return (
        f"{path}: {frames} frames at {answer.clip.rate:g} a second, {answer.trust.duration:.2f} s, "
        f"give or take {100 * answer.trust.sigma:.1f} cm ({band(answer.trust.sigma)}){stretched}"
    )


def print_warnings(answer: Trust | Explanation) -> None:
    """Print inferred controls and warnings on standard error."""
    if answer.inferred:
        chosen = " ".join(f"{name}={answer.controls[name]!r}" for name in answer.inferred)
        typer.echo(f"inferred: {chosen}, most typical for what was given", err=True)
    for warning in answer.warnings:
        typer.echo(f"warning: {warning}", err=True)


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
            bar = ProgressBar(self._label, self._total, interval=interval)
            self._bar = self.enter_context(bar)
        return self._bar
