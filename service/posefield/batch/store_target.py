"""Object store as a target, by URL, through obstore.

These are S3 and compatible stores, Google Cloud Storage and Azure. Stores write objects atomically.
Endpoint, region and credentials come from the environment variables of the store's own tools, such
as AWS_ENDPOINT_URL and AWS_ACCESS_KEY_ID.
"""

import asyncio
from collections.abc import AsyncIterator, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import obstore
from obstore.exceptions import AlreadyExistsError, BaseError

from posefield.common.errors import FileError
from posefield.registry import object_store

PART_SIZE = 8 << 20
"""Part size of multipart uploads, bytes; S3 allows 10,000 parts at most, and none below 5 MiB."""
CONCURRENT_PARTS = 4
"""Concurrent parts of one upload."""
LIST_PAGE_SIZE = 1000
"""Objects of one page of a listing."""


class StoreTarget:
    """Objects under the path of a URL."""

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        with _store_errors(self.url):
            self._store: Any = object_store.connect(self.url)

    def prepare(self) -> None:
        """Do nothing: a store has no folders."""

    def write(self, files: Iterable[tuple[str, bytes]]) -> None:
        """Write files concurrently, since latency dominates."""
        asyncio.run(self._write(list(files)))

    async def _write(self, files: list[tuple[str, bytes]]) -> None:
        puts = (obstore.put_async(self._store, path, content) for path, content in files)
        results = await asyncio.gather(*puts, return_exceptions=True)
        for (path, _), result in zip(files, results, strict=True):
            with _store_errors(self._url(path)):
                if isinstance(result, BaseException):
                    raise result

    def stream(self, path: str, pieces: Iterable[bytes]) -> None:
        with _store_errors(self._url(path)):
            asyncio.run(self._stream(path, _async_pieces(pieces)))

    async def _stream(self, path: str, pieces: AsyncIterator[bytes]) -> None:
        await obstore.put_async(
            self._store,
            path,
            pieces,
            use_multipart=True,
            chunk_size=PART_SIZE,
            max_concurrency=CONCURRENT_PARTS,
        )

    def create(self, path: str, content: bytes) -> bool:
        with _store_errors(self._url(path)):
            try:
                obstore.put(self._store, path, content, mode="create")
            except AlreadyExistsError:
                return False
        return True

    def read(self, path: str) -> bytes | None:
        with _store_errors(self._url(path)):
            try:
                return bytes(obstore.get(self._store, path).bytes())
            except FileNotFoundError:
                return None

    def pieces(self, path: str) -> Iterator[bytes]:
        with _store_errors(self._url(path)), suppress(FileNotFoundError):
            yield from map(bytes, obstore.get(self._store, path).stream(min_chunk_size=PART_SIZE))

    def names(self, folder: str) -> set[str]:
        with _store_errors(self._url(folder)):
            batches = obstore.list(self._store, f"{folder}/", chunk_size=LIST_PAGE_SIZE)
            return {meta["path"].rpartition("/")[2] for batch in batches for meta in batch}

    def holds(self, path: str, size: int) -> bool:
        """Return true: a store keeps acknowledged objects."""
        return True

    def empty(self, but: str) -> bool:
        with _store_errors(self.url):
            listing = obstore.list_with_delimiter(self._store)
        return not listing["objects"] and set(listing["common_prefixes"]) <= {but}

    def drop(self, path: str) -> None:
        with _store_errors(self._url(path)):
            obstore.delete(self._store, path)

    def remove(self, folder: str) -> None:
        with _store_errors(self._url(folder)):
            for batch in obstore.list(self._store, f"{folder}/", chunk_size=LIST_PAGE_SIZE):
                obstore.delete(self._store, [meta["path"] for meta in batch])

    def _url(self, path: str) -> str:
        return f"{self.url}/{path}"


async def _async_pieces(pieces: Iterable[bytes]) -> AsyncIterator[bytes]:
    # Iterated in this thread's event loop: the pieces may come from calls that use the store.
    for piece in pieces:
        yield piece


@contextmanager
def _store_errors(url: str) -> Iterator[None]:
    """Convert errors of the store to FileError for this object."""
    try:
        yield
    except (BaseError, OSError, ValueError) as fault:
        first = str(fault).partition("\n")[0]
        raise FileError(url, f"cannot be written or read: {first}") from fault
