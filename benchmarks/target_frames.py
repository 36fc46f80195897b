"""Targets in the frames of clips: how near the nearest written frame is to each.

Targets lie 2 to 10 cm from where a model puts the joint of its event, at the event, the end or any
time, with all controls given or with open ones. Distances are of joints in the clips that files are
written of. The control has frames at equal times, of the same motions.
"""

import argparse
import sys
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rows import Row, record, table

from posefield.inference import session
from posefield.motion import skeleton
from posefield.question.motion_question import ClipQuestion, PoseQuestion, Target
from posefield.question.results import PoseAnswer
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

ROOT = Path(__file__).resolve().parents[1]
TARGETS, RATES, GOAL = 500, (24.0, 30.0, 60.0), 0.2
NEAREST, FARTHEST = 0.02, 0.1
"""Distances of targets from the predicted place, m."""


def draw(model: Synthesizer, index: int, rng: np.random.Generator) -> tuple[dict, Target]:
    """Return the controls of a captured clip, none of every other target, and a target."""
    card = model.session.card
    event = card.event
    example = card.examples[rng.integers(len(card.examples))]
    controls = {control.name: v for control, v in zip(card.controls, example, strict=True)}
    at_zero = poses.synthesize_poses(model, PoseQuestion(controls=controls, times=[0.0]))
    moment = ("event", "end", "time", "time")[index // 2 % 4]
    share = {"event": event.share, "end": 1.0, "time": rng.uniform(0.05, 0.95)}[moment]
    time = share * at_zero.trust.duration
    answer = poses.synthesize_poses(model, PoseQuestion(controls=controls, times=[time]))
    place = path(model, answer)[0] + rng.uniform(NEAREST, FARTHEST) * unit(rng)
    when = {"time": time} if moment == "time" else {"at": moment}
    target = Target(card.skeleton.names[event.joint], tuple(map(float, place)), **when)
    return controls if index % 2 or moment == "time" else {}, target


def unit(rng: np.random.Generator) -> np.ndarray:
    """Return a direction."""
    way = rng.standard_normal(3)
    return way / np.linalg.norm(way)


def path(model: Synthesizer, answer: PoseAnswer) -> np.ndarray:
    """Return the positions (F, 3), m, of the joint of the event in poses."""
    card = model.session.card
    translations = skeleton.translations(answer.bone_offsets, answer.root_position)
    positions = skeleton.positions(card.skeleton.parents, answer.rotations, translations)
    return positions[:, card.event.joint]


def measure(models: Sequence[Synthesizer]) -> dict[str, list[float]]:
    """Return distances, cm, of nearest frames by rate, and of the control's by "equal RATE"."""
    rng, found = np.random.default_rng(1), defaultdict(list)
    for index in range(TARGETS):
        model = models[index % len(models)]
        controls, target = draw(model, index // len(models), rng)
        asked = {"controls": controls, "targets": (target,)}
        for rate in RATES:
            answer = clips.synthesize_clip(model, ClipQuestion(**asked, fps=rate))
            joint = answer.clip.positions()[:, model.session.card.event.joint]
            nearest = 100.0 * float(np.linalg.norm(joint - target.position, axis=-1).min())
            told = answer.trust.targets[-1]
            found["stretch"].append(round(rate * (answer.trust.stretch or 0.0), 3))
            if not told.reached:
                found["beyond"].append(nearest - 100.0 * told.miss)
                continue
            end = poses.synthesize_poses(model, PoseQuestion(**asked, times=[0.0])).trust.duration
            times = np.arange(0.0, end, 1.0 / rate).tolist()
            equal = path(model, poses.synthesize_poses(model, PoseQuestion(**asked, times=times)))
            found[f"{rate:g}"].append(nearest)
            apart = np.linalg.norm(equal - target.position, axis=-1).min()
            found[f"equal {rate:g}"].append(100.0 * float(apart))
    return found


def rows(found: dict[str, list[float]]) -> list[Row]:
    """Return the figures."""
    figures = []
    for rate in RATES:
        near, equal = found[f"{rate:g}"], found[f"equal {rate:g}"]
        note = f"{len(near)} targets reached; at equal times {max(equal):.1f}, mean "
        note += f"{np.mean(equal):.1f}"
        figures.append(Row(f"{rate:g} frames a second", max(near), "cm", note, None, GOAL))
    beyond = found["beyond"]
    note = f"{len(beyond)} targets out of reach, all rates"
    figures.append(
        Row("farther than `miss` tells", max(beyond, default=0.0), "cm", note, None, GOAL)
    )
    figures.append(Row("stretch", max(found["stretch"]), "frames", "", None, 0.5))
    return figures


def main(arguments: Sequence[str]) -> None:
    """Print the figures; write them where the documentation reads them if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", type=Path, nargs="+", help="model files with an event")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args(arguments)
    models = [Synthesizer(file.stem, session.load(file)) for file in options.models]
    figures = rows(measure(models))
    print(table(figures))
    if options.record:
        command = "python benchmarks/target_frames.py MODELS --record"
        record({"target_frames": figures}, command, ROOT / "docs/results")


if __name__ == "__main__":
    main(sys.argv[1:])
