"""Tests of random fields: their covariances, and their conditioning on samples."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.kriging import kriging_model, random_field
from posefield.kriging.kriging_model import Hyper, KrigingWeights, LabelKernel

LABELS = (LabelKernel(3, 0.5, 0.3), LabelKernel(2, 0.2, 0.4))
HYPER = Hyper("matern52", (0,), np.array([0.5, 0.8]), 0.15, 0.1, LABELS)
SEEDS, FIELDS = 200, 8
BINS = 6
"""Distances of a variogram."""


def points(rng, count):
    """Points in half-ranges with names of both label sets."""
    names = [np.eye(own.count)[rng.integers(own.count, size=count)] for own in LABELS]
    return np.hstack([rng.uniform(-1.0, 1.0, (count, 2)), *names])


@pytest.fixture
def samples(rng):
    return points(rng, 25)


@pytest.fixture
def places(rng):
    """Points of one performer, of several, of none and of a mixture."""
    found = points(rng, 40)
    found[:20, 2:] = found[0, 2:]
    found[30:35, 2:] = 0.0
    found[35:, 2:5] = 1.0 / 3.0
    return found


def drawn(field_of, places):
    """Values (seeds x fields, B) of the fields of many seeds."""
    return np.concatenate([field_of(seed).evaluate(places).T for seed in range(1, SEEDS + 1)])


def kriging_variances(weights, places):
    """Variances (B,) of the prediction's error with the nugget, in sills."""
    hyper, samples = weights.hyper, weights.samples
    own, across = weights.weights(places), kriging_model.covariances(hyper, places, samples)
    error = np.einsum("bn,nm,bm->b", own, kriging_model.noisy(hyper, samples), own)
    prior = kriging_model.prior_variances(hyper, places) + hyper.nugget
    return prior + error - 2.0 * np.sum(own * across, axis=1)


def variogram_ratios(values, hyper, places):
    """Simulated over the model's semivariance of one performer's points, in bins of distance."""
    rows, columns = np.triu_indices(20, 1)
    apart = kriging_model.squared_distances(hyper, places, places)[rows, columns]
    prior = kriging_model.prior_variances(hyper, places)
    model = (
        0.5 * (prior[rows] + prior[columns])
        - kriging_model.covariances(hyper, places, places)[rows, columns]
    )
    simulated = 0.5 * np.mean(np.square(values[:, rows] - values[:, columns]), axis=0)
    bins = np.array_split(np.argsort(apart), BINS)
    return np.array([simulated[own].sum() / model[own].sum() for own in bins])


@pytest.mark.parametrize("covariance", ["gaussian", "exponential", "matern32", "matern52"])
def test_an_unconditional_field_has_the_covariance_of_the_model(covariance, places):
    hyper = replace(HYPER, covariance=covariance)
    values = drawn(lambda seed: random_field.draw_field(hyper, seed, FIELDS), places)
    assert np.allclose(variogram_ratios(values, hyper, places), 1.0, atol=0.1)
    ratios = values.var(axis=0) / kriging_model.prior_variances(hyper, places)
    assert np.allclose(ratios, 1.0, atol=0.15) and ratios.mean() == pytest.approx(1.0, abs=0.05)
    # Half the scales show in the variogram.
    wrong = replace(hyper, scales=0.5 * hyper.scales)
    values = drawn(lambda seed: random_field.draw_field(wrong, seed, FIELDS), places)
    assert not np.allclose(variogram_ratios(values, hyper, places), 1.0, atol=0.1)


def test_a_conditional_field_has_the_kriging_variance_and_no_mean(samples, places):
    weights = KrigingWeights(HYPER, samples)
    values = drawn(lambda seed: random_field.simulate(weights, seed, FIELDS), places)
    ratios = values.var(axis=0) / kriging_variances(weights, places)
    assert np.allclose(ratios, 1.0, atol=0.15) and ratios.mean() == pytest.approx(1.0, abs=0.05)
    errors = values.mean(axis=0) / np.sqrt(values.var(axis=0) / len(values))
    assert np.sqrt(np.mean(np.square(errors))) < 1.3
    # Without conditioning the variance is that of the whole field.
    values = drawn(lambda seed: random_field.draw_field(HYPER, seed, FIELDS), places)
    assert np.mean(values.var(axis=0) / kriging_variances(weights, places)) > 1.5


def test_without_nugget_a_conditional_field_is_zero_at_the_samples(samples):
    exact = KrigingWeights(replace(HYPER, nugget=0.0), samples)
    assert np.abs(random_field.simulate(exact, 7, FIELDS).evaluate(samples)).max() < 1e-7
    rough = KrigingWeights(HYPER, samples)
    assert np.abs(random_field.simulate(rough, 7, FIELDS).evaluate(samples)).max() > 0.1


def test_a_seed_is_one_smooth_function_of_the_controls(samples):
    field = random_field.simulate(KrigingWeights(HYPER, samples), 7, FIELDS)
    path = np.repeat(samples[:1], 201, axis=0)
    path[:, 0] = np.linspace(-1.0, 1.0, len(path))
    values = field.evaluate(path)
    step = np.abs(np.diff(values, axis=0)).max()
    assert step < 0.1 * np.ptp(values, axis=0).max()
    assert np.abs(np.diff(values, 2, axis=0)).max() < 0.1 * step
    # A field of its own for each point jumps.
    jumping = [
        random_field.simulate(field.weights, seed, FIELDS).evaluate(path[[seed]])[0]
        for seed in range(1, 101)
    ]
    assert np.abs(np.diff(jumping, axis=0)).max() > 10.0 * step


def test_fields_of_many_seeds_are_those_of_each_alone(samples):
    weights, seeds = KrigingWeights(HYPER, samples), np.array([4, 9, 5])
    paths = np.stack([samples[:6], samples[2:8], samples[4:10]])
    found = random_field.simulate(weights, seeds, FIELDS).evaluate(paths)
    for seed, path, values in zip(seeds.tolist(), paths, found, strict=True):
        alone = random_field.simulate(weights, seed, FIELDS).evaluate(path)
        assert np.abs(values - alone).max() <= 1.1e-9
        other = random_field.simulate(weights, seed + 10, FIELDS).evaluate(path)
        assert np.abs(values - other).max() > 0.1


def test_a_covariance_without_frequencies_is_refused(samples):
    spherical = replace(HYPER, covariance="spherical")
    assert not random_field.has_features(spherical)
    with pytest.raises(ValueError, match="spherical"):
        random_field.draw_field(spherical, 7, FIELDS)


def test_points_that_are_evaluated_together_have_the_bits_that_each_has_alone(samples, places):
    field = random_field.simulate(KrigingWeights(HYPER, samples), 7, FIELDS)
    alone = np.concatenate([field.evaluate(place[None]) for place in places])
    assert field.evaluate_each(places).tobytes() == alone.tobytes()
    assert field.evaluate_each(places[3:5]).tobytes() == alone[3:5].tobytes()
    # Rounding hides that one product of matrices sums in another order; its weights show it.
    weights = KrigingWeights(HYPER, samples)
    single = np.concatenate([weights.weights(place[None]) for place in places])
    assert weights.weights(places[:, None])[:, 0].tobytes() == single.tobytes()
    assert weights.weights(places).tobytes() != single.tobytes()


# Known answers of Random123, the reference implementation: counter, key and words.
KNOWN = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


NORMALS = [0.000291568, -0.304846986, 1.788757349]


"""First numbers of seed 7, stream 0."""


COUNT = 100_000


@pytest.mark.parametrize(("counter", "key", "expected"), KNOWN)
def test_words_are_those_of_the_reference_implementation(counter, key, expected):
    counters = np.array(counter, dtype=np.uint64)[:, None]
    assert tuple(random_field.philox(counters, key)[:, 0].tolist()) == expected
    other = key[0] ^ 1, key[1]
    assert tuple(random_field.philox(counters, other)[:, 0].tolist()) != expected


def test_normal_numbers_are_the_same_in_every_version():
    found = random_field.normals(7, 0, 1, 3)
    assert found[0].tolist() == NORMALS
    assert random_field.normals(7, 0, 1, 4)[0, :3].tolist() == NORMALS
    assert random_field.normals(8, 0, 1, 3)[0].tolist() != NORMALS


def test_normal_numbers_are_standard_and_streams_independent():
    first, second = (random_field.normals(3, stream, 1, COUNT)[0] for stream in (0, 1))
    error = COUNT**-0.5
    assert abs(first.mean()) < 3.0 * error
    assert abs(first.var() - 1.0) < 3.0 * error * 2.0**0.5
    assert abs(np.mean(first**4) - 3.0) < 3.0 * error * 96.0**0.5
    assert abs(first @ second) / COUNT < 3.0 * error
    assert abs(first[:-1] @ first[1:]) / COUNT < 3.0 * error


def test_numbers_of_many_seeds_are_those_of_each_alone():
    seeds = np.array([[3, 8], [2**40 + 1, 0]])
    found = random_field.normals(seeds, 1, 5, 7)
    assert found.shape == (2, 2, 5, 7)
    for place in np.ndindex(2, 2):
        assert np.array_equal(found[place], random_field.normals(int(seeds[place]), 1, 5, 7))
        assert not np.array_equal(
            found[place], random_field.normals(int(seeds[place]) + 1, 1, 5, 7)
        )
    assert np.array_equal(
        random_field.signs(seeds, 1, 3, 2)[1, 0], random_field.signs(2**40 + 1, 1, 3, 2)
    )
