"""The data folder: motion files in folders, or in zip files of those folders' names."""

import zipfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath

from service.motion.errors import RecipeError


@dataclass(frozen=True)
class Member:
    """A file within a zip file, by name alone: it can be sent to another process."""

    archive: Path
    entry: str

    def __str__(self) -> str:
        return f"{self.archive}/{self.entry}"

    @property
    def name(self) -> str:
        """The last part of its name."""
        return PurePosixPath(self.entry).name

    def is_file(self) -> bool:
        """Whether the archive has it."""
        return zipfile.Path(_open(self.archive), self.entry).is_file()

    def read_bytes(self) -> bytes:
        """Everything that the file holds."""
        return _open(self.archive).read(self.entry)


Place = Path | Member


def find(folder: Path, name: str) -> Place:
    """File of a relative name such as "takes/bvh/walk.bvh" below the data folder.

    Where there is no folder "takes" but a takes.zip, the file is read out of that, be its entries
    "takes/bvh/walk.bvh" or "bvh/walk.bvh". Raises RecipeError naming every place that was tried.
    """
    parts = PurePosixPath(name).parts
    if not parts or parts[0] == "/" or ".." in parts:
        raise RecipeError(folder, f"file {name!r}, expected a path below the data folder")
    places = [folder / name, *_in_zip(folder, parts)]
    for place in places:
        if _is_there(place):
            return place
    tried = ", ".join(str(place) for place in places)
    raise RecipeError(folder, f"no file {name!r}; tried {tried}")


def _is_there(place: Place) -> bool:
    try:
        return place.is_file()
    except OSError:  # a name that no file can have
        return False


def _in_zip(folder: Path, parts: tuple[str, ...]) -> list[Place]:
    archive = folder / f"{parts[0]}.zip"
    if len(parts) < 2 or not archive.is_file():
        return []
    names = ("/".join(parts), "/".join(parts[1:]))
    return [Member(archive, name) for name in names]


@lru_cache(maxsize=8)
def _open(archive: Path) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(archive)
    except zipfile.BadZipFile as fault:
        raise RecipeError(archive, f"not a zip file: {fault}") from fault
