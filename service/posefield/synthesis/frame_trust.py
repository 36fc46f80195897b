"""Trust of the frames of a clip: its targets, its duration and stances as the frames show them."""

from dataclasses import replace
from typing import Annotated

import numpy as np
from msgspec import structs

from posefield.common.units import Floats, round_micrometres
from posefield.constraints.gauss_newton import MISS_TOLERANCE
from posefield.constraints.targets import JointTarget
from posefield.motion import skeleton
from posefield.question.results import ConstraintResult, FeetResult, Trust, split_results
from posefield.synthesis import synthesizer
from posefield.synthesis.clip_draft import ClipDraft
from posefield.synthesis.event_frames import ROUNDING
from posefield.synthesis.synthesizer import Synthesizer


def of_frames(model: Synthesizer, draft: ClipDraft) -> Trust:
    """Return the trust of a draft's answer, whose root still travels, as its frames show it."""
    trust = draft.answer.trust
    if draft.target_times:
        trust = _with_targets(model, draft, trust)
    shifts = draft.shifts
    if draft.question.loop:
        # It is played in whole steps; the duration of its trust is the motion's.
        stretch = max(np.abs(shifts).max(), abs(len(shifts) / draft.rate - trust.duration))
        return structs.replace(trust, stretch=round_micrometres(stretch) or None)
    stretch = round_micrometres(np.abs(shifts).max())
    if not stretch and abs(draft.duration - trust.duration) * draft.rate < ROUNDING:
        return trust
    feet = trust.feet and _at_frames(draft, trust.feet)
    return structs.replace(trust, duration=draft.duration, stretch=stretch or None, feet=feet)


def _at_frames(draft: ClipDraft, feet: FeetResult) -> FeetResult:
    """Return feet with the times of their stances in the clip instead of in the motion."""

    def played(time: float) -> float:
        return round_micrometres(time + np.interp(time, draft.times, draft.shifts))

    stances = tuple(
        replace(stance, begin=played(stance.begin), end=played(stance.end))
        for stance in feet.stances
    )
    return structs.replace(feet, stances=stances)


def _with_targets(model: Synthesizer, draft: ClipDraft, trust: Trust) -> Trust:
    """Return the trust with the misses of targets in the frames nearest to their moments.

    A target at a moment without a frame, before or after those of the clip, has its miss in the
    motion.
    """
    answer, targets = draft.answer, draft.constraints.targets if draft.constraints else ()
    controls, solved = split_results(trust.targets, len(targets))
    gaps = np.abs(np.subtract.outer(draft.target_times, draft.times))
    frames = gaps.argmin(axis=1)
    positions = skeleton.positions(
        model.session.card.skeleton.parents,
        answer.rotations[frames],
        skeleton.translations(answer.bone_offsets, answer.root_position[frames]),
    )
    shown = tuple(
        result if gap * draft.rate > 0.5 + ROUNDING else _result(target, result, pose)
        for target, result, gap, pose in zip(
            targets, solved, gaps.min(axis=1), positions, strict=True
        )
    )
    misses = synthesizer.miss_warnings(solved)
    warnings = [sentence for sentence in trust.warnings if sentence not in misses]
    if draft.question.extrapolate != "ok":
        warnings += synthesizer.miss_warnings(shown)
    return structs.replace(trust, targets=(*controls, *shown), warnings=tuple(warnings))


def _result(
    target: JointTarget, solved: ConstraintResult, pose: Annotated[Floats, "joints 3"]
) -> ConstraintResult:
    """Return the result of a target in a frame with joints at positions (J, 3), m."""
    away = pose[list(target.moment.joints)].mean(axis=0) - target.position
    miss = float(np.linalg.norm(away))
    return replace(solved, miss=miss, reached=miss <= MISS_TOLERANCE)
