"""Clips of robots: joints within their limits, and soles that stand."""

from dataclasses import replace

import numpy as np
from msgspec import structs

from posefield.common.units import Floats, Frames
from posefield.motion import quat
from posefield.motion.clip import assemble
from posefield.question.results import FeetResult, StanceResult, round_micrometres
from posefield.robots import robot_clip
from posefield.robots.robot_clip import RobotSkeleton
from posefield.robots.robot_motion import RobotMotion
from posefield.robots.standing_soles import SolePoint
from posefield.synthesis import poses
from posefield.synthesis.clip_draft import ClipDraft
from posefield.synthesis.synthesizer import Synthesizer

WARP_STEPS = 600
"""Steps of time in which the times of canonical frames are looked up."""


def keep_to_robot(model: Synthesizer, draft: ClipDraft) -> None:
    """Solve the legs of an answer so that its soles stand, within the limits of all joints.

    The change of the angles at each canonical frame of the cycle is that of all evaluations of the
    model, and is linear between the frames, as the prediction is.
    """
    card, soles = model.session.card, model.soles
    assert card.robot is not None and soles is not None
    rig = robot_clip.of(card.robot)
    answer = draft.answer
    motion = _motion(rig, answer.rotations, answer.root_position, draft.rate)
    draft.unlimited = motion
    angles = motion.angles
    if card.soles:
        grid = np.linspace(0.0, answer.trust.duration, WARP_STEPS + 1)
        frames = _frames(model, draft, grid)
        times = np.interp(np.arange(float(card.frames)), frames, grid)
        cycle = _motion(rig, *_poses(model, draft, times), draft.rate)
        turns = quat.to_matrix(cycle.base_rotations)
        standing = soles.corrected(cycle.base_path, turns, cycle.angles)
        changes = standing - soles.limited(cycle.angles)
        angles = angles + quat.interpolate_rows(changes, _frames(model, draft, answer.times))
        result = _result(rig, card.soles, cycle, replace(cycle, angles=standing), grid[-1])
        trust = structs.replace(answer.trust, feet=result)
        answer = replace(answer, trust=trust)
    limited = replace(motion, angles=soles.limited(angles))
    rotations = answer.rotations.copy()
    joints = list(rig.hinge_joints)
    rotations[:, joints] = rig.joint_motion(limited)[0][:, joints]
    draft.answer = replace(answer, rotations=rotations)


def _motion(rig: RobotSkeleton, rotations: Floats, root: Floats, rate: float) -> RobotMotion:
    skeleton = rig.skeleton
    clip = assemble(skeleton, rotations, root, skeleton.offsets, rate)
    return rig.motion(clip, "clip")


def _frames(model: Synthesizer, draft: ClipDraft, times: Frames) -> Frames:
    """Return the canonical frames (S,) of times (S,), s, of the motion of a draft."""
    question, motion = draft.validated, draft.motion
    if motion is not None:
        times = times * (motion.state.duration / motion.duration)
    return model.session.state(question.point, times, question.labels, question.level).frames


def _poses(model: Synthesizer, draft: ClipDraft, times: Frames) -> tuple[Floats, Floats]:
    """Return the predicted rotations (S, J, 4) and root positions (S, 3), m, at times (S,), s."""
    if draft.motion is not None:
        question, trust = draft.validated, draft.answer.trust
        (answer,) = model.solver.poses([(question, draft.motion, times, trust)])
        return answer.rotations, answer.root_position
    (row,) = poses.predict_frames(model, [draft.validated], [times])
    return row[0].astype(np.float64), row[1].astype(np.float64)


def _result(
    rig: RobotSkeleton,
    points: tuple[SolePoint, ...],
    before: RobotMotion,
    after: RobotMotion,
    duration: float,
) -> FeetResult:
    """Return the facts about standing feet of a cycle as predicted and as given."""
    robot, steps = rig.robot, len(before) - 1
    pairs = [motion.body_poses(robot) for motion in (before, after)]
    skates, drifts, stances = [], [0.0], list[StanceResult]()
    for index, point in enumerate(points):
        paths = [
            positions[:, point.body] + quat.rotate(turns[:, point.body], np.array(point.position))
            for positions, turns in pairs
        ]
        for first, last in point.stances:
            # Of a stance that goes on in the next cycle, the part in this one.
            frames = slice(first, min(last, steps) + 1)
            level = [path[frames, :2] for path in paths]
            skates.append([np.linalg.norm(np.diff(xy, axis=0), axis=-1).mean() for xy in level])
            offsets = level[1] - level[1].mean(axis=0)
            drifts.append(float(np.linalg.norm(offsets, axis=-1).max()))
            if index == 0 or points[index - 1].body != point.body:
                middle = min((first + last) // 2, steps)
                x, y, z = map(round_micrometres, pairs[1][0][middle, point.body].tolist())
                name = robot.bodies[point.body]
                begin, end = (round_micrometres(f / steps * duration) for f in (first, last))
                stances.append(StanceResult(name, begin, end, (y, z, x)))
    speeds = np.mean(skates, axis=0) * (steps / duration)
    skate_before, skate = map(round_micrometres, speeds.tolist())
    drift = round_micrometres(max(drifts))
    return FeetResult(tuple(stances), len(stances), skate_before, skate, drift, 0.0, 0.0, ())
