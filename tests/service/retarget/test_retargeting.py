"""Tests of retargeting: equal bodies, rest poses, proportions, feet and hands."""

from collections import namedtuple
from dataclasses import replace

import numpy as np
import pytest
import rig_files

from posefield.common.errors import InvalidField
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.question.results import StanceResult
from posefield.retarget import planted_legs, role_map
from posefield.retarget.retargeting import HandGoal, retarget
from posefield.retarget.role_map import PosedBody
from posefield.rigs.rig import read_rig

ROUNDING = 1e-5
"""Rounding of poses in single precision, m: the model's rotations are unit to 1e-7."""
SHINS = ("LeftFoot", "RightFoot")
LEGS = (*SHINS, "LeftLeg", "RightLeg")
FEET = ("LeftToeBase", "RightToeBase")


Retargeted = namedtuple("Retargeted", ("clip", "report"))


@pytest.fixture
def onto(walk, roles, tmp_path):
    """Function that retargets the walk to a figure."""

    def made(figure, clip=walk, own_roles=roles, **settings):
        rig = read_rig(rig_files.write_glb(tmp_path / "rig.glb", figure))
        return Retargeted(*retarget(clip, rig, own_roles, **settings))

    return made


def apart(one, other):
    """Largest distance of joints of equal names of two clips, m."""
    names = [name for name in one.skeleton.names if name in other.skeleton.names]
    assert len(names) > 20
    first, second = (
        clip.positions()[:, [clip.skeleton.names.index(name) for name in names]]
        for clip in (one, other)
    )
    return float(np.abs(first - second).max())


def place(clip, name):
    return clip.positions()[:, clip.skeleton.names.index(name)]


def test_a_rig_of_the_same_skeleton_has_the_same_motion(walk, figure, onto):
    made = onto(figure)
    assert apart(made.clip, walk) < ROUNDING
    assert np.abs(made.clip.rotations - walk.rotations).max() < ROUNDING
    assert (made.report.scale, made.report.missing) == (pytest.approx(1.0), ())
    assert made.report.legs_turned < 1e-4 and made.report.warnings == ()
    # Other proportions have another motion.
    assert apart(onto(figure.longer(1.02, *LEGS)).clip, walk) > 100 * ROUNDING


def test_axes_rest_pose_heading_and_a_root_above_the_hips_do_not_matter(walk, figure, onto):
    lowered = figure.turned("LeftArm", (0, 0, 1), -50.0).turned("RightArm", (0, 0, 1), 50.0)
    others = (figure.framed(1), lowered, figure.turned("Hips", (0, 1, 0), 90.0))
    for other in (*others, figure.with_root("root")):
        made = onto(other)
        assert apart(made.clip, walk) < ROUNDING
    assert np.array_equal(made.clip.rotations[:, 0], np.tile(quat.IDENTITY, (len(walk), 1)))


PROPORTIONS = {
    "taller": (1.2, LEGS),
    "shorter": (0.85, LEGS),
    "long shins": (1.25, SHINS),
    "long thighs": (1.25, ("LeftLeg", "RightLeg")),
    "wide hips": (1.5, ("LeftUpLeg", "RightUpLeg")),
    "long feet": (1.4, FEET),
}


@pytest.mark.parametrize("kind", PROPORTIONS)
def test_feet_stand_on_other_proportions(figure, onto, kind):
    factor, names = PROPORTIONS[kind]
    made = onto(figure.longer(factor, *names))
    found = made.report
    # The motion's feet roll; copied orientations slide, which is the negative control.
    assert found.skate_source < 0.03 and found.skate <= 1.1 * found.skate_source + 1e-4
    if kind not in ("taller", "shorter"):
        assert found.skate_copied > 1.3 * found.skate
    assert found.penetration <= 0.01
    assert np.degrees(found.legs_turned) <= 5.0
    # Neither pelvis nor knees pop: less than thrice the motion's largest acceleration.
    knee = place(made.clip, "LeftLeg")
    assert np.abs(np.diff(knee, 2, axis=0)).max() < 0.03
    assert np.abs(np.diff(made.clip.root_path, 2, axis=0)).max() < 0.01


def test_an_elbow_bends_about_its_axis_where_a_hand_is_moved(walk, roles):
    body = role_map.body_of_motion(walk.skeleton, walk.translations[0], roles)
    posed = PosedBody.of_rotations(body, walk.rotations, walk.root_path)
    arm, poses = posed.limb(("rightUpperArm", "rightLowerArm", "rightHand"))
    still = np.zeros(walk.root_path.shape)

    def off_hinge(limb):
        """Range of the angles of the elbow off its axis, rad, with the hand moved."""
        rotations = walk.rotations.copy()
        target = posed.of_role("rightHand") + np.array([0.15, 0.15, 0.1])
        planted_legs.turn_limb(rotations, limb, poses, still, target)
        turned = PosedBody.of_rotations(body, rotations, walk.root_path)
        assert np.abs(turned.of_role("rightHand") - target).max() < 1e-3
        hinge = turned.limb(("rightUpperArm", "rightLowerArm", "rightHand"))[0].hinge
        return float(np.subtract(hinge.high, hinge.low)[1:].max())

    assert off_hinge(arm) < np.radians(0.5)
    # Negative control: a limb without its hinge.
    assert off_hinge(replace(arm, hinge=None)) > np.radians(2.0)


def test_a_foot_stands_where_copied_orientations_put_it_on_average():
    copied, still = np.zeros((20, 1, 3)), np.zeros((20, 1, 3))
    copied[:, 0, 2] = np.linspace(0.0, 0.2, 20)
    feet = planted_legs.SourceFeet(("leftFoot",), still, ((range(8, 18),),), np.zeros(1))
    found = planted_legs.plan_paths(feet, copied, np.zeros(1), 60.0)
    assert found[8:18, 0, 2] == pytest.approx(copied[8:18, 0, 2].mean())


def test_told_stances_are_kept(walk, figure, onto):
    """A foot that is told to stand in frames in which it does not moves as the motion's does."""
    tall = figure.longer(1.25, *SHINS)
    told = StanceResult("LeftToeBase", 0.7, 1.0, (0.0, 0.0, 0.0))
    found = onto(tall, stances=[told]).report
    assert found.skate_source > 0.1 and found.skate == pytest.approx(found.skate_source, rel=0.01)
    # Without stances there is no skate to measure.
    assert onto(tall, stances=[]).report.skate == 0.0


def test_the_root_travels_in_proportion_or_as_the_motion(walk, figure, onto):
    tall = figure.longer(1.2, *LEGS)
    way = walk.root_path[-1] - walk.root_path[0]
    for travel, factor in (("scaled", 1.2), ("kept", 1.0)):
        made = onto(tall, travel=travel)
        own = made.clip.root_path[-1] - made.clip.root_path[0]
        assert np.abs(own - factor * way)[[0, 2]].max() < 0.01
        assert made.report.skate < 1.1 * made.report.skate_source + 1e-4


def test_more_joints_follow_along_the_chain_or_rest(walk, figure, onto):
    own = figure.split("Spine", "SpineMiddle").split("LeftForeArm", "LeftArmTwist")
    own = own.with_joint("Cape", "Spine1", (0.0, -0.1, -0.2))
    made = onto(own)
    names = made.clip.skeleton.names
    # Twists and capes rest on their parents, and everything else is as on the rig without them.
    for name in ("LeftArmTwist", "Cape"):
        assert np.array_equal(
            made.clip.rotations[:, names.index(name)], np.tile(quat.IDENTITY, (len(walk), 1))
        )
    arm = [n for n in walk.skeleton.names if "Left" in n and ("Arm" in n or "Hand" in n)]
    turned = orientations(made.clip), orientations(walk)
    for name in (*arm, "Spine1", "Head"):
        one, other = (
            found[:, clip.skeleton.names.index(name)]
            for found, clip in zip(turned, (made.clip, walk), strict=True)
        )
        assert np.abs(np.abs(np.sum(one * other, axis=-1)) - 1.0).max() < ROUNDING
    middle = orientations(made.clip)[:, names.index("SpineMiddle")]
    below, above = (turned[0][:, names.index(name)] for name in ("LowerBack", "Spine"))
    between = quat.slerp(below, above, np.array(0.5))
    angles = np.linalg.norm(quat.log(quat.mul(quat.conj(middle), between)), axis=-1)
    assert np.degrees(angles).max() < 3.0


def orientations(clip):
    return skeleton.forward_kinematics(clip.skeleton.parents, clip.rotations, clip.translations)[1]


def test_a_motion_with_any_rest_pose_is_retargeted(walk, roles, figure, onto):
    """Files that are at rest with all bones along one axis, as Bandai-Namco's are."""
    lengths = np.linalg.norm(walk.translations[0], axis=-1, keepdims=True)
    odd = lengths * np.array([1.0, 0.0, 0.0])
    turns = orientations(walk)
    # Each joint's axes are turned so that the bones that end at it run along +x at rest.
    parents = walk.skeleton.parents
    children = {p: j for j, p in reversed(list(enumerate(parents)))}
    placed, frames = walk.positions(), turns.copy()
    chains = {j: c for j, c in children.items() if j >= 0 and lengths[c] > 1e-6}
    single = [j for j in chains if parents.count(j) == 1]
    offsets = walk.translations[0].copy()
    for joint in single:
        way = offsets[chains[joint]] / lengths[chains[joint]]
        tilt = tilted(np.array([1.0, 0.0, 0.0]), way)
        frames[:, joint] = quat.mul(turns[:, joint], tilt)
        offsets[chains[joint]] = odd[chains[joint]]
    above = np.concatenate(
        [np.tile(quat.IDENTITY, (len(walk), 1, 1)), frames[:, list(parents[1:])]], axis=1
    )
    offsets[0] = 0.0
    own = replace(walk.skeleton, offsets=offsets, tip_joints=(), tip_offsets=np.zeros((0, 3)))
    moved = skeleton.translations(offsets, walk.root_path)
    clip = Clip(own, quat.mul(quat.conj(above), frames), moved, walk.rate)
    assert np.abs(clip.positions() - placed).max() < ROUNDING
    made = onto(figure, clip=clip)
    # A standing pose of the motion stands in for its rest pose: trunk and head differ a little.
    for name in (*LEGS, *FEET, "LeftForeArm", "RightHand"):
        assert np.abs(place(made.clip, name) - place(walk, name)).max() < 0.06, name
    assert np.degrees(made.report.legs_turned) < 5.0


def tilted(one, other):
    axis = np.cross(one, other)
    real = 1.0 + one @ other
    return quat.normalize(np.array([max(real, 1e-9), *(axis if real > 1e-9 else (0.0, 1.0, 0.0))]))


def test_hands_meet_their_goals(walk, figure, onto):
    tall = figure.longer(1.15, *LEGS)
    goal = place(onto(tall).clip, "LeftHand")[30] + np.array([0.15, 0.15, 0.1])
    made = onto(tall, hands=(HandGoal("leftHand", 0.5, goal),))
    assert np.linalg.norm(place(made.clip, "LeftHand")[30] - goal) < 1e-3
    assert made.report.hands_missed[0] < 1e-3 and made.report.warnings == ()
    # Without the goal it is elsewhere; the other hand and the feet are as without it.
    assert np.linalg.norm(place(onto(tall).clip, "LeftHand")[30] - goal) > 0.1
    for name in ("RightHand", "LeftFoot"):
        assert np.array_equal(place(made.clip, name), place(onto(tall).clip, name))
    far = goal + np.array([0.0, 5.0, 0.0])
    missed = onto(tall, hands=(HandGoal("leftHand", 0.5, far),)).report
    assert missed.hands_missed[0] > 4.0
    assert "leftHand at 0.5 s" in missed.warnings[0] and "out of reach" in missed.warnings[0]


def test_hands_stay_at_goals_that_last(walk, figure, onto):
    tall = figure.longer(1.15, *LEGS)
    free = place(onto(tall).clip, "LeftHand")
    goal = free[30] + np.array([0.05, 0.05, 0.0])
    lasting = HandGoal("leftHand", 0.45, goal, 0.55)
    made = onto(tall, hands=(lasting,))
    away = np.linalg.norm(place(made.clip, "LeftHand") - goal, axis=-1)[27:34]
    assert away.max() < 1e-3 and made.report.hands_missed[0] < 1e-3
    # Negative control: a hand that meets the goal at its ends alone moves between them.
    ends = tuple(HandGoal("leftHand", time, goal) for time in (0.45, 0.55))
    other = place(onto(tall, hands=ends).clip, "LeftHand")
    assert np.linalg.norm(other - goal, axis=-1)[27:34].max() > 3e-3
    far = HandGoal("leftHand", 0.45, goal + np.array([0.0, 0.0, 5.0]), 0.55)
    missing = onto(tall, hands=(far,))
    away = np.linalg.norm(place(missing.clip, "LeftHand") - far.position, axis=-1)[27:34]
    assert missing.report.hands_missed[0] == pytest.approx(away.max(), abs=1e-4)
    assert np.ptp(away) > 1e-3


@pytest.mark.parametrize(
    ("goal", "said"),
    [
        (HandGoal("head", 0.5, np.zeros(3)), "a goal of 'head'"),
        (HandGoal("leftHand", 9.0, np.zeros(3)), "a goal at 9 s until 9 s, expected 0 to"),
    ],
)
def test_goals_of_no_hand_or_no_time_are_refused(figure, onto, goal, said):
    with pytest.raises(InvalidField, match=said):
        onto(figure, hands=(goal,))


def test_missing_roles_are_told(walk, figure, onto):
    kept = [j for j in range(len(figure.names)) if j not in figure.below("Neck")]
    own = rig_files.Figure(
        tuple(figure.names[j] for j in kept),
        tuple(kept.index(figure.parents[j]) if j else -1 for j in kept),
        figure.offsets[kept],
        figure.frames[kept],
    )
    found = onto(own).report
    assert set(found.missing) == {"neck", "head"}
    (warning,) = found.warnings
    assert "no joint for" in warning and "they do not move" in warning


def test_a_motion_without_legs_is_refused(roles, figure, onto):
    with pytest.raises(InvalidField, match="no joint for rightFoot"):
        onto(figure, own_roles={r: j for r, j in roles.items() if r != "rightFoot"})
