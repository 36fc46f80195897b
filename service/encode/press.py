"""Templates that were made, kept for the layers that come."""

from collections import OrderedDict
from dataclasses import dataclass, field
from threading import Lock
from typing import Protocol

from service.encode import content as contents
from service.encode import crate, text
from service.encode.content import Author, Content, Pattern

Key = tuple[Author, Pattern]


class Template(Protocol):
    """Writes layers of one pattern."""

    def __len__(self) -> int:
        """Bytes that it takes, about."""

    def write(self, author: Author, content: Content) -> bytes | None:
        """The layer as usd-core writes it; None where it can do no such thing."""


class Form(Protocol):
    """A way to write layers: `crate` or `text`."""

    def pattern(self, author: Author, content: Content) -> Pattern:
        """What a template hangs on."""

    def ordinary(self, author: Author, content: Content) -> bytes:
        """The layer as usd-core writes it."""

    def template(self, author: Author, content: Content, pattern: Pattern) -> Template | None:
        """Template of an author's layers of one pattern, or None where it cannot be trusted."""


@dataclass(frozen=True)
class Refused:
    """Mark of a pattern whose template cannot be trusted."""

    def __len__(self) -> int:
        return 0

    def write(self, author: Author, content: Content) -> bytes | None:
        """Nothing."""
        return None


@dataclass(frozen=True)
class Seen(Refused):
    """Mark of a pattern that one layer has had."""


@dataclass
class Press:
    """Writes layers in one form, by a template from the second of a pattern on.

    limit: bytes that templates and patterns take together at most, about; those that were not used
    for longest go.
    Any thread may write.
    """

    form: Form
    limit: int
    _kept: OrderedDict[Key, Template] = field(default_factory=OrderedDict)
    _taken: int = 0
    _lock: Lock = field(default_factory=Lock)

    def write(self, author: Author, content: Content) -> bytes:
        """The layer of a content, as usd-core writes it."""
        pattern = self.form.pattern(author, content)
        known = self._look((author, pattern))
        if isinstance(known, Seen):
            known = self.form.template(author, content, pattern) or Refused()
            self._keep((author, pattern), known)
        elif known is None:
            known = Seen()
            self._keep((author, pattern), known)
        return known.write(author, content) or self.form.ordinary(author, content)

    def _look(self, key: Key) -> Template | None:
        with self._lock:
            known = self._kept.get(key)
            if known is not None:
                self._kept.move_to_end(key)
            return known

    def _keep(self, key: Key, known: Template) -> None:
        with self._lock:
            before = self._kept.pop(key, None)
            self._kept[key] = known
            self._taken += _size(key, known) - (0 if before is None else _size(key, before))
            while self._taken > self.limit:
                self._taken -= _size(*self._kept.popitem(last=False))


def _size(key: Key, known: Template) -> int:
    return contents.size(key[1]) + len(known)


CRATES, TEXTS = Press(crate, 64_000_000), Press(text, 8_000_000)
"""The presses of the process."""
