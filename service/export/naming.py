"""What clips are called: names that every file system and every archive takes."""

import re
from collections.abc import Iterable, Iterator

from service.export.query import Fault

PATTERN = r"^[A-Za-z0-9_-][A-Za-z0-9._-]{0,99}\Z"
LEGAL = "1 to 100 letters, digits, dots, hyphens and underscores, with no dot at the start"


def legal(name: str) -> bool:
    """Whether a clip may be called so: 1 to 100 letters, digits and ._- in ASCII, no dot first."""
    return re.match(PATTERN, name) is not None


def numbered(index: int) -> str:
    """Name of the clip at a place, from 0, that was given none."""
    return f"clip-{index:06d}"


def twice(names: Iterable[str]) -> Iterator[Fault]:
    """Each name that was there before, its place the index of the clip.

    Names that differ in capitals alone are one: they are on some file systems.
    """
    first: dict[str, int] = {}
    for index, name in enumerate(names):
        before = first.setdefault(name.casefold(), index)
        if before != index:
            yield Fault(str(index), f"{name!r} is the name of clip {before} too")
