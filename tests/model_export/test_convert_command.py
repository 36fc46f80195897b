"""Tests of `posefield convert`, with a program in place of Blender; tests/interop runs Blender."""

import json
import sys

import numpy as np
import pytest
from exported_clips import encoded
from minimal import small_clip
from test_motion_readers import two_animations

from posefield_train.source import motion_file, motion_readers

SAME = 1e-5


def gap(path, clip):
    found = motion_file.to_clip(motion_readers.read(path), metres_per_unit=0.01, up="y")
    return np.abs(found.positions() - clip.positions()).max()


@pytest.mark.parametrize("ending", ["usdc", "glb"])
def test_files_that_state_their_unit_need_nothing_else(posefield, tmp_path, ending):
    clip = small_clip()
    (tmp_path / f"a.{ending}").write_bytes(encoded(clip, ending))
    code, out, err = posefield(
        "convert", tmp_path / f"a.{ending}", "-o", tmp_path / "a.bvh", "--json"
    )
    assert (code, err) == (0, "")
    assert json.loads(out) == {
        "file": str(tmp_path / "a.bvh"),
        "frames": 21,
        "fps": 30.0,
        "joints": 5,
        "notes": [],
    }
    assert gap(tmp_path / "a.bvh", clip) < SAME
    # Bones that vary by rounding alone have no channels of their own.
    assert (tmp_path / "a.bvh").read_text().count("CHANNELS 6") == 1


def test_the_unit_of_other_files_is_asked_for(posefield, tmp_path):
    clip = small_clip()
    (tmp_path / "m.bvh").write_bytes(encoded(clip, "bvh"))
    words = ("convert", tmp_path / "m.bvh", "-o", tmp_path / "cm.bvh")
    code, _, err = posefield(*words)
    assert code == 3 and "states no unit, expected --unit" in err
    code, _, err = posefield(*words, "--unit", "1")
    assert code == 3 and "states no up axis, expected --up" in err
    code, out, _ = posefield(*words, "--unit", "1", "--up", "y")
    assert code == 0 and "21 frames at 30 a second, 5 joints, in centimetres with y up" in out
    assert gap(tmp_path / "cm.bvh", clip) < SAME


def test_one_of_several_animations_is_written(posefield, tmp_path):
    (tmp_path / "a.glb").write_bytes(two_animations())
    words = ("convert", tmp_path / "a.glb", "-o", tmp_path / "a.bvh")
    assert "2 animations (1 'left', 2 'ahead')" in posefield(*words)[2]
    assert posefield(*words, "--animation", "ahead")[0] == 0
    path = motion_readers.read(tmp_path / "a.bvh").translations[:, 0]
    assert np.abs(path[-1] - [0, 0, 100 * 59 / 30]).max() < 1e-3


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("-o", "a.glb"), 2, "expected a name that ends in .bvh"),
        (("-o", "a.bvh", "--unit", "0"), 2, "unit: 0.0, expected a positive number"),
    ],
)
def test_wrong_options_are_refused(posefield, tmp_path, words, code, said):
    found, _, err = posefield("convert", tmp_path / "a.glb", *words)
    assert found == code and said in err


def program(folder, version, work):
    """A program that states a version, and writes a GLB as Blender would."""
    path = folder / "blender"
    path.write_text(
        f"#!{sys.executable}\nimport shutil, sys\n"
        f"if sys.argv[1:] == ['--version']:\n    print({version!r})\n    sys.exit()\n"
        f"source, target = sys.argv[-2:]\n{work}\n"
    )
    path.chmod(0o755)
    return path


COPY = "shutil.copyfile(source, target)"


@pytest.fixture
def fbx(tmp_path):
    """A file with the name of an FBX file, which is a GLB that the program copies."""
    (tmp_path / "kick.fbx").write_bytes(encoded(small_clip(), "glb"))
    return tmp_path / "kick.fbx"


def test_fbx_is_read_by_blender_and_its_version_is_said(posefield, tmp_path, fbx):
    blender = program(tmp_path, "Blender 4.5.15\n\tbuild date: x", COPY)
    words = ("convert", fbx, "-o", tmp_path / "a.bvh", "--blender", blender)
    code, out, _ = posefield(*words)
    assert code == 0 and "note: kick.fbx: read by Blender 4.5.15" in out
    assert gap(tmp_path / "a.bvh", small_clip()) < SAME


def test_blender_is_found_on_the_path(posefield, tmp_path, fbx, monkeypatch):
    words = ("convert", fbx, "-o", tmp_path / "a.bvh")
    monkeypatch.setenv("PATH", str(tmp_path))
    code, _, err = posefield(*words)
    assert code == 3 and "blender: not found on the PATH, expected an installed Blender" in err
    program(tmp_path, "Blender 5.0.1", COPY)
    assert posefield(*words)[0] == 0


@pytest.mark.parametrize(
    ("version", "work", "said"),
    [
        ("Blender 3.6.2", COPY, "is Blender 3.6.2, expected 4.2 or later"),
        (
            "Blender 4.5.1",
            "print('Error: Version 6.1 unsupported'); sys.exit(3)",
            "kick.fbx: Blender 4.5.1 cannot read it: Error: Version 6.1 unsupported",
        ),
    ],
)
def test_what_blender_cannot_do_is_said(posefield, tmp_path, fbx, version, work, said):
    blender = program(tmp_path, version, work)
    code, _, err = posefield("convert", fbx, "-o", tmp_path / "a.bvh", "--blender", blender)
    assert code == 3 and said in err
