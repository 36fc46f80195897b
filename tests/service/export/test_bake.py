"""Tests of `posefield bake`: files blended as engines do, their stated errors, and refusals."""

import json
from pathlib import Path
from types import SimpleNamespace

import exporting
import numpy as np
import pytest

from posefield.batch import blend_space
from posefield.motion import skeleton
from posefield_train.source import motion_readers

ROOT = Path(__file__).parents[3]
SPEEDS = ("--grid", "speed=1.0:1.6:2", "--grid", "turn=2")
# The files have single precision, and the statement three decimals of a centimetre.
NEAR = 2e-3


@pytest.fixture
def bake(posefield, tmp_path):
    """Function that bakes the walk into a folder; gives exit code, output and errors."""

    def run(*words, model="cmu_walk", folder="space"):
        return posefield("bake", model, *words, "-o", tmp_path / folder, "--workers", "1")

    return run


@pytest.fixture
def space(bake, tmp_path):
    """Folder of a blend space of two walks, and what its file says."""
    code, _, err = bake(*SPEEDS)
    assert (code, err) == (0, "")
    return tmp_path / "space", json.loads((tmp_path / "space/blendspace.json").read_text())


def local_poses(file):
    """Rotations, translations and parents of a file below its root bone, and its steps."""
    motion = motion_readers.read(file)
    names, parents = motion.skeleton.names, np.array(motion.skeleton.parents)
    assert names[0] == "root"
    return motion.rotations[:, 1:], motion.translations[:, 1:], parents[1:] - 1


def sampled(poses, share):
    """Pose of a file at a share of its cycle, linear between frames."""
    rotations, translations, _ = poses
    place = share % 1.0 * (len(rotations) - 1)
    before = int(place)
    u = place - before
    after = rotations[before + 1] * np.sign(
        np.sum(rotations[before] * rotations[before + 1], axis=-1, keepdims=True)
    )
    turns = (1 - u) * rotations[before] + u * after
    turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
    return turns, (1 - u) * translations[before] + u * translations[before + 1]


def rms_of_blend(files, truth, delay=0.0):
    """Root mean square distance, cm, of two files blended half and half from a third.

    delay: of the first of the two, in shares of its cycle.
    """
    poses, exact = [local_poses(file) for file in files], local_poses(truth)
    squares = []
    for share in np.arange(len(exact[0]) - 1) / (len(exact[0]) - 1):
        (first, low), (second, high) = sampled(poses[0], share - delay), sampled(poses[1], share)
        second = second * np.sign(np.sum(first * second, axis=-1, keepdims=True))
        turns = (first + second) / np.linalg.norm(first + second, axis=-1, keepdims=True)
        wanted = sampled(exact, share)
        both = np.stack([turns, wanted[0]]), np.stack([(low + high) / 2, wanted[1]])
        blended, given = skeleton.positions(tuple(exact[2].tolist()), *both)
        squares.append(np.sum((blended - given) ** 2, axis=-1))
    return 100.0 * np.sqrt(np.mean(squares))


def test_another_reader_of_the_files_measures_the_stated_error(space, posefield, tmp_path):
    folder, facts = space
    ends = [sample["controls"] for sample in facts["samples"]]
    middle = [f"{name}={(ends[0][name] + ends[1][name]) / 2}" for name in ends[0]]
    words = [word for pair in middle for word in ("-c", pair)]
    truth = tmp_path / "middle.glb"
    posefield("clip", "cmu_walk", *words, "--loop", "--root", "bone", "-o", truth)
    files = [folder / entry["file"] for entry in facts["samples"]]
    stated = facts["error"]["rms_cm"]
    assert rms_of_blend(files, truth) == pytest.approx(stated, abs=NEAR)
    # Out of step by a twentieth of the cycle, the blend is wrong by centimetres.
    assert rms_of_blend(files, truth, delay=0.05) > 1.5 * stated


def test_samples_have_what_engines_need(space):
    folder, facts = space
    assert [axis["name"] for axis in facts["axes"]] == ["speed"]
    assert facts["root"] == "bone"
    for sample in facts["samples"]:
        assert (sample["controls"]["speed"], sample["controls"]["turn"]) == (sample["at"][0], 2.0)
        motion = motion_readers.read(folder / sample["file"])
        assert len(motion.rotations) == sample["frames"]
        assert sample["duration"] == pytest.approx((sample["frames"] - 1) / facts["fps"])
        # The root bone carries the travel; frames of a stretched clip keep its speed.
        travel = motion.translations[-1, 0] - motion.translations[0, 0]
        assert [sample["root_motion"][k] for k in "xz"] == pytest.approx(travel[[0, 2]], abs=1e-5)
        assert sample["speed"] == pytest.approx(sample["at"][0], rel=0.03)
        # Toes rest on the floor after each marker, and swing before it.
        places = skeleton.positions(motion.skeleton.parents, motion.rotations, motion.translations)
        steps = facts["fps"] * np.linalg.norm(np.diff(places, axis=0), axis=-1)
        for name, joint in {
            "leftToes_down": "LeftToeBase",
            "rightToes_down": "RightToeBase",
        }.items():
            frame = int(np.ceil(sample["markers"][name] * facts["fps"]))
            track = np.tile(steps[:, motion.skeleton.names.index(joint)], 2)
            # From the second cycle on, for a marker near the beginning of the first.
            frame += len(steps) * (frame < 9)
            assert track[frame : frame + 4].max() < 0.15 < 0.4 < track[frame - 9 : frame - 6].min()


def test_a_finer_grid_is_nearer_and_five_by_five_keeps_the_promise(bake, tmp_path):
    errors = {}
    for count in (3, 5):
        grid = (f"speed=0.6:1.7:{count}", f"turn=-4:20:{count}")
        code, out, _ = bake("--grid", grid[0], "--grid", grid[1], folder=f"walk{count}")
        facts = json.loads((tmp_path / f"walk{count}/blendspace.json").read_text())
        errors[count] = facts["error"]
        assert code == 0
        assert f"{facts['error']['rms_cm']:.2f} cm from the model between" in out
    guide = (ROOT / "docs/guide/blend-spaces.md").read_text()
    assert "".join(out.splitlines(keepends=True)[:2]) in guide
    assert f"within {errors[3]['worst_cm']:.1f} cm" in guide
    assert errors[5]["worst_cm"] < 2.0 < errors[3]["worst_cm"]
    strides = np.reshape([s["controls"]["stride_length"] for s in facts["samples"]], (5, 5))
    assert np.diff(strides, 2, axis=0) == pytest.approx(np.zeros((3, 5)), abs=1e-9)
    assert np.diff(strides, 2, axis=1) == pytest.approx(np.zeros((5, 3)), abs=1e-9)


def test_a_bake_that_was_damaged_is_mended_with_the_same_bytes(bake, tmp_path):
    grid = ("--grid", "speed=1.0:1.4:3")
    bake(*grid, folder="once")
    whole = exporting.content(tmp_path / "once")
    (tmp_path / "once/blendspace.json").write_bytes(b"{}")
    code, _, err = bake(*grid, folder="once")
    assert code == 0 and "missing or damaged" in err
    assert exporting.content(tmp_path / "once") == whole
    assert "it was complete before" in bake(*grid, folder="once")[1]
    code, _, err = bake("--grid", "speed=1.0:1.5:3", folder="once")
    assert code == 3 and "holds another export" in err


REFUSALS = {
    "last pose does not lead into its first": ("hdm05_kick", ["--grid", "kick_height=1.0:1.2:2"]),
    "expected 1 to 2, as blend spaces of engines have": ("cmu_walk", ["--grid", "speed=1.2"]),
    "expected rising values": ("cmu_walk", ["--grid", "speed=1.4,1.0"]),
    "expected a control": ("cmu_walk", ["--grid", "performer=cmu_02,cmu_05"]),
    "401 clips, expected at most 400": ("cmu_walk", ["--grid", "speed=1.0:1.4:401"]),
}


@pytest.mark.parametrize("sentence", REFUSALS)
def test_what_cannot_be_baked_is_refused_and_nothing_is_written(bake, tmp_path, sentence):
    model, words = REFUSALS[sentence]
    code, _, err = bake(*words, model=model)
    assert code == 2 and sentence in err
    assert not (tmp_path / "space").exists()


def test_weights_are_bilinear_and_samples_stay_themselves():
    axes = [
        blend_space.GridAxis(SimpleNamespace(name=name), np.array(values))
        for name, values in (("a", [0.0, 0.5, 2.0]), ("b", [0.0, 1.0]))
    ]
    corners = [{"a": 0.0, "b": 0.0, "further": value} for value in (0.0, 1.0, 2.0, 5.0)]
    grid = blend_space.BlendSpace(axes, corners)
    assert grid.weights([1.25, 0.25]) == pytest.approx({2: 0.375, 3: 0.125, 4: 0.375, 5: 0.125})
    assert grid.weights([2.0, 1.0]) == {5: 1.0}
    assert grid.controls([1.0, 0.5]) == {"a": 1.0, "b": 0.5, "further": 2.0}
