"""Fit of the contacts of a family, and their agreement with clips left out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from posefield.common.units import ClipFrames, Floats
from posefield.kriging.kriging_model import Hyper
from posefield.motion import quat
from posefield.motion.contact_detection import FootContact
from posefield_train.align.warp import CanonicalTiming
from posefield_train.contacts import contact_labels
from posefield_train.contacts.contact_labels import ClipContacts
from posefield_train.kriging import coefficient_models, universal_kriging
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import UniversalKriging
from posefield_train.onnx_graph import GraphBuilder
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe

LEAST_COLUMNS, MOST_COLUMNS = 6, 10
"""Numbers of functions, where there are as many clips."""
KEPT_VARIATION = 0.95
"""Share of the squared labels that the functions keep, where MOST_COLUMNS suffice."""


@dataclass(frozen=True)
class ContactTable:
    """Functions of canonical time whose sums are contact labels. values: (r, K, T)."""

    values: Annotated[Floats, "modes joints frames"]

    def numpy(
        self, coefficients: Annotated[Floats, "clips modes"], frames: ClipFrames
    ) -> Annotated[Floats, "clips frames joints"]:
        """Return probabilities (B, S, K) of contacts at canonical frames (B, S).

        coefficients: (B, r). As for poses, the functions are interpolated linearly between frames.
        """
        rows = quat.interpolate_rows(self._rows, frames).reshape(*frames.shape, *self._shape)
        return np.clip(np.einsum("bskr,br->bsk", rows, coefficients), 0.0, 1.0)

    def labels(
        self, coefficients: Annotated[Floats, "clips modes"]
    ) -> Annotated[Floats, "clips frames joints"]:
        """Return the labels (N, T, K) of coefficients (N, r), not clipped."""
        return np.einsum("rkt,nr->ntk", self.values, coefficients)

    def onnx(self, net: GraphBuilder, coefficients: str, frames: str) -> str:
        """Build `numpy` in a graph, from canonical frames (B, S)."""
        table, last = net.weights("contact_table", self.values), self.values.shape[2] - 1
        zero, one, time = net.indices(0), net.indices(1), net.indices(2)
        first = net("Slice", table, zero, net.indices(last), time)
        steps = net("Sub", net("Slice", table, one, net.indices(last + 1), time), first)
        before = net("Min", net("Floor", frames), net.number(last - 1.0))
        column = net("Cast", before, to=6)
        rise = net("Mul", net("Gather", steps, column, axis=2), net("Sub", frames, before))
        functions = net("Add", net("Gather", first, column, axis=2), rise)
        # (r, 1, B, 1) beside functions (r, K, B, S).
        weights = net("Unsqueeze", net("Transpose", coefficients, perm=[1, 0]), net.indices(1, 3))
        sums = net("ReduceSum", net("Mul", functions, weights), zero, keepdims=0)
        shares = net("Clip", sums, net.number(0.0), net.number(1.0))
        return net("Transpose", shares, perm=[1, 2, 0])

    @property
    def _shape(self) -> tuple[int, int]:
        modes, joints, _ = self.values.shape
        return joints, modes

    @property
    def _rows(self) -> Annotated[Floats, "frames values"]:
        """Return the functions as rows (T, K r)."""
        return self.values.transpose(2, 1, 0).reshape(self.values.shape[2], -1)


def reduce_labels(
    labels: Annotated[Floats, "clips frames joints"],
) -> tuple[ContactTable, Annotated[Floats, "clips modes"]]:
    """Return the functions of labels (N, T, K) and each clip's coefficients (N, r).

    Singular value decomposition over clips, of the labels as they are: the first function is near
    their mean.
    """
    clips, frames, joints = labels.shape
    rows = labels.transpose(0, 2, 1).reshape(clips, -1)
    left, sizes, right = np.linalg.svd(rows, full_matrices=False)
    squares = np.cumsum(np.square(sizes))
    enough = 1 + int(np.searchsorted(squares, KEPT_VARIATION * squares[-1]))
    rank = min(max(enough, LEAST_COLUMNS), MOST_COLUMNS, len(sizes))
    signs = coefficient_models.row_signs(right[:rank])
    functions = (signs[:, None] * right[:rank]).reshape(rank, joints, frames)
    return ContactTable(functions), left[:, :rank] * sizes[:rank] * signs


Labels = Annotated[Floats, "clips frames joints"]

PREDICTED = 0.8
"""Share of the climatology's Brier score below which contacts are predicted by the controls."""


@dataclass(frozen=True)
class ContactAccuracy:
    """Leave-one-recording-out errors of contacts, over clips, canonical frames and joints.

    agreement: share of frames where P > 0.5 agrees with the label. brier: mean squared difference.
    climatology: the same of the mean over the other recordings.
    """

    agreement: float
    brier: float
    climatology: float

    @classmethod
    def measure(cls, predicted: Floats, labels: Floats, from_mean: Floats) -> "ContactAccuracy":
        """Return the errors of probabilities (...) against labels (...), 0 or 1.

        from_mean: labels less their mean over the other recordings (...).
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
    settings = contact_labels.settings(recipe, names)
    if not settings.joints:
        return None, []
    clips = [contact_labels.clip_contacts(example, settings) for example in examples]
    found_statistics = contact_labels.contact_statistics(clips, settings.joints, settings.cyclic)
    notes = _notes(
        clips, found_statistics, [names[joint] for joint in settings.joints], settings.cyclic
    )
    columns = [column for column, contact in enumerate(found_statistics) if contact is not None]
    if not columns:
        return None, notes
    timing, logs = warps
    labels = contact_labels.canonical_labels(clips, logs, timing.basis, timing.frames)[..., columns]
    table, coefficients = reduce_labels(labels)
    solved = universal_kriging.solve_samples(pose, samples, coefficients)
    accuracy = left_out_accuracy(labels, table.labels(coefficients), pose, samples)
    statistics = tuple(contact for contact in found_statistics if contact is not None)
    fitted = FittedContacts(table, solved, statistics, accuracy)
    return fitted, [*notes, *_accuracy_notes(accuracy)]


def left_out_accuracy(
    labels: Labels, reduced: Labels, pose: Hyper, samples: SamplePoints
) -> ContactAccuracy:
    """Return the errors of labels (N, T, K) predicted from reduced ones of other recordings."""
    rows, reduced_rows = labels.reshape(len(labels), -1), reduced.reshape(len(labels), -1)
    left_out = universal_kriging.leave_out_samples(pose, samples)
    predicted = np.clip(reduced_rows - left_out @ reduced_rows, 0.0, 1.0)
    return ContactAccuracy.measure(predicted, rows, samples.from_mean(rows))


def _notes(
    clips: Sequence[ClipContacts],
    statistics: Sequence[FootContact | None],
    names: Sequence[str],
    cyclic: bool,
) -> list[str]:
    notes = []
    for column, (contact, name) in enumerate(zip(statistics, names, strict=True)):
        if contact is None:
            notes.append(f"{name} contacts nothing in any clip: the model has no contacts of it")
        elif contact_labels.without_swings(clips, column, cyclic):
            notes.append(
                f"{name} makes no whole swing between two contacts in any clip: its swings are "
                f"taken to last {contact.swing:g} s, as those of the other joints or as usual"
            )
    return notes


def _accuracy_notes(accuracy: ContactAccuracy) -> list[str]:
    if accuracy.brier < PREDICTED * accuracy.climatology:
        return []
    return [
        "when the feet stand hardly follows from the controls: contacts are plausible rather than "
        f"predicted (Brier score {accuracy.brier:.3f} of clips left out, "
        f"{accuracy.climatology:.3f} of the mean over the others)"
    ]


FRAMES = 100
"""Frames of a clip that are compared, evenly over its duration."""
SHARES = np.linspace(0.0, 1.0, FRAMES)

ContactPredictor = Callable[[Floats], Floats]
"""Map from shares (F,) of the duration to probabilities (M, F, K) for the clips held out."""


def held_out_accuracies(
    recipe: Recipe,
    rest: Sequence[Example],
    held_out: Sequence[Example],
    joints: Sequence[int],
    predict: ContactPredictor,
) -> list[ContactAccuracy]:
    """Return the accuracy of each clip held out, at equal shares of the durations.

    joints: indices of the predicted ones. Nothing is warped, so that errors of timing count.
    climatology is that of the mean over the other clips. Empty for cycles that are begun in phase:
    those held out begin elsewhere than the model's.
    """
    if recipe.alignment.begin == "in_phase" and recipe.motion.cyclic:
        return []
    mean = _labels_at_shares(recipe, rest, joints).mean(axis=0)
    pairs = zip(_labels_at_shares(recipe, held_out, joints), predict(SHARES), strict=True)
    return [
        ContactAccuracy.measure(predicted, labels, labels - mean) for labels, predicted in pairs
    ]


def mean_accuracy(accuracies: Sequence[ContactAccuracy]) -> dict[str, Any]:
    """Return the means over clips by name, rounded."""
    names = ("agreement", "brier", "climatology")
    return {
        name: float(f"{np.mean([getattr(one, name) for one in accuracies]):.4g}") for name in names
    }


def accuracy_text(accuracies: Sequence[ContactAccuracy]) -> str:
    """Return a sentence on the means over clips."""
    means = mean_accuracy(accuracies)
    return (
        f"contacts: {means['agreement']:.1%} of frames agree, Brier score {means['brier']:.3f}; by "
        f"the mean of the other clips {means['climatology']:.3f}"
    )


def _labels_at_shares(
    recipe: Recipe, examples: Sequence[Example], joints: Sequence[int]
) -> Annotated[Floats, "clips frames joints"]:
    settings = contact_labels.settings(recipe, examples[0].clip.skeleton.names)
    columns = [settings.joints.index(joint) for joint in joints]
    clips = (contact_labels.clip_contacts(example, settings) for example in examples)
    return np.stack([clip.at(SHARES)[:, columns] for clip in clips])
