"""Predictions of several clips in few calls of the graph, each with the bytes that it has alone.

A call takes as long for the operators of its graph as for 40 frames of a clip, so clips share it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common import cancellation
from posefield.common.errors import QueryError
from posefield.common.units import Floats
from posefield.inference.graph_ports import CURVES
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clip_drafts, frame_times, poses
from posefield.synthesis.clip_drafts import ClipDraft, ClipRequest
from posefield.synthesis.poses import OutputRow
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation.question_validation import ValidatedQuestion

MAX_FRAMES = 512
"""Frames of one call, those included that pad shorter clips: more exceed the processor's cache."""


@dataclass(frozen=True)
class _PlannedClip:
    """A clip whose frames are known: its place in the batch, and times (F,), s."""

    place: int
    question: ValidatedQuestion
    when: Floats


def draft_predictions(
    model: Synthesizer, requests: Mapping[int, ClipRequest]
) -> dict[int, ClipDraft]:
    """Return the drafts of clips that can share calls of the graph, by their places.

    requests: of clips without constraints. Those that cannot share calls have no draft: fewer than
    two of a level, outside the sampled ranges, clips of one frame, and those with errors.
    """
    found = {}
    for own in _by_level(model, requests):
        for part in _calls(_plan(model, own)):
            cancellation.check()
            for planned, row in zip(part, _run(model, part), strict=True):
                request, row = own[planned.place], _own_frames(model, planned, row)
                answer = clip_drafts.pose_answer(model, request, planned.when, row)
                found[planned.place] = clip_drafts.predicted(model, request, answer)
    return found


def _by_level(
    model: Synthesizer, requests: Mapping[int, ClipRequest]
) -> Iterator[dict[int, ClipRequest]]:
    """Yield the requests of each level that may share calls, where there are several."""
    # Durations outside the sampled ranges are bounded by further calls.
    inside = {
        place: own
        for place, own in requests.items()
        if model.session.bounds.is_inside(own.question.point)
    }
    for level in sorted({own.question.level for own in inside.values()}):
        own = {place: each for place, each in inside.items() if each.question.level == level}
        if len(own) > 1 and is_exact(model, level):
            yield own


def longest(model: Synthesizer, asked: ClipQuestion) -> float:
    """Return an upper bound of the number of frames of a clip, known before its synthesis.

    NaN where a field of the question is, which the synthesis refuses.
    """
    last = model.durations[1] if asked.end is None else asked.end
    return (last - asked.start) * asked.fps + 1.0


def _plan(model: Synthesizer, requests: Mapping[int, ClipRequest]) -> list[_PlannedClip]:
    """Return the clips with their frames; those with errors are made alone, which tells them."""
    questions = [own.question for own in requests.values()]
    planned = []
    for (place, own), duration in zip(requests.items(), _durations(model, questions), strict=True):
        try:
            when = frame_times.sample_times(own.asked, model.check_duration(duration), own.most)
        except QueryError:
            continue
        # A matrix product with one row sums in another order.
        if len(when) > 1:
            planned.append(_PlannedClip(place, own.question, when))
    return planned


def _durations(model: Synthesizer, questions: Sequence[ValidatedQuestion]) -> list[float]:
    points = np.concatenate([own.point for own in questions])
    labels = np.concatenate([own.labels for own in questions])
    found: list[float] = model.session.durations(points, labels, questions[0].level).tolist()
    return found


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
        questions = [own.question for own in sample]
        alone = [_durations(model, [each])[0] for each in questions]
        rows = zip(sample, _run(model, sample), strict=True)
        pairs = [(own, _run(model, [own])[0], row) for own, row in rows]
        known[level] = alone == _durations(model, questions) and all(
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
    return _PlannedClip(place, model.question(asked), when)
