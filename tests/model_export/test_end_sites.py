"""Tests of end sites as joints: of feet, events, controls, weights and targets."""

import json

import numpy as np
import pytest
from minimal import SKELETON, TOML, recipe_with, small_clip, write_clips

from posefield.common.errors import RecipeError
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield_train.source import bvh, clip_joints, ingest

CLIP = small_clip()
# A file keeps a millionth of a metre and of a degree.
WRITTEN = 1e-5
# A model of eight clips keeps few ways to move: a target is met within this distance, m.
MET = 1e-2


def tips(clip):
    """Positions (F, E, 3) of the end sites, from positions and orientations of their joints."""
    joints = clip.skeleton
    turns = clip.rotations.copy()
    for joint, parent in enumerate(joints.parents):
        if parent >= 0:
            turns[:, joint] = quat.mul(turns[:, parent], clip.rotations[:, joint])
    own = list(joints.tip_joints)
    return clip.positions()[:, own] + quat.rotate(turns[:, own], joints.tip_offsets)


def test_an_end_joint_is_where_the_end_site_was_and_changes_nothing_else():
    found = clip_joints.with_end_joints(CLIP, {"LeftHand_end", "Head_end", "Nobody"})
    joints = found.skeleton
    assert joints.names == (
        *("Hips", "Spine", "Head", "Head_end", "LeftArm", "LeftHand", "LeftHand_end"),
    )
    assert joints.tip_joints == ()
    ends = [joints.names.index(name) for name in ("Head_end", "LeftHand_end")]
    assert np.abs(found.positions()[:, ends] - tips(CLIP)).max() < 1e-12
    others = [joints.names.index(name) for name in SKELETON.names]
    assert np.array_equal(found.positions()[:, others], CLIP.positions())
    one = clip_joints.with_end_joints(CLIP, {"Head_end"})
    assert np.abs(tips(one) - tips(CLIP)[:, 1:]).max() < 1e-12
    assert clip_joints.with_end_joints(CLIP, {"Head"}) is CLIP


@pytest.mark.parametrize(
    "sections",
    [
        {"motion": {"feet": ["LeftHand_end"]}},
        {"event": {"joint": "LeftHand_end", "at": "end"}},
        {"roles": {"leftHand": "LeftHand_end"}},
    ],
    ids=["a foot", "an event", "a role"],
)
def test_every_key_that_names_joints_takes_end_sites(tmp_path, sections):
    write_clips(tmp_path, [CLIP, small_clip(0.2)])
    examples, notes = ingest.ingest(recipe_with(**sections), tmp_path)
    assert notes == []
    for example in examples:
        assert example.clip.skeleton.names[-1] == "LeftHand_end"
    assert "Head_end" not in examples[0].clip.skeleton.names


def test_an_end_site_that_is_not_there_is_refused_with_a_similar_name(tmp_path):
    write_clips(tmp_path, [CLIP])
    with pytest.raises(RecipeError) as refused:
        ingest.ingest(recipe_with(motion={"feet": ["LeftHnd_end"]}), tmp_path)
    assert refused.value.message == (
        f"{tmp_path}/0.bvh has no joints 'LeftHnd_end' (did you mean 'LeftHand_end'?) that the "
        "recipe names, expected some of Hips, Spine, Head, LeftArm, LeftHand, Head_end, "
        "LeftHand_end"
    )
    dropped = {"drop_joints": ["LeftArm"], "end_sites": ["LeftHand_end"]}
    with pytest.raises(RecipeError, match=r"joints \['LeftHand_end'\] are dropped, and named"):
        ingest.ingest(recipe_with(motion=dropped), tmp_path)


CONTROL = """\
[[controls]]
name = "reach"
auto = { quantity = "height", joint = "LeftHand_end", at = "end" }
description = "Height of the fingertips"
[motion]
end_sites = ["Head_end"]
feet = ["LeftHand_end"]
"""


def test_an_end_site_goes_through_training_targets_and_files(posefield, tmp_path):
    write_clips(tmp_path, [small_clip(0.1 * i) for i in range(8)])
    text = TOML.replace("[motion]\n", CONTROL)
    event = '[event]\njoint = "LeftHand_end"\nat = "end"\n[size]'
    (tmp_path / "tips.toml").write_text(text.replace("[size]", event))
    model = tmp_path / "tips.onnx"
    assert posefield("train", tmp_path / "tips.toml", "-o", model)[0] == 0
    code, out, _ = posefield("inspect", model, "--json")
    card = json.loads(out)
    names = card["skeleton"]["names"]
    assert code == 0 and {"Head_end", "LeftHand_end"} < set(names)
    end = names.index("LeftHand_end")
    assert (card["event"]["joint"], card["feet"]) == (end, [end])
    assert card["joint_sigma"][end] > card["joint_sigma"][0] > 0.0
    for ending in ("bvh", "glb", "usda", "json"):
        asked = ("-c", "speed=6.2", "-o", tmp_path / f"clip.{ending}")
        assert posefield("clip", model, *asked)[0] == 0
    # The target is where the fingertips of another speed begin; speed is left open.
    wanted = Motion(tmp_path / "clip.bvh").joint("LeftHand_end")[0]
    place = ",".join(map(str, wanted))
    target = ("--target", f"LeftHand_end@start={place}", "-o", tmp_path / "met.bvh")
    code, _, said = posefield("clip", model, *target)
    assert code == 0, said
    met = Motion(tmp_path / "met.bvh")
    assert np.linalg.norm(met.joint("LeftHand_end")[0] - wanted) < MET
    assert posefield("clip", model, "-o", tmp_path / "free.bvh")[0] == 0
    # Negative control: without the target they begin elsewhere.
    free = Motion(tmp_path / "free.bvh")
    assert np.linalg.norm(free.joint("LeftHand_end")[0] - wanted) > 3.0 * MET
    # The end joint is rigid: it stays at its distance from the hand.
    arm = met.joint("LeftHand_end") - met.joint("LeftHand")
    assert np.ptp(np.linalg.norm(arm, axis=-1)) < WRITTEN


class Motion:
    """Joint positions of a written motion file."""

    def __init__(self, path):
        self.clip: Clip = bvh.to_clip(
            bvh.read(path), metres_per_unit=0.01, up="y", root_offset="replace"
        )

    def joint(self, name):
        return self.clip.positions()[:, self.clip.skeleton.names.index(name)]
