"""Notes of a training, ranked by their consequence for the model.

First the clips that are probably wrong, then settings without effect, then assumptions about the
files, then corrections that were made. What is the same in many clips is one note.
"""

from collections.abc import Sequence

import numpy as np

from posefield_train.align import phase_alignment
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_points
from posefield_train.kriging.projected import inducing_clips
from posefield_train.source.canonical import Finding
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

MOST_ALIKE = 3
"""Clips that are noted one by one for the same kind of finding."""
SAME_MOTION = 0.7
"""Share of the differences between any clips from which clips of equal controls differ as much."""
LEAST_DIFFERENCE = 0.01
"""Smallest differences between clips of equal controls that are noted, m."""

LARGEST_DISAGREEMENT = 0.02
"""Difference of the errors of two tunings of a large family from which it is noted."""

MEANINGS = {
    "far": "close to half a turn from the family's mean",
    "wrap": "followed past half a turn from the family's mean",
    "jump": "jumps between two frames taken out",
    "twist": "jumps about the bone moved to the joint's children",
    "flip": "half turns taken out",
}
"""Kinds of findings in joints, those that say the most about the model first."""


def training_notes(recipe: Recipe, trained: TrainedModel, imported: Sequence[str]) -> list[str]:
    """Return all notes of a training, the most consequential first.

    imported: notes on the motion files, ranked.
    """
    return [
        *trained.outlier_notes(),
        *repeat_notes(trained),
        *disagreement_notes(trained),
        *sample_points.data_notes(recipe, trained.examples),
        *imported,
        *finding_notes(trained.findings, trained.examples, trained.skeleton.names),
        *phase_alignment.shift_notes(trained.examples),
        *trained.contact_notes,
    ]


def disagreement_notes(trained: TrainedModel) -> list[str]:
    """Return a note if parameters tuned on two draws of a large family predict unequally well."""
    apart = trained.pose.disagreement
    if apart is None or apart <= LARGEST_DISAGREEMENT:
        return []
    tuned = inducing_clips.tuned_count(len(trained.examples))
    return [
        f"parameters tuned on two draws of {tuned} of {len(trained.examples)} clips differ: with "
        f"one a clip left out lies {100 * apart:.1f} % farther away than with the other, which is "
        "used"
    ]


def repeat_notes(trained: TrainedModel) -> list[str]:
    """Return a note if clips of equal controls differ about as much as any clips do."""
    own = trained.tensor
    motions = trained.values["pose"] / np.sqrt(own.weight * own.values.shape[1])
    points = trained.samples.points
    _, groups, counts = np.unique(points, axis=0, return_inverse=True, return_counts=True)
    groups = np.ravel(groups)
    repeated = counts[groups] > 1
    if not repeated.any():
        return []
    means = np.stack([motions[groups == group].mean(axis=0) for group in range(len(counts))])
    freedoms = repeated.sum() - np.sum(counts > 1)
    within = float(np.sqrt(np.sum(np.square(motions - means[groups])) / freedoms))
    about = motions - motions.mean(axis=0)
    usual = float(np.sqrt(np.sum(np.square(about)) / (len(motions) - 1)))
    if within < max(SAME_MOTION * usual, LEAST_DIFFERENCE):
        return []
    example = trained.examples[int(np.flatnonzero(repeated)[0])]
    return [
        f"{repeated.sum()} of {len(motions)} clips share their controls with others, such as "
        f"{example.row.named}, and differ from them by {100 * within:.1f} cm where all clips "
        f"differ by {100 * usual:.1f} cm: a control that tells them apart may be missing"
    ]


def finding_notes(
    findings: Sequence[Finding], examples: Sequence[Example], names: Sequence[str]
) -> list[str]:
    """Return notes on joints by kind of finding: one per clip if they are few, else one in all."""
    notes = []
    for kind, meaning in MEANINGS.items():
        own = [finding for finding in findings if finding.kind == kind]
        clips = sorted({finding.clip for finding in own})
        if len(clips) > MOST_ALIKE:
            largest = max(own, key=lambda finding: finding.angle)
            notes.append(
                f"{meaning} in {len(clips)} of {len(examples)} clips, the largest in "
                f"{examples[largest.clip].row.named}: {_turned(largest, names)}"
            )
            continue
        for clip in clips:
            entries = ", ".join(_turned(each, names) for each in own if each.clip == clip)
            notes.append(f"{examples[clip].row.named}: {meaning}: {entries}")
    return notes


def _turned(finding: Finding, names: Sequence[str]) -> str:
    return f"{names[finding.joint]} by {np.degrees(finding.angle):.0f} degrees"
