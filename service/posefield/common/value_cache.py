"""Values that follow from their keys alone, kept while they are in use."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from threading import Lock
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


@dataclass
class ValueCache(Generic[Key, Value]):
    """Bounded cache for several threads; the least recently used values are removed.

    most: largest number of values. Values must not be changed. Unlike `lru_cache` of functools, it
    makes a value from what is no part of the key, so that it keeps no model in memory.
    """

    most: int
    _values: OrderedDict[Key, Value] = field(default_factory=OrderedDict, init=False)
    _lock: Lock = field(default_factory=Lock, init=False)

    def __len__(self) -> int:
        """Return the number of values."""
        return len(self._values)

    def find(self, key: Key, make: Callable[[], Value]) -> Value:
        """Return the value of a key; `make` returns it when it is not known.

        What `make` raises is raised and not kept. Two threads that ask for one key at once may
        both make it.
        """
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                return self._values[key]
        made = make()
        with self._lock:
            self._values[key] = made
            self._values.move_to_end(key)
            while len(self._values) > self.most:
                self._values.popitem(last=False)
        return made
