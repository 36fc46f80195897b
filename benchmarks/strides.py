"""Straight strides of the shipped walk by speed: as predicted, with standing feet, and captured.

python benchmarks/strides.py --data build/data

Clips, a walker of a crowd and performances are measured. The negative control puts the ball on the
floor at heel strike, lifts no heel, and lowers the pelvis, as before version 0.3.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any
from unittest import mock

import msgspec
import numpy as np
from evaluation import stride_quality
from evaluation.stride_quality import StrideQuality
from rows import Row, compact, origin

from posefield.common.units import Floats
from posefield.feet import ball_path, body_plans, footsteps
from posefield.feet.limbs import Limb
from posefield.locomotion import gait
from posefield.locomotion.locomotion_plan import Route
from posefield.motion.clip import Clip
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.motion_question import ClipQuestion, FeetMode
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.walk_question import WalkQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield.tracks import route_tracks, track_crowd
from posefield_train.source import ingest, recipe

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs/results"
RECIPE = ROOT / "model_export/posefield_train/recipes/cmu_walk.toml"
SPEEDS = tuple(round(0.1 * tenth, 1) for tenth in range(5, 19))
RATE, SECONDS, SETTLED = 60.0, 6.0, 60
"""Frames a second, seconds of longer motions, and frames left out at their ends."""
NEAR, STRAIGHT = 0.1, 12.0
"""Captured strides that are compared: difference of speed, m/s, and turn, degrees, at most."""
GOALS = {
    "pelvis range over predicted at 0.6 m/s": ("times", 1.2),
    "pelvis range over predicted, mean": ("times", 1.15),
    "pelvis lowered, mean": ("cm", 0.4),
    "knee at its straightest, short of 180 degrees, mean": ("degrees", 5.0),
    "sole below the floor, worst": ("cm", 0.5),
    "peak of one leg over predicted, worst": ("times", 1.3),
    "skate over captured, mean": ("times", 0.5),
}


def walk_model() -> Synthesizer:
    """Return the shipped walk."""
    return model_registry.load([model_registry.SHIPPED_FOLDER]).find("cmu_walk")


def legs_of(model: Synthesizer) -> tuple[Limb, ...]:
    """Return the legs of a model."""
    body = model.session.card
    skeleton = body.skeleton
    return footsteps.choose_limbs(skeleton.parents, skeleton.offsets, body.feet, ())[0].legs


def clip(model: Synthesizer, speed: float, feet: FeetMode) -> Clip:
    """Return a straight stride."""
    controls = {"speed": speed, "turn": 0.0}
    question = ClipQuestion(controls=controls, extrapolate="ok", fps=RATE, feet=feet)
    return clips.synthesize_clip(model, question).clip


def performance(model: Synthesizer, speed: float, feet: FeetMode) -> Clip:
    """Return a straight walk of a performance, without its ends."""
    walk = {"kind": "walk", "model": "cmu_walk", "seconds": SECONDS, "speed": speed, "turn": 0.0}
    content = msgspec.json.encode({"segments": [walk], "fps": RATE, "feet": feet})
    question = json_decoding.decode_question(PerformanceQuestion, content)
    script = resolve_script(question, lambda name: model)
    return composition.perform(script, 10_000).clip.part(slice(SETTLED, -SETTLED))


def walker(model: Synthesizer, speed: float, feet: FeetMode) -> Clip:
    """Return a walker of a crowd on a straight route, without its ends."""
    route = Route(np.array([[0.0, 0.0], [0.0, SECONDS * speed + 3.0]]), speed)
    # This seed draws a performer of middle size.
    order = WalkQuestion(count=1, seconds=SECONDS, fps=RATE, seed=3, feet=feet)
    fitted = gait.fit_gait(model.session)
    tracks = route_tracks.tracks_of_routes(fitted, [route], SECONDS)
    (batch,) = track_crowd.build_crowd(model, fitted, order, tracks).batches
    whole = Clip(
        model.session.card.skeleton,
        batch.rotations[0].astype(float),
        _translations(batch.bone_offsets[0], batch.root_position[0]),
        RATE,
    )
    return whole.part(slice(SETTLED, -SETTLED))


def _translations(bones: Floats, roots: Floats) -> Floats:
    translations = np.repeat(bones[None].astype(float), len(roots), axis=0)
    translations[:, 0] = roots
    return translations


MOTIONS: dict[str, Callable[[Synthesizer, float, FeetMode], Clip]] = {
    "clip": clip,
    "crowd": walker,
    "performance": performance,
}


@contextmanager
def balls_down() -> Iterator[None]:
    """Plan stances as before: balls on the floor at heel strike, and no lifted heels."""
    flat = mock.patch.object(
        ball_path,
        "flat_pitches",
        lambda vectors, contacts, rows: np.full(len(rows.counts), np.pi / 2),
    )
    still = mock.patch.object(ball_path, "trimmed", lambda stances, feet: stances)
    with (
        flat,
        still,
        mock.patch.multiple(ball_path, MOST_LIFT=0.0),
        mock.patch.multiple(body_plans, MOST=0.05),
    ):
        yield


def measures(model: Synthesizer, speed: float) -> dict[str, StrideQuality]:
    """Return the measures of predicted and standing motions of a speed, and the control's."""
    legs = legs_of(model)
    found = {}
    for name, make in MOTIONS.items():
        # Paths end just below the fastest captured stride.
        own = speed if name == "clip" else min(speed, 1.79)
        for mode, feet in (("predicted", "as_predicted"), ("standing", "stand")):
            found[f"{name} {mode}"] = stride_quality.measure(make(model, own, feet), legs)
    with balls_down():
        found["control"] = stride_quality.measure(clip(model, speed, "stand"), legs)
    return found


def captured(data: Path, legs: tuple[Limb, ...]) -> list[tuple[float, StrideQuality]]:
    """Return speeds and measures of the captured strides that are nearly straight."""
    examples, _ = ingest.ingest(recipe.read(RECIPE), data)
    found = []
    for own in examples:
        if abs(float(own.controls[1])) <= STRAIGHT:
            whole = own.captured or own.clip
            step = round(whole.rate / RATE)
            each = replace(whole.part(slice(None, None, step)), rate=whole.rate / step)
            found.append((float(own.controls[0]), stride_quality.measure(each, legs)))
    return found


def rows(tables: list[dict[str, Any]]) -> list[Row]:
    """Return the figures of all speeds with their goals, and the negative control's."""
    found = []
    for name in MOTIONS:
        values = _figures(tables, f"{name} predicted", f"{name} standing")
        control = _figures(tables, "clip predicted", "control")
        for figure, (unit, goal) in GOALS.items():
            told = f"{control[figure]:.3g} with balls down at heel strike" if name == "clip" else ""
            found.append(Row(f"{name}: {figure}", values[figure], unit, told, None, goal))
    return found


def _figures(tables: list[dict[str, Any]], before: str, after: str) -> dict[str, float]:
    ranges = [one[after]["range"] / one[before]["range"] for one in tables]
    skates = [one[after]["skate"] / one["captured"]["skate"] for one in tables]
    values = (
        next(ratio for ratio, one in zip(ranges, tables, strict=True) if one["speed"] == 0.6),
        float(np.mean(ranges)),
        float(np.mean([one[before]["height"] - one[after]["height"] for one in tables])),
        180.0 - float(np.mean([one[after]["knee"] for one in tables])),
        max(one[after]["sole"] for one in tables),
        max(one[after]["peak"] / one[before]["peak"] for one in tables),
        float(np.mean(skates)),
    )
    return dict(zip(GOALS, values, strict=True))


def main() -> None:
    """Measure, print and record the strides of all speeds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=ROOT / "build/data")
    model = walk_model()
    examples = captured(parser.parse_args().data, legs_of(model))
    tables = []
    for speed in SPEEDS:
        near = sorted(examples, key=lambda own: abs(own[0] - speed))
        near = [own for own in near if abs(own[0] - speed) <= NEAR] or near[:1]
        truth = stride_quality.mean([own for _, own in near])
        both = {**measures(model, speed), "captured": truth}
        rounded = {
            name: {key: float(f"{value:.4g}") for key, value in asdict(own).items()}
            for name, own in both.items()
        }
        tables.append({"speed": speed, "strides": len(near), **rounded})
    figures = [{**asdict(row), "met": row.met} for row in rows(tables)]
    recorded = {**origin("python benchmarks/strides.py"), "rows": figures, "speeds": tables}
    (RESULTS / "strides.json").write_text(compact(recorded) + "\n", encoding="utf-8")
    for row in figures:
        print(
            f"{row['name']}: {row['value']:.3g} {row['unit']} ({row['goal']:g}) {row['baseline']}"
        )


if __name__ == "__main__":
    main()
