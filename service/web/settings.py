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
    grid_limit: points of a grid of sigma. output_limit: bytes of a clip or a crowd's poses.
    grace: seconds that open requests get to finish after SIGTERM, and drain: seconds before that in
    which the service still listens, but says that it is not ready. workers: processes that share
    the port; 0 for as many as there are processors. reload: seconds from a look for new models to
    the next; 0 for never. versions: older versions of a model that answer under their hash, and
    versions_memory: bytes that all of those may take. concurrency: requests that a process answers
    at a time, and deadline: seconds until an answer has to begin. alias_seconds: how long caches
    may use an answer under a model's plain name without asking whether it is the newest's. log:
    whether each request is told on standard error, in one line. inference_body_limit: bytes of a
    body of tensors, and inference_poses: rows times times of one.

    url_limit, head_limit: bytes of a URL, and of all header lines. head_time, body_time: seconds in
    which a request's head and body have to arrive; idle_time: seconds that an unused connection
    stays open; drain_time: seconds in which a client has to take what was sent; who sends or takes
    4 KiB a second has longer. connections: how many may be open.

    origins: pages of other origins that may read answers, with commas between them.

    keys, keys_file: API keys as lines of name, hash and scopes. open: whether everybody may ask on
    an address that is not this machine's alone. metrics_open: whether /metrics needs no key.
    jwt_keys: file or URL of the issuer's public keys; jwt_refresh: seconds between two looks at it;
    jwt_leeway: seconds that clocks may differ by; jwt_scopes: name of the claim that holds scopes.
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
    output_limit: int = 256 * 1024 * 1024
    inference_body_limit: int = 32 * 1024 * 1024
    inference_poses: int = 100_000
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
    url_limit: int = 8 * 1024
    head_limit: int = 16 * 1024
    head_time: int = 10
    body_time: int = 20
    # Longer than what usual proxies keep unused connections for: they should end them, not we.
    idle_time: int = 75
    drain_time: int = 30
    # With twice as many about to end, the usual 1024 open files of a process are enough.
    connections: int = 500
    origins: str = ""
    keys: str = ""
    keys_file: str = ""
    open: bool = False
    metrics_open: bool = False
    jwt_keys: str = ""
    jwt_issuer: str = ""
    jwt_audience: str = ""
    jwt_algorithm: str = "RS256"
    jwt_scopes: str = "scope"
    jwt_leeway: int = 30
    jwt_refresh: int = 300

    def __post_init__(self) -> None:
        _within("port", self.port, 0, 65535)
        _within("body_limit", self.body_limit, 1, 64 * 1024 * 1024)
        _within("crowd_body_limit", self.crowd_body_limit, 1, 1024 * 1024 * 1024)
        _within("crowd_limit", self.crowd_limit, 1, 10_000_000)
        _within("crowd_poses", self.crowd_poses, 1, 50_000_000)
        _within("clips_body_limit", self.clips_body_limit, 1, 1024 * 1024 * 1024)
        _within("clips_limit", self.clips_limit, 1, 1_000_000)
        _within("clips_poses", self.clips_poses, 1, 1_000_000_000)
        _within("output_limit", self.output_limit, 64 * 1024, 1 << 34)
        _within("grid_limit", self.grid_limit, 4, 1024 * 1024)
        _within("inference_body_limit", self.inference_body_limit, 1, 1024 * 1024 * 1024)
        _within("inference_poses", self.inference_poses, 1, 10_000_000)
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
        _within("url_limit", self.url_limit, 256, 64 * 1024)
        _within("head_limit", self.head_limit, 1024, 256 * 1024)
        _within("head_time", self.head_time, 1, 600)
        _within("body_time", self.body_time, 1, 600)
        _within("idle_time", self.idle_time, 1, 3600)
        _within("drain_time", self.drain_time, 1, 3600)
        _within("connections", self.connections, 1, 100_000)
        _within("jwt_leeway", self.jwt_leeway, 0, 600)
        _within("jwt_refresh", self.jwt_refresh, 10, 86_400)


def read(
    host: str | None = None, port: int | None = None, environ: Mapping[str, str] = os.environ
) -> Settings:
    """Settings of the environment, but the host and port of the command line where given.

    Raises InvalidField for a variable or value that cannot be used.
    """
    found = {f.name: (f.default, environ.get(PREFIX + f.name.upper())) for f in fields(Settings)}
    values = {
        name: _parse(name, default, text)
        for name, (default, text) in found.items()
        if text is not None
    }
    settings = Settings(**values)  # type: ignore[arg-type]  # each name has its own type
    return replace(
        settings,
        host=settings.host if host is None else host,
        port=settings.port if port is None else port,
    )


def _parse(name: str, default: object, text: str) -> str | int:
    """Value of a variable, of the type that the setting's default has."""
    if isinstance(default, str):
        return text
    if isinstance(default, bool):
        if text not in ("0", "1"):
            raise InvalidField(PREFIX + name.upper(), f"{text!r}, expected 0 or 1")
        return text == "1"
    if not (text.isascii() and text.isdigit()):
        raise InvalidField(PREFIX + name.upper(), f"{text!r}, expected a whole number")
    return int(text)


def _within(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise InvalidField(PREFIX + name.upper(), f"{value}, expected {low} to {high}")
