"""Coefficient models of the quantities besides the pose: bone offsets, duration, warp, travel."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import ClipBones, Floats, SampleControls, SampleValues
from posefield.kriging.kriging_model import Hyper
from posefield_train.jobs import Jobs
from posefield_train.kriging import kriging_tuning, sample_points, universal_kriging
from posefield_train.kriging.kriging_bank import CoefficientModel, ConstantModel, PowerLawFit
from posefield_train.kriging.kriging_tuning import TunedKriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import (
    OTHER_STRENGTH,
    POSE_STRENGTH,
    PRIORS,
    SCALE_PRIOR,
    TINY,
    UNNAMED_STRENGTH,
    LeaveOneOutLoss,
    PoseLoss,
    TuningProblem,
)
from posefield_train.source.recipe_sections import Kriging
from posefield_train.tensor.decoder import COEFFICIENTS, Proportions, event_distances
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.truncation_error import EventFrame, TruncationReference

# The event's joint counts as much as all joints and frames, twice as much as in the pose's model.
EFFECTOR_GAIN = np.sqrt(2.0)
# The second model must reduce the error at the event to this share of the first's.
CLEAR_EVENT_IMPROVEMENT = 0.98


@dataclass(frozen=True)
class EventErrors:
    """Root mean square leave-one-out distance of the event's joint at the event, m.

    pose: with the pose's model. event: with the second one.
    """

    pose: float
    event: float

    @property
    def is_used(self) -> bool:
        """Return True if the second model is clearly better."""
        return self.event < CLEAR_EVENT_IMPROVEMENT * self.pose


def tune_event(
    nugget: float | None,
    pose: TunedKriging,
    samples: SamplePoints,
    values: Annotated[Floats, "samples modes"],
    effector: Annotated[Floats, "samples _ _"],
) -> TunedKriging:
    """Return the event's model of the motions (N, N): it has the pose's scales and a free trend.

    nugget: fixed value; None to tune it. effector: as in `TuningProblem`.
    """
    problem = TuningProblem(samples, values, nugget, EFFECTOR_GAIN * effector, OTHER_STRENGTH)
    # So large a trend leaves the slopes to the samples, as a linear drift does.
    trend = float(np.exp(PRIORS["trend"].high))
    return kriging_tuning.tune_at_scales(problem, replace(pose.hyper, trend=trend))


def compare_models(
    reference: TruncationReference,
    full: TuckerTensor,
    event: EventFrame,
    models: tuple[TunedKriging, TunedKriging],
) -> EventErrors:
    """Return the leave-one-out errors at the event of the pose's and of the event's model.

    The event's model predicts the leading coefficients alone.
    """
    pose, second = (model.residuals for model in models)
    blended = pose.copy()
    blended[:, :COEFFICIENTS] = second[:, :COEFFICIENTS]
    distances = (
        event_distances(reference, full, event, residuals) for residuals in (pose, blended)
    )
    return EventErrors(*(float(np.sqrt(np.mean(np.square(one)))) for one in distances))


# Largest error of bone offsets that a model may make, m.
SAME_BONE = 5e-4
# A Gaussian covariance is conditioned worse than Matérn's; it must reduce the error to this share.
CLEAR_IMPROVEMENT = 0.95
# Shares of the tuned scales, each of a longer range, that a large family is tried with.
LONGER = np.geomspace(0.95, 0.5, 13)
# Values that differ by less than this share of the largest are equal but for rounding.
ROUNDING = 1e-12
# Shares of a model that count as none, and as the whole of it.
NEGLIGIBLE, WHOLE = 0.05, 0.95


@dataclass(frozen=True)
class FittedModel:
    """A fitted coefficient model.

    explained: share of the variation that it explains. residuals: leave-one-out residuals (N, m).
    """

    field: CoefficientModel
    explained: float
    residuals: SampleValues


def choose_covariance(
    settings: Kriging,
    samples: SamplePoints,
    values: SampleValues,
    effector: Annotated[Floats, "samples _ _"] | None = None,
    jobs: Jobs = kriging_tuning.SERIAL,
) -> TunedKriging:
    """Return the model of values (N, m) with the first covariance, or a clearly better one.

    Parameters minimise the squares and the density of left-out recordings; the squares alone where
    performers have no names, and in large families.

    A covariance is clearly better if its leave-one-out error is below CLEAR_IMPROVEMENT times the
    first's. effector: as in `TuningProblem`. jobs: as in `kriging_tuning.tune`.
    """
    strength = UNNAMED_STRENGTH if samples.unnamed else POSE_STRENGTH
    problem = TuningProblem(
        samples, values, settings.nugget, effector, strength, unnamed=samples.unnamed
    )
    alone = samples.unnamed or samples.inducing is not None
    loss = LeaveOneOutLoss if alone else PoseLoss
    first, *alternatives = (
        kriging_tuning.tune(problem, name, settings.fixed_degree, jobs=jobs, loss=loss)
        for name in settings.covariances
    )
    best = min(alternatives, key=lambda field: field.unexplained, default=first)
    chosen = best if best.unexplained < CLEAR_IMPROVEMENT * first.unexplained else first
    if len(samples.points) > sample_points.LARGEST_TUNED:
        # The better of the model and of one tuned on other clips, with their disagreement.
        second = kriging_tuning.tune(
            problem, chosen.hyper.covariance, settings.fixed_degree, draw=1, jobs=jobs
        )
        errors = np.sqrt([chosen.unexplained, second.unexplained])
        disagreement = float(errors.max() / max(errors.min(), TINY) - 1.0)
        better = min(chosen, second, key=lambda field: field.unexplained)
        chosen = replace(better, disagreement=disagreement)
    return chosen if samples.inducing is None else _smoothest(chosen, samples, values)


def _smoothest(tuned: TunedKriging, samples: SamplePoints, values: SampleValues) -> TunedKriging:
    """Return the model of the longest ranges that predicts left-out takes as well as a tuned one.

    As well: its mean squared residual is at most one standard error of the tuned model's above it
    (Breiman et al. 1984, section 3.4.3). Recordings of a large family have near neighbours, and so
    hardly tell how far a clip says something about motions between them (decision 0025).
    """
    squares = _take_squares(samples, tuned.residuals)
    limit = float(np.mean(squares) + np.std(squares) / np.sqrt(len(squares)))
    smoothest, smallest = tuned.hyper, np.exp(SCALE_PRIOR.low)
    for share in LONGER:
        longer = replace(tuned.hyper, scales=np.maximum(share * tuned.hyper.scales, smallest))
        residuals = universal_kriging.left_out_residuals(longer, samples, values)
        if float(np.mean(_take_squares(samples, residuals))) > limit:
            break
        smoothest = longer
    if smoothest is tuned.hyper:
        return tuned
    evaluated = kriging_tuning.evaluate_fixed(smoothest, samples, values)
    return replace(evaluated, disagreement=tuned.disagreement)


def _take_squares(
    samples: SamplePoints, residuals: SampleValues
) -> Annotated[Floats, "recordings"]:
    """Return the squared residuals (g,) of each recording, summed over its clips."""
    _, recordings = np.unique(samples.groups, return_inverse=True)
    squares = np.einsum("nm,nm->n", residuals, residuals)
    return np.asarray(np.bincount(recordings, squares), dtype=np.float64)


def fit(settings: Kriging, pose: Hyper, samples: SamplePoints, values: SampleValues) -> FittedModel:
    """Return a model of values (N, m) with the scales of the pose's model, shrunk to their mean.

    Leave-one-out predictions tell by how much: their differences from the mean are multiplied by
    the share that fits the values best. A choice between model and mean does worse than either: a
    sample that is left out pulls the choice away from itself. Parameters are tuned by the density
    of left-out recordings.
    """
    if np.ptp(values, axis=0).max() <= ROUNDING * np.abs(values).max():
        return FittedModel(ConstantModel(values[0]), 0.0, np.zeros_like(values))
    problem = TuningProblem(samples, values, settings.nugget, strength=OTHER_STRENGTH)
    tuned = kriging_tuning.tune_beside(problem, pose)
    from_mean, mean = samples.from_mean(values), values.mean(axis=0)
    predicted = from_mean - tuned.residuals
    # Where the recipe gives a nugget, it has decided that the controls explain the samples.
    share = 1.0 if settings.nugget is not None else _explained_share(predicted, from_mean)
    if share == 0.0:
        return FittedModel(ConstantModel(mean), 0.0, from_mean)
    residuals = from_mean - share * predicted
    explained = 1.0 - float(np.sum(np.square(residuals)) / np.sum(np.square(from_mean)))
    shrunk = mean + share * (values - mean)
    return FittedModel(
        universal_kriging.solve_samples(tuned.hyper, samples, shrunk), explained, residuals
    )


def factor_of(
    fitted: PowerLawFit,
    samples: SamplePoints,
    controls: SampleControls,
    logs: Annotated[Floats, "samples 1"],
) -> FittedModel:
    """Return the model of what a power law of controls (N, d) leaves of logarithms (N, 1)."""
    left = logs - fitted.law.logarithms(controls)
    total = float(np.sum(np.square(samples.from_mean(logs))))
    explained = 1.0 - float(np.sum(np.square(fitted.residuals))) / total
    solved = universal_kriging.solve_samples(fitted.hyper, samples, left)
    return FittedModel(solved, explained, fitted.residuals)


def _explained_share(predicted: SampleValues, from_mean: SampleValues) -> float:
    """Return the share of predictions (N, m) that fits differences from the mean (N, m) best.

    From 0 to 1; next to either end it is the end.
    """
    total = float(np.sum(np.square(predicted)))
    share = float(np.sum(predicted * from_mean)) / total if total > 0.0 else 0.0
    return 0.0 if share < NEGLIGIBLE else min(share, 1.0) if share < WHOLE else 1.0


def fit_proportions(offsets: ClipBones) -> tuple[Proportions, Annotated[Floats, "clips rank"]]:
    """Return mean and directions of bone offsets (N, J, 3), and each clip's coefficients (N, r)."""
    mean = offsets.mean(axis=0)
    centred = (offsets - mean).reshape(len(offsets), -1)
    left, values, right = np.linalg.svd(centred, full_matrices=False)
    rank = 1
    while rank < len(values) and _largest_residual(centred, left, values, right, rank) > SAME_BONE:
        rank += 1
    turned = row_signs(right[:rank])
    directions = (turned[:, None] * right[:rank]).reshape(rank, -1, 3)
    # The root has no bone; clear the rounding error of the decomposition.
    directions[:, 0] = 0.0
    return Proportions(mean, directions), left[:, :rank] * values[:rank] * turned


def row_signs(rows: Annotated[Floats, "rows columns"]) -> Annotated[Floats, "rows"]:
    """Return the sign (r,) of the largest entry of each row, 1 for a zero row.

    Multiplying by it makes the rows independent of the machine.
    """
    largest = np.argmax(np.round(np.abs(rows), 9), axis=1)
    return np.where(rows[np.arange(len(rows)), largest] < 0, -1.0, 1.0)


def _largest_residual(
    centred: Annotated[Floats, "clips numbers"],
    left: Annotated[Floats, "clips rank"],
    values: Annotated[Floats, "rank"],
    right: Annotated[Floats, "rank numbers"],
    rank: int,
) -> float:
    reduced = (left[:, :rank] * values[:rank]) @ right[:rank]
    return float(np.abs(centred - reduced).max())
