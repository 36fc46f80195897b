"""Synthesis of clips, and their frame count, warnings and solver cost before synthesis."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from posefield.common import cancellation
from posefield.common.errors import QueryError
from posefield.constraints.constraint_solver import MotionTimes
from posefield.locomotion.stride import Strides
from posefield.motion.clip import assemble
from posefield.motion.curves import CurveValues
from posefield.question.motion_question import ClipQuestion
from posefield.question.results import ClipAnswer, PoseAnswer, split_results
from posefield.synthesis import clip_batch, poses, standing_feet
from posefield.synthesis.clip_batch import ClipDraft, ClipRequest
from posefield.synthesis.standing_feet import StandRequest
from posefield.synthesis.synthesizer import Synthesizer
from posefield.validation import question_validation
from posefield.validation.question_validation import ValidatedQuestion

Given = TypeVar("Given")
Found = TypeVar("Found")


@dataclass(frozen=True)
class ClipPreview:
    """Properties of a clip that are known before its synthesis.

    frames: number of frames. warnings: of the controls, as in the answer; deviations of controls
    that the correction constrains are told with the values at which they act. missed: true if the
    clip misses a target.
    """

    frames: int
    warnings: tuple[str, ...]
    missed: bool = False


def synthesize_clip(
    model: Synthesizer, asked: ClipQuestion, most: int = poses.MAX_POSES
) -> ClipAnswer:
    """Return the clip of a question; frame i is the pose at start + i / fps.

    most: largest number of frames. The N steps of a loop share the duration evenly, but are played
    at fps. Raises as `poses.synthesize_poses` does, and InvalidField for a loop of a model that is
    not cyclic, for joint names without roles and for more than `most` frames.
    """
    (found,) = synthesize_clips(model, [asked], most)
    if isinstance(found, QueryError):
        raise found
    return found


def synthesize_clips(
    model: Synthesizer, every: Sequence[ClipQuestion], most: int = poses.MAX_POSES
) -> list[ClipAnswer | QueryError]:
    """Return the clips of questions, each with the bytes that it has alone.

    Clips share the calls of NumPy, which take most of the time of one clip. A question that cannot
    be answered has the error that `synthesize_clip` raises.
    """
    asked = _each(partial(clip_batch.validate, model, most), every)
    drafts = _drafts(model, _solved(model, asked))
    answers = iter(_clips(model, [own for own in drafts if isinstance(own, ClipDraft)]))
    return [next(answers) if isinstance(own, ClipDraft) else own for own in drafts]


def _solved(
    model: Synthesizer, every: Sequence[ClipRequest | QueryError]
) -> list[ClipRequest | QueryError]:
    """Return the requests with the motions of those that have constraints."""
    found = list(every)
    places = [at for at, own in enumerate(every) if isinstance(own, ClipRequest) and own.goals]
    asked = [own for own in every if isinstance(own, ClipRequest) and own.goals]
    motions = model.solver.solve_all([(own.question, own.goals) for own in asked])
    for place, own, held in zip(places, asked, motions, strict=True):
        found[place] = held if isinstance(held, QueryError) else replace(own, held=held)
    return found


def _drafts(
    model: Synthesizer, every: Sequence[ClipRequest | QueryError]
) -> list[ClipDraft | QueryError]:
    """Return the motions of requests; predictions share calls of the graph."""
    predicted = {
        place: own
        for place, own in enumerate(every)
        if isinstance(own, ClipRequest) and own.held is None
    }
    shared = clip_batch.draft_predictions(model, predicted)
    rest = [own for place, own in enumerate(every) if place not in shared]
    alone = iter(_each(partial(clip_batch.draft, model), rest))
    return [shared[place] if place in shared else next(alone) for place in range(len(every))]


def _each(
    make: Callable[[Given], Found], every: Iterable[Given | QueryError]
) -> list[Found | QueryError]:
    """Return what is made of each, or the error of those of which nothing can be made."""
    found: list[Found | QueryError] = []
    for own in every:
        cancellation.check()
        try:
            found.append(own if isinstance(own, QueryError) else make(own))
        except QueryError as fault:
            found.append(fault)
    return found


def _clips(model: Synthesizer, drafts: Sequence[ClipDraft]) -> list[ClipAnswer]:
    computed = _poses(model, drafts)
    answers = [
        poses.part(own, slice(len(draft.when))) for own, draft in zip(computed, drafts, strict=True)
    ]
    standing = [place for place, draft in enumerate(drafts) if draft.whole is not None]
    requests = [
        _stand_request(drafts[place], answers[place], computed[place]) for place in standing
    ]
    for place, answer in zip(standing, standing_feet.stand(model, requests), strict=True):
        answers[place] = answer
    return [_clip(model, *own) for own in zip(drafts, answers, strict=True)]


def _stand_request(
    draft: ClipDraft, answer: PoseAnswer[np.float64], computed: PoseAnswer[np.float64]
) -> StandRequest:
    """Return the request for standing feet. computed: at the frames, then at the plan's times."""
    assert draft.whole is not None
    own, whole = draft.request, poses.part(computed, slice(len(draft.when), None))
    return StandRequest(own.question, own.goals, answer, draft.whole, whole, own.asked.ground)


def _poses(model: Synthesizer, drafts: Sequence[ClipDraft]) -> list[PoseAnswer[np.float64]]:
    """Return the poses of motions at the times of their frames and of the plans of their feet."""
    held = [
        MotionTimes(own.request.question, own.held, own.times, own.trust)
        for own in drafts
        if own.held is not None
    ]
    computed = iter(model.solver.poses(held))
    return [next(computed) if own.predicted is None else own.predicted for own in drafts]


def _clip(model: Synthesizer, draft: ClipDraft, answer: PoseAnswer[np.float64]) -> ClipAnswer:
    """Return the clip of a motion with the poses of its frames."""
    asked = draft.request.asked
    if draft.request.routed and draft.way is not None:
        answer = _apply_root_options(model, answer, draft.way, asked)
    turns, path, offsets = answer.rotations, answer.root_position, answer.bone_offsets
    clip = assemble(draft.request.joints, turns, path, offsets, float(asked.fps))
    if answer.curves is not None:
        clip = replace(clip, curves=CurveValues(model.session.card.curves, answer.curves))
    return ClipAnswer(replace(clip, root_bone=asked.root_bone), answer.trust)


def check(model: Synthesizer, asked: ClipQuestion) -> None:
    """Raise the errors of `synthesize_clip` that are known before the duration of the clip is."""
    model.solver.constraints(model.question(asked), asked)
    standing_feet.wants_standing_feet(model.session.card, asked)
    clip_batch.named_skeleton(model, asked)
    poses.time_window(asked, model.durations[1])


def preview_clip(
    model: Synthesizer, asked: ClipQuestion, most: int = poses.MAX_POSES
) -> ClipPreview:
    """Return frame count, warnings and misses of a clip, without synthesising its frames.

    The duration comes from a call with this question alone, as in `synthesize_clip`: in a batch it
    differs in the last digit, and a question that ends with the clip could pass here and be refused
    later. Raises as `synthesize_clip` does.
    """
    question = model.question(asked)
    standing_feet.wants_standing_feet(model.session.card, asked)
    clip_batch.named_skeleton(model, asked)
    duration, misses = _duration_and_misses(model, question, asked)
    times = poses.sample_times(asked, duration, most)
    # A loop ends with its first frame again.
    warnings = question_validation.merge_warnings(
        question.warnings, question.deviations, asked.extrapolate
    )
    return ClipPreview(len(times) + asked.loop, warnings, misses)


def _duration_and_misses(
    model: Synthesizer, question: ValidatedQuestion, asked: ClipQuestion
) -> tuple[float, bool]:
    """Return the duration of a clip, s, and whether it misses a target.

    Constraints can change the duration, as a target speed does.
    """
    goals = model.solver.constraints(question, asked)
    strict = asked.extrapolate == "refuse" or model.session.card.cyclic
    if not (goals.targets or (goals and strict)):
        return clip_batch.duration(model, question), False
    held = model.solve_constraints(question, goals, asked.extrapolate)
    _, targets = split_results(held.results, len(goals.targets))
    misses = asked.extrapolate != "ok" and not all(met.reached for met in targets)
    return model.check_duration(held.duration), misses


def _apply_root_options(
    model: Synthesizer, answer: PoseAnswer[np.float64], way: Strides, asked: ClipQuestion
) -> PoseAnswer[np.float64]:
    """Return the answer in place, or closed to a loop, as the question requests."""
    stays = asked.root == "in_place" and model.session.card.root == "travelling"
    answer = poses.remove_travel(answer, way) if stays else answer
    return poses.close_loop(answer, None if stays else way) if asked.loop else answer
