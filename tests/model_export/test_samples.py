"""Tests of sample locations: controls, performer labels and leave-out groups."""

from pathlib import Path

import numpy as np
import pytest
from minimal import recipe_with, small_clip

from posefield.common.errors import TrainingError
from posefield_train.kriging import sample_points
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.ingest import Example

WHO = ("cy", "ann", "ann", "bob", "cy", "bob")
FILES = ("c1", "a1", "a1", "b1", "c2", "b1")
SPEEDS = (1.0, 3.0, 2.0, 5.0, 4.0, 2.5)


def examples(speeds=SPEEDS, who=WHO, files=FILES):
    """Clips that differ by their rows alone."""
    clip = small_clip()
    rows = [
        ClipRow(Path(f"{file}.bvh"), "clips.csv", line, name, 0, None, np.array([speed]), ())
        for line, (speed, name, file) in enumerate(zip(speeds, who, files, strict=True), 2)
    ]
    return [Example(row, clip, row.controls, (), jumps=()) for row in rows]


def recipe(label="performer", **kriging):
    told = {"label": label} if label else {}
    return recipe_with(clips={"performer": "who"}, kriging={**told, **kriging})


def test_controls_come_first_in_half_ranges_and_labels_after_them():
    laid, labels = sample_points.make_samples(recipe(), examples())
    assert labels == {"performer": ("ann", "bob", "cy")}
    assert (laid.controls, laid.labels) == (1, (3,))
    assert laid.points[:, 0].tolist() == [-1.0, 0.0, -0.5, 1.0, 0.5, -0.25]
    assert laid.points[:, 1:].tolist() == [
        [float(name == performer) for performer in labels["performer"]] for name in WHO
    ]


def test_clips_of_one_file_are_one_group():
    groups = sample_points.make_samples(recipe(), examples())[0].groups
    same = [[a == b for a in FILES] for b in FILES]
    assert (groups[:, None] == groups).tolist() == same
    alone = sample_points.make_samples(recipe(), examples(files="abcdef"))[0].groups
    assert len(np.unique(alone)) == 6


def test_one_performer_is_told_apart_from_nobody_and_it_is_noted():
    laid, performers = sample_points.make_samples(recipe(), examples(who=["ann"] * 6))
    assert (performers, laid.labels) == ({}, ())
    said = sample_points.data_notes(recipe(), examples(who=["ann"] * 6))
    assert said == ["all clips are of one performer, 'ann': kriging.label has no effect"]
    assert sample_points.data_notes(recipe(), examples()) == []
    assert sample_points.data_notes(recipe(label=None), examples(who=["ann"] * 6)) == []


@pytest.mark.parametrize("files", ["aaaaaa", "aaaaab"], ids=["one file", "all but one of a file"])
def test_files_without_which_no_drift_is_left_are_not_left_out_whole(files):
    laid, _ = sample_points.make_samples(recipe(drift=1), examples(files=files))
    assert laid.groups.tolist() == list(range(6))
    said = sample_points.data_notes(recipe(drift=1), examples(files=files))
    assert len(said) == 1 and said[0].startswith("clips of one recording are not left out together")
    # A constant needs no more than one clip of another file.
    constant, _ = sample_points.make_samples(recipe(drift=0), examples(files=files))
    assert len(np.unique(constant.groups)) == (6 if files == "aaaaaa" else 2)


def test_a_drift_that_hangs_on_one_clip_is_refused_with_its_line():
    lonely = examples(speeds=(1.0, 1.0, 1.0, 1.0, 7.0, 1.0), files="abcdef")
    with pytest.raises(
        TrainingError, match=r"without the clip of line 6 .* set kriging.drift to 0"
    ):
        sample_points.make_samples(recipe(drift=1), lonely)
    for drift in (0, "chosen"):
        assert sample_points.make_samples(recipe(drift=drift), lonely)[0].points[4, 0] == 1.0
    pair = examples(speeds=(1.0, 1.0, 7.0, 1.0, 7.0, 1.0), files="abcdef")
    assert sample_points.make_samples(recipe(drift=1), pair)[0].points[4, 0] == 1.0


def test_the_mean_is_that_of_the_other_groups(rng):
    groups, values = np.array([0, 1, 1, 2, 0]), rng.normal(size=(5, 3))
    found = SamplePoints(np.zeros((5, 1)), 1, groups).from_mean(values)
    expected = [values[i] - values[groups != groups[i]].mean(axis=0) for i in range(5)]
    assert np.max(np.abs(found - expected)) < 1e-12
    alone = SamplePoints(np.zeros((5, 1)), 1, np.arange(5)).from_mean(values)
    assert np.max(np.abs(found - alone)) > 1e-2
