"""Examples of the contract: a request and its response for each operation and format.

An example of an operation whose path ends in `{format}` covers all its formats: `formats` holds the
parts that differ by format, with names of several formats as space-separated keys.
"""

import json
from pathlib import Path

import pytest

from posefield.encode.formats import ROBOT_ENCODERS
from posefield.http.api import contract

EXAMPLES = Path(__file__).parents[1] / "api/examples"
OPERATIONS = {operation.id: operation for operation in contract.load_contract().operations}
CASES = [
    (name, form)
    for name, each in OPERATIONS.items()
    for form in each.formats or [None]
    if form not in ROBOT_ENCODERS
    # The family of these examples has legs alone, and avatars and simulators need a whole body.
    if (name, form)
    not in {
        ("queryPerformanceInFormat", "vrma"),
        ("queryTracksInFormat", "osi"),
        ("queryTracksInFormat", "carla.npz"),
    }
]
"""Operation and format; None where the path names none. Reference motions are of robots' models."""


def each_example(of=lambda name: True):
    """Parametrise a test by the name and format of each example."""
    cases = [case for case in CASES if of(case[0])]
    ids = ["-".join(filter(None, case)) for case in cases]
    return pytest.mark.parametrize(("name", "form"), cases, ids=ids)


def request(name, form=None):
    """Return an example's request: method, path, and perhaps headers and body."""
    return _part(name, "request", form)


def response(name, form=None):
    """Return an example's response: status, headers, and perhaps some of its body."""
    return _part(name, "response", form)


def _part(name, part, form):
    found = json.loads((EXAMPLES / name / f"{part}.json").read_bytes())
    for names, own in found.pop("formats", {}).items():
        if form in names.split():
            found |= {key: _merged(found.get(key), value) for key, value in own.items()}
    return _filled(found, form, OPERATIONS[name].formats.get(form))


def _merged(common, own):
    return {**common, **own} if isinstance(common, dict) else own


def _filled(value, form, media_type):
    """Put the format and its media type in their places."""
    if isinstance(value, dict):
        return {key: _filled(each, form, media_type) for key, each in value.items()}
    if isinstance(value, str) and form:
        return value.replace("{format}", form).replace("{media_type}", media_type)
    return value
