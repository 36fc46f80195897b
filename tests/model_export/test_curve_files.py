"""Files of curves: what is read beside or instead of a skeleton, and what is refused."""

import re

import numpy as np
import pytest
from exported_clips import encoded
from families import face_files
from minimal import plain_recipe, recipe_with, small_clip, write_clips
from pydantic import ValidationError

from posefield.common.errors import RecipeError
from posefield_train.source import ingest
from posefield_train.source.recipe import Recipe

FRAMES = 21
NAMES = ("jawOpen", "smile")
# A file keeps four decimals.
WRITTEN = 1e-4


def values(clip, frames=FRAMES):
    """Values (F, 2) between 0 and 1 that differ from clip to clip."""
    t = np.linspace(0.0, 1.0, frames)
    return np.stack([0.5 + 0.4 * np.sin(3 * t + clip), 0.1 * clip + 0.5 * t**2], axis=-1)


@pytest.fixture
def folder(tmp_path):
    """Three clips with curves, each in a file beside its motion."""
    write_clips(tmp_path, [small_clip(0.3 * clip) for clip in range(3)])
    for clip in range(3):
        (tmp_path / f"{clip}.curves.csv").write_text(face_files.curve_text(NAMES, values(clip)))
    return tmp_path


def read(folder, **curves):
    return ingest.ingest(recipe_with(curves={"suffix": ".curves.csv", **curves}), folder)[0]


def edit(folder, old, new, clip=1):
    path = folder / f"{clip}.curves.csv"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))


def test_curves_are_found_by_a_suffix(folder):
    for clip, example in enumerate(read(folder)):
        assert example.clip.curves.names == list(NAMES)
        assert np.abs(example.clip.curve_values - values(clip)).max() < WRITTEN
        assert np.abs(example.clip.curve_values - values(clip + 1)).max() > 0.05


@pytest.mark.parametrize("form", ["glb", "usda"])
def test_curves_of_written_files_come_back(folder, form):
    """The project's own files, which hold the curves as weights of blend shapes."""
    for clip, example in enumerate(read(folder)):
        (folder / f"{clip}.{form}").write_bytes(encoded(example.clip, form))
    table = folder / "clips.csv"
    table.write_text(table.read_text().replace(".bvh", f".{form}"))
    recipe = recipe_with(curves={"suffix": f".{form}"}, source={"metres_per_unit": 1.0})
    for clip, example in enumerate(ingest.ingest(recipe, folder)[0]):
        assert example.clip.curves.names == list(NAMES)
        assert np.abs(example.clip.curve_values - values(clip)).max() < WRITTEN


def test_curves_without_a_skeleton_move_one_joint_that_rests(folder):
    rows = "\n".join(f"{clip}.curves.csv,{clip}" for clip in range(3))
    (folder / "clips.csv").write_text(f"file,v\n{rows}\n")
    found = ingest.ingest(recipe_with(curves={"rate": 25.0}), folder)[0]
    for clip, example in enumerate(found):
        assert example.clip.skeleton.names == ("Root",)
        assert not np.any(example.clip.positions())
        assert example.clip.rate == 25.0
        assert np.abs(example.clip.curve_values - values(clip)).max() < WRITTEN


def test_curves_are_cut_with_their_clip(folder):
    (folder / "clips.csv").write_text("file,v,a,b\n0.bvh,0,3,12\n1.bvh,1,0,20\n")
    cut = recipe_with(
        clips={"first_frame": "a", "last_frame": "b"}, curves={"suffix": ".curves.csv"}
    )
    first = ingest.ingest(cut, folder)[0][0].clip
    assert np.abs(first.curve_values - values(0)[3:13]).max() < WRITTEN


def test_a_cycle_closes_its_curves_within_their_range(folder):
    cyclic = recipe_with(motion={"cyclic": True}, curves={"suffix": ".curves.csv"})
    for clip, example in enumerate(ingest.ingest(cyclic, folder)[0]):
        found = example.clip.curve_values
        assert np.abs(found[0] - found[-1]).max() < 1e-12
        assert np.abs(values(clip)[0] - values(clip)[-1]).max() > 0.1
        assert found.min() >= 0.0 and found.max() <= 1.0


def test_a_curve_has_its_own_range_and_distance(folder):
    own = read(folder, range=[-1.0, 1.0], of={"smile": {"range": [0.0, 5.0], "distance_cm": 7.0}})
    jaw, smile = own[0].clip.curves.curves
    assert (jaw.minimum, jaw.maximum, jaw.distance) == (-1.0, 1.0, 0.02)
    assert (smile.minimum, smile.maximum, smile.distance) == (0.0, 5.0, pytest.approx(0.07))


@pytest.mark.parametrize("cell", ["nan", "high"])
def test_a_cell_that_is_no_number_is_refused(folder, cell):
    edit(folder, f"{values(1)[0, 1]:.4f}", cell)
    said = re.escape(f"1.curves.csv:2: column 'smile': {cell!r}, expected a number")
    with pytest.raises(RecipeError, match=said):
        read(folder)


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("\n7,", "\n8,", "frame 8 after 6, expected 7"),
        ("frame,", "image,", "no column 'frame' (number of the frame, from 0)"),
        ("jawOpen", "jawOpn", "no curves ['jawOpen'] (did you mean 'jawOpn'?)"),
        ("frame,", "frame,brow,", "expected the 4 of the heading"),
    ],
)
def test_missing_frames_and_other_names_are_refused(folder, old, new, said):
    edit(folder, old, new)
    with pytest.raises(RecipeError, match=re.escape(said)):
        read(folder)


def test_a_curve_that_the_first_clip_lacks_is_refused(folder):
    more = face_files.curve_text((*NAMES, "brow"), np.tile(values(1)[:, :1], 3))
    (folder / "1.curves.csv").write_text(more)
    said = re.escape("curves ['brow'] that the first clip lacks")
    with pytest.raises(RecipeError, match=said):
        read(folder)
    assert len(read(folder, names=list(NAMES))) == 3


def test_curves_longer_than_their_motion_are_refused(folder):
    (folder / "1.curves.csv").write_text(face_files.curve_text(NAMES, values(1, FRAMES + 2)))
    said = r"1\.curves\.csv has 23 frames of curves and .*1\.bvh has 21 frames, expected as many"
    with pytest.raises(RecipeError, match=said):
        read(folder)


def test_a_value_outside_its_range_is_refused(folder):
    said = r"column 'smile': 0\.605, expected 0 to 0\.6 \(curves\.range\)"
    with pytest.raises(RecipeError, match=said):
        read(folder, of={"smile": {"range": [0.0, 0.6]}})


@pytest.mark.parametrize(
    "keys, said",
    [
        ({}, "found none, expected one of column, suffix, rate"),
        ({"column": "c", "rate": 30.0}, "found column, rate, expected one of"),
        ({"rate": 30.0, "range": [1.0, 0.0]}, "expected the smaller end first"),
    ],
)
def test_keys_that_contradict_each_other_are_refused(keys, said):
    with pytest.raises(ValidationError, match=re.escape(said)):
        Recipe.model_validate({**plain_recipe(), "curves": keys})


def live_link(numbers, frames=FRAMES):
    """Rows as Live Link Face writes them, at 30 frames a second, the numbers of their frames."""
    head = "Timecode,BlendShapeCount,jawOpen,smile"
    rows = zip(numbers, values(0, frames), strict=True)
    cells = (f"10:59:{58 + n // 30}:{n % 30}.25,61,{a:.4f},{b:.4f}" for n, (a, b) in rows)
    return "\n".join([head, *cells])


def test_rows_of_live_link_face_are_frames(folder):
    plain = read(folder)
    (folder / "0.curves.csv").write_text(live_link(range(FRAMES)))
    (first, *_) = read(folder)
    np.testing.assert_array_equal(first.clip.curves.values, plain[0].clip.curves.values)
    (folder / "0.curves.csv").write_text(live_link([*range(9), *range(10, FRAMES + 1)]))
    with pytest.raises(RecipeError, match=r"csv:11: Timecode 10:59:58:10.25 lies 0.067 s behind"):
        ingest.ingest(recipe_with(curves={"suffix": ".curves.csv"}, source={"rate": 30.0}), folder)
