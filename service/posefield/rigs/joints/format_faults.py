"""Errors of files whose values have wrong types, which libraries find where they are used."""

from collections.abc import Iterator
from contextlib import contextmanager

from posefield.common.errors import MotionFileError


@contextmanager
def naming_faults(source: str, *faults: type[Exception]) -> Iterator[None]:
    """Raise faults of values of wrong types as MotionFileError with the file's name."""
    try:
        yield
    except faults as fault:
        said = f"{type(fault).__name__}: {' '.join(str(fault).split())[:200]}"
        raise MotionFileError(source, f"breaks its format: {said}") from fault
