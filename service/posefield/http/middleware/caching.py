"""HTTP caching: entity tags, computed before the response, and lifetimes.

The response to a GET depends only on the model file, the request line, the code and the rounding of
this machine. Their digest is its strong entity tag; computing it takes two microseconds.
"""

import platform
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path

import posefield

NO_STORE = b"no-store"
IMMUTABLE = b"max-age=31536000, immutable"
NO_CACHE = b"no-cache"
PUBLIC = b"public, "

LIBRARIES = ("backports.zstd", "msgspec", "nanoarrow", "numpy", "onnxruntime", "orjson", "usd-core")
"""Libraries whose versions can affect the bytes of a response."""


class NotModified(Exception):
    """The client's cached response is current (304)."""


def code_digest() -> bytes:
    """Return a digest of the sources, the library versions and the machine type.

    Responses depend on these, on the model and on the request.
    """
    digest = blake2b(digest_size=16)
    root = Path(posefield.__file__).parent
    for source in sorted(
        [each for kind in ("py", "yaml", "npz") for each in root.rglob(f"*.{kind}")]
    ):
        digest.update(source.relative_to(root).as_posix().encode() + b"\0")
        digest.update(source.read_bytes())
    for name in LIBRARIES:
        digest.update(f"{name} {version(name)}\0".encode())
    digest.update(platform.machine().encode())
    return digest.digest()


def entity_tag(*parts: bytes, coding: str | None = None) -> str:
    """Return the strong entity tag of a response that depends only on `parts`.

    coding: content coding of the response, if any.
    """
    digest = blake2b(b"\0".join(parts), digest_size=16).hexdigest()
    return f'"{digest}-{coding}"' if coding else f'"{digest}"'


def matches_tag(given: str, own: str) -> bool:
    """Return True if an If-None-Match header matches an entity tag.

    The comparison is weak (RFC 9110, 13.1.2). given: the header. own: the tag.
    """
    if given == own:
        return True
    return given.strip() == "*" or own in (t.strip().removeprefix("W/") for t in given.split(","))


def cache_control(model: str, alias_seconds: int, closed: bool) -> bytes:
    """Return the Cache-Control of a response of a model.

    model: key in the path; with a hash the response is immutable, with the name alone it stays
    fresh for `alias_seconds`, and must be revalidated for 0. closed: the service needs credentials,
    so only private caches may store the response.
    """
    whose = b"private, " if closed else PUBLIC
    if "@" in model:
        return whose + IMMUTABLE
    return whose + (b"max-age=%d" % alias_seconds if alias_seconds else NO_CACHE)
