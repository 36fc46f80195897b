"""Performances of trained models: joins, feet, paths, processor time, memory, and random scripts.

MODELS are the files of hdm05_grab_high, hdm05_deposit_floor, hdm05_kick, their returns, and
hdm05_hop; the walk is the shipped one.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import random_scripts
from performance_costs import (
    TARGETS,
    WALK,
    Figure,
    Find,
    Made,
    make,
    memory_rows,
    time_rows,
    whole,
)
from random_scripts import Cast, Document
from rows import Row, record, table

from posefield.common.units import Frames
from posefield.feet import foot_placement
from posefield.performance import composition
from posefield.performance.passage import RATE
from posefield.question.performance_report import PerformanceAnswer
from posefield.registry import model_registry
from posefield.synthesis.synthesizer import Synthesizer

ROOT = Path(__file__).resolve().parents[1]
BENDS = [[1.0, 4.0], [0.0, 8.0], [-1.0, 12.0], [0.0, 16.0], [0.0, 22.0]]
CURVE = [[0.0, 0.8], [7.0, 0.8], [10.0, 1.4], [16.0, 1.4], [18.0, 1.0]]
NEAR = (0.1, 0.6)
"""Times before and after a join in which feet that stand are looked at, s."""


def whole_rows(find: Find) -> list[Row]:
    """Return the figures of whole performances with several targets."""
    performances = [make(whole(target), find) for target in TARGETS]
    peaks = [
        max(join.peak for join in performance.answer.trust.joins) for performance in performances
    ]
    feet = [performance.answer.trust.feet for performance in performances]
    skates = [100.0 * performance.skate for performance in feet if performance is not None]
    before = 100.0 * float(
        np.mean([performance.skate_before for performance in feet if performance is not None])
    )
    slides, lowered = zip(*map(stood, performances), strict=True)
    distances = [1000.0 * _missed(*pair) for pair in zip(performances, TARGETS, strict=True)]
    note = f"{len(performances)} targets; mean of the worst joins {np.mean(peaks):.3g}"
    title = "walk, grab, hold, return, walk"
    worst = f"mean {np.mean(skates):.2g}; without placed feet {before:.2g}"
    return [
        Figure(f"{title}: largest peak at a join", max(peaks), "m/s²", note, None, 16.0, 8.0),
        Figure(f"{title}: feet skate, worst", max(skates), "cm/s", worst, None, 8.0, 2.0),
        _lowering(
            f"{title}: pelvis lowered", [value for performance in lowered for value in performance]
        ),
        _sliding(
            f"{title}: slide of standing feet at joins",
            [x for performance in slides for x in performance],
        ),
        Figure(
            f"{title}: hand from its target",
            max(distances),
            "mm",
            f"worst; mean {np.mean(distances):.2g}",
            None,
            1.0,
        ),
    ]


def _lowering(name: str, lowered: Sequence[float]) -> Row:
    mean, worst = float(np.mean(lowered)), max(lowered)
    return Figure(name, mean, "cm", f"mean; worst {worst:.2g}", None, 5.0, 2.0)


def _sliding(name: str, slides: Sequence[float]) -> Row:
    note = f"90th percentile of {len(slides)}; worst {max(slides):.2g}"
    sliding = round(float(np.percentile(slides, 90)), 3)
    return Figure(name, sliding, "cm", note, None, 1.0, 0.2)


def stood(performance: Made) -> tuple[list[float], Frames]:
    """Return how far each foot that stands at a join slides, and how low the pelvis is, cm."""
    timeline = performance.timeline
    plan, motion = composition.plan_feet(performance.script, timeline), timeline.performed
    times = np.arange(len(motion)) / RATE
    ((_, paths),) = foot_placement.foot_paths([plan])
    slides = []
    for join in timeline.joins:
        time = (join.frame - timeline.begin) / RATE
        near = (times >= time - NEAR[0]) & (times <= time + NEAR[1])
        for foot, steps in enumerate(plan.steps):
            for stance in steps.stances:
                if near[stance.start : stance.stop].any():
                    path = paths[stance.start : stance.stop, foot][:, [0, 2]]
                    slides.append(100.0 * float(np.linalg.norm(path - path[0], axis=-1).max()))
    return slides, 100.0 * np.abs(plan.lowered - plan.grounded)


def _missed(performance: Made, target: Sequence[float]) -> float:
    """Return how far the hand is from its target at the event in the clip, m."""
    clip, report = performance.answer.clip, performance.answer.trust
    hand = clip.skeleton.names.index("rhand")
    frame = round((report.segments[1].event or 0.0) * clip.rate)
    return float(np.linalg.norm(clip.positions()[frame, hand] - np.array(target)))


def walk_rows(find: Find) -> list[Row]:
    """Return how walks follow paths, and how feet skate in starts and stops."""
    ways = {
        "straight": {"to": [0.0, 20.0], "speed": 1.2},
        "with changes of speed": {"to": [0.0, 24.0], "speed": CURVE},
        "along bends": {"along": BENDS, "speed": 1.0},
        "turning": {"seconds": 12.0, "turn": 0.15, "speed": 1.1},
    }
    figures: dict[str, tuple[float, float, float]] = {}
    for name, direction in ways.items():
        performance = make(_walk(direction), find)
        path = performance.answer.trust.segments[0].path
        if path is not None:
            figures[name] = (100.0 * path.lateral, np.degrees(path.heading), 100.0 * path.speed)
    worst = {column: max(figures, key=lambda name: figures[name][column]) for column in range(3)}
    rows: list[Row] = [
        Figure(
            f"path following, means over cycles: {name}",
            figures[worst[column]][column],
            unit,
            f"worst of {len(figures)} walks: {worst[column]}",
            None,
            must,
            0.5,
        )
        for column, (name, unit, must) in enumerate(
            [("lateral", "cm", 2.5), ("heading", "°", 1.5), ("speed", "cm/s", 2.0)]
        )
    ]
    return [*rows, *_starts(find)]


def _walk(direction: Mapping[str, object]) -> Document:
    return {"fps": RATE, "segments": [{"kind": "walk", "model": WALK, **direction}]}


def _starts(find: Find) -> list[Row]:
    """Return how walks with standing ends skate, and how suddenly these move, over steady walks."""
    direction = {"to": [0.0, 12.0], "speed": 1.1}
    steady, both = (
        make(_walk(direction | end_points), find)
        for end_points in ({}, {"start": "standing", "stop": "standing"})
    )
    feet_result, typical = both.answer.trust.feet, steady.answer.trust.feet
    if feet_result is None or typical is None:
        raise ValueError("no feet, expected feet that stand")
    title, peaks = "starts and stops", [_end_peak(performance) for performance in (both, steady)]
    feet = [
        ("skate over steady walk", feet_result.skate_before, typical.skate_before),
        ("skate with placed feet over steady walk", feet_result.skate, typical.skate),
    ]
    return [
        *(
            Figure(
                f"{title}: {name}",
                first / second,
                "times",
                f"{100 * first:.2g} and {100 * second:.2g} cm/s",
                None,
                1.1,
            )
            for name, first, second in feet
        ),
        Figure(
            f"{title}: peak over steady walk",
            peaks[0] / peaks[1],
            "times",
            f"{peaks[0]:.2g} and {peaks[1]:.2g} m/s² in the first and last 1.5 s",
            None,
            1.1,
        ),
    ]


def _end_peak(performance: Made) -> float:
    """Return the largest acceleration in the first and last 1.5 s of a clip, m/s²."""
    clip = performance.answer.clip
    accelerations = random_scripts.accelerations(clip, clip.positions())
    end_points = round(1.5 * clip.rate)
    return float(max(accelerations[:end_points].max(), accelerations[-end_points:].max()))


def flag_rows(find: Find) -> list[Row]:
    """Return the share of joins of a squat and a stoop that no flag tells of."""
    heights = [(low, high) for low in (0.45, 0.5, 0.55) for high in (0.85, 0.9, 0.95)]
    pairs = [*heights, *(pair[::-1] for pair in heights)]
    joins = [make(_deposited(find, *pair), find).answer.trust.joins[0] for pair in pairs]
    unflagged = 100.0 * float(np.mean([not join.hard for join in joins]))
    note = f"of {len(joins)} joins of models"
    return [Figure("squat into stoop: joins not flagged", unflagged, "%", note, None, 0.0)]


def _deposited(find: Find, first: float, second: float) -> Document:
    """Return a deposit and a return at two heights of the root, and else typical controls."""
    acts = [("hdm05_deposit_floor", first), ("hdm05_deposit_return", second)]
    return {
        "fps": RATE,
        "segments": [
            {"kind": "act", "model": name, "controls": {**_typical(find(name)), "root_height": own}}
            for name, own in acts
        ],
    }


def _typical(model: Synthesizer) -> dict[str, float]:
    return {control.name: control.default for control in model.session.card.controls}


def random_rows(models: Mapping[str, Synthesizer], count: int) -> list[Row]:
    """Return how many random scripts have a fault."""
    cast = random_scripts.cast(models)
    faulty = refused = 0
    for number, document in enumerate(random_scripts.scripts(cast, count)):
        problems = random_scripts.check(document, cast.find)
        refused += bool(problems.refused)
        faulty += bool(problems.faults)
        for fault in problems.faults:
            print(f"script {number}: {fault}", file=sys.stderr)
    note = f"of {count}; {refused} refused with a pointer"
    return [Figure("random scripts with a fault", faulty, "scripts", note, None, 0.0)]


def documented_rows(models: Mapping[str, Synthesizer], count: int) -> list[Row]:
    """Return the hard joins and the warnings of the documented acts with their returns.

    As the negative control, returns take the typical controls of their models, and kicks have none.
    """
    cast = random_scripts.cast(models)
    documents = list(random_scripts.documented_scripts(cast, count))
    answers = [random_scripts.check(document, cast.find).answer for document in documents]
    spoiled = [random_scripts.check(_spoiled(own, cast), cast.find).answer for own in documents]
    joins, hard = _hard_joins(answers)
    others, others_hard = _hard_joins(spoiled)
    warnings = [len(answer.trust.script_warnings) for answer in answers if answer]
    title = "walks, acts and their returns"
    control = f"{others_hard} of {others} with typical controls and kicks without returns"
    return [
        Figure(f"{title}: hard joins", hard, "joins", f"of {joins}; {control}", None, 0.0),
        Figure(
            f"{title}: warnings a script",
            float(np.mean(warnings)),
            "",
            f"{len(warnings)} scripts; {count - len(warnings)} refused",
            None,
            0.3,
            0.1,
        ),
    ]


def _hard_joins(answers: Sequence[PerformanceAnswer | None]) -> tuple[int, int]:
    """Return the number of joins, and of hard ones."""
    joins = [join.hard for answer in answers if answer for join in answer.trust.joins]
    return len(joins), sum(joins)


def _spoiled(document: Document, cast: Cast) -> Document:
    """Return a script whose returns take typical controls, and whose kicks have none."""
    segments = []
    for segment in document["segments"]:
        model = segment.get("model", "")
        if model == random_scripts.RETURNS["hdm05_kick"]:
            continue
        is_return = model in random_scripts.RETURNS.values()
        typical = {"controls": _typical(cast.find(model))} if is_return else {}
        segments.append({**segment, **typical})
    return {**document, "segments": segments}


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", type=Path, nargs="+", help="model files")
    parser.add_argument("--scripts", type=int, default=1000, help="number of random scripts")
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--documented", type=int, default=200, help="number of documented scripts")
    options = parser.parse_args(arguments)
    models = {
        **model_registry.load([model_registry.SHIPPED_FOLDER / f"{WALK}.onnx"]).models,
        **model_registry.load(options.models).models,
    }
    find = models.__getitem__
    table_rows = [*whole_rows(find), *walk_rows(find), *flag_rows(find), *time_rows(find)]
    table_rows += [*memory_rows(), *documented_rows(models, options.documented)]
    table_rows += random_rows(models, options.scripts)
    print(table(table_rows))
    if options.record:
        command = f"python benchmarks/performances.py MODELS --scripts {options.scripts} --record"
        record({"performed": table_rows}, command, ROOT / "docs/results")


if __name__ == "__main__":
    main(sys.argv[1:])
