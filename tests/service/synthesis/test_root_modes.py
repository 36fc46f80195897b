"""Tests of clips in place and of loops, which end in their first pose."""

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.common.units import UP
from posefield.motion import quat
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips, poses

POINT = {"stature": 1.7, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}
STROLL = {"haste": 4.0, "veer": 400.0}
# The graph answers in float32, and sums a batch in another order than one row.
FLOAT32 = 1e-5


@pytest.fixture(scope="module")
def walker(walk_path):
    return model_registry.load([walk_path]).models["stroll"]


@pytest.fixture(scope="module")
def reacher(model_path):
    return model_registry.load([model_path]).models["reaching"]


def clip(model, controls, **asked):
    return clips.synthesize_clip(model, ClipQuestion(controls=controls, **asked)).clip


def end_of(model, controls):
    """The pose at the end of the clip, s, and when that is."""
    duration = poses.synthesize_poses(
        model, PoseQuestion(controls=controls, times=[0.0])
    ).trust.duration
    return poses.synthesize_poses(
        model, PoseQuestion(controls=controls, times=[duration])
    ), duration


def apart(a, b):
    """Largest difference of quaternions that may be of either sign."""
    return np.minimum(np.abs(a - b).max(axis=-1), np.abs(a + b).max(axis=-1)).max()


@pytest.mark.parametrize("fps", [1.0, 24.0, 29.97, 120.0])
def test_a_loop_is_the_whole_cycle_in_even_steps(walker, fps):
    asked = ClipQuestion(controls=STROLL, fps=fps, loop=True, feet="as_predicted")
    found = clips.synthesize_clip(walker, asked)
    _, duration = end_of(walker, STROLL)
    steps = max(1, round(duration * fps))
    assert len(found.clip) == steps + 1
    assert (found.clip.rate, found.clip.duration) == (fps, steps / fps)
    assert found.trust.duration == duration
    middle = steps // 2
    there = poses.synthesize_poses(
        walker, PoseQuestion(controls=STROLL, times=[middle * duration / steps])
    )
    assert np.abs(found.clip.rotations[middle] - there.rotations[0]).max() < FLOAT32
    assert np.abs(found.clip.root_path[middle] - there.root_position[0]).max() < FLOAT32


def test_a_loop_in_place_ends_in_every_number_as_it_begins(walker):
    found = clip(walker, STROLL, root="in_place", loop=True)
    assert np.array_equal(found.rotations[-1], found.rotations[0])
    assert np.array_equal(found.translations[-1], found.translations[0])
    # Negative control: without the loop the last frame is short of the end.
    open_end = clip(walker, STROLL, root="in_place")
    assert not np.array_equal(open_end.rotations[-1], open_end.rotations[0])


def test_a_loop_that_travels_ends_as_it_begins_but_for_its_way_and_turn(walker):
    found = clip(walker, STROLL, loop=True, feet="as_predicted")
    end, _ = end_of(walker, STROLL)
    assert np.array_equal(found.rotations[-1, 1:], found.rotations[0, 1:])
    assert found.root_path[-1, 1] == found.root_path[0, 1]
    turned = quat.mul(found.rotations[-1, 0], quat.conj(found.rotations[0, 0]))
    assert quat.twist(turned, UP) == pytest.approx(0.4, abs=0.02)
    assert np.abs(np.delete(turned, [0, 2])).max() < 1e-12
    # It is where the model itself has the end of the cycle.
    assert apart(found.rotations[-1], end.rotations[0]) < FLOAT32
    assert np.abs(found.root_path[-1] - end.root_position[0]).max() < FLOAT32
    # Negative control: the frame before is elsewhere.
    assert np.abs(found.root_path[-2] - end.root_position[0]).max() > 1000 * FLOAT32


def test_what_is_no_cycle_ends_over_where_it_began(reacher):
    _, duration = end_of(reacher, POINT)
    # The clip's last frame is its end.
    asked = {"fps": 30.0 / duration}
    still, going = (clip(reacher, POINT, root=root, **asked) for root in ("in_place", "travelling"))
    assert len(still) == 31
    assert np.abs((still.root_path[-1] - still.root_path[0])[[0, 2]]).max() < FLOAT32
    assert np.abs((going.root_path[-1] - going.root_path[0])[[0, 2]]).max() > 1000 * FLOAT32
    assert np.array_equal(still.root_path[:, 1], going.root_path[:, 1])
    assert np.array_equal(still.rotations, going.rotations)
    taken = (going.root_path - still.root_path)[:, [0, 2]]
    assert np.abs(np.diff(taken, n=2, axis=0)).max() < FLOAT32


def test_a_loop_of_what_is_no_cycle_is_refused(reacher):
    for ask in (clips.synthesize_clip, clips.check):
        with pytest.raises(InvalidField, match=r"^loop: true, expected false: this model's last"):
            ask(reacher, ClipQuestion(controls=POINT, loop=True))


def test_a_part_of_a_loop_is_refused(walker):
    for ask in (clips.synthesize_clip, clips.check):
        with pytest.raises(InvalidField, match=r"^start: 0\.2 s with loop, expected none: a loop"):
            ask(walker, ClipQuestion(controls=STROLL, loop=True, start=0.2))


def test_names_of_a_convention_need_roles(walker):
    for ask in (clips.synthesize_clip, clips.check):
        with pytest.raises(InvalidField, match=r"^names: 'ue5', expected 'own'"):
            ask(walker, ClipQuestion(controls=STROLL, names="ue5"))
