"""Object stores by URL, through obstore: S3 and compatible stores, Google Cloud Storage and Azure.

Endpoint, region and credentials come from the environment variables of the store's own tools, such
as AWS_ENDPOINT_URL and AWS_ACCESS_KEY_ID.
"""

import os
from functools import partial
from typing import Any

import obstore
from obstore.exceptions import BaseError
from obstore.store import from_url

from posefield.common.errors import ModelError
from posefield.model_file import checked_file
from posefield.registry.model_sources import MODEL_SUFFIX, ModelFile, parse_model_path

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
        except (BaseError, OSError, ValueError) as error:
            raise _read_error(self.url, error) from error

    def __call__(self) -> list[ModelFile]:
        """Return the model files; ModelError if there are none or the store fails."""
        try:
            if self._one:
                path = self.url.rpartition("/")[2]
                metadata = obstore.head(self._store, path)
                files = [self._model_file(metadata, path.removesuffix(MODEL_SUFFIX), "")]
            else:
                files = self._list_files()
        except (BaseError, OSError, ValueError) as error:
            raise _read_error(self.url, error) from error
        if not files:
            raise ModelError(self.url, f"no {MODEL_SUFFIX} object under this URL")
        return files

    def _list_files(self) -> list[ModelFile]:
        pages = obstore.list(self._store, chunk_size=PAGE_SIZE)
        objects = (metadata for page in pages for metadata in page)
        return [
            self._model_file(metadata, *name)
            for metadata in sorted(objects, key=lambda metadata: str(metadata["path"]))
            if (name := parse_model_path(metadata["path"]))
        ]

    def _model_file(self, metadata: Any, name: str, version: str) -> ModelFile:
        signature, url = _signature(metadata), f"{self._base}/{metadata['path']}"
        read = partial(self._read, metadata["path"], signature)
        return ModelFile(url, name, version, signature, read)

    def _read(self, path: str, signature: str) -> bytes:
        """Return the content of an object; ModelError if its signature has changed."""
        url = f"{self._base}/{path}"
        try:
            response = obstore.get(self._store, path)
            checked_file.check_size(response.meta["size"], url)
            content, current = bytes(response.bytes()), _signature(response.meta)
        except (BaseError, OSError, ValueError) as error:
            raise _read_error(url, error) from error
        if current != signature:
            raise ModelError(url, "cannot be read: it has changed meanwhile")
        return content


def _signature(metadata: Any) -> str:
    names = ("e_tag", "version", "size", "last_modified")
    return " ".join(str(metadata[name]) for name in names)


def _read_error(url: str, error: Exception) -> ModelError:
    first = str(error).partition("\n")[0]
    return ModelError(url, f"cannot be read: {first}")
