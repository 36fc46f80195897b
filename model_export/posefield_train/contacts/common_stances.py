"""Stances that the gaits of a robot have in common: points of its soles and when they stand."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Booleans, ClipTravel, Floats
from posefield.motion import contact_detection, quat, skeleton
from posefield.motion.clip import assemble
from posefield.motion.contact_detection import ContactThresholds
from posefield.robots import robot_clip, standing_soles
from posefield.robots.robot import Foot, Robot
from posefield.robots.standing_soles import SolePoint
from posefield_train.align.time_alignment import AlignedClips

THRESHOLDS = ContactThresholds(
    speed=0.06, height=0.015, grown_speed=0.12, grown_height=0.02, shortest=0.06, shortest_gap=0.04
)
BAND = 0.01
"""Height above the lowest point of a standing foot within which its sole lies, m."""
SOLE_HINGES = 5
"""Hinges of a leg that can hold a sole; of one with fewer the middle of the foot stands."""
AGREEMENT = 0.9
"""Share of the frames in which a gait agrees with most others, from which stances are common."""

MOST = 0.75
"""Share of the gaits in which a point stands in a frame from which it stands in all."""


@dataclass(frozen=True)
class CommonStances:
    """Sole points, empty where gaits have no stances in common, and notes that say so."""

    points: tuple[SolePoint, ...] = ()
    notes: tuple[str, ...] = ()


def find(robot: Robot | None, aligned: AlignedClips, travels: ClipTravel | None) -> CommonStances:
    """Return the stances of the gaits of a robot; none for others, nor without cycles.

    aligned: without their travels (N, 3); None for motions without cycles.
    """
    if robot is None:
        return CommonStances()
    if travels is None or aligned.rotations.shape[1] < 2:
        return CommonStances(notes=("feet are as predicted: only those of cycles stand",))
    positions, rotations = _bodies(robot, aligned, travels)
    rates = (positions.shape[1] - 1) / aligned.durations
    points, notes = list[SolePoint](), list[str]()
    for foot in robot.feet:
        of_foot, agreement = _of_foot(robot, foot, positions, rotations, rates)
        if not of_foot:
            notes.append(
                f"{robot.bodies[foot.body]} is as predicted: the gaits agree on its stances in "
                f"{100 * agreement:.0f} % of the frames, expected {100 * AGREEMENT:.0f} %"
            )
        points += of_foot
    return CommonStances(tuple(points), tuple(notes))


def _bodies(robot: Robot, aligned: AlignedClips, travels: ClipTravel) -> tuple[Floats, Floats]:
    """Return positions (N, T, B, 3), m, and rotations (N, T, B, 4) of bodies on canonical time."""
    share = np.linspace(0.0, 1.0, aligned.rotations.shape[1])
    rig, poses = robot_clip.of(robot), []
    for turns, path, travel in zip(aligned.rotations, aligned.root_path, travels, strict=True):
        turned, root = skeleton.add_travel(turns, path, share[:, None] * travel)
        clip = assemble(rig.skeleton, turned, root, rig.skeleton.offsets, float(len(share)))
        poses.append(rig.motion(clip, "example").body_poses(robot))
    positions, rotations = (np.stack(arrays) for arrays in zip(*poses, strict=True))
    return positions, rotations


def _of_foot(
    robot: Robot, foot: Foot, positions: Floats, rotations: Floats, rates: Floats
) -> tuple[list[SolePoint], float]:
    """Return the points of a foot that stand, and how far the gaits agree on when they do."""
    origins, turns = positions[:, :, foot.body], rotations[:, :, foot.body]
    corners = _sole(robot, foot, origins, turns, rates)
    points, worst = list[SolePoint](), 1.0
    for point in corners:
        path = origins + quat.rotate(turns, point)
        contacts = _contacts(path, rates)
        share = contacts.mean(axis=0)
        agreement = float(np.mean(np.maximum(share, 1.0 - share)))
        worst = min(worst, agreement)
        runs = contact_detection.runs(share >= MOST, cyclic=True)
        stances = [(int(run[0]), int(run[0]) + len(run) - 1) for run in runs]
        if agreement < AGREEMENT or not runs or len(runs[0]) == len(share):
            continue
        x, y, z = map(float, point)
        points.append(SolePoint(foot.body, (x, y, z), tuple(sorted(stances))))
    return points, worst


def _contacts(path: Floats, rates: Floats) -> Annotated[Booleans, "clips steps"]:
    """Return whether a point with paths (N, T, 3), m, stands, in frames 0 to T - 2 of each."""
    # The vertical comes second there.
    upright = path[..., [0, 2, 1]]
    return np.stack(
        [
            contact_detection.detect_contacts(one, rate, True, thresholds=THRESHOLDS)[:-1]
            for one, rate in zip(upright, rates.tolist(), strict=True)
        ]
    )


def _sole(robot: Robot, foot: Foot, origins: Floats, turns: Floats, rates: Floats) -> Floats:
    """Return the points (P, 3), m, of a foot that can stand: corners of its sole, or its middle."""
    middle = foot.points.mean(axis=0)
    standing = _contacts(origins + quat.rotate(turns, middle), rates)
    if not standing.any():
        standing = np.ones_like(standing)
    up = quat.rotate(quat.conj(turns[:, :-1][standing]), np.array([0.0, 0.0, 1.0])).mean(axis=0)
    up /= np.linalg.norm(up)
    heights = foot.points @ up
    sole = foot.points[heights < heights.min() + BAND]
    chain = standing_soles.legs(robot, [SolePoint(foot.body, (0.0, 0.0, 0.0), ())])[0]
    if len(chain.hinges) < SOLE_HINGES:
        return sole.mean(axis=0, keepdims=True)
    level = sole - sole.mean(axis=0)
    level -= np.outer(level @ up, up)
    _, sizes, axes = np.linalg.svd(level, full_matrices=False)
    across = level @ axes[:2].T / sizes[:2]
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    return sole[np.unique(np.argmax(across @ signs.T, axis=0))]
