"""New clips in the canonical time and the chart of a trained model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield.motion.clip import assemble
from posefield.motion.contact_detection import FootContact
from posefield.motion.curves import CurveValues
from posefield.motion.skeleton import Skeleton
from posefield_train.align import phase_alignment, time_alignment
from posefield_train.align import travel as travels
from posefield_train.align.time_alignment import FINE, AlignedClips, CanonicalTime
from posefield_train.graph.float_model import FloatModel
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.jobs import single_threaded
from posefield_train.kriging import sample_points
from posefield_train.kriging.kriging_bank import VARIANCE
from posefield_train.source import canonical, clip_joints
from posefield_train.source.canonical import Finding
from posefield_train.source.ingest import Example
from posefield_train.tensor import truncation_error

# A clip farther from the prediction than this many times sigma of an unseen performer is taken for
# another action. On three real families held-out performers lie within 1.1, 0.9 and 1.8 times
# sigma, and clips of another family beyond 2.3 times.
OUTLIER_SIGMAS = 2.0


@dataclass(frozen=True)
class AdaptableModel:
    """A model of one level with the training data that adaptation needs.

    skeleton: of the family. landmarks: their canonical times (M,). joint_weights: (J,). in_phase:
    True if cycles were shifted to a common phase. in_place: True if the root does not travel.
    truncation: root mean square error of the truncated tensor, m. groups: group (n,) of each
    sample; a group is left out together. left_out: leave-one-out errors (n,) of the samples, m, on
    canonical time. feet: joints whose contacts are detected. contacts: of the model's joints.
    """

    model: FloatModel
    skeleton: Skeleton
    landmarks: Floats
    joint_weights: Floats
    in_phase: bool
    in_place: bool
    truncation: float
    groups: Indices
    left_out: Floats
    feet: tuple[int, ...] = ()
    contacts: tuple[FootContact, ...] = ()

    @cached_property
    def canonical_excess(self) -> float:
        """Return the ratio of mean squared errors on canonical time to those that sigma counts.

        Sigma compares motions after time warping, which leaves less of an error.
        """
        pose, sill = self.model.bank.pose, self.model.bank.sill
        left_out = kriging_model.leave_out(pose.hyper, pose.samples, self.groups)
        variances = kriging_model.left_out_variances(pose.hyper, pose.samples, left_out)
        return float(np.mean(np.square(self.left_out) / variances)) / sill if sill else 1.0

    @property
    def canonical_time(self) -> CanonicalTime:
        """Return the model's canonical time."""
        timing = self.model.timing
        return CanonicalTime(timing.frames, timing.basis, self.landmarks, self.joint_weights)


def adaptable(trained: TrainedModel) -> AdaptableModel:
    """Return the data that adaptation needs of a model that has just been trained."""
    recipe, marks = trained.recipe, [example.landmarks for example in trained.examples]
    return AdaptableModel(
        trained.model,
        trained.skeleton,
        np.array(marks).reshape(len(marks), -1).mean(axis=0),
        truncation_error.joint_weights(recipe, trained.examples),
        recipe.motion.cyclic and recipe.alignment.begin == "in_phase",
        recipe.motion.root == "in_place",
        trained.truncation_errors.rms,
        trained.samples.groups,
        np.sqrt(trained.left_out_errors),
        tuple(map(trained.skeleton.names.index, recipe.motion.feet)),
        trained.contacts.statistics if trained.contacts else (),
    )


@dataclass(frozen=True)
class CanonicalClips:
    """New clips in a model's canonical time and chart.

    examples: clips at the model's phase. numbers: pose vectors (k, T, D). offsets: (k, J, 3), m.
    travels: (k, 3), m, of cycles, otherwise empty. distances: root mean square distance (k,), m,
    over joints, curves and frames of each clip from the prediction for an unseen performer,
    relative to the root.
    """

    examples: tuple[Example, ...]
    aligned: AlignedClips
    numbers: Floats
    offsets: Floats
    travels: dict[str, Floats]
    findings: list[Finding]
    distances: Floats


def align_phase(adaptable: AdaptableModel, examples: Sequence[Example]) -> tuple[Example, ...]:
    """Shift examples to the phase of the model's cycles if those were aligned in phase."""
    if not adaptable.in_phase:
        return tuple(examples)
    with single_threaded():
        references = _references(adaptable, examples)
        return phase_alignment.align_phases_to(
            examples, references, adaptable.joint_weights, adaptable.in_place
        )


@single_threaded()
def to_canonical(adaptable: AdaptableModel, examples: Sequence[Example]) -> CanonicalClips:
    """Warp examples, already at the model's phase, to its canonical time and chart."""
    references = _references(adaptable, examples)
    aligned = time_alignment.align_to(examples, references, adaptable.canonical_time)
    distances = _distances(adaptable, examples, aligned.logs, references)
    gone = {}
    if adaptable.model.travel:
        aligned, gone["travel"] = travels.remove_travel(aligned)
    offsets = np.stack([e.offsets for e in examples])
    own_chart = adaptable.model.decoder.chart
    small = canonical.small_joints(adaptable.skeleton.parents, offsets.mean(axis=0))
    rotations, flipped = canonical.remove_flips_about(own_chart.means, aligned.rotations, small)
    jumps = [replace(jump, clip=i) for i, e in enumerate(examples) for jump in e.jumps]
    findings = jumps + flipped + own_chart.far_joints(rotations)
    numbers = own_chart.numbers(rotations, aligned.root_path)
    if aligned.curves is not None:
        numbers = np.concatenate([numbers, aligned.curves], axis=-1)
    return CanonicalClips(tuple(examples), aligned, numbers, offsets, gone, findings, distances)


def _references(adaptable: AdaptableModel, examples: Sequence[Example]) -> Floats:
    return np.stack([_predicted_trace(adaptable, example) for example in examples])


def _predicted_trace(adaptable: AdaptableModel, example: Example) -> Floats:
    """Return the trace (FINE, features) of the model's prediction with the example's bones."""
    model = adaptable.model
    frames = np.linspace(0.0, model.timing.frames - 1.0, FINE)[None]
    labels = sample_points.label_weights([example.row.labels], model.bank.labels)
    answer = model.outputs_at_frames(example.controls[None], frames, labels, 0)
    motion = answer.rotations[0], answer.root_position[0], example.offsets
    clip = assemble(adaptable.skeleton, *motion, (FINE - 1) / example.clip.duration)
    curves = model.decoder.curves
    values = None if answer.curves is None else CurveValues(curves, answer.curves[0])
    return time_alignment.trace(replace(clip, curves=values), np.sqrt(adaptable.joint_weights))


def _distances(
    adaptable: AdaptableModel, examples: Sequence[Example], logs: Floats, references: Floats
) -> Floats:
    """Return RMS distances (k,), m, of clips from their references (k, FINE, features)."""
    times, weights = np.linspace(0.0, 1.0, FINE), adaptable.joint_weights
    distances = []
    for example, log, reference in zip(examples, logs, references, strict=True):
        trace = time_alignment.trace(example.clip, np.sqrt(weights))
        warped = time_alignment.interpolate(
            trace, adaptable.canonical_time.basis.invert(log, times)
        )
        weight = weights.sum() + len(adaptable.model.decoder.curves)
        squares = np.sum(np.square(warped - reference), axis=1) / weight
        distances.append(np.sqrt(squares.mean()))
    return np.array(distances)


def refuse_outliers(adaptable: AdaptableModel, clips: CanonicalClips) -> None:
    """Raise TrainingError for the first clip that does not fit the family.

    Checked are the size of the bones, and the distance from the prediction, at most OUTLIER_SIGMAS
    times sigma on canonical time.
    """
    _refuse_other_sizes(adaptable.model, clips.examples)
    for example, distance, sigma in zip(
        clips.examples, clips.distances, _sigmas(adaptable, clips.examples), strict=True
    ):
        if distance > OUTLIER_SIGMAS * sigma:
            raise TrainingError(
                f"{example.row.named}: lies {100 * distance:.1f} cm from what the model expects of "
                f"an unseen performer, {distance / sigma:.1f} times the {100 * sigma:.1f} cm by "
                "which it expects them to differ, expected at most "
                f"{OUTLIER_SIGMAS:g} times; is it of "
                "another action, cut elsewhere, or in another unit?"
            )


def _refuse_other_sizes(model: FloatModel, examples: Sequence[Example]) -> None:
    """Raise TrainingError for bones of another size, which reveal another unit.

    Controls measured from the motion can hide a wrong unit.
    """
    offsets = model.proportions.numpy(model.bank.sample_values("offsets"))
    median = np.median(np.linalg.norm(offsets, axis=-1).sum(axis=-1))
    if median == 0.0:
        # A single joint has no bones, such as that of curves without a skeleton.
        return
    for example in examples:
        size = np.linalg.norm(example.offsets, axis=-1).sum() / median
        if not 1.0 / clip_joints.SIZE_LIMIT <= size <= clip_joints.SIZE_LIMIT:
            raise TrainingError(
                f"{example.row.named}: its bones are {size:.2g} times as long as is usual here, "
                f"expected at most {clip_joints.SIZE_LIMIT:g} times either way; in another unit?"
            )


def _sigmas(adaptable: AdaptableModel, examples: Sequence[Example]) -> Floats:
    """Return sigma (k,), m, of an unseen performer on canonical time, at the nearest controls.

    Controls are clipped to the sampled range because sigma grows without bound outside it.
    """
    bank, controls = adaptable.model.bank, np.stack([example.controls for example in examples])
    labels = sample_points.label_weights([e.row.labels for e in examples], bank.labels)
    points = bank.points(np.clip(controls, bank.low, bank.high), labels)
    return np.sqrt(adaptable.canonical_excess) * bank.sigma(bank.numpy(points)[VARIANCE])
