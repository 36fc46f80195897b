"""Exact targets of limbs: met, missed without a jerk, held still, and several of one limb."""

import numpy as np
import passages
import pytest

from posefield.motion import quat, skeleton
from posefield.performance import limb_targets
from posefield.performance.limb_targets import WorldTarget
from posefield.performance.passage import RATE, Passage

LEFT = passages.FEET[0]
FRAMES, MOMENT = 180, 90
STILL, EXACT = 1e-6, 1e-6
# Acceleration of a limb that turns by up to half a turn, m/s².
GENTLE = 20.0


@pytest.fixture(scope="module")
def body():
    return passages.character()


def standing(sway=0.0):
    """A body with both legs bent, whose root sways, m."""
    rotations = np.tile(quat.IDENTITY, (FRAMES, len(passages.PARENTS), 1))
    rotations[:, [1, 4]] = quat.exp(np.array([-0.5, 0.0, 0.0]))
    rotations[:, [2, 5]] = quat.exp(np.array([1.0, 0.0, 0.0]))
    roots = np.tile([0.0, 0.9, 0.0], (FRAMES, 1))
    roots[:, 0] += sway * np.sin(np.arange(FRAMES) / 8.0)
    return Passage(rotations, roots, np.zeros((FRAMES, 2)), np.zeros(FRAMES))


def path(passage, joint):
    moved = skeleton.translations(passages.BONES, passage.roots)
    return skeleton.positions(passages.PARENTS, passage.rotations, moved)[:, joint]


def target(position, begin=MOMENT, end=None, joint=LEFT):
    return WorldTarget(
        joint, np.asarray(position, float), begin, end or begin, "/segments/0/targets/0"
    )


def hardest(passage, joint=LEFT):
    """The largest acceleration of a joint, m/s²."""
    return np.linalg.norm(np.diff(path(passage, joint), 2, axis=0), axis=-1).max() * RATE**2


def test_a_target_within_reach_is_met_and_the_rest_of_the_body_stays(body):
    own = standing()
    place = path(own, LEFT)[0] + [0.1, 0.1, 0.2]
    found, (missed,) = limb_targets.meet_targets(body, own, [target(place)])
    assert missed < EXACT
    assert path(found, LEFT)[MOMENT] == pytest.approx(place, abs=EXACT)
    others = [joint for joint in range(len(passages.PARENTS)) if joint not in (1, 2, 3)]
    assert (found.rotations[:, others] == own.rotations[:, others]).all()
    # Away from the target nothing is changed.
    assert np.abs(path(found, LEFT)[[0, -1]] - path(own, LEFT)[[0, -1]]).max() < 1e-12
    assert hardest(found) < GENTLE


@pytest.mark.parametrize("way", [(0, 0, 3), (0, -0.3, 0), (-1, 3, -1)])
def test_a_target_out_of_reach_is_missed_without_a_jerk(body, way):
    own = standing(0.01)
    place = path(own, LEFT)[0] + way
    found, (missed,) = limb_targets.meet_targets(body, own, [target(place)])
    hip = path(own, 1)[MOMENT]
    length = sum(np.linalg.norm(passages.BONES[joint]) for joint in (2, 3))
    assert missed == pytest.approx(np.linalg.norm(place - hip) - length, abs=0.03)
    # All joints of the limb, so that a knee that is jerked straight is seen too.
    assert max(hardest(found, joint) for joint in (2, LEFT)) < GENTLE
    # A shorter time is what makes a jerk: another target of the foot is a tenth of a second before.
    near = target(path(own, LEFT)[MOMENT - 6], MOMENT - 6)
    jerked, _ = limb_targets.meet_targets(body, own, [near, target(place)])
    assert max(hardest(jerked, joint) for joint in (2, LEFT)) > 2.0 * GENTLE


@pytest.mark.parametrize("way", [(0.1, 0.1, 0.2), (0.0, 0.0, 3.0), (0.0, -0.105, 0.0)])
def test_what_holds_is_still_whether_it_is_reached_or_not(body, way):
    own = standing(0.004)
    asked = target(path(own, LEFT)[MOMENT] + way, MOMENT, MOMENT + 60)
    found, _ = limb_targets.meet_targets(body, own, [asked])
    rows = slice(MOMENT, MOMENT + 61)
    assert np.ptp(path(found, LEFT)[rows], axis=0).max() < STILL
    assert np.ptp(path(own, LEFT)[rows], axis=0).max() > 1e-3


def test_targets_of_one_limb_leave_one_another_alone(body):
    own = standing()
    places = path(own, LEFT)[0] + [[0.1, 0.1, 0.1], [0.0, 0.2, 0.2], [-0.1, 0.1, 0.0]]
    frames = [60, 80, 150]
    asked = [target(place, frame) for place, frame in zip(places, frames, strict=True)]
    found, missed = limb_targets.meet_targets(body, own, asked)
    assert max(missed) < EXACT
    assert path(found, LEFT)[frames] == pytest.approx(places, abs=EXACT)


def test_a_foot_is_led_while_its_target_holds_and_the_body_for_a_trunk(body):
    foot, head = target([0, 0, 0], 40, 50), target([0, 1, 0], 70, joint=7)
    character, led = limb_targets.find_leads(body, [foot, head], range(20, 100))
    assert character.kept == ()
    assert np.flatnonzero(led.feet[0]).tolist() == [*range(20, 31), 50]
    assert np.flatnonzero(led.feet[1]).tolist() == [50]
    assert np.flatnonzero(led.root).tolist() == [50]
