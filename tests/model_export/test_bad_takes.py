"""Tests of folders with faults: each file is read, noted or refused, the others are searched."""

import csv
import json
import shutil
import tracemalloc

import bad_takes
import discover_takes
import numpy as np
import pytest
import rigid_takes
from minimal import TOML

from posefield_train.discover import recordings
from posefield_train.probe import probe_report
from posefield_train.source import frame_faults, motion_readers

FILES = bad_takes.contents()
SEARCHED = [name for name, (_, said) in FILES.items() if not said or said.startswith("note: ")]
FEW = ("--candidates", "60", "--licence", "CC0-1.0")
MANY = 80


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Four good takes among files with faults, a broken link, and a folder with a file's name."""
    place = rigid_takes.write_takes(tmp_path_factory.mktemp("bad") / "recordings")
    for name, (content, _) in FILES.items():
        (place / name).write_bytes(content)
    (place / "gone.bvh").symlink_to(place / "nowhere")
    (place / "sub.bvh").mkdir()
    return place


@pytest.fixture(scope="module")
def read(folder):
    return recordings.read_recordings(folder)


@pytest.mark.parametrize("name", FILES)
def test_each_file_is_searched_noted_or_refused_with_its_reason(read, name):
    said = FILES[name][1]
    assert (name in read.refused) == (name not in SEARCHED)
    assert (name in {recording.file for recording in read.recordings}) == (name in SEARCHED)
    if name in SEARCHED:
        assert any(said.removeprefix("note: ") in own for own in read.notes.get(name, [""]))
        assert (name in read.notes) == bool(said)
    else:
        assert said in read.refused[name] and not read.refused[name].startswith("/")


def test_a_folder_without_one_good_file_is_refused_and_nothing_written(posefield, tmp_path):
    recordings = tmp_path / "recordings"
    recordings.mkdir()
    for name in set(FILES) - set(SEARCHED) - {"metres.bvh", "z_up.bvh", "other_format.glb"}:
        (recordings / name).write_bytes(FILES[name][0])
    code, _, err = posefield("discover", recordings, "-o", tmp_path / "out")
    assert code == 3 and "no recording that can be searched; such as" in err
    assert not (tmp_path / "out").exists()


def test_probe_reports_readable_files_and_names_the_others(posefield, folder):
    files = sorted(path for path in folder.iterdir() if path.name != "sub.bvh")
    code, out, err = posefield("probe", *files, "--json")
    facts = json.loads(out)
    # Probe reads a body without legs, and a single pose, too.
    odd = {"no_legs.bvh", "one_frame.bvh", "metres.bvh", "z_up.bvh", "other_format.glb"}
    known = {*SEARCHED, *odd}
    assert code == 0 and "left out: " in err
    refused = {path.rpartition("/")[2]: said for path, said in facts["refused"].items()}
    assert set(refused) == {*FILES, "gone.bvh"} - known
    assert all(FILES[name][1] in said for name, said in refused.items() if name in FILES)
    warned = " ".join(facts["warnings"])
    assert "are in another unit, such as" in warned and "files have different up axes" in warned
    for name in ("rest_first.bvh: frame 0 is the rest pose", "dropped.bvh: 4 frames repeated"):
        assert name in warned


@pytest.mark.parametrize("suffix", [".fbx", ".npy", ".asf"])
def test_every_command_refuses_a_format_with_the_way_out(posefield, tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"x")
    said = motion_readers.REFUSED[suffix]
    code, _, err = posefield("probe", path)
    assert code == 3 and said in " ".join(err.split())
    if suffix != ".asf":
        code, _, err = posefield("discover", tmp_path, "--strides", "-o", tmp_path / "s.csv")
        assert code == 3 and said in " ".join(err.split())
    recipe = tmp_path / "r.toml"
    recipe.write_text(TOML)
    (tmp_path / "clips.csv").write_text(f"file,v\na{suffix},1\n")
    code, _, err = posefield("train", recipe, "--data", tmp_path, "-o", tmp_path / "m.onnx")
    assert code == 3 and said in " ".join(err.split())
    assert not (tmp_path / "m.onnx").exists()


def test_a_rest_pose_before_the_motion_is_in_no_clip(read):
    (recording,) = (own for own in read.recordings if own.file == "rest_first.bvh")
    assert recording.first == 1
    assert np.array_equal(recording.places["leftHand"][0], recording.places["leftHand"][1])
    good = next(own for own in read.recordings if own.file == "ann_0.bvh")
    # All recordings rest at first; where the motion goes on from there, nothing is left out.
    assert good.first == 0


def test_copies_are_one_take_of_one_performer_in_the_found_tables(posefield, folder, tmp_path):
    code, out, err = posefield("discover", folder, *FEW, "-o", tmp_path / "recipes", "--json")
    facts = json.loads(out)
    assert code == 0
    assert set(facts["refused"]) == {*FILES, "gone.bvh"} - set(SEARCHED)
    assert set(facts["notes"]) == {own for own in SEARCHED if FILES[own][1]}
    assert "left out: box.glb: found an animation of node 'box' without a skeleton" in err
    assert "note: leaping.bvh: 2 leaps, rightHand by 0.60 m between frames 199 and 200" in err
    rows = [
        row
        for path in sorted((tmp_path / "recipes").glob("*.csv"))
        for row in csv.DictReader(path.read_text().splitlines())
    ]
    copies = {"copied.bvh", "copied_again.bvh", "mirrored.bvh"}
    assert copies & {row["file"] for row in rows}
    for row in rows:
        own = "copied" if row["file"] in copies else row["file"].removesuffix(".bvh")
        assert row["recording"] == own
    assert len({row["performer"] for row in rows if row["file"] in copies}) == 1
    table = tmp_path / "like.csv"
    posefield("discover", folder, "--like", "copied.bvh:1-3.5", "-o", table)
    found = {
        row["file"]: row["recording"] for row in csv.DictReader(table.read_text().splitlines())
    }
    assert {found[name] for name in copies & set(found)} == {"copied"}
    assert len(copies & set(found)) > 1


def test_no_clip_is_found_across_a_leap(posefield, folder, tmp_path):
    table, recordings = tmp_path / "like.csv", tmp_path / "recordings"
    recordings.mkdir()
    for name in ("ann_0.bvh", "bob_1.bvh", "leaping.bvh"):
        shutil.copy(folder / name, recordings / name)
    words = ("--like", "ann_0.bvh:1-3.5", "--most", "400")
    posefield("discover", recordings, *words, "-o", table)
    rows = list(csv.DictReader(table.read_text().splitlines()))
    own = [row for row in rows if row["file"] == "leaping.bvh"]
    assert own
    for row in own:
        first, last = int(row["first_frame"]), int(row["last_frame"])
        assert not first <= 199 < last and not first <= 204 < last


def test_takes_of_two_performances_are_no_copies():
    times = np.arange(240) / discover_takes.RATE
    one = discover_takes.body(times, speed=1.0, swing=0.6)
    other = discover_takes.body(times, speed=1.02, swing=0.61)
    assert not recordings.find_copies(["a", "b"], [one, other])
    found = recordings.find_copies(["a", "b"], [one, one])
    assert found["b"][0] == "a" and "shares frames with" in found["b"][1]


def test_faults_are_told_from_motions_without():
    clip = bad_takes.good(31)
    rest = clip.skeleton.at_rest(clip.skeleton.offsets)
    assert frame_faults.find_faults(clip.positions(), clip.rate, rest) == frame_faults.NO_FAULTS
    # A pose that is held begins and ends slowly, or is long.
    held = clip.positions()[np.clip(np.arange(200), 0, 100)]
    assert not frame_faults.find_faults(held, clip.rate, rest).repeated


def test_the_order_in_which_files_are_listed_does_not_matter(posefield, tmp_path):
    outputs = []
    for order in (1, -1):
        recordings = tmp_path / f"order{order}" / "recordings"
        recordings.mkdir(parents=True)
        good = rigid_takes.write_takes(tmp_path / "good")
        for path in sorted(good.iterdir())[::order]:
            (recordings / path.name).write_bytes(path.read_bytes())
        (recordings / "cut.bvh").write_bytes(FILES["cut.bvh"][0])
        output = tmp_path / f"order{order}" / "recipes"
        assert posefield("discover", recordings, "-o", output, *FEW)[0] == 0
        outputs.append({p.name: p.read_text() for p in output.iterdir()})
    one, other = ({n: own.replace("order-1", "order1") for n, own in o.items()} for o in outputs)
    assert one == other


def tiny(folder, count):
    """Write many recordings of a second, each of another motion."""
    folder.mkdir()
    base = rigid_takes.clip("FS", 3)
    for index in range(count):
        rng = np.random.default_rng(index)
        start = int(rng.integers(0, 600))
        turns = base.rotations[start : start + 40].copy()
        places = base.translations[start : start + 40] + rng.normal(0.0, 0.05, 3)
        places[:, 0, 2] += rng.uniform(0.2, 1.0) * np.arange(40) / base.rate
        own = bad_takes.moved(base, turns, places * [1.0, rng.uniform(0.99, 1.01), 1.0])
        (folder / f"{index:05d}.bvh").write_bytes(bad_takes.bvh(own))
    return folder


def test_memory_of_many_files_is_that_of_their_joints_alone(tmp_path):
    """Of each file, only the joints with a role and a few measured frames stay in memory."""
    folder = tiny(tmp_path / "many", MANY)
    tracemalloc.start()
    read = recordings.read_recordings(folder)
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(read.recordings) > MANY - 10
    assert size < MANY * 100_000
    few = [len(read.figures[f"{index:05d}.bvh"].positions) for index in (0, MANY - 1)]
    assert few == [40, 5]
    report = probe_report.report_of(
        [folder / name for name in read.figures], [*read.figures.values()]
    )
    assert report.proposed["up"].value == "y"
