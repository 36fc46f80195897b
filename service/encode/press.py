"""Templates that were made, kept for the layers that come."""

from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass, field
from threading import Lock

from service.encode import content as contents
from service.encode import crate
from service.encode.content import Author, Content
from service.encode.crate import Template

ENTRY = 1000
"""Bytes that are counted for what is known of a pattern without a template."""


@dataclass(frozen=True)
class Refused:
    """Mark of a pattern whose template cannot be trusted."""

    def __len__(self) -> int:
        return 0


@dataclass(frozen=True)
class Seen(Refused):
    """Mark of a pattern that one layer has had."""


@dataclass
class Press:
    """Writes binary layers, by a template from the third of a pattern on.

    limit: bytes that templates take together at most; those that were not used for longest go.
    Any thread may write.
    """

    limit: int
    _kept: OrderedDict[Hashable, Template | Refused] = field(default_factory=OrderedDict)
    _taken: int = 0
    _lock: Lock = field(default_factory=Lock)

    def write(self, author: Author, content: Content) -> bytes:
        """The layer of a content, as usd-core writes it."""
        pattern = contents.pattern(content, author.numbers)
        known = self._look((author, pattern))
        if isinstance(known, Seen):
            known = crate.template(author, content, pattern) or Refused()
            self._keep((author, pattern), known)
        elif known is None:
            self._keep((author, pattern), Seen())
        made = known.write(author, content) if isinstance(known, Template) else None
        return made or crate.ordinary(author, content)

    def _look(self, key: Hashable) -> Template | Refused | None:
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
            return self._kept.get(key)

    def _keep(self, key: Hashable, known: Template | Refused) -> None:
        with self._lock:
            before = self._kept.pop(key, None)
            self._kept[key] = known
            self._taken += ENTRY + len(known) - (0 if before is None else ENTRY + len(before))
            while self._taken > self.limit:
                _, gone = self._kept.popitem(last=False)
                self._taken -= ENTRY + len(gone)


PRESS = Press(limit=64_000_000)
"""The one press of the process."""
