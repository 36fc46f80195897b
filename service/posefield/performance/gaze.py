"""Gaze: head, neck and trunk turn towards a point."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import UP, Bones, Frames, JointRotations, Rotations, Vector
from posefield.feet import two_bone
from posefield.motion import quat, skeleton

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
        moved = np.zeros((*rotations.shape[:-2], len(parents), 3))
        _, turns = skeleton.forward_kinematics(parents, rotations, moved)
        found = rotations.copy()
        for joint, share in self.shares.items():
            # All turns are about one axis, so that those of the joints add up.
            turn = quat.exp(share * weights[:, None] * self.turn)
            above = turns[:, parents[joint]] if parents[joint] >= 0 else quat.IDENTITY
            found[:, joint] = quat.mul(quat.conj(above), quat.mul(turn, turns[:, joint]))
        return found


@dataclass(frozen=True)
class HeldBody:
    """Skeleton of a character that stays in a pose, and can look.

    bones: offsets (J, 3), m. joints: by role. facing: of the rest pose, from +z to the left, rad.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    bones: Bones
    joints: Mapping[str, int]
    facing: float = 0.0

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
        part = TRUNK_SHARE if trunk else 0.0
        return {joint: part / len(trunk) for joint in trunk} | {
            joint: (1.0 - part) / len(neck) for joint in neck
        }

    def _turned(self, gaze: Gaze, rotations: JointRotations, root: Vector, point: Vector) -> Gaze:
        """Return the turn towards a point, seen from where the head is after a turn."""
        head = self.joints["head"]
        ahead = np.array([np.sin(self.facing), 0.0, np.cos(self.facing)])
        turned = gaze.add(self.parents, rotations[None], np.ones(1))[0]
        moved = skeleton.translations(self.bones, root[None])[0]
        places, _ = skeleton.forward_kinematics(self.parents, turned, moved)
        _, turns = skeleton.forward_kinematics(self.parents, rotations, moved)
        away = point - places[head]
        distance = float(np.linalg.norm(away))
        if distance < NEAREST:
            raise InvalidField(
                "look_at", f"{distance:.3g} m from the head, expected at least {NEAREST:g} m"
            )
        within = self._within(turns, away / distance)
        turn = quat.log(two_bone.shortest_turn(quat.rotate(turns[head], ahead), within))
        beside = np.linalg.norm(quat.cross(within, away)), within @ away
        return Gaze(gaze.shares, turn, float(np.arctan2(*beside)))

    def _within(self, turns: JointRotations, direction: Vector) -> Vector:
        """Return the direction (3,), at most `LARGEST` aside and up from the trunk's facing."""
        trunk = next((self.joints[role] for role in TRUNK[::-1] if role in self.joints), 0)
        frame = quat.mul(turns[trunk], quat.from_axis_angle(UP, np.array(self.facing)))
        left, up, ahead = quat.rotate(quat.conj(frame), direction)
        aside, rise = np.clip(
            [np.arctan2(left, ahead), np.arctan2(up, np.hypot(left, ahead))], -LARGEST, LARGEST
        )
        seen = [np.cos(rise) * np.sin(aside), np.sin(rise), np.cos(rise) * np.cos(aside)]
        found: Vector = quat.rotate(frame, np.array(seen))
        return found
