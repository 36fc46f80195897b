"""What suggested clips are worth: the procedural family from 40 samples to 92.

Samples are added as they are suggested, by controls that the body can do, or as chance has it, each
with the noise of the family; what is trained from them is compared with the truth. One such trial
says little, for each way takes its turn in being lucky: it is the mean of several that counts.
"""

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from joblib import Parallel, cpu_count, delayed

from model_export import ingest, recipe, threads
from model_export.evaluate import errors, methods, motion, truth
from model_export.evaluate.methods import Asked
from model_export.evaluate.protocol import RATE, Report
from model_export.sample import family, write
from model_export.sample import truth as truths
from model_export.sample.controls import Controls
from model_export.sample.family import Sample
from model_export.train import train
from service.motion import support, worth
from service.motion.conventions import Floats, Indices

START, END = 40, family.COUNT
SIZES = (START, 53, 66, 79, END)
CANDIDATES, ASKED = 600, 150
SEEDS = (31, 32, 33, 34, 35, 36, 37, 38)
"""Of the trials: each begins with samples of its own, and has noise and chance of its own."""
SUGGESTED, CHANCE = "suggested", "at random"


@dataclass(frozen=True)
class Learning:
    """Mean global and root-relative distance to the truth, m, at so many samples, of each trial, by
    how they were added (trials, 2, S)."""

    sizes: tuple[int, ...]
    trials: dict[str, Floats]

    @cached_property
    def errors(self) -> dict[str, Floats]:
        """Mean over the trials (2, S)."""
        return {way: own.mean(axis=0) for way, own in self.trials.items()}

    @cached_property
    def doubts(self) -> dict[str, Floats]:
        """Standard error of that mean (2, S)."""
        shares = {way: own.std(axis=0, ddof=1) for way, own in self.trials.items()}
        return {way: own / np.sqrt(len(self.trials[way])) for way, own in shares.items()}

    @property
    def reached(self) -> float:
        """Samples at which those suggested are as good as all of those added at random."""
        own, aim = self.errors[SUGGESTED][0], self.errors[CHANCE][0, -1]
        below = int(np.argmax(own <= aim)) if np.any(own <= aim) else len(own)
        if below in (0, len(own)):
            return float(self.sizes[min(below, len(own) - 1)])
        before, after = own[below - 1], own[below]
        share = (before - aim) / (before - after)
        return float(np.interp(share, (0, 1), self.sizes[below - 1 : below + 1]))

    @property
    def faster(self) -> float:
        """How many random samples one that is suggested is worth."""
        return (self.sizes[-1] - self.sizes[0]) / (self.reached - self.sizes[0])


def measure(report: Report, sizes: Sequence[int] = SIZES, seeds: Sequence[int] = SEEDS) -> Learning:
    """Learning at some sizes, the smallest first, in a trial of each seed; the same at every
    call."""
    # Both ways begin with the same samples, which are trained from once.
    steps = [(SUGGESTED, size) for size in sizes] + [(CHANCE, size) for size in sizes[1:]]
    parts = [(seed, way, size) for seed in seeds for way, size in steps]
    trials = {seed: _trial(seed) for seed in seeds}
    jobs = [delayed(_error)(trials[seed][way][:size]) for seed, way, size in parts]
    found = dict(zip(parts, _done(jobs, report), strict=True))
    for seed in seeds:
        found[seed, CHANCE, sizes[0]] = found[seed, SUGGESTED, sizes[0]]
    rows = {
        way: [np.array([found[seed, way, size] for size in sizes]).T for seed in seeds]
        for way in (SUGGESTED, CHANCE)
    }
    return Learning(tuple(sizes), {way: np.stack(own) for way, own in rows.items()})


def _done(jobs: Sequence[object], report: Report) -> list[tuple[float, float]]:
    parallel = Parallel(n_jobs=min(cpu_count(), len(jobs)), return_as="generator")
    found = []
    for count, part in enumerate(parallel(jobs), start=1):
        report(count, len(jobs))
        found.append(part)
    return found


def _trial(seed: int) -> dict[str, list[Sample]]:
    """Samples by how they were added: the same at first, and then 52 of each kind."""
    rng = np.random.Generator(np.random.PCG64(seed))
    known = list(family.samples())
    first = [known[i] for i in sorted(rng.choice(len(known), START, replace=False).tolist())]
    # Not those at which the truth is asked.
    candidates = truth.points(truth.POINTS + CANDIDATES)[truth.POINTS :]
    ways = {SUGGESTED: _suggested(first, candidates), CHANCE: rng.permutation(len(candidates))}
    added = {
        way: [candidates[i].tolist() for i in order[: END - START]] for way, order in ways.items()
    }
    return {
        way: [*first, *(_sample(point, rng) for point in points)] for way, points in added.items()
    }


def _suggested(first: Sequence[Sample], candidates: Floats) -> Indices:
    """What is ranked highest where the first samples are known."""
    own = support.of(np.array([_row(sample.controls) for sample in first]))
    ranked = worth.rank(own.scaled(candidates), own.samples, END - START)
    return np.array([at for at, _ in ranked])


def _row(own: Controls) -> list[float]:
    return [own.stature, own.hip_height, own.turn, own.target_height]


def _sample(point: list[float], rng: np.random.Generator) -> Sample:
    rounded = Controls(*(round(value, 4) for value in point))
    return Sample("somebody", rounded, family.trial(rounded, rng))


def _error(samples: Sequence[Sample]) -> tuple[float, float]:
    """Global and root-relative distance of what is trained from some samples, m."""
    with tempfile.TemporaryDirectory() as scratch:
        file = write.some(Path(scratch) / "family", samples)
        own = recipe.read(file)
        examples, _ = ingest.ingest(own, file.parent)
    with threads.one():
        trained = train(own, examples, lambda _: None)
        points = truth.points(ASKED)
        found = methods.ours(own, trained, Asked(points, [""] * len(points)))
        captured = [motion.of_clip(truths.clip(list(p), RATE), None) for p in points]
        pairs = zip(found, captured, strict=True)
        mean = errors.mean([errors.compare(made, true, ()) for made, true in pairs])
    return mean.absolute.mean, mean.relative.mean


def facts(found: Learning) -> dict[str, object]:
    """Figures as JSON holds them."""
    return {
        "samples": list(found.sizes),
        "trials": len(found.trials[CHANCE]),
        **{
            way.replace(" ", "_"): {
                "global_cm": _centimetres(own[0]),
                "relative_cm": _centimetres(own[1]),
                "global_standard_error_cm": _centimetres(found.doubts[way][0]),
            }
            for way, own in found.errors.items()
        },
        "reached": round(found.reached, 1),
        "faster": round(found.faster, 2),
    }


def _centimetres(values: Floats) -> list[float]:
    return [round(100 * value, 3) for value in values.tolist()]


def table(found: Learning) -> str:
    """The curve in Markdown."""
    return "\n".join(_lines(found))


def _lines(found: Learning) -> Iterator[str]:
    yield "| samples | " + " | ".join(map(str, found.sizes)) + " |"
    yield "|---" * (1 + len(found.sizes)) + "|"
    for way, own in found.errors.items():
        for name, row, off in zip(("global", "relative"), own, found.doubts[way], strict=True):
            cells = (f"{100 * e:.2f} ± {100 * o:.2f}" for e, o in zip(row, off, strict=True))
            yield f"| {way}, {name} | " + " | ".join(cells) + " |"
    yield ""
    yield (
        f"Centimetres from the truth, mean of {len(found.trials[CHANCE])} trials and its standard "
        f"error. Suggested samples are at {found.reached:.0f} where random "
        f"ones are at {found.sizes[-1]}: {found.faster:.1f} times as fast."
    )
