"""Training of a model: examples, alignment, tensor, HOSVD, kriging.

The steps follow Mukai & Kuriyama 2006, section 2.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from posefield.common import atomic_files
from posefield.common.units import Floats
from posefield.motion.skeleton import Skeleton
from posefield_train import outliers
from posefield_train.align import phase_alignment, time_alignment, travel
from posefield_train.align.time_alignment import AlignedClips, Refinement
from posefield_train.align.travel import Travel
from posefield_train.align.warp import CanonicalTiming, WarpBasis
from posefield_train.contacts import common_stances, contact_model
from posefield_train.graph import onnx_export, truncation_cost, warped_errors
from posefield_train.graph.float_model import FloatModel
from posefield_train.graph.onnx_export import ExportedModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.jobs import Jobs, ordered_results, single_threaded
from posefield_train.kriging import (
    coefficient_models,
    gaussian_process,
    kriging_bank,
    kriging_tuning,
    performer_means,
    sample_points,
    universal_kriging,
)
from posefield_train.kriging.coefficient_models import FittedModel
from posefield_train.kriging.kriging_bank import KrigingBank, PowerLaw
from posefield_train.kriging.kriging_tuning import TunedKriging
from posefield_train.kriging.sample_points import LabelNames, SamplePoints
from posefield_train.kriging.tuning_loss import TuningProblem
from posefield_train.source import canonical, ingest
from posefield_train.source import recipe as recipe_file
from posefield_train.source.canonical import Finding
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import hosvd, motion_tensor, truncation_error
from posefield_train.tensor.decoder import (
    COEFFICIENTS,
    Decoder,
    EventBlend,
    Proportions,
    build_blend,
    effector_weights,
    event_distances,
    event_weights,
)
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.motion_tensor import MotionTensor
from posefield_train.tensor.truncation_error import TruncationReference

StepCallback = Callable[[str], None]
"""Callback for progress messages."""


def _silent(step: str) -> None: ...


def read_recipe(path: Path | str) -> Recipe:
    """Return the recipe of a TOML file; RecipeError names the invalid key."""
    return recipe_file.read_accepted(Path(path))


@dataclass(frozen=True)
class _VectorizedClips:
    """Aligned clips as pose vectors.

    samples: their sample points. labels: names of each label set. offsets: bone offsets (N, J, 3),
    m. tensor: of the pose vectors. travels: (N, 3) of cycles, otherwise empty. controls: (N, d), in
    their own units.
    """

    samples: SamplePoints
    labels: LabelNames
    aligned: AlignedClips
    offsets: Floats
    tensor: MotionTensor
    travels: dict[str, Floats]
    findings: list[Finding]
    controls: Floats


def train(recipe: Recipe, folder: Path | str, report: StepCallback = _silent) -> TrainedModel:
    """Return the model of a recipe whose motion data are in a folder.

    report: called with a description of each step. Raises RecipeError if data cannot be read,
    TrainingError as `train_examples` and for a preset outside the data.
    """
    report("reading the clips")
    examples, notes = ingest.ingest(recipe, Path(folder))
    ingest.check_presets(recipe, examples)
    return train_examples(recipe, examples, report, notes=notes)


def export(model: TrainedModel, path: Path | str) -> ExportedModel:
    """Write the .onnx file of a model with its levels of detail; equal data give equal bytes.

    Raises TrainingError and ExportRefused as `onnx_export.export_model` does.
    """
    exported = onnx_export.export_model(model)
    atomic_files.write(exported.content, Path(path))
    return exported


@single_threaded()
def train_examples(
    recipe: Recipe,
    examples: Sequence[Example],
    report: StepCallback = _silent,
    jobs: Jobs = kriging_tuning.SERIAL,
    notes: Sequence[str] = (),
) -> TrainedModel:
    """Return a model of a recipe's examples.

    report: called with a description of each step. jobs: executor of the parts that need not wait
    for each other, which give the same bytes on all. notes: of the import, for the model card.
    Raises TrainingError if the samples do not determine a kriging model.
    """
    names = tuple(control.name for control in recipe.controls)
    controls = np.stack([example.controls for example in examples])
    outliers.check_family(recipe, examples)
    universal_kriging.check_samples(
        controls, names, recipe.kriging.degree, recipe.kriging.nugget == 0
    )
    examples = _sorted(examples)
    canonical.return_freed_memory()
    report(f"aligning {len(examples)} clips")
    weights = truncation_error.joint_weights(recipe, examples)
    examples = phase_alignment.align_phases(recipe, examples, weights)
    clips = _vectorize(recipe, examples, weights, jobs)
    report("decomposing the motion tensor")
    full = _decompose(clips)
    canonical.return_freed_memory()
    report("fitting the fields")
    trained = _fit_and_truncate(recipe, examples, clips, full, jobs)
    return replace(trained, outliers=outliers.find_outliers(recipe, trained), notes=tuple(notes))


# Root mean square distance of joints, m, that each of the three projections of a large tensor may
# leave out: together less than the least limit of a truncation.
NEXT_TO_NOTHING = 5e-5


def _decompose(vectorized: _VectorizedClips) -> TuckerTensor:
    """Return the HOSVD of a family's tensor; that of a large one in passes over its clips."""
    tensor = vectorized.tensor
    if vectorized.samples.inducing is None:
        return hosvd.decompose(tensor.values)
    _, frames, clips = tensor.values.shape
    return hosvd.decompose_in_passes(
        tensor.values, NEXT_TO_NOTHING**2 * tensor.weight * frames * clips
    )


def _sorted(examples: Sequence[Example]) -> tuple[Example, ...]:
    """Sort examples by controls, and repeated trials by duration and travel."""

    def key(example: Example) -> tuple[float, ...]:
        return (*example.controls, example.clip.duration, *example.clip.root_path[-1])

    return tuple(sorted(examples, key=key))


def _vectorize(
    recipe: Recipe, examples: Sequence[Example], weights: Floats, jobs: Jobs
) -> _VectorizedClips:
    """Align clips and build the tensor of their pose vectors."""
    basis, settings = WarpBasis(recipe.alignment.knots), recipe.alignment
    samples, labels = sample_points.make_samples(recipe, examples)
    refinement = None
    if settings.warp == "fitted":
        refinement = Refinement(settings.rounds, _predictor(recipe, samples, jobs))
    aligned = time_alignment.align(examples, recipe.motion.frames, basis, weights, refinement, jobs)
    travels = {}
    if recipe.motion.cyclic:
        aligned, travels["travel"] = travel.remove_travel(aligned)
    offsets = np.stack([example.offsets for example in examples])
    parents, curves = examples[0].clip.skeleton.parents, examples[0].clip.curves
    hinged = examples[0].robot is not None
    numbers, chart, noticed = motion_tensor.pose_vectors(aligned, parents, offsets, hinged)
    if samples.inducing is not None:
        aligned = aligned.without_poses()
    tensor = motion_tensor.build_tensor(
        numbers, chart, parents, offsets, weights, curves.curves if curves else ()
    )
    jumps = [replace(jump, clip=i) for i, example in enumerate(examples) for jump in example.jumps]
    findings = jumps + noticed
    controls = np.stack([example.controls for example in examples])
    return _VectorizedClips(samples, labels, aligned, offsets, tensor, travels, findings, controls)


def _predictor(recipe: Recipe, samples: SamplePoints, jobs: Jobs) -> time_alignment.Predictor:
    settings = recipe.kriging

    def predict(values: Floats) -> Floats:
        problem = TuningProblem(samples, values, settings.nugget)
        covariance, degree = settings.covariances[0], settings.fixed_degree
        tuned = kriging_tuning.tune(problem, covariance, degree, jobs=jobs)
        predicted: Floats = np.subtract(values, tuned.residuals, out=tuned.residuals)
        return predicted

    def mean(values: Floats) -> Floats:
        return np.broadcast_to(values.mean(axis=0), values.shape)

    return mean if recipe.alignment.reference == "mean" else predict


@dataclass(frozen=True)
class _FittedModels:
    """Tuned models of all quantities.

    timing: of predictions. values: sample values (N, m) by name. left_out_errors: mean squared
    leave-one-out distance (N,), m². warped_errors: the same of whole motions after time warping.
    acceleration: that of left-out predictions over that of captured clips.
    """

    proportions: Proportions
    timing: CanonicalTiming
    values: dict[str, Floats]
    pose: TunedKriging
    other_models: dict[str, FittedModel]
    left_out_errors: Floats
    warped_errors: Floats
    acceleration: float
    power_law: PowerLaw | None
    event: TunedKriging | None


def _fit_models(
    recipe: Recipe,
    examples: Sequence[Example],
    clips: _VectorizedClips,
    reference: TruncationReference,
    full: TuckerTensor,
    jobs: Jobs,
) -> _FittedModels:
    samples, tensor = clips.samples, reference.tensor
    proportions, bones = coefficient_models.fit_proportions(clips.offsets)
    durations = np.log(clips.aligned.durations)[:, None]
    other_values = {
        **clips.travels,
        "offsets": bones,
        "duration": durations,
        "warp": clips.aligned.logs,
    }
    effector = effector_weights(reference, full)
    pose = coefficient_models.choose_covariance(
        recipe.kriging, samples, full.motions, effector, jobs
    )
    pose = performer_means.shrink(pose, samples, full.motions, effector)
    fitted = {
        k: coefficient_models.fit(recipe.kriging, pose.hyper, samples, v)
        for k, v in other_values.items()
    }
    for k, v in clips.travels.items():
        fitted[k] = gaussian_process.with_own_ranges(fitted[k], samples, v)
    power_law_fit = kriging_bank.fit_power_law(
        pose.hyper, samples, clips.controls, durations, fitted["duration"].residuals
    )
    power_law = power_law_fit.law if power_law_fit else None
    if power_law_fit:
        fitted["duration"] = coefficient_models.factor_of(
            power_law_fit, samples, clips.controls, durations
        )
    values = {"pose": full.motions, **other_values}
    left_out_errors = _left_out_errors(tensor, pose, fitted)
    motions = full.motions - pose.residuals
    expected = {name: values[name] - fit.residuals for name, fit in fitted.items()}
    timing = CanonicalTiming(WarpBasis(recipe.alignment.knots), recipe.motion.frames)
    # Where the recipe gives a nugget, it has decided that the controls explain the samples.
    if recipe.kriging.nugget is None:
        timing = timing.unbiased(expected["warp"])

    def motions_of(rows: slice) -> tuple[Floats, Floats, int]:
        predicted = warped_errors.predicted_positions(
            timing,
            tensor,
            proportions,
            full.slices(motions[rows]),
            {name: rows_of_values[rows] for name, rows_of_values in expected.items()},
            reference.parents,
        )
        captured = warped_errors.captured_positions(examples[rows])
        return captured, predicted, len(tensor.curves)

    compared = map(motions_of, canonical.clip_blocks(len(examples)))
    results = np.concatenate(ordered_results(jobs, warped_errors.compare, compared))
    warped, predicted, captured = results.T
    acceleration = float(predicted.sum() / captured.sum()) if captured.any() else 1.0
    event = _fit_event(recipe, samples, reference, full, pose, effector)
    return _FittedModels(
        proportions,
        timing,
        values,
        pose,
        fitted,
        left_out_errors,
        warped,
        acceleration,
        power_law,
        event,
    )


def _fit_event(
    recipe: Recipe,
    samples: SamplePoints,
    reference: TruncationReference,
    full: TuckerTensor,
    pose: TunedKriging,
    effector: Floats | None,
) -> TunedKriging | None:
    """Return the second model of the pose for the time around the event, where it is better.

    effector: as in `TuningProblem`.
    """
    if effector is None or reference.event_frame is None or recipe.kriging.fixed_degree is not None:
        return None
    second = coefficient_models.tune_event(
        recipe.kriging.nugget, pose, samples, full.motions, effector
    )
    errors = coefficient_models.compare_models(
        reference, full, reference.event_frame, (pose, second)
    )
    return second if errors.is_used else None


# Shares of the leave-one-out errors that a truncation may add: squared, it adds 3 % to the mean
# squared error of all joints, and 11 % to that of the event's joint; 6 % where a second prediction
# at the event is worth its columns.
ALL_JOINTS_SHARE, EFFECTOR_SHARE, EVENT_SHARE = 1 / 6, 1 / 3, 1 / 4
SMALLEST_LIMIT = 1e-4


def _truncation_limits(
    reference: TruncationReference, full: TuckerTensor, fits: _FittedModels
) -> dict[str, float]:
    """Return the largest errors of a truncation, m, that hardly add to those of the prediction."""
    rms = float(np.sqrt(np.mean(fits.left_out_errors)))
    limits = {"rms": max(ALL_JOINTS_SHARE * rms, SMALLEST_LIMIT)}
    if reference.event_frame is not None:
        residuals = (fits.event or fits.pose).residuals
        distances = event_distances(reference, full, reference.event_frame, residuals)
        effector = float(np.sqrt(np.mean(np.square(distances))))
        share = EVENT_SHARE if fits.event else EFFECTOR_SHARE
        limits["effector"] = max(share * effector, SMALLEST_LIMIT)
    return limits


def _assemble(
    recipe: Recipe,
    controls: Floats,
    clips: _VectorizedClips,
    reference: TruncationReference,
    fits: _FittedModels,
    reduced: TuckerTensor,
) -> FloatModel:
    motions = performer_means.move(clips.samples, fits.pose.share, reduced.bases[2])
    solved = universal_kriging.solve_samples(fits.pose.hyper, clips.samples, motions)
    event, blend = None, _event_blend(recipe, reference, fits, reduced)
    if fits.event and blend:
        values = motions[:, : blend.count]
        event = universal_kriging.solve_samples(fits.event.hyper, clips.samples, values)
    other_models = {name: fit.field for name, fit in fits.other_models.items()}
    ranges, tensor = (controls.min(axis=0), controls.max(axis=0)), reference.tensor
    sill = float(np.mean(fits.warped_errors / fits.pose.variances))
    return FloatModel(
        KrigingBank(*ranges, clips.labels, solved, other_models, sill, (), fits.power_law, event),
        fits.timing,
        Decoder(
            reduced, tensor.mean, tensor.unwhiten, tensor.chart, event=blend, curves=tensor.curves
        ),
        fits.proportions,
        Travel(recipe.motion.frames, len(tensor.chart.means)) if recipe.motion.cyclic else None,
    )


def _event_blend(
    recipe: Recipe, reference: TruncationReference, fits: _FittedModels, reduced: TuckerTensor
) -> EventBlend | None:
    if fits.event is None or reference.event_frame is None:
        return None
    weights = event_weights(recipe.motion.frames, reference.event_frame.frame, recipe.motion.cyclic)
    return build_blend(COEFFICIENTS, weights, reduced.core, reduced.bases[1])


def _fit_and_truncate(
    recipe: Recipe,
    examples: Sequence[Example],
    clips: _VectorizedClips,
    full: TuckerTensor,
    jobs: Jobs,
) -> TrainedModel:
    tensor = clips.tensor
    reference = truncation_error.truncation_reference(recipe, examples, tensor)
    fits = _fit_models(recipe, examples, clips, reference, full, jobs)
    controls = np.stack([example.controls for example in examples])
    price = truncation_cost.RANK_COSTS[recipe.size.cost](tensor, controls.shape[1])
    limits = _truncation_limits(reference, full, fits)
    reduced = full.truncated(
        truncation_cost.choose_ranks(recipe.size, full, price, reference, limits)
    )
    explained = {name: fit.explained for name, fit in fits.other_models.items()}
    residuals = {name: fit.residuals for name, fit in fits.other_models.items()}
    model = _assemble(recipe, controls, clips, reference, fits, reduced)
    warps = (model.timing, clips.aligned.logs)
    hyper = fits.pose.hyper
    contacts, notes = contact_model.fit_contacts(recipe, examples, clips.samples, hyper, warps)
    if contacts:
        bank = replace(model.bank, contacts=contacts.kriging)
        model = replace(model, bank=bank, contacts=contacts.table)
    return TrainedModel(
        recipe,
        model,
        tuple(examples),
        clips.samples,
        _mean_skeleton(examples, clips.offsets),
        clips.aligned,
        tensor,
        full,
        fits.pose,
        fits.values,
        fits.left_out_errors,
        fits.warped_errors,
        fits.acceleration,
        {"pose": 1.0 - fits.pose.unexplained, **explained},
        clips.findings,
        residuals,
        reference.evaluate(reduced),
        joint_error_shares(reference, full, fits.pose, residuals.get("travel")),
        contacts=contacts,
        soles=common_stances.find(examples[0].robot, clips.aligned, clips.travels.get("travel")),
        contact_notes=tuple(notes),
    )


def _left_out_errors(
    tensor: MotionTensor, pose: TunedKriging, fitted: dict[str, FittedModel]
) -> Floats:
    """Return leave-one-out mean squared joint distances (N,), m², of all clips."""
    frames = tensor.values.shape[1]
    squares = np.sum(np.square(pose.residuals), axis=1) / (tensor.weight * frames)
    if "travel" in fitted:
        squares += travel.mean_squared_distance(fitted["travel"].residuals)
    return squares


def _mean_skeleton(examples: Sequence[Example], offsets: Floats) -> Skeleton:
    """Return the family's joints with mean bone offsets, the root at its mean height at rest."""
    first = examples[0].clip.skeleton
    rest = offsets.mean(axis=0)
    rest[0] = np.mean([example.clip.skeleton.offsets[0] for example in examples], axis=0)
    tips = np.mean([example.clip.skeleton.tip_offsets for example in examples], axis=0)
    return Skeleton(first.names, first.parents, rest, first.tip_joints, tips)


# Least share of a joint, so that its sigma is never zero.
MIN_JOINT_SHARE = 0.01


def joint_error_shares(
    reference: TruncationReference, full: TuckerTensor, pose: TunedKriging, travels: Floats | None
) -> Floats:
    """Return the root mean square error (J,) of each joint as a share of that of all joints.

    pose: kriging model of the full tensor's motions; its variances normalize the error of each
    clip. travels: residuals (N, 3) of a cycle's travel. Distances are true ones, by forward
    kinematics.
    """
    tensor = reference.tensor

    def block_squares(rows: slice) -> Floats:
        predicted = tensor.values[:, :, rows] - full.slices(pose.residuals[rows])
        positions = truncation_error.positions(
            tensor, predicted, reference.parents, reference.offsets[rows]
        )
        return np.mean(np.sum(np.square(positions - reference.points[rows]), axis=-1), axis=1)

    blocks = canonical.clip_blocks(len(reference.points))
    squares = np.concatenate([block_squares(rows) for rows in blocks])
    if travels is not None:
        squares[:, : len(reference.parents)] += travel.mean_squared_distance(travels)[:, None]
    mean_squares = np.mean(squares / pose.variances[:, None], axis=0)
    # Sigma is that of joints and curves together.
    overall, joints = np.mean(mean_squares), mean_squares[: len(reference.parents)]
    if overall == 0.0:
        return np.ones_like(joints)
    return np.maximum(np.sqrt(joints / overall), MIN_JOINT_SHARE)
