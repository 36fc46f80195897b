"""Tests of the command line: clips, performances and exports for the character of another file."""

import json

import numpy as np
import pytest
from user_rigs import glb_positions, glb_rig, stage_positions, usd_rig

from posefield.retarget.retargeting import retarget
from posefield.rigs.rig import read_rig

WALK = ("-c", "speed=1.3", "--fps", "15")
SCRIPT = {"segments": [{"kind": "walk", "model": "cmu_walk", "seconds": 1.5}], "fps": 15}


@pytest.fixture(scope="module")
def shipped_path(shipped_walk):
    from posefield.registry import model_registry

    return model_registry.SHIPPED_FOLDER / "cmu_walk.onnx"


@pytest.fixture(scope="module")
def rigs(shipped_walk, tmp_path_factory):
    folder = tmp_path_factory.mktemp("characters")
    usd_rig(folder / "hero.usdc", shipped_walk.session.card)
    glb_rig(folder / "small.glb", shipped_walk.session.card)
    return folder


def test_a_clip_moves_the_character_of_a_usd_file(posefield, shipped_path, rigs, tmp_path):
    made = tmp_path / "walk.usdc"
    words = ("clip", shipped_path, *WALK, "--character", rigs / "hero.usdc", "-o", made, "--json")
    code, out, err = posefield(*words)
    assert (code, err.count("warning")) == (0, 0), err
    told = json.loads(out)
    facts = told["retargeting"]
    assert (facts["character"], facts["file"]) == ("hero", "hero.usdc")
    assert abs(facts["scale"] - 1.2) < 0.03 and not facts["missing"]
    assert facts["skate"] < 0.05 and "leftFoot" in facts["mapped"]
    first, last = (stage_positions(made, frame) for frame in (0, told["frames"] - 1))
    assert first[1].shape == last[1].shape and len(first[1]) > 100
    travel = np.linalg.norm((last[0] - first[0]).mean(axis=0))
    assert 1.0 < travel < 3.0
    # Negative control: the same file at rest does not travel.
    still = [stage_positions(rigs / "hero.usdc", frame)[0] for frame in (0, 10)]
    assert np.array_equal(*still)


def test_the_file_shows_the_retargeted_motion(
    posefield, shipped_path, rigs, tmp_path, shipped_walk
):
    from posefield.characters import delivery, user_character
    from posefield.encode.formats import CLIP_ENCODERS
    from posefield.question.motion_question import FileQuestion
    from posefield.synthesis import clips

    made = tmp_path / "walk.usda"
    assert (
        posefield("clip", shipped_path, *WALK, "--character", rigs / "hero.usdc", "-o", made)[0]
        == 0
    )
    question = FileQuestion(controls={"speed": 1.3}, fps=15.0)
    answer = clips.synthesize_clip(shipped_walk, question)
    character = user_character.open_character(rigs / "hero.usdc", "./hero.usdc")
    order = delivery.deliver(character, CLIP_ENCODERS["usda"], question)
    expected = order.clip(answer, question, shipped_walk.session.card.roles).clip.positions()
    plain, _ = retarget(answer.clip, read_rig(rigs / "hero.usdc"), shipped_walk.session.card.roles)
    assert np.abs(expected - plain.positions()).max() < 0.2
    for frame in (0, 5, 11):
        assert np.abs(stage_positions(made, frame)[0] - expected[frame]).max() < 2e-5


def test_a_clip_animates_the_nodes_of_a_glb(posefield, shipped_path, rigs, tmp_path):
    made = tmp_path / "walk.glb"
    words = ("clip", shipped_path, *WALK, "--character", rigs / "small.glb", "-o", made)
    code, _, err = posefield(*words)
    assert code == 0 and "by the names of its joints" in err
    names, first = glb_positions(made.read_bytes(), 0)
    _, last = glb_positions(made.read_bytes(), 10)
    assert "mixamorig:LeftFoot" in names
    height = float(np.ptp(first[:, 1]))
    assert 0.9 < height < 1.5 and np.linalg.norm((last - first).mean(axis=0)) > 0.5


def test_references_are_relative_to_the_output(posefield, shipped_path, rigs):
    made = rigs / "shots" / "one" / "walk.usda"
    made.parent.mkdir(parents=True)
    assert (
        posefield("clip", shipped_path, *WALK, "--character", rigs / "hero.usdc", "-o", made)[0]
        == 0
    )
    assert "@../../hero.usdc@</Character>" in made.read_text()
    assert len(stage_positions(made, 3)[1]) > 100


def test_roles_are_stated_where_names_do_not_tell(posefield, shipped_path, rigs, tmp_path):
    content = (rigs / "small.glb").read_bytes()
    odd = tmp_path / "odd.glb"
    odd.write_bytes(content.replace(b"mixamorig:LeftUpLeg", b"mixamorig:QftQxPzzw"))
    words = ("clip", shipped_path, *WALK, "--character", odd, "-o", tmp_path / "walk.glb")
    code, _, err = posefield(*words)
    assert code != 0 and "leftUpperLeg" in err
    roles = tmp_path / "roles.toml"
    roles.write_text(
        '[roles]\nleftUpperLeg = "mixamorig:QftQxPzzw"\nrightUpperLeg = "mixamorig:RightUpLeg"\n'
    )
    assert posefield(*words, "--roles", roles)[0] == 0
    roles.write_text("[other]\n")
    assert "no table [roles]" in posefield(*words, "--roles", roles)[2]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--character", "gone.glb"], "gone.glb: No such file"),
        (["--character", "rig.fbx"], "rig.fbx: no file of a character, expected one of .usd"),
        (["--roles", "roles.toml"], "roles: roles.toml without --character"),
    ],
)
def test_what_is_no_character_is_refused(posefield, shipped_path, tmp_path, words, said):
    code, _, err = posefield("clip", shipped_path, *WALK, *words, "-o", tmp_path / "walk.glb")
    assert code != 0 and said in err


def test_a_performance_moves_the_character(posefield, rigs, tmp_path):
    script, made = tmp_path / "script.json", tmp_path / "made.usda"
    script.write_text(json.dumps(SCRIPT))
    words = ("perform", script, "--character", rigs / "hero.usdc", "-o", made, "--json")
    code, out, _ = posefield(*words)
    told = json.loads(out)
    assert code == 0 and told["retargeting"]["file"] == "hero.usdc"
    first, last = (stage_positions(made, frame)[0] for frame in (0, told["frames"] - 1))
    assert np.linalg.norm((last - first).mean(axis=0)) > 0.8
    assert "expected 'whole'" in posefield(*words, "--layout", "segments")[2]
    code, _, err = posefield("perform", script, "--plan", "--character", rigs / "hero.usdc")
    assert code == 2 and "character: given with --plan" in err


def test_many_performances_move_the_character(posefield, rigs, tmp_path):
    scripts, made = tmp_path / "scripts.jsonl", tmp_path / "made"
    scripts.write_text("".join(json.dumps(SCRIPT | {"name": own}) + "\n" for own in ("a", "b")))
    words = ("perform", scripts, "--workers", "1", "--format", "usda", "-o", made)
    code, _, err = posefield(*words, "--character", rigs / "hero.usdc")
    assert code == 0, err
    lines = [json.loads(own) for own in (made / "manifest.jsonl").read_text().splitlines()]
    assert [own["retargeting"]["character"] for own in lines] == ["hero", "hero"]
    assert len(stage_positions(made / "performances" / "a.usda", 3)[1]) > 100
    # Another character is another job: the files are made again.
    assert posefield(*words, "--character", rigs / "small.glb")[0] == 0
    text = (made / "performances" / "a.usda").read_text()
    assert "references" not in text and "small.glb" in text


def test_crowds_have_no_character(posefield, rigs, tmp_path):
    scripts = tmp_path / "scripts.jsonl"
    scripts.write_text(json.dumps(SCRIPT | {"name": "a"}) + "\n")
    words = ("perform", scripts, "--crowd", "-o", tmp_path / "crowd.usdc")
    code, _, err = posefield(*words, "--character", rigs / "hero.usdc")
    assert code == 2 and "character: given with --crowd" in err
