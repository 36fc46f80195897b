"""Values that follow from their keys alone, kept while they are in use."""

from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from threading import Lock
from typing import Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


@dataclass
class ValueCache(Generic[Key, Value]):
    """Bounded cache for several threads; the least recently used values are removed.

    capacity: largest number of values. Values must not be changed. Unlike `lru_cache` of functools,
    it makes a value from arguments that are not part of the key, so that it keeps no model in
    memory.
    """

    capacity: int
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
        value = make()
        self._keep({key: value})
        return value

    def find_all(
        self, keys: Sequence[Key], make: Callable[[list[Key]], Iterable[Value]]
    ) -> list[Value]:
        """Return the values of keys; `make` returns those of the keys that are not known.

        It is called once at most, with each key once. Values must not depend on which other keys
        are made with them.
        """
        with self._lock:
            values = {key: self._values[key] for key in keys if key in self._values}
            for key in values:
                self._values.move_to_end(key)
        missing = [key for key in dict.fromkeys(keys) if key not in values]
        if missing:
            new = dict(zip(missing, make(missing), strict=True))
            self._keep(new)
            values |= new
        return [values[key] for key in keys]

    def _keep(self, new: Mapping[Key, Value]) -> None:
        with self._lock:
            for key, value in new.items():
                self._values[key] = value
                self._values.move_to_end(key)
            while len(self._values) > self.capacity:
                self._values.popitem(last=False)
