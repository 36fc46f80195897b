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
from posefield.registry.listed_models import MODEL_SUFFIX, ModelFile, parse_model_path

PAGE_SIZE = 1000
"""Objects of one page of a listing."""


def connect(url: str) -> Any:
    """Return the store of the objects under the path of a URL; raises obstore's errors."""
    # Self-hosted servers often speak plain HTTP.
    plain = os.environ.get("AWS_ENDPOINT_URL", "").startswith("http://")
    return from_url(url, client_options={"allow_http": plain})


class ObjectStoreSource:
    """Source of models under a URL, laid out as in a folder.

    A URL that ends in .onnx is the source of one model.
    """

    def __init__(self, url: str) -> None:
        self.url = url.rstrip("/")
        self._one = self.url.endswith(MODEL_SUFFIX)
        self._base = self.url.rpartition("/")[0] if self._one else self.url
        try:
            self._store = connect(self._base)
        except (BaseError, OSError, ValueError) as fault:
            raise _read_error(self.url, fault) from fault

    def scan(self) -> list[ModelFile]:
        """Return the model files; ModelError if there are none or the store fails."""
        try:
            found = [self._single_file()] if self._one else self._list_files()
        except (BaseError, OSError, ValueError) as fault:
            raise _read_error(self.url, fault) from fault
        if not found:
            raise ModelError(self.url, f"no {MODEL_SUFFIX} object under this URL")
        return found

    def _single_file(self) -> ModelFile:
        path = self.url.rpartition("/")[2]
        return self._model_file(
            obstore.head(self._store, path), path.removesuffix(MODEL_SUFFIX), ""
        )

    def _list_files(self) -> list[ModelFile]:
        metas = (m for batch in obstore.list(self._store, chunk_size=PAGE_SIZE) for m in batch)
        return [
            self._model_file(meta, *place)
            for meta in sorted(metas, key=lambda meta: str(meta["path"]))
            if (place := parse_model_path(meta["path"]))
        ]

    def _model_file(self, meta: Any, name: str, version: str) -> ModelFile:
        signature, place = _signature(meta), f"{self._base}/{meta['path']}"
        return ModelFile(
            place, name, version, signature, lambda: self._read(meta["path"], signature)
        )

    def _read(self, path: str, signature: str) -> bytes:
        """Return the content of an object; ModelError if its signature has changed."""
        place = f"{self._base}/{path}"
        try:
            got = obstore.get(self._store, path)
            checked_file.check_size(got.meta["size"], place)
            content, read = bytes(got.bytes()), _signature(got.meta)
        except (BaseError, OSError, ValueError) as fault:
            raise _read_error(place, fault) from fault
        if read != signature:
            raise ModelError(place, "cannot be read: it has changed meanwhile")
        return content


def _signature(meta: Any) -> str:
    return f"{meta['e_tag']} {meta['version']} {meta['size']} {meta['last_modified']}"


def _read_error(place: str, fault: Exception) -> ModelError:
    first = str(fault).partition("\n")[0]
    return ModelError(place, f"cannot be read: {first}")
