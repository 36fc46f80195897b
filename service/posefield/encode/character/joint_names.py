"""Joint names that all readers of USD accept.

With a colon, hyphen, space or leading digit some readers silently drop the whole skeleton; readers
that identify joints by their leaf name alone merge joints with equal leaf names.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence

LEGAL_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def legal_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return unique legal names in the given order; legal names are kept.

    Of several names that become equal, the later ones get the endings _2, _3, and so on.
    """
    given = list(names)
    taken = {name for name in given if LEGAL_NAME.fullmatch(name)}
    counts: Counter[str] = Counter()
    return tuple(
        n if n in taken else _unique_name(_legal_characters(n), taken, counts) for n in given
    )


def joint_paths(leaves: Sequence[str], parents: Sequence[int]) -> tuple[str, ...]:
    """Return the joint tokens of UsdSkel: names of ancestors and joint, separated by slashes."""
    found: list[str] = []
    for leaf, parent in zip(leaves, parents, strict=True):
        found.append(leaf if parent < 0 else f"{found[parent]}/{leaf}")
    return tuple(found)


def _legal_characters(name: str) -> str:
    cleaned = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return cleaned if LEGAL_NAME.fullmatch(cleaned) else f"_{cleaned}"


def _unique_name(name: str, taken: set[str], counts: Counter[str]) -> str:
    """Return a name that is not taken; counts: the last ending tried, by name."""
    found = name
    while True:
        counts[name] += 1
        found = name if counts[name] == 1 else f"{name}_{counts[name]}"
        if found not in taken:
            taken.add(found)
            return found
