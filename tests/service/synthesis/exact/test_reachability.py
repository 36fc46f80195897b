"""Tests of reachability: its limit, and the partial correction beyond it."""

import numpy as np
import pytest
from scipy.spatial import distance as apart
from scipy.stats import chi

from posefield.constraints import constraint, reachability
from posefield.constraints.correction_task import CorrectionTask
from posefield.constraints.reachability import Reachability


def looked_at(begun, aims) -> Reachability:
    scene, numbers = begun.held.scene, begun.held.numbers
    seen = constraint.evaluate_many(aims, [scene], numbers[None])
    task = CorrectionTask(scene, begun.held.state.sigma, numbers, aims)
    return reachability.assess(begun.bench.spread, [task], numbers[None], seen)


def judged(differences, covariance, members):
    """Return the reachability of one motion."""
    return Reachability(differences[None], covariance[None], members)


@pytest.mark.parametrize("values", [1, 2, 3, 6, 12, 30])
def test_the_limit_is_as_unlikely_whatever_the_number_of_values(values):
    """Oracle: the chi distribution of SciPy; the formula is an approximation of it."""
    share = chi.sf(reachability.MAX_DEVIATIONS, 3)
    assert chi.sf(reachability.distance_limit(values), values) == pytest.approx(share, rel=0.15)
    # Negative control: that of three is no limit for others.
    assert values == 3 or abs(chi.sf(reachability.MAX_DEVIATIONS, values) / share - 1.0) > 0.15


def test_distances_are_in_what_is_missed_of_the_captured_clips(walking):
    """Counted by hand: every captured clip, looked at beside what the others predict for it."""
    aim = walking.place("LeftFoot", 9.0, (0.02, 0.01, -0.03))
    found = looked_at(walking, [aim])
    scene, numbers, spread = walking.held.scene, walking.held.numbers, walking.bench.spread
    total = np.zeros((3, 3))
    rest = numbers[spread.captured.shape[1] :]
    for captured, predicted, sigma in zip(
        spread.captured, spread.predicted, spread.sigmas, strict=True
    ):
        pair = [np.concatenate([motion, rest]) for motion in (captured, predicted)]
        there, told = (
            scene.position_and_gradient(own, walking.joint("LeftFoot"), 9.0)[0] for own in pair
        )
        total += np.outer(there - told, there - told) / sigma**2
    _, gradients = aim.evaluate(scene, numbers)
    beside = gradients[:, spread.captured.shape[1] :]
    total += beside @ spread.beside @ beside.T
    own = 0.9 * total + 0.1 * np.trace(total) / 3.0 * np.eye(3)
    own *= walking.held.state.sigma**2
    expected = apart.mahalanobis([0.02, 0.01, -0.03], np.zeros(3), np.linalg.inv(own))
    assert found.distance[0] == pytest.approx(expected, rel=1e-6)
    assert found.distance[0] == pytest.approx(walking.bench.distance(walking.held, [aim]))
    # Negative control: the other way round it is another distance.
    other = apart.mahalanobis([-0.03, 0.02, 0.01], np.zeros(3), np.linalg.inv(own))
    assert abs(other / expected - 1.0) > 1e-3


def test_aims_that_are_near_are_not_given_up_for_one_that_is_far(rng):
    left = np.array([0.01, 0.0, 0.02, 3.0, 2.0, 1.0])
    own = 0.02 * rng.standard_normal((6, 6))
    found = judged(left, own @ own.T + 1e-3 * np.eye(6), np.repeat(np.eye(2), 3, axis=0))
    (reached,) = found.reachable
    shares = reached / np.where(left == 0.0, 1.0, left)
    length = np.sqrt(reached @ np.linalg.solve(found.covariance[0], reached))
    assert length <= reachability.distance_limit(6) * (1.0 + 1e-6)
    assert np.ptp(shares[[0, 2]]) < 1e-9 and np.ptp(shares[3:]) < 1e-9
    assert np.all((0.0 <= shares) & (shares <= 1.0))
    assert shares[5] < 0.5
