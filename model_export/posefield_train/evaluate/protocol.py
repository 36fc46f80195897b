"""Evaluation protocols: clips held out, performers held out, and the noise-free truth."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import Floats
from posefield.motion.clip import Clip
from posefield_train.contacts import held_out_contacts
from posefield_train.contacts.contact_model import ContactAccuracy
from posefield_train.contacts.held_out_contacts import HeldOutClips
from posefield_train.evaluate import (
    compared_motion,
    corrected_answers,
    event_bodies,
    folds,
    ground_truth,
    methods,
    motion_errors,
    new_performers,
    support_flags,
)
from posefield_train.evaluate.compared_motion import ComparedMotion, MotionEvent
from posefield_train.evaluate.corrected_answers import Correction
from posefield_train.evaluate.event_bodies import CAPTURED, EventBodies
from posefield_train.evaluate.folds import Fold
from posefield_train.evaluate.footing import standing_answers
from posefield_train.evaluate.footing.standing_answers import FeetAnswer
from posefield_train.evaluate.methods import EXACT, OURS, Queries
from posefield_train.evaluate.motion_errors import MotionErrors
from posefield_train.evaluate.support_flags import SupportFlags
from posefield_train.evaluate.variation import take_answers, take_summary
from posefield_train.evaluate.variation.take_answers import TakeResults
from posefield_train.evaluate.variation.take_summary import Takes
from posefield_train.graph import onnx_export
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_points
from posefield_train.parallel import single_thread
from posefield_train.parallel.jobs import Jobs
from posefield_train.source.ingest import Example
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import truncation_error
from posefield_train.train import train

# Noise-free motions evaluated together: progress is shown, and memory is bounded.
BATCH = 50
# Methods whose bodies are kept for the charts.
CHARTED_METHODS = (OURS, EXACT, *new_performers.ADAPTATION_COUNTS)

ProgressCallback = Callable[[int, int], None]
"""Callback with the number of parts that are done, and of all parts."""


@dataclass(frozen=True)
class EvaluationResult:
    """Result of one protocol over C clips.

    clips: names. errors: of each method by clip; None for clips that a method did not predict.
    sigma: standard deviation (C,) that posefield predicts, m. joint_sigma: of each joint (C, J), m.
    joints: their names. takes: number (C,) of the take of each clip. corrections: of the
    predictions to the captured event (C,); empty without an event. flags: accuracy of the support
    flag; None against the truth, which has no held-out clips. bodies: at the event, of captured
    clips and of posefield's predictions. parents: of the joints. contacts: accuracy of posefield's
    (C,); empty without contacts, and against the truth. feet: of the service's answers (C,); empty
    without feet, in place, and against the truth. variation: takes of the clips.
    curves: names. has_positions: False for clips of curves without a skeleton, of which measures of
    positions say nothing.
    """

    family: str
    protocol: str
    clips: tuple[str, ...]
    errors: dict[str, tuple[MotionErrors | None, ...]]
    sigma: Floats
    joint_sigma: Floats
    joints: tuple[str, ...]
    takes: tuple[int, ...]
    corrections: tuple[Correction, ...]
    flags: SupportFlags | None = None
    bodies: EventBodies = field(default_factory=dict)
    parents: tuple[int, ...] = ()
    contacts: tuple[ContactAccuracy, ...] = ()
    feet: tuple[FeetAnswer, ...] = ()
    variation: Takes = field(default_factory=Takes)
    curves: tuple[str, ...] = ()
    has_positions: bool = True

    def asked(self, name: str) -> list[int]:
        """Return the indices of the clips that a method predicted."""
        return [place for place, error in enumerate(self.errors[name]) if error is not None]

    def of(self, name: str, places: Sequence[int]) -> list[MotionErrors]:
        """Return the errors of a method at some of the clips that it predicted."""
        return [error for place in places if (error := self.errors[name][place]) is not None]


@dataclass(frozen=True)
class PartialResult:
    """Result for some of the clips. places: their indices."""

    places: tuple[int, ...]
    errors: dict[str, list[MotionErrors | None]]
    sigma: Floats
    joint_sigma: Floats
    corrections: list[Correction]
    bodies: EventBodies
    parents: tuple[int, ...]
    contacts: Sequence[ContactAccuracy] = ()
    feet: Sequence[FeetAnswer] = ()
    takes: TakeResults | None = None

    def of(self, name: str) -> Sequence[MotionErrors | None]:
        """Return the errors of a method, None for each clip if it predicted none."""
        return self.errors.get(name, [None] * len(self.places))


@dataclass(frozen=True)
class _EvaluatedModel:
    """A recipe, its trained model, and the model file."""

    recipe: Recipe
    trained: TrainedModel
    file: bytes


def protocols(recipe: Recipe, examples: Sequence[Example]) -> list[str]:
    """Return the protocols that a recipe allows, the most important first."""
    several = len({example.row.performer for example in examples}) > 1
    known = ["truth"] if recipe.truth else []
    return known + ["clip"] + (["performer"] if several else [])


def count_jobs(examples: Sequence[Example], protocol: str) -> int:
    """Return the number of jobs that a protocol is run in."""
    if protocol == "truth":
        return -(-ground_truth.POINTS // BATCH)
    return len(_folds(examples, protocol))


def _folds(examples: Sequence[Example], protocol: str) -> list[Fold]:
    return folds.clip_folds(examples) if protocol == "clip" else folds.performer_folds(examples)


def run_protocol(
    recipe: Recipe, examples: Sequence[Example], protocol: str, jobs: Jobs, report: ProgressCallback
) -> EvaluationResult:
    """Run a protocol: "clip" or "performer", held out one by one, or "truth".

    Raises TrainingError if the examples that remain are too few to train from.
    """
    if protocol == "truth":
        return run_against_truth(recipe, examples, ground_truth.truth_points(), jobs, report)
    own = _folds(examples, protocol)
    each = [(fold, protocol) for fold in own]
    names = [f"{e.row.place.name} (line {e.row.line})" for e in examples]
    controls = np.stack([example.controls for example in examples])
    found = support_flags.measure_flags(
        controls, [control.name for control in recipe.controls], own
    )
    joints, takes = examples[0].clip.skeleton.names, sample_points.take_numbers(examples)
    asked = _ResultNames(f"leave_one_{protocol}_out", names, joints, takes.tolist())
    parts = with_progress(jobs.run(run_fold, each, (recipe, examples)), len(each), report)
    curves = tuple(examples[0].clip.curves.names) if examples[0].clip.curves else ()
    return replace(_merge_parts(recipe, asked, parts), flags=found, curves=curves)


def run_against_truth(
    recipe: Recipe,
    examples: Sequence[Example],
    points: Floats,
    jobs: Jobs,
    report: ProgressCallback,
) -> EvaluationResult:
    """Return the result at control points (C, d) of the procedural family."""
    made = _evaluated_model(recipe, examples)
    each = [(points[at : at + BATCH], at) for at in range(0, len(points), BATCH)]
    names = [", ".join(f"{value:.4g}" for value in point) for point in points]
    asked = _ResultNames("truth", names, made.trained.skeleton.names, range(len(points)))
    return _merge_parts(
        recipe, asked, with_progress(jobs.run(_run_truth_batch, each, (made,)), len(each), report)
    )


def with_progress(results: Iterator[Any], count: int, report: ProgressCallback) -> Iterator[Any]:
    """Yield the results of jobs and report each. count: number of the jobs."""
    for done, result in enumerate(results, start=1):
        report(done, count)
        yield result


@single_thread.single_threaded()
def run_fold(
    recipe: Recipe, examples: Sequence[Example], fold: Fold, protocol: str
) -> PartialResult:
    """Return the result for the clips of one fold. Raises TrainingError as `run_protocol` does."""
    rest, held = fold.split(examples)
    try:
        made = _evaluated_model(recipe, rest)
    except TrainingError as error:
        named = ", ".join(sorted({example.row.place.name for example in held}))
        raise TrainingError(f"with {named} held out: {error}") from error
    asked = Queries(np.stack([e.controls for e in held]), [e.row.labels for e in held])
    events = [methods.captured_event(recipe, made.trained, e.landmarks) for e in held]
    pairs = zip(held, events, strict=True)
    # As captured: closing a cycle moves joints, which would favour what closes the same way.
    captured = [
        compared_motion.motion_of_clip(example.captured or example.clip, event)
        for example, event in pairs
    ]
    if protocol == "clip":
        more: ExtraPredictions = new_performers.predict_unnamed(recipe, made.trained, rest, asked)
    else:
        more = new_performers.predict_adapted(recipe, made.trained, held)
    found = _compare_methods(made, fold.held, asked, _ReferenceMotions(captured, events, more))
    contacts = _contact_accuracies(made, HeldOutClips(rest, held), asked)
    by_clip = held if protocol == "clip" else []
    feet = standing_answers.feet_answers(recipe.name, made.file, by_clip, _relative_distance)
    takes = None
    if protocol == "clip":
        takes = take_answers.take_results(recipe.name, made.file, held, fold.held)
    return replace(found, contacts=contacts, feet=feet, takes=takes)


def _relative_distance(made: Clip, captured: Clip) -> float:
    """Return the mean distance of a clip from a captured one after time warping, m."""
    one, other = (compared_motion.motion_of_clip(own, None) for own in (made, captured))
    return float(motion_errors.compare_motions(one, other, ()).relative.mean)


def _contact_accuracies(
    made: _EvaluatedModel, clips: HeldOutClips, asked: Queries
) -> list[ContactAccuracy]:
    own, model = made.trained.contacts, made.trained.model
    if own is None:
        return []
    labels = sample_points.label_weights(asked.labels, model.bank.labels)
    durations = model.durations(asked.controls, labels)

    def predict(shares: Floats) -> Floats:
        found = model.evaluate(asked.controls, shares * durations[:, None], labels).contacts
        return np.zeros((len(durations), len(shares), 0)) if found is None else found

    joints = [one.joint for one in own.statistics]
    return held_out_contacts.held_out_accuracies(made.recipe, clips, joints, predict)


ExtraPredictions = Mapping[str, Sequence[ComparedMotion | None]]
"""Answers of methods that only one protocol has; None for clips that they did not predict."""


@dataclass(frozen=True)
class _ReferenceMotions:
    """Captured motions, their events, and predictions of additional methods."""

    captured: Sequence[ComparedMotion]
    events: Sequence[MotionEvent | None]
    more: ExtraPredictions


@single_thread.single_threaded()
def _run_truth_batch(made: _EvaluatedModel, points: Floats, start: int) -> PartialResult:
    event = methods.captured_event(made.recipe, made.trained, ())
    captured = ground_truth.truth_motions(points, event)
    places = tuple(range(start, start + len(points)))
    asked = Queries(points, [{}] * len(points))
    return _compare_methods(
        made, places, asked, _ReferenceMotions(captured, [event] * len(points), {})
    )


def _evaluated_model(recipe: Recipe, examples: Sequence[Example]) -> _EvaluatedModel:
    methods.check_lines(examples, tuple(control.name for control in recipe.controls))
    trained = train(recipe, examples, lambda _: None)
    return _EvaluatedModel(recipe, trained, onnx_export.export_finest(recipe, trained))


def _compare_methods(
    made: _EvaluatedModel,
    places: tuple[int, ...],
    asked: Queries,
    held: _ReferenceMotions,
) -> PartialResult:
    recipe, trained = made.recipe, made.trained
    feet = tuple(map(trained.skeleton.names.index, recipe.motion.feet))
    found = methods.predict_all(recipe, trained, asked)
    rest = {name: own for name, own in found.motions.items() if name != OURS}
    ours, corrections = {OURS: found.motions[OURS]}, list[Correction]()
    pairs = zip(held.captured, held.events, strict=True)
    wanted = [corrected_answers.event_target(own, event) for own, event in pairs if event]
    if wanted:
        corrected = corrected_answers.correct_motions(recipe, trained, made.file, asked, wanted)
        ours[EXACT], corrections = corrected.motions, corrected.corrections
    motions = {**ours, **held.more, **rest}
    compared = motion_errors.compare_methods(motions, held.captured, feet)
    named = {
        CAPTURED: held.captured,
        **{name: motions[name] for name in motions if name in CHARTED_METHODS},
    }
    moment = truncation_error.event_frame(recipe, trained.examples)
    looks = {
        name: [event_bodies.event_body(own, moment.joint) if moment else None for own in made_of]
        for name, made_of in named.items()
    }
    parents = trained.skeleton.parents
    trust = found.sigma, found.joint_sigma
    return PartialResult(places, compared, *trust, corrections, looks, parents)


@dataclass(frozen=True)
class _ResultNames:
    """Names of the protocol, of the clips and of the joints; takes: number of each clip's."""

    protocol: str
    clips: Sequence[str]
    joints: tuple[str, ...]
    takes: Sequence[int]


def _merge_parts(
    recipe: Recipe, asked: _ResultNames, parts: Iterator[PartialResult]
) -> EvaluationResult:
    """Merge parts into one result, in the order of the clips."""
    listed = sorted(parts, key=lambda part: part.places)
    order = np.argsort([place for part in listed for place in part.places])
    corrections = [correction for part in listed for correction in part.corrections]
    contacts = [accuracy for part in listed for accuracy in part.contacts]
    feet = [answer for part in listed for answer in part.feet]
    # A fold that leaves one performer lacks the methods that distinguish performers.
    methods_asked = dict.fromkeys(name for part in listed for name in part.errors)
    gathered = {name: [e for part in listed for e in part.of(name)] for name in methods_asked}
    looks = {
        name: [s for part in listed for s in part.bodies.get(name, [None] * len(part.places))]
        for name in (CAPTURED, *CHARTED_METHODS)
        if any(name in part.bodies for part in listed)
    }
    return EvaluationResult(
        recipe.name,
        asked.protocol,
        tuple(asked.clips),
        {name: tuple(own[i] for i in order) for name, own in gathered.items()},
        np.concatenate([part.sigma for part in listed])[order],
        np.concatenate([part.joint_sigma for part in listed])[order],
        asked.joints,
        tuple(asked.takes),
        tuple(corrections[i] for i in order if corrections),
        bodies={name: [own[i] for i in order] for name, own in looks.items()},
        parents=listed[0].parents,
        # A fold without a clip in contact has no contacts.
        contacts=tuple(contacts[i] for i in order) if len(contacts) == len(order) else (),
        feet=tuple(feet[i] for i in order) if len(feet) == len(order) else (),
        variation=take_summary.merge([part.takes for part in listed], order.tolist()),
        has_positions=recipe.curves is None or not recipe.curves.alone,
    )
