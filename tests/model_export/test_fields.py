"""Tests of the selection of kriging models by leave-one-out error."""

import numpy as np
import pytest

from posefield_train.kriging import coefficient_models, kriging_tuning, variogram
from posefield_train.kriging.kriging_bank import ConstantModel
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import UniversalKriging as Field
from posefield_train.source.recipe import Kriging


@pytest.fixture
def laid(rng):
    return SamplePoints(rng.uniform(-1.0, 1.0, (24, 2)), 2, np.arange(24) // 2)


@pytest.fixture(params=["smooth", "straight", "rough"])
def values(request, laid, rng):
    x, y = laid.points.T
    ways = {
        "smooth": np.stack([np.sin(3.0 * x), np.cos(2.0 * y)], axis=1),
        "straight": np.stack([2.0 * x - y, 0.5 * y], axis=1),
        "rough": np.stack([np.abs(x - 0.2), np.sign(y)], axis=1),
    }
    return ways[request.param] + 0.1 * rng.normal(size=(24, 2))


def candidates(laid, values, covariances=("matern52", "gaussian"), drifts=((1,), (0, 1, 1))):
    found = {}
    for covariance in covariances:
        for own in drifts:
            experimental = variogram.residual_variogram(laid.points, values, max(own))
            guess = kriging_tuning.initial_guess(experimental, laid.controls, covariance, own)
            found[covariance, own] = kriging_tuning.tune(guess, laid, values, None)
    return found


def test_the_least_left_out_is_chosen_and_gaussian_only_where_clearly_so(laid, values):
    tried = candidates(laid, values)

    def least(covariance):
        own = [name for name in tried if name[0] == covariance]
        return min(own, key=lambda name: tried[name].unexplained)

    leasts = {covariance: least(covariance) for covariance in ("matern52", "gaussian")}
    matern, gaussian = (tried[leasts[name]].unexplained for name in leasts)
    best = leasts[
        "gaussian" if gaussian < coefficient_models.CLEAR_IMPROVEMENT * matern else "matern52"
    ]
    chosen = coefficient_models.choose_covariance(Kriging(), laid, values)
    assert (chosen.hyper.covariance, chosen.hyper.drifts) == best
    assert chosen.unexplained == tried[best].unexplained
    assert len({field.unexplained for field in tried.values()}) > 1


@pytest.mark.parametrize(("drift", "drifts"), [(0, (0,)), (1, (1,)), ("mixed", (0, 1, 1))])
def test_what_the_recipe_names_is_not_chosen_again(laid, values, drift, drifts):
    settings = Kriging(covariance="exponential", drift=drift)
    chosen = coefficient_models.choose_covariance(settings, laid, values)
    assert (chosen.hyper.covariance, chosen.hyper.drifts) == ("exponential", drifts)


def test_fields_beside_the_pose_choose_their_drift_and_not_their_covariance(laid, values):
    tried = candidates(laid, values, ("gaussian",))
    best = min(tried, key=lambda name: tried[name].unexplained)
    found = coefficient_models.fit(Kriging(), "gaussian", laid, values).field
    assert isinstance(found, Field)
    assert (found.hyper.covariance, found.hyper.drifts) == best


def test_noise_is_answered_with_its_mean_and_a_field_is_not(laid, rng):
    noise = rng.normal(size=(24, 2))
    found = coefficient_models.fit(Kriging(), "matern52", laid, noise)
    assert isinstance(found.field, ConstantModel)
    assert np.array_equal(found.field.mean, noise.mean(axis=0))
    assert np.array_equal(found.residuals, laid.from_mean(noise))
    kept = coefficient_models.fit(Kriging(nugget=0.1), "matern52", laid, noise)
    assert isinstance(kept.field, Field)


def test_values_that_never_change_are_a_constant(laid):
    found = coefficient_models.fit(Kriging(), "matern52", laid, np.full((24, 2), 3.0))
    assert isinstance(found.field, ConstantModel)
    assert found.explained == 0.0 and not found.residuals.any()
