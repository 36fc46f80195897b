"""Tests of `posefield review`: decisions become files, and what is unknown is refused."""

import json
import shutil

import pytest
import rigid_takes

from posefield_train.families import found_families
from posefield_train.source import recipe


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def statuses(folder):
    facts = json.loads((folder / "discover.json").read_text())
    return {one["number"]: one["status"] for one in facts["families"]}


def middle(folder, number, at=0):
    """A clip of a family as the option --drop names it."""
    row = found_families.read(folder / f"family_{number:02d}.csv")[at]
    seconds = (row.first_frame + row.last_frame) / 2.0 / rigid_takes.RATE
    return f"{number}:{row.file}@{seconds:.2f}"


def test_families_are_accepted_and_rejected(posefield, made):
    code, out, _ = posefield("review", made, "--accept", "1", "--reject", "2")
    assert code == 0 and "family 1: accepted" in out and "family 2: rejected" in out
    assert recipe.read(made / "family_01.toml").accepted
    assert not recipe.read(made / "family_02.toml").accepted
    assert (statuses(made)[1], statuses(made)[2]) == ("accepted", "rejected")
    assert posefield("review", made, "--reject", "1")[0] == 0
    assert not recipe.read(made / "family_01.toml").accepted


def test_a_dropped_clip_is_no_longer_trained_from(posefield, made):
    assert posefield("review", made, "--drop", middle(made, 1, 2))[0] == 0
    rows = found_families.read(made / "family_01.csv")
    assert [at for at, row in enumerate(rows) if not row.accepted] == [2]
    assert (made / "family_01.toml").read_text().count("accepted = false") == 1


def test_merged_families_are_one_with_proposals_of_its_own(posefield, made):
    before = {n: found_families.read(made / f"family_0{n}.csv") for n in (1, 2)}
    text = (made / "family_01.toml").read_text().replace("rms_budget_cm = 1.0", "rms_budget_cm = 2")
    (made / "family_01.toml").write_text(text)
    assert posefield("review", made, "--merge", "1,2", "--accept", "1")[0] == 0
    assert found_families.read(made / "family_01.csv") == before[1] + before[2]
    assert not (made / "family_02.toml").exists() and not (made / "family_02.csv").exists()
    own = recipe.read(made / "family_01.toml")
    facts = json.loads((made / "discover.json").read_text())
    first, second = facts["families"][:2]
    assert first["clips"] == len(before[1]) + len(before[2])
    assert (second["status"], second["into"]) == ("merged", 1)
    assert [one.name for one in own.controls] == first["controls"]
    # The evidence is that of all clips, and that of the other family is kept.
    whole = (made / "family_01.toml").read_text()
    said = f"# {first['clips']} clips of 2 performers, {first['seconds']:.1f} s long in the median."
    assert whole.count(" clips of ") == 1 and said in whole
    within = f"which differ by {second['within']:.1%} of all motion"
    assert f"# Family 2 was merged into it: {len(before[2])} clips, {within}" in whole
    # What a person wrote into the recipe stays.
    assert own.accepted and own.size.rms_budget_cm == 2


@pytest.mark.parametrize("first", [("--merge", "1,2"), ("--reject", "2")])
def test_the_same_decisions_again_change_nothing(posefield, made, first):
    words = ("review", made, *first, "--accept", "1", "--drop", middle(made, 1))
    words = (*words, "--drop", middle(made, 2)) if first[0] == "--merge" else words
    assert posefield(*words)[0] == 0
    once = content(made)
    assert posefield(*words)[0] == 0
    assert content(made) == once


def test_a_file_of_decisions_is_the_same_as_options(posefield, made, tmp_path):
    other = shutil.copytree(made, tmp_path / "other")
    clip = middle(made, 1, 1)
    wanted = {"accept": [1], "reject": [], "merge": [[1, 2]], "drop": [clip]}
    (tmp_path / "decisions.json").write_text(json.dumps(wanted))
    assert posefield("review", made, "--decisions", tmp_path / "decisions.json")[0] == 0
    words = ("--accept", "1", "--merge", "1,2", "--drop", clip)
    assert posefield("review", other, *words)[0] == 0
    assert content(made) == content(other)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "expected either --decisions FILE or other decisions"),
        (("--accept", "77"), "family 77, expected one of 1, 2"),
        (("--accept", "1", "--reject", "1"), "1 is accepted too, expected one of both"),
        (("--merge", "1,2", "--accept", "2"), "2 goes into 1, expected no other decision on it"),
        (("--drop", "1:ann_0.bvh@999"), "no clip at 1:ann_0.bvh@999, expected one of"),
    ],
)
def test_what_the_folder_does_not_have_is_refused(posefield, made, words, said):
    before = content(made)
    code, _, err = posefield("review", made, *words)
    assert code == 2 and said in err
    assert content(made) == before


def test_a_family_that_was_merged_is_named(posefield, made):
    assert posefield("review", made, "--merge", "1,2")[0] == 0
    code, _, err = posefield("review", made, "--accept", "2")
    assert code == 2 and "family 2, which was merged into 1, expected one of 1" in err


@pytest.mark.parametrize(
    ("text", "said"), [("{", "not JSON"), ('{"accept": 3}', "expected a list for each decision")]
)
def test_a_file_that_is_no_decisions_is_refused(posefield, made, tmp_path, text, said):
    (tmp_path / "d.json").write_text(text)
    code, _, err = posefield("review", made, "--decisions", tmp_path / "d.json")
    assert code == 3 and said in err


def test_a_folder_of_other_files_is_refused(posefield, recordings, made):
    code, _, err = posefield("review", recordings, "--accept", "1")
    assert code == 3 and "no discover.json, expected a folder that posefield discover wrote" in err
    (made / "discover.json").write_text('{"families": [{}]}')
    code, _, err = posefield("review", made, "--accept", "1")
    assert code == 3 and "not a summary of posefield discover" in err
