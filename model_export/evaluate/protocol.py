"""The three ways to ask how good a model is, and what came out."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, cpu_count, delayed, parallel_config

from model_export import threads
from model_export.evaluate import errors, folds, methods, motion, newcomers, truth
from model_export.evaluate.errors import Errors
from model_export.evaluate.folds import Fold
from model_export.evaluate.methods import Answers, Asked
from model_export.evaluate.motion import Motion
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

    clips: what was asked for, by name. errors: of each method, clip by clip; None where a method
    was not asked. sigma (C,): predicted standard deviation of ours, m.
    """

    family: str
    protocol: str
    clips: tuple[str, ...]
    errors: dict[str, tuple[Errors | None, ...]]
    sigma: Floats

    def asked(self, name: str) -> list[int]:
        """Places of the clips that a method was asked for."""
        return [place for place, error in enumerate(self.errors[name]) if error is not None]

    def of(self, name: str, places: Sequence[int]) -> list[Errors]:
        """Errors of a method at some of the places that it was asked for."""
        return [error for place in places if (error := self.errors[name][place]) is not None]


@dataclass(frozen=True)
class _Part:
    """Answers to some of the clips: their places in the whole, their errors, and sigma."""

    places: tuple[int, ...]
    errors: dict[str, list[Errors | None]]
    sigma: Floats

    def of(self, name: str) -> Sequence[Errors | None]:
        """Errors of a method, none of one that was not asked."""
        return self.errors.get(name, [None] * len(self.places))


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
    jobs = [delayed(_held_out)(recipe, examples, fold, protocol) for fold in own]
    names = [f"{e.row.place.name} (line {e.row.line})" for e in examples]
    return _result(recipe, f"leave_one_{protocol}_out", names, _done(jobs, report))


def against_truth(
    recipe: Recipe, examples: Sequence[Example], points: Floats, report: Report
) -> Result:
    """Result at control points (C, d) whose noise-free motion is known."""
    trained = train(recipe, examples, lambda _: None)
    starts = range(0, len(points), BATCH)
    jobs = [delayed(_true)(recipe, trained, points[at : at + BATCH], at) for at in starts]
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
def _held_out(recipe: Recipe, examples: Sequence[Example], fold: Fold, protocol: str) -> _Part:
    rest, held = fold.split(examples)
    try:
        trained = train(recipe, rest, lambda _: None)
    except TrainingError as fault:
        named = ", ".join(sorted({example.row.place.name for example in held}))
        raise TrainingError(f"with {named} held out: {fault}") from fault
    asked = Asked(np.stack([e.controls for e in held]), [e.row.performer for e in held])
    captured = [
        motion.of_clip(e.clip, methods.captured_event(recipe, trained, e.landmarks)) for e in held
    ]
    found = methods.answers(recipe, trained, asked)
    if protocol == "clip":
        more: Mapping[str, Sequence[Motion | None]] = newcomers.unnamed(recipe, trained, asked)
    else:
        more = newcomers.adapted(recipe, trained, held)
    return _compared(recipe, trained, fold.held, _with(found, more), captured)


def _with(found: Answers, more: Mapping[str, Sequence[Motion | None]]) -> Answers:
    """Answers with those of more methods, ours before all others."""
    ours = {methods.OURS: found.motions[methods.OURS]}
    return replace(found, motions={**ours, **more, **found.motions})


@_alone()
def _true(recipe: Recipe, trained: Trained, points: Floats, start: int) -> _Part:
    event = methods.captured_event(recipe, trained, ())
    captured = [motion.of_clip(truths.clip(list(p), RATE), event) for p in points]
    found = methods.answers(recipe, trained, Asked(points, [""] * len(points)))
    places = tuple(range(start, start + len(points)))
    return _compared(recipe, trained, places, found, captured)


def _compared(
    recipe: Recipe,
    trained: Trained,
    places: tuple[int, ...],
    found: Answers,
    captured: Sequence[Motion],
) -> _Part:
    feet = tuple(map(trained.skeleton.names.index, recipe.motion.feet))
    compared = {
        name: [
            None if own is None else errors.compare(own, true, feet)
            for own, true in zip(made, captured, strict=True)
        ]
        for name, made in found.motions.items()
    }
    return _Part(places, compared, found.sigma)


def _result(recipe: Recipe, protocol: str, names: Sequence[str], parts: Iterator[_Part]) -> Result:
    """Parts in the order of the clips, whichever came first."""
    listed = list(parts)
    order = np.argsort([place for part in listed for place in part.places])
    # Where a fold holds the last but one performer out, nobody is told apart in it.
    methods_asked = dict.fromkeys(name for part in listed for name in part.errors)
    gathered = {name: [e for part in listed for e in part.of(name)] for name in methods_asked}
    return Result(
        recipe.name,
        protocol,
        tuple(names),
        {name: tuple(own[i] for i in order) for name, own in gathered.items()},
        np.concatenate([part.sigma for part in listed])[order],
    )
