"""Walkers, and the standing pose of each, made from its slowest cycle: no captured clip stands.

A walker is the gait of a model with one set of labels, and with controls at requested rates.

Trunk, head and arms have their mean rotations over the cycle. Each leg is that of the moment at
which the other foot passes it, so that its foot is flat; both feet are then brought beside each
other, and the knees a little straighter, by inverse kinematics.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import (
    UP,
    Bones,
    Floats,
    Indices,
    JointRotations,
    PerPoint,
    PointControls,
    PointLabels,
    RootPath,
    Rotations,
    Vector,
)
from posefield.common.value_cache import ValueCache
from posefield.feet import limbs
from posefield.feet.limbs import Limb, LimbPoses
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import ITERATIONS, Gait, requested_labels
from posefield.locomotion.stride import RelativePoses, Strides
from posefield.model_file.model_card import ModelCard
from posefield.motion import quat, skeleton
from posefield.question.motion_question import LabelValue, check_number, check_range
from posefield.synthesis import walking_feet
from posefield.validation.question_validation import label_weights

# Phases at which a cycle is averaged, and at which its feet are measured.
AVERAGED_PHASES, MEASURED_PHASES = 16, 60
# Largest deviation from the requested speed with given controls, as a share.
SPEED_TOLERANCE = 0.03


WalkerKey = tuple[str, bytes, bytes, tuple[tuple[int, float], ...]]


@dataclass(frozen=True)
class Walker:
    """The gait of a model with one set of labels, and controls at requested rates.

    weights: of the labels (1, p). offset: residual (d,) of the controls of its labels. given:
    values of controls by column.
    """

    gait: Gait
    weights: Annotated[Floats, "1 labels"]
    offset: Annotated[Floats, "controls"]
    given: Mapping[int, float]

    @property
    def card(self) -> ModelCard:
        """Card of the model."""
        return self.gait.session.card

    @property
    def key(self) -> WalkerKey:
        """Key of values that follow from the walker alone."""
        controls = tuple(sorted(self.given.items()))
        return self.gait.session.digest, self.weights.tobytes(), self.offset.tobytes(), controls

    def is_same(self, other: "Walker") -> bool:
        """Return whether another walker has the same labels and given controls."""
        same = self.gait.session is other.gait.session and dict(self.given) == dict(other.given)
        return same and bool(np.array_equal(self.weights, other.weights))

    def labels(self, count: int) -> PointLabels:
        """Return the weights (B, p) of the labels of B rows."""
        return np.repeat(self.weights, count, axis=0)

    def strides(self, controls: PointControls, level: int = 0) -> Strides:
        """Return the cycles of controls (B, d)."""
        return stride.strides(self.gait.session, controls, self.labels(len(controls)), level)

    def controls(self, speeds: PerPoint, turning: PerPoint) -> PointControls:
        """Return the controls (B, d) that lead to speeds (B,), m/s, and turning (B,), rad/s.

        Raises InvalidField if the given controls do not let the model walk at these speeds.
        """
        speed, turn = speeds, turning
        for _ in range(ITERATIONS):
            done = self.strides(self._mean_controls(speed, turn))
            speed, turn = speed + speeds - done.speeds, turn + turning - done.turning
        controls = self._mean_controls(speed, turn)
        if self.given:
            self._check_speeds(speeds, controls)
        return controls

    def _mean_controls(self, speeds: PerPoint, turning: PerPoint) -> PointControls:
        unseen = np.full(len(speeds), -1)
        controls = self.gait.mean_controls(speeds, turning, unseen) + self.offset
        for column, value in self.given.items():
            controls[:, column] = value
        return controls

    def _check_speeds(self, expected: PerPoint, controls: PointControls) -> None:
        speeds = self.strides(controls).speeds
        at = int(np.argmax(np.abs(speeds - expected)))
        if abs(speeds[at] - expected[at]) > SPEED_TOLERANCE * expected[at]:
            names = [self.card.controls[column].name for column in self.given]
            raise InvalidField(
                f"controls/{names[0]}",
                f"with it the model walks at {speeds[at]:.2f} m/s where {expected[at]:.2f} m/s is "
                "asked for; expected other controls than those of speed and turning",
            )

    def mean_offsets(self, controls: PointControls) -> Annotated[FloorVectors, "points"]:
        """Return the mean places (B,) of the root over a cycle, in the frame that travels."""
        phases = np.arange(AVERAGED_PHASES) / AVERAGED_PHASES
        labels = self.labels(len(controls))
        roots = stride.root_places(self.gait.session, controls, labels, phases)
        return np.asarray(roots.mean(axis=1))

    @cached_property
    def slowest(self) -> Annotated[Floats, "1 controls"]:
        """Controls (1, d) of the slowest walk straight ahead."""
        return self._mean_controls(np.array([self.gait.region.speeds[0]]), np.zeros(1))

    @cached_property
    def double_supports(self) -> Annotated[Floats, "phases"]:
        """Phases at which all feet stand, at the slowest speed: one in each half of the cycle.

        They are where the smallest probability of a contact is largest, or, for a model without
        contacts, where the fastest foot is slowest. Empty for a model without feet.
        """
        if not self.card.feet:
            return np.zeros(0)
        controls, phases = self.slowest, np.arange(MEASURED_PHASES) / MEASURED_PHASES
        by_contacts = len(walking_feet.foot_contacts(self.card)) > 1
        values = self._swings(controls, phases) if by_contacts else self._paces(controls, phases)
        return phases[_lowest(values)]

    def _swings(
        self, controls: Annotated[Floats, "1 controls"], phases: Annotated[Floats, "phases"]
    ) -> Annotated[Floats, "phases"]:
        """Return the largest probability (B,) that a foot does not stand, at phases (B,)."""
        columns = [
            self.card.contacts.index(contact) for contact in walking_feet.foot_contacts(self.card)
        ]
        rows, labels = np.repeat(controls, len(phases), axis=0), self.labels(len(phases))
        session = self.gait.session
        likely = stride.contact_probabilities(session, rows, labels, phases)
        return np.asarray(1.0 - likely[:, columns].min(axis=1))

    def _paces(
        self, controls: Annotated[Floats, "1 controls"], phases: Annotated[Floats, "phases"]
    ) -> Annotated[Floats, "phases"]:
        """Return the distances (B,), m, of the fastest foot from phases (B,) to the next ones."""
        rows, labels = np.repeat(controls, len(phases), axis=0), self.labels(len(phases))
        session, done = self.gait.session, self.strides(controls)
        posed = stride.synthesize_poses(session, rows, labels, phases)
        roots = posed.places + phases * done.travels[0]
        bones = stride.bones(session, controls, self.labels(1)).astype(float)
        local = skeleton.translations(bones, floor_plane.at_height(roots, posed.heights)[None])
        joints = skeleton.positions(self.card.skeleton.parents, posed.rotations[None], local)[0]
        feet = floor_plane.project(joints[:, list(self.card.feet)])
        after = np.vstack([feet[1:], feet[:1] + done.travels[0]])
        return np.asarray(np.abs(after - feet).max(axis=1))


def _lowest(values: Annotated[Floats, "phases"]) -> Annotated[Indices, "some"]:
    """Return the places of the lowest local minima of a cycle, more than a quarter apart."""
    half = len(values) / 2.0
    minima = (values <= np.roll(values, 1)) & (values < np.roll(values, -1))
    chosen: list[int] = []
    for index in sorted(np.flatnonzero(minima).tolist(), key=lambda index: float(values[index])):
        distances = [abs((index - one + half) % (2.0 * half) - half) for one in chosen]
        if len(chosen) < 2 and all(gap > 0.5 * half for gap in distances):
            chosen.append(index)
    return np.array(sorted(chosen), dtype=np.int64)


def find_walker(
    gait: Gait, labels: Mapping[str, LabelValue], controls: Mapping[str, float]
) -> Walker:
    """Return the walker with names or weights by label set, and given controls by name.

    Raises InvalidField for labels and controls that the model does not have.
    """
    card = gait.session.card
    weights = label_weights(card, None, labels)
    names = [control.name for control in card.controls]
    given_controls = {}
    for name, value in controls.items():
        field = f"controls/{name}"
        if name not in names:
            problem = f"unknown control{did_you_mean(name, names)}"
            raise InvalidField(field, f"{problem}, expected one of {', '.join(names)}")
        bounds = card.controls[names.index(name)]
        number = check_number(field, value)
        check_range(field, number, bounds.minimum, bounds.maximum, bounds.unit)
        given_controls[names.index(name)] = number
    # The mean residual of the controls for the labels; zeros for none.
    offset = np.zeros(gait.performer_offsets.shape[1])
    shares = requested_labels(card, labels).shares if labels else None
    if shares is not None and shares.any():
        offset = np.asarray(shares @ gait.performer_offsets[:-1] / max(1.0, shares.sum()))
    return Walker(gait, weights, offset, given_controls)


PHASES = 30
"""Phases of the cycle at which the poses are evaluated."""
# Walkers whose standing poses are kept, by model, labels and given controls; 3 kB each.
KEPT = 64
LEFT = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class FootPassing:
    """Moment of the cycle at which the swinging foot is beside the standing one.

    phase: of the cycle. swinging: leg, by place.
    """

    phase: float
    swinging: int


@dataclass(frozen=True)
class StandingPose:
    """Pose with both feet on the floor, in the frame that travels with the walker.

    parents: of the joints. bones: offsets (J, 3), m. legs: of the two feet, in the order of the
    passages' contacts. passings: of a cycle. rotations: (J, 4). height: of the root, m. place: of
    the root over the floor. balls: of the feet over the floor (2,). levels: heights of the balls
    (2,), m.
    """

    parents: tuple[int, ...]
    bones: Bones
    legs: tuple[Limb, Limb]
    passings: tuple[FootPassing, FootPassing]
    rotations: JointRotations
    height: float
    place: complex
    balls: Annotated[FloorVectors, "2"]
    levels: Annotated[Floats, "2"]


def find_standing_pose(walker: Walker) -> StandingPose | None:
    """Return the standing pose of a walker; None for a model without two feet that step in turn."""
    return _kept.find(walker.key, lambda: _made(walker))


_kept: ValueCache[WalkerKey, StandingPose | None] = ValueCache(KEPT)


def _made(walker: Walker) -> StandingPose | None:
    contacts = walking_feet.foot_contacts(walker.card)
    if len(contacts) != 2:
        return None
    parents = walker.card.skeleton.parents
    session, controls = walker.gait.session, walker.slowest
    bones = stride.bones(session, controls, walker.labels(1))[0].astype(np.float64)
    legs = [
        limbs.find_limb(parents, bones, contact.joint, walker.card.hinges) for contact in contacts
    ]
    phases = np.arange(PHASES) / PHASES
    rows = np.repeat(controls, PHASES, axis=0)
    posed = stride.synthesize_poses(session, rows, walker.labels(PHASES), phases)
    if legs[0] is None or legs[1] is None:
        return None
    cycle = _Cycle(parents, bones, (legs[0], legs[1]), posed)
    passings = _passings(cycle) if len(walker.double_supports) == 2 else None
    if passings is None:
        return None
    return _stand(cycle, passings)


@dataclass(frozen=True)
class _Cycle:
    """Poses of one cycle of a walker, at even phases."""

    parents: tuple[int, ...]
    bones: Bones
    legs: tuple[Limb, Limb]
    posed: RelativePoses

    def evaluate(self, rotations: Rotations, roots: RootPath) -> LimbPoses:
        """Return the limbs in poses (F, J, 4) with roots (F, 3), m."""
        tips = [leg.tip for leg in self.legs]
        return limbs.evaluate_joints(self.parents, self.bones, tips, rotations, roots)

    @cached_property
    def roots(self) -> RootPath:
        """Roots (F, 3), m."""
        return floor_plane.at_height(self.posed.places, self.posed.heights)

    @cached_property
    def poses(self) -> LimbPoses:
        """Limbs in all poses."""
        return self.evaluate(self.posed.rotations, self.roots)


def _passings(cycle: _Cycle) -> tuple[FootPassing, FootPassing] | None:
    """Return the moments at which the feet pass each other; None if they do not do so twice."""
    forward = [floor_plane.project(cycle.poses.position(leg.tip)).real for leg in cycle.legs]
    gap = forward[0] - forward[1]
    later = np.roll(gap, -1)
    rows = np.flatnonzero((gap < 0.0) != (later < 0.0))
    if len(rows) != 2:
        return None
    first, second = (_passing(gap, later, int(row)) for row in rows)
    return (first, second) if first.swinging != second.swinging else None


def _passing(
    gap: Annotated[Floats, "phases"], later: Annotated[Floats, "phases"], row: int
) -> FootPassing:
    """Return the passing between a phase and the next one; the foot that gets ahead swings."""
    phase = (row + float(gap[row] / (gap[row] - later[row]))) / len(gap)
    return FootPassing(phase, 0 if gap[row] < 0.0 else 1)


@dataclass(frozen=True)
class _StandingLeg:
    """Leg on which a walker stands while the other foot passes, in the frame that travels.

    rotations: of the joints of the leg, by joint (L, 4). foot: orientation (4,) of its end. ball:
    over the floor. level: height of the ball, m. arm: from the leg's end to the ball (3,), m.
    chord: distance from the hip to the leg's end in standing, m: halfway between that at this
    moment, at which a walker's standing leg is bent most, and the longest one.
    """

    rotations: Annotated[Floats, "some 4"]
    foot: Annotated[Floats, "4"]
    ball: complex
    level: float
    arm: Vector
    chord: float

    def ankle(self, ball: complex) -> Vector:
        """Return the place (3,), m, of the leg's end with the ball of the foot at a floor point."""
        ankle: Vector = (
            floor_plane.at_height(np.array([ball]), np.array([self.level]))[0] - self.arm
        )
        return ankle


def _standing_leg(
    cycle: _Cycle, leg: int, passings: tuple[FootPassing, FootPassing]
) -> _StandingLeg:
    """Return a leg at the moment at which the other foot passes it."""
    (phase,) = (passing.phase for passing in passings if passing.swinging != leg)
    at = phase * PHASES
    rows = np.array([int(at), int(at) + 1]) % PHASES
    share = np.array([at - int(at)])
    before, after = cycle.posed.rotations[rows][:, None]
    rotations = quat.nlerp(before, after, share)
    roots = (1.0 - share) * cycle.roots[rows[:1]] + share * cycle.roots[rows[1:]]
    poses, limb = cycle.evaluate(rotations, roots), cycle.legs[leg]
    chords = cycle.poses.position(limb.lower) - cycle.poses.position(limb.upper)
    hip, end, ball = (poses.position(passing)[0] for passing in (limb.upper, limb.lower, limb.tip))
    return _StandingLeg(
        rotations[0, _below(cycle.parents, limb)],
        poses.orientation(limb.lower)[0],
        complex(floor_plane.project(ball)),
        float(ball @ UP),
        ball - end,
        0.5 * float(np.linalg.norm(end - hip) + np.linalg.norm(chords, axis=-1).max()),
    )


def _below(parents: tuple[int, ...], leg: Limb) -> Indices:
    return np.flatnonzero(skeleton.descendant_matrix(parents)[leg.upper])


def _stand(
    cycle: _Cycle,
    passings: tuple[FootPassing, FootPassing],
) -> StandingPose:
    """Return the pose in which both feet stand, beside each other."""
    stood = [_standing_leg(cycle, leg, passings) for leg in range(2)]
    rotations = quat.mean(cycle.posed.rotations)
    for leg, standing in zip(cycle.legs, stood, strict=True):
        rotations[_below(cycle.parents, leg)] = standing.rotations
    root_place = complex(cycle.posed.places.mean())
    root = np.array([root_place.imag, 0.0, root_place.real])
    poses = cycle.evaluate(rotations[None], root[None])
    stances = np.array([standing.ball for standing in stood])
    balls = stances.real.mean() + 1j * _sides(poses, cycle.legs, stances.imag)
    ankles = [standing.ankle(complex(ball)) for standing, ball in zip(stood, balls, strict=True)]
    heights = []
    for leg, ankle, standing in zip(cycle.legs, ankles, stood, strict=True):
        # The height of the root at which the leg has its length; it is at 0 here.
        hip = poses.position(leg.upper)[0]
        level = float(np.sum(np.square((hip - ankle) * (1.0 - UP))))
        up = math.sqrt(max(standing.chord**2 - level, 0.0))
        heights.append(float((ankle - hip) @ UP) + up)
    poses = cycle.evaluate(rotations[None], (root + min(heights) * UP)[None])
    for leg, ankle, standing in zip(cycle.legs, ankles, stood, strict=True):
        upper, middle, lower = limbs.solve(poses, leg, ankle - poses.position(leg.upper))
        turned = quat.mul(quat.conj(poses.orientation(leg.lower)), standing.foot)
        rotations[leg.upper], rotations[leg.middle] = upper[0], middle[0]
        rotations[leg.lower] = quat.mul(lower, turned)[0]
    levels = np.array([standing.level for standing in stood])
    pose = rotations, min(heights), root_place
    feet = balls, levels
    return StandingPose(cycle.parents, cycle.bones, cycle.legs, passings, *pose, *feet)


def _sides(
    poses: LimbPoses, legs: tuple[Limb, Limb], walked: Annotated[Floats, "2"]
) -> Annotated[Floats, "2"]:
    """Return how far the feet stand to the left (2,), m, with the root over their middle.

    walked: how far to the left they are in the walk (2,), m. Walkers set one foot nearly before the
    other one; in standing the feet are halfway from there to the width of the hips.
    """
    hips = np.array([poses.position(leg.upper)[0] @ LEFT for leg in legs])
    width = 0.5 * (hips[0] - hips[1] + walked[0] - walked[1])
    sides: Floats = np.array([0.5, -0.5]) * width + float(poses.position(0)[0] @ LEFT)
    return sides
