"""Questions, and the service's answers, with which the run time in TypeScript is compared."""

import json
import time
from pathlib import Path

import numpy as np

from posefield.inference import session
from posefield.motion import skeleton
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

SHIPPED = Path(poses.__file__).parents[1] / "shipped"
SHARES = (0.0, 0.35, 1.0)


def questions(card, level):
    """Yield controls and a performer: the defaults, a corner, and two named performers."""
    shares = ({}, 0.9, 0.2, 0.7) if level == 0 else (0.4,)
    for index, share in enumerate(shares):
        controls = {
            c.name: c.minimum + share * (c.maximum - c.minimum) if share else c.default
            for c in card.controls
        }
        yield controls, card.performers[1] if index % 2 else None


def pose_answer(model, controls, performer, level):
    """Return a question for poses and what the service answers."""
    ask = {"controls": controls, "performer": performer, "level": level, "extrapolate": "ok"}
    first = poses.synthesize_poses(model, PoseQuestion(times=[0.0], exact="none", **ask))
    times = [share * first.trust.duration for share in SHARES]
    answer = poses.synthesize_poses(model, PoseQuestion(times=times, exact="none", **ask))
    return {
        "controls": controls,
        "options": {"level": level} | ({"performer": performer} if performer else {}),
        "times": times,
        "duration": answer.trust.duration,
        "sigma": answer.trust.sigma,
        "rotations": np.ravel(answer.rotations).tolist(),
        "rootPosition": np.ravel(answer.root_position).tolist(),
        "boneOffsets": np.ravel(answer.bone_offsets).tolist(),
    }


def clip_answer(model, controls, performer, level, **fields):
    """Return a question for a clip and the service's joints in the world, m."""
    ask = {"controls": controls, "performer": performer, "level": level, "extrapolate": "ok"}
    answer = clips.synthesize_clip(model, ClipQuestion(exact="none", **ask, **fields))
    clip = answer.clip
    parents, turns = model.session.card.skeleton.parents, clip.rotations
    positions = skeleton.forward_kinematics(parents, turns, clip.translations)[0]
    options = {"level": level, **fields} | ({"performer": performer} if performer else {})
    return {
        "controls": controls,
        "options": options,
        "duration": answer.trust.duration,
        "positions": np.round(positions, 7).ravel().tolist(),
    }


def clip_fields(card, controls, level):
    """Yield options of clips; all of them at the defaults."""
    yield {"fps": 60.0} if level == 0 else {}
    if controls == {control.name: control.default for control in card.controls}:
        yield {"feet": "as_predicted"}
        yield {"root": "in_place"}
        if card.cyclic:
            yield {"loop": True}
    if card.cyclic:
        yield {"loop": True, "root": "in_place", "fps": 50.0}


def seconds(model):
    """Return the CPU seconds of a pose, and of a clip of 100 frames with feet, of the service."""
    controls = {control.name: control.default for control in model.session.card.controls}
    ask = {"controls": controls, "exact": "none"}
    duration = poses.synthesize_poses(model, PoseQuestion(times=[0.0], **ask)).trust.duration
    calls = {
        "pose": lambda: poses.synthesize_poses(model, PoseQuestion(times=[0.3], **ask)),
        "clip": lambda: clips.synthesize_clip(model, ClipQuestion(fps=100 / duration, **ask)),
    }
    return {name: cpu_seconds(call) for name, call in calls.items()} | {"fps": 100 / duration}


def cpu_seconds(call, count=20):
    """Return the CPU seconds of a call, the mean of some after a first one."""
    call()
    start = time.process_time()
    for _ in range(count):
        call()
    return (time.process_time() - start) / count


def write(folder):
    """Return a file of questions and the service's answers for all shipped models and levels."""
    cases = []
    for path in sorted(SHIPPED.glob("*.onnx")):
        model = Synthesizer(path.stem, session.load(path))
        cards = [(model.session.card, level) for level in range(len(model.session.card.levels))]
        asked = [(level, *one) for card, level in cards for one in questions(card, level)]
        cases.append(
            {
                "file": str(path),
                "seconds": seconds(model),
                "poses": [pose_answer(model, *one, level) for level, *one in asked],
                "clips": [
                    clip_answer(model, *one, level, **fields)
                    for level, *one in asked
                    for fields in clip_fields(model.session.card, one[0], level)
                ],
            }
        )
    file = folder / "answers.json"
    file.write_text(json.dumps(cases))
    return file
