"""Adaptation of a trained model to a new performer from a few clips.

The original clips are not needed: the model's samples, in reduced form, stand for them. The new
clips are aligned to the model's prediction for an unseen performer, their residuals extend the
bases, and every coefficient model is solved again with its existing parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper
from posefield.kriging.support import half_ranges
from posefield.model_file.model_card import PERFORMER
from posefield.motion.contact_detection import FootContact
from posefield_train.adapt import canonical_clips
from posefield_train.adapt.canonical_clips import AdaptableModel, CanonicalClips
from posefield_train.align import travel as travels
from posefield_train.contacts import contact_labels, contact_model
from posefield_train.contacts.contact_labels import ContactSettings
from posefield_train.contacts.contact_model import ContactTable
from posefield_train.graph.float_model import FloatModel
from posefield_train.jobs import single_threaded
from posefield_train.kriging import coefficient_models, sample_points, universal_kriging
from posefield_train.kriging.coefficient_models import SAME_BONE
from posefield_train.kriging.kriging_bank import CoefficientModel, ConstantModel, KrigingBank
from posefield_train.kriging.sample_points import LabelNames, SamplePoints
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.source.ingest import Example
from posefield_train.tensor import hosvd, motion_tensor
from posefield_train.tensor.decoder import Decoder, EventBlend, Proportions, build_blend
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.motion_tensor import CONSTANT_RANGE, MotionTensor

# Error allowed for a model that was not truncated, m: invisible.
MINIMUM_NORM = 1e-4


@dataclass(frozen=True)
class ExtendedTensor:
    """The motion tensor of existing samples followed by new clips.

    full: its decomposition at full rank. ranks: those that keep all of it.
    """

    tensor: MotionTensor
    full: TuckerTensor
    ranks: tuple[int, int, int]


@dataclass(frozen=True)
class _PoseSpace:
    """Metric of the model's poses, and a basis of its degrees of freedom.

    varies: mask (D,) of numbers that vary, those of curves included. root, inverse: (D', D'), to
    the metric's coordinates and back. directions: orthonormal (D', r1). turn: (r1, r1), from the
    core's coordinates to those of the directions.
    """

    varies: Floats
    root: Floats
    inverse: Floats
    directions: Floats
    turn: Floats


def extend(
    model: FloatModel,
    parents: tuple[int, ...],
    joint_weights: Floats,
    numbers: Floats,
    allowed: float,
) -> ExtendedTensor:
    """Return the tensor of a model's samples and new pose vectors (k, T, D).

    joint_weights: (J,). allowed: root mean square error, m, that truncation may add.
    """
    decoder = model.decoder
    weight = float(joint_weights.sum()) + len(decoder.curves)
    old = _reduced(decoder)
    space = _pose_space(model, parents, joint_weights, numbers, old)
    centred = (numbers - decoder.mean)[..., space.varies] @ space.root
    # Each of the two modes gets half of the squared error.
    clips, frames = numbers.shape[:2]
    budget = max(allowed, MINIMUM_NORM) ** 2 * weight * clips * frames / 2.0
    directions = _extra_directions(space.directions, centred, budget)
    coordinates = (centred @ directions).swapaxes(1, 2)
    times = np.linalg.qr(decoder.reduced.bases[1])[0]
    longer = _extra_directions(times, coordinates, budget)
    new = (coordinates @ longer @ longer.T).transpose(1, 2, 0)
    turned = hosvd.mode_dot(old, space.turn, 0)
    turned = np.pad(turned, ((0, len(new) - len(turned)), (0, 0), (0, 0)))
    tensor = _tensor(np.concatenate([turned, new], axis=2), space, directions, decoder, weight)
    full = hosvd.decompose(tensor.values)
    samples = min(decoder.reduced.core.shape[2] + clips, full.core.shape[2])
    return ExtendedTensor(tensor, full, (len(new), longer.shape[1], samples))


def _reduced(decoder: Decoder) -> Floats:
    """Return motions (r1, T, n) of the samples in the coordinates of the first mode."""
    core, (_, times, samples) = decoder.reduced.core, decoder.reduced.bases
    return hosvd.mode_dot(hosvd.mode_dot(core, times, 1), samples, 2)


def _pose_space(
    model: FloatModel,
    parents: tuple[int, ...],
    joint_weights: Floats,
    numbers: Floats,
    old: Floats,
) -> _PoseSpace:
    decoder, own_chart = model.decoder, model.decoder.chart
    poses = decoder.mean + old.transpose(2, 1, 0) @ decoder.directions
    offsets = model.proportions.numpy(model.bank.sample_values("offsets"))
    gram = motion_tensor.sampled_gram(poses, own_chart, parents, offsets, joint_weights)
    moves = np.ptp(numbers.reshape(-1, numbers.shape[-1]), axis=0) > CONSTANT_RANGE
    varies = moves | np.any(decoder.directions != 0.0, axis=0)
    root, inverse = motion_tensor.metric_roots(gram, decoder.curves, varies)
    mixed = (decoder.directions[:, varies] @ root).T
    directions = hosvd.fix_signs(np.linalg.qr(mixed)[0])
    return _PoseSpace(varies, root, inverse, directions, directions.T @ mixed)


def _extra_directions(basis: Floats, rows: Floats, budget: float) -> Floats:
    """Extend an orthonormal basis (D, r) by the fewest columns that fit rows (..., D).

    budget: largest squared distance of the rows from the extended basis.
    """
    flat = rows.reshape(-1, rows.shape[-1])
    left = flat - flat @ basis @ basis.T
    values, vectors = np.linalg.eigh(left.T @ left)
    rank = np.count_nonzero(np.cumsum(np.maximum(values, 0.0)) > budget)
    extra = vectors[:, len(values) - rank :]
    # Rounding leaves components along the old columns; remove them.
    extra, _ = np.linalg.qr(extra - basis @ (basis.T @ extra))
    return np.hstack([basis, hosvd.fix_signs(extra)])


def _tensor(
    values: Floats, space: _PoseSpace, directions: Floats, decoder: Decoder, weight: float
) -> MotionTensor:
    whiten, unwhiten = np.zeros((2, len(values), len(decoder.mean)))
    whiten[:, space.varies] = directions.T @ space.root
    unwhiten[:, space.varies] = directions.T @ space.inverse
    own_chart, own_curves = decoder.chart, decoder.curves
    return MotionTensor(values, decoder.mean, whiten, unwhiten.T, own_chart, weight, own_curves)


@dataclass(frozen=True)
class ExtendedSamples:
    """Samples of a model followed by new ones.

    low, high: ends of the sampled ranges (d,). labels: names of each label set. growth: ratio (d,)
    of new to old ranges.
    """

    low: Floats
    high: Floats
    labels: LabelNames
    samples: SamplePoints
    growth: Floats

    def hyper(self, old: Hyper) -> Hyper:
        """Return parameters rescaled to the new ranges, with the new number of names."""
        # One trend serves all controls, so that the most extended one decides.
        trend = old.trend * float(np.max(self.growth)) ** 2
        pairs = zip(old.labels, self.samples.labels, strict=True)
        labels = tuple(replace(kernel, count=count) for kernel, count in pairs)
        return replace(old, scales=old.scales * self.growth, trend=trend, labels=labels)


def extend_samples(
    bank: KrigingBank, old_groups: Indices, examples: Sequence[Example], performer: str
) -> ExtendedSamples:
    """Return the samples of a bank, with groups (n,), followed by examples of a new performer.

    New examples are grouped by recording for leave-one-out. Their other labels are those of their
    rows.
    """
    d = len(bank.low)
    old = (bank.pose.samples[:, :d] * (bank.high - bank.low) + bank.low + bank.high) / 2.0
    new = np.stack([example.controls for example in examples])
    low, high = np.minimum(bank.low, new.min(axis=0)), np.maximum(bank.high, new.max(axis=0))
    added = [{**example.row.labels, PERFORMER: performer} for example in examples]
    all_labels = [*_labels(bank), *added]
    names = {name: tuple(sorted({labels[name] for labels in all_labels})) for name in bank.labels}
    weights = sample_points.label_weights(all_labels, names)
    points = np.hstack([half_ranges(np.vstack([old, new]), low, high), weights])
    groups = np.concatenate(
        [old_groups, 1 + old_groups.max() + sample_points.recording_numbers(examples)]
    )
    growth = (high - low) / (bank.high - bank.low)
    samples = SamplePoints(points, d, groups, tuple(map(len, names.values())))
    return ExtendedSamples(low, high, names, samples, growth)


def _labels(bank: KrigingBank) -> list[dict[str, str]]:
    """Return the name of each sample of a bank in each label set."""
    counts = tuple(map(len, bank.labels.values()))
    columns = kriging_model.label_columns(len(bank.low), counts)
    return [
        {
            name: names[int(np.argmax(point[indices]))]
            for (name, names), indices in zip(bank.labels.items(), columns, strict=True)
        }
        for point in bank.pose.samples
    ]


def solve_extended(
    samples: ExtendedSamples, bank: KrigingBank, name: str, new: Floats
) -> CoefficientModel:
    """Return one of a bank's other models solved with its old values and new ones (k, m)."""
    field, old = bank.other_models[name], bank.sample_values(name)
    if isinstance(field, ConstantModel):
        # The controls did not explain the old values, so the model stays constant.
        n, k = len(old), len(new)
        return ConstantModel((n * field.mean + new.sum(axis=0)) / (n + k))
    hyper = samples.hyper(field.hyper)
    return universal_kriging.solve(hyper, samples.samples.points, np.vstack([old, new]))


def solve_bones(
    samples: ExtendedSamples, bank: KrigingBank, proportions: Proportions, offsets: Floats
) -> tuple[CoefficientModel, Proportions]:
    """Return the model of bone offsets solved with new clips' (k, J, 3), m, and its directions."""
    coefficients = bank.sample_values("offsets")
    old, new, longer = _extend_proportions(proportions, coefficients, offsets)
    both, field = np.vstack([old, new]), bank.other_models["offsets"]
    if not isinstance(field, ConstantModel):
        return universal_kriging.solve(
            samples.hyper(field.hyper), samples.samples.points, both
        ), longer
    differences = longer.numpy(new) - longer.numpy(old[:1])
    if np.abs(differences).max() <= SAME_BONE:
        return ConstantModel(old[0]), longer
    return universal_kriging.solve(
        _performer_parameters(samples, bank), samples.samples.points, both
    ), longer


# Bounds of the search for parameters: bones hardly vary between the clips of a performer.
SMALLEST_NUGGET, LARGEST_OFFSET = 1e-3, 30.0


def _performer_parameters(samples: ExtendedSamples, bank: KrigingBank) -> Hyper:
    """Return parameters of a model that is nearly constant for each performer.

    The offset outweighs what remains of the stationary covariance.
    """
    shared = samples.hyper(bank.pose.hyper).with_offsets(
        *(LARGEST_OFFSET if name == PERFORMER else 0.0 for name in bank.labels)
    )
    return replace(shared, nugget=SMALLEST_NUGGET, trend=0.0)


def _extend_proportions(
    proportions: Proportions, coefficients: Floats, offsets: Floats
) -> tuple[Floats, Floats, Proportions]:
    """Return coefficients of old (n, r) and new clips, with directions extended for the new."""
    flat = proportions.directions.reshape(len(proportions.directions), -1)
    centred = (offsets - proportions.mean).reshape(len(offsets), -1)
    projected = centred @ np.linalg.pinv(flat)
    left, values, right = np.linalg.svd(centred - projected @ flat, full_matrices=False)
    rank = 0
    while rank < len(values) and _largest_residual(left, values, right, rank) > SAME_BONE:
        rank += 1
    more = right[:rank] * coefficient_models.row_signs(right[:rank])[:, None]
    directions = np.vstack([flat, more]).reshape(-1, *proportions.mean.shape)
    directions[:, 0] = 0.0
    beyond = left[:, :rank] * values[:rank] * coefficient_models.row_signs(right[:rank])
    return (
        np.pad(coefficients, ((0, 0), (0, rank))),
        np.hstack([projected, beyond]),
        Proportions(proportions.mean, directions),
    )


def _largest_residual(left: Floats, values: Floats, right: Floats, rank: int) -> float:
    """Return the largest absolute entry of the remainder of a truncated decomposition."""
    return float(np.abs((left[:, rank:] * values[rank:]) @ right[rank:]).max())


@dataclass(frozen=True)
class ExtendedContacts:
    """Contacts of a model's samples followed by those of new clips.

    statistics: of each joint, by the clips that the model was trained on.
    """

    table: ContactTable
    kriging: UniversalKriging
    statistics: tuple[FootContact, ...]


@dataclass(frozen=True)
class AdaptedModel:
    """A model with one more performer, and intermediate results.

    left_out_errors: mean squared joint distance (k,), m², of each new clip from its leave-one-out
    prediction. contacts: None without contacts.
    """

    model: FloatModel
    new_clips: CanonicalClips
    extended: ExtendedTensor
    left_out_errors: Floats
    contacts: ExtendedContacts | None = None


def adapt(adaptable: AdaptableModel, examples: Sequence[Example], performer: str) -> AdaptedModel:
    """Return the model extended by a performer with an unused name and some examples."""
    shifted = canonical_clips.align_phase(adaptable, examples)
    return solve(adaptable, canonical_clips.to_canonical(adaptable, shifted), performer)


@single_threaded()
def solve(adaptable: AdaptableModel, clips: CanonicalClips, performer: str) -> AdaptedModel:
    """Return the adapted model for examples that are already in the model's canonical time."""
    model, law = adaptable.model, adaptable.model.bank.power_law
    parents, weights = adaptable.skeleton.parents, adaptable.joint_weights
    extended = extend(model, parents, weights, clips.numbers, adaptable.truncation)
    samples = extend_samples(model.bank, adaptable.groups, clips.examples, performer)
    reduced = extended.full.truncated(extended.ranks)
    pose = universal_kriging.solve(
        samples.hyper(model.bank.pose.hyper), samples.samples.points, reduced.bases[2]
    )
    bones, proportions = solve_bones(samples, model.bank, model.proportions, clips.offsets)
    durations = np.log(clips.aligned.durations)[:, None]
    if law:
        durations -= law.logarithms(np.stack([example.controls for example in clips.examples]))
    new = {**clips.travels, "duration": durations, "warp": clips.aligned.logs}
    solved = {
        name: solve_extended(samples, model.bank, name, values) for name, values in new.items()
    }
    # Keep the model's order of quantities.
    other_models = {name: solved.get(name, bones) for name in model.bank.other_models}
    left_out_errors, sill = _left_out_errors(adaptable, samples, clips, extended)
    ranges = samples.low, samples.high
    event, blend = _event(samples, model, reduced)
    contacts = _extend_contacts(adaptable, clips, samples)
    field, table = (contacts.kriging, contacts.table) if contacts else (None, None)
    bank = KrigingBank(*ranges, samples.labels, pose, other_models, sill, (), law, event, field)
    tensor = extended.tensor
    decoder = Decoder(
        reduced, tensor.mean, tensor.unwhiten, tensor.chart, event=blend, curves=tensor.curves
    )
    adapted = FloatModel(bank, model.timing, decoder, proportions, model.travel, table)
    return AdaptedModel(adapted, clips, extended, left_out_errors, contacts)


def _event(
    samples: ExtendedSamples, model: FloatModel, reduced: TuckerTensor
) -> tuple[UniversalKriging | None, EventBlend | None]:
    """Return the event's model and blend for the extended tensor, if the model has them."""
    old, blend = model.bank.event, model.decoder.event
    if old is None or blend is None:
        return None, None
    count = min(blend.count, reduced.core.shape[2])
    values = reduced.bases[2][:, :count]
    solved = universal_kriging.solve(samples.hyper(old.hyper), samples.samples.points, values)
    first, second = reduced.core, reduced.bases[1]
    return solved, build_blend(count, blend.weights, first, second)


def _left_out_errors(
    adaptable: AdaptableModel,
    samples: ExtendedSamples,
    clips: CanonicalClips,
    extended: ExtendedTensor,
) -> tuple[Floats, float]:
    """Return leave-one-out errors of the new clips, and the sill updated with them.

    The errors are mean squared joint distances (k,), m², on canonical time; the sill is in m².
    """
    old = adaptable.model.bank
    hyper, points, k = samples.hyper(old.pose.hyper), samples.samples.points, len(clips.examples)
    left_out = kriging_model.leave_out(hyper, points, samples.samples.groups)
    variances = kriging_model.left_out_variances(hyper, points, left_out)[-k:]
    residuals = left_out[-k:] @ extended.full.motions
    frames = extended.tensor.values.shape[1]
    mean_squares = np.sum(np.square(residuals), axis=1) / (extended.tensor.weight * frames)
    for values in clips.travels.values():
        mean_squares += travels.mean_squared_distance(_travel_residuals(old, samples, values))
    n = len(points) - k
    ratio_sum = np.sum(mean_squares / variances) / adaptable.canonical_excess
    return mean_squares, float((n * old.sill + ratio_sum) / (n + k))


def _travel_residuals(old: KrigingBank, samples: ExtendedSamples, new: Floats) -> Floats:
    """Return leave-one-out residuals (k, 3) of the new clips' travel, m."""
    field, values = old.other_models["travel"], np.vstack([old.sample_values("travel"), new])
    if isinstance(field, UniversalKriging):
        hyper, groups = samples.hyper(field.hyper), samples.samples.groups
        left_out = kriging_model.leave_out(hyper, samples.samples.points, groups)
        return left_out[-len(new) :] @ values
    return samples.samples.from_mean(values)[-len(new) :]


def _extend_contacts(
    adaptable: AdaptableModel, new_clips: CanonicalClips, samples: ExtendedSamples
) -> ExtendedContacts | None:
    """Return the contacts of a model's samples and of new clips; None without any.

    Joints whose contacts came from a table of clips are left out, for new clips have none.
    """
    field, table, timing = (
        adaptable.model.bank.contacts,
        adaptable.model.contacts,
        adaptable.model.timing,
    )
    columns = [
        column
        for column, contact in enumerate(adaptable.contacts)
        if contact.joint in adaptable.feet
    ]
    if field is None or table is None or not columns:
        return None
    statistics = tuple(adaptable.contacts[column] for column in columns)
    joints = tuple(contact.joint for contact in statistics)
    settings = ContactSettings(joints, {}, adaptable.model.travel is not None, adaptable.in_place)
    clips = [contact_labels.clip_contacts(example, settings) for example in new_clips.examples]
    logs, frames = new_clips.aligned.logs, timing.frames
    new = contact_labels.canonical_labels(clips, logs, timing.basis, frames)
    labels = np.concatenate([table.labels(field.values)[..., columns], new])
    longer, coefficients = contact_model.reduce_labels(labels)
    hyper = samples.hyper(adaptable.model.bank.pose.hyper)
    solved = universal_kriging.solve(hyper, samples.samples.points, coefficients)
    return ExtendedContacts(longer, solved, statistics)


def contact_notes(adaptable: AdaptableModel, contacts: ExtendedContacts | None) -> list[str]:
    """Return a note on joints whose contacts the adapted model lacks."""
    there = contacts.statistics if contacts else ()
    lost = [
        adaptable.skeleton.names[contact.joint]
        for contact in adaptable.contacts
        if contact not in there
    ]
    if not lost:
        return []
    return [
        f"contacts of {', '.join(lost)} were left out: they came from the table of clips, which "
        "new clips have none of"
    ]
