"""Holds: a character stops and stays in its pose for a time, such as with a hand at a shelf.

After an act that has an event, such as the grasp of a reach, it stops at the event; else at the end
of the motion so far, which slows down first. Targets that are met when it begins stay met until its
end.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import (
    UP,
    Bones,
    Floats,
    Frames,
    Indices,
    JointRotations,
    RootPath,
    Rotations,
    Vector,
)
from posefield.feet import limbs
from posefield.feet.limbs import Limb
from posefield.feet.stance_rows import STANDING
from posefield.kriging import random_field
from posefield.locomotion import floor_plane
from posefield.locomotion.stepping import LEAST_SHARE
from posefield.motion import quat, skeleton
from posefield.motion.hinges import Hinge
from posefield.motion.skeleton import Skeleton
from posefield.performance.limb_targets import WorldTarget
from posefield.performance.passage import RATE, Passage, concatenate
from posefield.performance.script import Script
from posefield.performance.timeline import Span, Timeline
from posefield.question import motion_question
from posefield.question.performance_question import Hold

LARGEST = np.radians(70.0)
"""Largest angle of the gaze to the side of the facing of the trunk, and up or down from it, rad."""
TRUNK, NECK = ("spine", "chest", "upperChest"), ("neck", "head")
TRUNK_SHARE = 0.3
"""Part of the turn that the trunk makes; neck and head make the rest, in equal parts."""
NEAREST = 0.2
"""Smallest distance of the point from the head, m."""
# The trunk moves the head, and with it the direction to the point.
ROUNDS = 8


@dataclass(frozen=True)
class Gaze:
    """Turn of the joints of a pose towards a point.

    shares: part of the turn by joint. turn: rotation vector (3,) in the world, rad. miss: angle by
    which the gaze stays beside the point, as the neck does not turn farther, rad.
    """

    shares: Mapping[int, float]
    turn: Vector
    miss: float

    def add(self, parents: tuple[int, ...], rotations: Rotations, weights: Frames) -> Rotations:
        """Return poses (F, J, 4) with the turn, of which a weight (F,) is made in each."""
        origins = np.zeros((*rotations.shape[:-2], len(parents), 3))
        _, turns = skeleton.forward_kinematics(parents, rotations, origins)
        turned = rotations.copy()
        for joint, share in self.shares.items():
            # All turns are about one axis, so that those of the joints add up.
            turn = quat.exp(share * weights[:, None] * self.turn)
            above = turns[:, parents[joint]] if parents[joint] >= 0 else quat.IDENTITY
            turned[:, joint] = quat.mul(quat.conj(above), quat.mul(turn, turns[:, joint]))
        return turned


@dataclass(frozen=True)
class HeldBody:
    """Skeleton of a character that stays in a pose, and can look.

    bones: offsets (J, 3), m. joints: by role. facing: of the rest pose, from +z to the left, rad.
    hinges: limits of its knees and elbows, as far as known.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    bones: Bones
    joints: Mapping[str, int]
    facing: float = 0.0
    hinges: tuple[Hinge, ...] = ()

    def look_at(self, rotations: JointRotations, root: Vector, point: Vector) -> Gaze:
        """Return the turn of a pose (J, 4) towards a point (3,), m, in the frame of the pose.

        Raises InvalidField for a skeleton without a joint in the role of the head, and for a point
        at the head.
        """
        if "head" not in self.joints:
            raise InvalidField(
                "look_at", "no joint has the role of the head, expected it in the recipe's [roles]"
            )
        gaze = Gaze(self._shares(), np.zeros(3), 0.0)
        for _ in range(ROUNDS):
            gaze = self._turned(gaze, rotations, root, point)
        return gaze

    def _shares(self) -> dict[int, float]:
        chain = skeleton.joint_chain(self.parents, self.joints["head"])
        trunk, neck = (
            [self.joints[role] for role in roles if self.joints.get(role) in chain]
            for roles in (TRUNK, NECK)
        )
        trunk_share = TRUNK_SHARE if trunk else 0.0
        return {joint: trunk_share / len(trunk) for joint in trunk} | {
            joint: (1.0 - trunk_share) / len(neck) for joint in neck
        }

    def _turned(self, gaze: Gaze, rotations: JointRotations, root: Vector, point: Vector) -> Gaze:
        """Return the turn towards a point, seen from where the head is after a turn."""
        head = self.joints["head"]
        forward = np.array([np.sin(self.facing), 0.0, np.cos(self.facing)])
        turned = gaze.add(self.parents, rotations[None], np.ones(1))[0]
        translations = skeleton.translations(self.bones, root[None])[0]
        positions, _ = skeleton.forward_kinematics(self.parents, turned, translations)
        _, turns = skeleton.forward_kinematics(self.parents, rotations, translations)
        away = point - positions[head]
        distance = float(np.linalg.norm(away))
        if distance < NEAREST:
            raise InvalidField(
                "look_at", f"{distance:.3g} m from the head, expected at least {NEAREST:g} m"
            )
        within = self._within(turns, away / distance)
        turn = quat.log(limbs.shortest_turn(quat.rotate(turns[head], forward), within))
        sine_and_cosine = np.linalg.norm(quat.cross(within, away)), within @ away
        return Gaze(gaze.shares, turn, float(np.arctan2(*sine_and_cosine)))

    def _within(self, turns: JointRotations, direction: Vector) -> Vector:
        """Return the direction (3,), at most `LARGEST` aside and up from the trunk's facing."""
        trunk = next((self.joints[role] for role in TRUNK[::-1] if role in self.joints), 0)
        frame = quat.mul(turns[trunk], quat.from_axis_angle(UP, np.array(self.facing)))
        left, up, forward = quat.rotate(quat.conj(frame), direction)
        aside, rise = np.clip(
            [np.arctan2(left, forward), np.arctan2(up, np.hypot(left, forward))], -LARGEST, LARGEST
        )
        direction_in_trunk = [
            np.cos(rise) * np.sin(aside),
            np.sin(rise),
            np.cos(rise) * np.cos(aside),
        ]
        limited: Vector = quat.rotate(frame, np.array(direction_in_trunk))
        return limited


SWAY = np.array([0.005, 0.01j])
"""Standard deviations of the sway of a person who stands, ahead and to the left, m."""
FREQUENCIES, STREAM = np.array([0.11, 0.23, 0.37, 0.61]), 4
"""Frequencies of the sway, Hz, whose fast waves are low (Winter, "Human balance and posture control
during standing and walking", 1995), and the stream of a seed."""
ANGLES = {
    "spine": 0.3,
    "chest": 0.3,
    "upperChest": 0.3,
    "neck": 0.6,
    "head": 0.6,
    "leftUpperArm": 0.5,
    "leftLowerArm": 0.5,
    "rightUpperArm": 0.5,
    "rightLowerArm": 0.5,
}
"""Standard deviation of the rotation about each axis, degrees, by role of the joint."""


def add_sway(
    rotations: Rotations,
    roots: RootPath,
    joints: Mapping[str, int],
    envelope: Frames,
    rate: float,
    seed: int,
) -> tuple[Rotations, RootPath]:
    """Return poses (F, J, 4) of who stands and roots (F, 3), m, with the sway of a seed.

    joints: by role. envelope: gain (F,) of the sway. rate: frames a second.
    """
    frames = np.flatnonzero(envelope > LEAST_SHARE)
    sway = waves(frames, rate, 2 + 3 * len(ANGLES), seed) * envelope[frames, None]
    direction = np.exp(1j * quat.twist(rotations[frames, 0], UP))
    swayed, turned = roots.copy(), rotations.copy()
    swayed[frames] += floor_plane.at_height(direction * (sway[:, :2] @ SWAY), np.zeros(1))
    vectors = sway[:, 2:].reshape(len(frames), len(ANGLES), 3)
    for number, role in enumerate(ANGLES):
        if role in joints:
            turn = quat.exp(np.radians(ANGLES[role]) * vectors[:, number])
            turned[frames, joints[role]] = quat.mul(turned[frames, joints[role]], turn)
    return turned, swayed


def waves(
    frames: Annotated[Indices, "frames"], rate: float, channels: int, seed: int
) -> Annotated[Floats, "frames channels"]:
    """Return smooth random numbers (F, C) with a mean of zero and a variance of one over seeds."""
    angles = 2.0 * np.pi * (frames[:, None] + 1) / rate * FREQUENCIES
    basis = np.hstack([np.cos(angles), np.sin(angles)]) / np.tile(FREQUENCIES, 2)
    numbers = random_field.normals(seed, STREAM, 2 * len(FREQUENCIES), channels)
    return np.asarray(basis @ numbers / np.sqrt(np.sum(FREQUENCIES**-2.0)))


REST_FRAMES = 16
"""Frames of coming to rest. They show the last half as many frames of the motion, slowed down."""
RAMP = 1.0
"""Time in which sway grows and fades, s. A shorter hold sways less."""
LOOK_RAMP = 0.5
"""Time in which the gaze turns to a point and back, s."""
# Frames through which the one between two others is interpolated.
WINDOW = 4


def body_of(
    skeleton: Skeleton,
    roles: Mapping[str, str],
    bones: Bones,
    facing: float = 0.0,
    hinges: tuple[Hinge, ...] = (),
) -> HeldBody:
    """Return the body of a character with joints by role, bone offsets (J, 3), m, and its facing.

    facing: of the rest pose, from +z to the left, rad.
    """
    joints = {role: skeleton.names.index(joint) for role, joint in roles.items()}
    return HeldBody(skeleton.names, skeleton.parents, bones, joints, facing, hinges)


def come_to_rest(before: Passage) -> Passage:
    """Return the passage with its end slowed down, so that it reaches its last pose at rest.

    The last frames are shown in twice their time, `REST_FRAMES` at most, with the speed of time
    1 - 3 u^2 + 2 u^3 over them, so that each joint keeps its path.
    """
    sample_frames = _slowed_places(len(before))
    if not len(sample_frames):
        return before
    begin = len(before) - 1 - len(sample_frames) // 2
    return concatenate(before.part(0, begin + 1), at_frames(before, sample_frames))


def rest_frame(frames: int, frame: int) -> int:
    """Return the frame of a slowed passage that is nearest to a frame of the original one.

    frames: number of frames of the original passage.
    """
    sample_frames = _slowed_places(frames)
    begin = frames - 1 - len(sample_frames) // 2
    if frame <= begin:
        return frame
    return begin + 1 + int(np.argmin(np.abs(sample_frames - frame)))


def _slowed_places(frames: int) -> Frames:
    """Return the fractional frames (S,) at which a passage of F frames is sampled as it slows."""
    count = min(REST_FRAMES // 2, frames - 1)
    if not count:
        return np.zeros(0)
    share = np.arange(1, 2 * count + 1) / (2 * count)
    gone = 2.0 * count * (share - share**3 + 0.5 * share**4)
    sample_frames: Frames = frames - 1 - count + np.minimum(gone, count)
    return sample_frames


def hold_passage(
    before: Passage,
    body: HeldBody,
    seconds: float,
    joint: str | None = None,
    look_at: tuple[float, float, float] | None = None,
    seed: int = 0,
) -> tuple[Passage, float]:
    """Return the frames in which the last pose of a passage is held, that one left out.

    Second is the angle by which the gaze stays beside its point, rad; 0 for none. seconds: how long
    the pose is kept. joint: name of the joint that stays where it is. look_at: point that the head
    turns to, in the frame of the passage, m. seed: of the sway. The passage has come to rest
    (`come_to_rest`). The held joint stays where it is, and so does its orientation; feet are to be
    planned, as their contacts go on. Raises InvalidField for a time without a frame, a joint that
    no arm or leg leads to, and as `HeldBody.look_at` does.
    """
    seconds = motion_question.check_number("hold", seconds)
    count = round(seconds * RATE)
    if count < 1:
        raise InvalidField("hold", f"{seconds:g} s, expected at least {1.0 / RATE:.3g} s")
    limb = _limb(body, joint)
    rotations = np.repeat(before.rotations[-1:], count, axis=0)
    roots = np.repeat(before.roots[-1:], count, axis=0)
    # The speed of the sway is that of a long hold.
    sway = _envelope(count, RAMP) * min(1.0, 0.5 * count / RATE / RAMP)
    rotations, roots = add_sway(rotations, roots, body.joints, sway, RATE, seed)
    miss = 0.0
    if look_at is not None:
        point = np.array(
            [
                motion_question.check_number(f"look_at/{axis}", value)
                for axis, value in enumerate(look_at)
            ]
        )
        gaze = body.look_at(before.rotations[-1], before.roots[-1], point)
        # A head cannot turn to a point and back in no time: a short hold turns it by a part.
        share = min(1.0, 0.5 * count / RATE / LOOK_RAMP)
        turning = _envelope(count, LOOK_RAMP) * share
        rotations = gaze.add(body.parents, rotations, turning)
        miss = gaze.miss + (1.0 - share) * float(np.linalg.norm(gaze.turn))
    if limb is not None:
        rotations, roots = _keep(body, limb, before, rotations, roots)
    last = before.part(len(before) - 1, len(before))
    contacts, sigmas = (np.repeat(values, count, axis=0) for values in (last.contacts, last.sigmas))
    return Passage(rotations, roots, contacts, sigmas), miss


def at_frames(passage: Passage, sample_frames: Frames) -> Passage:
    """Return a passage at fractional frames (S,), by cubics through the nearest ones."""
    size = min(WINDOW, len(passage))
    first = np.clip(sample_frames.astype(int) - 1, 0, len(passage) - size)
    rows = first[:, None] + np.arange(size)
    weights = _lagrange(sample_frames - first, size)
    nearest = passage.rotations[rows[:, 0]]
    offsets = quat.log(quat.mul(quat.conj(nearest)[:, None], passage.rotations[rows]))
    turned = quat.mul(nearest, quat.exp(np.einsum("sk,skjc->sjc", weights, offsets)))
    roots = np.einsum("sk,skc->sc", weights, passage.roots[rows])
    before = np.clip(sample_frames.astype(int), 0, len(passage) - 1)
    after = np.minimum(before + 1, len(passage) - 1)
    share = sample_frames - before
    contacts = passage.contacts[before] + share[:, None] * (
        passage.contacts[after] - passage.contacts[before]
    )
    sigmas = passage.sigmas[before] + share * (passage.sigmas[after] - passage.sigmas[before])
    return Passage(turned, roots, contacts, sigmas)


def _lagrange(points: Frames, size: int) -> np.ndarray:
    """Return the weights (S, size) of points 0, 1, ... for the polynomial through them."""
    weights = np.ones((len(points), size))
    for point in range(size):
        for other in range(size):
            if other != point:
                weights[:, point] *= (points - other) / (point - other)
    return weights


def _envelope(count: int, ramp: float) -> Frames:
    """Return a weight (F,) that grows from 0 to 1 and falls to 0 in the last frame."""
    times = np.arange(1, count + 1) / RATE
    seconds = count / RATE
    share = np.clip(np.minimum(times, seconds - times) / min(ramp, 0.5 * seconds), 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def _limb(body: HeldBody, name: str | None) -> Limb | None:
    if name is None:
        return None
    if name not in body.names:
        names = ", ".join(body.names)
        raise InvalidField("joint", f"{name!r}{did_you_mean(name, body.names)}, expected {names}")
    limb = limbs.find_kept_limb(body.parents, body.bones, body.names.index(name), body.hinges)
    if limb is None:
        raise InvalidField("joint", f"{name!r}, expected a joint that an arm or a leg leads to")
    return limb


def _keep(
    body: HeldBody, limb: Limb, before: Passage, rotations: Rotations, roots: RootPath
) -> tuple[Rotations, RootPath]:
    """Return poses (F, J, 4) and roots (F, 3), m, whose limb ends where it did.

    The root follows where the limb is too short.
    """
    last = limbs.evaluate_joints(
        body.parents, body.bones, [limb.tip], before.rotations[-1:], before.roots[-1:]
    )
    poses = limbs.evaluate_joints(body.parents, body.bones, [limb.tip], rotations, roots)
    offset = last.position(limb.lower) - poses.position(limb.upper)
    distance = np.linalg.norm(offset, axis=-1)
    beyond = np.maximum(distance - limbs.firm_reach(last, limb), 0.0)
    shift = (beyond / distance)[:, None] * offset
    upper, middle, lower = limbs.solve(poses, limb, offset - shift)
    # The hand keeps its orientation while the body above it sways.
    turn_back = quat.mul(quat.conj(poses.orientation(limb.lower)), last.orientation(limb.lower))
    turned = rotations.copy()
    turned[:, limb.upper], turned[:, limb.middle] = upper, middle
    turned[:, limb.lower] = quat.mul(lower, turn_back)
    return turned, roots + shift


LOOKS_ASIDE = np.radians(15.0)
"""Angle by which the head may stay beside its point without a warning, rad: eyes alone look as far
aside (Stahl, "Amplitude of human head movements associated with horizontal saccades", 1999)."""


def add_hold(timeline: Timeline, script: Script, index: int) -> None:
    """Add a hold to the motion; an act before it stops at its event.

    Raises InvalidField for a joint that cannot be held, for a point that cannot be looked at, and
    for an act before it that has a target after its event.
    """
    hold = script.segments[index]
    if not isinstance(hold, Hold):
        raise TypeError(f"segment {index}, expected a hold")
    _come_to_rest(timeline)
    before = timeline.done
    joint = hold.joint or _held_joint(timeline, script)
    character = script.character
    body = body_of(
        character.skeleton,
        character.roles,
        character.bones,
        character.facing,
        character.body.hinges,
    )
    passage, miss = hold_passage(
        before, body, hold.seconds, joint, hold.look_at, script.question.take
    )
    if miss > LOOKS_ASIDE:
        timeline.warn(
            f"/segments/{index}/look_at",
            f"the head looks {np.degrees(miss):.0f} degrees beside the point",
        )
    begin = len(before) - 1
    timeline.motion = concatenate(before, passage)
    model = timeline.spans[-1].model if timeline.spans else script.character.identity
    sigma = float(before.sigmas[-1])
    timeline.spans.append(Span("hold", model, begin, begin, sigma))
    # A target that holds at the begin of a hold holds until its end.
    last = len(timeline.done) - 1
    timeline.targets = [
        replace(target, end=last) if target.end == begin else target for target in timeline.targets
    ]
    timeline.targets += _held_place(timeline, script, joint, range(begin, last + 1), index)
    timeline.exits = range(last, last + 1)


def _held_place(
    timeline: Timeline, script: Script, joint: str | None, frames: range, index: int
) -> list[WorldTarget]:
    """Return the place of the joint that is held as a target, so that feet are planned around it.

    Empty for a joint that stays anyway: one with a target there, or of a foot that stands.
    """
    body, character = script.character.body, script.character
    if joint is None:
        return []
    index_of_joint = character.skeleton.names.index(joint)
    above = skeleton.joint_chain(body.parents, index_of_joint)
    standing = timeline.done.contacts[frames.start] > STANDING
    legs = zip(body.legs, standing.tolist(), strict=True)
    targets = [target for target in timeline.targets if target.end == frames[-1]]
    if any(down and leg.lower in above for leg, down in legs) or index_of_joint in {
        target.joint for target in targets
    }:
        return []
    pose = timeline.done.part(frames.start, frames.start + 1)
    translations = skeleton.translations(body.bones, pose.roots)
    position = skeleton.positions(body.parents, pose.rotations, translations)[0, index_of_joint]
    return [WorldTarget(index_of_joint, position, frames[0], frames[-1], f"/segments/{index}")]


def _come_to_rest(timeline: Timeline) -> None:
    """End the motion at its last event, at rest; targets near it are met later."""
    done, span = timeline.done, timeline.spans[-1] if timeline.spans else None
    if span is not None and span.kind == "hold":
        return
    last = len(done) - 1 if span is None or span.event is None else span.event
    late = next((target for target in timeline.targets if target.begin > last), None)
    if late is not None:
        raise InvalidField(
            "",
            f"stops the act before it at its event, {(late.begin - last) / RATE:.2f} s before the "
            f"moment of the target {late.pointer}, expected targets until the event",
        )
    rested = come_to_rest(done.part(0, last + 1))
    later = len(rested) - 1
    timeline.motion = rested
    if span is not None and span.event == last:
        timeline.spans[-1] = replace(span, event=later)
    timeline.targets = [
        replace(
            target,
            begin=rest_frame(last + 1, target.begin),
            end=rest_frame(last + 1, target.end),
        )
        for target in timeline.targets
    ]


def _held_joint(timeline: Timeline, script: Script) -> str | None:
    """Return the joint of the event that the hold begins with, such as the hand of a reach."""
    index = len(timeline.spans) - 1
    source = script.sources[index] if index >= 0 else None
    event = None if source is None else source.model.session.card.event
    if event is None or timeline.spans[-1].kind != "act":
        return None
    return script.character.skeleton.names[event.joint]
