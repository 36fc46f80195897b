"""Evaluation protocols: clips held out, and performers held out."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield_train.contacts import held_out_contacts
from posefield_train.contacts.contact_model import ContactAccuracy
from posefield_train.contacts.held_out_contacts import HeldOutClips
from posefield_train.evaluate import (
    compared_motion,
    folds,
    motion_errors,
    predictions,
    support_flags,
)
from posefield_train.evaluate.compared_motion import ComparedMotion
from posefield_train.evaluate.folds import Fold
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.predictions import Predictions, Queries
from posefield_train.evaluate.support_flags import SupportFlags
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_points
from posefield_train.parallel import single_thread
from posefield_train.parallel.jobs import Jobs
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.train import train

ProgressCallback = Callable[[int, int], None]
"""Callback with the number of parts that are done, and of all parts."""


@dataclass(frozen=True)
class EvaluationResult:
    """Result of one protocol over C clips.

    clips: names. errors: of each method by clip; None for clips that a method did not predict.
    sigma: standard deviation (C,) that posefield predicts, m. joint_sigma: of each joint (C, J), m.
    joints: their names. takes: number (C,) of the take of each clip. flags: accuracy of the support
    flag; None if no clips are held out. contacts: accuracy of posefield's (C,); empty without
    contacts. curves: names. has_positions: False for clips of curves without a skeleton, of which
    measures of positions say nothing. definitions: of the methods by name. references: row of
    posefield that a method is compared with, where it is another than OURS.
    """

    family: str
    protocol: str
    clips: tuple[str, ...]
    errors: Mapping[str, Sequence[MotionErrors | None]]
    sigma: Floats
    joint_sigma: Floats
    joints: tuple[str, ...]
    takes: tuple[int, ...]
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
    """A model that was trained without the clips of a fold, and what it is asked.

    rest, held: clips that it was trained on, and those held out. captured: motions of the latter.
    """

    recipe: Recipe
    trained: TrainedModel
    fold: Fold
    rest: Sequence[Example]
    held: Sequence[Example]
    queries: Queries
    captured: Sequence[ComparedMotion]


def protocols(examples: Sequence[Example]) -> list[str]:
    """Return the protocols that a family allows, the most important first."""
    several = len({example.row.performer for example in examples}) > 1
    return ["clip", "performer"] if several else ["clip"]


def folds_of(examples: Sequence[Example], protocol: str) -> list[Fold]:
    """Return the folds of a protocol."""
    return folds.clip_folds(examples) if protocol == "clip" else folds.performer_folds(examples)


def run_protocol(
    recipe: Recipe, examples: Sequence[Example], protocol: str, jobs: Jobs, report: ProgressCallback
) -> EvaluationResult:
    """Run a protocol: "clip" or "performer", held out one by one.

    Raises TrainingError if the examples that remain are too few to train from.
    """
    listed = folds_of(examples, protocol)
    parts = jobs.run(run_fold, [(fold,) for fold in listed], (recipe, examples))
    return held_out_result(recipe, examples, protocol, with_progress(parts, len(listed), report))


def with_progress(results: Iterator[Any], count: int, report: ProgressCallback) -> Iterator[Any]:
    """Yield the results of jobs and report each. count: number of the jobs."""
    for done, result in enumerate(results, start=1):
        report(done, count)
        yield result


@single_thread.single_threaded()
def run_fold(recipe: Recipe, examples: Sequence[Example], fold: Fold) -> PartialResult:
    """Return the result for the clips of one fold. Raises TrainingError as `run_protocol` does."""
    trained = train_fold(recipe, examples, fold)
    return compare_fold(trained, predictions.predict(recipe, trained.trained, trained.queries))


def train_fold(recipe: Recipe, examples: Sequence[Example], fold: Fold) -> TrainedFold:
    """Return the model of the clips that a fold does not hold out."""
    rest, held = fold.split(examples)
    try:
        trained = train(recipe, rest, lambda _: None)
    except TrainingError as error:
        named = ", ".join(sorted({example.row.place.name for example in held}))
        raise TrainingError(f"with {named} held out: {error}") from error
    queries = Queries(np.stack([e.controls for e in held]), [e.row.labels for e in held])
    # As captured: closing a cycle moves joints, which would favour what closes the same way.
    captured = [
        compared_motion.motion_of_clip(
            example.captured or example.clip,
            predictions.captured_event(recipe, trained, example.landmarks),
        )
        for example in held
    ]
    return TrainedFold(recipe, trained, fold, rest, held, queries, captured)


def compare_fold(fold: TrainedFold, predicted: Predictions) -> PartialResult:
    """Return the errors of predictions for the clips that are held out."""
    feet = tuple(map(fold.trained.skeleton.names.index, fold.recipe.motion.feet))
    errors = motion_errors.compare_methods(predicted.motions, fold.captured, feet)
    contacts = _contact_accuracies(fold)
    return PartialResult(fold.fold.held, errors, predicted.sigma, predicted.joint_sigma, contacts)


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
    clips = HeldOutClips(fold.rest, fold.held)
    return held_out_contacts.held_out_accuracies(fold.recipe, clips, joints, predict)


def held_out_result(
    recipe: Recipe, examples: Sequence[Example], protocol: str, results: Iterator[PartialResult]
) -> EvaluationResult:
    """Return the result of a protocol from those of its folds."""
    clip = examples[0].clip
    controls = np.stack([example.controls for example in examples])
    flags = support_flags.measure_flags(
        controls, [control.name for control in recipe.controls], folds_of(examples, protocol)
    )
    merged = merge(
        recipe,
        f"leave_one_{protocol}_out",
        [f"{example.row.place.name} (line {example.row.line})" for example in examples],
        clip.skeleton.names,
        sample_points.take_numbers(examples).tolist(),
        results,
    )
    curves = tuple(clip.curves.names) if clip.curves else ()
    return replace(merged, flags=flags, curves=curves)


def merge(
    recipe: Recipe,
    protocol: str,
    clips: Sequence[str],
    joints: tuple[str, ...],
    takes: Sequence[int],
    results: Iterator[PartialResult],
) -> EvaluationResult:
    """Merge results for some of the clips, in any order, into one."""
    parts = sorted(results, key=lambda part: part.clips)
    # A fold that leaves one performer lacks the methods that distinguish performers.
    names = dict.fromkeys(name for part in parts for name in part.errors)

    def errors_of(name: str) -> Callable[[PartialResult], Sequence[MotionErrors | None]]:
        return lambda part: part.errors.get(name, [None] * len(part.clips))

    return EvaluationResult(
        recipe.name,
        protocol,
        tuple(clips),
        {name: in_order(parts, errors_of(name)) for name in names},
        np.array(in_order(parts, lambda part: part.sigma)),
        np.array(in_order(parts, lambda part: part.joint_sigma)),
        joints,
        tuple(takes),
        contacts=tuple(in_order(parts, lambda part: part.contacts)),
        has_positions=recipe.curves is None or not recipe.curves.alone,
    )


def in_order(parts: Sequence[Any], values: Callable[[Any], Sequence[Any]]) -> list[Any]:
    """Return a value of each clip in the order of the clips; empty where some have none.

    parts: each with `clips`, indices of which `values` are.
    """
    order = np.argsort([clip for part in parts for clip in part.clips])
    listed = [value for part in parts for value in values(part)]
    return [listed[i] for i in order] if len(listed) == len(order) else []
