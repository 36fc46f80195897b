"""Tests of corrections: the smallest that satisfy the constraints, and unreachable constraints."""

from dataclasses import replace

import numpy as np
import pytest
from beginning import covariance
from scipy.spatial import distance as apart
from scipy.stats import chi

from posefield.constraints import constraint, reachability
from posefield.constraints.reachability import Reachability


def poses(begun, held):
    return held.poses(np.arange(float(held.scene.reduced.frames)))


def roughness(begun, held) -> float:
    """Mean size of second differences of a hand's path, m."""
    frames = np.arange(float(held.scene.reduced.frames))
    path = held.scene.positions(held.numbers, begun.joint("RightHand"), frames)
    return float(np.linalg.norm(np.diff(path, n=2, axis=0), axis=-1).mean())


def test_a_linear_aim_is_met_by_the_mean_of_the_gaussian_that_meets_it(reaching):
    """Oracle: the least-norm solution by a singular value decomposition, in white coordinates."""
    begun = reaching.held
    held = reaching.solve(begun, [reaching.place("Hips", 30.0, (0.004, -0.003, 0.005))])
    _, gradients = begun.scene.position_and_gradient(begun.numbers, reaching.joint("Hips"), 30.0)
    root = np.linalg.cholesky(covariance(reaching) + 1e-12 * np.eye(len(begun.numbers)))

    def conditioned(metric):
        shift = np.array([0.004, -0.003, 0.005])
        return metric @ np.linalg.lstsq(gradients @ metric, shift, rcond=None)[0]

    change = held.numbers - begun.numbers
    size = np.linalg.norm(change)
    assert np.linalg.norm(change - conditioned(root)) < 1e-5 * size
    # Negative control: in another metric the least change is another.
    assert np.linalg.norm(change - conditioned(np.eye(len(change)))) > 0.1 * size
    assert held.steps == 1


def test_where_nothing_is_missing_nothing_changes(reaching):
    begun = reaching.held
    held = reaching.solve(begun, [reaching.place("RightHand", 20.0)])
    assert held.numbers.tobytes() == begun.numbers.tobytes()
    assert (held.steps, held.distance) == (0, 0.0)
    # Negative control: a tenth of a millimetre changes something.
    near = reaching.solve(begun, [reaching.place("RightHand", 20.0, (1e-4, 0.0, 0.0))])
    assert near.numbers.tobytes() != begun.numbers.tobytes()


@pytest.mark.parametrize(("name", "end"), [("reaching", "LeftHand"), ("walking", "RightFoot")])
def test_what_is_near_is_met_in_a_few_steps(name, end, request, rng):
    begun = request.getfixturevalue(name)
    for frame in (0.0, 12.5, float(begun.held.scene.reduced.frames - 1)):
        way = rng.standard_normal(3)
        unit = begun.place(end, frame, 0.01 * way)
        far = begun.bench.distance(begun.held, [unit])
        aim = begun.place(end, frame, 0.02 * way / far)
        held = begun.solve(begun.held, [aim])
        assert held.results[0].reached and held.results[0].miss < 2e-5
        assert held.steps <= 5
        joint = begun.joint(end)
        assert (
            np.linalg.norm(
                held.scene.position_and_gradient(held.numbers, joint, frame)[0] - aim.target
            )
            < 2e-5
        )


def test_what_is_out_of_reach_is_told_and_approached_as_far_as_motions_go(reaching):
    """However far off it is, the way that is gone is the same."""
    begun = reaching.held
    last = float(begun.scene.reduced.frames - 1)
    away = np.array([0.6, 0.0, 0.8])

    def held(metres):
        return reaching.solve(begun, [reaching.place("RightHand", last, metres * away)])

    one, ten = held(1.0), held(10.0)
    assert not one.results[0].reached and not ten.results[0].reached
    assert one.results[0].miss < 1.0 and ten.results[0].miss < 10.0
    assert ten.distance == pytest.approx(10.0 * one.distance)
    assert np.abs(one.numbers - ten.numbers).max() < 1e-6
    assert roughness(reaching, one) < 1.5 * roughness(reaching, begun)
    # Negative control: what is met moves less.
    limit = reachability.distance_limit(3) / one.distance
    inside, outside = held(0.99 * limit), held(1.01 * limit)
    assert inside.results[0].reached
    assert np.abs(inside.numbers - one.numbers).max() > 1e-6
    assert np.abs(inside.numbers - outside.numbers).max() < np.abs(one.numbers).max()


@pytest.mark.parametrize("apart", [0.0, 1.0])
def test_contradicting_aims_share_the_miss(reaching, apart):
    """One hand in two places at one time, or from one frame to the next."""
    aims = [
        reaching.place("RightHand", 20.0, (0.02, 0.0, 0.0)),
        reaching.place("RightHand", 20.0 + apart, (-0.02, 0.0, 0.0)),
    ]
    held = reaching.solve(reaching.held, aims)
    rotations, roots = poses(reaching, held)
    assert np.isfinite(rotations).all() and np.isfinite(roots).all()
    misses = [met.miss for met in held.results]
    assert not any(met.reached for met in held.results)
    assert 0.005 < min(misses) and max(misses) < 0.03
    before = roughness(reaching, reaching.held)
    assert roughness(reaching, held) < 2.0 * before
    # Negative control: alone each of them is met.
    alone = [reaching.solve(reaching.held, [aim]).results[0].miss for aim in aims]
    assert max(alone) < 1e-5
    # And of a motion so uncertain that nothing is far the hand jerks from one to the other, where
    # there is time for it.
    state = reaching.held.state
    uncertain = replace(
        reaching.held, state=state._replace(sigma=100.0 / reachability.MAX_DEVIATIONS * state.sigma)
    )
    jerked = reaching.solve(uncertain, aims)
    assert (roughness(reaching, jerked) > 2.5 * before) == (apart > 0.0)


def looked_at(begun, aims) -> Reachability:
    scene, numbers = begun.held.scene, begun.held.numbers
    seen = constraint.evaluate_many(aims, [scene], numbers[None])
    return reachability.assess(begun.bench.spread, [(begun.held, aims)], numbers[None], *seen)


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
    total += beside @ spread.cycle @ beside.T
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
