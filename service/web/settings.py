"""What an operator may choose, read once from the environment."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from service.motion.errors import InvalidField

PREFIX = "POSEFIELD_"


@dataclass(frozen=True)
class Settings:
    """Settings of the service; each is read from POSEFIELD_ and its name in capitals.

    host, port: where to listen; port 0 takes a free one. body_limit: bytes of a request body, and
    crowd_body_limit of one that asks for a crowd. crowd_limit: characters of a crowd, and
    crowd_poses: poses of all motions of one that walks. clips_body_limit: bytes of a body
    that asks for many clips, clips_limit: how many, and clips_poses: frames of all of them.
    inference_body_limit: bytes of a body of tensors, and inference_poses: rows times times of one.
    grace: seconds that open requests get to finish after SIGTERM.
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
    inference_body_limit: int = 32 * 1024 * 1024
    inference_poses: int = 100_000
    grace: int = 10

    def __post_init__(self) -> None:
        _within("port", self.port, 0, 65535)
        _within("body_limit", self.body_limit, 1, 64 * 1024 * 1024)
        _within("crowd_body_limit", self.crowd_body_limit, 1, 1024 * 1024 * 1024)
        _within("crowd_limit", self.crowd_limit, 1, 10_000_000)
        _within("crowd_poses", self.crowd_poses, 1, 50_000_000)
        _within("clips_body_limit", self.clips_body_limit, 1, 1024 * 1024 * 1024)
        _within("clips_limit", self.clips_limit, 1, 1_000_000)
        _within("clips_poses", self.clips_poses, 1, 1_000_000_000)
        _within("inference_body_limit", self.inference_body_limit, 1, 1024 * 1024 * 1024)
        _within("inference_poses", self.inference_poses, 1, 10_000_000)
        _within("grace", self.grace, 0, 600)


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
    if name == "host":
        return text
    if not (text.isascii() and text.isdigit()):
        raise InvalidField(PREFIX + name.upper(), f"{text!r}, expected a whole number")
    return int(text)


def _within(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise InvalidField(PREFIX + name.upper(), f"{value}, expected {low} to {high}")
