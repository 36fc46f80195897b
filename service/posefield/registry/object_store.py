"""Object stores by URL, through obstore: S3 and compatible stores, Google Cloud Storage and Azure.

Endpoint, region and credentials come from the environment variables of the store's own tools, such
as AWS_ENDPOINT_URL and AWS_ACCESS_KEY_ID.
"""

import os
from typing import Any

import obstore
from obstore.exceptions import BaseError
from obstore.store import from_url

from posefield.common.errors import ModelError
from posefield.model_file import checked_file
from posefield.registry.listed_models import ENDING, Found, named

LISTED = 1000
"""Objects of one page of a listing."""


def connect(url: str) -> Any:
    """Return the store of the objects under the path of a URL; raises obstore's errors."""
    # Self-hosted servers often speak plain HTTP.
    plain = os.environ.get("AWS_ENDPOINT_URL", "").startswith("http://")
    return from_url(url, client_options={"allow_http": plain})


class Objects:
    """Source of models under a URL, laid out as in a folder.

    A URL that ends in .onnx is the source of one model.
    """

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        self._one = self.url.endswith(ENDING)
        self._base = self.url.rpartition("/")[0] if self._one else self.url
        try:
            self._store = connect(self._base)
        except (BaseError, OSError, ValueError) as fault:
            raise _refusal(self.url, fault) from fault

    def look(self) -> list[Found]:
        """Return the model files; ModelError if there are none or the store fails."""
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
        """Return the content of an object; ModelError if its signature has changed."""
        place = f"{self._base}/{path}"
        try:
            got = obstore.get(self._store, path)
            checked_file.check_size(got.meta["size"], place)
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
