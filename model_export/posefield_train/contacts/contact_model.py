"""Fit of the contacts of a family, and their agreement with clips left out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats
from posefield.motion.contact_detection import FootContact
from posefield_train.align.warp import CanonicalTiming
from posefield_train.contacts import contact_labels, contact_statistics, contact_table
from posefield_train.contacts.contact_labels import ClipContacts
from posefield_train.contacts.contact_table import ContactTable
from posefield_train.kriging import sample_kriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import Hyper, UniversalKriging
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

Labels = Annotated[Floats, "clips frames joints"]

PREDICTED = 0.8
"""Share of the climatology's Brier score below which contacts are predicted by the controls."""


@dataclass(frozen=True)
class ContactAccuracy:
    """Leave-one-take-out errors of contacts, over clips, canonical frames and joints.

    agreement: share of frames where P > 0.5 agrees with the label. brier: mean squared difference.
    climatology: the same of the mean over the other takes.
    """

    agreement: float
    brier: float
    climatology: float

    @classmethod
    def measure(cls, predicted: Floats, labels: Floats, from_mean: Floats) -> "ContactAccuracy":
        """Return the errors of probabilities (...) against labels (...), 0 or 1.

        from_mean: labels less their mean over the other takes (...).
        """
        return cls(
            float(np.mean((predicted > 0.5) == (labels > 0.5))),
            float(np.mean(np.square(predicted - labels))),
            float(np.mean(np.square(from_mean))),
        )


@dataclass(frozen=True)
class FittedContacts:
    """Contacts of a family.

    table: functions of canonical time. kriging: model of their coefficients. statistics: of each
    joint. accuracy: of clips left out.
    """

    table: ContactTable
    kriging: UniversalKriging
    statistics: tuple[FootContact, ...]
    accuracy: ContactAccuracy


def fit_contacts(
    recipe: Recipe,
    examples: Sequence[Example],
    samples: SamplePoints,
    pose: Hyper,
    warps: tuple[CanonicalTiming, Floats],
) -> tuple[FittedContacts | None, list[str]]:
    """Return the contacts of a recipe's examples, None without joints in contact, and notes.

    pose: parameters of the pose's kriging. warps: canonical timing, and the log increments
    (N, knots) of each clip's warp.
    """
    names = examples[0].clip.skeleton.names
    asked = contact_labels.settings(recipe, names)
    if not asked.joints:
        return None, []
    clips = [contact_labels.clip_contacts(example, asked) for example in examples]
    every = contact_statistics.contact_statistics(clips, asked.joints, asked.cyclic)
    notes = _notes(clips, every, [names[joint] for joint in asked.joints], asked.cyclic)
    kept = [place for place, own in enumerate(every) if own is not None]
    if not kept:
        return None, notes
    timing, logs = warps
    labels = contact_labels.canonical_labels(clips, logs, timing.basis, timing.frames)[..., kept]
    table, coefficients = contact_table.reduce_labels(labels)
    solved = sample_kriging.solve(pose, samples, coefficients)
    accuracy = left_out_accuracy(labels, table.labels(coefficients), pose, samples)
    statistics = tuple(own for own in every if own is not None)
    fitted = FittedContacts(table, solved, statistics, accuracy)
    return fitted, [*notes, *_accuracy_notes(accuracy)]


def left_out_accuracy(
    labels: Labels, reduced: Labels, pose: Hyper, samples: SamplePoints
) -> ContactAccuracy:
    """Return the errors of labels (N, T, K) predicted from the reduced ones of the other takes."""
    rows, known = labels.reshape(len(labels), -1), reduced.reshape(len(labels), -1)
    left_out = sample_kriging.leave_out(pose, samples)
    predicted = np.clip(known - left_out @ known, 0.0, 1.0)
    return ContactAccuracy.measure(predicted, rows, samples.from_mean(rows))


def _notes(
    clips: Sequence[ClipContacts],
    found: Sequence[FootContact | None],
    names: Sequence[str],
    cyclic: bool,
) -> list[str]:
    notes = []
    for place, (own, name) in enumerate(zip(found, names, strict=True)):
        if own is None:
            notes.append(f"{name} contacts nothing in any clip: the model has no contacts of it")
        elif contact_statistics.without_swings(clips, place, cyclic):
            notes.append(
                f"{name} makes no whole swing between two contacts in any clip: its swings are "
                f"taken to last {own.swing:g} s, as those of the other joints or as usual"
            )
    return notes


def _accuracy_notes(own: ContactAccuracy) -> list[str]:
    """Return a note if the controls hardly say when joints are in contact."""
    if own.brier < PREDICTED * own.climatology:
        return []
    return [
        "when the feet stand hardly follows from the controls: contacts are plausible rather than "
        f"predicted (Brier score {own.brier:.3f} of clips left out, {own.climatology:.3f} of the "
        "mean over the others)"
    ]
