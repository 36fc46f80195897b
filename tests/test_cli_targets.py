"""Tests of the command line: poses, clips and exports with targets."""

import json

import pytest

POINT = {"stature": 1.72, "hip_height": 0.9, "turn": 20.0, "target_height": 1.1}
CONTROLS = [word for name, value in POINT.items() for word in ("-c", f"{name}={value}")]
NEAR, FAR = "RightHand@end=-0.2,1.1,0.49", "LeftHand@0.5=0,1,5"


def test_pose_meets_a_target(posefield, model_path):
    code, out, err = posefield("pose", model_path, *CONTROLS, "--target", NEAR)
    (met,) = json.loads(out)["trust"]["targets"]
    assert (code, err) == (0, "")
    assert met["what"] == "RightHand at end" and met["reached"] and met["miss"] < 1e-5


def test_clip_says_what_it_misses(posefield, model_path, tmp_path):
    made = tmp_path / "clip.usda"
    words = [*CONTROLS, "--target", FAR, "--json"]
    code, out, err = posefield("clip", model_path, "-o", made, *words)
    (far,) = json.loads(out)["targets"]
    assert (code, far["reached"]) == (0, False)
    said = f"LeftHand at 0.5 s stays {100 * far['miss']:.1f} cm from its target: out of reach"
    assert err == f"warning: {said}\n"
    assert said in made.read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--target", "RightHand"], "target: 'RightHand', expected JOINT@MOMENT:X,Y,Z, m"),
        (
            ["--target", "RightHnd@end=0,1,0"],
            "targets/0/joint: 'RightHnd' (did you mean 'RightHand'?), expected one of Hips",
        ),
        (
            ["-c", "statur=1.7"],
            "controls/statur: no such control (did you mean 'stature'?); this model has stature",
        ),
        (["--exact", ""], "exact: '', expected auto, none or names of controls"),
    ],
)
def test_what_no_motion_can_be_held_to_is_refused(posefield, model_path, words, said):
    code, out, err = posefield("pose", model_path, *CONTROLS, *words)
    assert (code, out) == (2, "") and err.startswith(f"posefield: {said}")


def test_an_export_is_held_row_by_row(posefield, model_path, tmp_path):
    hand = {"joint": "RightHand", "position": [-0.2, 1.1, 0.49], "at": "end"}
    far = {**hand, "position": [0, 1, 5]}
    table, made = tmp_path / "q.jsonl", tmp_path / "made"
    lines = [{**POINT, "targets": [hand]}, POINT, {**POINT, "targets": [far]}]
    table.write_text("".join(json.dumps(line) + "\n" for line in lines))
    words = ("export", model_path, table, "-o", made, "--workers", "1", "--format", "usda")
    code, out, _ = posefield(*words)
    assert code == 0 and "3 clips" in out and "with a warning in the manifest: 1" in out
    listed = [json.loads(line) for line in (made / "manifest.jsonl").read_text().splitlines()]
    assert [[met["reached"] for met in each.get("targets", [])] for each in listed] == [
        [True],
        [],
        [False],
    ]
    code, _, err = posefield(*words, "--exact", "none")
    assert code == 3 and "another" in err
