"""Callback that long work calls with the number of finished units."""

from collections.abc import Callable

ProgressCallback = Callable[[int, int], None]
"""Function of the number of finished units and of their total."""


def ignore_progress(done: int, total: int) -> None:
    """Show nothing."""
