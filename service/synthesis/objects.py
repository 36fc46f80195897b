"""Object stores by URL, through obstore: S3 and its like, Google's and Azure's.

Endpoint, region and credentials are what the store's own tools take: AWS_ENDPOINT_URL,
AWS_ACCESS_KEY_ID and the like in the environment.
"""

import os
from typing import Any

import obstore
from obstore.exceptions import BaseError
from obstore.store import from_url

from service.motion.errors import ModelError
from service.synthesis.sources import ENDING, Found, named

LISTED = 1000
"""Names asked for at once."""


def connect(url: str) -> Any:
    """Store of the objects under the path of a URL; raises what obstore does."""
    # Servers of one's own often speak plain HTTP.
    plain = os.environ.get("AWS_ENDPOINT_URL", "").startswith("http://")
    return from_url(url, client_options={"allow_http": plain})


class Objects:
    """Models under a URL, laid out as in a folder, or the one that a URL ending in .onnx names."""

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        self._one = self.url.endswith(ENDING)
        self._base = self.url.rpartition("/")[0] if self._one else self.url
        try:
            self._store = connect(self._base)
        except (BaseError, OSError, ValueError) as fault:
            raise _refusal(self.url, fault) from fault

    def look(self) -> list[Found]:
        """The objects that are models."""
        try:
            found = [self._alone()] if self._one else self._listed()
        except (BaseError, OSError, ValueError) as fault:
            raise _refusal(self.url, fault) from fault
        if not found:
            raise ModelError(self.url, f"no {ENDING} object under this URL")
        return found

    def _alone(self) -> Found:
        path = self.url.rpartition("/")[2]
        return self._found(obstore.head(self._store, path), path.removesuffix(ENDING), "")

    def _listed(self) -> list[Found]:
        metas = (m for batch in obstore.list(self._store, chunk_size=LISTED) for m in batch)
        return [
            self._found(meta, *place)
            for meta in sorted(metas, key=lambda meta: str(meta["path"]))
            if (place := named(meta["path"]))
        ]

    def _found(self, meta: Any, name: str, version: str) -> Found:
        signature, place = _signature(meta), f"{self._base}/{meta['path']}"
        return Found(place, name, version, signature, lambda: self._read(meta["path"], signature))

    def _read(self, path: str, signature: str) -> bytes:
        """Content of an object, if it is still the same."""
        place = f"{self._base}/{path}"
        try:
            got = obstore.get(self._store, path)
            content, read = bytes(got.bytes()), _signature(got.meta)
        except (BaseError, OSError, ValueError) as fault:
            raise _refusal(place, fault) from fault
        if read != signature:
            raise ModelError(place, "cannot be read: it has changed meanwhile")
        return content


def _signature(meta: Any) -> str:
    return f"{meta['e_tag']} {meta['version']} {meta['size']} {meta['last_modified']}"


def _refusal(place: str, fault: Exception) -> ModelError:
    first = str(fault).partition("\n")[0]
    return ModelError(place, f"cannot be read: {first}")
