"""Formats: their names and media types."""

from dataclasses import dataclass
from typing import TypeVar

JSON = "application/json"
ARROW = "application/vnd.apache.arrow.stream"
MSGPACK = "application/vnd.msgpack"
# No type is registered for archives of arrays; some browsers would unpack application/zip.
NPZ = "application/x-npz"


@dataclass(frozen=True)
class Format:
    """Name and media type of a format; the name is the extension of its files."""

    extension: str
    media_type: str


F = TypeVar("F", bound=Format)


def by_extension(*formats: F) -> dict[str, F]:
    """Return formats by their extensions, in the given order."""
    return {each.extension: each for each in formats}
