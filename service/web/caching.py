"""HTTP caching: what an answer is called before it is made, and how long that holds.

An answer to a GET follows from the model's file, the request's line, the code, and how this machine
rounds. A digest of all of them is its strong entity tag, and takes two microseconds.
"""

import platform
from hashlib import blake2b
from importlib.metadata import version
from pathlib import Path

import service

ALWAYS_NEW = b"no-store"
FOR_EVER = b"max-age=31536000, immutable"
AGAIN = b"no-cache"
PUBLIC = b"public, "

LIBRARIES = ("backports.zstd", "msgspec", "nanoarrow", "numpy", "onnxruntime", "orjson", "usd-core")
"""Those that have a say in an answer's bytes."""


class NotModified(Exception):
    """The client has the answer already."""


def code() -> bytes:
    """Digest of all that answers are made by but the model: sources, libraries, machine."""
    digest = blake2b(digest_size=16)
    root = Path(service.__file__).parent
    for source in sorted([*root.rglob("*.py"), *root.rglob("*.yaml")]):
        digest.update(source.relative_to(root).as_posix().encode() + b"\0")
        digest.update(source.read_bytes())
    for name in LIBRARIES:
        digest.update(f"{name} {version(name)}\0".encode())
    digest.update(platform.machine().encode())
    return digest.digest()


def tag(*parts: bytes, coding: str | None = None) -> str:
    """Strong entity tag of what follows from the parts, in a content coding."""
    digest = blake2b(b"\0".join(parts), digest_size=16).hexdigest()
    return f'"{digest}-{coding}"' if coding else f'"{digest}"'


def held(given: str, own: str) -> bool:
    """Whether an If-None-Match header names an entity tag; weakly, as RFC 9110 13.1.2 says."""
    if given == own:
        return True
    return given.strip() == "*" or own in (t.strip().removeprefix("W/") for t in given.split(","))


def lifetime(model: str, alias_seconds: int, closed: bool) -> bytes:
    """How long an answer may be used unasked: for ever under a model's hash, under its name alone
    for so many seconds. closed: by whoever asked and had to say who they are, not by others."""
    whose = b"private, " if closed else PUBLIC
    if "@" in model:
        return whose + FOR_EVER
    return whose + (b"max-age=%d" % alias_seconds if alias_seconds else AGAIN)
