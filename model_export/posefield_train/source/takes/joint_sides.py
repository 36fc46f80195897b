"""Left and right joints by their names."""

from collections.abc import Iterator

# Words for left and right anywhere in a name, and letters that begin it, or end it after a
# separator.
WORDS = (("Left", "Right"), ("left", "right"))
LETTERS = (("L", "R"), ("l", "r"))
SEPARATORS = ("_", ".", "-", " ")


def mirrored_joints(names: tuple[str, ...]) -> tuple[int, ...]:
    """Return the index (J,) of each joint's counterpart on the other side, or its own."""
    rights = _right_by_left(names)
    others = {**rights, **{right: left for left, right in rights.items()}}
    return tuple(names.index(others.get(name, name)) for name in names)


def right_joints(names: tuple[str, ...]) -> list[int]:
    """Return the joints of the right side that have a counterpart on the left."""
    rights = set(_right_by_left(names).values())
    return [joint for joint, name in enumerate(names) if name in rights]


def _right_by_left(names: tuple[str, ...]) -> dict[str, str]:
    there, found = set(names), dict[str, str]()
    for name in names:
        right = next((other for other in _right_names(name) if other in there), None)
        if right is not None and right not in found.values():
            found[name] = right
    return found


def _right_names(name: str) -> Iterator[str]:
    """Yield the names that the counterpart of a left joint may have."""
    for left, right in WORDS:
        if left in name:
            yield name.replace(left, right)
    for left, right in LETTERS:
        if name.startswith(left):
            yield right + name.removeprefix(left)
        for separator in SEPARATORS:
            if name.endswith(separator + left):
                yield name.removesuffix(left) + right
