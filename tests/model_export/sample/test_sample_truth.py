"""Tests of the generator's true motions: targets, standing feet and smoothness."""

import numpy as np
import pytest
from numpy.random import PCG64, Generator

from posefield.common.errors import InvalidField
from posefield.motion import quat, skeleton
from posefield.motion.clip import assemble
from posefield_train.sample import noise_free, sample_body, sample_controls, sample_limbs

PHASES = np.linspace(0.0, 1.0, 201)
SITTING = {"stature": 1.70, "hip_height": 0.50, "turn": 40.0, "target_height": 1.2}
STANDING = {"stature": 1.80, "hip_height": 0.96, "turn": -35.0, "target_height": 0.6}


def points(count, seed=7):
    """Control points all over the allowed region, many of them on its edge."""
    rng = Generator(PCG64(seed))

    def within(bounds):
        return float(np.interp(rng.uniform(-0.2, 1.2), (0, 1), bounds))

    for _ in range(count):
        stature = within((1.62, 1.88))
        hip = within(sample_controls.limits("hip_height", stature, 0.0))
        turn = within(sample_controls.limits("turn", stature, hip))
        yield stature, hip, turn, within(sample_controls.limits("target_height", stature, hip))


def positions(point, phases=PHASES):
    rotations, root_path, offsets = noise_free.poses(point, phases)
    translations = np.repeat(offsets[None], len(phases), axis=0)
    translations[:, 0] = root_path
    return skeleton.forward_kinematics(sample_body.PARENTS, rotations, translations)


def joint(array, name):
    return array[:, sample_body.INDEX[name]]


def miss(point, phase):
    found = sample_limbs.palm_position(positions(point, np.array([phase]))[0])[0]
    return np.linalg.norm(found - noise_free.target(point))


def test_hand_reaches_the_target_at_the_end_and_no_sooner():
    assert max(miss(point, 1.0) for point in points(60)) < 1e-6
    assert min(miss(point, 0.8) for point in points(60)) > 1e-3


def test_hips_begin_at_the_hip_height():
    for point in points(20):
        assert noise_free.poses(point, np.zeros(1))[1][0, 1] == pytest.approx(point[1], abs=1e-12)


@pytest.mark.parametrize("side", sample_body.SIDES)
def test_feet_stay_planted_flat_on_the_floor(side):
    for point in points(20):
        places, turns = positions(point)
        ankle, toes = joint(places, side + "Foot"), joint(places, side + "ToeBase")
        for foot in (ankle, toes, joint(turns, side + "Foot")):
            assert np.ptp(foot, axis=0).max() < 1e-9
        assert ankle[0, 1] == pytest.approx(sample_body.ankle_height(point[0]), abs=1e-12)
        assert np.ptp(joint(places, side + "UpLeg"), axis=0).max() > 0.002


@pytest.mark.parametrize("side", sample_body.SIDES)
def test_knees_bend_forwards(side):
    for point in points(20):
        places, turns = positions(point)
        hip, knee, ankle = (joint(places, side + name) for name in ("UpLeg", "Leg", "Foot"))
        ahead = quat.rotate(joint(turns, side + "Foot"), np.array([0.0, 0.0, 1.0]))
        assert np.sum((knee - 0.5 * (hip + ankle)) * ahead, axis=-1).min() > 0.0


def test_elbows_bend_as_elbows_do():
    for point in points(30):
        rotations, _, _ = noise_free.poses(point, PHASES)
        for side, sign in sample_body.SIDES.items():
            flexion = -sign * quat.twist(joint(rotations, side + "ForeArm"), np.eye(3)[1])
            assert 0.05 < flexion.min() and flexion.max() < 2.5


@pytest.mark.parametrize(
    ("point", "name", "step"),
    [(SITTING, "stature", 4e-3), (STANDING, "hip_height", 4e-3), (SITTING, "turn", 4)],
)
def test_motion_is_smooth_in_each_control(point, name, step):
    """Halving the step halves the difference, and quarters what is left of the straight line."""

    def moved(by):
        return positions({**point, name: point[name] + by}, PHASES[::10])[0]

    here = moved(0.0)
    whole, half = (np.abs(moved(by) - here).max() for by in (step, 0.5 * step))
    assert half == pytest.approx(0.5 * whole, rel=0.1)
    bends = [np.abs(moved(by) - 2.0 * here + moved(-by)).max() for by in (step, 0.5 * step)]
    assert bends[1] < 0.3 * bends[0] + 1e-12


def test_clip_has_the_duration_and_timing_of_the_truth():
    clip = noise_free.truth_clip(STANDING, 240.0)
    assert clip.duration == pytest.approx(noise_free.duration(STANDING), abs=0.5 / 240.0)
    phases = noise_free.phases(STANDING, np.linspace(0.0, 1.0, len(clip)))
    rotations, root_path, offsets = noise_free.poses(STANDING, phases)
    expected = assemble(clip.skeleton, rotations, root_path, offsets, 240.0)
    assert np.abs(clip.positions() - expected.positions()).max() < 1e-12


@pytest.mark.parametrize("stature", sample_controls.STATURES.values())
def test_rest_pose_stands_on_the_floor_and_is_as_tall_as_its_stature(stature):
    figure = sample_body.skeleton(stature)
    still = np.tile(quat.IDENTITY, (len(figure), 1))
    places, _ = skeleton.forward_kinematics(figure.parents, still, figure.offsets)
    tips = places[list(figure.tip_joints)] + figure.tip_offsets
    assert tips[:, 1].min() == pytest.approx(0.0, abs=1e-12)
    assert tips[:, 1].max() == pytest.approx(stature, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "value"), [("hip_height", 0.40), ("turn", 91.0), ("target_height", float("nan"))]
)
def test_what_the_body_cannot_do_is_refused_by_name(name, value):
    with pytest.raises(InvalidField, match=r"cannot be reached, expected .* to ") as error:
        noise_free.truth_clip({**SITTING, name: value}, 120.0)
    assert error.value.field == name


def test_missing_and_unknown_controls_are_refused_by_name():
    with pytest.raises(InvalidField, match="missing") as missing:
        noise_free.target({"stature": 1.7})
    with pytest.raises(InvalidField, match="unknown") as unknown:
        noise_free.target({**SITTING, "weight": 70.0})
    assert (missing.value.field, unknown.value.field) == ("hip_height", "weight")
    with pytest.raises(InvalidField, match="3 values, expected 4"):
        noise_free.target([1.7, 0.5, 0.0])
