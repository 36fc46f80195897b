"""Extension of a model's contacts by those of new clips."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.motion.foot_contacts import FootContact
from posefield_train.adapt.canonical_clips import AdaptableModel, CanonicalClips
from posefield_train.adapt.extended_models import ExtendedSamples
from posefield_train.contacts import contact_labels, contact_table
from posefield_train.contacts.contact_labels import ContactSettings
from posefield_train.contacts.contact_table import ContactTable
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.universal_kriging import UniversalKriging


@dataclass(frozen=True)
class ExtendedContacts:
    """Contacts of a model's samples followed by those of new clips.

    statistics: of each joint, by the clips that the model was trained on.
    """

    table: ContactTable
    kriging: UniversalKriging
    statistics: tuple[FootContact, ...]


def extend_contacts(
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
    return [_lost_note(lost)] if lost else []


def _lost_note(lost: Sequence[str]) -> str:
    return (
        f"contacts of {', '.join(lost)} were left out: they came from the table of clips, which "
        "new clips have none of"
    )
