"""Tests of the search for families: planted motions are found, rests and noise are not offered."""

import discover_takes
import numpy as np
import pytest

from posefield_train.discover import family_search, motion_features

SECONDS, TAKES = 24.0, 3
ORDERS = ("RCCRRC", "CRRRCC", "CCRCRR")
"""Planted motions of each recording, raises and circles, in an order that does not repeat."""


def plan(kind):
    """Recording, begin and duration, s, of the planted motions of a kind; the hand rests else."""
    rng = np.random.default_rng(8)
    found = []
    for recording, order in enumerate(ORDERS):
        at = 1.0
        for own in order:
            seconds, rest = rng.uniform(1.5, 2.0), rng.uniform(0.9, 2.2)
            found += [(recording, at, seconds)] if own == kind else []
            at += seconds + rest
    return tuple(found)


RAISES, CIRCLES = plan("R"), plan("C")


def moving(planted, noise=0.0, seed=0):
    """Recordings whose right hand makes the planted motions: raises and circles to the side."""
    recordings = []
    for index in range(TAKES):
        times = np.arange(round(SECONDS * discover_takes.RATE) + 1) / discover_takes.RATE
        hands = np.zeros((len(times), 3))
        for kind, (_, begin, seconds) in ((k, p) for k, p in planted if p[0] == index):
            share = np.clip((times - begin) / seconds, 0.0, 1.0)
            up, side = np.sin(np.pi * share) ** 2, np.sin(2.0 * np.pi * share)
            hands += np.stack([-0.1 * up, 0.9 * up, 0.4 * side], axis=1) * (kind == "raise")
            hands += np.stack([0.5 * side, -0.1 * up, 0.8 * up], axis=1) * (kind == "circle")
        knots = np.random.default_rng(seed + index).normal(0.0, noise, (3, 49))
        wander = [np.interp(times, np.arange(49.0) / 2.0, own) for own in knots]
        recordings.append(
            discover_takes.recording(
                f"{index}.bvh", SECONDS, hands=hands + np.stack(wander, axis=1)
            )
        )
    return motion_features.build_corpus(recordings)


PLANTED = [("raise", one) for one in RAISES] + [("circle", one) for one in CIRCLES]


@pytest.fixture(scope="module")
def corpus():
    return moving(PLANTED, noise=0.02)


def kinds(span):
    """Kinds of the planted motions that lie in a part of a recording, each but for a tenth."""
    found = []
    for kind, (recording, begin, seconds) in PLANTED:
        both = min(span.end, begin + seconds) - max(span.start, begin)
        found += [kind] if span.recording == recording and both >= 0.9 * seconds else []
    return found


def offered(corpus):
    joined = motion_features.join_features(corpus)
    found = family_search.find_families(corpus)
    return [one for one in found if not family_search.assess(joined, one).reasons]


def test_planted_motions_are_found_as_families_of_their_own(corpus):
    """A clip may have some of the rest before and after its motion."""
    families = offered(corpus)
    found = [[kinds(member.span) for member in family.members] for family in families]
    for kind, planted in (("raise", RAISES), ("circle", CIRCLES)):
        hits = max(sum(own == [kind] for own in members) for members in found)
        assert hits >= 0.8 * len(planted), found
    clips = [own for members in found for own in members]
    assert sum(len(own) == 1 for own in clips) >= 0.9 * len(clips)
    assert all(len({tuple(own) for own in members if own}) == 1 for members in found), found


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_hand_that_wanders_without_a_pattern_is_not_offered(seed):
    wandering = moving([], noise=0.2, seed=10 * seed)
    clips = sum(len(one.members) for one in offered(wandering))
    assert clips <= 0.2 * TAKES * SECONDS / family_search.SHORTEST


def test_the_search_reports_each_candidate_and_is_repeated_exactly(corpus):
    counts = []
    one = family_search.find_families(corpus, 40, counts.append)
    assert counts == list(range(1, 41)) and one == family_search.find_families(corpus, 40)


def paths(length, frames):
    """All alignments by the steps of a match: frames of the clip for those of the query."""
    if length == 1:
        return [[0]] if frames == 1 else []
    found = []
    for rows, columns in motion_features.STEPS:
        if length > rows and frames > columns:
            found += [own + [frames - 1] * rows for own in paths(length - rows, frames - columns)]
    return found


@pytest.mark.parametrize(("length", "frames"), [(5, 3), (5, 9), (7, 8)])
def test_the_alignment_is_the_best_of_all(length, frames):
    apart = np.random.default_rng(length * frames).uniform(0.1, 1.0, (length, frames))
    every = {tuple(path) for path in paths(length, frames)}
    costs = {path: apart[np.arange(length), list(path)].sum() for path in every}
    found = tuple(motion_features.align(apart).tolist())
    assert costs[found] == pytest.approx(min(costs.values()), rel=1e-12)
    assert len(every) == 1 or max(costs.values()) > costs[found]


@pytest.mark.parametrize(("length", "frames"), [(5, 2), (5, 10)])
def test_a_clip_of_another_duration_is_not_aligned(length, frames):
    assert not paths(length, frames)
    with pytest.raises(ValueError, match=f"{frames} frames, expected"):
        motion_features.align(np.ones((length, frames)))
