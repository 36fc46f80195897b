"""What an operator may choose, read once from the environment."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from service.motion.errors import InvalidField

PREFIX = "POSEFIELD_"
TEXTS = ("host", "log")


@dataclass(frozen=True)
class Settings:
    """Settings of the service; each is read from POSEFIELD_ and its name in capitals.

    host, port: where to listen; port 0 takes a free one. body_limit: bytes of a request body, and
    crowd_body_limit of one that asks for a crowd. crowd_limit: characters of a crowd, and
    crowd_poses: poses of all motions of one that walks. clips_body_limit: bytes of a body
    that asks for many clips, clips_limit: how many, and clips_poses: frames of all of them.
    grid_limit: points of a grid of sigma. grace: seconds that open requests get to finish after
    SIGTERM, and drain: seconds before that in which the service still listens, but says that it is
    not ready. workers: processes that share the port; 0 for as many as there are processors.
    reload: seconds from a look for new models to the next; 0 for never. versions: older versions of
    a model that answer under their hash, and versions_memory: bytes that all of those may take.
    concurrency: requests that a process answers at a time, and deadline: seconds until an answer
    has to begin. alias_seconds: how long caches may use an answer under a model's plain name
    without asking whether it is the newest's. log: whether each request is told on standard error,
    in one line.
    """

    host: str = "127.0.0.1"
    port: int = 8000
    body_limit: int = 64 * 1024
    # A character with six controls, none rounded, takes 250 bytes.
    crowd_body_limit: int = 32 * 1024 * 1024
    crowd_limit: int = 100_000
    # USD takes 900 bytes for a pose of 31 joints.
    crowd_poses: int = 500_000
    # A clip with six controls, none rounded, a name and a performer takes 400 bytes.
    clips_body_limit: int = 8 * 1024 * 1024
    clips_limit: int = 10_000
    clips_poses: int = 1_000_000
    # 50 ms of work.
    grid_limit: int = 65_536
    grace: int = 10
    # A pose takes a tenth of a millisecond, a thousand in flight a tenth of a second.
    concurrency: int = 1000
    deadline: int = 30
    alias_seconds: int = 0
    log: str = "on"
    drain: int = 0
    workers: int = 1
    reload: int = 10
    versions: int = 2
    versions_memory: int = 64 * 1024 * 1024

    def __post_init__(self) -> None:
        _within("port", self.port, 0, 65535)
        _within("body_limit", self.body_limit, 1, 64 * 1024 * 1024)
        _within("crowd_body_limit", self.crowd_body_limit, 1, 1024 * 1024 * 1024)
        _within("crowd_limit", self.crowd_limit, 1, 10_000_000)
        _within("crowd_poses", self.crowd_poses, 1, 50_000_000)
        _within("clips_body_limit", self.clips_body_limit, 1, 1024 * 1024 * 1024)
        _within("clips_limit", self.clips_limit, 1, 1_000_000)
        _within("clips_poses", self.clips_poses, 1, 1_000_000_000)
        _within("grid_limit", self.grid_limit, 4, 1024 * 1024)
        _within("grace", self.grace, 0, 600)
        _within("concurrency", self.concurrency, 1, 1_000_000)
        _within("deadline", self.deadline, 1, 3600)
        _within("alias_seconds", self.alias_seconds, 0, 31_536_000)
        if self.log not in ("on", "off"):
            raise InvalidField(PREFIX + "LOG", f"{self.log!r}, expected on or off")
        _within("drain", self.drain, 0, 600)
        _within("workers", self.workers, 0, 256)
        _within("reload", self.reload, 0, 86_400)
        _within("versions", self.versions, 0, 1000)
        _within("versions_memory", self.versions_memory, 0, 1 << 40)


def read(
    host: str | None = None, port: int | None = None, environ: Mapping[str, str] = os.environ
) -> Settings:
    """Settings of the environment, but the host and port of the command line where given.

    Raises InvalidField for a variable or value that cannot be used.
    """
    found = {f.name: environ.get(PREFIX + f.name.upper()) for f in fields(Settings)}
    values = {name: _parse(name, text) for name, text in found.items() if text is not None}
    settings = Settings(**values)  # type: ignore[arg-type]  # each name has its own type
    return replace(
        settings,
        host=settings.host if host is None else host,
        port=settings.port if port is None else port,
    )


def _parse(name: str, text: str) -> str | int:
    if name in TEXTS:
        return text
    if not (text.isascii() and text.isdigit()):
        raise InvalidField(PREFIX + name.upper(), f"{text!r}, expected a whole number")
    return int(text)


def _within(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise InvalidField(PREFIX + name.upper(), f"{value}, expected {low} to {high}")
