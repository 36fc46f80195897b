"""Tests of compatibility: a contract of the same major version as the released one keeps to it."""

import copy
from pathlib import Path

import breaking
import pytest
import yaml


def version(text):
    return tuple(map(int, text.split(".")))


# A release copies api/openapi.yaml here under its version.
RELEASED = Path(__file__).parents[2] / "api/released"
NEWEST = max(RELEASED.glob("[0-9]*.yaml"), key=lambda path: version(path.stem))
POSE = "/v1/models/{model}/pose"


def test_what_breaks_the_released_contract_raises_the_major_version(spec):
    released, current = version(NEWEST.stem), version(spec["info"]["version"])
    assert current >= released
    if current[0] == released[0]:
        assert breaking.changes(yaml.safe_load(NEWEST.read_bytes()), spec) == []


def test_a_released_contract_lies_under_its_version():
    for path in RELEASED.glob("[0-9]*.yaml"):
        assert yaml.safe_load(path.read_bytes())["info"]["version"] == path.stem


def pose(spec):
    return spec["paths"][POSE]["get"]


def schema(spec, name):
    return spec["components"]["schemas"][name]


def without(place, *names):
    for name in names:
        del place[name]


# How a contract may be changed, and what is then said of it.
BREAKING = {
    "format": (
        lambda s: s["components"]["parameters"]["tableFormat"]["schema"]["enum"].remove("npz"),
        f"POST {POSE}.npz: gone",
    ),
    "key": (
        lambda s: pose(s).update(security=[{"bearer": ["read"]}]),
        f"GET {POSE} now needs a key",
    ),
    "parameter needed": (
        lambda s: s["components"]["parameters"]["level"].update(required=True),
        f"GET {POSE} now needs parameter level",
    ),
    "enumeration": (lambda s: schema(s, "Names")["enum"].remove("vrm"), "Names (asked): enum {"),
    "field of an answer": (
        lambda s: without(schema(s, "Trust")["properties"], "sigma"),
        "Trust (answered)/sigma: gone",
    ),
}


@pytest.mark.parametrize("name", BREAKING)
def test_what_breaks_is_found_and_named(name, spec):
    change, said = BREAKING[name]
    changed = copy.deepcopy(spec)
    change(changed)
    found = breaking.changes(spec, changed)
    assert any(line.startswith(said) for line in found), found
