"""Tests of recordings: stated by the table, or found from files and motions."""

from dataclasses import replace

import newcomers
import numpy as np
import pytest
from minimal import ingested, recipe_with, small_clip

from posefield.common.errors import RecipeError
from posefield.common.units import UP
from posefield.motion import quat
from posefield_train import training
from posefield_train.adapt import adapted_file, model_reconstruction, new_clips
from posefield_train.adapt.adapted_file import NewPerformer
from posefield_train.graph import onnx_export, trained_card
from posefield_train.kriging import sample_points
from posefield_train.source import ingest, recording_groups
from posefield_train.source.recording_groups import ClipPair

SWAPPED = (0, 1, 4, 5, 2, 3)


def wandering(rng, frames=60):
    """Joints (F, 6, 3) that wander smoothly, as those of no other call do."""
    t = np.linspace(0.0, 1.0, frames)[:, None, None, None]
    waves = np.sin(2 * np.pi * (t * np.arange(1, 4)[:, None, None] + rng.random((3, 6, 3))))
    path = np.linspace(0.0, 1.5, frames)[:, None, None] * [0.0, 0.0, 1.0]
    return 0.15 * (waves * rng.normal(size=(3, 6, 3))).sum(axis=1) + rng.normal(size=(6, 3)) + path


def seen_elsewhere(motion, angle=0.7):
    """The motion in another place and heading."""
    turn = quat.from_axis_angle(UP, np.array(angle))
    turned = quat.rotate(np.broadcast_to(turn, (*motion.shape[:-1], 4)), motion)
    return turned + np.array([3.0, 0.0, -1.0])


def mirrored(motion):
    return motion[:, list(SWAPPED)] * [-1.0, 1.0, 1.0]


def relations(*motions):
    return recording_groups.find_pairs(motions, SWAPPED)


def test_performances_of_their_own_share_nothing(rng):
    assert relations(*(wandering(rng) for _ in range(6))) == []


def test_clips_that_share_frames_are_found_in_any_place_and_heading(rng):
    whole, other = wandering(rng), wandering(rng)
    part = seen_elsewhere(np.round(whole[20:], 4))
    assert relations(whole, other, part) == [ClipPair(0, 2, "shares frames with")]
    assert relations(part, other, whole) == [ClipPair(2, 0, "shares frames with")]
    # The end of one clip is the beginning of the other.
    assert relations(whole[:40], seen_elsewhere(whole[30:])) == [
        ClipPair(0, 1, "shares frames with")
    ]
    assert relations(whole[:40], seen_elsewhere(whole[38:])) == [], "two frames are too few"
    assert relations(whole, whole.copy()) == [ClipPair(0, 1, "shares frames with")]
    # Negative control: the same motion with an error as large as between performances.
    assert relations(whole, whole + 0.01 * rng.normal(size=whole.shape)) == []


def test_mirror_images_are_found(rng):
    whole = wandering(rng)
    image = seen_elsewhere(mirrored(whole))
    assert relations(whole, wandering(rng), image) == [ClipPair(0, 2, "mirrors")]
    assert relations(whole[5:50], image) == [ClipPair(1, 0, "mirrors")]
    # Without the exchange of sides it is another motion.
    assert relations(whole, seen_elsewhere(whole * [-1.0, 1.0, 1.0])) == []


def test_clips_that_continue_each_other_are_found_where_they_were_captured(rng):
    whole = wandering(rng, 150)
    for first in (69, 70):
        assert relations(whole[:70], whole[first:]) == [ClipPair(0, 1, "continues")]
    assert relations(whole[:70], whole[72:]) == [], "frames are missing between"
    assert relations(whole[:70], seen_elsewhere(whole[69:])) == [], "moved to another place"


def test_loops_and_held_poses_tell_nothing(rng):
    """Animated clips begin and end alike; that makes no recording of them."""
    t = np.linspace(0.0, 2 * np.pi, 41)[:, None, None]
    rest = rng.normal(size=(6, 3))
    loops = [rest + np.sin(t) * 0.2 * rng.normal(size=(6, 3)) for _ in range(3)]
    assert relations(*loops) == []
    held = [np.concatenate([np.repeat(rest[None], 10, axis=0), wandering(rng)]) for _ in range(2)]
    held = [one - one[10:11] * (np.arange(70) >= 10)[:, None, None] for one in held]
    assert relations(*held) == []


EIGHT = tuple(small_clip(0.1 * i, 21 + i % 3) for i in range(8))


def part(clip, first, last):
    kept = slice(first, last + 1)
    return replace(clip, rotations=clip.rotations[kept], translations=clip.translations[kept])


@pytest.fixture
def read(tmp_path):
    """Function that writes clips and their table, and returns takes and notes."""

    def of(*given, **sections):
        _, examples, notes = ingested(tmp_path, *given, **sections)
        return examples, sample_points.recording_numbers(examples).tolist(), notes

    return of


STATED = {"clips": {"recording": "recording"}}


def test_takes_of_two_performers_may_have_the_same_name(read):
    rows = [
        f"{i}.bvh,{i},{'1' if i % 4 < 2 else '2'},{'ann' if i < 4 else 'bob'}" for i in range(8)
    ]
    sections = {"clips": {"recording": "recording", "performer": "who"}}
    assert read(EIGHT, rows, "file,v,recording,who", **sections)[1] == [0, 0, 1, 1, 2, 2, 3, 3]


def test_a_take_column_that_splits_a_file_is_refused(read):
    cuts = {"clips": {"recording": "recording", "first_frame": "a", "last_frame": "b"}}
    rows = ["0.bvh,0,0,10,one", "1.bvh,1,0,20,one", "0.bvh,2,10,20,two"]
    with pytest.raises(RecipeError) as refused:
        read(EIGHT, rows, "file,v,a,b,recording", **cuts)
    assert refused.value.line == 4
    assert refused.value.message == (
        "0.bvh is of recording 'two' here and of 'one' in line 2, expected one for a file: "
        "its clips were recorded in one go"
    )
    with pytest.raises(
        RecipeError, match=r"clips\.csv:3: column 'recording': nothing, expected the na"
    ):
        read(EIGHT, ["0.bvh,0,a", "1.bvh,1,"], "file,v,recording", **STATED)


def test_clips_of_one_file_and_of_one_recording_are_grouped_with_a_note(read):
    long = small_clip(0.0, 61)
    motions = [part(long, 0, 30), *EIGHT[1:6], part(long, 30, 60), part(EIGHT[1], 4, 15)]
    _, recordings, notes = read(motions)
    assert recordings[0] == recordings[6] and recordings[1] == recordings[7]
    assert len(set(recordings)) == 6
    assert notes == [
        "line 9, 7.bvh shares frames with line 3, 1.bvh: such clips are left out together as one "
        "recording (clips.recording states recordings)",
        "line 8, 6.bvh continues line 2, 0.bvh: such clips are left out together as one recording "
        "(clips.recording states recordings)",
    ]
    cuts = {"clips": {"first_frame": "a", "last_frame": "b"}}
    rows = [f"{i // 2}.bvh,{i},{10 * (i % 2)},{10 + 10 * (i % 2)}" for i in range(8)]
    _, recordings, notes = read(EIGHT, rows, "file,v,a,b", **cuts)
    assert recordings == [0, 0, 1, 1, 2, 2, 3, 3]
    assert notes == [
        "8 of 8 clips share their file with others: clips of one file are left out together as one "
        "recording (clips.recording states recordings)"
    ]


def test_the_model_file_keeps_takes_that_are_no_files(read, tmp_path):
    rows = [f"{i}.bvh,{i},{i // 2}" for i in range(8)]
    for head, own, expected in (
        ("file,v,recording", STATED, (0, 0, 1, 1, 2, 2, 3, 3)),
        ("file,v,other", {}, ()),
    ):
        examples, *_ = read(EIGHT, rows, head, **own)
        recipe = recipe_with(**own)
        trained = training.train_examples(recipe, examples)
        assert trained.samples.groups.tolist() == list(expected or range(8))
        exported = onnx_export.export_model(trained)
        assert exported.card.making.takes == expected


def test_an_adapted_model_keeps_its_takes_and_adds_those_of_new_clips(tmp_path):
    folder, recipe = newcomers.write(tmp_path / "family"), newcomers.recipe()
    examples = [
        replace(example, recording=f"{example.row.performer} {i // 6}")
        for i, example in enumerate(ingest.ingest(recipe, folder)[0])
    ]
    trained = training.train_examples(recipe, examples)
    content = onnx_export.export_model(trained).content
    reopened = model_reconstruction.reconstruct(content, "a model")
    before = reopened.card.making.takes
    assert len(before) == newcomers.CLIPS and len(set(before)) == 9
    table = newcomers.write_newcomer(tmp_path / "cy", (2.0, 7.0))
    found, _ = new_clips.examples_of_table(reopened, table, recipe.source, {"performer": "cy"})
    adapted = adapted_file.export_adapted(reopened, NewPerformer("cy", found, "CC0"))
    assert adapted.card.making.takes == (*before, max(before) + 1, max(before) + 2)
    # The new clips are not among those whose accelerations the card has.
    captured = adapted.card.captured_acceleration
    assert captured == reopened.card.captured_acceleration is not None
    assert captured != trained_card.captured_acceleration([*trained.examples, *found])
