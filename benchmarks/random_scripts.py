"""Random scripts of performances that are valid by the schema, and checks of their answers."""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np

from posefield.common.errors import QueryError
from posefield.common.units import Booleans, Frames, Positions
from posefield.locomotion import gait
from posefield.motion.clip import Clip
from posefield.performance import composition
from posefield.performance.script import Script, resolve_script
from posefield.question import json_decoding
from posefield.question.performance_question import Act, PerformanceQuestion
from posefield.question.performance_report import PerformanceAnswer
from posefield.synthesis.synthesizer import Synthesizer

FPS = 60.0
MOST_FRAMES = 100_000
MOST_PEAK = 3.0
"""A frame jumps if its acceleration exceeds the usual one by this factor."""
FAST = "of captured clips of the model"
"""Words of the warning about an act that is faster than captured clips."""
CAPTURED_PEAK = 16.0
"""Largest mean acceleration of captured walking, m/s². Away from joins, a frame with no larger one
does not jump: feet of slow walkers land as suddenly as those of fast ones."""
BEFORE, AFTER = 0.1, 0.6
"""Times before and after a join that belong to it, s."""
DEEPEST = 0.0105
"""Largest depth of a foot below the floor, m: a sole may sink by 5 mm, and a stance by 5 mm."""

LED = 0.3
"""Time before and after a target for which a foot is led, s."""

Document = dict[str, Any]


@dataclass(frozen=True)
class Cast:
    """Models that scripts are drawn from. walks: with their slowest and fastest speeds, m/s."""

    walks: Mapping[str, tuple[float, float]]
    acts: Mapping[str, Synthesizer]
    models: Mapping[str, Synthesizer]

    def find(self, name: str) -> Synthesizer:
        """Return the model of a name."""
        return self.models[name]


def cast(models: Mapping[str, Synthesizer]) -> Cast:
    """Return models as the cast of random scripts."""
    walks, acts = {}, {}
    for name, model in models.items():
        if model.session.card.cyclic:
            walks[name] = gait.fit_gait(model.session).region.speeds
        else:
            acts[name] = model
    return Cast(walks, acts, models)


def scripts(cast: Cast, count: int, seed: int = 0) -> Iterator[Document]:
    """Yield random scripts as JSON values."""
    for number in range(count):
        yield draw(cast, np.random.Generator(np.random.PCG64([seed, number])))


def draw(cast: Cast, rng: np.random.Generator) -> Document:
    """Return a random script of one to six segments."""
    here, segments = [0.0, 0.0], []
    for _ in range(int(rng.integers(1, 7))):
        if cast.acts and rng.random() < 0.1:
            segments += _lead(cast, rng, here)
            continue
        kinds = ["walk"] * 3 + ["act"] * (3 if cast.acts else 0) + (["hold"] if segments else [])
        kind = str(rng.choice(kinds))
        make_segment = {"walk": _walk, "act": _act, "hold": _hold}[kind]
        segments.append(make_segment(cast, rng, here))
    script: Document = {"segments": segments, "fps": FPS}
    if rng.random() < 0.3:
        position = [_round(value) for value in rng.uniform(-3.0, 3.0, 2)]
        script["start"] = {"position": position, "heading": _round(rng.uniform(-1.2, 1.2))}
    if rng.random() < 0.3:
        script |= {"take": int(rng.integers(0, 1000)), "detail": bool(rng.random() < 0.5)}
    if rng.random() < 0.2:
        script["feet"] = "as_predicted"
    if rng.random() < 0.2:
        script["extrapolate"] = "refuse"
    return script


RETURNS = {
    "hdm05_grab_high": "hdm05_grab_return",
    "hdm05_deposit_floor": "hdm05_deposit_return",
    "hdm05_kick": "hdm05_kick_return",
    "hdm05_hop": None,
}
"""Documented acts and their returns; a hop goes on into a walk."""


def documented_scripts(cast: Cast, count: int, seed: int = 0) -> Iterator[Document]:
    """Yield scripts of walks and one or two of the documented acts, with their returns.

    Controls and heights of targets are within the captured ranges.
    """
    for number in range(count):
        rng, here = np.random.Generator(np.random.PCG64([seed, number])), [0.0, 0.0]
        acts = rng.choice(list(RETURNS), int(rng.integers(1, 3)))
        segments = [segment for name in acts for segment in _visit(cast, rng, here, str(name))]
        yield {"segments": [*segments, _stroll(cast, rng)], "fps": FPS}


def _visit(cast: Cast, rng: np.random.Generator, here: list[float], name: str) -> list[Document]:
    """Return a walk, an act, for some a hold, and the return if the act has one."""
    walk, act = _stroll(cast, rng), {"kind": "act", "model": name}
    ranges = [(own.name, own.minimum, own.maximum) for own in cast.find(name).session.card.controls]
    controls = {control: _round(rng.uniform(low, high)) for control, low, high in ranges}
    hold = {"kind": "hold", "seconds": _round(rng.uniform(0.3, 1.5))}
    given, held = rng.random() < 0.5, rng.random() < 0.5
    if "target_height" in controls:
        place = _ahead(rng, here)
        position = [place[0], controls["target_height"], place[1]]
        act["targets"] = [{"joint": "rhand", "position": position, "at": "event"}]
        del walk["seconds"]
    elif given:
        act["controls"] = controls
    here[1] += walk["speed"] * walk.get("seconds", 0.0)
    holds = [hold] if held and "targets" in act else []
    after = RETURNS[name]
    return [walk, act, *holds, *([{"kind": "act", "model": after}] if after else [])]


def _stroll(cast: Cast, rng: np.random.Generator) -> Document:
    speed, seconds = _round(rng.uniform(0.8, 1.5)), _round(rng.uniform(2.0, 4.0))
    (name,) = cast.walks
    return {"kind": "walk", "model": name, "speed": speed, "seconds": seconds}


def _walk(cast: Cast, rng: np.random.Generator, here: list[float]) -> Document:
    name = str(rng.choice(list(cast.walks)))
    low, high = cast.walks[name]
    speeds = rng.uniform(low, min(high, 1.8), 3)
    segment: Document = {"kind": "walk", "model": name}
    if rng.random() < 0.7:
        segment["speed"] = _round(speeds[0])
    elif rng.random() < 0.5:
        pairs = zip((0.0, 2.0, 5.0), speeds, strict=True)
        segment["speed"] = [[distance, _round(speed)] for distance, speed in pairs]
        segment["speed_over"] = str(rng.choice(["distance", "time"]))
    path_kind = str(rng.choice(["seconds", "seconds", "seconds", "to", "along"]))
    if path_kind == "seconds":
        segment["seconds"] = _round(rng.uniform(0.3, 6.0))
        if rng.random() < 0.5:
            segment["turn"] = _round(rng.uniform(-0.4, 0.4))
    elif path_kind == "to":
        segment["to"] = _ahead(rng, here)
    elif path_kind == "along":
        segment["along"] = [_ahead(rng, here) for _ in range(int(rng.integers(1, 4)))]
    for end in ("start", "stop"):
        if rng.random() < 0.25:
            segment[end] = "standing"
    return segment | _joined(rng)


def _lead(cast: Cast, rng: np.random.Generator, here: list[float]) -> list[Document]:
    """Return a walk without an end of its own, and the act that it leads to."""
    segment = {"kind": "walk", "model": str(rng.choice(list(cast.walks)))}
    act = _act(cast, rng, here)
    if "at" not in act:
        targets = act.get("targets", [])
        if not targets or targets[0]["frame"] != "world":
            act |= {"at": _ahead(rng, here), "targets": []}
    return [segment, act]


def _ahead(rng: np.random.Generator, here: list[float]) -> list[float]:
    here[0] += float(rng.normal(0.0, 0.7))
    here[1] += float(rng.uniform(2.0, 8.0))
    return [_round(value) for value in here]


def _act(cast: Cast, rng: np.random.Generator, here: list[float]) -> Document:
    name = str(rng.choice(list(cast.acts)))
    card = cast.acts[name].session.card
    segment: Document = {"kind": "act", "model": name}
    if rng.random() < 0.5:
        segment["controls"] = {
            control.name: _round(rng.uniform(control.minimum, control.maximum))
            for control in card.controls
            if rng.random() < 0.7
        }
    if card.performers and rng.random() < 0.3:
        segment["performer"] = str(rng.choice(card.performers))
    if rng.random() < 0.5 and card.event is not None:
        segment["targets"] = [_target(cast.acts[name], rng, here)]
    if rng.random() < 0.3:
        segment["at"] = _ahead(rng, here)
        segment["facing"] = _round(rng.uniform(-3.2, 3.2))
    return segment | _joined(rng)


def _target(model: Synthesizer, rng: np.random.Generator, here: list[float]) -> Document:
    card = model.session.card
    frame = str(rng.choice(["world", "segment"]))
    height = [control for control in card.controls if "height" in control.name]
    low, high = (height[0].minimum, height[0].maximum) if height else (0.2, 1.5)
    x, z = _ahead(rng, list(here)) if frame == "world" else rng.uniform(-0.3, 0.8, 2)
    joint = card.skeleton.names[card.event.joint] if card.event else card.skeleton.names[-1]
    position = [_round(x), _round(rng.uniform(low, high)), _round(z)]
    return {"joint": joint, "position": position, "at": "event", "frame": frame}


def _hold(cast: Cast, rng: np.random.Generator, here: list[float]) -> Document:
    segment: Document = {"kind": "hold", "seconds": _round(rng.uniform(0.1, 3.0))}
    if rng.random() < 0.3:
        segment["look_at"] = [_round(value) for value in rng.uniform([-3, 0, 0], [3, 2, 9])]
    return segment


def _joined(rng: np.random.Generator) -> Document:
    if rng.random() < 0.8:
        return {}
    kinds = ["auto", "dead", "hermite"]
    return {"join": {"seconds": _round(rng.uniform(0.1, 0.8)), "blend": str(rng.choice(kinds))}}


def _round(value: float) -> float:
    return round(float(value), 3)


@dataclass
class Outcome:
    """Result of a script.

    faults: one sentence each. refused: message of the refusal; empty for a script that is
    performed. answer: None for a refused script.
    """

    faults: list[str] = field(default_factory=list)
    refused: str = ""
    answer: PerformanceAnswer | None = None


def check(document: Document, find: Callable[[str], Synthesizer]) -> Outcome:
    """Perform a script, and return the answer or the refusal, and all faults found in it."""
    question = read(document)
    try:
        script = resolve_script(question, find)
        answer = composition.perform(script, MOST_FRAMES)
    except QueryError as refusal:
        note = f"/{refusal.field}: {refusal.message}"
        is_known = exists(msgspec.to_builtins(question), f"/{refusal.field}")
        return Outcome([] if is_known else [f"no such pointer: {note}"], note)
    return Outcome(list(faults(script, answer)), "", answer)


def read(document: Document) -> PerformanceQuestion:
    """Return the script of a JSON value."""
    return json_decoding.decode_question(PerformanceQuestion, msgspec.json.encode(document))


def exists(document: Any, pointer: str) -> bool:
    """Return whether a JSON pointer leads to a value of a document."""
    for key in pointer.split("/")[1:]:
        if isinstance(document, list | tuple):
            if not key.isdecimal() or int(key) >= len(document):
                return False
            document = document[int(key)]
        elif isinstance(document, dict) and key in document:
            document = document[key]
        else:
            return False
    return True


def faults(script: Script, answer: PerformanceAnswer) -> Iterator[str]:
    """Yield the faults of a performance, one sentence each."""
    clip, report = answer.clip, answer.trust
    numbers = (clip.rotations, clip.translations, clip.root_path)
    if not all(np.isfinite(script_warning).all() for script_warning in numbers):
        yield "numbers that are not finite"
        return
    if len(clip) != report.frames:
        yield f"{len(clip)} frames, {report.frames} said"
    lengths = np.linalg.norm(clip.rotations, axis=-1)
    if np.abs(lengths - 1.0).max() > 1e-5:
        yield f"quaternions of length {lengths.min():g} to {lengths.max():g}"
    for script_warning in report.script_warnings:
        if not exists(msgspec.to_builtins(script.question), script_warning.pointer):
            yield f"no such pointer in a warning: {script_warning.sentence}"
    positions = clip.positions()
    yield from _timeline(answer)
    yield from _jumps(answer, accelerations(clip, positions))
    yield from _depth(script, answer, positions)


def accelerations(clip: Clip, positions: Positions) -> Frames:
    """Return the mean accelerations (F,) of the joints relative to the root, m/s²; ends are 0."""
    relative = positions - positions[:, :1]
    means = np.zeros(len(clip))
    if len(clip) > 2:
        second = np.diff(relative, n=2, axis=0) * clip.rate**2
        means[1:-1] = np.linalg.norm(second, axis=-1).mean(axis=-1)
    return means


def _timeline(answer: PerformanceAnswer) -> Iterator[str]:
    report = answer.trust
    end_points = [segment.ends for segment in report.segments]
    begins = [segment.begins for segment in report.segments]
    if (
        begins[0] != 0.0
        or abs(end_points[-1] - report.duration) > 1e-5
        or begins[1:] != end_points[:-1]
    ):
        yield f"segments from {begins} to {end_points}, {report.duration} s in all"
    if any(segment.ends < segment.begins for segment in report.segments):
        yield f"a segment ends before it begins: {begins}, {end_points}"
    if any(not math.isfinite(segment.sigma) for segment in report.segments):
        yield "a sigma that is not finite"


def _jumps(answer: PerformanceAnswer, accelerations_found: Frames) -> Iterator[str]:
    """Yield frames whose accelerations are larger than the report of the joins says."""
    joins = answer.trust.joins
    typical = max(
        (join.usual for join in joins), default=float(np.percentile(accelerations_found, 99.0))
    )
    times = np.arange(len(accelerations_found)) / answer.clip.rate
    free = np.ones(len(accelerations_found), dtype=bool)
    flagged = {
        pointer
        for warning in answer.trust.script_warnings
        if FAST in warning.message
        for pointer in re.findall(r"/segments/\d+", warning.sentence)
    }
    for index, segment in enumerate(answer.trust.segments):
        if f"/segments/{index}" in flagged:
            free &= (times < segment.begins) | (times > segment.ends)
    for join in joins:
        near = (times >= join.time - BEFORE) & (times <= join.time + AFTER)
        free &= ~near
        peak = float(accelerations_found[near].max(initial=0.0))
        allowed = max(join.peak, MOST_PEAK * join.usual)
        if not join.hard and peak > allowed:
            yield (
                f"join at {join.time:.2f} s: {peak:.1f} m/s², {join.peak:.1f} said, usual "
                f"{join.usual:.1f}"
            )
    worst = float(accelerations_found[free].max(initial=0.0))
    if worst > max(MOST_PEAK * typical, CAPTURED_PEAK):
        time = float(times[free][np.argmax(accelerations_found[free])])
        yield f"{worst:.1f} m/s² at {time:.2f} s, away from joins; usual {typical:.1f}"


def _depth(script: Script, answer: PerformanceAnswer, positions: Positions) -> Iterator[str]:
    feet = script.character.feet
    if script.question.feet != "stand" or not feet:
        return
    for foot, contact in zip(feet, script.character.contacts, strict=True):
        # A foot goes where its target is.
        led = _led(script, answer, script.character.skeleton.names[foot])
        depth = np.where(led, 0.0, contact.height - positions[:, foot, 1])
        if depth.max() > DEEPEST:
            frame = int(np.argmax(depth))
            yield f"foot {foot} is {100 * depth.max():.1f} cm below the floor in frame {frame}"


def _led(script: Script, answer: PerformanceAnswer, joint: str) -> Booleans:
    """Return the frames (F,) near the event of an act, or in a hold of it, that leads a joint."""
    report = answer.trust
    times = np.arange(report.frames) / answer.clip.rate
    values = np.zeros(len(times), dtype=bool)
    for index, (segment, segment_report) in enumerate(
        zip(script.segments, report.segments, strict=True)
    ):
        if not isinstance(segment, Act) or joint not in {
            target.joint for target in segment.targets
        }:
            continue
        begins = end_points = segment_report.event or segment_report.ends
        for later in report.segments[index + 1 :]:
            if later.kind != "hold":
                break
            end_points = later.ends
        values |= (times >= begins - LED) & (times <= end_points + LED)
    return values
