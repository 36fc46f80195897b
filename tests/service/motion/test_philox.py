"""Tests of the counter-based random numbers."""

import numpy as np
import pytest

from posefield.kriging import philox

# Known answers of Random123, the reference implementation: counter, key and words.
KNOWN = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    (
        (0xFFFFFFFF,) * 4,
        (0xFFFFFFFF,) * 2,
        (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD),
    ),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]
NORMALS = [0.000291568, -0.304846986, 1.788757349]
"""First numbers of seed 7, stream 0."""
COUNT = 100_000


@pytest.mark.parametrize(("counter", "key", "expected"), KNOWN)
def test_words_are_those_of_the_reference_implementation(counter, key, expected):
    counters = np.array(counter, dtype=np.uint64)[:, None]
    assert tuple(philox.philox(counters, key)[:, 0].tolist()) == expected
    other = key[0] ^ 1, key[1]
    assert tuple(philox.philox(counters, other)[:, 0].tolist()) != expected


def test_normal_numbers_are_the_same_in_every_version():
    found = philox.normals(7, 0, 1, 3)
    assert found[0].tolist() == NORMALS
    assert philox.normals(7, 0, 1, 4)[0, :3].tolist() == NORMALS
    assert philox.normals(8, 0, 1, 3)[0].tolist() != NORMALS


def test_normal_numbers_are_standard_and_streams_independent():
    first, second = (philox.normals(3, stream, 1, COUNT)[0] for stream in (0, 1))
    error = COUNT**-0.5
    assert abs(first.mean()) < 3.0 * error
    assert abs(first.var() - 1.0) < 3.0 * error * 2.0**0.5
    assert abs(np.mean(first**4) - 3.0) < 3.0 * error * 96.0**0.5
    assert abs(first @ second) / COUNT < 3.0 * error
    assert abs(first[:-1] @ first[1:]) / COUNT < 3.0 * error


def test_numbers_of_many_seeds_are_those_of_each_alone():
    seeds = np.array([[3, 8], [2**40 + 1, 0]])
    found = philox.normals(seeds, 1, 5, 7)
    assert found.shape == (2, 2, 5, 7)
    for place in np.ndindex(2, 2):
        assert np.array_equal(found[place], philox.normals(int(seeds[place]), 1, 5, 7))
        assert not np.array_equal(found[place], philox.normals(int(seeds[place]) + 1, 1, 5, 7))
    assert np.array_equal(philox.signs(seeds, 1, 3, 2)[1, 0], philox.signs(2**40 + 1, 1, 3, 2))
