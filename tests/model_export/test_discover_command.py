"""Tests of `posefield discover`: tables for recipes, what is refused, and reruns."""

import csv
import json

import discover_takes
import numpy as np
import pytest
from minimal import plain_recipe

from posefield.common.errors import RecipeError
from posefield.motion import bvh_writer
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source import clip_table
from posefield_train.source.recipe import Recipe

WALK = {"speed": 1.0, "swing": 0.6, "period": 1.2}
NAMES = {
    "hips": "Hips",
    "neck": "Neck",
    "head": "Head",
    **{
        side + role: side.title() + name
        for side in ("left", "right")
        for role, name in (
            ("UpperLeg", "UpLeg"),
            ("LowerLeg", "Leg"),
            ("Foot", "Foot"),
            ("Toes", "ToeBase"),
            ("UpperArm", "Arm"),
            ("LowerArm", "ForeArm"),
            ("Hand", "Hand"),
        )
    },
}
PARENTS = {"neck": "hips", "head": "neck"} | {
    side + role: side + parent if parent not in ("hips", "neck") else parent
    for side in ("left", "right")
    for role, parent in (
        ("UpperLeg", "hips"),
        ("LowerLeg", "UpperLeg"),
        ("Foot", "LowerLeg"),
        ("Toes", "Foot"),
        ("UpperArm", "neck"),
        ("LowerArm", "UpperArm"),
        ("Hand", "LowerArm"),
    )
}


def clip_of(recording):
    """A clip whose joints move by translation alone, so that their places are the recording's."""
    roles = list(recording.places)
    order = ["hips", *(role for role in roles if role != "hips")]
    parents = (-1, *(order.index(PARENTS[role]) for role in order[1:]))
    places = np.stack([recording.places[role] for role in order], axis=1)
    local = places.copy()
    local[:, 1:] -= places[:, parents[1:]]
    tips = tuple(sorted(set(range(len(order))) - set(parents)))
    joints = Skeleton(
        tuple(NAMES[role] for role in order), parents, local[0], tips, np.full((len(tips), 3), 0.01)
    )
    turns = np.zeros((len(places), len(order), 4))
    turns[..., 0] = 1.0
    return Clip(joints, turns, local, recording.rate)


def write(path, recording):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(bvh_writer.dumps(clip_of(recording), metres_per_unit=1.0))


@pytest.fixture
def folder(tmp_path):
    """A folder of two recordings, one of them in a subfolder, and a broken file."""
    write(tmp_path / "recordings/a.bvh", discover_takes.recording("a", 6.0, **WALK))
    write(
        tmp_path / "recordings/day2/b.bvh", discover_takes.recording("b", 4.0, heading=1.0, **WALK)
    )
    (tmp_path / "recordings/broken.bvh").write_text("HIERARCHY\nROOT a {")
    return tmp_path / "recordings"


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_strides_of_a_folder_become_a_table(posefield, folder):
    code, out, err = posefield("discover", folder, "--strides", "-o", folder / "strides.csv")
    assert code == 0 and "5 clips (strides) of 2 recordings" in out
    assert "left out: broken.bvh: " in err
    found = rows(folder / "strides.csv")
    assert [(row["file"], row["first_frame"], row["last_frame"]) for row in found] == [
        *(("a.bvh", str(at), str(at + 72)) for at in (72, 144, 216)),
        *(("day2/b.bvh", str(at), str(at + 72)) for at in (72, 144)),
    ]
    assert {(row["name"], row["seconds"], row["accepted"]) for row in found} == {
        ("stride", "1.200", "false")
    }


def test_the_same_takes_give_the_same_bytes(posefield, folder):
    words = ("--like", "a.bvh:1.2-2.4", "--name", "step")
    for name in ("one.csv", "two.csv"):
        assert posefield("discover", folder, *words, "-o", folder / name)[0] == 0
    assert (folder / "one.csv").read_bytes() == (folder / "two.csv").read_bytes()


def test_the_example_comes_first_and_is_accepted(posefield, folder):
    words = ("--like", "a.bvh:1.2-2.4", "--name", "step", "--most", "3", "--json")
    code, out, _ = posefield("discover", folder, *words, "-o", folder / "step.csv")
    facts = json.loads(out)
    assert code == 0 and (facts["clips"], facts["recordings"]) == (4, 2)
    assert list(facts["refused"]) == ["broken.bvh"]
    found = rows(folder / "step.csv")
    assert [row["accepted"] for row in found] == ["true", "false", "false", "false"]
    assert (found[0]["file"], found[0]["first_frame"], found[0]["last_frame"]) == (
        "a.bvh",
        "72",
        "144",
    )
    costs = [float(row["cost"]) for row in found]
    assert costs == sorted(costs) and {row["name"] for row in found} == {"step"}
    # A step of the same walk lies a whole number of strides from the example.
    assert int(found[1]["last_frame"]) % 72 in (*range(7), *range(66, 72))


def test_a_recipe_takes_the_rows_that_a_person_accepted(posefield, folder):
    table = folder / "strides.csv"
    posefield("discover", folder, "--strides", "-o", table)
    columns = {name: name for name in ("file", "first_frame", "last_frame")}
    accepted = {"accepted": {"among": ["true"]}}
    plain = plain_recipe()
    plain["clips"] = {"table": "strides.csv", **columns, "where": accepted}
    plain["controls"][0]["column"] = "seconds"
    own = Recipe.model_validate(plain)
    with pytest.raises(RecipeError, match="none of 5 rows meets the conditions"):
        clip_table.read(own, folder)
    lines = table.read_text().splitlines()
    lines[2] = lines[2].replace("false", "true")
    table.write_text("\n".join(lines) + "\n")
    (row,) = clip_table.read(own, folder)
    assert (row.first_frame, row.last_frame) == (144, 216)


def test_takes_are_compared_in_the_roles_of_all_and_the_others_are_told(posefield, folder):
    path = folder / "a.bvh"
    path.write_text(path.read_text().replace("Hand", "Hook"))
    words = ("--like", "a.bvh:1.2-2.4", "-o", folder / "x.csv")
    _, _, err = posefield("discover", folder, *words)
    assert "not compared, because some recordings have none: leftHand, rightHand" in err
    assert json.loads(posefield("discover", folder, *words, "--json")[1])["not_compared"] == [
        "leftHand",
        "rightHand",
    ]
    (folder / "a.bvh").write_text(path.read_text().replace("Hook", "Hand"))
    assert "not compared" not in posefield("discover", folder, *words)[2]


def test_reviewed_rows_are_the_examples_of_the_next_round(posefield, folder):
    one, two = folder / "one.csv", folder / "two.csv"
    posefield("discover", folder, "--like", "a.bvh:1.2-2.4", "-o", one)
    lines = one.read_text().splitlines()
    lines[2] = lines[2].replace("false", "true")
    lines[3] = lines[3].replace("false", "rejected")
    one.write_text("\n".join(lines) + "\n")
    assert posefield("discover", folder, "--like", one, "-o", two)[0] == 0
    before, after = rows(one), rows(two)
    frames = [[(row["file"], row["first_frame"]) for row in each] for each in (before, after)]
    assert frames[1][:2] == frames[0][:2] and frames[1][-1] == frames[0][2]
    assert frames[0][2] not in frames[1][:-1]
    verdicts = [row["accepted"] for row in after]
    assert verdicts == ["true", "true", *["false"] * (len(after) - 3), "rejected"]


@pytest.mark.parametrize(
    ("verdict", "code", "said"),
    [
        ("false", 2, "no row is accepted, expected one or more"),
        ("maybe", 3, "accepted 'maybe', expected one of true, rejected, false"),
    ],
)
def test_a_table_without_examples_is_refused(posefield, folder, verdict, code, said):
    table = folder / "one.csv"
    posefield("discover", folder, "--like", "a.bvh:1.2-2.4", "-o", table)
    table.write_text(table.read_text().replace("true", verdict))
    found, _, err = posefield("discover", folder, "--like", table, "-o", folder / "two.csv")
    assert found == code and said in err


def test_takes_without_motion_are_refused(posefield, tmp_path):
    write(tmp_path / "a.bvh", discover_takes.recording("a", 6.0))
    words = ("--like", "a.bvh:1.2-2.4", "-o", tmp_path / "x.csv")
    code, _, err = posefield("discover", tmp_path, *words)
    assert code == 2 and "nothing moves in the recordings" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--strides", "--like", "a.bvh:1-2"), "expected either --strides or --like"),
        (
            ("--like", "c.bvh:1-2"),
            "file 'c.bvh', expected a recording of the folder, such as a.bvh",
        ),
        (("--like", "a.bvh:5-7"), "5 to 7 s, expected 0.6 s or more between 0 and 6.00 s"),
    ],
)
def test_searches_that_are_none_are_refused(posefield, folder, words, said):
    code, out, err = posefield("discover", folder, *words, "-o", folder / "x.csv")
    assert (code, out) == (2, "") and said in err
    assert not (folder / "x.csv").exists()


@pytest.fixture
def odd(tmp_path):
    """A folder with a recording whose hips and feet have names that no tool gives."""
    path = tmp_path / "a.bvh"
    write(path, discover_takes.recording("a", 6.0, **WALK))
    text = path.read_text().replace("LeftFoot", "LeftHoof").replace("RightFoot", "RightHoof")
    path.write_text(text)
    return tmp_path


def test_roles_that_names_do_not_tell_are_asked_and_can_be_stated(posefield, odd):
    words = ("--strides", "-o", odd / "x.csv")
    code, _, err = posefield("discover", odd, *words)
    assert code == 3 and "no joint for leftFoot, rightFoot" in err
    (odd / "roles.toml").write_text('[roles]\nleftFoot = "LeftHoof"\nrightFoot = "RightHoof"\n')
    code, out, _ = posefield("discover", odd, *words, "--roles", odd / "roles.toml")
    assert code == 0 and "of 1 recordings" in out and len(rows(odd / "x.csv")) >= 3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[roles]\nleftFoot = 3", "no table [roles] of joints by role"),
        ('[roles]\nleftPaw = "a"', "unknown roles ['leftPaw'], expected some of hips, spine"),
    ],
)
def test_roles_that_cannot_be_are_refused(posefield, odd, text, said):
    (odd / "roles.toml").write_text(text)
    words = ("--strides", "-o", odd / "x.csv", "--roles", odd / "roles.toml")
    code, _, err = posefield("discover", odd, *words)
    assert code == 3 and said in err
