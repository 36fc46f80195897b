"""Suggestion of the known name that is most similar to an unknown one.

The unknown name may be a client's text, so its length and the number of compared names are bounded.
"""

from collections.abc import Iterable
from itertools import islice

MAX_NAME_LENGTH = 40
"""Longer names get no suggestion, since a comparison takes quadratic time."""
MAX_NAMES = 1000
"""Number of known names that are compared, as many as a motion file can have joints."""
MIN_PREFIX = 3
"""Length from which the beginning of a name suggests it."""
SIMILARITY = 0.7
"""Smallest similarity of a suggestion: share of equal characters, as `difflib` defines it."""


def similar_name(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most similar to `name`, or None if none is similar enough.

    None also if two are equally similar. Case and the separators "_", "-", ":" and " " do not
    count.
    """
    if len(name) > MAX_NAME_LENGTH:
        return None
    short = (each for each in islice(known, MAX_NAMES) if len(each) <= MAX_NAME_LENGTH)
    plain = {_plain(each): each for each in short}
    # Imported here, because only refused questions need it.
    from difflib import SequenceMatcher, get_close_matches

    wanted = _plain(name)
    begun = [each for each in plain if len(wanted) >= MIN_PREFIX and each.startswith(wanted)]
    if len(begun) == 1:
        return plain[begun[0]]
    found = get_close_matches(wanted, plain, n=2, cutoff=SIMILARITY)
    tied = len({SequenceMatcher(None, each, wanted).ratio() for each in found}) < len(found)
    return plain[found[0]] if found and not tied else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the text " (did you mean 'NAME'?)" to follow an unknown name, or "" for no name."""
    found = similar_name(name, known)
    return "" if found is None else f" (did you mean {found!r}?)"


_SEPARATORS = str.maketrans("", "", "_-: ")


def _plain(name: str) -> str:
    return name.casefold().translate(_SEPARATORS)
