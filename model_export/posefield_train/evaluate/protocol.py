"""Evaluation protocols: clips held out, and performers held out."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield.kriging import support
from posefield_train.contacts import contact_model
from posefield_train.contacts.contact_model import ContactAccuracy
from posefield_train.evaluate import motion_errors, predictions
from posefield_train.evaluate.motion_errors import ComparedMotion, MotionErrors
from posefield_train.evaluate.predictions import Predictions, Queries
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.jobs import Jobs, single_threaded
from posefield_train.kriging import sample_points
from posefield_train.report import significant_digits
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.training import train_examples

# Families of more than MANY recordings are held out in PARTS parts of whole ones.
MANY, PARTS = 40, 12


@dataclass(frozen=True)
class Fold:
    """Examples that are held out together. held_out: their indices."""

    held_out: tuple[int, ...]

    def split(self, examples: Sequence[Example]) -> tuple[list[Example], list[Example]]:
        """Return the examples to train from, and those held out."""
        indices = set(self.held_out)
        rest = [example for i, example in enumerate(examples) if i not in indices]
        return rest, [examples[i] for i in self.held_out]


def clip_folds(examples: Sequence[Example]) -> list[Fold]:
    """Return folds that hold out every recording once, with all of its clips.

    Strides of one recording are nearly equal; held out one by one, they would predict each other.
    Raises TrainingError if all clips are of one recording.
    """
    numbers = sample_points.recording_numbers(examples)
    recordings = [tuple(np.flatnonzero(numbers == one).tolist()) for one in np.unique(numbers)]
    if len(recordings) == 1:
        raise TrainingError(
            f"all {len(examples)} clips are of one recording, expected two or more: none can be "
            "held out (clips.recording states recordings)"
        )
    if len(recordings) > MANY:
        recordings = [sum(recordings[start::PARTS], ()) for start in range(PARTS)]
    return [Fold(clips) for clips in recordings]


def performer_folds(examples: Sequence[Example]) -> list[Fold]:
    """Return folds that hold out every performer once, with all of their clips."""
    return [Fold(clips) for clips in _groups([example.row.performer for example in examples])]


def _groups(names: Sequence[str]) -> list[tuple[int, ...]]:
    listed = np.array(names)
    return [tuple(np.flatnonzero(listed == name).tolist()) for name in sorted(set(names))]


BEYOND_SHARE = 0.25
"""Share of a control's range by which clips are moved beyond it."""


@dataclass(frozen=True)
class SupportFlags:
    """Shares of clips that were flagged as unsupported.

    alarms: of held-out clips. beyond: of clips moved beyond the range of a control, by control.
    """

    alarms: float
    beyond: dict[str, float]

    def facts(self) -> dict[str, Any]:
        """Return the shares as JSON values."""
        beyond = {name: significant_digits.round_number(s) for name, s in self.beyond.items()}
        return {"false_alarms": significant_digits.round_number(self.alarms), "beyond": beyond}

    def text(self) -> str:
        """Return the shares in a sentence."""
        beyond = ", ".join(f"{name} {100 * share:.0f} %" for name, share in self.beyond.items())
        return (
            f"support: {100 * self.alarms:.1f} % of held-out clips are flagged; of clips moved "
            f"{100 * BEYOND_SHARE:.0f} % of the range beyond a control: {beyond}"
        )


def measure_flags(controls: Floats, names: Sequence[str], folds: Sequence[Fold]) -> SupportFlags:
    """Return the flags over controls (N, d) of clips held out by folds."""
    alarms, beyond = [], []
    for fold in folds:
        is_held = np.isin(np.arange(len(controls)), fold.held_out)
        points, fitted = controls[is_held], support.fit_support(controls[~is_held])
        alarms.append(~fitted.supported(points))
        flagged = [_flagged_beyond(fitted, points, control) for control in range(len(names))]
        beyond.append(np.stack(flagged, axis=1))
    shares = np.concatenate(beyond).mean(axis=0).tolist()
    return SupportFlags(float(np.concatenate(alarms).mean()), dict(zip(names, shares, strict=True)))


def _flagged_beyond(fitted: support.Support, points: Floats, control: int) -> Floats:
    """Return the share (H,) of both ends of a control beyond which each held clip is flagged."""
    room = BEYOND_SHARE * (fitted.high - fitted.low)[control]
    flagged = []
    for end in (fitted.low[control] - room, fitted.high[control] + room):
        outside = points.copy()
        outside[:, control] = end
        flagged.append(~fitted.supported(outside))
    return np.asarray(np.mean(flagged, axis=0))


ProgressCallback = Callable[[int, int], None]
"""Callback with the number of parts that are done, and of all parts."""


@dataclass(frozen=True)
class EvaluationResult:
    """Result of one protocol over C clips.

    clips: names. errors: of each method by clip; None for clips that a method did not predict.
    sigma: standard deviation (C,) that posefield predicts, m. joint_sigma: of each joint (C, J), m.
    joints: their names. recordings: number (C,) of the recording of each clip. flags: accuracy of
    the support flag; None if no clips are held out. contacts: accuracy of posefield's (C,); empty
    without contacts. curves: names. has_positions: False for clips of curves without a skeleton, of
    which measures of positions say nothing. definitions: of the methods by name. references: row of
    posefield that a method is compared with, where it is another than OURS.
    """

    family: str
    protocol: str
    clips: tuple[str, ...]
    errors: Mapping[str, Sequence[MotionErrors | None]]
    sigma: Floats
    joint_sigma: Floats
    joints: tuple[str, ...]
    recordings: tuple[int, ...]
    flags: SupportFlags | None = None
    contacts: tuple[ContactAccuracy, ...] = ()
    curves: tuple[str, ...] = ()
    has_positions: bool = True
    definitions: Mapping[str, str] = field(default_factory=lambda: predictions.DEFINITIONS)
    references: Mapping[str, str] = field(default_factory=dict)

    def predicted(self, name: str) -> list[int]:
        """Return the indices of the clips that a method predicted."""
        return [clip for clip, error in enumerate(self.errors[name]) if error is not None]

    def of(self, name: str, clips: Sequence[int] | None = None) -> list[MotionErrors]:
        """Return the errors of a method at some of the clips that it predicted; None for all."""
        chosen = range(len(self.clips)) if clips is None else clips
        return [error for clip in chosen if (error := self.errors[name][clip]) is not None]


@dataclass(frozen=True)
class PartialResult:
    """Result for some of the clips, whose indices are `clips`; the rest as in EvaluationResult."""

    clips: tuple[int, ...]
    errors: Mapping[str, Sequence[MotionErrors | None]]
    sigma: Floats
    joint_sigma: Floats
    contacts: Sequence[ContactAccuracy] = ()


@dataclass(frozen=True)
class TrainedFold:
    """A model that was trained without the clips of a fold, and the queries about them.

    rest: clips that it was trained on. captured: motions of those held out.
    """

    trained: TrainedModel
    fold: Fold
    rest: Sequence[Example]
    held_out: Sequence[Example]
    queries: Queries
    captured: Sequence[ComparedMotion]


def protocols(examples: Sequence[Example]) -> list[str]:
    """Return the protocols that a family allows, the most important first."""
    several = len({example.row.performer for example in examples}) > 1
    return ["clip", "performer"] if several else ["clip"]


def folds_of(examples: Sequence[Example], protocol: str) -> list[Fold]:
    """Return the folds of a protocol."""
    return clip_folds(examples) if protocol == "clip" else performer_folds(examples)


def run_protocol(
    recipe: Recipe, examples: Sequence[Example], protocol: str, jobs: Jobs, report: ProgressCallback
) -> EvaluationResult:
    """Run a protocol: "clip" or "performer", held out one by one.

    Raises TrainingError if the examples that remain are too few to train from.
    """
    listed = folds_of(examples, protocol)
    results = jobs.run(run_fold, [(fold,) for fold in listed], (recipe, examples))
    return held_out_result(recipe, examples, protocol, with_progress(results, len(listed), report))


def with_progress(results: Iterator[Any], count: int, report: ProgressCallback) -> Iterator[Any]:
    """Yield the results of jobs and report each. count: number of the jobs."""
    for done, result in enumerate(results, start=1):
        report(done, count)
        yield result


@single_threaded()
def run_fold(recipe: Recipe, examples: Sequence[Example], fold: Fold) -> PartialResult:
    """Return the result for the clips of one fold. Raises TrainingError as `run_protocol` does."""
    trained = train_fold(recipe, examples, fold)
    return compare_fold(trained, predictions.predict(trained.trained, trained.queries))


def train_fold(recipe: Recipe, examples: Sequence[Example], fold: Fold) -> TrainedFold:
    """Return the model of the clips that a fold does not hold out."""
    rest, held_out = fold.split(examples)
    try:
        trained = train_examples(recipe, rest)
    except TrainingError as error:
        file_names = ", ".join(sorted({example.row.file.name for example in held_out}))
        raise TrainingError(f"with {file_names} held out: {error}") from error
    queries = Queries(np.stack([e.controls for e in held_out]), [e.row.labels for e in held_out])
    # As captured: closing a cycle moves joints, which would favour what closes the same way.
    captured = [
        motion_errors.motion_of_clip(
            example.captured or example.clip,
            predictions.captured_event(trained, example.landmarks),
        )
        for example in held_out
    ]
    return TrainedFold(trained, fold, rest, held_out, queries, captured)


def compare_fold(fold: TrainedFold, predicted: Predictions) -> PartialResult:
    """Return the errors of predictions for the clips that are held out."""
    feet = tuple(map(fold.trained.skeleton.names.index, fold.trained.recipe.motion.feet))
    errors = motion_errors.compare_methods(predicted.motions, fold.captured, feet)
    contacts = _contact_accuracies(fold)
    return PartialResult(
        fold.fold.held_out, errors, predicted.sigma, predicted.joint_sigma, contacts
    )


def _contact_accuracies(fold: TrainedFold) -> list[ContactAccuracy]:
    fitted, model = fold.trained.contacts, fold.trained.model
    if fitted is None:
        return []
    controls = fold.queries.controls
    labels = sample_points.label_weights(fold.queries.labels, model.bank.labels)
    durations = model.durations(controls, labels)

    def predict(shares: Floats) -> Floats:
        contacts = model.evaluate(controls, shares * durations[:, None], labels).contacts
        return np.zeros((len(durations), len(shares), 0)) if contacts is None else contacts

    joints = [statistics.joint for statistics in fitted.statistics]
    return contact_model.held_out_accuracies(
        fold.trained.recipe, fold.rest, fold.held_out, joints, predict
    )


def held_out_result(
    recipe: Recipe, examples: Sequence[Example], protocol: str, results: Iterator[PartialResult]
) -> EvaluationResult:
    """Return the result of a protocol from those of its folds."""
    clip = examples[0].clip
    controls = np.stack([example.controls for example in examples])
    flags = measure_flags(
        controls, [control.name for control in recipe.controls], folds_of(examples, protocol)
    )
    merged = merge(
        recipe,
        f"leave_one_{protocol}_out",
        [f"{example.row.file.name} (line {example.row.line})" for example in examples],
        clip.skeleton.names,
        sample_points.recording_numbers(examples).tolist(),
        results,
    )
    curves = tuple(clip.curves.names) if clip.curves else ()
    return replace(merged, flags=flags, curves=curves)


def merge(
    recipe: Recipe,
    protocol: str,
    clips: Sequence[str],
    joints: tuple[str, ...],
    recordings: Sequence[int],
    results: Iterator[PartialResult],
) -> EvaluationResult:
    """Merge results for some of the clips, in any order, into one."""
    ordered = sorted(results, key=lambda result: result.clips)
    # A fold that leaves one performer lacks the methods that distinguish performers.
    names = dict.fromkeys(name for result in ordered for name in result.errors)

    def errors_of(name: str) -> Callable[[PartialResult], Sequence[MotionErrors | None]]:
        return lambda result: result.errors.get(name, [None] * len(result.clips))

    return EvaluationResult(
        recipe.name,
        protocol,
        tuple(clips),
        {name: in_order(ordered, errors_of(name)) for name in names},
        np.array(in_order(ordered, lambda result: result.sigma)),
        np.array(in_order(ordered, lambda result: result.joint_sigma)),
        joints,
        tuple(recordings),
        contacts=tuple(in_order(ordered, lambda result: result.contacts)),
        has_positions=recipe.curves is None or not recipe.curves.alone,
    )


def in_order(results: Sequence[Any], values: Callable[[Any], Sequence[Any]]) -> list[Any]:
    """Return a value of each clip in the order of the clips; empty where some have none.

    results: each with `clips`, the indices of its values.
    """
    order = np.argsort([clip for result in results for clip in result.clips])
    listed = [value for result in results for value in values(result)]
    return [listed[i] for i in order] if len(listed) == len(order) else []
