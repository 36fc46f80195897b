"""Tests of content negotiation by Accept (RFC 9110, 12.5.1)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from posefield.http.negotiation import preferred_format

CLIP = (
    ("usdc", "model/vnd.usdc"),
    ("usda", "model/vnd.usda"),
    ("json", "application/json"),
    ("bvh", "application/x-bvh"),
)


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        ("*/*", "usdc"),
        ("application/json; charset=utf-8", "json"),
        ("model/*;q=0.5, application/x-bvh;q=0.6", "bvh"),
        # What is named counts more than what any wildcard lets in.
        # The closest range gives the weight, wherever it stands and however small it is.
        ("*/*, model/*;q=0.1, model/vnd.usda;q=0", "json"),
        ("model/vnd.usda;q=0.1, */*;q=0.5, model/*;q=0.2", "json"),
        # Members that nobody can read, or that ask for more than there is, count for nothing.
        ("json, application/x-bvh;q=0.1", "bvh"),
        ("application/json;q=-1, application/x-bvh;q=0.1", "bvh"),
        ('text/plain;a="x, application/json", application/x-bvh', "bvh"),
        # Nothing is left.
        ("text/html", None),
        ("*/json", None),
        ("application/json;q=0.000", None),
    ],
)
def test_the_header_decides(accept, expected):
    assert preferred_format(accept, CLIP) == expected


TYPES = [media_type for _, media_type in CLIP]
RANGES = st.sampled_from([*TYPES, "model/*", "application/*", "*/*", "text/html"])
WEIGHTS = st.sampled_from([0.0, 0.001, 0.3, 0.9, 1.0])


def closeness(offered, media_range):
    kind, subtype = media_range.split("/")
    if media_range == offered:
        return 3
    return 2 if subtype == "*" and kind == offered.split("/")[0] else int(media_range == "*/*")


@given(st.dictionaries(RANGES, WEIGHTS, min_size=1))
def test_it_is_what_the_standard_says_word_by_word(ranges):
    """The standard's own words as an oracle: the most specific range gives each type its weight."""
    accept = ", ".join(f"{name};q={weight}" for name, weight in ranges.items())

    def worth(offer):
        closest = max(ranges, key=lambda name: closeness(offer[1], name))
        close = closeness(offer[1], closest)
        return (ranges[closest] if close else 0.0, close)

    best = max(CLIP, key=worth)
    assert preferred_format(accept, CLIP) == (best[0] if worth(best)[0] else None)
    assert preferred_format(", ".join(reversed(accept.split(", "))), CLIP) == preferred_format(
        accept, CLIP
    )


@given(st.text(max_size=200))
def test_nothing_that_is_sent_is_a_failure(accept):
    assert preferred_format(accept, CLIP) in {None, *(name for name, _ in CLIP)}


@pytest.mark.parametrize("piece", ['"', ' ;q="', "a/b;a=\\", 'a/b;c="'])
def test_a_long_header_takes_no_long_time(piece):
    # A search that goes back on itself would not come to an end.
    assert preferred_format(piece * 20_000 + ",*/*", CLIP) in ("usdc", None)
