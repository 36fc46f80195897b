"""Cache of layer templates, keyed by author and pattern."""

from collections import OrderedDict
from dataclasses import dataclass, field
from threading import Lock
from typing import Protocol

from posefield.encode.usd import crate_template, text_template
from posefield.encode.usd import layer_content as contents
from posefield.encode.usd.layer_content import LayerBuilder, LayerContent, LayerPattern

TemplateKey = tuple[LayerBuilder, LayerPattern]
MAX_SAMPLE_BYTES = 16_000_000
"""Bytes of samples beyond which no template is made: it takes several times as much."""


class Template(Protocol):
    """Writer of layers of one pattern."""

    def __len__(self) -> int:
        """Return the approximate bytes of the template in memory."""

    def write(self, author: LayerBuilder, content: LayerContent) -> bytes | None:
        """Return the layer as written by usd-core; None if the template does not apply to it."""


class TemplateFormat(Protocol):
    """Form of layers, binary or text: the module `crate_template` or `text_template`."""

    def pattern(self, author: LayerBuilder, content: LayerContent) -> LayerPattern:
        """Return the pattern that selects the template."""

    def ordinary(self, author: LayerBuilder, content: LayerContent) -> bytes:
        """Return the layer as written by usd-core."""

    def template(
        self, author: LayerBuilder, content: LayerContent, pattern: LayerPattern
    ) -> Template | None:
        """Return a template of an author's layers of one pattern; None if it cannot be verified."""


@dataclass(frozen=True)
class UnverifiedPattern:
    """Entry of a pattern whose template could not be verified."""

    def __len__(self) -> int:
        return 0

    def write(self, author: LayerBuilder, content: LayerContent) -> bytes | None:
        """Return None."""
        return None


@dataclass(frozen=True)
class FirstOccurrence(UnverifiedPattern):
    """Entry of a pattern that has occurred once."""


@dataclass
class TemplateCache:
    """Writer of layers in one form, with a thread-safe cache of templates.

    A template is made when a pattern occurs for the second time. limit: approximate bytes of all
    templates and patterns; the least recently used ones are removed. taken: bytes in use.
    """

    form: TemplateFormat
    limit: int
    used_bytes: int = field(default=0, init=False)
    _entries: OrderedDict[TemplateKey, Template] = field(default_factory=OrderedDict)
    _lock: Lock = field(default_factory=Lock)

    def write(self, author: LayerBuilder, content: LayerContent) -> bytes:
        """Return the layer of a content, equal to usd-core's."""
        if contents.samples_size(content) > MAX_SAMPLE_BYTES:
            return self.form.ordinary(author, content)
        pattern = self.form.pattern(author, content)
        known = self._find((author, pattern))
        if isinstance(known, FirstOccurrence):
            known = self.form.template(author, content, pattern) or UnverifiedPattern()
            self._store((author, pattern), known)
        elif known is None:
            known = FirstOccurrence()
            self._store((author, pattern), known)
        return known.write(author, content) or self.form.ordinary(author, content)

    def _find(self, key: TemplateKey) -> Template | None:
        with self._lock:
            known = self._entries.get(key)
            if known is not None:
                self._entries.move_to_end(key)
            return known

    def _store(self, key: TemplateKey, known: Template) -> None:
        with self._lock:
            before = self._entries.pop(key, None)
            self._entries[key] = known
            self.used_bytes += _entry_size(key, known) - (
                0 if before is None else _entry_size(key, before)
            )
            while self.used_bytes > self.limit:
                self.used_bytes -= _entry_size(*self._entries.popitem(last=False))


def _entry_size(key: TemplateKey, known: Template) -> int:
    return contents.pattern_size(key[1]) + len(known)


CRATE_CACHE, TEXTS = (
    TemplateCache(crate_template, 64_000_000),
    TemplateCache(text_template, 8_000_000),
)
"""Writers of this process, of binary and text layers."""
