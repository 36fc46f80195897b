"""Crowds in parts: the same people and bytes whatever makes them, and whenever it was stopped."""

import json
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pytest
from clusters import started

import posefield
from posefield.question.walk_question import WalkQuestion
from posefield.tracks import track_crowd
from posefield.tracks.track import Track

COUNT, SIZE = 7, 3
NAMES = ["00000.bones.npz", "00001.bones.npz", "00002.bones.npz"]


def table(path, seconds=3.0, jump=()):
    """Write people who start one after the other, and walk along arcs."""
    rows = ["time,id,x,y"]
    for step in np.arange(0.0, seconds + 0.5 * COUNT, 0.5):
        for person in range(COUNT):
            moment = step - 0.5 * person
            if 0.0 <= moment <= seconds:
                x = 30.0 * (person in jump and moment > 1.0) + 1.2 * moment
                rows.append(f"{step:g},p{person},{x:g},{2.0 * person + 0.1 * moment**2:g}")
    path.write_text("\n".join(rows) + "\n")
    return path


def command(tracks, output, *words):
    options = ["--trajectories", str(tracks), "--people-per-file", str(SIZE), "--take", "index"]
    words = ["crowd", "cmu_walk", *options, "-o", str(output), "--json", *words]
    return [sys.executable, "-m", "posefield", *words]


def in_one_file(tracks, output, *more):
    """Return the arrays of the people without parts."""
    words = command(tracks, output, *more)
    at = words.index("--people-per-file")
    subprocess.run(words[:at] + words[at + 2 :], check=True, capture_output=True)
    return dict(np.load(output))


def run(*words):
    done = subprocess.run(command(*words), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def contents(folder):
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir()) if file.is_file()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Folder of an uninterrupted run, and its report."""
    folder = tmp_path_factory.mktemp("whole")
    report = run(table(folder / "tracks.csv"), folder / "people.bones.npz")
    return folder / "people", report


@pytest.mark.system
def test_parts_hold_the_people_of_one_crowd_on_one_clock(whole, tmp_path):
    folder, report = whole
    assert [part["file"] for part in report["parts"]] == NAMES
    people = [name for part in report["parts"] for name in part["people"]]
    assert people == [f"p{person}" for person in range(COUNT)]
    one = in_one_file(table(tmp_path / "tracks.csv"), tmp_path / "all.bones.npz")
    parts = [dict(np.load(folder / name)) for name in NAMES]
    for name in ("time", "positions", "velocities"):
        joined = np.concatenate([part[name] for part in parts])
        np.testing.assert_array_equal(joined, one[name])


@pytest.mark.system
def test_a_run_that_was_killed_resumes_with_the_same_bytes(whole, tmp_path):
    folder, _ = whole
    tracks, output = table(tmp_path / "tracks.csv"), tmp_path / "people.bones.npz"
    with subprocess.Popen(command(tracks, output), stdout=subprocess.PIPE) as running:
        limit = time.monotonic() + 60.0
        while not (tmp_path / "people" / "00000.json").exists() and time.monotonic() < limit:
            time.sleep(0.02)
        running.kill()
    begun = contents(tmp_path / "people")
    assert "manifest.json" not in begun
    assert list((tmp_path / "people").glob(".writing.*"))
    made = (tmp_path / "people" / NAMES[0]).stat().st_mtime_ns
    run(tracks, output, "--workers", "2")
    assert contents(tmp_path / "people") == contents(folder)
    assert not list((tmp_path / "people").glob(".writing.*"))
    assert (tmp_path / "people" / NAMES[0]).stat().st_mtime_ns == made
    # A damaged part is made again.
    (tmp_path / "people" / NAMES[1]).write_bytes(b"")
    run(tracks, output)
    assert contents(tmp_path / "people") == contents(folder)
    manifest = json.loads((folder / "manifest.json").read_bytes())
    assert len({part["made_from"] for part in manifest["parts"]}) == len(NAMES)


@pytest.mark.system
def test_parts_on_a_cluster_are_those_of_one_process(whole, tmp_path):
    folder, _ = whole
    tracks = table(tmp_path / "tracks.csv")
    with started(tmp_path, 2) as cluster:
        run(tracks, tmp_path / "people.bones.npz", "--scheduler", cluster.address)
    assert contents(tmp_path / "people") == contents(folder)


@pytest.mark.system
def test_unusable_people_are_refused_or_named(tmp_path):
    tracks = table(tmp_path / "tracks.csv", jump=(0, 3, 4, 5))
    words = command(tracks, tmp_path / "a.osi")
    failed = subprocess.run(words, capture_output=True, text=True, check=False)
    assert failed.returncode == 3
    assert "person 'p0': jumps" in failed.stderr
    assert list((tmp_path / "a").iterdir()) == []
    words += ["-o", str(tmp_path / "a.osi")]
    twice = subprocess.run(words, capture_output=True, text=True, check=False)
    assert twice.returncode == 2
    assert "output: the same file twice" in twice.stderr
    report = run(tracks, tmp_path / "a.bones.npz", "--skip-bad", "-o", str(tmp_path / "a.arrow"))
    assert list(report["skipped"]) == ["p0", "p3", "p4", "p5"]
    # A part without people has no file, and the clock begins with the first usable track.
    assert [part["file"] for part in report["parts"]] == [NAMES[0], None, NAMES[2]]
    assert report["parts"][2]["files"] == [NAMES[2], "00002.arrow"]
    rows = pa.ipc.open_stream((tmp_path / "a" / "00002.arrow").read_bytes()).read_all()
    one = in_one_file(tracks, tmp_path / "all.bones.npz", "--skip-bad")
    times = [np.load(tmp_path / "a" / NAMES[part])["time"] for part in (0, 2)]
    np.testing.assert_array_equal(rows["time"], times[1])
    assert report["begin"] == one["time"].min() == 0.5
    np.testing.assert_array_equal(np.concatenate(times), one["time"])


def test_the_worst_limits_come_first():
    step, speeds = np.arange(4.0), (3.0, 1.0, 5.0, 4.0)
    people = [Track(f"p{speed}", step, 1j * speed * step) for speed in speeds]
    walk = posefield.load("cmu_walk").synthesizer
    facts = track_crowd.build_crowd(walk, walk.gait, WalkQuestion(count=4), people).facts
    said = [line for line in facts["warnings"] if "faster than a walk" in line]
    assert [line.split("'")[1] for line in said] == ["p5.0", "p4.0", "p3.0"]
