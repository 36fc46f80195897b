"""Tests of poses and clips with targets and exact controls, and of their errors."""

import json
from urllib.parse import urlencode

import numpy as np
import pytest
from asking import unpacked

from posefield.motion import skeleton

MODEL = "/v1/models/reach"
CONTROLS = {"stature": 1.72, "hip_height": 0.9, "turn": 20.0, "target_height": 1.1}
NEAR = (-0.2, 1.1, 0.49)
AT_END = {"joint": "RightHand", "position": NEAR, "at": "end"}
EARLY = {"joint": "RightHand", "position": (-0.32, 0.87, 0.23), "time": 0.4}
FAR = {"joint": "LeftHand", "position": (0, 1, 5), "at": "end"}
WORDS = "RightHand@end:-0.2,1.1,0.49"
# Fields of a body, status, problem, place at fault, words of the detail
IN_BODY = [
    ({"targets": [{**AT_END, "time": 0}]}, 400, "bad-body", "/targets/0", "time and at"),
    (
        {"targets": [AT_END, {**AT_END, "joint": "Tail"}]},
        422,
        "invalid-field",
        "/targets/1/joint",
        "expected one of Hips, LeftUpLeg",
    ),
    (
        {"targets": [EARLY, AT_END, {**EARLY, "position": [0, 0, 0]}]},
        422,
        "invalid-field",
        "/targets/2",
        "RightHand at 0.4 s has a target already (targets/0), expected one",
    ),
    ({"exact": ["turn"]}, 422, "invalid-field", "/exact", "'turn' is not measured on a motion"),
]


def query(path, **more):
    return f"{MODEL}/{path}?{urlencode({**CONTROLS, **more}, doseq=True)}"


def problem(answer):
    """Status, kind, place and words of a refusal."""
    assert answer.headers["content-type"] == "application/problem+json", answer.text
    found = answer.json()
    (place,) = found["errors"]
    kind = found["type"].rpartition(":")[2]
    return answer.status_code, kind, place.get("pointer", place.get("parameter")), found["detail"]


@pytest.mark.parametrize(("fields", "status", "kind", "place", "said"), IN_BODY)
def test_bad_fields_are_refused(ask, fields, status, kind, place, said):
    clips = [{"controls": CONTROLS}, {"controls": CONTROLS, **fields}]
    found = problem(ask("POST", f"{MODEL}/clips", json={"format": "bvh", "clips": clips}))
    assert found[:3] == (status, kind, f"/clips/1{place}")
    assert said in found[3]


def places(clip, joint):
    """Return a joint's positions in the frames of a clip's JSON."""
    rotations, roots = np.array(clip["rotations"]), np.array(clip["root_position"])
    offsets = np.array(clip["bone_offsets"])
    translations = np.repeat(offsets[None], len(roots), axis=0)
    translations[:, 0] = roots
    found, _ = skeleton.forward_kinematics(tuple(clip["parents"]), rotations, translations)
    return found[:, clip["names"].index(joint)]


def test_a_clip_meets_its_target(ask):
    plain, held = (
        ask("GET", query("clip.json", fps=25, **more)).json()
        for more in ({}, {"target": "RightHand@0.4:-0.32,0.87,0.23"})
    )
    assert np.abs(places(held, "RightHand")[10] - EARLY["position"]).max() < 1e-5
    assert np.abs(places(plain, "RightHand")[10] - EARLY["position"]).max() > 5e-3
    (met,) = held["trust"]["targets"]
    assert met["miss"] < 1e-5
    assert met | {"miss": 0} == {
        "what": "RightHand at 0.4 s",
        "miss": 0,
        "unit": "m",
        "reached": True,
    }
    assert "targets" not in plain["trust"] and held["trust"]["warnings"] == []


@pytest.mark.parametrize("extension", ["bvh", "usdc"])
def test_what_is_missed_is_said_in_headers(ask, extension):
    answer = ask("GET", query(f"clip.{extension}", target="LeftHand@end:0,1,5"))
    (missed,) = json.loads(f"[{answer.headers['posefield-missed']}]")
    assert (missed["what"], missed["unit"]) == ("LeftHand at end", "m")
    assert 4 < missed["miss"] < 5
    (said,) = json.loads(f"[{answer.headers['posefield-warning']}]")
    centimetres = f"{100 * missed['miss']:.1f} cm"
    assert said == f"LeftHand at end stays {centimetres} from its target: out of reach"
    met = ask("GET", query(f"clip.{extension}", target=WORDS))
    assert "posefield-missed" not in met.headers and "posefield-warning" not in met.headers


def test_what_is_missed_can_be_refused(ask):
    strict = {"controls": CONTROLS, "targets": [FAR], "extrapolate": "refuse"}
    found = problem(ask("POST", f"{MODEL}/clip", json=strict))
    assert found[:3] == (422, "out-of-reach", "/targets/0")
    assert found[3].startswith("targets/0: LeftHand at end stays 4")
    assert problem(ask("POST", f"{MODEL}/pose", json={**strict, "times": [0]})) == found
    by_query = query("pose", time=0, target="LeftHand@end:0,1,5", extrapolate="refuse")
    assert problem(ask("GET", by_query))[:3] == (422, "out-of-reach", "target")
    many = {"format": "bvh", "clips": [{"controls": CONTROLS}, strict]}
    found = problem(ask("POST", f"{MODEL}/clips", json=many))
    assert found[:3] == (422, "out-of-reach", "/clips/1/targets/0")
    reached = {**strict, "targets": [AT_END]}
    assert ask("POST", f"{MODEL}/clip", json=reached).status_code == 200


def test_clips_of_an_archive_are_held_each_to_its_own(ask):
    clips = [{"controls": CONTROLS, "targets": [each]} for each in (AT_END, FAR)]
    body = {"format": "usda", "clips": [*clips, {"controls": CONTROLS}]}
    answer = ask("POST", f"{MODEL}/clips.zip", json=body)
    assert json.loads(f"[{answer.headers['posefield-warning']}]") == [
        "1 of 3 clips miss some target"
    ]
    files = unpacked("zip", answer.content)
    near, far, free = map(json.loads, files["manifest.jsonl"].splitlines())
    assert near["targets"][0]["reached"] and not far["targets"][0]["reached"]
    assert far["warnings"] and "targets" not in free
    alone = ask("POST", f"{MODEL}/clip.usda", json=clips[0])
    assert files["clip-000000.usda"] == alone.content != files["clip-000002.usda"]
