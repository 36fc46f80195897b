"""Streaming of response bodies while they are generated."""

from collections.abc import AsyncIterator, Iterable, Iterator

from anyio import CapacityLimiter

from service.web import threads

ENOUGH = 1 << 18
"""Minimum bytes of a piece, since a thread switch per piece takes a tenth of a millisecond."""


def gathered(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """Yield the same bytes in pieces of at least ENOUGH bytes, except the last; none is empty."""
    held, size = [], 0
    for piece in pieces:
        held.append(piece)
        size += len(piece)
        if size >= ENOUGH:
            yield b"".join(held)
            held, size = [], 0
    if size:
        yield b"".join(held)


async def sent(pieces: Iterator[bytes], places: CapacityLimiter) -> AsyncIterator[bytes]:
    """Yield the pieces, each generated in a thread after the previous one was sent.

    pieces: none may be empty. When the client disconnects, generation stops after the current
    piece.
    """
    while piece := await threads.run(next, pieces, b"", places=places):
        yield piece
