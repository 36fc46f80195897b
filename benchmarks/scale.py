"""Scale of training: time, memory, file and errors of procedural families of 92 to 2,000 clips.

make bench-scale, or python benchmarks/scale.py [--clips 92 300] [--record]

Each family is trained in a process of its own. Finished families are kept in build/scale, so that a
run that was stopped goes on; remove the folder to measure anew.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
from evaluation import ground_truth
from rows import Row, record, table

import posefield_train
from posefield.common.units import Floats
from posefield_train.evaluate import motion_errors, predictions
from posefield_train.evaluate.motion_errors import ComparedMotion
from posefield_train.evaluate.predictions import Queries
from posefield_train.graph import onnx_export
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.jobs import single_threaded
from posefield_train.kriging.kriging_bank import VARIANCE
from posefield_train.sample import sample_files
from posefield_train.sample.sample_controls import parse_controls
from posefield_train.source import recipe

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "build/scale"
CLIPS = (92, 300, 1_000, 2_000)
ASKED, SEED = 200, 7
"""Points at which models are compared with the truth, and the seed of new clips there."""
GOALS = {92: ("cpu_s", 15.0), 1_000: ("cpu_s", 600.0), 2_000: ("cpu_s", 1_200.0)}
USED = 2_000
"""Clips of the model that is exported from and explained, too."""
PICTURE = ROOT / "docs/scale.png"


def measure(clips: int) -> dict[str, Any]:
    """Return the figures of a family of some clips: this process trains it and nothing else."""
    folder = FOLDER / f"reaching_{clips}"
    file = sample_files.write_family(folder, sample_files.samples(clips))
    before, start = _cpu(), time.perf_counter()
    family_recipe = recipe.read(file)
    trained = posefield_train.train(family_recipe, file.parent)
    exported = onnx_export.export_model(trained)
    spent, wall = _cpu() - before, time.perf_counter() - start
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    used = use(exported.content) if clips == USED else {}
    with single_threaded():
        compared = compare(family_recipe, trained)
    return {
        "clips": clips,
        "listed": exported.card.samples,
        "cpu_s": round(spent, 1),
        "wall_s": round(wall, 1),
        "memory_mb": round(memory / 1e6),
        "file_kb": round(len(exported.content) / 1e3, 1),
        "left_out_cm": round(100 * exported.card.diagnostics["leave_one_out_rms_m"], 3),
        **compared,
        "disagreement": exported.card.diagnostics.get("projected", {}).get("disagreement"),
        "used": used,
    }


def use(content: bytes) -> dict[str, float]:
    """Return the processor time, s, of what people do with a model, each command's in all.

    content: of its file. RuntimeError for a command that fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder, "reaching.onnx")
        model.write_bytes(content)
        commands: dict[str, tuple[object, ...]] = {
            "100 clips exported": ("export", model, "--sample", "100", "-o", Path(folder, "made")),
            "a motion explained": ("why", model, "-c", "turn=20"),
        }
        return {name: _children_seconds(words) for name, words in commands.items()}


def _children_seconds(words: Sequence[object]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [Path(sys.executable).with_name("posefield"), *words]
    done = subprocess.run([*map(str, command)], check=False, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{words[0]} ended with {done.returncode}: {done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1)


def compare(family_recipe: recipe.Recipe, trained: TrainedModel) -> dict[str, float]:
    """Return distances to the truth, cm, and the error of new clips over their sigma.

    truth_cm: over the whole range of the controls. among_cm: at control points among the clips, of
    the three performers, standing and sitting. Distances are of joints after time warping, with the
    root's position; new clips have the noise of the family, and errors and sigma are root mean
    squares.
    """
    points = ground_truth.truth_points(ASKED)
    motions = _answers(family_recipe, trained, points)
    rng = np.random.Generator(np.random.PCG64(SEED))
    clips = [sample_files.noisy_trial(parse_controls(list(point)), rng) for point in points]
    captured = [motion_errors.motion_of_clip(clip, None) for clip in clips]
    squares = [
        motion_errors.compare_motions(motion, one, ()).mean_squared_error
        for motion, one in zip(motions, captured, strict=True)
    ]
    bank = trained.model.bank
    positions = bank.points(points, np.zeros((len(points), bank.label_count)))
    sigma = bank.sigma(bank.numpy(positions)[VARIANCE])
    among = np.array([astuple(controls) for _, controls in sample_files.design(ASKED)])
    return {
        "truth_cm": _distance(motions, points),
        "among_cm": _distance(_answers(family_recipe, trained, among), among),
        "sigma_ratio": round(float(np.sqrt(np.mean(squares) / np.mean(np.square(sigma)))), 3),
    }


def _answers(
    family_recipe: recipe.Recipe, trained: TrainedModel, points: Floats
) -> list[ComparedMotion]:
    return predictions.predict_posefield(trained, Queries(points, [{}] * len(points)))


def _distance(motions: Sequence[ComparedMotion], points: Floats) -> float:
    """Return the mean distance, cm, of motions from the noise-free ones at control points."""
    truths = ground_truth.truth_motions(points, None)
    pairs = zip(motions, truths, strict=True)
    errors = [motion_errors.compare_motions(motion, true, ()) for motion, true in pairs]
    return round(100 * motion_errors.mean(errors).absolute.mean, 3)


def _cpu() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def curve(counts: Sequence[int]) -> list[dict[str, Any]]:
    """Return the figures of families, those that are not kept measured in processes."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    measurements = []
    for clips in counts:
        path = FOLDER / f"{clips}.json"
        if not path.exists():
            words = [sys.executable, __file__, "--one", str(clips)]
            output = subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout
            path.write_text(output, encoding="utf-8")
        measurements.append(json.loads(path.read_text(encoding="utf-8")))
    return measurements


def rows(measurements: Sequence[dict[str, Any]]) -> list[Row]:
    """Return the rows of the documentation's table."""
    first = measurements[0]
    return [row for measurement in measurements for row in _rows(measurement, first)]


def _rows(measurement: dict[str, Any], first: dict[str, Any]) -> list[Row]:
    clips = measurement["clips"]
    name = f"{clips:,} clips"
    goal = GOALS.get(clips, (None, None))[1]
    listed = "all" if measurement["listed"] == clips else f"{measurement['listed']} inducing"
    twice = measurement["disagreement"]
    note = "" if twice is None else f"; two tunings {100 * twice:.1f} % apart"
    large, largest = clips >= 300, clips == 2_000
    return [
        Row(f"{name}: processor time", measurement["cpu_s"], "s", f"{listed}{note}", None, goal),
        Row(
            f"{name}: peak memory",
            measurement["memory_mb"],
            "MB",
            "",
            None,
            2_000.0 if largest else None,
        ),
        Row(f"{name}: file", measurement["file_kb"], "kB", "", None, 350.0 if large else None),
        Row(
            f"{name}: distance to the truth",
            measurement["truth_cm"],
            "cm",
            f"{first['truth_cm']} cm of {first['clips']} clips",
            None,
            0.5 if largest else None,
        ),
        Row(f"{name}: the same among the clips", measurement["among_cm"], "cm", "", None, None),
        Row(
            f"{name}: error of new clips over sigma",
            measurement["sigma_ratio"],
            "",
            "at least 0.6" if largest else "",
            None,
            1.4 if largest else None,
        ),
        *(
            Row(f"{name}: {done}", seconds, "s", "processor time of the command", None, None)
            for done, seconds in measurement["used"].items()
        ),
    ]


def draw(measurements: Sequence[dict[str, Any]], path: Path) -> None:
    """Draw processor time, memory, file and distance to the truth over the number of clips."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    panels = (
        ("cpu_s", "processor time, s"),
        ("memory_mb", "peak memory, MB"),
        ("file_kb", "file, kB"),
        ("truth_cm", "distance to the truth, cm"),
    )
    figure, axes = pyplot.subplots(1, len(panels), figsize=(11.0, 2.6), layout="constrained")
    clips = [measurement["clips"] for measurement in measurements]
    for ax, (key, title) in zip(axes, panels, strict=True):
        ax.plot(clips, [measurement[key] for measurement in measurements], "o-", color="#2d64c8")
        ax.set(xlabel="clips", title=title, ylim=(0.0, None), xscale="log")
        ax.set_xticks(clips, [f"{measurement:,}" for measurement in clips])
        ax.minorticks_off()
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=90, metadata={"Software": None})


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clips", type=int, nargs="+", default=CLIPS)
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.one:
        print(json.dumps(measure(options.one)))
        return
    measurements = curve(options.clips)
    print(table(rows(measurements)))
    if options.record:
        record({"scaled": rows(measurements)}, "make bench-scale", ROOT / "docs/results")
        draw(measurements, PICTURE)


if __name__ == "__main__":
    main(sys.argv[1:])
