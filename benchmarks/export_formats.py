"""A clip in every format that the service writes, in batches as an export makes them."""

import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import family
from family import Family
from rows import Row, table
from timing import in_turn

from posefield.encode.formats import CLIP_ENCODERS
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

FRAMES, BATCH = 100, 16
GOALS = {"glb": 5.0, "bvh": 5.0}
"""ms a clip: 200 clips a second and core."""


def rows(trained_family: Family) -> list[Row]:
    """Time the synthesis of a clip of 100 frames, and its writing in each format."""
    model = Synthesizer("reaching", session.open_bytes(trained_family.exported.content, "reaching"))
    question = _question(model)
    answers = [clips.synthesize_clip(model, question)] * BATCH
    timings = in_turn(
        {"synthesis": partial(_synthesised, model, question), **_writers(answers)},
        rounds=9,
        repeats=1,
    )
    joints = len(answers[0].clip.skeleton)
    return [_row(name, seconds / BATCH, joints, answers[0]) for name, seconds in timings.items()]


def _question(model: Synthesizer) -> ClipQuestion:
    """A clip in the middle of the controls, at the rate at which it has so many frames."""
    middle = {control.name: control.default for control in model.session.card.controls}
    duration = poses.synthesize_poses(
        model, PoseQuestion(controls=middle, times=[0.0], extrapolate="refuse")
    ).trust.duration
    return ClipQuestion(controls=middle, fps=(FRAMES - 1) / duration)


def _synthesised(model: Synthesizer, question: ClipQuestion) -> list[ClipAnswer]:
    return [clips.synthesize_clip(model, question) for _ in range(BATCH)]


def _writers(answers: list[ClipAnswer]) -> dict[str, Callable[[], list[bytes]]]:
    return {
        name: partial(e.write, answers, e.default_convention) for name, e in CLIP_ENCODERS.items()
    }


def _row(name: str, seconds: float, joints: int, answer: ClipAnswer) -> Row:
    words = f"{1.0 / seconds:,.0f} clips a second"
    if name in CLIP_ENCODERS:
        words += f" of {len(CLIP_ENCODERS[name].encode(answer)) / 1e3:.0f} kB"
    what = f"clip of {FRAMES} frames, {joints} joints, {name}"
    return Row(what, 1e3 * seconds, "ms", words, None, GOALS.get(name))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        sys.stdout.write(table(rows(family.make(Path(folder) / "reaching"))) + "\n")
