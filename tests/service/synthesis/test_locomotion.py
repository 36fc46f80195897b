"""Tests of walkers over time: continuous motion, along their paths."""

import re
from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.inference import session
from posefield.locomotion import (
    collision_avoidance,
    floor_plane,
    gait,
    locomotion_plan,
    stride,
    walking_crowd,
)
from posefield.motion import quat, skeleton

# float32 of places some metres away, and of phases after some strides.
SINGLE = 2e-5
RATE = 30.0
ANN = np.zeros(1, dtype=np.int64)


def finest(opened, plan):
    """Motions of all characters of a plan, at the finest level."""
    shown = locomotion_plan.constant_schedule(0, plan.phases.shape)
    return walking_crowd.motions(opened, plan, np.arange(len(plan.who)), shown)


@pytest.fixture(scope="module")
def own(walk_path):
    return gait.fit_gait(session.load(walk_path))


def held(own, veer, frames, rate, phase=0.0):
    """Plan of Ann who walks at one speed and turns evenly, from the origin."""
    controls = np.tile([4.0, veer], (1, frames, 1))
    origin = np.zeros(1, dtype=np.complex128), np.zeros(1)
    return locomotion_plan.plan_from_controls(own, controls, ANN, np.array([phase]), origin, rate)


def joints(own, plan):
    """Places of all joints (N, F, J, 3), m."""
    made = walking_crowd.motions(
        own.session,
        plan,
        np.arange(len(plan.who)),
        locomotion_plan.constant_schedule(0, plan.phases.shape),
    )
    local = skeleton.translations(
        made.bone_offsets.astype(np.float64), made.root_position.astype(np.float64)
    )
    parents = own.session.card.skeleton.parents
    return skeleton.forward_kinematics(parents, made.rotations.astype(np.float64), local)[0]


def clip_joints(own, veer, phases):
    """The same (F, J, 3) of the model's own clip, its root's first place on the origin."""
    controls, labels = np.array([[4.0, veer]]), stride.labels(own.session, ANN)
    duration = stride.strides(own.session, controls, labels).durations[0]
    asked = ("rotations", "root_position", "bone_offsets")
    times = np.array([[0.0, *(phases * duration)]])
    rotations, roots, bones = own.session.run(controls, times, *asked, labels=labels)
    roots = roots[0] - roots[0, :1] * [1.0, 0.0, 1.0]
    local = skeleton.translations(bones[0].astype(float), roots[1:])
    parents = own.session.card.skeleton.parents
    return skeleton.forward_kinematics(parents, rotations[0, 1:].astype(float), local)[0]


def rate_of(own, veer, frames):
    """The rate, 1/s, at which a cycle has so many frames."""
    labels = stride.labels(own.session, ANN)
    return frames / stride.strides(own.session, np.array([[4.0, veer]]), labels).durations[0]


@pytest.mark.parametrize("veer", [0.0, 450.0])
def test_held_controls_are_the_models_own_clip_again_and_again(own, veer):
    rate = rate_of(own, veer, 40)
    plan = held(own, veer, 121, rate)
    made = joints(own, plan)[0]
    clip = clip_joints(own, veer, np.arange(41) / 40)
    assert np.abs(made[:40] - clip[:40]).max() < SINGLE
    # A cycle ends where the next begins, in the same pose.
    assert np.abs(made[40] - clip[40]).max() < SINGLE
    first = (
        floor_plane.unit_vectors(plan.headings[0, 80]) * floor_plane.project(clip[:40])
        + plan.places[0, 80]
    )
    assert np.abs(floor_plane.project(made[80:120]) - first).max() < SINGLE
    # Negative control: another phase is another clip.
    other = joints(own, held(own, veer, 41, rate, phase=0.3))[0]
    assert np.abs(other[:40] - clip[:40]).max() > 0.1


def test_an_even_turn_comes_back_to_where_it_began(own):
    labels = stride.labels(own.session, ANN)
    found = stride.strides(own.session, np.array([[4.0, 450.0]]), labels)
    cycles = 2.0 * np.pi / found.turns[0]
    frames = 600
    plan = held(own, 450.0, frames + 1, frames / (cycles * found.durations[0]))
    radius = np.abs(found.travels[0]) / found.turns[0]
    assert abs(plan.places[0, -1] - plan.places[0, 0]) < 1e-9
    across = np.abs(plan.places[0][: frames // 2] - plan.places[0][frames // 2 : -1])
    assert across == pytest.approx(2.0 * radius, rel=1e-9)
    # Negative control: a twentieth less of a turn is no circle.
    short = held(own, 450.0, frames + 1, frames / (0.95 * cycles * found.durations[0]))
    assert abs(short.places[0, -1]) > 0.2 * radius


def swaying(own, frames):
    """Plan of Ann whose speed and turning change from end to end of what was sampled."""
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, 4 * np.pi, frames))
    controls = np.stack([3.0 + 2.0 * share, -400.0 + 800.0 * share], axis=-1)[None]
    origin = np.zeros(1, dtype=np.complex128), np.zeros(1)
    return locomotion_plan.plan_from_controls(own, controls, ANN, np.zeros(1), origin, RATE)


def leap(own, plan):
    """The farthest that a joint goes between two frames, m."""
    return float(np.linalg.norm(np.diff(joints(own, plan), axis=1), axis=-1).max())


def test_nothing_leaps_while_controls_change(own):
    plan = swaying(own, 300)
    fastest = locomotion_plan.plan_from_controls(
        own,
        np.tile([5.0, 400.0], (1, 300, 1)),
        ANN,
        np.zeros(1),
        (np.zeros(1, dtype=np.complex128), np.zeros(1)),
        RATE,
    )
    assert leap(own, plan) < 1.1 * leap(own, fastest)
    # Negative control: a phase that begins again with every change of controls pops.
    again = np.concatenate([plan.phases[:, :150], plan.phases[:, :150]], axis=1)
    assert leap(own, replace(plan, phases=again)) > 1.5 * leap(own, fastest)


def wandering(own, count, seconds=6.0, seed=3):
    return walking_crowd.plan_random(own, count, seconds, RATE, seed)


def test_who_walks_keeps_to_the_way(own):
    characters = collision_avoidance.draw_characters(own, 20, 3)
    ways = collision_avoidance.draw_paths(own, characters, 6.0)
    frames = 181
    plan = locomotion_plan.plan_along_paths(
        own, ways, characters.who, characters.phases, frames, RATE
    )
    starts = plan.places[:, 0], plan.headings[:, 0]
    free = locomotion_plan.plan_from_controls(
        own, plan.controls, plan.who, plan.phases[:, 0], starts, RATE
    )
    # Left to itself the model goes the same way: median 2 cm away after six seconds, 11 at most.
    assert np.median(np.abs(free.places - plan.places)[:, -1]) < 0.03
    assert np.abs(free.places - plan.places).max() < 0.15
    assert np.abs(free.headings - plan.headings).max() < 0.05
    straight = plan.places[:, :1] + floor_plane.unit_vectors(plan.headings[:, :1]) * np.linspace(
        0, 6, frames
    )
    assert np.abs(plan.places - straight).max() > 0.5


def test_feet_slide_no_more_than_in_the_models_own_strides(own):
    plan = wandering(own, 60)
    made = finest(own.session, plan)
    found = walking_crowd.measure_foot_skate(own.session.card, made, RATE).mean()
    strides = walking_crowd.mean_foot_skate(own, RATE)
    each = walking_crowd.foot_skate_per_clip(own, RATE)[:, 0]
    who = np.array(own.session.card.moved_by)
    assert strides == pytest.approx(0.5 * (each[who == 0].mean() + each[who == 1].mean()))
    assert 0.0 < found < 1.2 * strides < 0.05
    # Negative control: a root that goes on a tenth too fast.
    fast = replace(plan, places=plan.places + 0.1 * (plan.places - plan.places[:, :1]))
    slid = finest(own.session, fast)
    assert walking_crowd.measure_foot_skate(own.session.card, slid, RATE).mean() > 2.0 * strides


@pytest.mark.parametrize("count", [1, 3])
def test_the_root_alone_is_where_it_is_in_whole_poses_bit_for_bit(own, count):
    opened, phases = own.session, np.arange(8) / 8
    controls = np.array(opened.card.examples[:count])
    labels = np.zeros((count, len(opened.card.clip_labels[0])))
    found = stride.root_places(opened, controls, labels, phases)
    rows, whole = np.repeat(np.arange(count), 8), np.tile(phases, count)
    posed = stride.synthesize_poses(opened, controls[rows], labels[rows], whole)
    assert found.tobytes() == posed.places.reshape(count, 8).tobytes()
    later = stride.synthesize_poses(opened, controls[rows], labels[rows], np.roll(whole, 1))
    assert found.tobytes() != later.places.tobytes()


@pytest.fixture(scope="module")
def opened(walk_path):
    return session.load(walk_path)


def test_speeds_and_turning_are_those_of_the_clips(own, strides):
    # The controls say km/h and thousandths of a radian a stride: the model says m/s and rad/s.
    haste, veer = np.array([example.controls for example in strides]).T
    durations = np.array([example.clip.duration for example in strides])
    assert np.abs(own.rates[:, 0] - haste / 3.6).max() < 0.01
    assert np.abs(own.rates[:, 1] - veer / 1000.0 / durations).max() < 0.01


def test_the_model_does_what_was_wanted_whoever_walks(own, opened, rng):
    speeds = rng.uniform(0.8, 1.4, 300)
    turning = rng.uniform(-0.4, 0.4, 300)
    who = rng.integers(-1, 2, 300)
    labels = stride.labels(opened, who)
    done = stride.strides(opened, own.controls(speeds, turning, who), labels)
    assert np.abs(done.speeds - speeds).max() < 2e-3
    assert np.abs(done.turning - turning).max() < 2e-3
    # Negative control: the regression alone is not that near.
    usual = stride.strides(opened, own.mean_controls(speeds, turning, who), labels)
    assert np.abs(usual.turning - turning).max() > 0.01


def test_the_hull_of_a_square_is_the_square(rng):
    corners = np.array([[1.0, -1.0], [2.0, -1.0], [2.0, 1.0], [1.0, 1.0]])
    inner = rng.uniform([1.0, -1.0], [2.0, 1.0], (50, 2))
    found = gait.convex_hull(np.vstack([inner, corners]))
    assert len(found.limits) == 4
    assert found.speeds == (1.0, 2.0)
    low, high = found.turning(np.array([1.0, 1.3, 2.0]))
    assert low == pytest.approx(-1.0)
    assert high == pytest.approx(1.0)


def test_a_model_that_is_no_cycle_does_not_walk(model_path):
    with pytest.raises(InvalidField, match="model: reaching is no cycle"):
        gait.fit_gait(session.load(model_path))


def test_a_model_of_one_speed_does_not_walk(opened):
    one = (replace(opened.card.labels[0], clips=(0, 0)),)
    once = replace(opened.card, examples=opened.card.examples[:2], labels=one)
    with pytest.raises(InvalidField, match=r"model: stroll goes 0\.\d+ to 0\.\d+ m/s, expected"):
        gait.fit_gait(replace(opened, card=once))


def made(own, count, seed=3, seconds=1.0):
    """A crowd that wanders, and its motions."""
    plan = walking_crowd.plan_random(own, count, seconds, RATE, seed)
    crowd = walking_crowd.crowd_of_plan(
        own.session, plan, locomotion_plan.constant_schedule(0, plan.phases.shape)
    )
    return crowd, list(crowd.batches)


def joined(motions, part):
    return np.concatenate([getattr(one, part) for one in motions])


PARTS = ("rotations", "root_position", "bone_offsets", "levels")


def test_the_same_seed_gives_the_same_bytes_and_another_others(own):
    once, again, other = (made(own, 6, seed)[1] for seed in (3, 3, 4))
    for part in PARTS:
        assert np.array_equal(joined(once, part), joined(again, part))
    assert not np.array_equal(joined(once, "rotations"), joined(other, "rotations"))


def test_fewer_characters_are_the_first_of_more(own):
    few, many = made(own, 5), made(own, 10)
    assert np.array_equal(few[0].placement.positions, many[0].placement.positions[:5])
    for part in PARTS:
        # The runtime's sums may go in another order in a batch of another size.
        gap = np.abs(joined(few[1], part) - joined(many[1], part)[:5])
        assert gap.max() < 2e-6
    assert few[0].facts["performers"] == many[0].facts["performers"][:5]


def test_a_motion_begins_at_home_and_its_placement_puts_it_in_the_world(own):
    plan = walking_crowd.plan_random(own, 4, 2.0, RATE, 0)
    crowd = walking_crowd.crowd_of_plan(
        own.session, plan, locomotion_plan.constant_schedule(0, plan.phases.shape)
    )
    motions = next(iter(crowd.batches))
    at_home = motions.root_position[:, 0] * [1.0, 0.0, 1.0]
    # A pelvis sways about the way, no farther.
    assert np.abs(at_home).max() < 0.1
    who, frames = np.repeat(np.arange(4), 61), np.tile(np.arange(61), 4)
    posed = locomotion_plan.synthesize_poses(own.session, plan, who, frames)
    turns = crowd.placement.turns[:, None]
    roots = quat.rotate(turns, motions.root_position) + crowd.placement.positions[:, None]
    expected = floor_plane.at_height(posed.places, posed.heights).reshape(4, 61, 3)
    assert np.abs(roots - expected).max() < 1e-5
    turned = quat.mul(turns, motions.rotations[:, :, 0]).reshape(-1, 4)
    assert np.abs(turned - posed.rotations[:, 0]).max() < 1e-5
    assert (
        np.abs(posed.rotations[:, 1:] - motions.rotations[:, :, 1:].reshape(-1, 6, 4)).max() < 1e-6
    )


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ((0, 1.0, RATE, 0), "count: 0, expected at least 1"),
        ((5, np.inf, RATE, 0), "seconds: inf, expected"),
        ((5, 1.0, 0.0, 0), "fps: 0, expected 1 to 1000"),
        ((5, 1.0, RATE, -1), "seed: -1, expected 0 to less than"),
        ((10**6, 10.0, RATE, 0), "count: 3.01e+08 poses, expected 20000000"),
    ],
)
def test_numbers_that_make_no_crowd_are_refused(own, asked, said):
    with pytest.raises(InvalidField, match=re.escape(said)):
        walking_crowd.plan_random(own, *asked)
