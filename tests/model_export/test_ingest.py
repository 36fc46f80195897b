"""Tests of ingestion: clips are converted to one coordinate frame."""

import re
from dataclasses import replace

import numpy as np
import pytest
from minimal import SKELETON, recipe_with, small_clip, write_clips

from posefield.common.errors import RecipeError
from posefield.common.units import UP
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source import canonical, ingest

# A file keeps a millionth of a degree and of a metre: what comes back is off by less than this, m.
WRITTEN = 1e-5
FLOOR = 1.0 - UP


@pytest.fixture
def read(tmp_path):
    """Function that writes clips, reads them by a recipe and gives examples and notes."""

    def of(*clips, metres_per_unit=1.0, **sections):
        write_clips(tmp_path, clips, metres_per_unit)
        return ingest.ingest(recipe_with(**sections), tmp_path)

    return of


def first(found):
    return found[0][0].clip


def turned(clip, angle, move):
    """The clip as seen by a camera that was turned and moved."""
    turn = np.broadcast_to(quat.from_axis_angle(UP, np.asarray(angle)), (len(clip), 4))
    rotations, translations = clip.rotations.copy(), clip.translations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    translations[:, 0] = quat.rotate(turn, translations[:, 0]) + move
    return replace(clip, rotations=rotations, translations=translations)


def gap(a, b):
    return np.abs(a.positions() - b.positions()).max()


def around_root(clip):
    """Joint positions (F, J, 3) from below the root and seen from its heading, m."""
    facing = quat.from_axis_angle(UP, -canonical.heading(clip))[:, None]
    return quat.rotate(facing, clip.positions() - (clip.root_path * FLOOR)[:, None])


def test_the_first_frame_stands_at_the_origin_and_faces_ahead(read):
    source = small_clip(heading=2.0)
    assert canonical.heading(source)[0] > 1.0 and np.abs(source.root_path[0] * FLOOR).max() > 1.0
    clip = first(read(source))
    assert np.abs(clip.root_path[0] * FLOOR).max() < 1e-12
    assert abs(canonical.heading(clip)[0]) < 1e-12
    assert clip.root_path[0, 1] == pytest.approx(source.root_path[0, 1], abs=WRITTEN)


@pytest.mark.parametrize("angle", [178.0, 90.0])
def test_where_and_whither_a_clip_was_captured_does_not_matter(read, angle):
    source = small_clip()
    elsewhere = turned(source, np.radians(angle), np.array([-3.0, 0.0, 40.0]))
    (straight, other), _ = read(source, elsewhere)
    assert gap(straight.clip, other.clip) < WRITTEN
    assert gap(source, elsewhere) > 1.0


def lying(clip):
    """The same motion as a file with Z up says it."""

    def down(v):
        return v[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])

    figure = clip.skeleton
    skeleton = Skeleton(
        figure.names,
        figure.parents,
        down(figure.offsets),
        figure.tip_joints,
        down(figure.tip_offsets),
    )
    rotations = np.concatenate([clip.rotations[..., :1], down(clip.rotations[..., 1:])], axis=-1)
    return Clip(skeleton, rotations, down(clip.translations), clip.rate)


def test_a_file_with_z_up_says_the_same_motion(read):
    source = small_clip()
    upright = first(read(source))
    stood_up = read(lying(source), source={"up": "z"})[0][0]
    assert gap(upright, stood_up.clip) < WRITTEN
    assert np.abs(stood_up.clip.skeleton.tip_offsets - SKELETON.tip_offsets).max() < WRITTEN
    # Read as if it had Y up, the same file is another motion.
    assert gap(upright, first(read(lying(source)))) > 0.1


def test_lengths_are_scaled_to_metres(read):
    source = small_clip()
    metres = first(read(source))
    feet = first(read(source, metres_per_unit=0.3048, source={"metres_per_unit": 0.3048}))
    assert gap(metres, feet) < WRITTEN
    twice = first(read(source, source={"metres_per_unit": 2.0}))
    assert np.abs(twice.positions() - 2.0 * metres.positions()).max() < WRITTEN


def test_frames_are_cut_and_count_from_zero(read, tmp_path):
    source = small_clip()
    write_clips(tmp_path, [source])
    (tmp_path / "clips.csv").write_text("file,v,from,to\n0.bvh,1,4,9\n")
    own = recipe_with(clips={"first_frame": "from", "last_frame": "to"})
    clip = ingest.ingest(own, tmp_path)[0][0].clip
    assert len(clip) == 6
    assert np.abs(around_root(clip) - around_root(source)[4:10]).max() < WRITTEN
    assert np.abs(around_root(clip) - around_root(source)[5:11]).max() > 100 * WRITTEN


def test_frames_beyond_the_file_are_refused_by_row(tmp_path):
    write_clips(tmp_path, [small_clip(frames=21)])
    own = recipe_with(clips={"first_frame": "from", "last_frame": "to"})
    table = tmp_path / "clips.csv"
    table.write_text("file,v,from,to\n0.bvh,1,0,20\n")
    assert len(ingest.ingest(own, tmp_path)[0]) == 1
    table.write_text("file,v,from,to\n0.bvh,1,0,21\n")
    message = r"clips\.csv:2: frame 21, but .*0\.bvh has frames 0 to 20"
    with pytest.raises(RecipeError, match=message):
        ingest.ingest(own, tmp_path)


def test_a_dropped_joint_goes_with_all_below_it(read):
    source = small_clip()
    examples, _ = read(source, motion={"drop_joints": ["LeftArm"]})
    clip = examples[0].clip
    assert clip.skeleton.names == ("Hips", "Spine", "Head")
    assert clip.skeleton.parents == (-1, 0, 1)
    assert clip.skeleton.tip_joints == (2,)
    assert np.abs(examples[0].clip.skeleton.tip_offsets - SKELETON.tip_offsets[:1]).max() < WRITTEN
    assert np.abs(around_root(clip) - around_root(source)[:, :3]).max() < WRITTEN


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ({"drop_joints": ["Hips"]}, "the root cannot be dropped"),
        ({"drop_joints": ["Tail"]}, r"0\.bvh has no joints 'Tail' that the recipe names"),
        (
            {"feet": ["LeftHand"], "drop_joints": ["LeftArm"]},
            r"joints \['LeftHand'\] are dropped, and named by the recipe elsewhere",
        ),
    ],
)
def test_joints_that_cannot_be_followed_are_refused_by_row(read, motion, message):
    with pytest.raises(RecipeError, match=message) as caught:
        read(small_clip(), motion=motion)
    assert caught.value.line == 2


def test_in_place_takes_the_straight_travel_out_and_nothing_else(read):
    source = small_clip()
    travelling = first(read(source))
    still = first(read(source, motion={"root": "in_place"}))
    assert np.abs((still.root_path[-1] - still.root_path[0]) * FLOOR).max() < 1e-12
    assert np.linalg.norm(travelling.root_path[-1] * FLOOR) > 0.9
    taken = travelling.root_path - still.root_path
    assert np.abs(np.diff(taken, 2, axis=0)).max() < 1e-12
    assert np.abs(taken[:, 1]).max() == 0.0
    assert np.array_equal(travelling.rotations, still.rotations)


def tilt_between(clip):
    """Return the last root's tilt off a vertical turn of the first, rad."""
    step = quat.log(quat.mul(clip.rotations[-1, 0], quat.conj(clip.rotations[0, 0])))
    return np.abs(step * FLOOR).max()


def test_a_cyclic_clip_ends_in_the_pose_that_it_begins_with(read):
    source = small_clip()
    loop = first(read(source, motion={"cyclic": True}))
    opened = first(read(source))
    for clip, closed in ((loop, True), (opened, False)):
        step = quat.log(quat.mul(quat.conj(clip.rotations[0, 1:]), clip.rotations[-1, 1:]))
        assert (np.abs(step).max() < 1e-9) == closed
        assert (tilt_between(clip) < 1e-9) == closed
        assert (abs(clip.root_path[-1, 1] - clip.root_path[0, 1]) < 1e-9) == closed


def landmarked(tmp_path, marks):
    write_clips(tmp_path, [small_clip(frames=21)])
    names = [f"m{i}" for i in range(len(marks))]
    cells = ",".join(map(str, marks))
    (tmp_path / "clips.csv").write_text(f"file,v,from,to,{','.join(names)}\n0.bvh,1,2,18,{cells}\n")
    clips = {"first_frame": "from", "last_frame": "to", "landmarks": names}
    return ingest.ingest(recipe_with(clips=clips), tmp_path)[0][0]


def test_landmarks_are_fractions_of_the_clip(tmp_path):
    assert landmarked(tmp_path, [6, 10]).landmarks == (0.25, 0.5)


@pytest.mark.parametrize("marks", [[10, 6], [2, 6], [6, 19]])
def test_landmarks_rise_within_the_clip(tmp_path, marks):
    message = (
        r"column '.*': frame \d+ is out of the clip, expected one between its frames 2 and 18 of 0"
        r"\.bvh, without|column '.*': frame 6, expected one after frame (10|6) of column"
    )
    with pytest.raises(RecipeError, match=message) as caught:
        landmarked(tmp_path, marks)
    assert caught.value.line == 2


def renamed(clip, names, parents=SKELETON.parents):
    skeleton = replace(clip.skeleton, names=names, parents=parents)
    return replace(clip, skeleton=skeleton)


def test_clips_of_other_skeletons_are_refused_with_both_files(read, tmp_path):
    other = renamed(small_clip(), ("Hips", "Spine", "Head", "LeftArm", "LeftPaw"))
    with pytest.raises(RecipeError) as caught:
        read(small_clip(), small_clip(1.0), other)
    assert caught.value.line == 4
    assert caught.value.message == (
        f"{tmp_path / '2.bvh'} has other joints than {tmp_path / '0.bvh'} of line 2: "
        "only one of them has ['LeftHand', 'LeftPaw']; of people, say skeleton.topology = 'roles'"
    )


def with_root_offset(file):
    """The file again, its root's OFFSET no longer zero."""
    content, count = re.subn(r"OFFSET [0. ]+\n", "OFFSET 0.0 0.25 0.0\n", file.read_text(), count=1)
    assert count == 1
    file.write_text(content)
    return file


def test_a_root_offset_that_the_recipe_does_not_speak_of_is_noted(tmp_path):
    source = small_clip()
    write_clips(tmp_path, [source])
    file = with_root_offset(tmp_path / "0.bvh")
    heights = {}
    for said, expected in ((None, 1), ("replace", 0), ("add", 0)):
        own = recipe_with(source={} if said is None else {"root_offset": said})
        examples, notes = ingest.ingest(own, tmp_path)
        assert len(notes) == expected
        heights[said] = examples[0].clip.root_path[0, 1]
    note = ingest.ingest(recipe_with(), tmp_path)[1][0]
    assert note.startswith(f"{file}: the root's OFFSET is (0.0, 0.25, 0.0)")
    assert note.endswith("say so as source.root_offset")
    assert heights[None] == heights["replace"] == pytest.approx(0.9, abs=WRITTEN)
    assert heights["add"] == pytest.approx(1.15, abs=WRITTEN)
