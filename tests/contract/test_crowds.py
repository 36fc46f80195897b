"""Tests of crowds over HTTP: tables, walking crowds as USD, and errors."""

import io
import json

import numpy as np
import pyarrow as pa
import pytest
from asking import asker
from pxr import Usd, UsdSkel

from posefield.http import crowd_operations
from posefield.http.api.settings import Settings
from posefield.http.app import create_app

CROWD = "/v1/models/reach/crowd"
WALK = "/v1/models/walk/crowd"


def question(controls, count=3, **given):
    return {
        "controls": {name: [value] * count for name, value in controls.items()},
        "time": [0.1 * row for row in range(count)],
        "position": [[3.0 * row, 0.0, 0.0] for row in range(count)],
        "heading": 0.5,
        **given,
    }


def test_all_formats_hold_the_same_poses(ask, controls):
    asked = question(controls, level=[0, 1, 2])
    answers = {e: ask("POST", f"{CROWD}.{e}", json=asked) for e in ("arrow", "npz", "json")}
    assert {answer.status_code for answer in answers.values()} == {200}
    batch = pa.ipc.open_stream(answers["arrow"].content).read_next_batch()
    archive = np.load(io.BytesIO(answers["npz"].content))
    plain = answers["json"].json()
    turns = batch.column("rotations").to_numpy_ndarray()
    assert turns.shape == (3, 33, 4)
    assert np.array_equal(turns, archive["rotations"])
    assert np.abs(turns - np.array(plain["rotations"])).max() < 1e-6
    assert np.ptp(turns, axis=0).max() > 1e-2
    assert plain["levels"] == archive["levels"].tolist() == [0, 1, 2]
    assert plain["model"].startswith("reach@")


def test_more_characters_than_the_service_takes_are_refused(loaded, controls):
    small = asker(create_app(loaded, Settings(crowd_limit=2, crowd_poses=100)))
    answer = small("POST", f"{CROWD}.arrow", json=question(controls))
    assert answer.status_code == 422 and "expected 1 to 2" in answer.json()["detail"]
    assert small("GET", f"{WALK}.usdc?count=3").status_code == 422
    long = small("GET", f"{WALK}.usdc?count=2&seconds=60")
    assert long.status_code == 422 and "expected at most 100" in long.json()["detail"]
    assert small("GET", f"{WALK}.usdc?count=2&seconds=1").status_code == 200


def test_a_body_of_more_values_than_any_crowd_has_is_refused_before_it_is_decoded(ask, controls):
    def refused(count):
        body = json.dumps({"controls": controls, "time": 0}).replace(
            '"time": 0', '"time": [' + "0," * count + "x]"
        )
        headers = {"content-type": "application/json"}
        return ask("POST", f"{CROWD}.arrow", content=body.encode(), headers=headers)

    most = crowd_operations.VALUES * crowd_operations.FEWEST
    answer = refused(most)
    assert answer.status_code == 413 and f"expected at most {most}" in answer.json()["detail"]
    # Negative control: with fewer the decoder finds the fault at the end.
    assert refused(1000).status_code == 400


@pytest.mark.parametrize(
    ("query", "expected"),
    [
        # 438 MB, made in 2.4 GB of memory.
        ("count=1&seconds=16000", "480001 frames of a motion, expected at most 36000"),
        ("count=1&seconds=-1e308", "expected a time above 0"),
        ("count=1&fps=-1e308", "expected 1 to 1000"),
        # More than a minute of work in 1.4 GB.
        ("count=100000&motions=5&seconds=0.1&instancing=flatten", "expected at most 268.4 MB"),
        ("count=100000&motions=2000&seconds=1", "expected at most 268.4 MB"),
    ],
)
def test_a_crowd_that_takes_too_much_memory_is_refused(ask, query, expected):
    answer = ask("GET", f"{WALK}.usdc?{query}")
    assert answer.status_code == 422, answer.status_code
    assert expected in answer.json()["detail"]


def skeletons(path):
    """Animated skeletons of a stage, instances looked into."""
    stage = Usd.Stage.Open(str(path))
    inside = Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies())
    return stage, [UsdSkel.Skeleton(prim) for prim in inside if prim.IsA(UsdSkel.Skeleton)]


@pytest.mark.parametrize(
    ("ending", "instancing"),
    [("usda", "references"), ("usdc", "scenegraph"), ("usdc", "flatten"), ("usdz", "references")],
)
def test_a_walk_opens_and_everybody_moves(ask, tmp_path, ending, instancing):
    answer = ask("GET", f"{WALK}.{ending}?count=4&seconds=0.5&instancing={instancing}")
    assert answer.status_code == 200
    path = tmp_path / f"walk.{ending}"
    path.write_bytes(answer.content)
    stage, found = skeletons(path)
    cache = UsdSkel.Cache()
    queries = [cache.GetSkelQuery(skeleton) for skeleton in found]
    moving = [query for query in queries if query.GetAnimQuery()]
    assert len(moving) == 4 and stage.GetEndTimeCode() == 15
    for query in moving:
        first, last = (np.array(query.ComputeJointSkelTransforms(code)) for code in (0, 15))
        assert np.abs(last[:, 3, 2] - first[:, 3, 2]).max() > 0.2


@pytest.mark.parametrize(
    ("query", "status", "parameter"),
    [
        ("label=performer=bob", 422, "label"),
        ("count=5&motions=6", 422, "motions"),
        ("motions=2&camera=30,2,0", 422, "motions"),
        ("instancing=clones", 400, "instancing"),
    ],
)
def test_a_walk_that_cannot_be_is_refused_before_it_begins(ask, query, status, parameter):
    answer = ask("GET", f"{WALK}.usdz?{query}")
    assert answer.status_code == status, answer.text
    assert parameter in answer.json()["errors"][0].get("parameter", ""), answer.text
