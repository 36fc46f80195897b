"""Cache of templates of text layers, keyed by author and pattern."""

from collections import OrderedDict
from dataclasses import dataclass, field
from threading import Lock

from posefield.encode.usd_layers import layer_content, text_template
from posefield.encode.usd_layers.layer_content import LayerBuilder, LayerContent, LayerPattern
from posefield.encode.usd_layers.text_template import TextTemplate

TextKey = tuple[LayerBuilder, LayerPattern]
MAX_SAMPLE_BYTES = 16_000_000
"""Bytes of samples beyond which no template is made: it takes several times as much."""
ENTRY_BYTES = 1500
"""Approximate bytes of an entry without its template."""


@dataclass(frozen=True)
class Entry:
    """Entry of a pattern: its template, None without. tried: whether making one was tried."""

    template: TextTemplate | None
    tried: bool

    @property
    def size(self) -> int:
        """Return the approximate bytes of the entry in memory."""
        return ENTRY_BYTES + (0 if self.template is None else len(self.template))


ONCE = Entry(None, tried=False)
"""Entry of a pattern that has occurred once."""


@dataclass
class TextCache:
    """Writer of text layers, with a thread-safe cache of templates.

    A template is made when a pattern occurs for the second time. limit: approximate bytes of all
    entries; the least recently used ones are removed. used_bytes: bytes in use.
    """

    limit: int
    used_bytes: int = field(default=0, init=False)
    _entries: OrderedDict[TextKey, Entry] = field(default_factory=OrderedDict)
    _lock: Lock = field(default_factory=Lock)

    def write(self, author: LayerBuilder, content: LayerContent) -> bytes:
        """Return the layer of a content, equal to usd-core's."""
        if layer_content.samples_size(content) > MAX_SAMPLE_BYTES:
            return text_template.ordinary(author, content)
        key = (author, text_template.pattern(content))
        entry = self._find(key)
        if entry == ONCE:
            entry = Entry(text_template.template(author, content, key[1]), tried=True)
            self._store(key, entry)
        elif entry is None:
            self._store(key, ONCE)
        written = entry.template.write(author, content) if entry and entry.template else None
        return written or text_template.ordinary(author, content)

    def _find(self, key: TextKey) -> Entry | None:
        with self._lock:
            known = self._entries.get(key)
            if known is not None:
                self._entries.move_to_end(key)
            return known

    def _store(self, key: TextKey, entry: Entry) -> None:
        with self._lock:
            before = self._entries.pop(key, None)
            self._entries[key] = entry
            self.used_bytes += entry.size - (0 if before is None else before.size)
            while self.used_bytes > self.limit:
                self.used_bytes -= self._entries.popitem(last=False)[1].size


TEXTS = TextCache(8_000_000)
"""Writer of text layers of this process."""
