"""Results of finished jobs in a folder, so that a run that was stopped goes on where it was.

A result is found again by a key over the code of both packages, the versions of the libraries, the
function and all of its arguments. Its file is written as a whole or not at all, and begins with a
checksum. Results are pickles, of which only arrays and data classes of both packages are read: a
file with anything else, which could run code, is refused.
"""

import hashlib
import io
import pickle
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import joblib

import posefield
import posefield_train
from posefield.common import atomic_files
from posefield.common.errors import FileError
from posefield_train.parallel.jobs import LIBRARIES, Arguments, Jobs

SUFFIX = ".result"
ARRAY_MAKERS = ("_reconstruct", "_frombuffer", "scalar", "ndarray", "dtype")
CHECKSUM_BYTES = hashlib.sha256().digest_size


@dataclass(frozen=True)
class FinishedJobs:
    """Jobs whose results are kept. jobs: executor of those without one. folder: of the results."""

    jobs: Jobs
    folder: Path

    def run(
        self,
        function: Callable[..., Any],
        arguments: Iterable[Arguments],
        shared: Arguments = (),
    ) -> Iterator[Any]:
        """Yield the results of jobs as `Jobs.run` does, kept ones first.

        Raises FileError if a result cannot be written, and as `read_result`.
        """
        common = joblib.hash((code_key(), f"{function.__module__}.{function.__name__}", shared))
        listed = list(arguments)
        files = [self.folder / f"{joblib.hash((common, own))}{SUFFIX}" for own in listed]
        left = []
        for number, file in enumerate(files):
            kept = read_result(file)
            if kept:
                yield kept[0]
            else:
                left.append((number, listed[number]))
        for number, result in self.jobs.run(_run_numbered, left, (function, shared)):
            content = pickle.dumps(result, protocol=pickle.HIGHEST_PROTOCOL)
            atomic_files.write(hashlib.sha256(content).digest() + content, files[number])
            yield result


def _run_numbered(
    function: Callable[..., Any], shared: Arguments, number: int, own: Arguments
) -> tuple[int, Any]:
    return number, function(*shared, *own)


def read_result(file: Path) -> tuple[Any] | None:
    """Return a kept result; None if there is none, or its checksum is wrong.

    Raises FileError for a file that holds more than data.
    """
    if not file.exists():
        return None
    content = file.read_bytes()
    checksum, content = content[:CHECKSUM_BYTES], content[CHECKSUM_BYTES:]
    if hashlib.sha256(content).digest() != checksum:
        return None
    try:
        return (_DataUnpickler(io.BytesIO(content)).load(),)
    except pickle.UnpicklingError as fault:
        raise FileError(file, f"{fault}, expected arrays and data classes of posefield") from None


class _DataUnpickler(pickle.Unpickler):
    """Reader of pickles that names no function but those by which NumPy makes arrays."""

    def find_class(self, module: str, name: str) -> Any:
        """Return a class or a function of NumPy; UnpicklingError for any that is not data."""
        package = module.partition(".")[0]
        if package == "numpy" and name in ARRAY_MAKERS:
            return super().find_class(module, name)
        if package in (posefield.__name__, posefield_train.__name__):
            found = super().find_class(module, name)
            if isinstance(found, type) and is_dataclass(found):
                return found
        raise pickle.UnpicklingError(f"names {module}.{name}")


@cache
def code_key() -> str:
    """Return a key over the sources of both packages and the versions of the libraries."""
    found = hashlib.sha256()
    for package in (posefield, posefield_train):
        (place,) = package.__path__
        for file in sorted(Path(place).rglob("*.py")):
            found.update(file.relative_to(place).as_posix().encode())
            found.update(hashlib.sha256(file.read_bytes()).digest())
    for name in LIBRARIES:
        found.update(f"{name} {version(name)}".encode())
    return found.hexdigest()
