"""What a command says on standard error while it works."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise

import typer


@contextmanager
def bar(name: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on standard error that is told how many parts are done, of how many."""
    with typer.progressbar(length=1, label=name, file=sys.stderr) as shown:

        def progress(done: int, parts: int) -> None:
            shown.length = parts
            shown.update(done - shown.pos)

        yield progress


class Progress:
    """Says each step as it begins, and remembers when that was."""

    def __init__(self) -> None:
        self._begun: list[tuple[str, float]] = []

    def __call__(self, step: str) -> None:
        self._begun.append((step, time.perf_counter()))
        typer.echo(f"{self._begun[-1][1] - self._begun[0][1]:6.1f} s  {step}", err=True)

    @property
    def finished(self) -> list[tuple[str, float]]:
        """Steps that another has followed, and how long each took, s."""
        return [(step, end - start) for (step, start), (_, end) in pairwise(self._begun)]
