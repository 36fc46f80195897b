"""Examples to a model: align, tensor, HOSVD, kriging."""

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
"""Is told what is being done, in a few words."""


@dataclass(frozen=True)
class Trained:
    """A model with what it was made from and what was seen on the way.

    examples: in an order of their own, so that the model does not depend on the table's. laid:
    where they lie. pose: the tuned pose field. values: what each field is laid through (N, m), the
    pose's whole motions in the coordinates of the sample mode. missed (N,): mean squared joint
    distance, m², of each clip from what all others predict for it. explained: for each field the
    share of the variation between clips that leave-one-out predicts from the controls; one that is
    not surely above zero is answered with its mean. residuals: of each field but the pose, left
    out (N, m). fidelity: what the truncation costs. joints (J,): how far each joint of a clip left
    out lies from what all others predict, as a share of the root mean square of all. strangers:
    what speaks against clips that do not seem to belong.
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
    """Aligned clips as pose vectors (N, T, D), with their bone offsets (N, J, 3), m, and where they
    lie among the controls and performers.

    travels (N, 3) are a cycle's, and empty else.
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
    """Model of a recipe's examples.

    Raises TrainingError where the samples cannot carry a field.
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
    """By controls, and repeated trials by their duration and pace."""

    def key(example: Example) -> tuple[float, ...]:
        return (*example.controls, example.clip.duration, *example.clip.root_path[-1])

    return tuple(sorted(examples, key=key))


def _move(recipe: Recipe, examples: Sequence[Example], weights: Floats) -> _Moved:
    """Clips aligned and written as pose vectors."""
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
    """What the other clips predict for each, by a field of its own parameters."""

    def predict(values: Floats) -> Floats:
        covariance = recipe.kriging.covariances[0]
        return values - fields.tuned(recipe.kriging, covariance, laid, values).residuals

    def mean(values: Floats) -> Floats:
        return np.broadcast_to(values.mean(axis=0), values.shape)

    return mean if recipe.alignment.reference == "mean" else predict


@dataclass(frozen=True)
class _Fits:
    """Every field at its own parameters: what it is laid through (N, m), and what it misses (N,) of
    the poses, m²."""

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
    """The stages that the fields feed, of controls (N, d)."""
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
    """Fields, the ranks that keep the budgets, and the model of both."""
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
    """Mean squared joint distance (N,), m², of each clip from what the others predict."""
    frames = own_tensor.values.shape[1]
    missed = np.sum(np.square(pose.residuals), axis=1) / (own_tensor.weight * frames)
    if "travel" in fitted:
        missed += travel.spread(fitted["travel"].residuals)
    return missed


def _mean_skeleton(examples: Sequence[Example], offsets: Floats) -> Skeleton:
    """The family's joints with mean bone offsets, the root at its mean height at rest."""
    first = examples[0].clip.skeleton
    rest = offsets.mean(axis=0)
    rest[0] = np.mean([example.clip.skeleton.offsets[0] for example in examples], axis=0)
    tips = np.mean([example.clip.skeleton.tip_offsets for example in examples], axis=0)
    return Skeleton(first.names, first.parents, rest, first.tip_joints, tips)
