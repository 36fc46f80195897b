"""Adaptation of a trained model to a new performer from a few clips.

The original clips are not needed: the model's samples, in reduced form, stand for them. The new
clips are aligned to the model's prediction for an unseen performer, their residuals extend the
bases, and every coefficient model is solved again with its existing parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.motion.contact_detection import FootContact
from posefield_train.adapt import canonical_clips, extended_models, tensor_extension
from posefield_train.adapt.canonical_clips import AdaptableModel, CanonicalClips
from posefield_train.adapt.extended_models import ExtendedSamples
from posefield_train.adapt.tensor_extension import ExtendedTensor
from posefield_train.align import travel as travels
from posefield_train.contacts import contact_labels, contact_table
from posefield_train.contacts.contact_labels import ContactSettings
from posefield_train.contacts.contact_table import ContactTable
from posefield_train.graph.float_model import FloatModel
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.kriging_bank import KrigingBank
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.parallel import single_thread
from posefield_train.source.ingest import Example
from posefield_train.tensor import event_blend
from posefield_train.tensor.decoder import Decoder
from posefield_train.tensor.event_blend import EventBlend
from posefield_train.tensor.hosvd import TuckerTensor


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


def adapt(known: AdaptableModel, examples: Sequence[Example], performer: str) -> AdaptedModel:
    """Return the model extended by a performer with an unused name and some examples."""
    begun = canonical_clips.align_phase(known, examples)
    return solve(known, canonical_clips.to_canonical(known, begun), performer)


@single_thread.single_threaded()
def solve(known: AdaptableModel, moved: CanonicalClips, performer: str) -> AdaptedModel:
    """Return the adapted model for examples that are already in the model's canonical time."""
    model, law = known.model, known.model.bank.power_law
    parents, weights = known.skeleton.parents, known.joint_weights
    extended = tensor_extension.extend(model, parents, weights, moved.numbers, known.truncation)
    laid = extended_models.extend_samples(model.bank, known.groups, moved.examples, performer)
    reduced = extended.full.truncated(extended.ranks)
    pose = universal_kriging.solve(
        laid.hyper(model.bank.pose.hyper), laid.samples.points, reduced.bases[2]
    )
    bones, proportions = extended_models.solve_bones(
        laid, model.bank, model.proportions, moved.offsets
    )
    durations = np.log(moved.aligned.durations)[:, None]
    if law:
        durations -= law.logarithms(np.stack([example.controls for example in moved.examples]))
    new = {**moved.travels, "duration": durations, "warp": moved.aligned.logs}
    solved = {
        name: extended_models.solve_extended(laid, model.bank, name, values)
        for name, values in new.items()
    }
    # Keep the model's order of quantities.
    others = {name: solved.get(name, bones) for name in model.bank.others}
    missed, sill = _left_out_errors(known, laid, moved, extended)
    ends = laid.low, laid.high
    event, blend = _event(laid, model, reduced)
    contacts = _extend_contacts(known, moved, laid)
    field, table = (contacts.kriging, contacts.table) if contacts else (None, None)
    bank = KrigingBank(*ends, laid.labels, pose, others, sill, (), law, event, field)
    own = extended.tensor
    decoder = Decoder(reduced, own.mean, own.unwhiten, own.chart, event=blend, curves=own.curves)
    adapted = FloatModel(bank, model.timing, decoder, proportions, model.travel, table)
    return AdaptedModel(adapted, moved, extended, missed, contacts)


def _event(
    laid: ExtendedSamples, model: FloatModel, reduced: TuckerTensor
) -> tuple[UniversalKriging | None, EventBlend | None]:
    """Return the event's model and blend for the extended tensor, if the model has them."""
    old, blend = model.bank.event, model.decoder.event
    if old is None or blend is None:
        return None, None
    count = min(blend.count, reduced.core.shape[2])
    values = reduced.bases[2][:, :count]
    solved = universal_kriging.solve(laid.hyper(old.hyper), laid.samples.points, values)
    first, second = reduced.core, reduced.bases[1]
    return solved, event_blend.build_blend(count, blend.weights, first, second)


def _left_out_errors(
    known: AdaptableModel, laid: ExtendedSamples, moved: CanonicalClips, extended: ExtendedTensor
) -> tuple[Floats, float]:
    """Return leave-one-out errors of the new clips, and the sill updated with them.

    The errors are mean squared joint distances (k,), m², on canonical time; the sill is in m².
    """
    old = known.model.bank
    hyper, points, k = laid.hyper(old.pose.hyper), laid.samples.points, len(moved.examples)
    left_out = universal_kriging.leave_out(hyper, points, laid.samples.groups)
    variances = universal_kriging.left_out_variances(hyper, points, left_out)[-k:]
    residuals = left_out[-k:] @ extended.full.motions
    frames = extended.tensor.values.shape[1]
    missed = np.sum(np.square(residuals), axis=1) / (extended.tensor.weight * frames)
    for values in moved.travels.values():
        missed += travels.mean_squared_distance(_travel_residuals(old, laid, values))
    n = len(points) - k
    squares = np.sum(missed / variances) / known.canonical_excess
    return missed, float((n * old.sill + squares) / (n + k))


def _travel_residuals(old: KrigingBank, laid: ExtendedSamples, new: Floats) -> Floats:
    """Return leave-one-out residuals (k, 3) of the new clips' travel, m."""
    field, both = old.others["travel"], np.vstack([old.sample_values("travel"), new])
    if isinstance(field, UniversalKriging):
        hyper, groups = laid.hyper(field.hyper), laid.samples.groups
        left_out = universal_kriging.leave_out(hyper, laid.samples.points, groups)
        return left_out[-len(new) :] @ both
    return laid.samples.from_mean(both)[-len(new) :]


def _extend_contacts(
    known: AdaptableModel, moved: CanonicalClips, laid: ExtendedSamples
) -> ExtendedContacts | None:
    """Return the contacts of a model's samples and of new clips; None without any.

    Joints whose contacts came from a table of clips are left out, for new clips have none.
    """
    field, table, timing = known.model.bank.contacts, known.model.contacts, known.model.timing
    kept = [place for place, own in enumerate(known.contacts) if own.joint in known.feet]
    if field is None or table is None or not kept:
        return None
    statistics = tuple(known.contacts[place] for place in kept)
    joints = tuple(own.joint for own in statistics)
    asked = ContactSettings(joints, {}, known.model.travel is not None, known.in_place)
    clips = [contact_labels.clip_contacts(example, asked) for example in moved.examples]
    logs, frames = moved.aligned.logs, timing.frames
    new = contact_labels.canonical_labels(clips, logs, timing.basis, frames)
    labels = np.concatenate([table.labels(field.values)[..., kept], new])
    longer, coefficients = contact_table.reduce_labels(labels)
    hyper = laid.hyper(known.model.bank.pose.hyper)
    solved = universal_kriging.solve(hyper, laid.samples.points, coefficients)
    return ExtendedContacts(longer, solved, statistics)


def contact_notes(known: AdaptableModel, kept: ExtendedContacts | None) -> list[str]:
    """Return a note on joints whose contacts the adapted model lacks."""
    there = kept.statistics if kept else ()
    lost = [known.skeleton.names[own.joint] for own in known.contacts if own not in there]
    if not lost:
        return []
    return [
        f"contacts of {', '.join(lost)} were left out: they came from the table of clips, which "
        "new clips have none of"
    ]
