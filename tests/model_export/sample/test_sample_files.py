"""Tests of the generated family's 92 files: content and reproducible bytes."""

import csv
import hashlib
import os
import re
import subprocess
import sys

import numpy as np
import pytest

from posefield.common.errors import FileError
from posefield_train.sample import sample_body, sample_controls, sample_files


@pytest.fixture(scope="module")
def samples():
    return list(sample_files.samples())


@pytest.fixture(scope="module")
def folder(reaching_folder):
    return reaching_folder


@pytest.fixture(scope="module")
def rows(folder):
    with (folder / "clips.csv").open(newline="") as table:
        return list(csv.DictReader(table))


def digest(folder):
    hashed = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        hashed.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return hashed.hexdigest()


def motion_of(path):
    """Header lines and the numbers (F, 94) of a BVH file."""
    head, _, body_text = path.read_text().partition("MOTION\n")
    frames, frame_time, *lines = body_text.splitlines()
    assert int(frames.removeprefix("Frames: ")) == len(lines)
    values = np.array([line.split() for line in lines], dtype=float)
    return head, float(frame_time.removeprefix("Frame Time: ")), values


@pytest.mark.system
def test_files_are_the_same_in_every_process(folder, tmp_path):
    script = "import sys, pathlib; from posefield_train.sample import sample_files; "
    script += "sample_files.write_family(pathlib.Path(sys.argv[1]))"
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", script, str(tmp_path / seed)],
            env=os.environ | {"PYTHONHASHSEED": seed},
        )
        for seed in ("1", "4242")
    ]
    assert [run.wait() for run in runs] == [0, 0]
    assert {digest(tmp_path / "1"), digest(tmp_path / "4242")} == {digest(folder)}


def test_there_are_92_clips_of_94_channels_at_120_hz(folder, rows):
    assert len(rows) == sample_files.COUNT == 92
    assert sorted(row["file"] for row in rows) == sorted(
        path.relative_to(folder).as_posix() for path in folder.rglob("*.bvh")
    )
    for row in rows:
        head, frame_time, values = motion_of(folder / row["file"])
        counts = [int(count) for count in re.findall(r"CHANNELS (\d+)", head)]
        assert (len(counts), sum(counts), values.shape[1]) == (33, 94, 94)
        assert sorted(counts) == [1] * 4 + [3] * 28 + [6]
        assert 1.0 / frame_time == pytest.approx(120.0, abs=1e-6)
        assert int(row["event_frame"]) == len(values) - 1


@pytest.mark.parametrize("count", [92, 10_000])
def test_samples_of_any_number_can_be_reached(count):
    """Rounding to the table's decimals leaves no control point outside the body's limits."""
    found = [where for _, where in sample_files.design(count)]
    assert len(found) == count
    for where in found:
        values = [where.stature, where.hip_height, where.turn, where.target_height]
        assert sample_controls.parse_controls(values) == where


def test_noise_has_the_size_it_claims_and_keeps_hinges_and_feet(samples):
    rng = np.random.Generator(np.random.PCG64(0))
    noise = sample_files.smooth_noise(rng, 200, (40, 3))
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(sample_files.NOISE, rel=0.2)
    for sample in samples[::9]:
        hinges = sample.clip.rotations[:, [sample_body.INDEX[name] for name in sample_body.HINGES]]
        assert np.abs(hinges[..., 2:]).max() == 0.0
        for name in ("LeftFoot", "RightFoot"):
            foot = sample.clip.positions()[:, sample_body.INDEX[name]]
            assert np.linalg.norm(foot - foot.mean(axis=0), axis=-1).max() < 0.02


@pytest.fixture
def small(tmp_path, samples):
    """A family of one clip in a folder that was empty."""
    (tmp_path / "small").mkdir()
    return sample_files.write_family(tmp_path / "small", samples[:1]).parent


def test_a_folder_that_holds_the_family_is_left_as_it_is(small, samples):
    before = {path: path.stat().st_mtime_ns for path in small.rglob("*")}
    assert sample_files.write_family(small, samples[:1]) == small / "recipe.toml"
    assert {path: path.stat().st_mtime_ns for path in small.rglob("*")} == before


def test_an_empty_folder_is_filled_and_nothing_else_is_left(small):
    found = {path.relative_to(small).as_posix() for path in small.rglob("*") if path.is_file()}
    assert found == {"bvh/reach_001.bvh", "clips.csv", "recipe.toml"}
    assert [path.name for path in small.parent.iterdir()] == ["small"]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: (folder / "bvh" / "mine.txt").touch(), r"bvh/mine\.txt is in the way"),
        (lambda folder: (folder / "bvh" / "reach_001.bvh").write_text("b"), r"001\.bvh differs"),
        (lambda folder: (folder / "recipe.toml").unlink(), r"recipe\.toml is missing"),
    ],
)
def test_a_folder_with_anything_else_is_refused(small, samples, spoil, message):
    spoil(small)
    with pytest.raises(FileError, match=message):
        sample_files.write_family(small, samples[:1])
