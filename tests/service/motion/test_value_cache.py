"""Tests of the cache of values that follow from their keys."""

import pytest

from posefield.common.value_cache import ValueCache


def never():
    raise AssertionError("asked for a value that is known")


def test_a_value_is_made_once_while_it_is_known():
    cache = ValueCache(2)
    assert cache.find("a", lambda: 1) == 1
    assert cache.find("a", never) == 1
    with pytest.raises(AssertionError):
        cache.find("b", never)
    assert len(cache) == 1


def test_the_value_that_was_not_used_for_longest_is_removed():
    cache = ValueCache(2)
    for key in "aba":
        cache.find(key, lambda key=key: key)
    cache.find("c", lambda: "c")
    assert cache.find("a", never) == "a"
    assert cache.find("c", never) == "c"
    assert cache.find("b", lambda: "again") == "again"
    assert len(cache) == 2


def test_values_of_many_keys_are_made_together_and_once():
    cache, asked = ValueCache(3), []

    def double(keys):
        asked.append(keys)
        return [2 * key for key in keys]

    cache.find(1, lambda: 2)
    assert cache.find_all([3, 1, 3, 4], double) == [6, 2, 6, 8]
    assert cache.find_all([4, 3], double) == [8, 6]
    assert asked == [[3, 4]]
    assert cache.find_all([7, 8, 9, 10], double) == [14, 16, 18, 20]
    assert len(cache) == 3
    with pytest.raises(ValueError, match="shorter"):
        cache.find_all([5, 6], lambda keys: keys[:1])
