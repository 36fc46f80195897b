"""Tests of streamed pieces: minimum size, and none is empty."""

import pytest

from posefield.http.responses import MIN_CHUNK_SIZE, merged_chunks


@pytest.mark.parametrize(
    "pieces",
    [[b"a", b"", b"b"], [b"", b"x" * MIN_CHUNK_SIZE, b"", b"y"], [b"x" * 1000] * 1000],
)
def test_nothing_is_lost_and_all_but_the_last_are_long_enough(pieces):
    found = list(merged_chunks(pieces))
    assert b"".join(found) == b"".join(pieces)
    assert all(found)
    assert all(MIN_CHUNK_SIZE <= len(piece) < 2 * MIN_CHUNK_SIZE for piece in found[:-1])


def test_no_more_is_taken_than_is_sent():
    taken = []
    pieces = merged_chunks(taken.append(n) or b"x" * (MIN_CHUNK_SIZE // 2) for n in range(10))
    next(pieces)
    assert taken == [0, 1]
