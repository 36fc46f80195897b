"""Tests of the selection of kriging models by leave-one-out error."""

import numpy as np
import pytest

from posefield.kriging.kriging_model import Hyper
from posefield_train.kriging import coefficient_models, kriging_tuning
from posefield_train.kriging.kriging_bank import ConstantModel
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import TuningProblem
from posefield_train.kriging.universal_kriging import UniversalKriging as Field
from posefield_train.source.recipe_sections import Kriging

BOTH = ("matern52", "gaussian")
POSE = Hyper("matern52", (0,), np.array([0.5, 0.5]), 0.1, 1.0)


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


def test_gaussian_is_chosen_only_where_clearly_better(laid, values):
    problem = TuningProblem(laid, values)
    matern, gaussian = (kriging_tuning.tune(problem, name, None) for name in BOTH)
    clearly = gaussian.unexplained < coefficient_models.CLEAR_IMPROVEMENT * matern.unexplained
    chosen = coefficient_models.choose_covariance(Kriging(), laid, values)
    assert chosen.hyper.covariance == ("gaussian" if clearly else "matern52")
    assert chosen.unexplained == (gaussian if clearly else matern).unexplained
    assert matern.unexplained != gaussian.unexplained


@pytest.mark.parametrize(("drift", "degree"), [(0, 0), (1, 1), ("chosen", 0)])
def test_what_the_recipe_names_is_not_chosen_again(laid, values, drift, degree):
    settings = Kriging(covariance="exponential", drift=drift)
    chosen = coefficient_models.choose_covariance(settings, laid, values)
    assert (chosen.hyper.covariance, chosen.hyper.drifts) == ("exponential", (degree,))
    assert (chosen.hyper.trend > 0.0) == (drift == "chosen")


def test_noise_is_answered_with_its_mean_and_a_field_is_not(laid):
    for seed in range(5):
        noise = np.random.Generator(np.random.PCG64(seed)).normal(size=(24, 2))
        found = coefficient_models.fit(Kriging(), POSE, laid, noise)
        if isinstance(found.field, ConstantModel):
            assert np.array_equal(found.field.mean, noise.mean(axis=0))
            assert np.array_equal(found.residuals, laid.from_mean(noise))
        # What is left of a model of noise is a small part of what it was made from.
        answered = found.field.predict(laid.points) - noise.mean(axis=0)
        assert np.abs(answered).mean() < 0.4 * np.abs(noise).mean()
    kept = coefficient_models.fit(Kriging(nugget=0.1), POSE, laid, noise)
    assert isinstance(kept.field, Field)
