"""Settings of the service, read once from environment variables."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from posefield.common.errors import InvalidField

PREFIX = "POSEFIELD_"


@dataclass(frozen=True)
class Settings:
    """Settings of the service; each is read from POSEFIELD_ and its name in capitals.

    Limits are maxima; times are in seconds, sizes in bytes. The documentation's page of settings is
    made of the paragraphs below.

    host: IP address to listen on. port: TCP port; 0 takes a free one. workers: processes that share
    the port; 0 for the number of processors. log: "on" for one line per request on standard error,
    or "off". concurrency: open requests of a process; 503 above it. deadline: time until a response
    begins; 503 after it. drain: time after SIGTERM in which the service still listens and reports
    not ready. grace: time for open requests to finish after the drain. unresponsive: time without
    an iteration of the event loop until a process logs its stacks and ends, to be replaced; 0 for
    never.

    body_limit: size of a request body. crowd_body_limit: size of the body of a crowd request.
    clips_body_limit: size of the body of a request for many clips or performances. bodies_memory:
    memory of the bodies of all open requests, beyond 64 KiB of each; 503 above it. url_limit: size
    of a URL. head_limit: size of all header lines, at most 100 of them. idle_time: time until an
    idle connection is closed. output_limit: size of a clip, of a performance, of a crowd's poses
    and of a walking crowd, estimated before it is made. Independent of it, a clip or a performance
    that would take more than 480 MB of memory to make is refused, so that a process stays below 700
    MB.

    crowd_limit: characters of a crowd. crowd_poses: poses of all motions of a walking crowd.
    crowd_frames: frames of each motion of a walking crowd. clips_limit: clips of an archive.
    clips_poses: frames of all clips of an archive. clips_targets: targets of all clips of an
    archive; one of a clip with open controls counts as four. performances_limit: performances of an
    archive. performances_segments: segments of all performances of an archive.
    performances_seconds: duration of all of them, in seconds. grid_limit: points of a grid of
    sigma.

    reload: time between two checks for new models; 0 for never. versions: older versions of a model
    that stay available by hash. versions_memory: memory of all older versions, roughly.
    alias_seconds: time for which caches may use a response for a model's plain name without
    revalidation.

    characters: folder of USD and .glb files of characters, to which motions are delivered, read at
    start; a file NAME.toml beside NAME.glb states its roles. character_prefix: path before the name
    of a character's file by which USD files refer to it, such as ../rigs/ or
    https://example.com/rigs/.

    hosts: accepted host names, comma-separated, such as poses.example.com,*.example.org, or *;
    without any, localhost. IP addresses are always accepted. origins: origins that CORS allows,
    comma-separated, or *.

    keys: API keys as lines of name, hash and scopes, or some between semicolons. keys_file: file of
    such lines, as posefield key writes them. open: 1 allows a service without credentials on
    addresses other than loopback. metrics_open: 1 allows /metrics without credentials. jwt_keys:
    file or https URL of the token issuer's public keys (JWKS). jwt_refresh: time between two reads
    of these keys. jwt_issuer: value that tokens must have as iss. jwt_audience: value that tokens
    must have as aud. jwt_algorithm: the one accepted algorithm; RS, PS or ES with 256, 384 or 512,
    or EdDSA. jwt_leeway: tolerance for clock differences. jwt_scopes: name of the claim with the
    scopes.
    """

    host: str = "127.0.0.1"
    port: int = 8000
    body_limit: int = 64 * 1024
    # A character with six controls, none rounded, takes 250 bytes.
    crowd_body_limit: int = 32 * 1024 * 1024
    crowd_limit: int = 100_000
    # USD takes 900 bytes for a pose of 31 joints.
    crowd_poses: int = 500_000
    # Twenty minutes at 30 frames a second; a whole motion is in memory while its layer is written.
    crowd_frames: int = 36_000
    # A clip with six controls, none rounded, a name and a performer takes 400 bytes.
    clips_body_limit: int = 8 * 1024 * 1024
    clips_limit: int = 10_000
    clips_poses: int = 1_000_000
    # A target takes 3 to 12 ms of CPU time: at most 25 s in all, within the default deadline.
    clips_targets: int = 2000
    # To plan a segment takes about 10 ms of CPU time, and a second of motion 2 ms, or 12 ms with
    # takes: at most 25 s in all, within the default deadline.
    performances_limit: int = 256
    performances_segments: int = 1024
    performances_seconds: int = 1800
    # 50 ms of CPU time.
    grid_limit: int = 65_536
    output_limit: int = 256 * 1024 * 1024
    grace: int = 10
    # A pose takes 0.1 ms, so a thousand open requests delay one by 0.1 s.
    concurrency: int = 1000
    deadline: int = 30
    alias_seconds: int = 0
    log: str = "on"
    # Clients with open connections learn in this time to open new ones.
    drain: int = 1
    workers: int = 1
    reload: int = 10
    versions: int = 2
    versions_memory: int = 64 * 1024 * 1024
    url_limit: int = 8 * 1024
    head_limit: int = 16 * 1024
    # Longer than the default of common proxies: the proxy should close idle connections.
    idle_time: int = 75
    bodies_memory: int = 128 * 1024 * 1024
    characters: str = ""
    # USD searches for paths that do not begin with a dot in other places too.
    character_prefix: str = "./"
    hosts: str = ""
    # Long work runs in threads, so half a minute is a fault of the event loop, not load.
    unresponsive: int = 30
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
        _check_range("port", self.port, 0, 65535)
        _check_range("body_limit", self.body_limit, 1, 64 * 1024 * 1024)
        _check_range("crowd_body_limit", self.crowd_body_limit, 1, 1024 * 1024 * 1024)
        _check_range("crowd_limit", self.crowd_limit, 1, 10_000_000)
        _check_range("crowd_poses", self.crowd_poses, 1, 50_000_000)
        _check_range("crowd_frames", self.crowd_frames, 1, 50_000_000)
        _check_range("clips_body_limit", self.clips_body_limit, 1, 1024 * 1024 * 1024)
        _check_range("clips_limit", self.clips_limit, 1, 1_000_000)
        _check_range("clips_poses", self.clips_poses, 1, 1_000_000_000)
        _check_range("clips_targets", self.clips_targets, 1, 1_000_000)
        _check_range("performances_limit", self.performances_limit, 1, 100_000)
        _check_range("performances_segments", self.performances_segments, 1, 1_000_000)
        _check_range("performances_seconds", self.performances_seconds, 1, 1_000_000)
        _check_range("output_limit", self.output_limit, 64 * 1024, 1 << 34)
        _check_range("grid_limit", self.grid_limit, 4, 1024 * 1024)
        _check_range("grace", self.grace, 0, 600)
        _check_range("concurrency", self.concurrency, 1, 1_000_000)
        _check_range("deadline", self.deadline, 1, 3600)
        _check_range("alias_seconds", self.alias_seconds, 0, 31_536_000)
        if self.log not in ("on", "off"):
            raise InvalidField(PREFIX + "LOG", f"{self.log!r}, expected on or off")
        _check_range("drain", self.drain, 0, 600)
        _check_range("workers", self.workers, 0, 256)
        _check_range("reload", self.reload, 0, 86_400)
        _check_range("versions", self.versions, 0, 1000)
        _check_range("versions_memory", self.versions_memory, 0, 1 << 40)
        _check_range("url_limit", self.url_limit, 256, 64 * 1024)
        _check_range("head_limit", self.head_limit, 1024, 256 * 1024)
        _check_range("idle_time", self.idle_time, 1, 3600)
        _check_range("bodies_memory", self.bodies_memory, 1024 * 1024, 1 << 40)
        _check_range("unresponsive", self.unresponsive, 0, 3600)
        _check_range("jwt_leeway", self.jwt_leeway, 0, 600)
        _check_range("jwt_refresh", self.jwt_refresh, 10, 86_400)


def read_settings(
    host: str | None = None, port: int | None = None, environ: Mapping[str, str] = os.environ
) -> Settings:
    """Return the settings of the environment; host and port of the command line override them.

    Raises InvalidField for an invalid value.
    """
    texts = {f.name: (f.default, environ.get(PREFIX + f.name.upper())) for f in fields(Settings)}
    values = {
        name: _parse_value(name, default, text)
        for name, (default, text) in texts.items()
        if text is not None
    }
    settings = Settings(**values)  # type: ignore[arg-type]  # each name has its own type
    return replace(
        settings,
        host=settings.host if host is None else host,
        port=settings.port if port is None else port,
    )


def _parse_value(name: str, default: object, text: str) -> str | int:
    """Return the value of a variable, of the type of the setting's default.

    Raises InvalidField for invalid text.
    """
    if isinstance(default, str):
        return text
    if isinstance(default, bool):
        if text not in ("0", "1"):
            raise InvalidField(PREFIX + name.upper(), f"{text!r}, expected 0 or 1")
        return text == "1"
    if not (text.isascii() and text.isdigit()):
        raise InvalidField(PREFIX + name.upper(), f"{text!r}, expected a whole number")
    return int(text)


def _check_range(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise InvalidField(PREFIX + name.upper(), f"{value}, expected {low} to {high}")
