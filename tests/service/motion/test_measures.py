"""Tests of measures on motions with known values."""

from dataclasses import replace

import numpy as np
import pytest
from families import sample_walk

from posefield.model_file.model_card import mean_accelerations
from posefield.motion import cycle_velocities, measures
from posefield.motion.measures import Measure, MeasuredMotion
from posefield_train.source.measured_controls import travel

# Sums and roots of numbers near one, in double precision.
ROUNDING = 1e-12
PARENTS = (-1, 0, 0)
OFFSETS = np.array([(0.0, 0.0, 0.0), (0.3, 0.4, 0.0), (0.0, -0.8, 0.1)])
FRAMES = 101
TOP = 0.3
"""Share of the motion at which the thrown joint is at its highest."""


def thrown():
    """A root that walks to the left and a joint that flies on a parabola ahead of it."""
    t = np.linspace(0.0, 1.0, FRAMES)
    root = np.stack([0.5 * t, np.full(FRAMES, 0.9), 0 * t], axis=1)
    ball = np.stack([0 * t, 2.0 - 4.0 * (t - TOP) ** 2, 3.0 * t], axis=1)
    foot = np.stack([0 * t, 0 * t, np.sin(2 * np.pi * t)], axis=1)
    positions = np.stack([root, ball, foot], axis=1)
    return MeasuredMotion(positions, 2.0, np.array([0.5, 0.0, np.pi / 6]), PARENTS, OFFSETS, 25.5)


def of(quantity, *joints, at=None, seen=None):
    return measures.evaluate(Measure(quantity, joints, at), thrown() if seen is None else seen)


def test_the_highest_moment_is_the_top_of_the_parabola():
    assert of("height", 1, at="highest") == pytest.approx(2.0, abs=ROUNDING)
    assert of("forward", 1, at="highest") == pytest.approx(3.0 * TOP, abs=ROUNDING)
    # Negative control: it comes down, and the lowest place is the farther end.
    assert of("height", 1, at="lowest") == pytest.approx(2.0 - 4.0 * (1.0 - TOP) ** 2)
    assert of("forward", 1, at="lowest") == pytest.approx(3.0)


def test_farthest_is_from_the_root():
    # The foot swings as far back as ahead, and the root has gone farther when it is back.
    assert of("forward", 2, at="farthest") == pytest.approx(-1.0, abs=1e-3)
    assert of("forward", 1, at="farthest") == pytest.approx(3.0)
    seen = thrown()
    seen.positions[:, 0, 0] *= -1.0
    seen.positions[:, 0, 0] += 0.5
    # Negative control: of a root that comes back it is the other end.
    assert of("forward", 2, at="farthest", seen=seen) == pytest.approx(1.0, abs=1e-3)


def test_bodily_quantities_hang_on_bones_alone():
    assert of("leg_length", 2) == pytest.approx(np.hypot(0.8, 0.1))
    assert of("leg_length", 1, 2) == pytest.approx(0.5 + np.hypot(0.8, 0.1))
    assert of("stature") == pytest.approx(0.4 + 0.8)
    moved = replace(thrown(), positions=np.zeros((3, 3, 3)), duration=9.0, travel=np.ones(3))
    assert of("stature", seen=moved) == of("stature")
    taller = replace(thrown(), offsets=2.0 * OFFSETS)
    assert of("stature", seen=taller) == pytest.approx(2.0 * of("stature"))


@pytest.mark.parametrize("at", [m for m in measures.MOMENTS if m != "landmark"])
@pytest.mark.parametrize("quantity", measures.POSITION_AXES)
def test_a_place_moves_with_the_motion_and_its_moment_does_not(quantity, at):
    seen, way = thrown(), np.array([3.0, 1.0, -7.0])
    elsewhere = replace(seen, positions=seen.positions + way)
    gone = of(quantity, 1, at=at, seen=elsewhere) - of(quantity, 1, at=at)
    assert gone == pytest.approx(way[measures.POSITION_AXES[quantity]], abs=1e-9)


def strolled(speed, turn):
    clip = sample_walk.walk_stride(speed, turn, 0.02)
    gone = travel(clip.rotations[:, 0], clip.root_path)
    offsets = sample_walk.SKELETON.offsets
    return MeasuredMotion(
        clip.positions(), clip.duration, gone, sample_walk.SKELETON.parents, offsets
    ), clip


def test_a_stroll_is_as_fast_and_turns_as_much_as_it_was_made_to():
    for speed, turn in ((0.7, -0.5), (1.5, 0.0), (1.1, 0.2)):
        seen, _ = strolled(speed, turn)
        assert measures.evaluate(Measure("turn"), seen) == pytest.approx(np.degrees(turn), abs=1e-9)
        # Its way is the chord of an arc as long as its speed says.
        arc = speed * seen.duration
        chord = arc * np.sinc(turn / (2 * np.pi))
        assert measures.evaluate(Measure("stride_length"), seen) == pytest.approx(chord, abs=1e-9)
        assert measures.evaluate(Measure("speed"), seen) == pytest.approx(chord / seen.duration)
    assert arc - chord > 1e-3, "negative control: an arc is longer than its chord"


VELOCITIES = np.array([[0.1, 0.4, 0.0], [-0.2, 0.7, 1e-7], [0.3, -0.5, 1.3], [0.0, 1.0, -2.5]])
"""To the left and ahead, m/s, and of the heading, rad/s."""


def test_travels_are_integrals_of_velocities_and_give_them_back():
    durations = np.array([1.0, 0.8, 1.7, 2.0])
    gone = cycle_velocities.travels(np, VELOCITIES, durations)
    steps = 4000
    shares = (np.arange(steps) + 0.5)[:, None] / steps
    headings = shares * VELOCITIES[:, 2] * durations
    ahead, left = VELOCITIES[:, 1], VELOCITIES[:, 0]
    integrals = [
        (np.cos(headings) * left + np.sin(headings) * ahead).mean(axis=0) * durations,
        (np.cos(headings) * ahead - np.sin(headings) * left).mean(axis=0) * durations,
        VELOCITIES[:, 2] * durations,
    ]
    assert np.abs(gone.T - integrals).max() < 1e-6
    assert np.abs(gone[:, :2] / durations[:, None] - VELOCITIES[:, :2]).max() > 0.1, "a chord"
    for column, quantity in enumerate(cycle_velocities.QUANTITIES):
        values = measures.travel_values(quantity, gone, durations)
        np.testing.assert_allclose(values, VELOCITIES[:, column], atol=ROUNDING)
    chosen, goals = np.array([0.0, 1.0, 1.0]), VELOCITIES[::-1]
    mixed = cycle_velocities.of_travels(
        np, cycle_velocities.matched(np, gone, durations, goals, chosen), durations
    )
    np.testing.assert_allclose(mixed[:, 0], VELOCITIES[:, 0], atol=ROUNDING)
    np.testing.assert_allclose(mixed[:, 1:], goals[:, 1:], atol=ROUNDING)


@pytest.mark.parametrize("asked", [Measure("height", (4, 5), "landmark", 0.25), Measure("turn")])
def test_a_measure_read_is_the_measure_written(asked):
    assert measures.from_dict(measures.to_dict(asked)) == asked
    assert all(value not in (None, []) for value in measures.to_dict(asked).values())


SIZE, FREQUENCY = 0.2, 2.0 * np.pi * 1.5


"""Amplitude, m, and angular frequency, rad/s, of the wave of a joint."""


PRECISION = 3e-3


"""The second difference of a wave is smaller than its acceleration by (frequency / rate)² / 12."""


def waving(rate, seconds=2.0):
    """Return positions (F, 2, 3) of a root that travels with a joint that waves sideways."""
    times = np.arange(round(seconds * rate) + 1) / rate
    root = np.stack([0.3 * np.sin(5 * times), 1.0 + 0.1 * np.cos(9 * times), 1.2 * times], axis=1)
    joint = root + SIZE * np.sin(FREQUENCY * times)[:, None] * [1.0, 0.0, 0.0]
    expected = SIZE * FREQUENCY**2 * np.abs(np.sin(FREQUENCY * times[1:-1]))
    return np.stack([root, joint], axis=1), expected


@pytest.mark.parametrize("rate", [60.0, 120.0])
def test_a_wave_accelerates_by_its_size_times_its_frequency_squared(rate):
    places, expected = waving(rate)
    # The mean over the joints counts the root, which is still relative to itself.
    found = 2.0 * mean_accelerations(places, rate)
    assert len(found) == len(places) - 2
    assert np.abs(found - expected).max() < PRECISION * expected.max()
    # Negative control: at another rate it is another acceleration.
    other = 2.0 * mean_accelerations(places, 1.1 * rate)
    assert np.abs(other - expected).max() > 10.0 * PRECISION * expected.max()


def test_the_motion_of_the_root_does_not_count():
    places, _ = waving(60.0)
    jolted = places + np.random.default_rng(1).normal(size=(len(places), 1, 3))
    still, moved = (mean_accelerations(own, 60.0) for own in (places, jolted))
    assert np.abs(moved - still).max() < 1e-9
    # Negative control: a motion of the joint alone does.
    jolted[:, 0] = places[:, 0]
    assert np.abs(mean_accelerations(jolted, 60.0) - still).max() > 1.0
