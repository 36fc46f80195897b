"""Tests of the TypeScript client: its tests against a service, and its generated source."""

import io
import json
from pathlib import Path

import httpx
import numpy as np
import pytest

from posefield.motion import skeleton

PACKAGE = Path(__file__).parents[3] / "clients/typescript"
REACH = "/v1/models/reach"
PLACES = [[0, 0, 0], [3, 0, 1], [-2, 0, 5]]
CROWD = {"time": [0.0, 0.2, 0.4], "heading": [0.0, 1.0, -2.0], "position": PLACES}


@pytest.fixture
def assert_runs(in_package):
    return in_package("typescript")


def test_its_own_tests_pass_against_a_real_service(address, kinematics, assert_runs):
    said = assert_runs("npm", "test", POSEFIELD_URL=address, POSEFIELD_KINEMATICS=str(kinematics))
    assert "\nℹ fail 0\n" in said
    assert "\nℹ skipped 0\n" in said


def test_its_schema_is_what_the_contract_gives(assert_runs, tmp_path):
    anew = tmp_path / "schema.ts"
    assert_runs("node", "generate.ts", str(anew))
    assert anew.read_text() == (PACKAGE / "src/schema.ts").read_text()
    assert anew.read_text().startswith("// Generated from api/openapi.yaml by ")


def test_a_failure_of_the_tools_is_one_of_this_suite(assert_runs):
    with pytest.raises(AssertionError, match="not of this world"):
        assert_runs("node", "-e", "console.error('not of this world'); process.exit(1)")


@pytest.fixture
def kinematics(address, tmp_path):
    """Joints in the world by the service's own kinematics, for what TypeScript asks as well."""
    with httpx.Client(base_url=address, timeout=60) as client:
        card = client.get(REACH).raise_for_status().json()
        controls = {control["name"]: control["default"] for control in card["controls"]}
        clip = {"controls": controls, "fps": 20}
        crowd = {"controls": {**controls, "stature": [1.6, 1.75, 1.9]}, **CROWD}
        found = {
            "clip": {"question": clip, "positions": positions(client, "/clip.npz", clip)},
            "crowd": {"question": crowd, "positions": positions(client, "/crowd.npz", crowd)},
        }
    path = tmp_path / "kinematics.json"
    path.write_text(json.dumps(found))
    return path


def positions(client, path, question):
    answer = client.post(REACH + path, json=question).raise_for_status()
    with np.load(io.BytesIO(answer.content)) as found:
        arrays = {name: found[name].astype(float) for name in _ARRAYS}
        parents = tuple(found["parents"].tolist())
    rotations, roots, offsets = arrays.values()
    local = np.broadcast_to(offsets, (*rotations.shape[:-1], 3)).copy()
    local[:, 0] = roots
    return skeleton.forward_kinematics(parents, rotations, local)[0].tolist()


_ARRAYS = ("rotations", "root_position", "bone_offsets")
