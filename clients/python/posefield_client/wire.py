"""Messages between the request logic and the HTTP clients, without I/O."""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from posefield_client.generated import Operation

T = TypeVar("T")
R = TypeVar("R", covariant=True)


@dataclass(frozen=True, slots=True)
class Request:
    """An HTTP request. target: path and query, relative to the service's address."""

    operation: Operation
    target: str
    body: bytes | None = None


@dataclass(frozen=True, slots=True)
class Reply:
    """An HTTP response. content: empty if it went to a sink."""

    status: int
    headers: Mapping[str, str]
    content: bytes


@dataclass(frozen=True, slots=True)
class Call(Generic[R]):
    """A request and the decoder of its response, which raises ValueError for an invalid one."""

    request: Request
    read: Callable[[Reply], R]


class Sink(Protocol):
    """Consumer of a large response in chunks."""

    def begin(self, total: int | None) -> None:
        """Discard earlier content. total: bytes to come; None if unknown."""

    def write(self, chunk: bytes) -> None:
        """Consume the next bytes."""


@dataclass(frozen=True, slots=True)
class Send:
    """Step: send a request. tag: entity tag of the cached response."""

    request: Request
    tag: str | None = None
    sink: Sink | None = None


@dataclass(frozen=True, slots=True)
class Sleep:
    """Step: wait for some seconds."""

    seconds: float


Steps = Generator[Send | Sleep, Reply | None, T]
"""Generator of a request: yields steps, receives responses, returns the result."""
