"""Files in an object store: S3 and its like, Google's or Azure's, by URL, through obstore.

An object is there whole or not at all by itself. Endpoint, region and credentials are what the
store's own tools take: AWS_ENDPOINT_URL, AWS_ACCESS_KEY_ID and the like in the environment.
"""

import asyncio
from collections.abc import AsyncIterator, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import obstore
from obstore.exceptions import AlreadyExistsError, BaseError

from service.motion.errors import FileError
from service.synthesis import objects

PIECE = 8 << 20
"""Bytes that a large file is sent in; S3 takes 10,000 of them at most, and none below 5 MiB."""
AT_ONCE = 4
"""Pieces of one file on their way at once."""
LISTED = 1000
"""Names asked for at once."""


class Store:
    """Objects under the path of a URL."""

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        with _said(self.url):
            self._store: Any = objects.connect(self.url)

    def prepare(self) -> None:
        """Nothing: a store has no folders."""

    def write(self, files: Iterable[tuple[str, bytes]]) -> None:
        """Put files, all of them at once: each takes long, and all together little longer."""
        asyncio.run(self._write(list(files)))

    async def _write(self, files: list[tuple[str, bytes]]) -> None:
        puts = (obstore.put_async(self._store, path, content) for path, content in files)
        results = await asyncio.gather(*puts, return_exceptions=True)
        for (path, _), result in zip(files, results, strict=True):
            with _said(self._url(path)):
                if isinstance(result, BaseException):
                    raise result

    def stream(self, path: str, pieces: Iterable[bytes]) -> int:
        """Put one file that comes in pieces; its size in bytes."""
        sizes: list[int] = []
        with _said(self._url(path)):
            asyncio.run(self._stream(path, _counted(pieces, sizes)))
        return sum(sizes)

    async def _stream(self, path: str, pieces: AsyncIterator[bytes]) -> None:
        await obstore.put_async(
            self._store,
            path,
            pieces,
            use_multipart=True,
            chunk_size=PIECE,
            max_concurrency=AT_ONCE,
        )

    def create(self, path: str, content: bytes) -> bool:
        """Put a file where there is none; False, and nothing done, where there is one."""
        with _said(self._url(path)):
            try:
                obstore.put(self._store, path, content, mode="create")
            except AlreadyExistsError:
                return False
        return True

    def read(self, path: str) -> bytes | None:
        """Content of a file; None where there is none."""
        with _said(self._url(path)):
            try:
                return bytes(obstore.get(self._store, path).bytes())
            except FileNotFoundError:
                return None

    def names(self, folder: str) -> set[str]:
        """Names of the files in a folder."""
        with _said(self._url(folder)):
            batches = obstore.list(self._store, f"{folder}/", chunk_size=LISTED)
            return {meta["path"].rpartition("/")[2] for batch in batches for meta in batch}

    def holds(self, path: str, size: int) -> bool:
        """True: a store keeps what it has acknowledged."""
        return True

    def empty(self, but: str) -> bool:
        """Whether nothing is here but one folder."""
        with _said(self.url):
            found = obstore.list_with_delimiter(self._store)
        return not found["objects"] and set(found["common_prefixes"]) <= {but}

    def drop(self, path: str) -> None:
        """Take away a file, if it is there."""
        with _said(self._url(path)):
            obstore.delete(self._store, path)

    def remove(self, folder: str) -> None:
        """Take away a folder and all that is in it."""
        with _said(self._url(folder)):
            for batch in obstore.list(self._store, f"{folder}/", chunk_size=LISTED):
                obstore.delete(self._store, [meta["path"] for meta in batch])

    def _url(self, path: str) -> str:
        return f"{self.url}/{path}"


async def _counted(pieces: Iterable[bytes], sizes: list[int]) -> AsyncIterator[bytes]:
    # Taken in the loop of this thread, which may ask the store for other things meanwhile.
    for piece in pieces:
        sizes.append(len(piece))
        yield piece


@contextmanager
def _said(url: str) -> Iterator[None]:
    """Faults of the store as FileError of that object."""
    try:
        yield
    except (BaseError, OSError, ValueError) as fault:
        first = str(fault).partition("\n")[0]
        raise FileError(url, f"cannot be written or read: {first}") from fault
