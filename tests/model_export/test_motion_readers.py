"""Tests of the table of readers, of formats that are refused, and of files that are kept."""

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from acclaim_files import ARM_AMC, ARM_ASF
from exported_clips import encoded
from gltf_files import GltfFile, arm
from minimal import recipe_with, small_clip, write_clips

from posefield.common.errors import AcclaimError, FileError, MotionFileError
from posefield.motion import bvh_writer
from posefield_train.probe import probe_report, recipe_draft
from posefield_train.source import data_folder, ingest, motion_file, motion_readers
from posefield_train.source.motion_file import ReadOptions
from posefield_train.source.motion_readers import MotionFiles

PAGE = Path(__file__).parents[2] / "docs/guide/motion-files.md"


def test_every_format_and_refusal_is_on_the_page(tmp_path):
    text = PAGE.read_text()
    suffixes = {suffix for own in motion_readers.FORMATS for suffix in own.suffixes}
    assert suffixes.isdisjoint(motion_readers.REFUSED)
    for suffix in suffixes | motion_readers.REFUSED.keys():
        assert f"`{suffix}`" in text, suffix
    for suffix, way_out in motion_readers.REFUSED.items():
        with pytest.raises(MotionFileError, match=re.escape(way_out)):
            motion_readers.read(tmp_path / f"a{suffix.upper()}")
    with pytest.raises(MotionFileError, match=r"'.xyz', expected one of .bvh, .amc, .glb, .gltf"):
        motion_readers.read(tmp_path / "a.xyz")


def test_a_file_of_one_motion_has_no_animation_to_choose(tmp_path):
    folder = write_clips(tmp_path, [small_clip()])
    with pytest.raises(MotionFileError, match="'walk', but BVH files hold one motion"):
        motion_readers.read(folder / "0.bvh", ReadOptions(animation="walk"))


def write_arm(folder, *skeletons, motion="07_01.amc"):
    for name in skeletons:
        (folder / name).write_text(ARM_ASF)
    (folder / motion).write_bytes(ARM_AMC.encode("latin-1"))
    return folder / motion


@pytest.mark.parametrize(
    ("skeletons", "taken"),
    [(["07.asf"], "07.asf"), (["body.asf"], "body.asf"), (["0.asf", "07.asf", "8.asf"], "07.asf")],
)
def test_an_amc_file_is_read_with_the_skeleton_beside_it(tmp_path, skeletons, taken):
    path = write_arm(tmp_path, *skeletons)
    found = motion_readers.read(path, ReadOptions(rate=120.0))
    assert found.skeleton.names == ("root", "upper", "lower") and found.rate == 120.0
    assert (found.metres_per_unit, found.up) == (None, None)
    assert found.notes == (f"07_01.amc: read with the skeleton {taken}",)


@pytest.mark.parametrize("skeletons", [[], ["a.asf", "b.asf"]])
def test_an_amc_file_without_its_own_skeleton_is_refused(tmp_path, skeletons):
    said = ", ".join(skeletons) or "none"
    with pytest.raises(AcclaimError, match=f"found the skeletons {said} beside it"):
        motion_readers.read(write_arm(tmp_path, *skeletons))


def test_an_amc_file_needs_the_rate_of_the_recipe(tmp_path):
    write_arm(tmp_path, "07.asf")
    (tmp_path / "clips.csv").write_text("file,v\n07_01.amc,1\n")
    with pytest.raises(MotionFileError, match=r"Acclaim files state no frame rate, .*source\.rate"):
        ingest.ingest(recipe_with(), tmp_path)
    report = probe_report.probe([tmp_path / "07_01.amc"])
    assert report.proposed["fps"].value is None
    assert "# TODO rate = \n" in recipe_draft.recipe_text(report, "arm", None)
    assert "unknown s" in probe_report.text(report)


def test_files_in_archives_are_read_alike(tmp_path):
    clip = small_clip()
    folder = tmp_path / "recordings"
    folder.mkdir()
    write_arm(folder, "07.asf")
    for ending in ("usda", "usdz", "glb"):
        (folder / f"a.{ending}").write_bytes(encoded(clip, ending))
    with zipfile.ZipFile(tmp_path / "packed.zip", "w") as archive:
        for path in folder.iterdir():
            archive.write(path, path.name)
    for name in ("a.usda", "a.usdz", "a.glb", "07_01.amc"):
        plain = motion_readers.read(folder / name, ReadOptions(30.0))
        packed = motion_readers.read(
            data_folder.find(tmp_path, f"packed/{name}"), ReadOptions(30.0)
        )
        assert packed.source.endswith(f"packed.zip/{name}")
        assert np.array_equal(plain.rotations, packed.rotations)


def test_files_are_read_once(tmp_path):
    folder = write_clips(tmp_path, [small_clip()])
    files = MotionFiles()
    first = files.read(folder / "0.bvh")
    assert files.read(folder / "0.bvh") is first
    assert files.read(folder / "0.bvh", ReadOptions(rate=30.0)) is not first


def test_a_bound_keeps_the_files_that_were_asked_for_last(tmp_path):
    folder = write_clips(tmp_path, [small_clip(phase) for phase in (0.0, 0.1, 0.2)])
    poses = motion_readers.read(folder / "0.bvh").poses
    files = MotionFiles(most_poses=2 * poses)
    first, second = (files.read(folder / f"{index}.bvh") for index in range(2))
    assert files.read(folder / "0.bvh") is first
    files.read(folder / "2.bvh")
    assert files.read(folder / "0.bvh") is first
    again = files.read(folder / "1.bvh")
    assert again is not second and np.array_equal(again.rotations, second.rotations)


def two_animations():
    """Two seconds of two motions of one arm in one file, at 30 frames a second."""
    times = np.arange(60) / 30.0
    file = GltfFile(arm(), [{"joints": [0, 1]}])
    for name, way in (("left", times**2), ("ahead", times)):
        path = np.outer(way, [1, 0, 0] if name == "left" else [0, 0, 1])
        file.animate((0, "translation", times, path, "LINEAR"), name=name)
    return file.glb()


def table(folder, *rows):
    (folder / "clips.csv").write_text("\n".join(["file,v,part", *rows]) + "\n")
    clips = {"animation": "part"}
    return ingest.ingest(recipe_with(clips=clips, motion={"facing": "none"}), folder)


def test_a_table_names_the_animations_of_a_file(tmp_path):
    (tmp_path / "a.glb").write_bytes(two_animations())
    (left, ahead), _ = table(tmp_path, "a.glb,1,left", "a.glb,2,ahead")
    assert (left.row.source, ahead.row.source) == ("a.glb[left]", "a.glb[ahead]")
    assert (left.recording, ahead.recording) == (left.row.motion, ahead.row.motion)
    assert np.abs(left.clip.root_path[-1] - ahead.clip.root_path[-1]).max() > 1.0
    with pytest.raises(FileError, match="the same frames of the same file as line 2"):
        table(tmp_path, "a.glb,1,left", "a.glb,2,left")
    with pytest.raises(FileError, match="2 animations"):
        table(tmp_path, "a.glb,1,")


def test_a_recipe_overrules_what_a_file_states(tmp_path):
    (tmp_path / "a.glb").write_bytes(encoded(small_clip(), "glb"))
    (tmp_path / "clips.csv").write_text("file,v\na.glb,1\n")
    (plain,), notes = ingest.ingest(recipe_with(), tmp_path)
    assert notes == []
    for source, said in (
        ({"metres_per_unit": 0.01}, "a.glb: states a unit of 1 m, overruled: read as 0.01 m"),
        ({"up": "z"}, "a.glb: states y as its up axis, overruled: read as z"),
    ):
        (example,), notes = ingest.ingest(recipe_with(source=source), tmp_path)
        assert notes[0] == said
        scale = source.get("metres_per_unit", 1.0)
        lengths = [np.linalg.norm(own.offsets, axis=1) for own in (example, plain)]
        assert lengths[0] == pytest.approx(scale * lengths[1])


def test_a_file_keeps_its_unit_beside_files_that_need_that_of_the_recipe(tmp_path):
    """BVH in centimetres and GLB, which states metres and y up, in one family."""
    clips = [small_clip(), small_clip(0.5)]
    folder = write_clips(tmp_path, clips, metres_per_unit=0.01)
    (folder / "1.glb").write_bytes(encoded(clips[1], "glb"))
    (folder / "clips.csv").write_text("file,v\n0.bvh,0\n1.glb,1\n")
    examples, notes = ingest.ingest(recipe_with(source={"metres_per_unit": 0.01}), folder)
    assert any("1.glb: states a unit of 1 m, kept" in note for note in notes)
    assert examples[1].offsets == pytest.approx(examples[0].offsets, abs=1e-5)


def test_probe_takes_what_files_state_and_says_what_contradicts_it(tmp_path, examples):
    """A GLB in centimetres, as some exporters write, states metres by its format."""
    clip = examples[0].clip
    (tmp_path / "a.usdc").write_bytes(encoded(clip, "usdc"))
    found = probe_report.probe([tmp_path / "a.usdc"]).proposed
    assert (found["metres_per_unit"].value, found["up"].value) == (0.01, "z")
    assert found["metres_per_unit"].confidence == found["up"].confidence == "certain"
    assert found["up"].evidence[0] == "stated by the files: z"
    large = bvh_writer.dumps(clip, metres_per_unit=0.01)
    (tmp_path / "large.bvh").write_bytes(large)
    file = motion_readers.read(tmp_path / "large.bvh")
    enlarged = motion_file.to_clip(file, metres_per_unit=1.0, up="y")
    (tmp_path / "large.glb").write_bytes(encoded(enlarged, "glb"))
    found = probe_report.probe([tmp_path / "large.glb"]).proposed["metres_per_unit"]
    assert (found.value, found.confidence) == (1.0, "low")
    assert "which the motion contradicts: 0.01 m fits it" in found.evidence[0]
