"""Tests of several label sets: covariance, tuning, graph, and what knowing labels is worth."""

from dataclasses import replace

import numpy as np
import pytest
from families import sample_walk
from running import bank_values, outputs
from scipy.optimize import check_grad

from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper, LabelKernel
from posefield_train import training
from posefield_train.kriging import kriging_bank, sample_points, universal_kriging
from posefield_train.kriging.kriging_bank import KrigingBank
from posefield_train.kriging.kriging_graph import COVARIANCES
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import LeaveOneOutLoss, TuningProblem
from posefield_train.source import ingest

SETS = {"performer": ("ann", "bob", "cy"), "style": ("calm", "tired")}
KERNELS = (LabelKernel(3, 0.6, 0.4), LabelKernel(2, 0.3, 1.2))
COUNT = 24


@pytest.fixture(params=COVARIANCES)
def hyper(request):
    return Hyper(request.param, (0,), np.array([0.5, 0.9]), 0.1, 1.5, KERNELS)


def weights(named):
    return sample_points.label_weights(named, SETS)


@pytest.fixture
def named(rng):
    """Names of the samples in both sets."""
    return [{name: str(rng.choice(names)) for name, names in SETS.items()} for _ in range(COUNT)]


@pytest.fixture
def laid(rng, named):
    return np.hstack([rng.uniform(-1.0, 1.0, (COUNT, 2)), weights(named)])


def mixtures(rng, count):
    """Points with weights of both sets that sum to at most one; the first leaves both open."""
    both = [rng.dirichlet(np.ones(len(names) + 1), count)[:, :-1] for names in SETS.values()]
    found = np.hstack([rng.uniform(-1.0, 1.0, (count, 2)), *both])
    found[0, 2:] = 0.0
    return found


# --- the covariance -------------------------------------------------------------------------------


def test_covariance_is_stationary_with_offsets_and_a_trend(hyper, laid):
    controls = laid[:, :2]
    gaps = (controls[:, None] - controls) * hyper.scales
    expected = COVARIANCES[hyper.covariance].numpy(np.sum(gaps**2, axis=-1))
    offsets = hyper.trend * controls @ controls.T
    for kernel, columns in zip(KERNELS, (laid[:, 2:5], laid[:, 5:]), strict=True):
        same = columns @ columns.T
        expected *= np.where(same > 0.0, 1.0, kernel.correlation)
        offsets += kernel.offset * same
    expected += offsets
    assert np.abs(kriging_model.covariances(hyper, laid, laid) - expected).max() < 1e-12
    variances = kriging_model.prior_variances(hyper, laid)
    assert np.abs(variances - np.diagonal(expected)).max() < 1e-12
    steeper = replace(hyper, trend=0.9 * hyper.trend)
    assert np.abs(kriging_model.covariances(steeper, laid, laid) - expected).max() > 1e-2


def test_a_performer_left_out_is_a_stranger(hyper, laid, named, rng):
    values = rng.normal(size=(COUNT, 3))
    _, groups = np.unique([own["performer"] for own in named], return_inverse=True)
    found = kriging_model.leave_out(hyper, laid, groups) @ values
    for performer in range(3):
        own = groups == performer
        field = universal_kriging.solve(hyper, laid[~own], values[~own])
        nobody, other = laid[own].copy(), laid[own].copy()
        nobody[:, 2:5], other[:, 2:5] = 0.0, np.eye(3)[performer - 1]
        assert np.abs(found[own] - values[own] + field.predict(nobody)).max() < 1e-9
        assert np.abs(found[own] - values[own] + field.predict(other)).max() > 1e-2


def test_joint_covariance_of_names_mixtures_and_open_sets_is_positive_definite(hyper, laid, rng):
    points = np.vstack([laid, mixtures(rng, 30)])

    def least_eigenvalue(hyper, points):
        joint = kriging_model.covariances(hyper, points, points)
        np.fill_diagonal(joint, kriging_model.prior_variances(hyper, points))
        return np.linalg.eigvalsh(joint)[0]

    assert least_eigenvalue(hyper, points) > -1e-9
    # The samples' own covariance, which is inverted, needs no nugget.
    assert np.linalg.eigvalsh(kriging_model.covariances(hyper, laid, laid))[0] > 0.0
    # Negative control: styles that are further from one another than opposites.
    beyond = replace(hyper, labels=(KERNELS[0], LabelKernel(2, -3.0, 0.0)), trend=0.0)
    assert least_eigenvalue(beyond, points) < -0.5


def test_a_mixture_lies_between_its_names_and_is_less_certain(hyper, laid, rng):
    """Far from all clips the labels' offsets are left, in which the prediction is linear."""
    field = universal_kriging.solve(hyper, laid, rng.normal(size=(COUNT, 3)))
    far = np.full((4, 2), 60.0)
    styles = np.array([[1.0, 0.0], [0.0, 1.0], [0.7, 0.3], [0.0, 0.0]])
    asked = np.hstack([far, np.tile(np.eye(3)[:1], (4, 1)), styles])
    calm, tired, mixed, open_ = field.predict(asked)
    assert np.abs(mixed - (0.7 * calm + 0.3 * tired)).max() < 1e-9
    assert np.abs(mixed - open_).max() > 1e-3
    near = np.hstack([np.tile(laid[:1, :5], (4, 1)), styles])
    named, mixture, unknown = field.variance(near)[[int(laid[0, 6]), 2, 3]]
    assert named < mixture < unknown


def test_gradient_of_the_loss_is_that_of_both_sets(laid, rng):
    samples = SamplePoints(laid, 2, np.arange(COUNT) // 2, (3, 2))
    problem = TuningProblem(samples, rng.normal(size=(COUNT, 4)))
    kernels = [(name, index) for name in ("correlation", "offset") for index in (0, 1)]
    base = Hyper("matern52", (0,), np.ones(2), 0.0, 0.0, KERNELS)
    names = (("nugget", 0), *kernels, ("trend", 0))
    loss = LeaveOneOutLoss(problem, base, names, own_scales=True)
    at = np.array([-0.5, -0.2, -2.0, 0.4, -0.7, -1.0, 0.3, 0.2])
    away = check_grad(
        lambda x: loss.value_and_slope(x)[0], lambda x: loss.value_and_slope(x)[1], at
    )
    size = np.linalg.norm(loss.value_and_slope(at)[1])
    assert away < 1e-5 * size
    # Negative control: the slopes of the two correlations are not each other's.
    slope = loss.value_and_slope(at)[1]
    assert abs(slope[3] - slope[4]) > 1e-2 * size


def test_the_graph_weights_names_and_mixtures_as_the_reference_does(laid, rng):
    low, high = np.array([1.5, -60.0]), np.array([1.9, 60.0])
    fields = {}
    for name, size in (("pose", 6), ("offsets", 2), ("duration", 1)):
        kernels = tuple(replace(own, offset=own.offset * size) for own in KERNELS)
        hyper = Hyper("matern52", (0,), np.array([0.5, 0.9]), 0.1, 1.5, kernels)
        fields[name] = universal_kriging.solve(hyper, laid, rng.normal(size=(COUNT, size)))
    bank = KrigingBank(low, high, SETS, fields.pop("pose"), fields, 0.04)
    points = mixtures(rng, 40)
    points[20:, 2:] = np.hstack(kriging_bank.random_labels(rng, SETS, 20))
    controls = 0.5 * (points[:, :2] * (high - low) + high + low)

    def build(net, controls, *_):
        return bank_values(net, bank, controls, [6])

    asked = controls.astype(np.float32).astype(float)
    found = outputs(build, (2, 2, 2, 1), controls=asked, labels=points[:, 2:])
    variance, *values = bank.numpy(bank.points(asked, points[:, 2:])).values()
    expected = [*values, bank.sigma(variance)]

    def apart(expected):
        return max(np.abs(a - b).max() for a, b in zip(found, expected, strict=True))

    assert apart(expected) < 2e-4
    turned = bank.numpy(bank.points(asked, points[:, [3, 4, 2, 6, 5]]))
    assert apart([*list(turned.values())[1:], bank.sigma(turned["variance"])]) > 1e-2


# --- a family of two walkers in three styles ------------------------------------------------------


@pytest.fixture(scope="module")
def strides(tmp_path_factory):
    folder = sample_walk.write_styled_walk(tmp_path_factory.mktemp("styles"))
    return ingest.ingest(sample_walk.styled_recipe(), folder)[0]


def left_out_error(labels, examples):
    """Leave-one-out error, m, of a model that knows some label sets."""
    recipe = sample_walk.styled_recipe()
    kriging = recipe.kriging.model_copy(update={"label": labels})
    made = training.train_examples(
        recipe.model_copy(update={"kriging": kriging}), examples, lambda _: None
    )
    return float(np.sqrt(made.left_out_errors.mean()))


def test_both_labels_are_better_than_one(strides):
    both = left_out_error(["performer", "style"], strides)
    performer = left_out_error(["performer"], strides)
    assert both < 0.5 * performer
    # Negative control: styles of other clips tell nothing.
    order = np.random.Generator(np.random.PCG64(5)).permutation(len(strides))
    shuffled = [
        replace(own, row=replace(own.row, other_labels=other.row.other_labels))
        for own, other in zip(strides, [strides[i] for i in order], strict=True)
    ]
    assert left_out_error(["performer", "style"], shuffled) > 0.9 * performer


def test_sets_that_divide_the_clips_alike_are_noted(strides):
    recipe = sample_walk.styled_recipe()
    assert sample_points.data_notes(recipe, strides) == []
    same = [
        replace(own, row=replace(own.row, other_labels={"style": own.row.performer}))
        for own in strides
    ]
    (said,) = sample_points.data_notes(recipe, same)
    assert said.startswith("label sets 'performer' and 'style' divide the clips alike")


def test_a_set_of_one_name_is_left_out_and_noted(strides):
    recipe = sample_walk.styled_recipe()
    plain = [replace(own, row=replace(own.row, other_labels={"style": "calm"})) for own in strides]
    laid, known = sample_points.make_samples(recipe, plain)
    assert known == {"performer": ("ann", "ben")} and laid.labels == (2,)
    assert sample_points.data_notes(recipe, plain) == [
        "all clips are of one style, 'calm': kriging.label has no effect"
    ]
