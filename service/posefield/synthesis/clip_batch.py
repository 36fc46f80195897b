"""Clips of several questions in few calls of the graph, each with the bytes that it has alone.

A call takes as long for the operators of its graph as for 40 frames of a clip, so clips share it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar, TypeVarTuple

import numpy as np

from posefield.common.units import Floats
from posefield.inference.graph_ports import CURVES
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer
from posefield.synthesis import clips, frame_times, poses
from posefield.synthesis.poses import OutputRow
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.question_validation import ValidatedQuestion

MAX_FRAMES = 512
"""Frames of one call, those included that pad shorter clips: more exceed the processor's cache."""

Result = TypeVar("Result")
Arguments = TypeVarTuple("Arguments")


@dataclass(frozen=True)
class _PlannedClip:
    """A clip whose frames are known: its place in the batch, and times (F,), s."""

    place: int
    asked: ClipQuestion
    question: ValidatedQuestion
    when: Floats


def synthesize_clips(
    model: Synthesizer, asked: Sequence[ClipQuestion], most: int = frame_times.MAX_POSES
) -> list[ClipAnswer | Exception]:
    """Return the clip of each question, equal to that of `clips.synthesize_clip`, or its error.

    asked: questions of one level. most: largest number of frames of a clip.
    """
    found: dict[int, ClipAnswer | Exception] = {}
    for part in _calls(_plan(model, asked, most)):
        for own, row in zip(part, _run(model, part), strict=True):
            found[own.place] = _attempt(_answer, model, own, row)
    for place, question in enumerate(asked):
        if place not in found:
            found[place] = _attempt(clips.synthesize_clip, model, question, most)
    return [found[place] for place in range(len(asked))]


def longest(model: Synthesizer, asked: ClipQuestion) -> float:
    """Return an upper bound of the number of frames of a clip, known before its synthesis.

    NaN where a field of the question is, which the synthesis refuses.
    """
    last = model.durations[1] if asked.end is None else asked.end
    return (last - asked.start) * asked.fps + 1.0


def _attempt(work: Callable[[*Arguments], Result], *arguments: *Arguments) -> Result | Exception:
    """Return the result or the exception of one question, which concerns no other."""
    try:
        return work(*arguments)
    except Exception as fault:
        return fault


def _plan(model: Synthesizer, asked: Sequence[ClipQuestion], most: int) -> list[_PlannedClip]:
    """Return the clips that share calls; the others, and those with errors, are made alone."""
    if len(asked) < 2:
        return []
    checked = [(place, _attempt(_validated, model, each)) for place, each in enumerate(asked)]
    valid = [(place, own) for place, own in checked if isinstance(own, ValidatedQuestion)]
    if not valid or not is_exact(model, asked[0].level):
        return []
    planned = []
    for (place, question), duration in zip(valid, _durations(model, valid), strict=True):
        when = _attempt(_times, model, asked[place], duration, most)
        # A matrix product with one row sums in another order.
        if not isinstance(when, Exception) and len(when) > 1:
            planned.append(_PlannedClip(place, asked[place], question, when))
    return planned


def _validated(model: Synthesizer, asked: ClipQuestion) -> ValidatedQuestion | None:
    """Return the validated question of a clip that may share calls, None for another one."""
    question = model.question(asked)
    clips.named_skeleton(model, asked)
    # Durations outside the sampled ranges are bounded by further calls.
    shares = clips.is_predicted(model, asked) and model.session.bounds.is_inside(question.point)
    return question if shares else None


def _durations(model: Synthesizer, valid: Sequence[tuple[int, ValidatedQuestion]]) -> list[float]:
    points, labels = (
        np.concatenate([getattr(own, name) for _, own in valid]) for name in ("point", "labels")
    )
    found: list[float] = model.session.durations(points, labels, valid[0][1].level).tolist()
    return found


def _times(model: Synthesizer, asked: ClipQuestion, duration: float, most: int) -> Floats:
    return frame_times.sample_times(asked, model.check_duration(duration), most)


def _calls(planned: Sequence[_PlannedClip]) -> Iterator[list[_PlannedClip]]:
    """Yield the clips of each call, of similar lengths, since shorter ones are padded."""
    part: list[_PlannedClip] = []
    for own in sorted(planned, key=lambda each: len(each.when)):
        if part and (len(part) + 1) * len(own.when) > MAX_FRAMES:
            yield part
            part = []
        part.append(own)
    if part:
        yield part


def _run(model: Synthesizer, part: Sequence[_PlannedClip]) -> list[OutputRow]:
    """Return the graph's outputs for clips in one call, padded to equally many frames."""
    when = np.empty((len(part), max(len(own.when) for own in part)))
    for times, own in zip(when, part, strict=True):
        times[: len(own.when)], times[len(own.when) :] = own.when, own.when[-1]
    names = poses.pose_outputs(model.session.card)
    answers = model.session.run(
        np.concatenate([own.question.point for own in part]),
        when,
        *names,
        labels=np.concatenate([own.question.labels for own in part]),
        level=part[0].question.level,
    )
    return [tuple(answer[row] for answer in answers) for row in range(len(part))]


def _answer(model: Synthesizer, own: _PlannedClip, row: OutputRow) -> ClipAnswer:
    row = _own_frames(model, own, row)
    answer = clips.pose_answer(model, own.question, own.asked, own.when, row)
    return clips.predicted_clip(model, own.question, own.asked, answer)


def _own_frames(model: Synthesizer, own: _PlannedClip, row: OutputRow) -> OutputRow:
    """Return the outputs of a clip without the frames that pad it."""
    names = poses.pose_outputs(model.session.card)
    return tuple(
        array[: len(own.when)] if name in _PER_FRAME else array
        for name, array in zip(names, row, strict=True)
    )


_PER_FRAME = ("rotations", "root_position", CURVES)


def is_exact(model: Synthesizer, level: int) -> bool:
    """Return whether clips that share a call get the bytes that they get alone.

    Measured once per level with a sample of clips, as `poses.is_batch_exact` does for poses.
    """
    known = model.exact_clip_levels
    if level not in known:
        shares = np.linspace(0.0, 1.0, poses.SAMPLE_SIZE)
        sample = [_sample(model, place, share, level) for place, share in enumerate(shares)]
        valid = [(own.place, own.question) for own in sample]
        alone = [_durations(model, [each])[0] for each in valid]
        rows = zip(sample, _run(model, sample), strict=True)
        pairs = [(own, _run(model, [own])[0], row) for own, row in rows]
        known[level] = alone == _durations(model, valid) and all(
            np.array_equal(a, b)
            for own, single, row in pairs
            for a, b in zip(single, _own_frames(model, own, row), strict=True)
        )
    return known[level]


def _sample(model: Synthesizer, place: int, share: float, level: int) -> _PlannedClip:
    """Return a clip of `place` + 2 frames at a share of each control's range."""
    card = model.session.card
    controls = {c.name: c.minimum + share * (c.maximum - c.minimum) for c in card.controls}
    asked = ClipQuestion(controls=controls, extrapolate="ok", level=level)
    when = np.linspace(0.0, card.durations[0], place + 2)
    return _PlannedClip(place, asked, model.question(asked), when)
