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


def test_who_is_asked_for_is_made_more_of_his_own_clips(ask, controls):
    weights = {}
    for who in ("tall", None):
        body = {"controls": controls, "performer": who, "nearest": 1000}
        clips = ask("POST", WHY, json=body).json()["nearest"]
        weights[who] = sum(clip["weight"] for clip in clips if clip["performer"] == "tall")
    assert weights["tall"] > weights[None] + 0.01


def test_what_lies_outside_is_warned_of_or_refused(ask, controls):
    body = {"controls": {**controls, "turn": 1e3}}
    assert "turn: asked 1000 deg, given" in ask("POST", WHY, json=body).json()["warnings"][0]
    refused = ask("POST", WHY, json={**body, "extrapolate": "refuse"})
    assert refused.json()["type"] == "urn:posefield:problem:outside-samples"
