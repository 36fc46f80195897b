"""Takes of equal controls beside captured repeats: how far two of them differ, and their durations.

OMP_NUM_THREADS=1 .venv/bin/python benchmarks/take_repeats.py DATA RECIPE... --record

Repeats are clips of one performer in two recordings, with nearly equal controls. The takes are
those of the service at the controls of the first of them, of models that were trained without its
recording. Distances are root mean squares over joints, relative to the root, after time warping.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from evaluation import finest_file
from rows import Row, record, table

from posefield.common.units import Indices
from posefield.inference import session
from posefield.motion.clip import Clip
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train import training
from posefield_train.evaluate import motion_errors
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_points

ROOT = Path(__file__).parents[1]
FOLDS, FEWEST, MOST, LAG = 4, 10, 40, 0.12
"""Folds; pairs of a family; and distance of their controls in half-ranges, unless too few have."""
VARIETIES = (0.7, 1.0)


@dataclass(frozen=True)
class Differences:
    """Distance of two motions, m, and difference of the logarithms of their durations."""

    distance: float
    duration: float


def repeats(trained: TrainedModel) -> tuple[Indices, Indices]:
    """Return the pairs of clips (K,), (K,) of one performer that are repeats."""
    samples, recordings = trained.samples, sample_points.recording_numbers(trained.examples)
    labels = np.array(samples.label_indices).reshape(-1, len(recordings))
    first, second = np.triu_indices(len(recordings), 1)
    alike = (labels[:, first] == labels[:, second]).all(axis=0)
    alike &= recordings[first] != recordings[second]
    first, second = first[alike], second[alike]
    points = samples.points[:, : samples.controls]
    lags = np.sqrt(np.square(points[first] - points[second]).mean(axis=1))
    count = int(np.clip((lags < LAG).sum(), FEWEST, MOST))
    nearest = np.argsort(lags, kind="stable")[:count]
    return first[nearest], second[nearest]


def differences(clip: Clip, other: Clip) -> Differences:
    """Return the differences of two motions."""
    motions = [motion_errors.motion_of_clip(motion, None) for motion in (clip, other)]
    errors = motion_errors.compare_motions(*motions, ())
    return Differences(errors.relative.rms, abs(float(np.log(clip.duration / other.duration))))


def models(trained: TrainedModel) -> Iterator[tuple[set[int], Synthesizer]]:
    """Yield the clips of each fold of recordings with a model that was trained without them."""
    recordings = sample_points.recording_numbers(trained.examples)
    for fold in range(FOLDS):
        held_out = set(np.flatnonzero(recordings % FOLDS == fold).tolist())
        kept = [example for clip, example in enumerate(trained.examples) if clip not in held_out]
        content = finest_file.export_finest(training.train_examples(trained.recipe, kept))
        yield held_out, Synthesizer("takes", session.open_bytes(content, "takes"))


def take(model: Synthesizer, trained: TrainedModel, clip: int, seed: int, variety: float) -> Clip:
    """Return a take of the service at the controls and labels of a captured clip."""
    card = model.session.card
    controls = zip(card.controls, trained.examples[clip].controls, strict=True)
    names = zip(trained.model.bank.labels.items(), trained.samples.label_indices, strict=True)
    labels = {label_set: labels[indices[clip]] for (label_set, labels), indices in names}
    known = {label_set.name: label_set.names for label_set in card.labels}
    question = ClipQuestion(
        controls={control.name: float(value) for control, value in controls},
        labels={name: label for name, label in labels.items() if label in known.get(name, ())},
        extrapolate="ok",
        take=seed,
        variety=variety,
        fps=60.0,
    )
    return clips.synthesize_clip(model, question).clip


def family_rows(trained: TrainedModel) -> list[Row]:
    """Return the rows of a family."""
    first, second = repeats(trained)
    examples = trained.examples
    real = [
        differences(examples[a].clip, examples[b].clip)
        for a, b in zip(first.tolist(), second.tolist(), strict=True)
    ]
    takes: dict[float, list[Differences]] = {variety: [] for variety in VARIETIES}
    for held_out, model in models(trained):
        for pair, clip in enumerate(first.tolist()):
            for variety in VARIETIES if clip in held_out else ():
                seeds = 1 + 2 * pair, 2 + 2 * pair
                two = (take(model, trained, clip, seed, variety) for seed in seeds)
                takes[variety].append(differences(*two))
    name, captured = trained.recipe.name, _means(real)
    rows = []
    for variety, made in takes.items():
        distance, duration = _means(made)
        words = f"{len(real)} repeats: {captured[0]:.1f} cm"
        title = f"{name}, variety {variety:g}: distance of two takes"
        rows.append(Row(title, distance, "cm", words, distance / captured[0], None))
        title, words = f"{name}, variety {variety:g}: durations", f"repeats: {captured[1]:.1f} %"
        rows.append(Row(title, duration, "%", words, None, None))
    return rows


def _means(pairs: Sequence[Differences]) -> tuple[float, float]:
    """Return the mean distance, cm, and the mean difference of durations, %."""
    distances, durations = zip(*(vars(pair).values() for pair in pairs), strict=True)
    return 100.0 * float(np.mean(distances)), 100.0 * float(np.mean(durations))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("recipes", type=Path, nargs="+")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args()
    rows = []
    for recipe in options.recipes:
        rows += family_rows(training.train(training.read_recipe(recipe), options.data))
        print(table(rows[-2 * len(VARIETIES) :]), flush=True)
    if options.record:
        record({"take_repeats": rows}, "python benchmarks/take_repeats.py", ROOT / "docs/results")
