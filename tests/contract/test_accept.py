"""Tests of content negotiation: paths without a format equal those with the accepted format."""

from urllib.parse import urlencode

import pytest

from posefield.encode.archives import ARCHIVE_WRITERS
from posefield.encode.formats import CLIP_ENCODERS, CROWD_ENCODERS, GRID_ENCODERS, POSE_ENCODERS

REACH = "/v1/models/reach"
WALK = "/v1/models/walk/crowd"


def questions(controls):
    """Method, path, content and formats, the usual one first, of all that is negotiated."""
    once, columns = {**controls, "time": 0.3}, {n: [v, v] for n, v in controls.items()}
    usd = {name: CLIP_ENCODERS[name] for name in ("usdc", "usda", "usdz")}
    body = {"controls": controls}
    many = {"format": "bvh", "clips": [body]}
    crowd = {"controls": columns, "time": 0.1}
    return [
        ("GET", f"{REACH}/pose", f"?{urlencode(once)}", None, POSE_ENCODERS),
        ("POST", f"{REACH}/pose", "", {**body, "times": [0.3]}, POSE_ENCODERS),
        (
            "GET",
            f"{REACH}/clip",
            f"?{urlencode({**controls, 'end': 0.2})}",
            None,
            usd | CLIP_ENCODERS,
        ),
        ("POST", f"{REACH}/clip", "", {**body, "end": 0.2}, usd | CLIP_ENCODERS),
        ("POST", f"{REACH}/clips", "", many, ARCHIVE_WRITERS),
        ("POST", f"{REACH}/crowd", "", crowd, CROWD_ENCODERS),
        ("GET", f"{REACH}/sigma", "?across=turn&along=stature&rows=3", None, GRID_ENCODERS),
        ("POST", f"{REACH}/sigma", "", {"across": "turn", "along": "stature"}, GRID_ENCODERS),
        ("GET", WALK, "?count=2&seconds=0.2", None, usd),
    ]


@pytest.mark.parametrize("which", range(9))
def test_each_format_is_had_by_its_media_type(which, ask, controls):
    method, path, query, body, formats = questions(controls)[which]
    for name, found in formats.items():
        own = ask(method, f"{path}.{name}{query}", json=body)
        answer = ask(method, f"{path}{query}", json=body, headers={"accept": found.media_type})
        assert (own.status_code, answer.status_code) == (200, 200), answer.text
        assert answer.headers["content-type"] == own.headers["content-type"] == found.media_type
        assert "Accept" in answer.headers["vary"].split(", ")
        assert "Accept" not in own.headers.get("vary", "").split(", ")
        assert answer.content == own.content
        for header in ("content-disposition", "posefield-sigma"):
            assert answer.headers.get(header) == own.headers.get(header)
    first = next(iter(formats.values()))
    for headers in ({}, {"accept": "text/html, */*;q=0.1"}):
        answer = ask(method, f"{path}{query}", json=body, headers=headers)
        assert answer.headers["content-type"] == first.media_type
    refused = ask(method, f"{path}{query}", json=body, headers={"accept": "image/png"})
    assert refused.status_code == 406 and first.media_type in refused.json()["detail"]


def test_what_is_accepted_is_asked_before_anything_else(ask):
    path = f"{REACH}/clip?turn=never"
    assert ask("GET", path, headers={"accept": "image/png"}).status_code == 406
    assert ask("GET", path).status_code == 400
