"""A trained model with its training data and diagnostics."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.motion.skeleton import Skeleton
from posefield_train.align.time_alignment import AlignedClips
from posefield_train.contacts.common_stances import CommonStances
from posefield_train.contacts.contact_model import FittedContacts
from posefield_train.graph.float_model import FloatModel
from posefield_train.kriging.kriging_tuning import TunedKriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source.canonical import Finding
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.tensor.hosvd import TuckerTensor
from posefield_train.tensor.motion_tensor import MotionTensor
from posefield_train.tensor.truncation_error import TruncationErrors

KINDS = ("size", "disguise", "bones", "leap", "far", "travel", "duration")
"""Kinds of evidence, the worst for a model first."""
MOST_ALIKE = 5
"""Clips of one kind of evidence that have notes of their own."""


@dataclass(frozen=True)
class Outlier:
    """Evidence against one clip, as part of a sentence.

    kind: "far" from the prediction, "disguise", "leap", "size", "bones", "duration" or "travel".
    """

    clip: int
    kind: str
    evidence: str


@dataclass(frozen=True)
class TrainedModel:
    """A trained model with its training data and diagnostics.

    examples: sorted by their content, so that the model does not depend on the order of the table.
    samples: sample points. pose: tuned kriging model of the pose. values: sample values (N, m) of
    each quantity, the pose's full motions in the coordinates of the sample mode. left_out_errors:
    mean squared joint distance (N,), m², of each clip from its leave-one-out prediction on
    canonical time. warped_errors: the same of whole motions after time warping, by which sigma is
    scaled. acceleration: that of left-out predictions over that of captured clips, at equal
    durations. explained: share of the variation between clips that leave-one-out predicts from the
    controls, by quantity; one that they do not explain is constant. residuals:
    leave-one-out residuals (N, m) of each quantity but the pose. truncation_errors: of the reduced
    tensor. joints: leave-one-out error (J,) of each joint as a share of the root mean square of
    all. outliers: evidence against clips that do not fit. contacts: of the feet, None without them.
    contact_notes: assumptions about them. soles: of a robot. notes: of the import.
    """

    recipe: Recipe
    model: FloatModel
    examples: tuple[Example, ...]
    samples: SamplePoints
    skeleton: Skeleton
    aligned: AlignedClips
    tensor: MotionTensor
    full: TuckerTensor
    pose: TunedKriging
    values: dict[str, Floats]
    left_out_errors: Floats
    warped_errors: Floats
    acceleration: float
    explained: dict[str, float]
    findings: list[Finding]
    residuals: dict[str, Floats]
    truncation_errors: TruncationErrors
    joints: Floats
    outliers: tuple[Outlier, ...] = ()
    contacts: FittedContacts | None = None
    contact_notes: tuple[str, ...] = ()
    soles: CommonStances = field(default_factory=CommonStances)
    notes: tuple[str, ...] = ()

    @property
    def listed(self) -> Annotated[Indices, "listed"]:
        """Return the clips that the model card lists: the inducing ones of a large family."""
        inducing = self.samples.inducing
        return np.arange(len(self.examples)) if inducing is None else inducing

    def outlier_notes(self) -> list[str]:
        """Return one note per clip with evidence against it, the worst kinds first.

        Of many clips with the same worst kind of evidence the last ones are only named.
        """
        by_clip: dict[int, list[Outlier]] = {}
        for one in sorted(self.outliers, key=lambda one: KINDS.index(one.kind)):
            by_clip.setdefault(one.clip, []).append(one)
        notes = []
        for kind in KINDS:
            clips = sorted(clip for clip, outliers in by_clip.items() if outliers[0].kind == kind)
            for clip in clips[:MOST_ALIKE]:
                evidence = "; ".join(one.evidence for one in by_clip[clip])
                notes.append(f"{self.examples[clip].row.named}: {evidence}")
            if more := [self.examples[clip].row.named for clip in clips[MOST_ALIKE:]]:
                notes.append(f"{len(more)} more clips with such evidence: {', '.join(more)}")
        return notes
