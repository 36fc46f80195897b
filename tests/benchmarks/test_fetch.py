"""Tests of benchmarks/fetch.py with files of HDM05, and with Acclaim files made of CMU's walks."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from acclaim_files import ARM_AMC, ARM_ASF, files_of
from fetch import main
from recipe_data import cmu_trials, data_sets

from posefield_train.source import bvh, data_folder, ingest, recipe

UNIT = cmu_trials.METRES_PER_UNIT
# Given files are written to four decimals of the unit: 5.3e-6 m was measured.
WRITTEN = 1e-5
WALK, TURN = "bvh/p07_walking_4_tr.bvh", "bvh/puA_walking_22_tr.bvh"


@pytest.fixture(scope="module")
def downloaded(real_data, tmp_path_factory):
    """A folder with two performers' skeletons and three clips of HDM05, as unpacked."""
    folder = tmp_path_factory.mktemp("HDM05_cut_amc")
    for name in ("HDM_bd.asf", "HDM_bd_grabHighR_001_120.amc", "HDM_bd_grabHighR_002_120.amc"):
        copy_reach(real_data, name, folder / "grabHighR")
    for name in ("HDM_tr.asf", "HDM_tr_depositFloorR_029_120.amc"):
        copy_reach(real_data, name, folder / "depositFloorR")
    return folder


def copy_reach(real_data, name, folder):
    folder.mkdir(exist_ok=True)
    with data_folder.find(real_data, f"hdm05_reach/asf_amc/{name}").open("rb") as file:
        (folder / name).write_bytes(file.read())


def clip_of(place):
    return bvh.to_clip(bvh.read(place), metres_per_unit=UNIT, up="y", root_offset="replace")


@pytest.fixture
def fetch(capsys, tmp_path):
    """Function that fetches into tmp_path/data; gives code, output, errors."""

    def run(name, source):
        code = main([name, str(source), str(tmp_path / "data")])
        return code, *capsys.readouterr()

    return run


def assert_same_motion(ours, theirs):
    a, b = clip_of(ours), clip_of(theirs)
    assert a.skeleton.same_tree(b.skeleton)
    assert (len(a), a.rate) == (len(b), b.rate)
    assert np.abs(a.positions() - b.positions()).max() < WRITTEN
    assert np.abs(a.positions()[1:] - b.positions()[:-1]).max() > 10 * WRITTEN, "negative control"


def test_reaches_are_converted_with_their_rows_and_hashes(fetch, downloaded, real_data, tmp_path):
    code, _, err = fetch("hdm05", downloaded)
    assert code == 0, err
    assert [line.partition(": ")[0] for line in err.splitlines()] == ["missing"] * 58
    place = tmp_path / "data/hdm05_reach"
    facts = json.loads((place / "fetched.json").read_text())
    assert len(facts["missing"]) == 58 and len(facts["files"]) == facts["rows"] == 3
    known = data_sets.HDM05.hashes()
    for one in facts["files"]:
        assert one["remark"] == ""
        assert one["sha256"] == known[one["file"]]
        assert one["sha256"] == data_sets.sha256((place / one["file"]).read_bytes())
        assert all(own["sha256"] == known[own["file"]] for own in one["sources"])
        given = data_folder.find(real_data, f"hdm05_reach/{one['file']}")
        assert_same_motion(place / one["file"], given)
    own = recipe.read(data_folder.RECIPES / "hdm05_grab_high.toml")
    made, notes = ingest.ingest(own, tmp_path / "data")
    given, _ = ingest.ingest(own, real_data)
    by_file = {example.row.file.name: example for example in given}
    assert len(made) == 2 and not any("the one that ships" in note for note in notes)
    for example in made:
        expected = by_file[example.row.file.name].controls
        assert np.abs(example.controls - expected).max() < WRITTEN


def test_another_cut_and_two_files_of_one_name_are_refused(fetch, downloaded, tmp_path):
    source = tmp_path / "own"
    for path in downloaded.rglob("HDM_bd*"):
        source.mkdir(exist_ok=True)
        (source / path.name).write_bytes(path.read_bytes())
    path = source / "HDM_bd_grabHighR_001_120.amc"
    whole = path.read_bytes()
    path.write_bytes(whole[: whole.rindex(b"\n253")] + b"\n")
    code, out, err = fetch("hdm05", source)
    assert (code, out) == (3, "")
    assert re.search(r"001_120\.amc: found 252 frames, expected 253 as in the table", err)
    path.write_bytes(whole)
    (source / "again").mkdir()
    (source / "again/HDM_bd.asf").write_text(ARM_ASF)
    code, _, err = fetch("hdm05", source)
    assert code == 3 and re.search(r"HDM_bd\.asf: differs from .*HDM_bd\.asf, expected one", err)
    assert not (tmp_path / "data").exists()


@pytest.fixture(scope="module")
def walks(real_data):
    """Function from the table's name of a walk to its place in the given data."""
    return lambda file: data_folder.find(real_data, f"cmu_walk/{file}")


@pytest.fixture(scope="module")
def acclaim_texts(walks):
    """ASF and AMC texts of two walks, with the names of bones that CMU's files have."""
    names = {own: theirs for theirs, own in cmu_trials.JOINTS.items()}

    def made(file):
        clip = clip_of(walks(file))
        bones = replace(clip.skeleton, names=tuple(names[one] for one in clip.skeleton.names))
        return files_of(replace(clip, skeleton=bones), UNIT)

    return {file: made(file) for file in (WALK, TURN)}


def write_trial(folder, texts, subject, number):
    """A skeleton and a motion as CMU lays them out."""
    own = folder / f"subjects/{subject:02}"
    own.mkdir(parents=True, exist_ok=True)
    (own / f"{subject:02}.asf").write_text(texts[0])
    (own / f"{subject:02}_{number:02}.amc").write_text(texts[1])


def test_walks_are_recognized_by_their_motion(fetch, acclaim_texts, walks, tmp_path):
    # The trial's number is not the one that the table supposes, and one subject is unknown.
    write_trial(tmp_path / "cmu", acclaim_texts[WALK], 7, 12)
    write_trial(tmp_path / "cmu", acclaim_texts[TURN], 91, 3)
    code, _, err = fetch("cmu", tmp_path / "cmu")
    assert code == 0, err
    place = tmp_path / "data/cmu_walk"
    facts = json.loads((place / "fetched.json").read_text())
    assert {one["file"]: one["sources"][-1]["file"] for one in facts["files"]} == {
        WALK: "07_12.amc",
        TURN: "91_03.amc",
    }
    for file in (WALK, TURN):
        assert_same_motion(place / file, walks(file))
    listed = (place / "strides.csv").read_text().splitlines()
    assert len(listed) == 1 + facts["rows"]
    assert {line.partition(",")[0] for line in listed[1:]} == {WALK, TURN}
    assert facts["missing"]["bvh/p07_walking_5_tr.bvh"] == (
        "found no match, expected a trial of subject 07 of 329 frames"
    )
    own = recipe.read(data_folder.RECIPES / "cmu_walk.toml")
    made, _ = ingest.ingest(own, tmp_path / "data")
    assert {example.row.file.name for example in made} == {Path(WALK).name, Path(TURN).name}


def test_another_subject_another_motion_and_two_trials_are_no_match(fetch, acclaim_texts, tmp_path):
    write_trial(tmp_path / "other", acclaim_texts[WALK], 8, 1)
    code, _, err = fetch("cmu", tmp_path / "other")
    assert code == 3 and "found none of 60 clips; see http://mocap.cs.cmu.edu" in err
    skeleton, motion = acclaim_texts[WALK]
    slow = re.sub(r"(?m)^(root \S+ \S+) (\S+)", lambda m: f"{m[1]} {0.9 * float(m[2])}", motion)
    write_trial(tmp_path / "slow", (skeleton, slow), 7, 1)
    assert fetch("cmu", tmp_path / "slow")[0] == 3
    for number in (1, 2):
        write_trial(tmp_path / "two", acclaim_texts[WALK], 7, number)
    code, _, err = fetch("cmu", tmp_path / "two")
    assert code == 3
    assert "found 07_01.amc, 07_02.amc with these strides, expected one trial" in err


def test_a_folder_without_files_or_without_a_skeleton_is_refused(fetch, tmp_path):
    code, _, err = fetch("cmu", tmp_path)
    assert code == 3 and "found no .asf, .amc, .bvh file in this folder" in err
    (tmp_path / "07_01.amc").write_text(ARM_AMC)
    code, _, err = fetch("cmu", tmp_path)
    assert code == 3 and "07_01.amc: found no skeleton 07.asf for it, expected one" in err
    (tmp_path / "07.asf").write_text(ARM_ASF)
    code, _, err = fetch("cmu", tmp_path)
    assert code == 3 and "found none of 60 clips" in err
