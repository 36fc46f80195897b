"""The three ways to ask how good a model is, and what came out."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, cpu_count, delayed, parallel_config

from model_export import export, threads
from model_export.evaluate import errors, exact, folds, methods, motion, truth
from model_export.evaluate.errors import Errors
from model_export.evaluate.exact import Correction
from model_export.evaluate.folds import Fold
from model_export.evaluate.methods import EXACT, OURS, Asked
from model_export.evaluate.motion import Event, Motion
from model_export.ingest import Example
from model_export.recipe import Recipe
from model_export.sample import truth as truths
from model_export.train import Trained, train
from service.motion.conventions import Floats
from service.motion.errors import TrainingError

# Frames a second at which the procedural truth is played.
RATE = 120.0
# Truths asked at a time, so that progress is seen and memory bounded.
BATCH = 50

Report = Callable[[int, int], None]
"""Is told how many parts are done, and of how many."""


@dataclass(frozen=True)
class Result:
    """What one protocol found.

    clips: what was asked for, by name. errors: of each method, clip by clip. sigma (C,): predicted
    standard deviation of ours, m. corrections (C,): what it took to hold ours to the captured
    event; none where the recipe names no event.
    """

    family: str
    protocol: str
    clips: tuple[str, ...]
    errors: dict[str, tuple[Errors, ...]]
    sigma: Floats
    corrections: tuple[Correction, ...]


@dataclass(frozen=True)
class _Part:
    """Answers to some of the clips: their places in the whole, their errors, sigma, corrections."""

    places: tuple[int, ...]
    errors: dict[str, list[Errors]]
    sigma: Floats
    corrections: list[Correction]


@dataclass(frozen=True)
class _Made:
    """What was trained of a recipe, and the file of it."""

    recipe: Recipe
    trained: Trained
    file: bytes


def protocols(recipe: Recipe, examples: Sequence[Example]) -> list[str]:
    """What can be asked of a recipe, the one that counts most first."""
    several = len({example.row.performer for example in examples}) > 1
    known = ["truth"] if recipe.truth else []
    return known + ["clip"] + (["performer"] if several else [])


def run(recipe: Recipe, examples: Sequence[Example], protocol: str, report: Report) -> Result:
    """Result of a protocol: "clip" or "performer", held out one by one, or "truth".

    Raises TrainingError where what is left of the examples cannot carry a field.
    """
    if protocol == "truth":
        return against_truth(recipe, examples, truth.points(), report)
    own = folds.clips(examples) if protocol == "clip" else folds.performers(examples)
    jobs = [delayed(_held_out)(recipe, examples, fold) for fold in own]
    names = [f"{e.row.place.name} (line {e.row.line})" for e in examples]
    return _result(recipe, f"leave_one_{protocol}_out", names, _done(jobs, report))


def against_truth(
    recipe: Recipe, examples: Sequence[Example], points: Floats, report: Report
) -> Result:
    """Result at control points (C, d) whose noise-free motion is known."""
    made = _made(recipe, examples)
    starts = range(0, len(points), BATCH)
    jobs = [delayed(_true)(made, points[at : at + BATCH], at) for at in starts]
    names = [", ".join(f"{value:.4g}" for value in point) for point in points]
    return _result(recipe, "truth", names, _done(jobs, report))


def _done(jobs: Sequence[object], report: Report) -> Iterator[_Part]:
    parallel = Parallel(n_jobs=min(cpu_count(), len(jobs)), return_as="generator_unordered")
    for count, part in enumerate(parallel(jobs), start=1):
        report(count, len(jobs))
        yield part


@contextmanager
def _alone() -> Iterator[None]:
    """A job asks for no others: on a cluster scikit-learn's own would leave its place there."""
    with parallel_config(backend="sequential"), threads.one():
        yield


@_alone()
def _held_out(recipe: Recipe, examples: Sequence[Example], fold: Fold) -> _Part:
    rest, held = fold.split(examples)
    try:
        made = _made(recipe, rest)
    except TrainingError as fault:
        named = ", ".join(sorted({example.row.place.name for example in held}))
        raise TrainingError(f"with {named} held out: {fault}") from fault
    asked = Asked(np.stack([e.controls for e in held]), [e.row.performer for e in held])
    events = [methods.captured_event(recipe, made.trained, e.landmarks) for e in held]
    pairs = zip(held, events, strict=True)
    captured = [motion.of_clip(example.clip, event) for example, event in pairs]
    return _compared(made, fold.held, asked, captured, events)


@_alone()
def _true(made: _Made, points: Floats, start: int) -> _Part:
    event = methods.captured_event(made.recipe, made.trained, ())
    captured = [motion.of_clip(truths.clip(list(p), RATE), event) for p in points]
    places = tuple(range(start, start + len(points)))
    asked = Asked(points, [""] * len(points))
    return _compared(made, places, asked, captured, [event] * len(points))


def _made(recipe: Recipe, examples: Sequence[Example]) -> _Made:
    trained = train(recipe, examples, lambda _: None)
    return _Made(recipe, trained, export.finest(recipe, trained))


def _compared(
    made: _Made,
    places: tuple[int, ...],
    asked: Asked,
    captured: Sequence[Motion],
    events: Sequence[Event | None],
) -> _Part:
    recipe, trained = made.recipe, made.trained
    feet = tuple(map(trained.skeleton.names.index, recipe.motion.feet))
    found = methods.answers(recipe, trained, asked)
    motions, corrections = found.motions, list[Correction]()
    wanted = [exact.goal(own, event) for own, event in zip(captured, events, strict=True) if event]
    if wanted:
        held = exact.answers(recipe, trained, made.file, asked, wanted)
        rest = {name: own for name, own in motions.items() if name != OURS}
        motions, corrections = {OURS: motions[OURS], EXACT: held.motions, **rest}, held.corrections
    compared = {
        name: [errors.compare(own, true, feet) for own, true in zip(named, captured, strict=True)]
        for name, named in motions.items()
    }
    return _Part(places, compared, found.sigma, corrections)


def _result(recipe: Recipe, protocol: str, names: Sequence[str], parts: Iterator[_Part]) -> Result:
    """Parts in the order of the clips, whichever came first."""
    listed = list(parts)
    order = np.argsort([place for part in listed for place in part.places])
    corrections = [correction for part in listed for correction in part.corrections]
    gathered = {
        name: [error for part in listed for error in part.errors[name]] for name in listed[0].errors
    }
    return Result(
        recipe.name,
        protocol,
        tuple(names),
        {name: tuple(own[i] for i in order) for name, own in gathered.items()},
        np.concatenate([part.sigma for part in listed])[order],
        tuple(corrections[i] for i in order if corrections),
    )
