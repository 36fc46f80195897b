"""Tests of recipes of found families: what they say, who performs, and what is refused."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import rigid_takes

from posefield.common.errors import RecipeError
from posefield.motion import bvh_writer
from posefield_train.families import found_families, recipe_folder
from posefield_train.source import clip_table, ingest, recipe

LICENCE = ("--licence", "CC BY 4.0, by us")
FEW = ("--candidates", "60")


def test_families_become_recipes_that_train_reads(made, recordings):
    facts = json.loads((made / "discover.json").read_text())
    assert len(facts["families"]) >= 2 and set(facts["recordings"]) == {
        p.name for p in recordings.iterdir()
    }
    for one in facts["families"]:
        own = recipe.read(made / f"family_{one['number']:02d}.toml")
        assert not own.accepted and own.licence == LICENCE[1] and own.source.up == "y"
        assert own.source.metres_per_unit == 0.01 and own.roles["rightHand"] == "RightHand"
        assert one["clips"] == len(clip_table.read(own, recordings))
        assert [control.name for control in own.controls] == one["controls"]
        assert {row.performer for row in clip_table.read(own, recordings)} <= {"ann", "bob"}
    first = recipe.read(made / "family_01.toml")
    examples, _ = ingest.ingest(first, recordings)
    assert first.event.joint == "RightHand" and first.controls[0].auto.joint == "RightHand"
    assert np.ptp([one.controls for one in examples], axis=0).min() > 0.01


def test_the_same_takes_give_the_same_bytes(posefield, made, recordings):
    words = ("discover", recordings, "-o", made, *LICENCE, *FEW)
    code, _, err = posefield(*words)
    assert code == 3 and "exists already, and is not overwritten: say --overwrite" in err
    assert posefield(*words, "--overwrite")[0] == 0
    before = {path.name: path.read_bytes() for path in made.iterdir()}
    (made / "family_77.toml").write_text("left over")
    (made / "notes.txt").write_text("mine")
    assert posefield(*words, "--overwrite")[0] == 0
    after = {path.name: path.read_bytes() for path in made.iterdir()}
    assert after == before | {"notes.txt": b"mine"}


def test_a_recipe_without_licence_is_refused_by_its_reader(posefield, recordings, tmp_path):
    out = tmp_path / "recipes"
    assert posefield("discover", recordings, "-o", out, *FEW)[0] == 0
    assert "# TODO licence" in (out / "family_01.toml").read_text()
    with pytest.raises(RecipeError, match="licence"):
        recipe.read(out / "family_01.toml")


@pytest.mark.parametrize("command", ["train", "evaluate"])
def test_no_model_is_made_of_a_recipe_that_nobody_accepted(posefield, made, recordings, command):
    words = ("-o", made / "x.onnx") if command == "train" else ()
    code, _, err = posefield(command, made / "family_01.toml", "--data", recordings, *words)
    assert code == 3 and "accepted = false: look at its clips, then accept it with" in err
    assert f"posefield review {made} --accept NUMBER" in err
    text = (made / "family_01.toml").read_text()
    (made / "family_01.toml").write_text(recipe_folder.with_accepted(text, True))
    assert recipe.read_accepted(made / "family_01.toml").accepted


def with_a_hat(recordings, folder, head="Head"):
    """Return a folder of the takes and of one more, of a performer with one joint more."""
    shutil.copytree(recordings, folder)
    hat = rigid_takes.clip("FSSFFS", 9, extra=True)
    names = tuple(head if name == "Head" else name for name in hat.skeleton.names)
    hat = replace(hat, skeleton=replace(hat.skeleton, names=names))
    (folder / "cid_9.bvh").write_bytes(bvh_writer.dumps(hat, metres_per_unit=0.01))
    return folder


def test_clips_without_the_roles_of_the_others_are_named_and_left_out(
    posefield, recordings, tmp_path
):
    folder = with_a_hat(recordings, tmp_path / "recordings", head="Top")
    assert posefield("discover", folder, "-o", tmp_path / "recipes", *LICENCE, *FEW)[0] == 0
    facts = json.loads((tmp_path / "recipes/discover.json").read_text())
    left_out = {name: why for one in facts["families"] for name, why in one["left_out"].items()}
    assert left_out and set(left_out.values()) == {"other joints than most clips"}
    assert all(name.startswith("cid_9.bvh@") for name in left_out)
    tables = "".join(path.read_text() for path in (tmp_path / "recipes").glob("*.csv"))
    assert "cid_9" not in tables and facts["recordings"]["cid_9.bvh"]["performer"] == "performer_1"


def test_clips_of_several_skeletons_get_a_recipe_with_one_topology(posefield, recordings, tmp_path):
    folder, out = with_a_hat(recordings, tmp_path / "recordings"), tmp_path / "recipes"
    words = ("discover", folder, "-o", out, *LICENCE, *FEW)
    assert posefield(*words)[0] == 0
    facts = json.loads((out / "discover.json").read_text())
    assert not any(one["left_out"] for one in facts["families"])
    mixed = [one for one in facts["families"] if "cid_9" in table_of(out, one)]
    assert mixed and all(one["roles"]["rightHand"] == "rightHand" for one in mixed)
    for one in mixed:
        text = (out / f"family_{one['number']:02d}.toml").read_text()
        assert "# The files have 2 kinds of skeletons, of 17, 18 joints: clips get the" in text
        own = recipe.read(out / f"family_{one['number']:02d}.toml")
        assert own.skeleton.is_unified and not own.roles
        assert own.motion.feet == ["leftToes", "rightToes"]
        examples, notes = ingest.ingest(own, folder)
        assert {"cid_9.bvh"} < {example.row.file.name for example in examples}
        assert any("18 joints became 17 by their roles, without Hat;" in note for note in notes)


def table_of(folder, family):
    return (folder / f"family_{family['number']:02d}.csv").read_text()


def test_performers_are_told_by_bones_and_named_by_files():
    one, other = np.array([0.4, 0.3]), np.array([0.4, 0.3008])
    files = ["day/ann_1.bvh", "day/bob_1.bvh", "day/ann_2.bvh"]
    assert found_families.name_performers(files, [one, other, one + 0.0004]) == [
        "ann",
        "bob",
        "ann",
    ]
    # Within the tolerance all are one, whom no word tells from others.
    assert set(found_families.name_performers(files, [one, one, one])) == {"performer_1"}
    # A name on files of two bodies tells neither of them.
    mixed = ["ann_1.bvh", "ann_2.bvh", "bob_1.bvh"]
    assert found_families.name_performers(mixed, [one, other, one]) == [
        "performer_1",
        "performer_2",
        "performer_1",
    ]
