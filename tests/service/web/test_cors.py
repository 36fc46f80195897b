"""Tests of CORS: allowed origins and headers."""

import re

import pytest

from posefield.common.errors import InvalidField
from posefield.http import responses

ALLOWED = responses.parse_origins("https://a.example, http://localhost:5173", "ORIGINS")


def test_an_origin_is_allowed_by_its_very_name():
    given = dict(responses.cors_headers(b"https://a.example", ALLOWED))
    assert given[b"access-control-allow-origin"] == b"https://a.example"
    assert given[b"vary"] == b"Origin"
    shown = given[b"access-control-expose-headers"].split(b", ")
    assert {b"Posefield-Sigma", b"Content-Encoding"} <= set(shown)


@pytest.mark.parametrize(
    "origin",
    [
        b"https://b.example",
        b"http://a.example",
        b"https://a.example:8443",
        b"https://a.example.evil",
        b"null",
        None,
    ],
)
def test_every_other_is_not_but_caches_are_told(origin):
    assert responses.cors_headers(origin, ALLOWED) == [(b"vary", b"Origin")]


def test_credentials_of_browsers_are_never_allowed():
    for allowed in (ALLOWED, responses.ANY_ORIGIN):
        for pair in (
            *responses.cors_headers(b"https://a.example", allowed),
            *responses.preflight_headers(b"GET"),
        ):
            assert b"credentials" not in pair[0]


@pytest.mark.parametrize(
    "text", ["https://a.example/", "https://A.example", "https://*.example", "null"]
)
def test_what_is_no_origin_is_refused(text):
    with pytest.raises(InvalidField, match=re.escape("ORIGINS: ")):
        responses.parse_origins(text, "ORIGINS")
