"""Atomic writes of files with progress."""

import io
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from errno import EISDIR
from pathlib import Path
from stat import S_IMODE
from types import TracebackType
from typing import BinaryIO, TypeVar

import msgspec

from posefield_client import archives
from posefield_client.archives import Counter, Entry
from posefield_client.exchange import Core
from posefield_client.files import Files
from posefield_client.wire import Call, Reply, Steps


@dataclass(frozen=True)
class Progress:
    """Progress of a download: bytes received of total, and files of count for an archive."""

    received: int
    total: int | None = None
    files: int | None = None
    count: int | None = None


Line = TypeVar("Line")

Watch = Callable[[Progress], object]
"""Callback for progress. An exception from it ends the download without a file."""


@dataclass(frozen=True)
class Missed:
    """Distance of a clip from one of its constraints, in a unit."""

    what: str
    miss: float
    unit: str


@dataclass(frozen=True)
class Saved:
    """A written file and the service's metadata of it.

    model: name@hash. sigma: m. duration: s. supported: True near captured clips. inferred: values
    chosen for omitted controls. missed: constraints that are not met. entries: one per clip or
    performance of an archive.
    """

    path: Path
    bytes: int
    model: str | None
    sigma: float | None
    duration: float | None
    warnings: tuple[str, ...]
    entries: tuple[Entry, ...]
    supported: bool | None = None
    inferred: Mapping[str, float] = field(default_factory=dict, hash=False)
    missed: tuple[Missed, ...] = ()


class Part:
    """Temporary file beside the target; `keep` renames it, otherwise it is deleted at the end."""

    def __init__(self, path: Path) -> None:
        self._asked = path
        # Write the target of a symbolic link, and keep the link.
        self.path = path.resolve()
        self._beside = self.path.with_name(f".{secrets.token_hex(6)}.part")
        self.file: BinaryIO

    def __enter__(self) -> "Part":
        if self.path.is_dir():
            raise IsADirectoryError(EISDIR, "a folder, expected a file", str(self.path))
        with self._named_faults():
            self.file = self._beside.open("xb+")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        fault: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.file.close()
        with suppress(FileNotFoundError):
            self._beside.unlink()

    def keep(self) -> None:
        """Rename the complete file to its target."""
        self.file.close()
        # Keep the permissions of an existing file.
        with suppress(FileNotFoundError):
            self._beside.chmod(S_IMODE(self.path.stat().st_mode))
        with self._named_faults():
            self._beside.replace(self.path)

    @contextmanager
    def _named_faults(self) -> Iterator[None]:
        """Raise errors of the file system with the wanted path, not with the temporary one."""
        try:
            yield
        except OSError as fault:
            raise type(fault)(fault.errno, fault.strerror, str(self._asked)) from None


class Into:
    """Sink that writes to a file and reports progress."""

    def __init__(self, file: BinaryIO, ending: str, count: int | None, watch: Watch | None) -> None:
        self._file = file
        self._ending = ending
        self._count = count
        self._watch = watch
        self.begin(None)

    def begin(self, total: int | None) -> None:
        """Discard earlier content."""
        self._file.seek(0)
        self._file.truncate()
        self.received, self._total = 0, total
        self._counter = Counter(self._ending) if self._watch and self._count else None

    def write(self, chunk: bytes) -> None:
        """Write the next bytes."""
        self._file.write(chunk)
        self.received += len(chunk)
        if self._watch is not None:
            self._watch(self._progress(chunk))

    def _progress(self, chunk: bytes) -> Progress:
        if self._counter is None or self._count is None:
            return Progress(self.received, self._total)
        self._counter.feed(chunk)
        # The counter includes the manifest.
        whole = min(self._counter.files, self._count)
        return Progress(self.received, self._total, whole, self._count)


def save(core: Core, files: Files, path: Path, watch: Watch | None) -> Steps[Saved]:
    """Write a response to a file; its suffix selects the format.

    Raises PosefieldError and OSError.
    """
    ending = files.ending(path)
    request = files.request(ending)
    with Part(path) as part:

        def look(reply: Reply) -> Saved:
            return _saved(path, reply, _entries(part.file, ending, files))

        sink = Into(part.file, ending, files.count, watch)
        saved = yield from core.answer(Call(request, look), sink)
        part.keep()
        return replace(saved, bytes=sink.received)


def content(core: Core, files: Files, ending: str) -> Steps[bytes]:
    """Return a response in a format, as bytes."""

    def look(reply: Reply) -> bytes:
        _entries(io.BytesIO(reply.content), ending, files)
        return reply.content

    return (yield from core.answer(Call(files.request(ending), look)))


def _entries(file: BinaryIO, ending: str, files: Files) -> tuple[Entry, ...]:
    """Return the manifest of a complete archive; empty for other files."""
    if files.count is None:
        return ()
    file.seek(0)
    return archives.check(file, ending, files.count, files.entry)


def _saved(path: Path, reply: Reply, entries: tuple[Entry, ...]) -> Saved:
    """Return the metadata from a response's headers; ValueError if they are invalid."""
    headers = reply.headers
    return Saved(
        path,
        0,
        headers.get("posefield-model"),
        _number(headers.get("posefield-sigma")),
        _number(headers.get("posefield-duration")),
        _lines(headers.get("posefield-warning", ""), str),
        entries,
        _truth(headers.get("posefield-supported")),
        msgspec.json.decode(headers.get("posefield-inferred", "{}"), type=dict[str, float]),
        _lines(headers.get("posefield-missed", ""), Missed),
    )


def _lines(joined: str, each: type[Line]) -> tuple[Line, ...]:
    """Return the JSON values of a header with several comma-joined lines."""
    return msgspec.json.decode(f"[{joined}]", type=tuple[each, ...])  # type: ignore[valid-type]


def _truth(text: str | None) -> bool | None:
    return None if text is None else text == "true"


def _number(text: str | None) -> float | None:
    return None if text is None else float(text)
