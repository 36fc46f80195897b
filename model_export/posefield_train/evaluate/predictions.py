"""Predictions of posefield and two other methods for the same queries, from the same training."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from posefield.common.units import Floats
from posefield.motion import skeleton
from posefield_train.evaluate import motion_errors
from posefield_train.evaluate.motion_errors import ComparedMotion, MotionEvent
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_points
from posefield_train.kriging.gaussian_process import MarginalLikelihood
from posefield_train.kriging.kriging_bank import VARIANCE
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.tensor import motion_tensor, truncation_error
from posefield_train.tensor.motion_tensor import UNIFORM_SHARES
from posefield_train.tensor.truncation_error import EventFrame


def predict_process(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
    """Return predictions of a Gaussian process with a length scale for each control and performer.

    Length scales, amplitude and noise maximise the marginal likelihood.
    """
    centre, size = values.mean(axis=0), max(float(values.std()), 1e-12)
    lengths = np.ones(samples.points.shape[1])
    kernel = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(lengths, (0.1, 100.0))
    noisy = kernel + WhiteKernel(0.1, (1e-5, 10.0))
    scaled = (values - centre) / size
    squares = np.square(samples.points[:, None] - samples.points)
    likelihood = MarginalLikelihood(squares, scaled)
    model = GaussianProcessRegressor(noisy, optimizer=likelihood.optimize, random_state=0)
    with warnings.catch_warnings():
        # A length scale at its bound is a valid result: the control has no influence, or all.
        warnings.simplefilter("ignore", ConvergenceWarning)
        predicted = model.fit(samples.points, scaled).predict(queries)
    return centre + size * predicted.reshape(len(queries), -1)


OURS, GP, MEAN = "posefield", "gp", "mean"
DEFINITIONS = {
    OURS: "the model as exported: truncated, with its own bone lengths and timing",
    GP: "scikit-learn GaussianProcessRegressor, ARD RBF + white noise, label as columns",
    MEAN: "the mean motion",
}
"""Definition of each method."""

Values = Mapping[str, Floats]
"""Values (n, m) of each kriged quantity by name; "pose" may be pose vectors (n, T, D)."""


@dataclass(frozen=True)
class Queries:
    """Queries. controls: (Q, d). labels: names of each query by label set; empty for none."""

    controls: Floats
    labels: Sequence[Mapping[str, str]]


@dataclass(frozen=True)
class Predictions:
    """Predictions of all methods.

    motions: by method; None for queries that a method does not predict. sigma: standard deviation
    (Q,) that posefield predicts, m. joint_sigma: of each joint (Q, J), m.
    """

    motions: Mapping[str, Sequence[ComparedMotion | None]]
    sigma: Floats
    joint_sigma: Floats


def predict(trained: TrainedModel, queries: Queries) -> Predictions:
    """Return the predictions of every method, posefield's first."""
    points, values = query_points(trained, queries), trained.values
    process = {
        name: predict_process(trained.samples, sample_values, points)
        for name, sample_values in values.items()
    }
    mean = {
        name: np.tile(sample_values.mean(axis=0), (len(points), 1))
        for name, sample_values in values.items()
    }
    peers = {GP: with_pose_vectors(trained, process), MEAN: with_pose_vectors(trained, mean)}
    return with_sigma(trained, queries, peers)


def with_sigma(trained: TrainedModel, queries: Queries, peers: Mapping[str, Values]) -> Predictions:
    """Return the predictions of posefield and of peers by name, and posefield's sigma.

    peers: predicted values, with pose vectors.
    """
    bank = trained.model.bank
    motions = {OURS: predict_posefield(trained, queries)}
    motions |= motions_of_values(trained, peers)
    sigma = bank.sigma(bank.numpy(query_points(trained, queries))[VARIANCE])
    return Predictions(motions, sigma, sigma[:, None] * trained.joints)


def query_points(trained: TrainedModel, queries: Queries) -> Floats:
    """Return the points (Q, d + p) of queries: controls in half-ranges, and labels."""
    return trained.model.bank.points(queries.controls, _labels(trained, queries))


def _labels(trained: TrainedModel, queries: Queries) -> Floats:
    return sample_points.label_weights(queries.labels, trained.model.bank.labels)


def captured_event(trained: TrainedModel, landmarks: Sequence[float]) -> MotionEvent | None:
    """Return the event of a captured clip from its landmarks; None if the recipe names none."""
    recipe = trained.recipe
    frame = truncation_error.event_frame(recipe, trained.examples)
    if frame is None or recipe.event is None:
        return None
    if recipe.event.at in ("start", "end"):
        return MotionEvent(frame.joint, float(recipe.event.at == "end"))
    return MotionEvent(frame.joint, landmarks[recipe.landmark_names.index(recipe.event.at)])


def predict_posefield(trained: TrainedModel, queries: Queries) -> list[ComparedMotion]:
    """Return the predictions of the exported model."""
    event = truncation_error.event_frame(trained.recipe, trained.examples)
    labels, model = _labels(trained, queries), trained.model
    fields = model.bank.numpy(model.bank.points(queries.controls, labels))
    times = np.exp(fields["duration"]) * UNIFORM_SHARES
    answer = model.evaluate(queries.controls, times, labels)
    motions = _motions(
        trained,
        answer.rotations,
        answer.root_position,
        answer.bone_offsets,
        answer.duration,
        fields["warp"],
        event,
    )
    if answer.curves is None:
        return motions
    return motion_errors.with_curves(motions, model.decoder.curves, answer.curves)


def with_pose_vectors(trained: TrainedModel, values: Values) -> Values:
    """Return predicted values with pose vectors (Q, T, D) for reduced motions (Q, N)."""
    return {**values, "pose": pose_vectors(trained, values["pose"])}


def pose_vectors(trained: TrainedModel, coefficients: Floats) -> Floats:
    """Return pose vectors (Q, T, D) of motions (Q, N) in coordinates of the sample mode."""
    return trained.tensor.numbers(trained.full.slices(coefficients))


def motions_of_values(
    trained: TrainedModel, peers: Mapping[str, Values]
) -> dict[str, list[ComparedMotion]]:
    """Return motions of the values that peers predict, with pose vectors.

    They have the model's timing, travel, chart and bones.
    """
    event, model = truncation_error.event_frame(trained.recipe, trained.examples), trained.model
    names = next(iter(peers.values()))
    values = {
        name: np.concatenate([predicted[name] for predicted in peers.values()]) for name in names
    }
    poses = motion_tensor.predicted_poses(
        model.timing, trained.tensor, values["pose"], values["warp"], values.get("travel")
    )
    offsets = model.proportions.numpy(values["offsets"])
    durations = np.exp(values["duration"][:, 0])
    motions = _motions(
        trained, poses.rotations, poses.path, offsets, durations, values["warp"], event
    )
    motions = motion_errors.with_curves(motions, trained.tensor.curves, poses.curves)
    count = len(motions) // len(peers)
    return {name: motions[i * count : (i + 1) * count] for i, name in enumerate(peers)}


def _motions(
    trained: TrainedModel,
    rotations: Floats,
    path: Floats,
    offsets: Floats,
    durations: Floats,
    logs: Floats,
    event: EventFrame | None,
) -> list[ComparedMotion]:
    """Return motions of rotations (Q, S, J, 4), root paths (Q, S, 3), bone offsets (Q, J, 3)."""
    translations = skeleton.translations(offsets, path)
    events = [_predicted_event(trained, log, event) for log in logs]
    return motion_errors.motions_of_poses(
        trained.skeleton.parents, rotations, translations, list(map(float, durations)), events
    )


def _predicted_event(
    trained: TrainedModel, logs: Floats, event: EventFrame | None
) -> MotionEvent | None:
    """Return the event at the share of the duration that the predicted timing gives it."""
    if event is None:
        return None
    timing = trained.model.timing
    share = np.array([event.frame / (timing.frames - 1)])
    return MotionEvent(event.joint, float(timing.basis.invert(timing.warps(logs), share)[0]))
