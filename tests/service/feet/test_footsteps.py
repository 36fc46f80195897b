"""Plans of whole motions: four feet, joined motions, floors, and limits of the pelvis."""

from dataclasses import replace

import numpy as np
import pytest
from few_feet import Motion, frame_rows, plan_feet

from posefield.feet import ball_path, body_plans, foot_placement, footsteps, limbs, stance_rows
from posefield.feet.footsteps import Led
from posefield.motion import quat, skeleton
from posefield.motion.contact_detection import FootContact
from posefield.question.motion_question import Floor

RATE, FRAMES = 60.0, 90
# A trunk with four legs: hip, knee, ankle of each; a head keeps the trunk from being a leg.
PARENTS = (-1, *(j for leg in range(4) for j in (0, 3 * leg + 1, 3 * leg + 2)), 0)
CORNERS = [(0.15, 0.3), (-0.15, 0.3), (0.15, -0.3), (-0.15, -0.3)]
BONES = np.array(
    [
        [0.0, 0.0, 0.0],
        *(
            bone
            for x, z in CORNERS
            for bone in ([x, 0.0, z], [0.0, -0.4, 0.05], [0.0, -0.4, -0.05])
        ),
        [0.0, 0.2, 0.5],
    ]
)
FEET = (3, 6, 9, 12)


def body(feet=FEET, held=()):
    return footsteps.choose_limbs(PARENTS, BONES, feet, held)[0]


def sliding(height=0.78, speed=0.3):
    """All legs bent a little, the root going ahead: all feet slide."""
    rotations = np.zeros((FRAMES, len(PARENTS), 4))
    rotations[..., 0] = 1.0
    for leg in range(4):
        rotations[:, 3 * leg + 1] = quat.exp(np.array([-0.3, 0.0, 0.0]))
        rotations[:, 3 * leg + 2] = quat.exp(np.array([0.6, 0.0, 0.0]))
    roots = np.zeros((FRAMES, 3))
    roots[:, 1], roots[:, 2] = height, speed * np.arange(FRAMES) / RATE
    return Motion(rotations, roots, RATE)


def contact(motion, foot, lift=0.05):
    return FootContact(foot, float(feet_of(motion)[0, FEET.index(foot), 1]), 0.3, 0.5, lift)


def feet_of(motion, bones=BONES):
    moved = skeleton.translations(bones, motion.roots)
    return skeleton.positions(PARENTS, motion.rotations, moved)[:, list(FEET)]


def alternating():
    """Probabilities of a trot: diagonal legs swing together."""
    likely = np.ones((FRAMES, 4))
    likely[20:40, [0, 3]] = likely[50:70, [1, 2]] = 0.0
    return likely


def placed(motion, plan):
    times = np.arange(FRAMES) / RATE
    return Motion(*foot_placement.place_feet(plan, times, motion.rotations, motion.roots), RATE)


def test_four_feet_stand_and_step():
    motion = sliding()
    plan = plan_feet(body(), motion, [contact(motion, foot) for foot in FEET], alternating())
    feet = feet_of(placed(motion, plan))
    for foot, steps in enumerate(plan.steps):
        assert len(steps.stances) == 2
        for stance, anchor in zip(steps.stances, steps.anchors, strict=True):
            apart = feet[stance.start : stance.stop, foot] - anchor
            assert np.abs(apart).max() < 1e-9
    ((before, after),) = foot_placement.foot_paths([plan])
    assert np.abs(after - feet).max() < 1e-9
    assert np.abs(before - feet_of(motion)).max() < 1e-9


def test_only_limbs_above_the_wanted_joints_are_turned():
    motion, times = sliding(), np.arange(FRAMES) / RATE
    plan = plan_feet(body(), motion, [contact(motion, foot) for foot in FEET])
    whole = placed(motion, plan)
    wanted = {FEET[1], len(PARENTS) - 1}
    some = Motion(
        *foot_placement.place_feet(plan, times, motion.rotations, motion.roots, wanted), RATE
    )
    assert np.array_equal(some.roots, whole.roots)
    own = feet_of(some)
    assert np.array_equal(own[:, 1], feet_of(whole)[:, 1])
    # The other legs are as predicted.
    assert np.array_equal(some.rotations[:, :4], motion.rotations[:, :4])
    assert not np.array_equal(whole.rotations[:, :4], motion.rotations[:, :4])


@pytest.mark.parametrize("floats", [-0.04, 0.04])
def test_a_character_that_floats_is_moved_to_the_floor(floats):
    motion = sliding()
    known = [contact(motion, foot) for foot in FEET]
    lifted = Motion(motion.rotations, np.add(motion.roots, [0.0, floats, 0.0]), RATE)
    plan = plan_feet(body(), lifted, known, np.ones((FRAMES, 4)))
    assert plan.grounded == pytest.approx(floats - np.clip(floats, -stance_rows.SUNK, 0.01))
    heights = feet_of(placed(lifted, plan))[..., 1]
    assert np.abs(heights - known[0].height).max() <= stance_rows.UNEVEN + 1e-9


FLOORS = [Floor(0.5, 0.0, 0.0), Floor(-0.5, 0.0, 0.0), Floor(0.1, 0.0, 0.25), Floor(0.0, 0.2, -0.2)]


@pytest.mark.parametrize("floor", FLOORS)
def test_feet_stand_and_swing_on_a_given_floor(floor):
    motion = sliding()
    known, likely = [contact(motion, foot) for foot in FEET], alternating()
    usual = plan_feet(body(), motion, known, likely)
    plan = plan_feet(body(), motion, known, likely, floor=floor)
    feet, level = feet_of(placed(motion, plan)), feet_of(placed(motion, usual))
    # Places over the floor, and heights above it, are those of a floor at height 0.
    above = feet[..., 1] - floor.heights(feet)
    assert np.abs(feet[..., [0, 2]] - level[..., [0, 2]]).max() < 1e-6
    assert np.abs(above - level[..., 1]).max() < 1e-6
    for foot, steps in enumerate(plan.steps):
        assert steps.stances == usual.steps[foot].stances
        for stance, anchor in zip(steps.stances, steps.anchors, strict=True):
            assert np.abs(feet[stance.start : stance.stop, foot] - anchor).max() < 1e-9
    if floor.is_level:
        assert plan.lowered - usual.lowered == pytest.approx(-floor.height)
    else:
        # The heights of another floor are not these.
        assert np.ptp(feet[0, :, 1]) > 0.05


def test_feet_are_tilted_as_the_floor_is():
    """The ball lies ahead of the ankle: on a slope its foot is turned, and the ball stays."""
    parents = (*PARENTS, *FEET)
    bones = np.concatenate([BONES, np.tile([0.0, -0.05, 0.12], (4, 1))])
    balls, motion, floor = (14, 15, 16, 17), sliding(), Floor(0.0, 0.0, 0.2)
    rotations = np.zeros((FRAMES, 18, 4))
    rotations[..., 0], rotations[:, :14] = 1.0, motion.rotations
    whole = Motion(rotations, motion.roots, RATE)
    character = footsteps.choose_limbs(parents, bones, balls, ())[0]
    assert [leg.lower for leg in character.legs] == list(FEET)
    height = skeleton.positions(parents, rotations, skeleton.translations(bones, motion.roots))
    known = [FootContact(ball, float(height[0, ball, 1]), 0.3, 0.5, 0.05) for ball in balls]
    plan = plan_feet(character, whole, known, alternating(), floor=floor)
    times = np.arange(FRAMES) / RATE
    turned, roots = foot_placement.place_feet(plan, times, whole.rotations, whole.roots)
    after = skeleton.positions(parents, turned, skeleton.translations(bones, roots))
    for leg, ball in zip(FEET, balls, strict=True):
        arm, tilted = after[:, ball] - after[:, leg], floor.tilted(height[0, ball] - height[0, leg])
        # Stretched legs lift their heels.
        lifted = np.arccos(np.clip(arm @ tilted / (tilted @ tilted), -1.0, 1.0))
        assert np.median(lifted) < 0.1 and lifted.max() < ball_path.MOST_LIFT
    ((_, paths),) = foot_placement.foot_paths([plan])
    assert np.abs(paths - after[:, list(balls)]).max() < 1e-9


def test_a_floor_out_of_reach_of_a_fixed_body_is_told():
    motion = sliding()
    known, likely = [contact(motion, foot) for foot in FEET], np.ones((FRAMES, 4))
    plan = plan_feet(body(held={0}), motion, known, likely, floor=Floor(-0.3, 0.0, 0.0))
    assert not plan.lowered.any() and plan.unreached == (0, 1, 2, 3)
    assert plan_feet(body(held={0}), motion, known, likely).unreached == ()
    free = replace(body(held={0}), raised=True)
    risen = plan_feet(free, motion, known, likely, floor=Floor(-0.3, 0.0, 0.0))
    assert risen.lowered == pytest.approx(0.3) and risen.unreached == ()


def test_the_pelvis_is_lowered_within_its_limit_and_stances_end_that_need_more():
    motion = sliding(speed=1.2)
    plan = plan_feet(body(), motion, [contact(motion, foot) for foot in FEET], np.ones((FRAMES, 4)))
    assert 0.0 < (plan.lowered - plan.grounded).max() <= body_plans.MOST + 1e-12
    assert all(len(stance) < FRAMES for steps in plan.steps for stance in steps.stances)


def test_the_cover_is_smooth_and_nowhere_below(rng):
    needed = np.maximum(rng.normal(size=200), 0.0)
    for cyclic in (False, True):
        rows = frame_rows([needed[:150], needed[150:]], RATE, cyclic)
        found = body_plans.cover(needed, rows)
        assert (found >= needed - 1e-12).all()
        # Of each motion alone, the frames of the other are no neighbours.
        alone = body_plans.cover(needed[:150], frame_rows([needed[:150]], RATE, cyclic))
        assert (found[:150] == alone).all()
    assert limbs.find_limb(PARENTS, BONES, 3) is not None


KICK = 30


def led_at(frames, foot=0, limbs=0):
    """Lead one of the four feet in some frames."""
    found = footsteps.always(4, limbs, FRAMES)
    found.feet[foot, frames] = True
    return found


def kicking():
    """The sliding motion, in which the first leg is lifted high around a frame."""
    motion = sliding()
    share = np.exp(-0.5 * np.square((np.arange(FRAMES) - KICK) / 6.0))
    motion.rotations[:, 1] = quat.exp(share[:, None] * [-1.2, 0.0, 0.0] + [-0.3, 0.0, 0.0])
    return motion


def planned(motion, led=None):
    known = [contact(sliding(), foot) for foot in FEET]
    return plan_feet(body(), motion, known, alternating(), led=led)


def test_a_led_foot_is_where_the_motion_has_it_and_stands_before_and_after():
    motion = kicking()
    plan = planned(motion, led_at([KICK]))
    feet, wanted = feet_of(placed(motion, plan)), feet_of(motion)
    assert np.linalg.norm(feet[KICK, 0] - wanted[KICK, 0]) < 1e-9
    # Half a captured swing before the kick and after it the foot does not stand.
    stances = plan.steps[0].stances
    assert [own.stop <= KICK - 9 or own.start > KICK + 9 for own in stances] == [True, True]
    assert plan.steps[0].anchors[:, 1] == pytest.approx(0.04, abs=0.02)
    for stance, anchor in zip(stances, plan.steps[0].anchors, strict=True):
        apart = feet[stance.start : stance.stop, 0] - anchor
        assert np.abs(apart[:, ::2]).max() < 1e-9 and np.abs(apart[:, 1]).max() < stance_rows.SUNK
    assert feet[:, 0, 1].min() > plan.steps[0].anchors[0, 1] - stance_rows.SUNK
    # A foot that is not led is elsewhere, and one that is never planned slides.
    free = feet_of(placed(motion, planned(motion)))
    assert np.linalg.norm(free[KICK, 0] - wanted[KICK, 0]) > 1e-3
    assert np.abs(wanted[:15, 0] - wanted[0, 0]).max() > 0.05


def test_a_foot_that_is_led_on_the_floor_stands_there():
    motion = sliding()
    plan = planned(motion, led_at([10]))
    wanted = feet_of(motion)[10, 0]
    (stance,) = (own for own in plan.steps[0].stances if own.start <= 10 < own.stop)
    assert stance == range(20)
    assert plan.steps[0].anchors[0] == pytest.approx(wanted, abs=1e-9)
    assert planned(motion).steps[0].anchors[0] != pytest.approx(wanted, abs=1e-3)


def test_the_pelvis_is_lowered_no_more_than_a_led_limb_reaches():
    motion = kicking()
    plan = planned(motion, led_at([KICK]))
    _, below = plan.led.room(plan.poses, plan.character.legs + plan.character.kept)
    assert np.isinf(below).sum() == FRAMES - 1
    assert plan.lowered[KICK] <= below[KICK] + 1e-12
    root = footsteps.always(4, 0, FRAMES)
    root.root[KICK] = True
    still = planned(motion, root)
    assert still.lowered[KICK] == 0.0


def test_limbs_keep_their_ends_as_far_as_they_are_led():
    motion = sliding(0.77)
    motion.roots[:, 1] += 0.03 * np.sin(np.arange(FRAMES) / 10.0)
    known = [contact(motion, foot) for foot in FEET[1:]]
    character = body(FEET, held=[FEET[0]])
    (kept,) = character.kept
    share = np.clip(np.abs(np.arange(FRAMES) - 45.0) / 20.0, 0.0, 1.0)[None]
    likely = alternating()[:, 1:]
    plan = plan_feet(
        character,
        motion,
        known,
        likely,
        led=Led(np.zeros((3, FRAMES), bool), share, np.zeros(FRAMES, bool)),
    )
    assert plan.lowered.max() > 0.001
    moved = feet_of(placed(motion, plan))[:, FEET.index(kept.tip)] - feet_of(motion)[:, 0]
    assert -moved[:, 1] == pytest.approx((1.0 - share[0]) * plan.lowered, abs=1e-3)
    always = plan_feet(character, motion, known, likely)
    own = feet_of(placed(motion, always))[:, 0] - feet_of(motion)[:, 0]
    assert np.abs(own).max() < 1e-6
