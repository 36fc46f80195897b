"""One pose of each of many characters: how long it takes, and what a coarser level saves."""

import os
from collections.abc import Callable

import crowd_scene
import numpy as np
from crowd_scene import AUTO, SEEN, Scene
from rows import Row
from timing import in_turn

from posefield.inference.onnx_runtime import OUTPUTS
from posefield.synthesis import crowd_synthesis
from posefield.synthesis.synthesizer import Synthesizer

BATCH = crowd_synthesis.MOST_ROWS

MANY = 10_000
SIZES = (1, 10, 100, 1_000, MANY, 100_000)
FRAME, HALF_FRAME = 16.7, 8.3
"""ms: of a frame at 60 a second, the goal, and at 120, the wish."""
RATIO = 2.0
PAPER = (510.0, 190.0)
"""ms of the paper's crowd, with every character at the finest level and with levels mixed."""


def rows(model: Synthesizer) -> list[Row]:
    """10,000 characters, the scaling, and the coarsest level against the finest."""
    timings = {count: _taken(crowd_scene.around(model, count)) for count in SIZES}
    scene = crowd_scene.around(model, MANY)
    return [
        *_many_rows(scene, timings[MANY]),
        *(_size_row(count, timings[count]) for count in SIZES),
        *_ratio_rows(scene, timings[MANY]),
    ]


def _taken(scene: Scene) -> dict[str, float]:
    """Median seconds of a crowd at levels by view, at the finest and at the coarsest."""
    runs = {
        "auto": scene.poses(AUTO),
        "finest": scene.poses(scene.all_at(0)),
        "coarsest": scene.poses(scene.all_at(scene.coarsest)),
    }
    return in_turn(runs, rounds=15, repeats=max(1, 2_000 // len(scene)))


def _many_rows(scene: Scene, timings: dict[str, float]) -> list[Row]:
    levels = scene.poses(AUTO)().levels
    words = f"{SEEN}; {crowd_scene.mix(levels, scene.coarsest + 1)}"
    name = f"crowd of {MANY:,}, a pose each, {os.cpu_count()} threads"
    return [
        Row(f"{name}, levels by view", 1e3 * timings["auto"], "ms", words, None, FRAME),
        Row(f"{name}, the same", 1e3 * timings["auto"], "ms", "the wish", None, HALF_FRAME),
        Row(f"{name}, all at the finest", 1e3 * timings["finest"], "ms", "", None, FRAME),
        Row(f"{name}, all at the coarsest", 1e3 * timings["coarsest"], "ms", "", None, FRAME),
    ]


def _size_row(count: int, timings: dict[str, float]) -> Row:
    times = {name: f"{1e3 * seconds:.3g} ms" for name, seconds in timings.items()}
    microseconds = {name: f"{1e6 * seconds / count:.3g} µs" for name, seconds in timings.items()}
    words = "; ".join(f"{name} {times[name]}, {microseconds[name]} a pose" for name in timings)
    return Row(
        f"crowd of {count:,}, levels by view", 1e3 * timings["auto"], "ms", words, None, None
    )


def _ratio_rows(scene: Scene, timings: dict[str, float]) -> list[Row]:
    alone = in_turn(
        {"finest": _graph(scene, 0), "coarsest": _graph(scene, scene.coarsest)},
        rounds=31,
        repeats=20,
    )
    fine, mixed = PAPER
    return [
        _ratio_row(f"graph alone, {BATCH} poses a call, one thread", alone, BATCH),
        _ratio_row(f"whole call, {MANY:,} characters", timings, MANY),
        Row(
            "the paper's crowd with levels of detail",
            mixed,
            "ms",
            f"the same without: {fine:g} ms",
            fine / mixed,
            None,
        ),
    ]


def _ratio_row(name: str, timings: dict[str, float], poses: int) -> Row:
    microseconds = {level: 1e6 * seconds / poses for level, seconds in timings.items()}
    words = f"the finest: {microseconds['finest']:.3g} µs"
    ratio = microseconds["finest"] / microseconds["coarsest"]
    return Row(
        f"coarsest level, a pose: {name}", microseconds["coarsest"], "µs", words, ratio, RATIO
    )


def _graph(scene: Scene, level: int) -> Callable[[], object]:
    controls = scene.controls[:BATCH].astype(np.float32)
    times = scene.times[:BATCH, None].astype(np.float32)
    return lambda: scene.model.session.run(controls, times, *OUTPUTS, level=level)
