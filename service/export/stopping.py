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

    def hear(self, number: int, frame: FrameType | None) -> None:
        """Stop; at once, whatever is left behind, if told twice."""
        if self():
            raise KeyboardInterrupt
        self.signal = number


@contextmanager
def heard() -> Iterator[Stopping]:
    """What this process is told meanwhile; its main thread alone can be told."""
    stopping = Stopping()
    before = {number: signal.signal(number, stopping.hear) for number in TOLD}
    try:
        yield stopping
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
