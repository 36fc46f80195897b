"""Tests of `posefield bake`: files blended as engines do, their stated errors, and refusals."""

import json
from pathlib import Path

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


def followed(share, leader, follower):
    """Share of a follower's cycle between the markers between which the leader is."""
    leading, following = ([*entry, entry[0] + 1.0] for entry in (leader, follower))
    if share < leading[0]:
        share += 1.0
    step = 0 if share < leading[1] else 1
    part = (share - leading[step]) / (leading[step + 1] - leading[step])
    return following[step] + part * (following[step + 1] - following[step])


def rms_of_blend(files, shares, truth, markers):
    """Root mean square distance, cm, of two files blended half and half from a third."""
    poses, exact = [local_poses(file) for file in files], local_poses(truth)
    squares = []
    for share in shares:
        (first, low), (second, high) = (
            sampled(pose, followed(share, markers[-1], own))
            for pose, own in zip(poses, markers, strict=False)
        )
        second = second * np.sign(np.sum(first * second, axis=-1, keepdims=True))
        turns = (first + second) / np.linalg.norm(first + second, axis=-1, keepdims=True)
        wanted = sampled(exact, share)
        both = np.stack([turns, wanted[0]]), np.stack([(low + high) / 2, wanted[1]])
        blended, given = skeleton.positions(tuple(exact[2].tolist()), *both)
        squares.append(np.sum((blended - given) ** 2, axis=-1))
    return 100.0 * np.sqrt(np.mean(squares))


@pytest.mark.parametrize("synchronisation", ["markers", "phase"])
def test_another_reader_of_the_files_measures_the_stated_error(
    space, posefield, tmp_path, synchronisation
):
    folder, facts = space
    middle = ("-c", "speed=1.3", "-c", "turn=2", "--loop", "--root", "bone")
    posefield("clip", "cmu_walk", *middle, "-o", tmp_path / "middle.glb")
    # The middle of a grid of three has the markers of the model between the two.
    posefield(
        *("bake", "cmu_walk", "--grid", "speed=1.0:1.6:3", "--grid", "turn=2"),
        *("-o", tmp_path / "three", "--workers", "1"),
    )
    truth = json.loads((tmp_path / "three/blendspace.json").read_text())["samples"][1]
    samples = [*facts["samples"], truth]
    markers = [[time / s["duration"] for time in s["markers"].values()] for s in samples]
    if synchronisation == "phase":
        markers = [[0.0, 0.5]] * 3
    files = [folder / entry["file"] for entry in facts["samples"]]
    shares = np.arange(truth["frames"] - 1) / (truth["frames"] - 1)
    measured = rms_of_blend(files, shares, tmp_path / "middle.glb", markers)
    stated = facts["error"][synchronisation]["rms_cm"]
    assert measured == pytest.approx(stated, abs=NEAR)
    # Out of step by a twentieth of the cycle, the blend is wrong by centimetres.
    shifted = [[m + 0.05 for m in markers[0]], markers[1], markers[2]]
    assert rms_of_blend(files, shares, tmp_path / "middle.glb", shifted) > 1.5 * stated


def test_samples_have_what_engines_need(space):
    folder, facts = space
    assert [axis["name"] for axis in facts["axes"]] == ["speed"]
    assert (facts["fixed"], facts["root"]) == ({"turn": 2.0}, "bone")
    for sample in facts["samples"]:
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
        assert f"{facts['error']['phase']['rms_cm']:.2f} cm from the model between" in out
    guide = (ROOT / "docs/guide/blend-spaces.md").read_text()
    assert "".join(out.splitlines(keepends=True)[:3]) in guide
    for way in ("markers", "phase"):
        assert errors[5][way]["rms_cm"] < min(1.0, 0.9 * errors[3][way]["rms_cm"])


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
    "last pose does not lead into its first": (
        "hdm05_kick",
        ["--grid", "kick_height=1.0:1.2:2"],
    ),
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
    control = type("Control", (), {"name": "c"})()
    axes = [blend_space.GridAxis(control, np.array(values)) for values in ([0.0, 2.0], [0.0, 1.0])]
    grid = blend_space.BlendSpace(axes, {}, [])
    assert grid.weights([0.5, 0.25]) == pytest.approx({0: 0.5625, 1: 0.1875, 2: 0.1875, 3: 0.0625})
    assert grid.weights([2.0, 1.0]) == {3: 1.0}
