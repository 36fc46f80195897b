"""Tests of `probe` and `init`: proposals with evidence, and drafts that train."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rigid_takes

from posefield.common.errors import RecipeError
from posefield.motion import bvh_writer, quat
from posefield.motion.clip import Clip
from posefield_train.probe import probe_report, recipe_draft
from posefield_train.sample import noise_free
from posefield_train.source import bvh, clip_table, recipe

POINT = {"stature": 1.75, "hip_height": 0.94, "turn": 10.0, "target_height": 1.1}
UNITS = {"metres": 1.0, "ASF units": 0.0564444}


@pytest.fixture(scope="module")
def clip():
    """Return a motion of the procedural family at 30 frames a second; it faces +z, with y up."""
    return noise_free.truth_clip(POINT, 30.0)


@pytest.fixture
def written(tmp_path):
    """Function that writes a clip as a BVH file in a unit, and returns the path."""

    def of(clip, name="one.bvh", metres=0.01):
        path = tmp_path / name
        path.write_bytes(bvh_writer.dumps(clip, metres_per_unit=metres))
        return path

    return of


def proposed(path, name):
    return probe_report.probe([path]).proposed[name]


def z_up(clip):
    """The clip with z up: (x, y, z) becomes (x, -z, y)."""

    def turned(vectors):
        return vectors[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])

    rotations = clip.rotations.copy()
    rotations[..., 1:] = turned(rotations[..., 1:])
    bones = replace(
        clip.skeleton,
        offsets=turned(clip.skeleton.offsets),
        tip_offsets=turned(clip.skeleton.tip_offsets),
    )
    return Clip(bones, rotations, turned(clip.translations), clip.rate)


def facing_x(clip):
    """The clip whose root is turned back by a quarter, while its children face as before."""
    back = quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(-0.5 * np.pi))
    rotations, translations = clip.rotations.copy(), clip.translations.copy()
    rotations[:, 0] = quat.mul(rotations[:, 0], back)
    for joint, parent in enumerate(clip.skeleton.parents):
        if parent == 0:
            rotations[:, joint] = quat.mul(quat.conj(back), rotations[:, joint])
            translations[:, joint] = quat.rotate(quat.conj(back), translations[:, joint])
    return replace(clip, rotations=rotations, translations=translations)


@pytest.mark.parametrize("unit", UNITS)
def test_the_unit_follows_from_the_legs(clip, written, unit):
    found = proposed(written(clip, metres=UNITS[unit]), "metres_per_unit")
    assert (found.value, found.confidence) == (pytest.approx(UNITS[unit]), "high")
    assert f"m in {unit}; of an adult about 0.86 m" in found.evidence[0]


def test_an_odd_unit_has_a_low_confidence(clip, written):
    """Negative control: in the nearest unit the legs are 1.3 m long, longer than an adult's."""
    assert proposed(written(clip, metres=0.0065), "metres_per_unit").confidence == "low"


@pytest.mark.parametrize("up", ["y", "z"])
def test_the_up_axis_and_the_facing_follow_from_body_and_floor(clip, written, up):
    path = written(clip if up == "y" else z_up(clip))
    found = proposed(path, "up")
    assert (found.value, found.confidence) == (up, "high")
    assert len(found.evidence) == 3
    assert all(f"+{up}" in said for said in found.evidence)
    facing = proposed(path, "facing")
    assert abs(facing.value) < 10.0 and facing.confidence == "high"


def test_an_axis_that_cannot_be_read_is_not_proposed(clip, written):
    turn = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(-0.5 * np.pi))
    rotations, translations = clip.rotations.copy(), clip.translations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    translations[:, 0] = quat.rotate(turn, translations[:, 0])
    fallen = replace(clip, rotations=rotations, translations=translations)
    found = proposed(written(fallen), "up")
    assert found.value is None
    assert found.evidence[-1] == "the up axis seems to be +x; only +y and +z can be read"


def test_rate_feet_and_licence(clip, written):
    report = probe_report.probe([written(clip)])
    assert (report.proposed["fps"].value, report.proposed["fps"].confidence) == (30.0, "certain")
    feet = report.proposed["feet"]
    assert feet.confidence == "high" and set(feet.value) <= set(report.joints)
    assert [name.startswith(("Left", "Right")) for name in feet.value] == [True, True]
    assert report.proposed["licence"].value is None


def test_files_of_two_rates_are_told(clip, written):
    paths = [written(clip, "a.bvh"), written(clip, "b.bvh"), written(replace(clip, rate=60.0))]
    found = probe_report.probe(paths).proposed["fps"]
    assert (found.value, found.confidence) == (30.0, "medium")
    assert found.evidence[1] == "2 files at 30, 1 files at 60"


def test_a_root_that_faces_elsewhere_is_told(clip, written):
    """Findings: animals that travel along -x had `forward` and `left` swapped without a word."""
    turned = facing_x(clip)
    assert np.abs(turned.positions() - clip.positions()).max() < 1e-9
    report = probe_report.probe([written(turned)])
    found = report.proposed["facing"]
    assert found.value == pytest.approx(90.0, abs=10.0) and found.confidence == "low"
    assert "say motion.facing = 'hips'" in found.evidence[1]
    assert 'facing = "hips"' in recipe_draft.recipe_text(report, "x", None).splitlines()
    straight = probe_report.probe([written(clip)])
    assert 'facing = "hips"' not in recipe_draft.recipe_text(straight, "x", None)


def test_a_root_that_stays_while_its_child_moves_is_told(clip, tmp_path, written):
    text = written(clip).read_text()
    name = re.search(r"ROOT (\S+)", text)[1]
    head, motion = text.split("MOTION")
    lines = motion.strip().splitlines()
    tree = head.replace("HIERARCHY\nROOT", "JOINT").strip()
    extra = "ROOT dummy\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
    head = f"HIERARCHY\n{extra}Yrotation Xrotation\n{tree}\n}}\n"
    rows = [f"0 0 0 0 0 0 {line}" for line in lines[2:]]
    path = tmp_path / "dummy.bvh"
    path.write_text(head + "\n".join(["MOTION", *lines[:2], *rows]) + "\n")
    report = probe_report.probe([path])
    assert report.warnings == (
        f"the root 'dummy' stays in place while {name!r} moves: training takes {name!r} as the "
        "root",
    )
    assert report.proposed["up"].value == "y"
    # Negative control: the file itself is without a warning.
    assert probe_report.probe([written(clip)]).warnings == ()


def test_files_of_other_skeletons_are_told(clip, written):
    names = tuple(name.replace("Hand", "Paw") for name in clip.skeleton.names)
    other = replace(clip, skeleton=replace(clip.skeleton, names=names))
    paths = [written(clip, "a.bvh"), written(clip, "b.bvh"), written(other, "c.bvh")]
    (said,) = probe_report.probe(paths).warnings
    assert said.startswith("1 of 3 files have other joints, such as ") and "LeftPaw" in said


def swapped_sides(text):
    """A BVH file's text with left and right exchanged in the names."""
    return text.replace("Left", "?").replace("Right", "Left").replace("?", "Right")


def test_roles_that_the_body_contradicts_are_asked(posefield, clip, written, tmp_path):
    sure = probe_report.probe([written(clip)])
    assert sure.asked == {} and sure.roles["leftHand"] == "LeftHand"
    path = tmp_path / "swapped.bvh"
    path.write_text(swapped_sides(written(clip).read_text()))
    report = probe_report.probe([path])
    assert "leftFoot" in report.asked and "leftFoot" not in report.roles
    assert report.roles["hips"] == "Hips"
    lines = posefield("probe", path)[1].splitlines()
    reason = "the joints named left lie on the right of the feet"
    assert f"role to confirm: leftFoot = LeftFoot (confidence 0.50: {reason})" in lines
    draft = recipe_draft.recipe_text(report, "x", None).splitlines()
    assert (
        '# leftFoot = "LeftFoot"' in draft
        and f"# TODO confirm (confidence 0.50: {reason})" in draft
    )
    assert 'hips = "Hips"' in draft


# --- the commands ---------------------------------------------------------------------------------


def test_probe_tells_people_and_answers_as_json(posefield, clip, written):
    path = written(clip)
    code, out, err = posefield("probe", path)
    assert (code, err) == (0, "")
    assert out.startswith("1 BVH file, ")
    assert re.search(r"^metres_per_unit 0.01 m \(confidence: high\)$", out, re.MULTILINE)
    assert re.search(r"^licence +unknown \(confidence: none\)$", out, re.MULTILINE)
    said = json.loads(posefield("probe", path, "--json")[1])
    assert said["files"][0]["file"] == str(path)
    assert said["proposed"]["metres_per_unit"]["value"] == 0.01
    assert set(said["proposed"]) == {"metres_per_unit", "up", "fps", "feet", "facing", "licence"}
    assert all(found["evidence"] for found in said["proposed"].values())


@pytest.fixture
def folder(clip, written, tmp_path):
    """Return a folder with two motion files."""
    for name in ("a.bvh", "b.bvh"):
        written(clip, name)
    return tmp_path


def test_init_writes_a_recipe_to_be_completed(posefield, folder):
    code, out, _ = posefield("init", folder)
    assert code == 0 and "TODO" in out
    rows = (folder / "clips.csv").read_text().splitlines()
    last = len(bvh.read(folder / "a.bvh").values) - 1
    assert rows == ["file,first_frame,last_frame", f"a.bvh,0,{last}", f"b.bvh,0,{last}"]
    # As it is, it names what is missing; completed by its own comments, it is a recipe.
    path = folder / "recipe.toml"
    with pytest.raises(RecipeError) as caught:
        recipe.read(path)
    assert [line.split(": ")[1] for line in str(caught.value).splitlines()] == [
        "licence",
        "controls",
    ]
    own = recipe.read(completed(path))
    assert (own.source.metres_per_unit, own.source.up) == (0.01, "y")
    assert own.clips.landmarks == ["contact_frame"] and own.event.at == "end"
    assert own.controls[0].name == "righthand_height" and own.controls[1].column == "COLUMN"
    assert own.motion.feet and own.roles["hips"] == "Hips"


def completed(path):
    """Return the path of a draft with its comments of TOML taken as they are."""
    text = path.read_text().replace('licence = ""', 'licence = "CC0-1.0"')
    keys = r"\[\[?[a-z]+\]\]?$|(name|auto|description|column|unit|landmarks|joint|at) = "
    path.write_text(re.sub(rf"(?m)^# (?={keys})", "", text))
    return path


def test_init_overwrites_nothing(posefield, folder):
    assert posefield("init", folder)[0] == 0
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    code, _, err = posefield("init", folder)
    assert code == 3 and "recipe.toml: exists already, and is not overwritten" in err
    (folder / "recipe.toml").unlink()
    code, _, err = posefield("init", folder)
    assert code == 3 and "clips.csv: exists already, and is not overwritten: name it with" in err
    assert {p.name: p.read_bytes() for p in folder.iterdir()}.items() <= before.items()


def test_init_takes_a_table_that_is_there(posefield, folder):
    table = folder / "mine.csv"
    table.write_text("path,who,kick_frame,frames,speed\na.bvh,kim,3,9,1.5\nb.bvh,bo,4,8,2.5\n")
    code, out, _ = posefield("init", folder, "--table", "mine.csv", "--json")
    assert code == 0 and json.loads(out)["written"] == [str(folder / "recipe.toml")]
    assert not (folder / "clips.csv").exists()
    text = (folder / "recipe.toml").read_text()
    assert "# Columns of numbers: frames, speed." in text
    own = recipe.read(completed(folder / "recipe.toml"))
    assert (own.clips.table, own.clips.file, own.clips.performer) == ("mine.csv", "path", "who")
    assert own.clips.landmarks == ["kick_frame"] and own.event.at == "kick_frame"


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["{}/none"], 3, "not a folder, expected one with motion files"),
        (["{}"], 2, "has no motion files, expected one or more"),
        (["{}", "--table", "none.csv"], 3, "none.csv: cannot be read"),
    ],
)
def test_what_init_cannot_use_is_refused(posefield, tmp_path, words, code, said):
    found, out, err = posefield("init", *(word.format(tmp_path) for word in words))
    assert (found, out) == (code, "") and said in err
    assert list(tmp_path.iterdir()) == []


GUIDE = Path(__file__).parents[2] / "docs/guide/landmarks.md"


def test_the_example_of_landmarks_is_a_recipe_and_a_table(tmp_path, clip, written):
    """The guide's recipe, with the parts that it leaves out, and its table are read as they are."""
    blocks = dict(re.findall(r"```(\w+)\n(.*?)```", GUIDE.read_text(), re.DOTALL))
    text = (
        'schema = 1\nname = "kick"\ndescription = "d"\nlicence = "l"\n'
        '[source]\nmetres_per_unit = 0.01\nup = "y"\n'
        f"{blocks['toml']}"
        '[motion]\nframes = 20\ncyclic = false\nroot = "travelling"\n[size]\nrms_budget_cm = 1.0\n'
    )
    path = tmp_path / "recipe.toml"
    path.write_text(text)
    own = recipe.read(path)
    assert own.event.at == own.controls[0].auto.at == own.clips.landmarks[0] == "kick_frame"
    (tmp_path / "clips.csv").write_text(blocks["csv"])
    (tmp_path / "bvh").mkdir()
    for name in re.findall(r"bvh/\S+\.bvh", blocks["csv"]):
        written(clip, name)
    assert [row.landmarks for row in clip_table.read(own, tmp_path)] == [(84,), (113,), (76,)]


def test_init_proposes_the_controls_of_clips_of_a_body(posefield, tmp_path):
    """Raises of the right arm to six heights: the draft trains once its licence is stated."""
    for seed in range(6):
        recording = rigid_takes.clip("F", seed)
        raised = replace(
            recording,
            rotations=recording.rotations[:110],
            translations=recording.translations[:110],
        )
        (tmp_path / f"{seed}.bvh").write_bytes(bvh_writer.dumps(raised, metres_per_unit=0.01))
    code, out, err = posefield("init", tmp_path)
    assert code == 0 and "complete the licence (TODO)" in out and "discover" not in err
    path = tmp_path / "recipe.toml"
    path.write_text(path.read_text().replace('licence = ""', 'licence = "CC0-1.0"'))
    names = [control.name for control in recipe.read(path).controls]
    assert any(name.startswith("right_hand") for name in names)
    assert posefield("train", path, "-o", tmp_path / "m.onnx")[0] == 0


def test_init_of_long_takes_names_the_search_for_clips(posefield, tmp_path):
    rigid_takes.write_takes(tmp_path)
    code, _, err = posefield("init", tmp_path)
    assert code == 0 and f"posefield discover {tmp_path} finds clips in long recordings" in err
