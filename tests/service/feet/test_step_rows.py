"""Paths of many feet at once, against the system of one foot."""

import time

import numpy as np
import pytest

from posefield.feet import ball_path, stance_rows, step_rows
from posefield.feet.stances import FootPath, Interval
from posefield.motion.foot_contacts import FootContact

RATE, FRAMES = 30.0, 300
FOOT = FootContact(0, 0.04, 0.3, 0.5, 0.08)


def path_of(seed, frames=FRAMES):
    """A path over the floor that goes on and wavers, m."""
    stream = np.random.default_rng(seed)
    steps = stream.normal(0.01, 0.01, frames) + 1j * stream.normal(0.0, 0.01, frames)
    return np.cumsum(steps)


def placed(path, found, values):
    """The change of one path, by the system of all its frames."""
    return ball_path.smooth_change(path, found, RATE, None, values)


@pytest.mark.parametrize(
    "found",
    [
        [Interval(0, 20), Interval(30, 50), Interval(61, 100), Interval(103, 300)],
        [Interval(5, 8), Interval(20, 22), Interval(41, 44)],
        [Interval(150, 170)],
    ],
)
def test_swings_solved_alone_are_those_of_the_whole_system(found):
    path = path_of(1)
    values = np.array([path[own.begin : own.end].mean() for own in found])
    rows = [np.full(len(found), 0), *(np.array(own) for own in zip(*map(ends, found), strict=True))]
    own = step_rows.smooth_change(path[None], stance_rows.Runs(*rows), values, RATE)[0]
    # A change ends 2 s after a stance, where a millionth of it is left: 0.1 micrometres.
    whole = real_and_imaginary(path, found, values)
    assert np.abs(own - whole).max() < 1e-7
    for stance, value in zip(found, values, strict=True):
        assert (own[stance.begin : stance.end] == value).all()
    # Negative control: a straight line between stances is not the smoothest change.
    line = path + np.interp(
        np.arange(FRAMES),
        np.concatenate([np.arange(s.begin, s.end) for s in found]),
        np.concatenate(
            [(v - path[s.begin : s.end]).real for s, v in zip(found, values, strict=True)]
        ),
    )
    assert np.abs(line.real - whole.real).max() > 1e-3


def ends(interval):
    return interval.begin, interval.end


def real_and_imaginary(path, found, values):
    """Both coordinates by the oracle, which takes given values of real paths."""
    return placed(path.real, found, values.real) + 1j * placed(path.imag, found, values.imag)


def standing(down, seed):
    """A foot (F, 3) whose prediction stands where it is down, and goes on between."""
    places = np.zeros((len(down), 3))
    moves = np.where(down, 0.0, np.random.default_rng(seed).uniform(0.0, 0.05, len(down)))
    places[:, 2], places[:, 1] = np.cumsum(moves), FOOT.height
    return places


def test_swings_are_lifted_as_those_of_one_foot():
    down = np.zeros((2, FRAMES), bool)
    for begin, end in ((0, 30), (45, 80), (100, 180), (200, 280)):
        down[0, begin:end] = True
        down[1, begin + 8 : end + 5] = True
    # Prediction and plan keep a foot for a frame at both ends of a swing.
    held = down | np.roll(down, 1, axis=1) | np.roll(down, -1, axis=1) | np.roll(down, 2, axis=1)
    paths = np.stack([standing(own, seed) for seed, own in enumerate(held)])
    feet = stance_rows.foot_rows(paths, RATE, (FOOT,), np.full(2, FOOT.height))
    found = step_rows.plan_paths(feet, down)
    for row in range(2):
        runs = ball_path.stances.runs(down[row], False)
        alone = ball_path.plan_path(FootPath(paths[row], RATE), runs, FOOT)
        assert np.abs(found.positions[row] - alone.positions).max() < 1e-9
    assert found.positions[..., 1].max() > FOOT.height + 0.05


def test_a_foot_that_never_stands_keeps_its_path():
    paths = standing(np.zeros(FRAMES, bool), 3)[None]
    feet = stance_rows.foot_rows(paths, RATE, (FOOT,), np.full(1, FOOT.height))
    found = step_rows.plan_paths(feet, np.zeros((1, FRAMES), bool))
    assert (found.positions == paths).all()


def test_a_foot_does_not_depend_on_the_others():
    down = np.random.default_rng(5).uniform(size=(40, FRAMES // 10)) > 0.5
    down = np.repeat(down, 10, axis=1)
    paths = np.stack([standing(np.zeros(FRAMES, bool), seed) for seed in range(40)])
    feet = stance_rows.foot_rows(paths, RATE, (FOOT,), np.full(40, FOOT.height))
    together = step_rows.plan_paths(feet, down).positions
    for row in (0, 17, 39):
        alone = step_rows.plan_paths(feet.select(np.array([row])), down[[row]]).positions
        assert (alone[0] == together[row]).all()


def test_many_frames_a_second_cost_little():
    """By CPU time: a system of 1,200 unknowns has five diagonals, and takes 10 ms."""
    down = np.zeros((1, 4000), bool)
    down[0, :1000] = down[0, 2200:3000] = True
    feet = stance_rows.foot_rows(standing(down[0], 0)[None], 1000.0, (FOOT,), np.array([0.04]))
    begun = time.process_time()
    found = step_rows.plan_paths(feet, down)
    assert time.process_time() - begun < 0.3
    assert (found.positions[0, :1000] == found.positions[0, 0]).all()
