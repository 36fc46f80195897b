"""Tests of phase alignment: cycles with different cuts get the same start."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from minimal import SKELETON, recipe_with

from posefield.common.errors import RecipeError
from posefield.common.units import UP
from posefield.motion import quat
from posefield.motion.clip import assemble
from posefield_train.align import phase_alignment, time_alignment
from posefield_train.source import canonical
from posefield_train.source.clip_table import ClipRow
from posefield_train.source.ingest import Example

CLIPS, FRAMES = 9, 100
# A shift is whole frames: the rest is half a frame of so many.
HALF_A_FRAME = 0.5 / FRAMES
ROUNDING = 1e-9
IN_PHASE = recipe_with(motion={"cyclic": True}, alignment={"begin": "in_phase"})


def cycle(cut, size=1.0, turn=0.3, landmarks=()):
    """A closed cycle of a walker who turns, cut at a share of it."""
    u = cut + np.linspace(0.0, 1.0, FRAMES + 1)
    waves = [np.sin(2 * np.pi * (u + k / 7)) + 0.4 * np.sin(4 * np.pi * u + k) for k in range(15)]
    rotations = quat.exp(0.3 * size * np.stack(waves, axis=1).reshape(-1, 5, 3))
    rotations[:, 0] = quat.mul(quat.from_axis_angle(UP, turn * u), rotations[:, 0])
    # Along an arc, on which every cycle goes on from the last as the first did.
    path = np.stack([-np.cos(turn * u), 0 * u, np.sin(turn * u)], axis=1) * 1.2 / turn
    clip = assemble(SKELETON, rotations, path + 0.9 * UP, SKELETON.offsets, 100.0)
    row = ClipRow(Path("x.bvh"), "clips.csv", 2, "", 0, None, np.array([size]), ())
    return Example(row, canonical.straighten_gait(clip), row.controls, landmarks, jumps=())


@pytest.fixture
def cuts(rng):
    """Shares of a cycle in whole frames, their circular mean about zero."""
    found = rng.integers(-20, 20, CLIPS) / FRAMES
    return found - np.rint(found.mean() * FRAMES) / FRAMES


def begun(examples, recipe=IN_PHASE):
    return phase_alignment.align_phases(recipe, tuple(examples), np.ones(5))


def around(example):
    return example.clip.positions() - example.clip.root_path[:, None]


def disagreement(examples):
    """Largest distance between joints of the clips at one share of their cycles, m."""
    return np.ptp(
        [time_alignment.trace(example.clip, np.ones(5)) for example in examples], axis=0
    ).max()


def test_cycles_cut_anywhere_begin_at_one_moment(cuts):
    family = [cycle(cut) for cut in cuts]
    found = begun(family)
    shifts = np.array([example.shift for example in found])
    assert np.ptp(shifts + cuts) < 2 * HALF_A_FRAME
    assert abs(np.angle(np.exp(2j * np.pi * shifts).mean())) < 2 * np.pi * HALF_A_FRAME
    assert np.abs(shifts).max() > 10 * HALF_A_FRAME, "negative control: there are shifts"
    assert disagreement(found) < 0.1 * disagreement(family)
    same = phase_alignment.shift_start(family[0], 0.3 * HALF_A_FRAME)
    assert same is family[0], "less than half a frame is no shift"


def test_half_a_cycle_away_is_found_too(cuts):
    cuts[3] = 0.5
    found = begun([cycle(cut) for cut in cuts])
    assert disagreement(found) < 0.05
    assert abs(found[3].shift) > 0.3


@pytest.mark.parametrize("frames", [30, -20])
def test_what_is_cut_off_goes_on_at_the_other_end(frames):
    """As if the walker had walked on and the cycle had been cut later."""
    found = phase_alignment.shift_start(cycle(0.0), frames / FRAMES)
    # The cycle's own end is where the next begins: the same arc cut elsewhere.
    later = cycle(frames / FRAMES)
    assert np.abs(around(found) - rotated(later, found)).max() < ROUNDING
    steps = np.linalg.norm(np.diff(found.clip.root_path, axis=0), axis=1)
    assert np.ptp(steps) < ROUNDING
    assert np.abs(found.clip.root_path[0] * (1.0 - UP)).max() < ROUNDING


def rotated(example, like):
    """Joints around the root, turned to the heading that another clip sets out in."""
    turn = quat.from_axis_angle(
        UP, canonical.heading(like.clip)[0] - canonical.heading(example.clip)[0]
    )
    return quat.rotate(np.broadcast_to(turn, (1, 1, 4)), around(example))


def test_the_line_of_the_heading_goes_on():
    """A pelvis swings: fitted anew, the line would depend on where in the swing it begins."""
    whole = cycle(0.0)
    quarter = phase_alignment.shift_start(whole, 0.25)
    expected = canonical.heading(whole.clip)[25] - 0.25 * 0.3
    assert canonical.heading(quarter.clip)[0] == pytest.approx(expected, abs=1e-6)
    fitted = canonical.heading(canonical.straighten_gait(quarter.clip))[0]
    assert abs(fitted - expected) > 0.01


def test_landmarks_move_with_the_cycle():
    found = phase_alignment.shift_start(cycle(0.0, landmarks=(0.2, 0.9)), 0.1)
    assert found.landmarks == pytest.approx((0.1, 0.8))
    assert found.shift == pytest.approx(0.1)


def test_a_landmark_that_would_pass_the_cut_is_refused():
    cuts = np.array([-0.1, 0.0, 0.0, 0.0, 0.1])
    family = [cycle(cut, landmarks=((0.05 - cut) % 1.0, 0.6 - cut)) for cut in cuts]
    # The landmark of the last is at 0.95: begun with the others it is back at 0.05, in order.
    last = replace(family[-1], landmarks=(0.5, 0.95))
    with pytest.raises(RecipeError, match=r"landmarks lie at 60%, 5% of the cycle .* near 5%, 60%"):
        begun([*family[:-1], last])
    met = begun([replace(e, landmarks=(0.6 - cut,)) for e, cut in zip(family, cuts, strict=True)])
    assert np.ptp([e.landmarks[0] for e in met]) < 4 * HALF_A_FRAME


@pytest.mark.parametrize(("cyclic", "begin"), [(True, "as_cut"), (True, None), (False, "in_phase")])
def test_the_frames_say_where_a_cycle_begins_unless_the_recipe_says_else(cuts, cyclic, begin):
    own = recipe_with(motion={"cyclic": cyclic}, alignment={"begin": begin} if begin else {})
    family = tuple(cycle(cut) for cut in cuts)
    assert phase_alignment.align_phases(own, family, np.ones(5)) is family


def test_in_place_stays_in_place():
    walker = cycle(0.0)
    standing = replace(walker, clip=canonical.remove_drift(walker.clip))
    kept = phase_alignment.shift_start(standing, 0.3, in_place=True).clip.root_path
    assert np.abs((kept[-1] - kept[0]) * (1.0 - UP)).max() < ROUNDING


def test_large_shifts_are_noted():
    found = [phase_alignment.shift_start(cycle(0.0), share) for share in (0.05, 0.2, -0.1)]
    assert phase_alignment.shift_notes(found) == [
        "line 2, x.bvh: begun 20% of its cycle later than it was cut",
        "line 2, x.bvh: begun 10% of its cycle earlier than it was cut",
    ]
