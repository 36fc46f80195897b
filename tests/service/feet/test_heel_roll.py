"""Rolling feet: heel, ball and leg lengths, against the geometry that they must have."""

import numpy as np
import pytest
from few_feet import FootPath, foot_rows, plan_path

from posefield.common.units import UP
from posefield.feet import ball_path, limbs, stance_rows
from posefield.feet.limbs import Limb
from posefield.feet.stance_rows import Cycle
from posefield.locomotion import floor_plane
from posefield.motion import quat
from posefield.motion.contact_detection import FootContact

RATE, FRAMES = 60.0, 60
FOOT = FootContact(0, 0.04, 0.3, 0.5, 0.05)
LENGTH, FLAT = 0.13, -0.3
ANKLE, HEEL = FOOT.height - LENGTH * np.sin(FLAT), ball_path.HEEL * LENGTH * np.cos(FLAT)


def rolling(heading=0.4, drift=0.0):
    """A foot that comes down on its heel, is flat and goes to tiptoe; it slides at `drift`, m/s."""
    times = np.arange(FRAMES) / RATE
    pitch = FLAT + np.interp(times, [0.0, 0.2, 0.7, 1.0], [0.35, 0.0, 0.0, -0.8])
    arms = LENGTH * floor_plane.at_height(
        np.cos(pitch) * np.exp(1j * heading), np.sin(pitch)
    ).reshape(FRAMES, 3)
    toes_up = np.maximum(pitch - FLAT, 0.0)
    back = (np.cos(toes_up) + 1j * np.sin(toes_up)) * (-HEEL - 1j * ANKLE)
    ahead = np.exp(1j * heading)
    # The heel is on the floor; from then on the ball keeps its place.
    ball = arms - floor_plane.at_height(back.real * ahead, back.imag)
    ball[12:] = ball[12]
    ball += floor_plane.at_height(drift * times * ahead, np.zeros(FRAMES))
    return ball, arms, floor_plane.at_height(back.real * ahead, back.imag)


@pytest.mark.parametrize("cycle", [None, Cycle(1.0 + 0.2j, np.exp(0.3j))])
def test_the_heel_keeps_its_place_and_then_the_ball(cycle):
    ball, arms, back = rolling(drift=0.05)
    feet = foot_rows([FootPath(ball, RATE, cycle)], FOOT, arms, FLAT)
    stance = range(50)
    path = plan_path(FootPath(ball, RATE, cycle), [stance], FOOT, feet=feet).positions
    heel = (path - arms + back)[:12]
    assert np.abs(heel - heel[0]).max() < 2e-3 and np.abs(heel @ UP).max() < 1e-3
    assert np.abs(path[12:50, ::2] - path[12, ::2]).max() < 1e-9
    # A ball that stands from the beginning presses its heel into the floor.
    plain = plan_path(FootPath(ball, RATE, cycle), [stance], FOOT).positions
    assert ((plain - arms + back)[0] @ UP) < -0.02


def test_a_foot_is_flat_at_the_pitch_that_it_keeps():
    ball, arms, _ = rolling()
    feet = foot_rows([FootPath(ball, RATE)], FOOT, arms)
    contacts = stance_rows.from_intervals([[range(50)]])
    assert ball_path.flat_pitches(arms, contacts, feet.rows) == pytest.approx(FLAT, abs=0.02)


def test_frames_in_which_the_foot_moves_are_no_stance():
    ball, arms, _ = rolling()
    ball[45:, 2] += 0.01 * np.arange(15.0) ** 1.5
    feet = foot_rows([FootPath(ball, RATE)], FOOT, arms, FLAT)
    ends = ball_path.trimmed(stance_rows.from_intervals([[range(3, 56)]]), feet)
    assert ends.begins.tolist() == [3] and 45 <= ends.ends[0] <= 48
    # A motion that ends in a stance goes on in it.
    last = ball_path.trimmed(stance_rows.from_intervals([[range(3, FRAMES)]]), feet)
    assert last.ends.tolist() == [FRAMES]


PARENTS = (-1, 0, 1, 2, 3)
BONES = np.array(
    [[0.0, 1.0, 0.0], [0.1, 0.0, 0.0], [0.0, -0.4, 0.0], [0.0, -0.4, 0.0], [0, -0.05, 0.12]]
)
LEG = Limb(1, 2, 3, 4)


def legs(bends):
    """Poses (F) of a leg whose knee is bent by angles (F,), rad."""
    rotations = np.zeros((len(bends), 5, 4))
    rotations[..., 0] = 1.0
    rotations[:, 2] = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), bends)
    return limbs.evaluate_joints(PARENTS, BONES, [4], rotations, np.zeros((len(bends), 3)))


def test_a_leg_is_never_longer_than_straight_and_stays_where_it_is():
    bends = np.repeat([0.05, 0.3, 1.5], 41)
    poses = legs(bends)
    source = np.linalg.norm(poses.position(3) - poses.position(1), axis=-1)
    more = np.tile(np.linspace(-0.1, 0.1, 41), 3)
    chord = limbs.leg_chord(poses, LEG, source + more)
    assert chord[more == 0.0] == pytest.approx(source[more == 0.0], abs=1e-12)
    assert chord.max() < 0.8 and (np.diff(chord.reshape(3, 41)) > 0.0).all()
    # A straight leg presses its heel before it bends; a bent knee follows nearly as far.
    pressed = (chord - source - more)[more < 0]
    assert 0.0 <= pressed.min() and 0.8 * limbs.PRESS < pressed.max() <= limbs.PRESS
    assert pressed[-20:].max() < 1e-4 and np.abs(chord - source - more)[-21:].max() < 0.02


def test_a_lifted_heel_leaves_the_ball_and_gives_the_leg_its_length():
    poses = legs(np.full(5, 0.05))
    arm = poses.position(4) - poses.position(3)
    away = np.array([0.0, -0.005, -0.02]) * np.arange(5.0)[:, None]
    offset = poses.position(1) - poses.position(4) - away
    chord = limbs.leg_chord(poses, LEG, np.linalg.norm(offset + arm, axis=-1))
    turns = ball_path.heel_turns(offset, arm, chord)
    lifted = quat.rotate(turns, arm)
    assert np.linalg.norm(offset + lifted, axis=-1) == pytest.approx(chord, abs=1e-9)
    assert (-lifted @ UP)[1:].min() > (-arm @ UP).max()
    assert np.linalg.norm(offset + arm, axis=-1)[-1] > chord[-1] + 5e-3


def test_ends_of_toes_are_not_below_the_floor():
    pitch = np.array([-1.2, -0.4, 0.0, 0.5])
    toe = 0.06 * floor_plane.at_height(np.cos(pitch) * np.exp(0.3j), np.sin(pitch))
    bent = quat.rotate(ball_path.toe_bends(toe, np.full(4, -0.01)), toe)
    assert bent @ UP == pytest.approx(np.maximum(toe @ UP, -0.01), abs=1e-9)
    assert np.linalg.norm(bent, axis=-1) == pytest.approx(0.06)
    assert bent[2:] == pytest.approx(toe[2:])
