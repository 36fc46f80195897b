"""Atomic writes of files with progress, and archives that are complete."""

import secrets
import tarfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from errno import EISDIR
from pathlib import Path
from stat import S_IMODE
from typing import BinaryIO, TypeVar

import msgspec

from posefield_client.errors import IncompleteAnswer
from posefield_client.questions import Entry, Files
from posefield_client.wire import Reply

Line = TypeVar("Line")
MANIFEST = "manifest.jsonl"


@dataclass(frozen=True)
class Progress:
    """Progress of a download: bytes received of total, which is None if unknown."""

    received: int
    total: int | None = None


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
    """Sink with a temporary file beside the target, deleted unless `keep` renames it."""

    def __init__(self, path: Path, watch: Watch | None) -> None:
        self.path = path
        # Write the target of a symbolic link, and keep the link.
        self._target = path.resolve()
        self._temporary = self._target.with_name(f".{secrets.token_hex(6)}.part")
        self._watch = watch
        self._received = 0
        self._total: int | None = None
        self.file: BinaryIO

    def __enter__(self) -> "Part":
        if self._target.is_dir():
            raise IsADirectoryError(EISDIR, "a folder, expected a file", str(self._target))
        with self._named_errors():
            self.file = self._temporary.open("xb+")
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()
        with suppress(FileNotFoundError):
            self._temporary.unlink()

    def begin(self, total: int | None) -> None:
        """Discard the content of an earlier attempt."""
        self.file.seek(0)
        self.file.truncate()
        self._received, self._total = 0, total

    def write(self, chunk: bytes) -> None:
        """Write the next bytes."""
        self.file.write(chunk)
        self._received += len(chunk)
        if self._watch is not None:
            self._watch(Progress(self._received, self._total))

    def keep(self) -> None:
        """Rename the complete file to its target."""
        self.file.close()
        # Keep the permissions of an existing file.
        with suppress(FileNotFoundError):
            self._temporary.chmod(S_IMODE(self._target.stat().st_mode))
        with self._named_errors():
            self._temporary.replace(self._target)

    def saved(self, form: str, files: Files, reply: Reply) -> Saved:
        """Return the metadata from a response's headers; ValueError if they are invalid."""
        headers = reply.headers
        supported = headers.get("posefield-supported")
        return Saved(
            self.path,
            self._received,
            headers.get("posefield-model"),
            _number(headers.get("posefield-sigma")),
            _number(headers.get("posefield-duration")),
            _lines(headers.get("posefield-warning", ""), str),
            entries(self.file, form, files),
            None if supported is None else supported == "true",
            msgspec.json.decode(headers.get("posefield-inferred", "{}"), type=dict[str, float]),
            _lines(headers.get("posefield-missed", ""), Missed),
        )

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        """Raise errors of the file system with the wanted path, not with the temporary one."""
        try:
            yield
        except OSError as error:
            raise type(error)(error.errno, error.strerror, str(self.path)) from None


def entries(file: BinaryIO, form: str, files: Files) -> tuple[Entry, ...]:
    """Return the manifest of an archive; empty for other files.

    Raises IncompleteAnswer if the archive does not match its manifest.
    """
    if files.count is None:
        return ()
    file.seek(0)
    try:
        sizes, manifest = _zip(file) if form == "zip" else _tar(file)
        decoder = msgspec.json.Decoder(files.entry)
        lines = tuple(map(decoder.decode, manifest.splitlines()))
    except (zipfile.BadZipFile, tarfile.TarError, KeyError, msgspec.DecodeError, EOFError) as error:
        raise IncompleteAnswer(f"the archive broke off: {error}") from None
    clips = {name: size for name, size in sizes.items() if name != MANIFEST}
    complete = len(lines) == files.count and clips == {line.file: line.bytes for line in lines}
    if list(sizes)[-1:] != [MANIFEST] or not complete:
        raise IncompleteAnswer(f"the archive holds {len(sizes)} files, expected {files.count + 1}")
    return lines


def _zip(file: BinaryIO) -> tuple[dict[str, int], bytes]:
    with zipfile.ZipFile(file) as archive:
        sizes = {info.filename: info.file_size for info in archive.infolist()}
        return sizes, archive.read(MANIFEST)


def _tar(file: BinaryIO) -> tuple[dict[str, int], bytes]:
    with tarfile.open(fileobj=file, mode="r:") as archive:
        sizes = {member.name: member.size for member in archive.getmembers()}
        manifest = archive.extractfile(MANIFEST)
        assert manifest is not None
        return sizes, manifest.read()


def _lines(joined: str, kind: type[Line]) -> tuple[Line, ...]:
    """Return the JSON values of a header with several comma-joined lines."""
    return msgspec.json.decode(f"[{joined}]", type=tuple[kind, ...])  # type: ignore[valid-type]


def _number(text: str | None) -> float | None:
    return None if text is None else float(text)
