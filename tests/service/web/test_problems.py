"""Tests of problem kinds: every client error has a status, and names are unique."""

import json

import pytest
from starlette.requests import Request

from posefield.common.errors import FormError, InvalidField, QueryError
from posefield.http.api import problems


def descendants(error):
    return {error, *(d for child in error.__subclasses__() for d in descendants(child))}


def test_every_query_error_is_in_the_table():
    # A FormError is a bad parameter or a bad body.
    assert {*problems.QUERY_ERROR_PROBLEMS, FormError} == descendants(QueryError) - {QueryError}


def test_every_kind_is_a_client_error_but_one():
    for kind in (*problems.REQUEST_PROBLEMS, *problems.QUERY_ERROR_PROBLEMS.values()):
        assert 400 <= kind.status < 500
    assert problems.INTERNAL.status == 500


@pytest.mark.parametrize(
    ("error", "where"),
    [
        (InvalidField("controls/a/b", "1e9, expected less", 17), "/controls/a~1b/17"),
        (InvalidField("time", "-1, expected more", 0), "/time/0"),
        (InvalidField("time", "none"), "/time"),
    ],
)
def test_one_of_many_is_pointed_at(error, where):
    request = Request({"type": "http", "method": "POST", "path": "/", "state": {"request_id": "x"}})
    answer = problems.query_error_response(request, error)
    assert json.loads(answer.body)["errors"][0]["pointer"] == where
