"""Tests of the operation `why` over HTTP: captured clips and their weights."""

from urllib.parse import urlencode

WHY = "/v1/models/reach/why"


def test_the_nearest_and_all_others_add_up_to_one(ask, controls, loaded):
    asked = urlencode({**controls, "performer": "tall", "nearest": 4})
    found = ask("GET", f"{WHY}?{asked}").json()
    model = loaded.find("reach")
    assert (found["model"], found["performer"]) == (model.identity, "tall")
    assert found["controls"] == controls
    distances = [clip["distance"] for clip in found["nearest"]]
    assert distances == sorted(distances) and len(distances) == 4
    weights = [clip["weight"] for clip in found["nearest"]]
    assert abs(sum(weights) + found["others"]["weight"] - 1.0) < 1e-7
    assert found["others"]["count"] == model.session.card.samples - 4
    assert {clip["source"] for clip in found["nearest"]} <= set(model.session.card.sources)
