"""Tests of discovery on real recordings, against cuts and controls of recipes by hand."""

import csv
import shutil
import sys
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from posefield_train.discover import family_search, found_clips, motion_features
from posefield_train.discover.motion_features import Span
from posefield_train.discover.recordings import read_recordings

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import proposed_controls

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def unpacked(real_data, tmp_path_factory):
    """Function that returns the folder of a data set, unpacked."""

    def of(name):
        target = tmp_path_factory.mktemp(name)
        if (real_data / f"{name}.zip").exists():
            with zipfile.ZipFile(real_data / f"{name}.zip") as archive:
                archive.extractall(target)
        elif (real_data / name).is_dir():
            shutil.copytree(real_data / name, target / name)
        else:
            pytest.skip(f"no {name} in {real_data}")
        return target / name

    return of


def table(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_strides_are_those_cut_by_hand(unpacked):
    folder = unpacked("cmu_walk")
    found = {
        recording.file: [one for one in found_clips.find_strides(recording) if one.travels]
        for recording in read_recordings(folder).recordings
    }
    offsets, cuts = [], table(folder / "strides.csv")
    for row in cuts:
        first, last = int(row["start_frame"]), int(row["end_frame"])
        for one in found.get(row["file"], []):
            common = min(one.last, last) - max(one.first, first)
            if common > 0.8 * (max(one.last, last) - min(one.first, first)):
                offsets.append((abs(one.first - first), abs(one.last - last)))
    assert len(cuts) == 92 and len(offsets) >= 0.97 * 92
    assert np.median(offsets) <= 1 and np.percentile(offsets, 90) <= 4


def shared(one, other):
    """Common time of two parts as a share of the time of either."""
    if one.recording != other.recording:
        return 0.0
    common = min(one.end, other.end) - max(one.start, other.start)
    return common / (max(one.end, other.end) - min(one.start, other.start))


def test_one_example_finds_the_motions_of_its_action(unpacked):
    """R-precision: the share of the best R matches that are one of the R other cuts."""
    folder = unpacked("hdm05_long")
    recordings = read_recordings(folder / "bvh").recordings
    corpus = motion_features.build_corpus(recordings)
    files = [recording.file for recording in recordings]
    truth = []
    for row in table(folder / "truth.csv"):
        recording = files.index(row["file"])
        frames = int(row["first_frame"]), int(row["last_frame"])
        truth.append(
            (row["action"], Span(recording, *(at / recordings[recording].rate for at in frames)))
        )
    counts = Counter(action for action, _ in truth)
    precisions = []
    for action, example in truth[::4]:
        others = [span for own, span in truth if own == action and span != example]
        found = family_search.find_like(corpus, [example], counts[action] - 1)
        right = sum(any(shared(match.span, one) >= 0.5 for one in others) for match in found)
        precisions.append(right / len(others))
    assert len(truth) == 288 and np.mean(precisions) >= 0.88


def test_families_are_the_actions_of_long_takes(unpacked):
    """Precision and recall of the clips of families that are offered, against cuts by hand."""
    folder = unpacked("hdm05_long")
    corpus = motion_features.build_corpus(read_recordings(folder / "bvh").recordings)
    joined = motion_features.join_features(corpus)
    files = [recording.file for recording in corpus.recordings]
    truth = []
    for row in table(folder / "truth.csv"):
        recording = files.index(row["file"])
        frames = int(row["first_frame"]), int(row["last_frame"])
        truth.append(
            (
                row["action"],
                Span(recording, *(at / corpus.recordings[recording].rate for at in frames)),
            )
        )
    clips, right, hits = 0, 0, set()
    for family in family_search.find_families(corpus):
        if family_search.assess(joined, family).reasons:
            continue
        own = [
            [at for at, (_, span) in enumerate(truth) if shared(span, member.span) >= 0.5]
            for member in family.members
        ]
        counts = Counter(truth[at][0] for found in own for at in found)
        action = counts.most_common(1)[0][0] if counts else None
        found = {at for each in own for at in each if truth[at][0] == action}
        clips, right, hits = clips + len(own), right + len(found), hits | found
    assert right / clips >= 0.90 and len(hits) / len(truth) >= 0.80


def test_proposed_controls_include_those_of_most_recipes_and_explain_as_much(real_data):
    found = [proposed_controls.propose(name, real_data) for name in proposed_controls.RECIPES]
    assert sum(not one.lacking for one in found) >= 4, found
    assert all(one.remaining <= one.remaining_by_hand for one in found), found
