"""Knees and elbows against the limits of their captures: clips, takes and performances of models.

Each figure stands beside that of the same answers of models without limits, as of earlier files.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rows import Row, record, table

from posefield.common.units import Floats
from posefield.inference import session
from posefield.motion import hinges
from posefield.motion.clip import Clip
from posefield.motion.hinges import Hinges
from posefield.performance import composition
from posefield.performance.script import resolve_script
from posefield.question.json_decoding import decode_question
from posefield.question.motion_question import ClipQuestion
from posefield.question.performance_question import PerformanceQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

ROOT = Path(__file__).resolve().parents[1]
SEEDS, TOGETHER = 200, 20
VARIETIES = 0.7, 1.0
GOAL = 3.0
"""Largest angle beyond the captured range, degrees."""
WRONG = np.radians(5.0)
"""Angle beyond the captured range, or beyond straight, at which a joint bends the wrong way."""
FRAMES = 100_000

Excess = tuple[Floats, int]
"""Largest angles (3,) beyond the captured range, degrees, and clips that bend the wrong way."""


def without_limits(model: Synthesizer) -> Synthesizer:
    """Return the model as a file of an earlier version."""
    card = replace(model.session.card, hinges=())
    return Synthesizer(model.name, replace(model.session, card=card))


def excess(limits: Hinges, motions: Sequence[Clip]) -> Excess:
    """Return how far motions exceed the captured ranges."""
    angles = [limits.angles(motion.rotations) for motion in motions]
    beyond = [np.maximum(limits.low - a, a - limits.high).max(axis=(0, 1)) for a in angles]
    straight = np.minimum(limits.low[:, 0], 0.0) - WRONG
    wrong = sum(bool((a[..., 0] < straight).any()) for a in angles)
    return np.degrees(np.maximum(np.max(beyond, axis=0), 0.0)), wrong


def synthesized(model: Synthesizer, count: int, **fields: float) -> list[Clip]:
    """Return clips with standing feet at controls of captured clips, one after another."""
    card, found = model.session.card, []
    names = [control.name for control in card.controls]
    for first in range(0, count, TOGETHER):
        questions = [
            ClipQuestion(
                controls=dict(zip(names, card.examples[row % len(card.examples)], strict=True)),
                extrapolate="ok",
                fps=60.0,
                take=(row + 1) * bool(fields),
                **fields,
            )
            for row in range(first, min(first + TOGETHER, count))
        ]
        for answer in clips.synthesize_clips(model, questions):
            if isinstance(answer, Exception):
                raise answer
            found.append(answer.clip)
    return found


def script(models: dict[str, Synthesizer], walk: str, index: int) -> bytes:
    """Return a script of a walk, an act, a hold of what is reached, and a walk."""
    acts = sorted(name for name in models if name != walk)
    name, seconds = acts[index % len(acts)], 2.0 + 0.3 * (index % 5)
    card = models[name].session.card
    example = card.examples[(7 * index) % len(card.examples)]
    controls = {c.name: value for c, value in zip(card.controls, example, strict=True)}
    event = None if card.event is None else card.skeleton.names[card.event.joint]
    reaches = event in (card.roles.get("leftHand"), card.roles.get("rightHand"))
    segments = [
        {"kind": "walk", "model": walk, "seconds": seconds, "speed": 0.9 + 0.1 * (index % 6)},
        {"kind": "act", "model": name, "controls": controls},
        *[{"kind": "hold", "seconds": 1.0}] * reaches,
        {"kind": "walk", "model": walk, "seconds": 2.0},
    ]
    return json.dumps({"segments": segments, "fps": 60, "take": index % 2 * index}).encode()


def performed(
    models: dict[str, Synthesizer], scripts: Sequence[bytes], limits: Sequence[Hinges]
) -> Excess:
    """Return how far performances of scripts exceed the limits of their characters."""
    found = []
    for text, of_character in zip(scripts, limits, strict=True):
        question = decode_question(PerformanceQuestion, text)
        answer = composition.perform(resolve_script(question, models.__getitem__), FRAMES)
        found.append(excess(of_character, [answer.clip]))
    return np.max([angles for angles, _ in found], axis=0), sum(wrong for _, wrong in found)


def row(name: str, limited: Excess, free: Excess) -> Row:
    """Return the row of answers with limits, and without them beside it."""
    (angles, wrong), (others, others_wrong) = limited, free
    parts = "bend {:.1f}, twist {:.1f}, sideways {:.1f}".format(*angles)
    bare = "bend {:.1f}, twist {:.1f}, sideways {:.1f}".format(*others)
    against = f"{parts}; {wrong} bend the wrong way; without limits {bare}; {others_wrong}"
    return Row(name, float(angles.max()), "degrees", against, None, GOAL)


def rows(paths: Sequence[Path], seeds: int, scripts: int) -> Iterator[Row]:
    """Yield the rows of models: of clips, of takes, and of performances of all models."""
    models = {path.stem: Synthesizer(path.stem, session.load(path)) for path in paths}
    for name, model in models.items():
        limits, free = hinges.from_card(model.session.card.hinges), without_limits(model)
        count = len(model.session.card.examples)
        pair = (excess(limits, synthesized(each, count)) for each in (model, free))
        yield row(f"{name}: {count} clips", *pair)
        for variety in VARIETIES:
            pair = (
                excess(limits, synthesized(each, seeds, variety=variety)) for each in (model, free)
            )
            yield row(f"{name}: {seeds} takes of variety {variety:g}", *pair)
    walk = next(name for name, model in models.items() if model.session.card.cyclic)
    texts = [script(models, walk, index) for index in range(scripts)]
    questions = (decode_question(PerformanceQuestion, text) for text in texts)
    characters = [resolve_script(each, models.__getitem__).character.body for each in questions]
    bounds = [hinges.from_card(body.hinges) for body in characters]
    bare = {name: without_limits(model) for name, model in models.items()}
    yield row(
        f"{scripts} performances",
        performed(models, texts, bounds),
        performed(bare, texts, bounds),
    )


def main(arguments: Sequence[str]) -> None:
    """Print the figures, and record them if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", type=Path, nargs="+", help="files of a walk and of acts")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--scripts", type=int, default=40)
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args(arguments)
    found = list(rows(options.models, options.seeds, options.scripts))
    print(table(found))
    if options.record:
        command = "python benchmarks/joint_angles.py MODELS --record"
        record({"joint_angles": found}, command, ROOT / "docs/results")


if __name__ == "__main__":
    main(sys.argv[1:])
