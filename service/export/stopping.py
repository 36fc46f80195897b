"""To stop when told to: by Ctrl-C or by whoever runs this, after what was begun is put away."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

TOLD = (signal.SIGINT, signal.SIGTERM)


class Stopping:
    """Whether to stop, and by which signal; call it to ask."""

    def __init__(self) -> None:
        self.signal: int | None = None

    def __call__(self) -> bool:
        return self.signal is not None

    def _told(self, number: int, frame: FrameType | None) -> None:
        if self():
            # Twice: without any manners.
            raise KeyboardInterrupt
        self.signal = number


@contextmanager
def watching() -> Iterator[Stopping]:
    """What is told this process meanwhile; only its main thread can be told."""
    stopping = Stopping()
    before = {number: signal.signal(number, stopping._told) for number in TOLD}
    try:
        yield stopping
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
