"""Canonical rest pose: a T-pose that is found from the motion, whatever the rest pose of the files.

A joint's frame is turned by a constant of its body, so that in the T-pose all frames are equal: x
to the left, y up, z ahead. Two directions in the joint's frame tell the turn. The first is the mean
direction of the bone. The second tells the twist about it: the hinge axis of elbow or knee, which
is the mean of the normals of the limb's plane and so counts bent poses most; else the mean of an
axis of the parent. Both turn with the frame, so that files in a T-pose and in an A-pose agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats
from posefield.motion import quat
from posefield_train.source.common_topology import Topology

X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
FOOT = np.array([0.0, -1.0, 2.0]) / np.sqrt(5.0)
"""Direction from the ankle to the ball of the foot in the T-pose."""
SHORTEST = 0.01
"""Distance below which a joint tells no direction, m."""
LEAST_BEND = 0.02
"""Least mean normal of a limb's plane that tells a hinge, as the sine of the bend: 1 degree."""
ELBOWS = ("UpperArm", "LowerArm")
KNEES = ("UpperLeg", "LowerLeg")
HINGES = {"UpperArm": "Hand", "LowerArm": "Hand", "UpperLeg": "Foot", "LowerLeg": "Foot"}


@dataclass(frozen=True)
class JointMotion:
    """Motion of a topology's joints in poses of a body.

    positions (F, J, 3), m. turns (F, J, 4): orientations of the files' joints.
    """

    positions: Floats
    turns: Floats


@dataclass(frozen=True)
class _RestAlignment:
    """Alignment of one joint after another, parents first. found (J, 4): turns so far."""

    topology: Topology
    motion: JointMotion
    found: Floats

    def turn(self, joint: int) -> Floats:
        """Return the turn (4,) of a joint."""
        name = self.topology.names[joint]
        if name == "hips":
            return _turn_between((self.across("UpperLeg", joint), X), (self.above(joint), Y))
        if name.startswith("spine"):
            return _turn_between((self.above(joint), Y), (self.across("UpperArm", joint), X))
        if name.startswith("neck"):
            return _turn_between((self.above(joint), Y), self.of_parent(joint, X))
        child, direction = limb_bone(name)
        if child not in self.topology.names:
            return _turn_between(self.of_parent(joint, X), self.of_parent(joint, Y))
        bone = self.towards(joint, self.topology.index(child)), direction
        beside = Y if abs(direction[0]) > 0.5 else X
        return _turn_between(bone, self.hinge(joint) or self.of_parent(joint, beside))

    def local(self, joint: int, vectors: Floats) -> Floats:
        """Return the mean (3,) of world vectors (F, 3) in the frame of a joint."""
        return np.asarray(quat.rotate(quat.conj(self.motion.turns[:, joint]), vectors).mean(axis=0))

    def towards(self, joint: int, target: int) -> Floats:
        """Return the mean vector (3,) from a joint to another in the former's frame."""
        places = self.motion.positions
        return self.local(joint, places[:, target] - places[:, joint])

    def across(self, role: str, joint: int) -> Floats:
        """Return the mean vector from the right to the left joint of a role in a joint's frame."""
        left, right = (self.topology.index(side + role) for side in ("left", "right"))
        places = self.motion.positions
        return self.local(joint, places[:, left] - places[:, right])

    def above(self, joint: int) -> Floats:
        """Return the mean vector to the first joint of the trunk that is farther up."""
        trunk = self.topology.trunk
        name = self.topology.names[joint]
        vectors = [
            self.towards(joint, self.topology.index(other))
            for other in trunk[trunk.index(name) + 1 if name in trunk else 0 :]
        ]
        return next((v for v in vectors if np.linalg.norm(v) > SHORTEST), vectors[-1])

    def of_parent(self, joint: int, axis: Floats) -> tuple[Floats, Floats]:
        """Return the mean of a canonical axis of the parent in a joint's frame, and the axis."""
        parent = self.topology.parents[joint]
        turns = quat.mul(self.motion.turns[:, parent], quat.conj(self.found[parent]))
        return self.local(joint, quat.rotate(turns, axis)), axis

    def hinge(self, joint: int) -> tuple[Floats, Floats] | None:
        """Return the mean hinge axis of an elbow or knee in a joint's frame, and its direction.

        None for other joints, and for a limb that is straight in all poses.
        """
        name = self.topology.names[joint]
        side = "left" if name.startswith("left") else "right"
        role = name.removeprefix(side)
        if role not in HINGES:
            return None
        limb = ELBOWS if role in ELBOWS else KNEES
        ends = (*limb, HINGES[role])
        first, middle, last = (
            self.motion.positions[:, self.topology.index(side + r)] for r in ends
        )
        normals = quat.cross(_units(middle - first), _units(last - middle))
        axis = self.local(joint, normals)
        if np.linalg.norm(axis) < LEAST_BEND:
            return None
        # A forearm bends ahead, a lower leg backwards.
        upright = X if limb == KNEES else (-Y if side == "left" else Y)
        return axis, upright


def limb_bone(name: str) -> tuple[str, Floats]:
    """Return the role at the end of a limb's bone, "" without one, and its direction at rest."""
    side = "left" if name.startswith("left") else "right"
    outwards = X if side == "left" else -X
    end, direction = {
        "Shoulder": ("UpperArm", outwards),
        "UpperArm": ("LowerArm", outwards),
        "LowerArm": ("Hand", outwards),
        "UpperLeg": ("LowerLeg", -Y),
        "LowerLeg": ("Foot", -Y),
        "Foot": ("Toes", FOOT),
    }.get(name.removeprefix(side), ("", X))
    return side + end if end else "", direction


def _units(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


Directions = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]


def _turn_between(first: Directions, second: Directions) -> Floats:
    """Return the turn (4,) that brings one direction onto another, and a second one near its own.

    first, second: a direction in a joint's frame, of any length, and in the canonical frame. Where
    the second says nothing, the smallest turn of the first is taken.
    """
    own, common = (_basis(first[at], second[at]) for at in (0, 1))
    if own is None or common is None:
        return smallest_turns(first[0][None], first[1][None])[0]
    return np.asarray(quat.from_matrix(common @ own.T))


def _basis(along: Floats, beside: Floats) -> Floats | None:
    """Return axes (3, 3) as columns: along, the rest of beside, and their normal; None if equal."""
    x = _units(along)
    rest = _units(beside) - (_units(beside) @ x) * x
    if np.linalg.norm(x) < 0.5 or np.linalg.norm(rest) < 1e-3:
        return None
    y = _units(rest)
    return np.stack([x, y, quat.cross(x, y)], axis=-1)


def smallest_turns(a: Floats, b: Floats) -> Floats:
    """Return the smallest turns (F, 4) between directions (F, 3); none between opposites."""
    start, end = _units(a), _units(b)
    halves = np.concatenate(
        [1.0 + np.sum(start * end, axis=-1, keepdims=True), quat.cross(start, end)], axis=-1
    )
    halves[np.linalg.norm(halves, axis=-1) < 1e-6] = (1.0, 0.0, 0.0, 0.0)
    return np.asarray(quat.normalize(halves))


def mean_turns(topology: Topology, motions: Sequence[JointMotion]) -> Floats:
    """Return the turns (J, 4) from a body's frames in the files to its canonical ones."""
    whole = JointMotion(
        np.concatenate([one.positions for one in motions]),
        np.concatenate([one.turns for one in motions]),
    )
    turns = np.zeros((len(topology.names), 4))
    turns[:, 0] = 1.0
    for joint in range(len(topology.names)):
        turns[joint] = _RestAlignment(topology, whole, turns).turn(joint)
    return turns
