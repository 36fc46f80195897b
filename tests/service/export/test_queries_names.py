"""Names that are generated follow the row; names that are given are told apart in little memory."""

import tracemalloc

from hypothesis import given
from hypothesis import strategies as st

from service.export.names import Seen, generated

WORDS = st.text("abAB_1", min_size=1, max_size=3)
NAMES = 300_000
BATCHES = st.lists(st.lists(WORDS, max_size=12), max_size=8)


@given(batches=BATCHES)
def test_a_name_is_repeated_if_it_was_seen_before(batches):
    """Oracle: a set of all names so far."""
    seen, before = Seen(), set()
    for batch in batches:
        expected = []
        for place, name in enumerate(batch):
            if name.lower() in before:
                expected.append(place)
            before.add(name.lower())
        assert seen.repeated(batch) == expected


def test_names_take_eight_bytes_each():
    """And as much again, twice, while they are merged."""
    tracemalloc.start()
    try:
        seen = Seen()
        for first in range(0, NAMES, 4096):
            assert seen.repeated([f"walk-{i}" for i in range(first, first + 4096)]) == []
        held, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert held < 10 * NAMES
    assert peak < 30 * NAMES
    assert seen.repeated(["WALK-77", "walk-x", "walk-299999"]) == [0, 2]


def test_a_set_of_as_many_would_be_noticed():
    """Negative control of the test above."""
    tracemalloc.start()
    try:
        kept = {f"walk-{i}" for i in range(NAMES)}
        assert tracemalloc.get_traced_memory()[0] > 30 * NAMES
    finally:
        tracemalloc.stop()
    assert len(kept) == NAMES


def test_generated_names_sort_as_their_rows():
    names = [generated(i) for i in range(1000)]
    assert names[123] == "clip-000123"
    assert sorted(names) == names
    assert generated(12_345_678) == "clip-12345678"
