"""Evaluation of every method: clips or performers held out, and against the noise-free truth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from evaluation import (
    corrections,
    equal_information,
    finest_file,
    ground_truth,
    methods,
    new_performers,
    standing_feet,
    takes,
)
from evaluation.corrections import Correction, EventTarget
from evaluation.methods import EXACT, NO_PERFORMER, OPEN, UNCORRECTED
from evaluation.standing_feet import FeetAnswer
from evaluation.takes import TakeResults
from posefield.common.units import Floats
from posefield_train.evaluate import motion_errors, predictions, protocol, summary
from posefield_train.evaluate.predictions import OURS, Predictions, Queries
from posefield_train.evaluate.protocol import (
    EvaluationResult,
    Fold,
    PartialResult,
    ProgressCallback,
)
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.jobs import Jobs, single_threaded
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.training import train_examples

TRUTH = "truth"
BATCH = 50
"""Noise-free motions evaluated together: progress is shown, and memory is bounded."""


@dataclass(frozen=True)
class Part:
    """Results for some of the clips. clips: their indices. errors: by every method.

    corrections: of the predictions to the captured event; empty without an event. feet: of the
    service's answers; empty without feet, in place, and against the truth. takes: None unless clips
    are held out.
    """

    errors: PartialResult
    corrections: Sequence[Correction]
    feet: Sequence[FeetAnswer] = ()
    takes: TakeResults | None = None

    @property
    def clips(self) -> tuple[int, ...]:
        """Return the indices of the clips."""
        return self.errors.clips


@dataclass(frozen=True)
class Result:
    """Result of a protocol: errors of every method, and the figures of the other measures."""

    errors: EvaluationResult
    corrections: Sequence[Correction]
    feet: Sequence[FeetAnswer]
    takes: dict[str, Any]

    def facts(self) -> dict[str, Any]:
        """Return the figures as JSON values."""
        figures = summary.facts(self.errors)
        if EXACT in figures["methods"]:
            exact = corrections.facts(self.errors, self.corrections)
            figures["methods"][EXACT]["exact"] = exact
        feet = standing_feet.facts(self.feet)
        return {
            **figures,
            **({"feet": feet} if feet else {}),
            **({"takes": self.takes} if self.takes else {}),
            "equal_information": equal_information.facts(self.errors),
        }


def run(
    recipe: Recipe, examples: Sequence[Example], name: str, jobs: Jobs, report: ProgressCallback
) -> Result:
    """Run a protocol of a recipe: "clip", "performer" or "truth"."""
    if name == TRUTH:
        return run_against_truth(recipe, examples, ground_truth.truth_points(), jobs, report)
    listed = protocol.folds_of(examples, name)
    run_jobs = jobs.run(run_fold, [(fold, name) for fold in listed], (recipe, examples))
    fold_results = list(protocol.with_progress(run_jobs, len(listed), report))
    errors = (fold_result.errors for fold_result in fold_results)
    return _result(protocol.held_out_result(recipe, examples, name, errors), fold_results)


@single_threaded()
def run_fold(recipe: Recipe, examples: Sequence[Example], fold: Fold, name: str) -> Part:
    """Return the results for the clips of one fold."""
    rest, held_out = fold.split(examples)
    methods.check_lines(rest, tuple(control.name for control in recipe.controls))
    trained = protocol.train_fold(recipe, examples, fold)
    file = finest_file.export_finest(trained.trained)
    # Methods that only one protocol has.
    if name == "clip":
        more: dict[str, Any] = new_performers.predict_unnamed(
            recipe, trained.trained, rest, trained.queries
        )
    else:
        more = new_performers.predict_adapted(recipe, trained.trained, held_out)
    events = [predictions.captured_event(trained.trained, e.landmarks) for e in held_out]
    targets = [
        corrections.event_target(motion, event)
        for motion, event in zip(trained.captured, events, strict=True)
        if event
    ]
    predicted, corrected = _predict(recipe, trained.trained, file, trained.queries, targets, more)
    errors = protocol.compare_fold(trained, predicted)
    if name != "clip":
        return Part(errors, corrected)
    feet = standing_feet.feet_answers(recipe.name, file, held_out)
    return Part(
        errors, corrected, feet, takes.take_results(recipe.name, file, held_out, fold.held_out)
    )


def _predict(
    recipe: Recipe,
    trained: TrainedModel,
    file: bytes,
    queries: Queries,
    targets: Sequence[EventTarget],
    more: dict[str, Any],
) -> tuple[Predictions, Sequence[Correction]]:
    """Return the predictions of all methods, posefield's first, and of the corrections."""
    predicted = methods.predict(recipe, trained, queries)
    timing = replace(trained.model.timing, correction=None)
    uncorrected = replace(trained, model=replace(trained.model, timing=timing))
    ours: dict[str, Any] = {
        OURS: predicted.motions[OURS],
        UNCORRECTED: predictions.predict_posefield(uncorrected, queries),
    }
    corrected: Sequence[Correction] = ()
    if targets:
        ours[EXACT], corrected = corrections.correct_motions(
            recipe, trained, file, queries, targets
        )
    peers = {name: motions for name, motions in predicted.motions.items() if name != OURS}
    return replace(predicted, motions={**ours, **more, **peers}), corrected


def run_against_truth(
    recipe: Recipe,
    examples: Sequence[Example],
    points: Floats,
    jobs: Jobs,
    report: ProgressCallback,
) -> Result:
    """Return the result at control points (C, d) of the procedural family."""
    methods.check_lines(list(examples), tuple(control.name for control in recipe.controls))
    trained = train_examples(recipe, examples)
    file = finest_file.export_finest(trained)
    batches = [(points[at : at + BATCH], at) for at in range(0, len(points), BATCH)]
    run_jobs = jobs.run(_run_truth_batch, batches, (recipe, trained, file))
    fold_results = list(protocol.with_progress(run_jobs, len(batches), report))
    names = [", ".join(f"{value:.4g}" for value in point) for point in points]
    joints, alone = trained.skeleton.names, range(len(points))
    errors = (fold_result.errors for fold_result in fold_results)
    return _result(protocol.merge(recipe, TRUTH, names, joints, alone, errors), fold_results)


@single_threaded()
def _run_truth_batch(
    recipe: Recipe, trained: TrainedModel, file: bytes, points: Floats, start: int
) -> Part:
    event = predictions.captured_event(trained, ())
    captured = ground_truth.truth_motions(points, event)
    queries = Queries(points, [{}] * len(points))
    targets = [corrections.event_target(motion, event) for motion in captured] if event else []
    predicted, corrected = _predict(recipe, trained, file, queries, targets, {})
    feet = tuple(map(trained.skeleton.names.index, recipe.motion.feet))
    errors = motion_errors.compare_methods(predicted.motions, captured, feet)
    clips = tuple(range(start, start + len(points)))
    return Part(PartialResult(clips, errors, predicted.sigma, predicted.joint_sigma), corrected)


def _result(errors: EvaluationResult, fold_results: Sequence[Part]) -> Result:
    """Return the result of parts, in the order of the clips."""
    listed = sorted(fold_results, key=lambda fold_result: fold_result.clips)
    names = list(errors.errors)
    unnamed = [name for name in names if name.endswith(OPEN) and NO_PERFORMER in names]
    varied = [fold_result.takes for fold_result in listed if fold_result.takes]
    with_takes = [fold_result for fold_result in listed if fold_result.takes]
    answers = protocol.in_order(with_takes, lambda fold_result: fold_result.takes.clips)
    return Result(
        replace(
            errors,
            definitions={name: methods.definition(name) for name in names},
            references=dict.fromkeys(unnamed, NO_PERFORMER),
        ),
        protocol.in_order(listed, lambda fold_result: fold_result.corrections),
        protocol.in_order(listed, lambda fold_result: fold_result.feet),
        takes.facts(answers, [fold_result.fields for fold_result in varied if fold_result.fields]),
    )
