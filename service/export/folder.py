"""A local folder of files that are whole or not there.

A file is written aside under a name that is its writer's own, and renamed: whoever is killed leaves
nothing but such a name, and two who write the same file do each other no harm.
"""

import contextlib
import errno
import os
import shutil
import time
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from service.motion.errors import FileError

TRIES, PAUSE = 40, 0.05
"""To take away a folder that another process may still be writing to; the pause in seconds."""

LINKLESS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)
"""What file systems say that have no second names for a file: exFAT, and some over a network."""


class Folder:
    """Files under a root. Paths are text: to make a path object costs a tenth of a small write."""

    def __init__(self, root: str, aside: str) -> None:
        self.root = root
        self._aside = f"{root}/{aside}/{uuid.uuid4().hex}"
        self._made: set[str] = set()

    def prepare(self) -> None:
        """Make the root, and in it the folder for what is not yet whole."""
        folder = Path(self._aside).parent
        with _said(str(folder)):
            folder.mkdir(parents=True, exist_ok=True)

    def write(self, files: Iterable[tuple[str, bytes]]) -> None:
        """Put files, each in place of that of its name."""
        for path, content in files:
            self.stream(path, (content,))

    def stream(self, path: str, pieces: Iterable[bytes]) -> int:
        """Put one file that comes in pieces; its size in bytes."""
        whole = self._path(path)
        with self._set_aside(whole, pieces) as size:
            os.rename(self._aside, whole)
        return size

    def create(self, path: str, content: bytes) -> bool:
        """Put a file where there is none; False, and nothing done, where there is one."""
        whole = self._path(path)
        with self._set_aside(whole, (content,)):
            try:
                return _place(self._aside, whole)
            finally:
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(self._aside)

    def read(self, path: str) -> bytes | None:
        """Content of a file; None where there is none."""
        with _said(self._path(path)):
            try:
                return Path(self.root, path).read_bytes()
            except (FileNotFoundError, NotADirectoryError):
                return None

    def names(self, folder: str) -> set[str]:
        """Names of the files in a folder."""
        with _said(self._path(folder)):
            try:
                return set(os.listdir(self._path(folder)))
            except FileNotFoundError:
                return set()

    def holds(self, path: str, size: int) -> bool:
        """Whether a file has stayed: after a power cut it may be there and empty."""
        try:
            return os.stat(self._path(path)).st_size == size
        except OSError:
            return False

    def empty(self, but: str) -> bool:
        """Whether nothing is here but one folder."""
        return self.names("") <= {but}

    def drop(self, path: str) -> None:
        """Take away a file, if it is there."""
        with _said(self._path(path)):
            Path(self._path(path)).unlink(missing_ok=True)

    def remove(self, folder: str) -> None:
        """Take away a folder and all that is in it."""
        for _ in range(TRIES):
            shutil.rmtree(self._path(folder), ignore_errors=True)
            if not Path(self.root, folder).exists():
                return
            time.sleep(PAUSE)
        raise FileError(self._path(folder), "cannot be taken away")

    def _path(self, path: str) -> str:
        return f"{self.root}/{path}" if path else self.root

    @contextmanager
    def _set_aside(self, whole: str, pieces: Iterable[bytes]) -> Iterator[int]:
        """Size of the pieces, which lie aside for the caller to put in place."""
        with _said(whole):
            self._room(whole.rpartition("/")[0])
            try:
                with open(self._aside, "wb") as file:
                    size = sum(map(file.write, pieces))
                yield size
            except BaseException:
                with contextlib.suppress(OSError):
                    os.unlink(self._aside)
                raise

    def _room(self, folder: str) -> None:
        if folder not in self._made:
            Path(folder).mkdir(parents=True, exist_ok=True)
            self._made.add(folder)


def _place(aside: str, whole: str) -> bool:
    """Put a file where there is none; whether there was none."""
    try:
        os.link(aside, whole)
    except FileExistsError:
        return False
    except OSError as fault:
        if fault.errno not in LINKLESS:
            raise
        # Two who begin at once may both be told that there was none; the later one's file stays.
        if os.path.exists(whole):
            return False
        os.rename(aside, whole)
    return True


@contextmanager
def _said(path: str) -> Iterator[None]:
    """Faults of the file system as FileError of that path."""
    try:
        yield
    except OSError as fault:
        raise FileError(path, f"cannot be written or read: {fault.strerror}") from fault
