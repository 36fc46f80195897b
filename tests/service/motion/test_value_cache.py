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
