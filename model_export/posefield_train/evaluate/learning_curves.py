"""Learning curves of suggested and random captures, on the procedural family.

From 40 to 92, samples are added in the order of the suggestions or at random, among controls that
the body can reach, each with the noise of the family. Models trained from them are compared with
the noise-free truth. Single trials vary, so the result is the mean of several.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.kriging import acquisition, support
from posefield_train.evaluate import ground_truth, methods, motion_errors, protocol
from posefield_train.evaluate.methods import Queries
from posefield_train.evaluate.protocol import ProgressCallback
from posefield_train.parallel import single_thread
from posefield_train.parallel.jobs import Jobs
from posefield_train.report.drawing import markdown_table
from posefield_train.sample import sample_family, sample_files
from posefield_train.sample.sample_controls import SampleControls
from posefield_train.sample.sample_family import SampleTrial
from posefield_train.source import ingest, recipe
from posefield_train.train import train

START, END = 40, sample_family.COUNT
SIZES = (START, 53, 66, 79, END)
CANDIDATES, ASKED = 600, 150
SEEDS = (31, 32, 33, 34, 35, 36, 37, 38)
"""Seeds of the trials, for their first samples, noise and random order."""
SUGGESTED, CHANCE = "suggested", "at random"


@dataclass(frozen=True)
class Learning:
    """Mean global and root-relative distance to the truth, m.

    sizes: numbers of samples. trials: distances (trials, 2, S), suggested and at random.
    """

    sizes: tuple[int, ...]
    trials: dict[str, Floats]

    @cached_property
    def errors(self) -> dict[str, Floats]:
        """Return the mean over the trials (2, S), m."""
        return {way: own.mean(axis=0) for way, own in self.trials.items()}

    @cached_property
    def standard_errors(self) -> dict[str, Floats]:
        """Return the standard error of that mean (2, S), m."""
        shares = {way: own.std(axis=0, ddof=1) for way, own in self.trials.items()}
        return {way: own / np.sqrt(len(self.trials[way])) for way, own in shares.items()}

    @property
    def equivalent_samples(self) -> float:
        """Return the interpolated number of suggested samples with the error of all random ones."""
        own, aim = self.errors[SUGGESTED][0], self.errors[CHANCE][0, -1]
        below = int(np.argmax(own <= aim)) if np.any(own <= aim) else len(own)
        if below in (0, len(own)):
            return float(self.sizes[min(below, len(own) - 1)])
        before, after = own[below - 1], own[below]
        share = (before - aim) / (before - after)
        return float(np.interp(share, (0, 1), self.sizes[below - 1 : below + 1]))

    @property
    def speedup(self) -> float | None:
        """Return the random samples added per suggested sample for the same error.

        None if random samples do not reduce the error.
        """
        added = self.equivalent_samples - self.sizes[0]
        return (self.sizes[-1] - self.sizes[0]) / added if added > 0.0 else None

    def text(self) -> str:
        """Return the comparison in a sentence."""
        if self.speedup is None:
            return "Random samples do not reduce the error; there is nothing to compare with."
        return (
            f"Suggested samples reach at {self.equivalent_samples:.0f} the error of random ones at "
            f"{self.sizes[-1]}: {self.speedup:.1f} times as fast."
        )


def measure_curves(
    jobs: Jobs, report: ProgressCallback, sizes: Sequence[int] = SIZES, seeds: Sequence[int] = SEEDS
) -> Learning:
    """Measure the curves at some sizes, in ascending order, with a trial for each seed."""
    # Both curves of a trial start from the same samples, which are trained from once.
    steps = [(SUGGESTED, size) for size in sizes] + [(CHANCE, size) for size in sizes[1:]]
    parts = [(seed, way, size) for seed in seeds for way, size in steps]
    trials = {seed: _sample_orders(seed) for seed in seeds}
    each = [(part, trials[part[0]][part[1]][: part[2]]) for part in parts]
    found = dict(protocol.with_progress(jobs.run(_trained_error, each), len(each), report))
    for seed in seeds:
        found[seed, CHANCE, sizes[0]] = found[seed, SUGGESTED, sizes[0]]
    rows = {
        way: [np.array([found[seed, way, size] for size in sizes]).T for seed in seeds]
        for way in (SUGGESTED, CHANCE)
    }
    return Learning(tuple(sizes), {way: np.stack(own) for way, own in rows.items()})


def _sample_orders(seed: int) -> dict[str, list[SampleTrial]]:
    """Return the samples in the order of both ways; the first START are the same."""
    rng = np.random.Generator(np.random.PCG64(seed))
    known = list(sample_family.samples())
    first = [known[i] for i in sorted(rng.choice(len(known), START, replace=False).tolist())]
    # Disjoint from the points at which models are compared.
    candidates = ground_truth.truth_points(ground_truth.POINTS + CANDIDATES)[ground_truth.POINTS :]
    ways = {
        SUGGESTED: _rank_candidates(first, candidates),
        CHANCE: rng.permutation(len(candidates)),
    }
    added = {
        way: [candidates[i].tolist() for i in order[: END - START]] for way, order in ways.items()
    }
    return {
        way: [*first, *(noisy_sample(point, rng) for point in points)]
        for way, points in added.items()
    }


def _rank_candidates(first: Sequence[SampleTrial], candidates: Floats) -> Indices:
    """Return the candidates ranked highest given the first samples."""
    own = support.fit_support(np.array([_control_row(sample.controls) for sample in first]))
    ranked = acquisition.rank_candidates(own.scaled(candidates), own.samples, END - START)
    return np.array([at for at, _ in ranked])


def _control_row(own: SampleControls) -> list[float]:
    return [own.stature, own.hip_height, own.turn, own.target_height]


def noisy_sample(point: list[float], rng: np.random.Generator) -> SampleTrial:
    """Return a noisy sample at controls (4,); each stature is a performer of its own."""
    rounded = SampleControls(*(round(value, 4) for value in point))
    performer = f"of {rounded.stature} m"
    return SampleTrial(performer, rounded, sample_family.noisy_trial(rounded, rng))


def _trained_error(
    part: tuple[int, str, int], samples: Sequence[SampleTrial]
) -> tuple[tuple[int, str, int], tuple[float, float]]:
    """Return the part, and global and root-relative distance of its trained model, m."""
    with tempfile.TemporaryDirectory() as scratch:
        file = sample_files.write_family(Path(scratch) / "family", samples)
        own = recipe.read(file)
        examples, _ = ingest.ingest(own, file.parent)
    with single_thread.single_threaded():
        trained = train(own, examples, lambda _: None)
        points = ground_truth.truth_points(ASKED)
        found = methods.predict_posefield(own, trained, Queries(points, [{}] * len(points)))
        pairs = zip(found, ground_truth.truth_motions(points, None), strict=True)
        mean = motion_errors.mean(
            [motion_errors.compare_motions(made, true, ()) for made, true in pairs]
        )
    return part, (mean.absolute.mean, mean.relative.mean)


def facts(found: Learning) -> dict[str, object]:
    """Return the figures as JSON values."""
    return {
        "samples": list(found.sizes),
        "trials": len(found.trials[CHANCE]),
        **{
            way.replace(" ", "_"): {
                "global_cm": _centimetres(own[0]),
                "relative_cm": _centimetres(own[1]),
                "global_standard_error_cm": _centimetres(found.standard_errors[way][0]),
            }
            for way, own in found.errors.items()
        },
        "reached": round(found.equivalent_samples, 1),
        "faster": None if found.speedup is None else round(found.speedup, 2),
    }


def _centimetres(values: Floats) -> list[float]:
    return [round(100 * value, 3) for value in values.tolist()]


def table(found: Learning) -> str:
    """Return the curves as a table in Markdown, and a sentence."""
    rows = [
        (f"{way}, {name}", *(f"{100 * e:.2f} ± {100 * o:.2f}" for e, o in zip(*row, strict=True)))
        for way, own in found.errors.items()
        for name, *row in zip(("global", "relative"), own, found.standard_errors[way], strict=True)
    ]
    table = markdown_table.markdown_table(("samples", *map(str, found.sizes)), rows)
    return (
        f"{table}\n\nCentimetres from the "
        f"truth, mean of {len(found.trials[CHANCE])} trials and its standard error. {found.text()}"
    )
