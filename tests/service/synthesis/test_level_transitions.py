"""Tests of walkers' levels over time: error limits, and no flicker or popping."""

import numpy as np
import pytest

from posefield.inference.level_selection import LevelTable
from posefield.locomotion import gait, locomotion_plan, walking_crowd
from posefield.motion import quat, skeleton
from posefield.registry import model_registry

RATE = 30.0
LADDER = LevelTable(np.array([0.01, 0.03, 0.08, 0.2]), np.array([4.0, 3.0, 2.0, 1.0]))
SWITCH = round(locomotion_plan.TRANSITION_SECONDS * RATE)


def passing(count=40, frames=600):
    """Pixels (N, F) that a metre covers on characters who pass by at 2 m or more."""
    rng = np.random.Generator(np.random.PCG64(8))
    nearest = rng.uniform(2.0, 40.0, count)[:, None]
    when = rng.uniform(0.0, frames / RATE, count)[:, None]
    speed = rng.uniform(2.0, 30.0, count)[:, None]
    way = speed * (np.arange(frames) / RATE - when)
    return 935.0 / np.hypot(nearest, way)


def shown_pixels(shown, scale):
    """Errors (N, F) of what is shown, the coarser level's while two are mixed."""
    both = np.maximum(LADDER.errors[shown.levels], LADDER.errors[shown.previous])
    coarser = np.where(shown.shares < 1.0, both, LADDER.errors[shown.levels])
    return coarser * scale


def test_nobody_is_shown_coarser_than_the_limit_even_while_switching():
    scale = passing()
    shown = locomotion_plan.schedule_levels(LADDER, scale, 1.0, RATE)
    visible = shown_pixels(shown, scale) > 1.0
    unavoidable = LADDER.errors[0] * scale > 1.0
    # On its way to the finest level a character may still be at the next: never beyond its limit.
    assert not np.any(visible & ~unavoidable & (shown.levels > 0))
    assert not np.any((shown.levels > 0) & (LADDER.errors[shown.levels] * scale > 1.0))
    assert set(np.unique(shown.levels)) == {0, 1, 2, 3}
    # Negative control: the same levels a second later would show.
    late = np.roll(shown.levels, 30, axis=1)[:, 30:]
    assert np.any((late > 0) & (LADDER.errors[late] * scale[:, 30:] > 1.0))


def test_a_switch_takes_its_time_and_ends_before_the_next():
    shown = locomotion_plan.schedule_levels(LADDER, passing(), 1.0, RATE)
    for levels, shares in zip(shown.levels, shown.shares, strict=True):
        switches = np.flatnonzero(np.diff(levels)) + 1
        assert np.all(np.diff(switches) >= SWITCH)
        for at in switches:
            way = shares[at : at + SWITCH + 1]
            assert np.all(np.diff(way) > 0.0) and way[0] < 0.1
            assert len(way) < SWITCH + 1 or way[-1] == 1.0
    assert np.any(np.diff(shown.levels, axis=1))


# --- a real walk ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def model(walk_path):
    return next(iter(model_registry.load([walk_path]).models.values()))


@pytest.fixture(scope="module")
def own(model):
    return gait.fit_gait(model.session)


def joints(own, plan, shown):
    made = walking_crowd.motions(own.session, plan, np.arange(len(plan.who)), shown)
    local = skeleton.translations(made.bone_offsets.astype(float), made.root_position.astype(float))
    parents = own.session.card.skeleton.parents
    return skeleton.forward_kinematics(parents, made.rotations.astype(float), local)[0]


def switching(plan, shares):
    """From the finest level to the coarsest in the middle, by the shares of the way."""
    shown = locomotion_plan.constant_schedule(0, plan.phases.shape)
    middle = plan.phases.shape[1] // 2
    shown.levels[:, middle:] = 3
    before = np.zeros_like(shown.levels)
    own_shares = np.ones(plan.phases.shape)
    own_shares[:, middle : middle + len(shares)] = shares
    return locomotion_plan.LevelSchedule(shown.levels, before, own_shares)


def test_a_switch_does_not_pop(own):
    """Mixed, a switch moves joints hardly more than the coarse level does by itself."""
    plan = walking_crowd.plan_random(own, 20, 2.0, RATE, 1)
    finest = joints(own, plan, locomotion_plan.constant_schedule(0, plan.phases.shape))

    middle = plan.phases.shape[1] // 2

    def pop(shown):
        away = joints(own, plan, shown) - finest
        steps = np.linalg.norm(np.diff(away, axis=1), axis=-1)[:, middle - 1 : middle + SWITCH]
        return np.sqrt(np.mean(np.square(steps), axis=(0, 2))).max()

    gentle = np.array([quat.smoothstep(s) for s in np.linspace(0.0, 1.0, SWITCH + 2)[1:-1]])
    sudden, mixed = pop(switching(plan, np.zeros(0))), pop(switching(plan, gentle))
    usual = pop(locomotion_plan.constant_schedule(3, plan.phases.shape))
    assert mixed < 1.5 * usual
    assert sudden > 1.7 * mixed
