"""What passes between the part that decides and the part that sends: no I/O here."""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from posefield_client.generated import Operation

T = TypeVar("T")
R = TypeVar("R", covariant=True)


@dataclass(frozen=True, slots=True)
class Request:
    """A question as it travels. target: path and query, below the service's address."""

    operation: Operation
    target: str
    body: bytes | None = None


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer as it came; without content where that went into a sink."""

    status: int
    headers: Mapping[str, str]
    content: bytes


@dataclass(frozen=True, slots=True)
class Call(Generic[R]):
    """A request, and how its answer is read: ValueError where it is no such answer."""

    request: Request
    read: Callable[[Reply], R]


class Sink(Protocol):
    """Where a large answer goes while it comes."""

    def begin(self, total: int | None) -> None:
        """Forget what came before; total: bytes that will come, where that is known."""

    def write(self, chunk: bytes) -> None:
        """Take the next bytes."""


@dataclass(frozen=True, slots=True)
class Send:
    """Wish that a request be sent. tag: of the answer that is at hand."""

    request: Request
    tag: str | None = None
    sink: Sink | None = None


@dataclass(frozen=True, slots=True)
class Sleep:
    """Wish that some seconds pass."""

    seconds: float


Steps = Generator[Send | Sleep, Reply | None, T]
"""What is to be done for an answer: wishes go out, replies come in, the answer is returned."""
