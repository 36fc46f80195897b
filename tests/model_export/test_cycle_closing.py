"""Tests of the closing of a cycle: it meets itself smoothly, and most frames stay as captured."""

import numpy as np
import pytest
from minimal import small_clip

from posefield.motion import quat
from posefield_train.source import canonical

FRAMES = 121


@pytest.fixture
def opened():
    """A gait whose last pose is not its first."""
    return canonical.straighten_gait(small_clip(frames=FRAMES))


@pytest.fixture
def closed(opened):
    return canonical.close_cycle(opened, canonical.heading(opened))


def faded_linearly(clip):
    """Closed as before: half of the gap at either end, fading to zero in the middle."""
    share = np.linspace(0.5, -0.5, len(clip))
    gap = quat.log(quat.mul(quat.conj(clip.rotations[0]), clip.rotations[-1]))
    return quat.mul(clip.rotations, quat.exp(share[:, None, None] * gap))


def moved(before, after):
    """Mean angle by which each joint but the root was turned, rad."""
    apart = quat.log(quat.mul(quat.conj(before[:, 1:]), after[:, 1:]))
    return np.linalg.norm(apart, axis=-1).mean(axis=0)


def test_joints_move_at_most_half_as_far_as_by_a_linear_fade(opened, closed):
    own = moved(opened.rotations, closed.rotations)
    linear = moved(opened.rotations, faded_linearly(opened))
    far = linear > 1e-3
    assert far.any() and (own[far] < 0.5 * linear[far]).all()


def test_only_the_ends_of_a_cycle_move(opened, closed):
    kept = slice(int(canonical.FADE * FRAMES) + 1, -int(canonical.FADE * FRAMES) - 1)
    assert np.abs(closed.rotations[kept] - opened.rotations[kept]).max() < 1e-12
    # Negative control: the ends do.
    assert np.abs(closed.rotations[0] - opened.rotations[0]).max() > 1e-3


def turning(rotations, frame):
    """Rotation vector from a frame to the next, of every joint but the root."""
    return quat.log(quat.mul(quat.conj(rotations[frame, 1:]), rotations[frame + 1, 1:]))


def test_the_seam_has_no_corner(opened, closed):
    def corner(rotations):
        return np.abs(turning(rotations, 0) - turning(rotations, -2)).max()

    assert corner(closed.rotations) < 0.35 * corner(opened.rotations)
    # Negative control: a linear fade leaves the corner.
    assert corner(faded_linearly(opened)) > 0.9 * corner(opened.rotations)
