"""Training of a model from examples: alignment, tensor, HOSVD, kriging.

The steps follow Mukai & Kuriyama 2006, section 2.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from model_export import (
    align,
    cost,
    fidelity,
    fields,
    hosvd,
    kriging,
    phase,
    ranks,
    samples,
    shares,
    strangers,
    tensor,
    threads,
    travel,
)
from model_export.align import Aligned
from model_export.chart import Chart
from model_export.decoder import Decoder, Proportions
from model_export.fidelity import Fidelity
from model_export.field_bank import FieldBank
from model_export.fields import Fitted
from model_export.flips import Finding
from model_export.hosvd import Multilinear
from model_export.ingest import Example
from model_export.model import Model
from model_export.recipe import Recipe
from model_export.samples import Samples
from model_export.strangers import Stranger
from model_export.tensor import MotionTensor
from model_export.timing import Timing
from model_export.travel import Travel
from model_export.tune import Tuned
from model_export.warp import WarpBasis
from service.motion.conventions import Floats
from service.motion.skeleton import Skeleton

Report = Callable[[str], None]
"""Callback for progress messages."""


@dataclass(frozen=True)
class Trained:
    """A trained model with its training data and diagnostics.

    examples: sorted by their content, so that the model does not depend on the order of the table.
    laid: sample points. pose: tuned kriging model of the pose. values: sample values (N, m) of each
    quantity, the pose's full motions in the coordinates of the sample mode. missed: mean squared
    joint distance (N,), m², of each clip from its leave-one-out prediction. explained: share of the
    variation between clips that leave-one-out predicts from the controls, by quantity; without a
    significant gain the quantity is constant. residuals: leave-one-out residuals (N, m) of each
    quantity but the pose. fidelity: truncation errors. joints: leave-one-out error (J,) of each
    joint as a share of the root mean square of all. strangers: evidence against clips that do not
    fit.
    """

    model: Model
    examples: tuple[Example, ...]
    laid: Samples
    skeleton: Skeleton
    aligned: Aligned
    tensor: MotionTensor
    full: Multilinear
    pose: Tuned
    values: dict[str, Floats]
    missed: Floats
    explained: dict[str, float]
    findings: list[Finding]
    residuals: dict[str, Floats]
    fidelity: Fidelity
    joints: Floats
    strangers: tuple[Stranger, ...] = ()


@dataclass(frozen=True)
class _Moved:
    """Aligned clips as pose vectors.

    numbers: (N, T, D). offsets: bone offsets (N, J, 3), m. laid: their sample points. travels: (N,
    3) of cycles, otherwise empty.
    """

    laid: Samples
    performers: tuple[str, ...]
    aligned: Aligned
    offsets: Floats
    numbers: Floats
    chart: Chart
    travels: dict[str, Floats]
    findings: list[Finding]


def train(recipe: Recipe, examples: Sequence[Example], report: Report) -> Trained:
    """Return a model of a recipe's examples.

    report: called with a description of each step. Raises TrainingError if the samples do not
    determine a kriging model.
    """
    with threads.one():
        return _train(recipe, examples, report)


def _train(recipe: Recipe, examples: Sequence[Example], report: Report) -> Trained:
    names = tuple(control.name for control in recipe.controls)
    given = np.stack([example.controls for example in examples])
    kriging.check(given, names, recipe.kriging.degree, recipe.kriging.nugget == 0)
    examples = _sorted(examples)
    report(f"aligning {len(examples)} clips")
    weights = fidelity.joint_weights(recipe, examples)
    examples = phase.in_phase(recipe, examples, weights)
    moved = _move(recipe, examples, weights)
    report("building the motion tensor")
    parents = examples[0].clip.skeleton.parents
    own_tensor = tensor.build(moved.numbers, moved.chart, parents, moved.offsets, weights)
    full = hosvd.decompose(own_tensor.values)
    report("fitting the fields")
    trained = _fit(recipe, examples, moved, own_tensor, full)
    return replace(trained, strangers=strangers.find(recipe, trained))


def _sorted(examples: Sequence[Example]) -> tuple[Example, ...]:
    """Sort examples by controls, and repeated trials by duration and travel."""

    def key(example: Example) -> tuple[float, ...]:
        return (*example.controls, example.clip.duration, *example.clip.root_path[-1])

    return tuple(sorted(examples, key=key))


def _move(recipe: Recipe, examples: Sequence[Example], weights: Floats) -> _Moved:
    """Align clips and convert them to pose vectors."""
    basis, settings = WarpBasis(recipe.alignment.knots), recipe.alignment
    laid, performers = samples.lay(recipe, examples)
    predict = _predictor(recipe, laid)
    aligned = align.align(examples, recipe.motion.frames, basis, settings.rounds, weights, predict)
    travels = {}
    if recipe.motion.cyclic:
        aligned, travels["travel"] = travel.take_out(aligned)
    offsets = np.stack([example.offsets for example in examples])
    parents = examples[0].clip.skeleton.parents
    numbers, chart, noticed = tensor.pose_vectors(aligned, parents, offsets)
    jumps = [replace(jump, clip=i) for i, example in enumerate(examples) for jump in example.jumps]
    findings = jumps + noticed
    return _Moved(laid, performers, aligned, offsets, numbers, chart, travels, findings)


def _predictor(recipe: Recipe, laid: Samples) -> align.Predict:
    """Return a function that predicts each clip from the others by a tuned kriging model."""

    def predict(values: Floats) -> Floats:
        covariance = recipe.kriging.covariances[0]
        return values - fields.tuned(recipe.kriging, covariance, laid, values).residuals

    def mean(values: Floats) -> Floats:
        return np.broadcast_to(values.mean(axis=0), values.shape)

    return mean if recipe.alignment.reference == "mean" else predict


@dataclass(frozen=True)
class _Fits:
    """Tuned models of all quantities.

    values: sample values (N, m) by name. missed: mean squared leave-one-out distance (N,), m².
    """

    proportions: Proportions
    values: dict[str, Floats]
    pose: Tuned
    beside: dict[str, Fitted]
    missed: Floats


def _fits(recipe: Recipe, moved: _Moved, own_tensor: MotionTensor, full: Multilinear) -> _Fits:
    laid = moved.laid
    proportions, bones = fields.proportions(moved.offsets)
    durations = np.log(moved.aligned.durations)[:, None]
    beside = {**moved.travels, "offsets": bones, "duration": durations, "warp": moved.aligned.logs}
    pose = fields.chosen(recipe.kriging, laid, full.motions)
    covariance = pose.hyper.covariance
    fitted = {k: fields.fit(recipe.kriging, covariance, laid, v) for k, v in beside.items()}
    values = {"pose": full.motions, **beside}
    missed = _missed(own_tensor, pose, fitted)
    return _Fits(proportions, values, pose, fitted, missed)


def _model(
    recipe: Recipe,
    controls: Floats,
    moved: _Moved,
    own_tensor: MotionTensor,
    fits: _Fits,
    reduced: Multilinear,
) -> Model:
    """Assemble the model of controls (N, d) from the tuned models and the truncated tensor."""
    solved = kriging.solve(fits.pose.hyper, moved.laid.points, reduced.bases[2])
    others = {name: found.field for name, found in fits.beside.items()}
    ends = controls.min(axis=0), controls.max(axis=0)
    sill = float(np.mean(fits.missed / fits.pose.variances))
    return Model(
        FieldBank(*ends, moved.performers, solved, others, sill),
        Timing(WarpBasis(recipe.alignment.knots), recipe.motion.frames),
        Decoder(reduced, own_tensor.mean, own_tensor.unwhiten, own_tensor.chart.means),
        fits.proportions,
        Travel(recipe.motion.frames) if recipe.motion.cyclic else None,
    )


def _fit(
    recipe: Recipe,
    examples: Sequence[Example],
    moved: _Moved,
    own_tensor: MotionTensor,
    full: Multilinear,
) -> Trained:
    """Fit the coefficient models, choose the ranks within the budgets, and assemble the model."""
    fits = _fits(recipe, moved, own_tensor, full)
    controls = np.stack([example.controls for example in examples])
    judge = fidelity.judge(recipe, examples, own_tensor)
    price = cost.PRICES[recipe.size.cost](own_tensor, controls.shape[1])
    reduced = full.truncated(ranks.choose(recipe.size, full, price, judge))
    explained = {name: found.explained for name, found in fits.beside.items()}
    residuals = {name: found.residuals for name, found in fits.beside.items()}
    return Trained(
        _model(recipe, controls, moved, own_tensor, fits, reduced),
        tuple(examples),
        moved.laid,
        _mean_skeleton(examples, moved.offsets),
        moved.aligned,
        own_tensor,
        full,
        fits.pose,
        fits.values,
        fits.missed,
        {"pose": 1.0 - fits.pose.unexplained, **explained},
        moved.findings,
        residuals,
        judge.of(reduced),
        shares.of_joints(judge, full, fits.pose, residuals.get("travel")),
    )


def _missed(own_tensor: MotionTensor, pose: Tuned, fitted: dict[str, Fitted]) -> Floats:
    """Return leave-one-out mean squared joint distances (N,), m², of all clips."""
    frames = own_tensor.values.shape[1]
    missed = np.sum(np.square(pose.residuals), axis=1) / (own_tensor.weight * frames)
    if "travel" in fitted:
        missed += travel.spread(fitted["travel"].residuals)
    return missed


def _mean_skeleton(examples: Sequence[Example], offsets: Floats) -> Skeleton:
    """Return the family's joints with mean bone offsets, the root at its mean height at rest."""
    first = examples[0].clip.skeleton
    rest = offsets.mean(axis=0)
    rest[0] = np.mean([example.clip.skeleton.offsets[0] for example in examples], axis=0)
    tips = np.mean([example.clip.skeleton.tip_offsets for example in examples], axis=0)
    return Skeleton(first.names, first.parents, rest, first.tip_joints, tips)
