"""Data folder: motion files in folders or in zip files named after those; shipped recipes."""

import io
import struct
import zipfile
import zlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import IO, TYPE_CHECKING, Literal

from posefield.common.errors import InvalidField, RecipeError, did_you_mean

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

COMPRESSION_METHODS = {zipfile.ZIP_STORED: "stored", zipfile.ZIP_DEFLATED: "deflate"}
"""Accepted compression methods. For bzip2 and LZMA, `zipfile` unpacks the whole content of 4 kB at
once, which can be gigabytes."""

ENCRYPTED = 0x1
"""Flag of a member that needs a password."""

ZIP_ERRORS = (
    zipfile.BadZipFile,
    NotImplementedError,
    zlib.error,
    EOFError,
    OSError,
    struct.error,
    ValueError,
)
"""Errors of zipfile and zlib for damaged data and for features that zipfile lacks."""

CHUNK_BYTES = 1_000_000
"""Bytes that are unpacked per read."""


@dataclass(frozen=True)
class ZipMember:
    """A file within a zip file.

    It holds names only, so that it can be sent to another process.
    """

    archive: Path
    entry: str

    def __str__(self) -> str:
        return f"{self.archive}/{self.entry}"

    @property
    def name(self) -> str:
        """Return the last component of the entry's path."""
        return PurePosixPath(self.entry).name

    def is_file(self) -> bool:
        """Return True if the archive contains the entry as a file."""
        return zipfile.Path(_open_zip(self.archive), self.entry).is_file()

    def open(self, mode: Literal["rb"]) -> io.BufferedReader:
        """Open the file and decompress it while it is read, whatever size its header declares.

        Raises RecipeError, on opening or reading, for an encrypted or damaged member and for a
        compression method other than METHODS.
        """
        info = _open_zip(self.archive).getinfo(self.entry)
        if info.flag_bits & ENCRYPTED:
            raise RecipeError(str(self), "found an encrypted member, expected no password")
        if info.compress_type not in COMPRESSION_METHODS:
            methods = " or ".join(
                f"{number} ({name})" for number, name in COMPRESSION_METHODS.items()
            )
            raise RecipeError(
                str(self), f"found compression method {info.compress_type}, expected {methods}"
            )
        try:
            file = _open_zip(self.archive).open(self.entry)
        except ZIP_ERRORS as fault:
            raise _member_error(self, fault) from fault
        return io.BufferedReader(_MemberStream(self, file), CHUNK_BYTES)


class _MemberStream(io.RawIOBase):
    """Raw bytes of a member; zip errors are raised as RecipeError with the member's name."""

    def __init__(self, member: ZipMember, file: IO[bytes]) -> None:
        self._member, self._file = member, file

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: "WriteableBuffer") -> int:
        view = memoryview(buffer)
        try:
            piece = self._file.read(min(len(view), CHUNK_BYTES))
        except ZIP_ERRORS as fault:
            raise _member_error(self._member, fault) from fault
        view[: len(piece)] = piece
        return len(piece)

    def close(self) -> None:
        if not self.closed:
            self._file.close()
        super().close()


def _member_error(member: ZipMember, fault: Exception) -> RecipeError:
    message = f"found data that cannot be unpacked ({fault}), expected a whole zip member"
    return RecipeError(str(member), message)


FileLocation = Path | ZipMember


def read(path: FileLocation, max_bytes: int, what: str) -> bytes:
    """Return the whole content of a file; `what` names it in the message of one that is too large.

    Raises RecipeError for more than `max_bytes` bytes, reading at most one byte more, and if the
    file cannot be read.
    """
    try:
        with path.open("rb") as file:
            content = file.read(max_bytes + 1)
    except OSError as fault:
        raise RecipeError(str(path), f"cannot be read: {fault.strerror}") from fault
    if len(content) > max_bytes:
        size = f"{max_bytes // 1000} kB"
        raise RecipeError(str(path), f"found more than {size}, expected {what} of at most {size}")
    return content


def names_beside(file: FileLocation) -> list[str]:
    """Return the names of the files in the folder of a file, in order."""
    if isinstance(file, Path):
        return sorted(path.name for path in file.parent.iterdir() if path.is_file())
    folder = PurePosixPath(file.entry).parent
    entries = map(PurePosixPath, _open_zip(file.archive).namelist())
    return sorted(entry.name for entry in entries if entry.parent == folder)


def beside(file: FileLocation, name: str) -> FileLocation:
    """Return the file with a relative name such as "data/walk.bin" seen from the folder of a file.

    Raises RecipeError for a name that leads out of this folder, and if there is no such file.
    """
    components = PurePosixPath(name).parts
    if not components or components[0] == "/" or ".." in components:
        raise RecipeError(str(file), f"file {name!r}, expected a path below its folder")
    if isinstance(file, Path):
        neighbour: FileLocation = file.parent / name
    else:
        neighbour = ZipMember(file.archive, str(PurePosixPath(file.entry).parent / name))
    if not _is_file(neighbour):
        raise RecipeError(str(file), f"no file {name!r} beside it, expected one")
    return neighbour


def find(folder: Path, name: str) -> FileLocation:
    """Return the file with a relative name such as "takes/bvh/walk.bvh" below the data folder.

    If the file does not exist, takes.zip is searched for "takes/bvh/walk.bvh" and "bvh/walk.bvh".
    Raises RecipeError, naming every path tried, if none exists.
    """
    components = PurePosixPath(name).parts
    if not components or components[0] == "/" or ".." in components:
        raise RecipeError(folder, f"file {name!r}, expected a path below the data folder")
    candidates: list[FileLocation] = [folder / name]
    archive = folder / f"{components[0]}.zip"
    if len(components) > 1 and archive.is_file():
        candidates += [
            ZipMember(archive, "/".join(components)),
            ZipMember(archive, "/".join(components[1:])),
        ]
    for candidate in candidates:
        if _is_file(candidate):
            return candidate
    tried = ", ".join(str(candidate) for candidate in candidates)
    raise RecipeError(folder, f"no file {name!r}; tried {tried}")


def _is_file(file: FileLocation) -> bool:
    try:
        return file.is_file()
    except OSError:  # a name that no file can have
        return False


@lru_cache(maxsize=8)
def _open_zip(archive: Path) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(archive)
    except ZIP_ERRORS as fault:
        raise RecipeError(archive, f"not a zip file: {fault}") from fault


RECIPES = Path(__file__).parents[1] / "recipes"


def shipped_names() -> list[str]:
    """Return the names of the recipes."""
    return sorted(path.stem for path in RECIPES.glob("*.toml"))


def recipe_file(argument: Path, data: Path | None) -> Path:
    """Return the recipe file of a command's argument: a path, or the name of a shipped recipe.

    data: folder of the motion data, which a shipped recipe needs. Raises InvalidField for an
    unknown name and for a shipped recipe without data.
    """
    if argument.suffix or len(argument.parts) > 1 or argument.exists():
        return argument
    if argument.name not in (names := shipped_names()):
        shipped = ", ".join(names)
        quoted = f"{argument.name!r}{did_you_mean(argument.name, names)}"
        raise InvalidField("RECIPE", f"{quoted}, expected a TOML file or one of {shipped}")
    if data is None:
        raise InvalidField("data", f"missing, expected the folder of the data of {argument.name}")
    return RECIPES / f"{argument.name}.toml"


def find_table(folder: Path, name: str, recipe_folder: Path | None = None) -> FileLocation:
    """Return the table of clips in a data folder, else beside the recipe, else the shipped one.

    recipe_folder: folder of the recipe. Raises RecipeError, as `data_folder.find`, if none exists.
    """
    try:
        return find(folder, name)
    except RecipeError:
        if (
            recipe_folder is not None
            and ".." not in Path(name).parts
            and (recipe_folder / name).is_file()
        ):
            return recipe_folder / name
        shipped = {path.relative_to(RECIPES).as_posix(): path for path in RECIPES.glob("*/*.csv")}
        if name not in shipped:
            raise
        return shipped[name]


def table_notes(table: str) -> list[str]:
    """Return a note on the use of a shipped table; none for a table of the data folder."""
    if not Path(table).is_relative_to(RECIPES):
        return []
    name = Path(table).relative_to(RECIPES).as_posix()
    return [f"{name}: the data folder has no such table, the one that ships was used"]
