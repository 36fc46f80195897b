"""Contacts of a foot: hysteresis of speed and height, runs of frames, and cycles that wrap."""

import numpy as np
import pytest

from posefield.motion import contact_detection
from posefield.motion.contact_detection import DEFAULT

RATE = 120.0


def stepping(swings, seconds=2.0, lift=0.1, stride=0.5):
    """Path of a foot that stands but for swings of given times, which each go `stride` ahead."""
    times = np.arange(round(seconds * RATE) + 1) / RATE
    path = np.zeros((len(times), 3))
    path[:, 1] = 0.05
    for first, last in swings:
        share = np.clip((times - first) / (last - first), 0.0, 1.0)
        path[:, 2] += stride * share * share * (3.0 - 2.0 * share)
        path[:, 1] += lift * np.sin(np.pi * share)
    return path


def spans(mask):
    """First and last time of each contact, s."""
    return [(run[0] / RATE, run[-1] / RATE) for run in contact_detection.runs(mask, False)]


def test_a_foot_is_in_contact_but_for_its_swings():
    found = contact_detection.detect_contacts(stepping([(0.5, 0.9), (1.4, 1.7)]), RATE, False)
    assert np.allclose(spans(found), [(0.0, 0.5), (0.9, 1.4), (1.7, 2.0)], atol=0.05)


def test_a_contact_grows_from_what_is_certain_to_what_is_possible():
    """A foot that rolls on at 0.3 m/s stays in contact, but does not begin one."""
    path = stepping([])
    path[:, 2] = np.where(np.arange(len(path)) < 120, 0.0, 0.3 * (np.arange(len(path)) - 120) / 120)
    assert contact_detection.detect_contacts(path, RATE, False).all()
    rolling = stepping([])
    rolling[:, 2] = 0.3 * np.arange(len(rolling)) / RATE
    assert not contact_detection.detect_contacts(rolling, RATE, False).any()
    high = stepping([])
    high[:, 1] += np.where(np.arange(len(high)) < 60, 0.0, 0.045)
    raised = contact_detection.detect_contacts(high, RATE, False)
    # Within 5.25 cm it is possible, and joins the certain contact; the step up itself is fast.
    assert raised[:55].all() and not raised[70:].any()


@pytest.mark.parametrize("cyclic", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_no_contact_and_no_gap_between_contacts_is_short(cyclic, seed):
    rng = np.random.default_rng(seed)
    mask = np.repeat(rng.random(40) < 0.5, rng.integers(1, 30, 40))
    found = contact_detection.tidy_contacts(mask, RATE, cyclic)
    contacts, gaps = (contact_detection.runs(one, cyclic) for one in (found, ~found))
    assert all(len(run) >= DEFAULT.shortest * RATE for run in contacts)
    inner = [run for run in gaps if cyclic or (run[0] > 0 and run[-1] < len(found) - 1)]
    if len(contacts) > 0:
        assert all(len(run) >= DEFAULT.shortest_gap * RATE for run in inner)
    again = contact_detection.tidy_contacts(found, RATE, cyclic)
    assert np.array_equal(again, found)


@pytest.mark.parametrize("shift", [0, 17, 60, 119, 200])
def test_a_cycle_has_the_contacts_of_its_shifted_self(shift):
    """A cycle that begins elsewhere has the same contacts."""
    path = stepping([(0.5, 0.9)])
    length = len(path) - 1
    gone = path[-1] - path[0]
    twice = np.concatenate([path[:-1], path + gone * np.array([1.0, 0.0, 1.0])])
    own = contact_detection.detect_contacts(path, RATE, True)
    shifted = contact_detection.detect_contacts(twice[shift : shift + length + 1], RATE, True)
    assert own[0] == own[-1] and shifted[0] == shifted[-1]
    assert np.array_equal(np.roll(own[:-1], -shift), shifted[:-1])
    # Negative control: a clip that ends there has other contacts at its ends.
    short = stepping([(0.06, 1.94)], lift=0.8, stride=3.0)
    wrapped, cut = (contact_detection.detect_contacts(short, RATE, c) for c in (True, False))
    assert wrapped[0] and not cut[0]


def test_the_ground_of_a_motion_in_place_moves_under_its_feet():
    """A walk without its travel: standing feet go back as the ground does."""
    left, right = stepping([(0.0, 0.8)]), stepping([(1.0, 1.8)])
    ground = np.array([0.0, 0.0, -0.9])
    drift = np.arange(len(left))[:, None] / RATE * ground
    feet = np.stack([left + drift, right + drift], axis=1)
    found = contact_detection.ground_velocity(feet, RATE)
    assert np.allclose(found, ground, atol=1e-6)
    for path, still in ((left, feet[:, 0]), (right, feet[:, 1])):
        expected = contact_detection.detect_contacts(path, RATE, False)
        moving = contact_detection.detect_contacts(still, RATE, False, found)
        assert expected.any() and np.array_equal(moving, expected)
        assert not contact_detection.detect_contacts(still, RATE, False).any()


FPS = 30.0


SECONDS = np.arange(31) / FPS


def foot(height, along):
    """One foot's places (F, 1, 3) of heights and ways forward, m."""
    return np.stack([np.zeros(31), height + 0.0 * SECONDS, along], axis=-1)[:, None]


def test_a_foot_that_slides_does_so_at_its_speed():
    assert contact_detection.mean_skate_speed(foot(0.1, 0.4 * SECONDS), FPS) == pytest.approx(0.4)
    assert contact_detection.mean_skate_speed(foot(0.1, 0.4 * SECONDS), 2 * FPS) == pytest.approx(
        0.8
    )


@pytest.mark.parametrize(("height", "slowest"), [(0.0, 5.0), (0.015, 5.0), (0.3, 0.0)])
def test_only_what_is_within_2_cm_of_the_ground_counts(height, slowest):
    late = SECONDS > 0.5
    found = contact_detection.mean_skate_speed(foot(height * late, 9.0 * late), FPS)
    assert found > slowest if slowest else found == 0.0


def test_every_motion_of_a_crowd_has_its_own_floor():
    low, high = foot(0.0, 0.1 * SECONDS), foot(7.0, 0.2 * SECONDS)
    assert contact_detection.mean_skate_speed(np.stack([low, high]), FPS) == pytest.approx(
        [0.1, 0.2]
    )
