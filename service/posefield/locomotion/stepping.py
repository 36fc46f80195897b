"""Steps that no capture shows: in place, round corners, sideways, backwards, and standing.

A model's stride travels forward at its captured speeds and rates of turning. What a person does
beyond that, such as a turn on the spot, is done in steps: the phase of the cycle advances with the
turn and with the way to the side as with the distance, the legs turn about the vertical so that
each foot keeps its heading while it stands, and the planner of feet sets the feet under the body.
Between steps the pose is blended into a standing one.
"""

from dataclasses import dataclass, replace
from typing import Annotated, TypeVar

import numpy as np

from posefield.common.units import UP, CharacterFrames, Floats, Frames, Indices
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.stride import RelativePoses
from posefield.motion import quat, skeleton

TURN_OF_CYCLE = 2.0
"""Turn on the spot of one cycle, two steps, rad."""
SIDE_OF_CYCLE = 0.4
"""Way to the side of one cycle, m: feet do not cross."""
MOST_CADENCE = 1.3
"""Most cycles a second of steps that are not forward."""
POWER = 3.0
"""Exponent of the sum of the cadences of the way forward, to the side, and of the turn."""
LEG_SHARE = 0.9
"""Length of a leg over the height of the root."""
LEAST_SHARE = 1e-9
"""Share of the standing pose from which on a pose is blended."""
Numbers = TypeVar("Numbers", Floats, FloorVectors)
SWING = 0.36
"""Share of the cycle in which a foot swings and takes a new heading."""


@dataclass(frozen=True)
class StandingPoses:
    """Standing poses of C combinations of labels, in the frames that travel.

    rotations: (C, J, 4). heights: of the roots (C,), m. points: of the roots over the floor (C,).
    hips: upper joint of each leg. sides: 1 for the left foot, -1 for the right one (2,). passings:
    phase at which each foot swings past the other (C, 2). supports: phases of double support (C,
    2).
    """

    rotations: Annotated[Floats, "combinations joints 4"]
    heights: Annotated[Floats, "combinations"]
    points: Annotated[FloorVectors, "combinations"]
    hips: tuple[int, ...]
    sides: Annotated[Floats, "2"]
    passings: Annotated[Floats, "combinations 2"]
    supports: Annotated[Floats, "combinations 2"]


@dataclass(frozen=True)
class Stepping:
    """Steps and standing of N characters in F frames.

    shares: of the standing pose (N, F). firm: share (N, F) to which both feet stand. turns: of each
    leg about the vertical (N, F, 2), rad. shifts: of each foot (N, F, 2), m, in the frame that
    travels.
    """

    poses: StandingPoses
    parents: tuple[int, ...]
    shares: CharacterFrames
    firm: CharacterFrames
    turns: Annotated[Floats, "characters frames 2"]
    shifts: Annotated[FloorVectors, "characters frames 2"]

    def part(self, begin: int, end: int) -> "Stepping":
        """Return the frames from `begin` until before `end`."""
        names = "shares", "firm", "turns", "shifts"
        return replace(self, **{name: getattr(self, name)[:, begin:end] for name in names})

    def apply(
        self,
        pair: tuple[Annotated[Indices, "poses"], Annotated[Indices, "poses"]],
        combinations: Annotated[Indices, "poses"],
        walked: RelativePoses,
    ) -> RelativePoses:
        """Return walked poses (K) of pairs of a character and a frame with steps and standing.

        combinations: of labels of each pose (K,).
        """
        share, poses = self.shares[pair], self.poses
        # Shares are averages, whose rounding leaves no zero to who walks.
        rotations, some = walked.rotations.copy(), np.flatnonzero(share > LEAST_SHARE)
        standing = poses.rotations[combinations[some]]
        rotations[some] = quat.nlerp(rotations[some], standing, share[some])
        heights = walked.heights + share * (poses.heights[combinations] - walked.heights)
        points = walked.places + share * (poses.points[combinations] - walked.places)
        lengths = LEG_SHARE * poses.heights[combinations]
        shifts = self.shifts[pair] / lengths[:, None]
        turn_legs(self.parents, rotations, poses.hips, self.turns[pair], shifts)
        return replace(walked, rotations=rotations, heights=heights, places=points)


def turn_legs(
    parents: tuple[int, ...],
    rotations: Annotated[Floats, "poses joints 4"],
    hips: tuple[int, ...],
    turns: Annotated[Floats, "poses legs"],
    tilts: Annotated[FloorVectors, "poses legs"],
) -> None:
    """Turn the legs of poses (K, J, 4) about the vertical through their hips (K, 2), rad.

    tilts: sideways and ahead, by angles (K, 2) towards a direction over the floor, rad.
    """
    for leg, hip in enumerate(hips):
        above = rotations[:, 0]
        for joint in skeleton.joint_chain(parents, hip)[1:-1]:
            above = quat.mul(above, rotations[:, joint])
        # A foot below the hip moves towards x as the leg turns about z.
        tilt = tilts[:, leg]
        axis = np.stack([-tilt.real, np.zeros(len(tilt)), tilt.imag], axis=-1)
        turn = quat.mul(quat.exp(axis), quat.from_axis_angle(UP, turns[:, leg]))
        turned = quat.mul(turn, quat.mul(above, rotations[:, hip]))
        rotations[:, hip] = quat.mul(quat.conj(above), turned)


def cadences(
    forward: Annotated[Floats, "*frames"],
    side: Annotated[Floats, "*frames"],
    turning: Annotated[Floats, "*frames"],
    strides: tuple[Annotated[Floats, "*frames"], Annotated[Floats, "*frames"]],
    slowest: float,
) -> Annotated[Floats, "*frames"]:
    """Return the cycles a second (F,) at velocities forward and to the side (F,), m/s.

    turning: beyond that of the model (F,), rad/s. strides: their lengths (F,), m, and durations
    (F,), s, at these speeds. slowest: of the model's speeds, m/s; below it strides get shorter and
    slower alike.
    """
    speed = np.abs(forward)
    walked = np.where(speed >= slowest, speed / strides[0], np.sqrt(speed / slowest) / strides[1])
    other = np.hypot(side / SIDE_OF_CYCLE, turning / TURN_OF_CYCLE)
    stepped = MOST_CADENCE * np.tanh(other / MOST_CADENCE)
    return np.asarray((walked**POWER + stepped**POWER) ** (1.0 / POWER))


def stances(
    phases: Frames, passings: Annotated[Floats, "2"]
) -> tuple[Annotated[Floats, "frames 2"], Annotated[Floats, "frames 2"]]:
    """Return the phases of the middle of each foot's last stance (F, 2), and shares of the next.

    phases: of the cycle (F,), without wrapping. passings: phase at which each foot swings past the
    other one. The next stance is a cycle later; the share (F, 2) grows while the foot swings.
    """
    cycles = phases[:, None] - passings
    swing = np.round(cycles)
    share = quat.smoothstep(np.clip((cycles - swing) / SWING + 0.5, 0.0, 1.0))
    return passings + swing - 0.5, share


def stepped(
    phases: Frames, beyond: Annotated[Numbers, "*frames"], passings: Annotated[Floats, "2"]
) -> Annotated[Numbers, "frames 2"]:
    """Return the changes of both legs (F, 2) with which feet keep their places in stances.

    phases, passings: as of `stances`. beyond: turns, rad, or ways, m, of the body beyond those of
    the model (F,), or of each foot (F, 2). A foot has the place of the body in the middle of its
    stance, and goes to the next one while it swings, round turns on a bow past the other leg: half
    as far aside as the body, since more raises peaks of accelerations.
    """
    middles, shares = stances(phases, passings)
    changes = np.empty((len(phases), 2), beyond.dtype)
    # Phases may rest, where the body does, too.
    rising = phases + 1e-9 * np.arange(len(phases))
    of_feet = np.broadcast_to(beyond.T, changes.T.shape)
    for foot, (middle, share, way) in enumerate(zip(middles.T, shares.T, of_feet, strict=True)):
        before, halfway, after = (np.interp(middle + c, rising, way) for c in (0.0, 0.5, 1.0))
        bow = halfway - 0.5 * (before + after)
        bow[(middle < rising[0]) | (middle + 1.0 > rising[-1])] = 0.0
        changes[:, foot] = before + share * (after - before + 2.0 * (1.0 - share) * bow) - way
    return changes
