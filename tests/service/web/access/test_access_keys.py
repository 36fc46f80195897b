"""Tests of API keys: generation, verification by hash, and errors."""

import hashlib

import pytest

from posefield.common.errors import InvalidField
from posefield.http.access import api_keys
from posefield.http.access.api_keys import EVERYONE, METRICS, NO_ACCESS, READ

DIGEST = "0" * 64


def test_a_key_is_256_random_bits_and_none_twice():
    made = {api_keys.generate_key() for _ in range(100)}
    assert len(made) == 100
    assert all(key.startswith("pf_") and len(key) == 3 + 43 for key in made)


def test_a_key_is_found_by_what_its_line_says():
    key, other = api_keys.generate_key(), api_keys.generate_key()
    lines = [
        api_keys.key_line("a", ["read:reach"], key),
        api_keys.key_line("b", ["read:*", "metrics"], other),
    ]
    known = api_keys.parse_keys("\n".join(lines), "KEYS")
    assert known.find(key) == api_keys.from_scopes("a", ["read:reach"])
    assert known.find(other) == api_keys.from_scopes("b", ["read:*", "metrics"])


def test_a_line_does_not_hold_the_key():
    key = api_keys.generate_key()
    line = api_keys.key_line("a", ["read:*"], key)
    assert key not in line and key.removeprefix("pf_") not in line
    assert line.split()[1] == hashlib.sha256(key.encode()).hexdigest()


def test_what_is_nearly_a_key_is_none():
    key = api_keys.generate_key()
    known = api_keys.parse_keys(api_keys.key_line("a", ["read:*"], key), "KEYS")
    last = "A" if key[-1] != "A" else "B"
    for wrong in ("", "pf_", key[:-1], key + "A", key[:-1] + last, key.upper(), f" {key}"):
        assert known.find(wrong) is None
    assert known.find(key) is not None


def test_comments_semicolons_and_empty_lines():
    text = f"# two\n\n  a {DIGEST} read:*  # first\n;b {DIGEST[:-1]}1 metrics;\n"
    assert {who.name for _, who in api_keys.parse_keys(text, "KEYS").principals.values()} >= {"b"}
    assert api_keys.parse_keys("# none\n\n", "KEYS").principals == {}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a", "KEYS:1: the hash of 'a', expected 64"),
        (f"\na {DIGEST} write:*", "KEYS:2: the scopes of 'a'"),
        (f"a {DIGEST} read:", "KEYS:1: the scopes of 'a'"),
        (f"a/b {DIGEST} read:*", "KEYS:1: its name"),
        (f"a {DIGEST} read:*;a {DIGEST[:-1]}1 read:*", "KEYS:2: a second key named 'a'"),
    ],
)
def test_a_line_that_is_none_is_refused_by_its_place(text, words):
    with pytest.raises(InvalidField, match=words.replace("*", r"\*")):
        api_keys.parse_keys(text, "KEYS")


def test_a_key_in_the_place_of_its_hash_is_not_repeated():
    key = api_keys.generate_key()
    with pytest.raises(InvalidField) as refused:
        api_keys.parse_keys(f"a {key} read:*", "KEYS")
    assert key not in str(refused.value)
    with pytest.raises(InvalidField) as refused:
        api_keys.parse_keys(f"{key} read:*", "KEYS")
    assert "expected 64" in str(refused.value) and "read:*" not in str(refused.value)


def test_scopes_say_what_may_be_read():
    some = api_keys.from_scopes("a", ["read:reach", "other", "metricsx"])
    assert (some.may_read("reach"), some.may_read("walk")) == (True, False)
    assert (some.may(READ), some.may(METRICS)) == (True, False)
    every = api_keys.from_scopes("a", ["read:reach", "read:*"])
    assert every.may_read("walk") and every.may(READ)
    assert not api_keys.from_scopes("a", ["metrics"]).may(READ)
    assert EVERYONE.may(READ) and EVERYONE.may(METRICS) and EVERYONE.may_read("any")
    assert not (NO_ACCESS.may(READ) or NO_ACCESS.may(METRICS) or NO_ACCESS.may_read("any"))
