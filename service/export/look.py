"""Who looks on at an export: shows how it goes, and hears when to stop."""

from contextlib import ExitStack

from service.export import stopping
from service.export.ledger import Part
from service.export.pace import Pace
from service.export.query import KEPT


class Look:
    """Watch of a run, which shows how it goes; once files are written it hears who says stop.

    told: the signal that did, if any.
    """

    def __init__(self) -> None:
        self.told: int | None = None
        self.pace = Pace(0, 0)
        self.skipped = 0
        self._stack = ExitStack()

    def __enter__(self) -> "Look":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def begin(self, total: int, done: int) -> None:
        """Show how far it is, and listen."""
        # Takes a tenth of a second to import: every other command would wait for it too.
        from service.export import progress

        self.pace = Pace(total, done)
        self._show = progress.show(self.pace)
        self._stack.callback(self._show.end)
        self._stopping = self._stack.enter_context(stopping.heard())

    def advance(self, part: Part) -> None:
        """Show that a chunk is done, and the first rows that were skipped."""
        for fault in part.skipped[: max(KEPT - self.skipped, 0)]:
            self._show.say(f"skipped: {fault.place}: {fault.message}")
        self.skipped += len(part.skipped)
        self.pace.done += part.clips + len(part.skipped)
        self._show.update(self.pace)

    def stopped(self) -> bool:
        """Whether somebody said stop."""
        self.told = self._stopping.signal
        return self.told is not None
