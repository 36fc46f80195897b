"""Poses of a model, of one question or of a batch that gives each question the same bytes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Singles
from posefield.constraints.targets import ConstraintSet
from posefield.inference.onnx_runtime import CURVES
from posefield.model_file.model_card import ModelCard
from posefield.question import motion_question
from posefield.question.motion_question import PoseQuestion
from posefield.question.results import PoseAnswer
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.question_validation import ValidatedQuestion

MAX_POSES = 10_000
POSE_OUTPUTS = ("rotations", "root_position", "bone_offsets", "duration", "sigma")
"""Outputs that all poses are made of."""

OutputRow = tuple[Singles, ...]
"""Values of `pose_outputs` for one question: (S, J, 4), (S, 3), (J, 3), two numbers, and (S, C) of
a model with curves.
"""


def pose_outputs(card: ModelCard) -> tuple[str, ...]:
    """Return the outputs that the poses of a model are made of."""
    return (*POSE_OUTPUTS, CURVES) if card.curves else POSE_OUTPUTS


_PER_FRAME = ("rotations", "root_position", CURVES)

SAMPLE_SIZE = 17
"""Number of questions that show whether a row depends on its batch: odd, and more than a kernel's
rows.
"""


@dataclass(frozen=True)
class PreparedPoseQuestion:
    """A question for poses with its validated part and its times.

    question: as received. validated: its validated part. when: times (S,), s, as given.
    graph_times: times (S,), s, limited to the longest plausible clip, as the graph's input. first,
    last: the smallest and the largest time given.
    """

    question: PoseQuestion
    validated: ValidatedQuestion
    when: Floats
    graph_times: Floats
    first: float
    last: float

    @property
    def level(self) -> int:
        """Level of detail."""
        return self.validated.level


def synthesize_poses(model: Synthesizer, question: PoseQuestion) -> PoseAnswer[Any]:
    """Return the poses (S,) of the question, constrained where it has targets.

    Raises InvalidField for a control, time, performer or level that cannot be used, and for
    constraints that do not fit the model. Where `extrapolate` is "refuse", raises OutsideSamples
    for controls without similar captured clips and OutOfReach for a missed target.
    """
    prepared = prepare(model, question)
    constraints = model.constraints(prepared.validated, question)
    if constraints is not None:
        return synthesize_constrained(model, prepared, constraints)
    return build_answer(model, prepared, run_batch(model, [prepared])[0])


def prepare(model: Synthesizer, question: PoseQuestion) -> PreparedPoseQuestion:
    """Return the question of `synthesize_poses`, validated without a call of the model.

    Raises InvalidField and OutsideSamples.
    """
    validated, times = model.question(question), question.times
    if not 1 <= len(times) <= MAX_POSES:
        raise InvalidField("times", f"{len(times)} times, expected 1 to {MAX_POSES}")
    when = [motion_question.check_number(f"times/{i}", value) for i, value in enumerate(times)]
    # The duration is known only after the call of the graph; times beyond the longest plausible
    # clip are limited because they may overflow float32.
    longest = model.durations[1]
    first, last, array = min(when), max(when), np.array(when)
    fits = 0.0 <= first and last <= longest
    within = array if fits else np.clip(array, 0.0, longest)
    return PreparedPoseQuestion(question, validated, array, within, first, last)


def synthesize_constrained(
    model: Synthesizer, prepared: PreparedPoseQuestion, constraints: ConstraintSet
) -> PoseAnswer[np.float64]:
    """Return the poses of a motion that meets constraints; raises as `synthesize_poses` does."""
    question, received = prepared.validated, prepared.question
    motion = model.solve_constraints(question, constraints, received.extrapolate)
    when = _check_times(prepared, model.check_duration(motion.duration))
    trust = model.constrained_trust(received, question, motion)
    (answer,) = model.solver.poses([(question, motion, when, trust)])
    return answer


def run_batch(model: Synthesizer, batch: Sequence[PreparedPoseQuestion]) -> list[OutputRow]:
    """Return the graph's outputs for questions of one level and equal numbers of times.

    One call of the graph. Where `is_batch_exact` is true, a question's bytes do not depend on the
    others in the call.
    """
    questions = [prepared.validated for prepared in batch]
    times = [prepared.graph_times for prepared in batch]
    if len(batch) == 1 and len(times[0]) == 1:
        # A matrix product with one row sums in another order, so a single question is duplicated.
        return predict_frames(model, questions * 2, times * 2)[:1]
    return predict_frames(model, questions, times)


def predict_frames(
    model: Synthesizer, questions: Sequence[ValidatedQuestion], times: Sequence[Floats]
) -> list[OutputRow]:
    """Return the graph's outputs for questions of one level at the times of each (F,), s.

    One call of the graph, in which shorter questions are padded.
    """
    longest = max(map(len, times))
    padded = [
        frames if len(frames) == longest else np.pad(frames, (0, longest - len(frames)), "edge")
        for frames in times
    ]
    names = pose_outputs(model.session.card)
    outputs = model.session.run(
        np.concatenate([question.point for question in questions]),
        np.array(padded),
        *names,
        labels=np.concatenate([question.labels for question in questions]),
        level=questions[0].level,
    )
    rows = [tuple(output[row] for output in outputs) for row in range(len(times))]
    return [
        row
        if len(frames) == longest
        else tuple(
            values[: len(frames)] if name in _PER_FRAME else values
            for name, values in zip(names, row, strict=True)
        )
        for row, frames in zip(rows, times, strict=True)
    ]


def build_answer(
    model: Synthesizer, prepared: PreparedPoseQuestion, row: OutputRow
) -> PoseAnswer[np.float32]:
    """Return the answer of one row of `run_batch`.

    Raises as `synthesize_poses` does for a time outside the clip.
    """
    rotations, root, offsets, length, sigma, *curves = row
    duration = model.check_duration(float(length))
    # The graph limits times to the end of the clip.
    when = _check_times(prepared, duration)
    trust = model.trust(prepared.question, prepared.validated, duration, float(sigma))
    return PoseAnswer(when, rotations, root, offsets, trust, *curves)


def is_batch_exact(model: Synthesizer, level: int) -> bool:
    """Return whether `run_batch` gives each question of a batch the bytes that it gets alone.

    Measured once per level with a sample of questions: graphs of earlier versions sum in an order
    that depends on the row's position.
    """
    exact = model.exact_levels
    if level not in exact:
        sample = [_sample(model, share, level) for share in np.linspace(0.0, 1.0, SAMPLE_SIZE)]
        alone = (run_batch(model, [prepared])[0] for prepared in sample)
        both = zip(run_batch(model, sample), alone, strict=True)
        exact[level] = all(
            np.array_equal(a, b) for row, single in both for a, b in zip(row, single, strict=True)
        )
    return exact[level]


def _sample(model: Synthesizer, share: float, level: int) -> PreparedPoseQuestion:
    """Return a question at a share of each control's range and of the shortest clip."""
    card = model.session.card
    controls = {c.name: c.minimum + share * (c.maximum - c.minimum) for c in card.controls}
    return prepare(
        model,
        PoseQuestion(
            controls=controls, times=[share * card.durations[0]], extrapolate="ok", level=level
        ),
    )


def _check_times(prepared: PreparedPoseQuestion, duration: float) -> Floats:
    """Return the times (S,), s; InvalidField for a time outside a clip of this duration."""
    if prepared.first >= 0.0 and prepared.last <= duration:
        return prepared.when
    times = enumerate(prepared.when.tolist())
    return np.array(
        [motion_question.check_rounded_range(f"times/{i}", t, 0.0, duration, "s") for i, t in times]
    )
