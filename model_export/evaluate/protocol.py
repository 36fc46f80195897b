"""The three ways to ask how good a model is, and what came out."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from joblib import Parallel, cpu_count, delayed, parallel_config

from model_export import export, fidelity, threads
from model_export.evaluate import (
    errors,
    exact,
    flags,
    folds,
    methods,
    motion,
    newcomers,
    stills,
    truth,
)
from model_export.evaluate.errors import Errors
from model_export.evaluate.exact import Correction
from model_export.evaluate.flags import Flags
from model_export.evaluate.folds import Fold
from model_export.evaluate.methods import EXACT, OURS, Asked
from model_export.evaluate.motion import Event, Motion
from model_export.evaluate.stills import CAPTURED, Stills
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

# Methods whose answers are kept to be looked at.
OWN = (OURS, EXACT, *newcomers.SHOWN)

Report = Callable[[int, int], None]
"""Is told how many parts are done, and of how many."""


@dataclass(frozen=True)
class Result:
    """What one protocol found.

    clips: what was asked for, by name. errors: of each method, clip by clip; None where a method
    was not asked. sigma (C,): predicted standard deviation of ours, m; joint_sigma (C, J): of each
    joint, by name in `joints`. corrections (C,): what it took to hold ours to the captured event;
    none where the recipe names no event. flags: how the support flag does on the same clips; none
    against the truth, which is everywhere. stills: of the captured clips and of our own answers,
    with the joints' parents.
    """

    family: str
    protocol: str
    clips: tuple[str, ...]
    errors: dict[str, tuple[Errors | None, ...]]
    sigma: Floats
    joint_sigma: Floats
    joints: tuple[str, ...]
    corrections: tuple[Correction, ...]
    flags: Flags | None = None
    stills: Stills = field(default_factory=dict)
    parents: tuple[int, ...] = ()

    def asked(self, name: str) -> list[int]:
        """Places of the clips that a method was asked for."""
        return [place for place, error in enumerate(self.errors[name]) if error is not None]

    def of(self, name: str, places: Sequence[int]) -> list[Errors]:
        """Errors of a method at some of the places that it was asked for."""
        return [error for place in places if (error := self.errors[name][place]) is not None]


@dataclass(frozen=True)
class _Part:
    """Answers to some of the clips: their places in the whole, their errors, sigma, corrections."""

    places: tuple[int, ...]
    errors: dict[str, list[Errors | None]]
    sigma: Floats
    joint_sigma: Floats
    corrections: list[Correction]
    stills: Stills
    parents: tuple[int, ...]

    def of(self, name: str) -> Sequence[Errors | None]:
        """Errors of a method, none of one that was not asked."""
        return self.errors.get(name, [None] * len(self.places))


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
    jobs = [delayed(_held_out)(recipe, examples, fold, protocol) for fold in own]
    names = [f"{e.row.place.name} (line {e.row.line})" for e in examples]
    controls = np.stack([example.controls for example in examples])
    found = flags.measure(controls, [control.name for control in recipe.controls], own)
    asked = _Asked(f"leave_one_{protocol}_out", names, examples[0].clip.skeleton.names)
    return replace(_result(recipe, asked, _done(jobs, report)), flags=found)


def against_truth(
    recipe: Recipe, examples: Sequence[Example], points: Floats, report: Report
) -> Result:
    """Result at control points (C, d) whose noise-free motion is known."""
    made = _made(recipe, examples)
    starts = range(0, len(points), BATCH)
    jobs = [delayed(_true)(made, points[at : at + BATCH], at) for at in starts]
    names = [", ".join(f"{value:.4g}" for value in point) for point in points]
    return _result(recipe, _Asked("truth", names, made.trained.skeleton.names), _done(jobs, report))


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
        made = _made(recipe, rest)
    except TrainingError as fault:
        named = ", ".join(sorted({example.row.place.name for example in held}))
        raise TrainingError(f"with {named} held out: {fault}") from fault
    asked = Asked(np.stack([e.controls for e in held]), [e.row.performer for e in held])
    events = [methods.captured_event(recipe, made.trained, e.landmarks) for e in held]
    pairs = zip(held, events, strict=True)
    captured = [motion.of_clip(example.clip, event) for example, event in pairs]
    if protocol == "clip":
        more: More = newcomers.unnamed(recipe, made.trained, asked)
    else:
        more = newcomers.adapted(recipe, made.trained, held)
    return _compared(made, fold.held, asked, _Truth(captured, events, more))


More = Mapping[str, Sequence[Motion | None]]
"""Answers of methods that only one protocol asks, None where they were not asked."""


@dataclass(frozen=True)
class _Truth:
    """Captured motions, their events, and answers to them that are at hand already."""

    captured: Sequence[Motion]
    events: Sequence[Event | None]
    more: More


@_alone()
def _true(made: _Made, points: Floats, start: int) -> _Part:
    event = methods.captured_event(made.recipe, made.trained, ())
    captured = [motion.of_clip(truths.clip(list(p), RATE), event) for p in points]
    places = tuple(range(start, start + len(points)))
    asked = Asked(points, [""] * len(points))
    return _compared(made, places, asked, _Truth(captured, [event] * len(points), {}))


def _made(recipe: Recipe, examples: Sequence[Example]) -> _Made:
    trained = train(recipe, examples, lambda _: None)
    return _Made(recipe, trained, export.finest(recipe, trained))


def _compared(
    made: _Made,
    places: tuple[int, ...],
    asked: Asked,
    held: _Truth,
) -> _Part:
    recipe, trained = made.recipe, made.trained
    feet = tuple(map(trained.skeleton.names.index, recipe.motion.feet))
    found = methods.answers(recipe, trained, asked)
    rest = {name: own for name, own in found.motions.items() if name != OURS}
    ours, corrections = {OURS: found.motions[OURS]}, list[Correction]()
    pairs = zip(held.captured, held.events, strict=True)
    wanted = [exact.goal(own, event) for own, event in pairs if event]
    if wanted:
        corrected = exact.answers(recipe, trained, made.file, asked, wanted)
        ours[EXACT], corrections = corrected.motions, corrected.corrections
    motions = {**ours, **held.more, **rest}
    compared = {
        name: [
            None if own is None else errors.compare(own, true, feet)
            for own, true in zip(named, held.captured, strict=True)
        ]
        for name, named in motions.items()
    }
    named = {CAPTURED: held.captured, **{name: motions[name] for name in motions if name in OWN}}
    moment = fidelity.moment(recipe, trained.examples)
    looks = {
        name: [stills.still(own, moment.joint) if moment else None for own in made_of]
        for name, made_of in named.items()
    }
    parents = trained.skeleton.parents
    trust = found.sigma, found.joint_sigma
    return _Part(places, compared, *trust, corrections, looks, parents)


@dataclass(frozen=True)
class _Asked:
    """Which protocol, of which clips, and the names of the joints."""

    protocol: str
    clips: Sequence[str]
    joints: tuple[str, ...]


def _result(recipe: Recipe, asked: _Asked, parts: Iterator[_Part]) -> Result:
    """Parts in the order of the clips, whichever came first."""
    listed = list(parts)
    order = np.argsort([place for part in listed for place in part.places])
    corrections = [correction for part in listed for correction in part.corrections]
    # Where a fold holds the last but one performer out, nobody is told apart in it.
    methods_asked = dict.fromkeys(name for part in listed for name in part.errors)
    gathered = {name: [e for part in listed for e in part.of(name)] for name in methods_asked}
    looks = {
        name: [s for part in listed for s in part.stills.get(name, [None] * len(part.places))]
        for name in (CAPTURED, *OWN)
        if any(name in part.stills for part in listed)
    }
    return Result(
        recipe.name,
        asked.protocol,
        tuple(asked.clips),
        {name: tuple(own[i] for i in order) for name, own in gathered.items()},
        np.concatenate([part.sigma for part in listed])[order],
        np.concatenate([part.joint_sigma for part in listed])[order],
        asked.joints,
        tuple(corrections[i] for i in order if corrections),
        stills={name: [own[i] for i in order] for name, own in looks.items()},
        parents=listed[0].parents,
    )
