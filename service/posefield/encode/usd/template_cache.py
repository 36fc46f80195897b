"""Cache of layer templates, keyed by author and pattern."""

from collections import OrderedDict
from dataclasses import dataclass, field
from threading import Lock
from typing import Protocol

from posefield.encode.usd import crate_template, text_template
from posefield.encode.usd import layer_content as contents
from posefield.encode.usd.layer_content import Author, Content, Pattern

Key = tuple[Author, Pattern]
LARGE = 16_000_000
"""Bytes of samples beyond which no template is made: it takes several times as much."""


class Template(Protocol):
    """Writer of layers of one pattern."""

    def __len__(self) -> int:
        """Return the approximate bytes of the template in memory."""

    def write(self, author: Author, content: Content) -> bytes | None:
        """Return the layer as written by usd-core; None if the template does not apply to it."""


class Form(Protocol):
    """Form of layers, binary or text: the module `crate` or `text`."""

    def pattern(self, author: Author, content: Content) -> Pattern:
        """Return the pattern that selects the template."""

    def ordinary(self, author: Author, content: Content) -> bytes:
        """Return the layer as written by usd-core."""

    def template(self, author: Author, content: Content, pattern: Pattern) -> Template | None:
        """Return a template of an author's layers of one pattern; None if it cannot be verified."""


@dataclass(frozen=True)
class Refused:
    """Entry of a pattern whose template could not be verified."""

    def __len__(self) -> int:
        return 0

    def write(self, author: Author, content: Content) -> bytes | None:
        """Return None."""
        return None


@dataclass(frozen=True)
class Seen(Refused):
    """Entry of a pattern that has occurred once."""


@dataclass
class Press:
    """Writer of layers in one form, with a thread-safe cache of templates.

    A template is made when a pattern occurs for the second time. limit: approximate bytes of all
    templates and patterns; the least recently used ones are removed. taken: bytes in use.
    """

    form: Form
    limit: int
    taken: int = field(default=0, init=False)
    _kept: OrderedDict[Key, Template] = field(default_factory=OrderedDict)
    _lock: Lock = field(default_factory=Lock)

    def write(self, author: Author, content: Content) -> bytes:
        """Return the layer of a content, equal to usd-core's."""
        if contents.samples_size(content) > LARGE:
            return self.form.ordinary(author, content)
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
            self.taken += _size(key, known) - (0 if before is None else _size(key, before))
            while self.taken > self.limit:
                self.taken -= _size(*self._kept.popitem(last=False))


def _size(key: Key, known: Template) -> int:
    return contents.size(key[1]) + len(known)


CRATES, TEXTS = Press(crate_template, 64_000_000), Press(text_template, 8_000_000)
"""Writers of this process, of binary and text layers."""
