"""How far each joint errs, beside all joints."""

from dataclasses import replace

import numpy as np
import pytest

from model_export import fidelity, shares


@pytest.fixture
def offsets(trained):
    return np.stack([example.offsets for example in trained.examples])


def asked(trained, offsets, residuals):
    return shares.of_joints(
        trained.tensor, trained.full, trained.skeleton.parents, offsets, residuals
    )


def test_squares_average_to_one_and_hands_err_more_than_hips(trained, offsets):
    found = asked(trained, offsets, {"pose": trained.pose.residuals})
    assert np.mean(np.square(found)) == pytest.approx(1.0, abs=1e-3)
    assert np.array_equal(found, trained.joints)
    hand, hips = map(trained.skeleton.names.index, ("RightHand", "Hips"))
    assert found[hand] > 1.5 * found[hips]


def test_shares_are_of_distances_between_the_clip_and_its_prediction(trained, offsets):
    whole, parents, clip = trained.tensor, trained.skeleton.parents, 7
    values, own = whole.values[:, :, [clip]], offsets[[clip]]
    predicted = values - trained.full.slices(trained.pose.residuals[[clip]])
    places = [fidelity.positions(whole, each, parents, own) for each in (values, predicted)]
    squares = np.mean(np.square(np.linalg.norm(places[0] - places[1], axis=-1)[0]), axis=0)
    alone, rest = replace(whole, values=values), {"pose": trained.pose.residuals[[clip]]}
    found = shares.of_joints(alone, trained.full, parents, own, rest)
    assert np.allclose(found, np.sqrt(squares / squares.mean()), atol=1e-9)
    # Negative control: another clip's prediction lies elsewhere.
    others = {"pose": trained.pose.residuals[[clip + 1]]}
    assert not np.allclose(shares.of_joints(alone, trained.full, parents, own, others), found)


def test_travel_moves_all_joints_alike(trained, offsets):
    plain = asked(trained, offsets, {"pose": trained.pose.residuals})
    far = {"pose": trained.pose.residuals, "travel": np.full((len(offsets), 3), 100.0)}
    assert np.ptp(asked(trained, offsets, far)) < 0.01 < np.ptp(plain)


def test_what_is_met_exactly_errs_evenly(trained, offsets):
    nothing = {"pose": np.zeros_like(trained.pose.residuals)}
    assert np.array_equal(asked(trained, offsets, nothing), np.ones(len(trained.skeleton)))
