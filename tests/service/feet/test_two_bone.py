"""Limbs: which are found, and inverse kinematics of two bones."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.feet import footsteps, limbs
from posefield.feet.limbs import Limb
from posefield.motion import hinges, quat, skeleton
from posefield.motion.hinges import FREE, MOST

# Root, hip joint of no length, hip, knee, ankle, ball; spine, chest, shoulder, elbow, wrist, hand;
# the other shoulder, elbow and wrist, and a head.
PARENTS = (-1, 0, 1, 2, 3, 4, 0, 6, 7, 8, 9, 10, 7, 12, 13, 7)
BONES = np.array(
    [
        [0, 0, 0],
        [0.02, 0, 0],
        [0.08, 0, 0],
        [0, -0.42, 0.01],
        [0, -0.40, -0.01],
        [0, -0.06, 0.13],
        [0, 0.2, 0],
        [0, 0.3, 0],
        [0.18, 0, 0],
        [0.28, 0, 0.01],
        [0.26, 0, -0.01],
        [0.06, 0, 0],
        [-0.18, 0, 0],
        [-0.28, 0, 0],
        [-0.26, 0, 0],
        [0, 0.2, 0],
    ]
)
LEG, ARM = Limb(2, 3, 4, 5), Limb(8, 9, 10, 11)


def poses(rng, frames=30, size=0.3):
    """Random smooth poses: rotations (F, J, 4) and roots (F, 3)."""
    waves = np.sin(np.linspace(0.0, 3.0, frames)[:, None, None] + rng.normal(size=(1, 16, 3)))
    return quat.exp(size * waves), np.tile([0.0, 0.95, 0.0], (frames, 1))


def flexed(angles):
    """Rotations (F, 4) of a knee that bends to the front by angles (F,), rad."""
    return quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.asarray(angles))


def forward(rotations, roots):
    return skeleton.forward_kinematics(PARENTS, rotations, skeleton.translations(BONES, roots))


def moved(rotations, limb, found):
    turned = rotations.copy()
    turned[:, limb.upper], turned[:, limb.middle], turned[:, limb.lower] = found
    return turned


def test_limbs_are_chosen_by_feet_and_exact_joints():
    plain = footsteps.choose_limbs(PARENTS, BONES, (5,), ())
    assert plain[0].legs == (LEG,) and not plain[2] and not plain[0].fixed
    hand = footsteps.choose_limbs(PARENTS, BONES, (5,), {11})
    assert hand[0].kept == (ARM,) and not hand[0].fixed
    trunk = footsteps.choose_limbs(PARENTS, BONES, (5,), {0})
    assert trunk[0].fixed
    foot = footsteps.choose_limbs(PARENTS, BONES, (5,), {5})
    assert foot[0].legs == () and foot[0].kept == (LEG,)
    assert foot[2] == ((5, "is as predicted: its leg meets an exact target"),)
    none = footsteps.choose_limbs(PARENTS, BONES, (1,), ())
    assert none[2] == ((1, "is as predicted: no two bones lead to it"),)
    both = footsteps.choose_limbs(PARENTS, BONES, (5, 4), ())
    assert both[1] == (0,)
    assert both[2] == ((4, "is as predicted: its leg moves another foot"),)


def test_the_end_reaches_its_target_and_keeps_its_orientation(rng):
    rotations, roots = poses(rng)
    before, oriented = forward(rotations, roots)
    found = limbs.evaluate_joints(PARENTS, BONES, [LEG.tip], rotations, roots)
    shift = np.tile([0.0, -0.03, 0.0], (30, 1))
    target = before[:, 4] + 0.02 * rng.normal(size=(30, 3)) + [0.0, 0.05, 0.0]
    end = limbs.reach(found, LEG, shift, target)
    turned = moved(rotations, LEG, limbs.solve(found, LEG, end))
    after, now = forward(turned, roots + shift)
    assert np.abs(after[:, 4] - target).max() < 1e-12
    same = np.abs(np.sum(now[:, 4] * oriented[:, 4], axis=-1))
    assert np.abs(same - 1.0).max() < 1e-12
    others = [joint for joint in range(16) if joint not in (2, 3, 4, 5)]
    assert np.abs(after[:, others] - before[:, others] - shift[:, None]).max() < 1e-12


def off_hinge(rotations):
    """Largest angle of a knee off an axis along x, rad."""
    return np.abs(quat.log(rotations[:, LEG.middle])[:, 1:]).max()


def test_a_knee_with_a_hinge_bends_about_its_axis_alone(rng):
    rotations, roots = poses(rng)
    rotations[:, LEG.middle] = flexed(np.linspace(0.2, 1.4, 30))
    bones = (np.tile(BONES[joint], (30, 1)) for joint in (LEG.middle, LEG.lower))
    knee = replace(hinges.measure(3, rotations[:, LEG.middle], *bones), joint=LEG.middle)
    before, oriented = forward(rotations, roots)
    leg = limbs.find_limb(PARENTS, BONES, LEG.tip, [knee])
    assert leg == replace(LEG, hinge=knee)
    found = limbs.evaluate_joints(PARENTS, BONES, [LEG.tip], rotations, roots)
    target = before[:, LEG.lower] + 0.06 * rng.normal(size=(30, 3)) + [0.0, 0.05, 0.0]
    end = limbs.reach(found, leg, np.zeros((30, 3)), target)
    turned = moved(rotations, leg, limbs.solve(found, leg, end))
    after, now = forward(turned, roots)
    assert np.abs(after[:, LEG.lower] - before[:, LEG.upper] - end).max() < 1e-9
    same = np.abs(np.sum(now[:, LEG.lower] * oriented[:, LEG.lower], axis=-1))
    assert np.abs(same - 1.0).max() < 1e-12
    assert off_hinge(turned) < np.radians(0.1)
    # Negative control: without its hinge the knee turns off its axis.
    free = moved(rotations, LEG, limbs.solve(found, LEG, end))
    assert off_hinge(free) > np.radians(3.0)


def test_a_knee_with_a_hinge_stays_within_its_range(rng):
    rotations, roots = poses(rng)
    rotations[:, LEG.middle] = flexed(np.linspace(0.4, 1.0, 30))
    bones = (np.tile(BONES[joint], (30, 1)) for joint in (LEG.middle, LEG.lower))
    leg = replace(LEG, hinge=hinges.measure(LEG.middle, rotations[:, LEG.middle], *bones))
    found = limbs.evaluate_joints(PARENTS, BONES, [LEG.tip], rotations, roots)
    for scale, bound in ((0.5, 1.0 + MOST), (1.5, 0.4 - MOST)):
        chord = found.position(LEG.lower) - found.position(LEG.upper)
        bent = limbs.solve(found, leg, scale * chord)[1]
        flexion = quat.log(bent)[:, 0]
        assert (np.abs(flexion - 0.7) < 0.3 + MOST + 1e-4).all()
        assert flexion[0 if scale > 1.0 else -1] == pytest.approx(bound, abs=0.02)
        # Within the reach of the hinge, the end is met and the angle is within FREE.
        end = limbs.reach(found, leg, np.zeros((30, 3)), found.position(LEG.upper) + scale * chord)
        flexion = quat.log(limbs.solve(found, leg, end)[1])[:, 0]
        assert (0.4 - FREE - 0.01 < flexion).all() and (flexion < 1.0 + FREE + 0.01).all()


def test_a_limb_out_of_reach_is_never_stretched(rng):
    rotations, roots = poses(rng)
    before, _ = forward(rotations, roots)
    found = limbs.evaluate_joints(PARENTS, BONES, [LEG.tip], rotations, roots)
    far = before[:, 4] + [0.0, -0.5, 0.3]
    length = np.linalg.norm(limbs.reach(found, LEG, np.zeros((30, 3)), far), axis=-1)
    whole = np.linalg.norm(BONES[3]) + np.linalg.norm(BONES[4])
    assert (length <= whole).all() and (length > 0.99 * whole).all()


@pytest.mark.parametrize("firm", [0.7, 0.79])
def test_reach_is_firm_and_then_soft(firm):
    distance = np.linspace(0.5, 1.0, 500)
    found = limbs.soften(distance, np.full(500, firm), 0.8)
    assert (found[distance <= firm] == distance[distance <= firm]).all()
    assert (np.diff(found) >= 0.0).all() and found.max() <= 0.8
    assert np.diff(found).max() <= np.diff(distance).max() * (1.0 + 1e-9)


def test_a_knee_that_is_overstretched_bends_to_its_front_in_a_kick_too():
    """The leg hangs, and is raised until above level, so that its front is up and then behind."""
    raised = np.concatenate([np.zeros(60), np.linspace(0.0, -2.4, 41)])
    # The knee bends, is overstretched around where the leg is level, and bends again.
    bend = np.concatenate([np.full(60, 0.6), 0.25 + 0.35 * np.cos(np.linspace(0.0, 6.0, 41))])
    rotations = np.tile(quat.IDENTITY, (101, len(PARENTS), 1))
    rotations[:, LEG.upper] = flexed(raised)
    # A knee that bends, is overstretched while the leg is level, and bends again.
    rotations[:, LEG.middle] = flexed(bend)
    roots = np.tile([0.0, 0.95, 0.0], (101, 1))
    own = limbs.evaluate_joints(PARENTS, BONES, [LEG.tip], rotations, roots)
    end = 0.9 * (own.position(LEG.lower) - own.position(LEG.upper))
    turned = moved(rotations, LEG, limbs.solve(own, LEG, end))
    positions, _ = forward(turned, roots)
    knee = positions[:, LEG.middle] - positions[:, LEG.upper]
    front = np.stack([0.0 * raised, -np.sin(raised), np.cos(raised)], axis=1)
    assert np.sum(knee * front, axis=-1).min() > 0.1
    assert np.linalg.norm(np.diff(knee, axis=0), axis=-1).max() < 0.1


def folded_leg(flexion):
    """Poses of a leg whose thigh points to the front and a little aside, with a flexed knee."""
    count = len(flexion)
    rotations = np.tile(quat.IDENTITY, (count, len(PARENTS), 1))
    aside = quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.linspace(0.0, 0.3, count))
    rotations[:, LEG.upper] = quat.mul(aside, flexed(np.full(count, -1.6)))
    rotations[:, LEG.middle] = flexed(flexion)
    roots = np.tile([0.0, 0.45, 0.0], (count, 1))
    return rotations, limbs.evaluate_joints(PARENTS, BONES, [LEG.tip], rotations, roots), roots


def test_a_knee_that_is_folded_does_not_turn_over_when_its_foot_is_placed():
    """Joins of deep squats fold knees beyond 180 degrees, where the plane of the leg turns over."""
    rotations, own, roots = folded_leg(np.linspace(2.3, 3.5, 30))
    chord = own.position(LEG.lower) - own.position(LEG.upper)
    end = chord + np.linspace(0.0, 1.0, 30)[:, None] * [-0.1, -0.2, 0.0]
    after, _ = forward(moved(rotations, LEG, limbs.solve(own, LEG, end)), roots)
    steps = np.linalg.norm(np.diff(after[:, LEG.middle], axis=0), axis=-1)
    assert steps.max() < 0.03
    # A knee that turns with the direction of the foot from the hip jumps.
    turn = limbs.shortest_turn(chord, end)
    knee = quat.rotate(turn, own.position(LEG.middle) - own.position(LEG.upper))
    assert np.linalg.norm(np.diff(knee, axis=0), axis=-1).max() > 0.2
