"""Tests of responses: trust, warnings, request ids and internal errors."""

import json
import logging
import re
from urllib.parse import urlencode

import pytest
from asking import asker

from posefield.http.api import contract
from posefield.http.api.settings import Settings
from posefield.http.app import build_app
from posefield.http.operations import OPERATIONS
from posefield.question.motion_question import PoseQuestion
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis import poses

CLIP = "/v1/models/reach/clip"
FORMATS = ("usda", "usdc", "usdz", "json", "bvh", "glb", "vrma", "npz", "arrow", "msgpack")


def url(path, controls, **more):
    return f"{path}?{urlencode({**controls, **more}, doseq=True)}"


@pytest.mark.parametrize("extension", FORMATS)
def test_a_file_says_how_far_it_may_be_trusted(extension, ask, controls, loaded):
    model = loaded.find("reach")
    trust = poses.synthesize_poses(model, PoseQuestion(controls=controls, times=[0.0])).trust
    answer = ask("GET", url(f"{CLIP}.{extension}", controls))
    assert answer.headers["posefield-model"] == model.identity
    assert float(answer.headers["posefield-sigma"]) == trust.sigma
    # The clip ends on a frame.
    assert abs(float(answer.headers["posefield-duration"]) - trust.duration) <= 0.5 / 30
    assert answer.headers["posefield-supported"] == str(trust.supported).lower() == "true"
    assert "posefield-warning" not in answer.headers
    assert answer.headers["content-disposition"] == f'attachment; filename="reach.{extension}"'


def test_each_control_outside_the_samples_gives_a_warning(ask, controls, loaded):
    card = loaded.find("reach").session.card
    outside = {**controls, **{c.name: c.maximum * 1.1 for c in card.controls[:2]}}
    answer = ask("GET", url(f"{CLIP}.usda", outside))
    lines = answer.headers.get_list("posefield-warning")
    first = [re.match(r"\w+", json.loads(line))[0] for line in lines]
    assert first == [c.name for c in card.controls[:2]]
    # Proxies may join the lines: the joined line must come apart again.
    assert len(json.loads(f"[{', '.join(lines)}]")) == 2
    pose = ask("GET", url("/v1/models/reach/pose", outside, time=0)).json()
    assert pose["trust"]["warnings"] == [json.loads(line) for line in lines]


@pytest.mark.parametrize("given", ["abc-1.2_X", "a" * 64])
def test_a_request_keeps_its_id(given, ask):
    answer = ask("GET", "/nowhere", headers={"x-request-id": given})
    assert answer.headers["x-request-id"] == given
    assert answer.json()["instance"] == given


@pytest.mark.parametrize("given", ["", "a" * 65, "a b", "<script>", "a\tb"])
def test_an_id_that_is_none_is_replaced(given, ask):
    answer = ask("GET", "/livez", headers={"x-request-id": given})
    assert len(answer.headers["x-request-id"]) == 32


def test_a_failure_shows_its_id_and_nothing_else(caplog):
    async def fails(request):
        raise RuntimeError("secret /etc/path")

    app = build_app(
        contract.load_contract(),
        {**OPERATIONS, "getLiveness": fails},
        ModelRegistry({}),
        Settings(),
    )
    with caplog.at_level(logging.ERROR):
        answer = asker(app)("GET", "/livez", headers={"x-request-id": "id-1"})
    problem = answer.json()
    assert answer.status_code == problem["status"] == 500
    assert problem["type"] == "urn:posefield:problem:internal-error"
    assert problem["instance"] == answer.headers["x-request-id"] == "id-1"
    assert "secret" not in answer.text and "RuntimeError" not in answer.text
    assert "id-1" in caplog.text and "secret" in caplog.text
