"""Cost of a clip's standing feet and of a take, as processor time in one thread."""

import time
from collections.abc import Callable, Mapping

from msgspec import structs
from rows import Row
from threadpoolctl import threadpool_limits

from posefield.locomotion.gait import Gait
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

FRAMES, ROUNDS, QUESTIONS = 60, 40, 2
FEET_GOAL, TAKE_GOAL = 5.0, 1.0
"""Milliseconds."""


def rows(walks: dict[str, Gait]) -> list[Row]:
    """Processor milliseconds of standing feet and of a take, beside those of the prediction."""
    models = {name: Synthesizer("walk", gait.session) for name, gait in walks.items()}
    return [row for name, model in models.items() for row in model_rows(name, model)]


def model_rows(name: str, model: Synthesizer) -> list[Row]:
    """Return the rows of one model."""
    plain = _question(model)
    seeds = iter(range(1, 1_000_000))
    # Standing feet are planned over the whole motion, whatever the frames that are asked for.
    runs = {
        "plain": lambda: clips.synthesize_clip(model, plain),
        "stand": lambda: clips.synthesize_clip(model, structs.replace(plain, feet="stand")),
        "take": lambda: clips.synthesize_clip(model, structs.replace(plain, take=next(seeds))),
    }
    timings = processor_seconds(runs)
    feet, take = (1e3 * (timings[name] - timings["plain"]) for name in ("stand", "take"))
    title = f"a clip of {FRAMES} frames, {name}, one thread"
    words = f"processor time above that of the prediction, {1e3 * timings['plain']:.2g} ms"
    return [
        Row(f"standing feet of {title}", feet, "ms", words, None, FEET_GOAL),
        Row(f"a take with a new seed, {title}", take, "ms", words, None, TAKE_GOAL),
    ]


def _question(model: Synthesizer) -> ClipQuestion:
    """Return the question for the default motion in that many frames."""
    card = model.session.card
    question = ClipQuestion(
        controls={control.name: control.default for control in card.controls},
        feet="as_predicted",
        exact="none",
    )
    duration = clips.synthesize_clip(model, question).trust.duration
    return structs.replace(question, fps=(FRAMES - 1) / duration)


def processor_seconds(runs: Mapping[str, Callable[[], object]]) -> dict[str, float]:
    """Return the least processor seconds per call of each function, measured alternately.

    The least of many rounds: whatever else runs on the machine can only add to it.
    """
    timings: dict[str, list[float]] = {name: [] for name in runs}
    with threadpool_limits(limits=1):
        for _ in range(ROUNDS):
            for name, run in runs.items():
                start = time.process_time()
                for _ in range(QUESTIONS):
                    run()
                timings[name].append((time.process_time() - start) / QUESTIONS)
    return {name: min(times) for name, times in timings.items()}
