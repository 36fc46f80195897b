"""Roles of the joints of a motion and of a rig: which joint of one follows which of the other."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Self

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Bones, Floats, RootPath, Rotations, Vector
from posefield.feet.limbs import Limb, LimbPoses
from posefield.motion import hinges, quat, skeleton
from posefield.motion.hinges import Hinge
from posefield.motion.skeleton import Skeleton, joint_chain
from posefield.rigs.rig import facing_of
from posefield.roles import joint_recognition
from posefield.roles.joint_recognition import NEEDED

SIDES = joint_recognition.SIDES
FIELD = "character"
LEG = ("UpperLeg", "LowerLeg", "Foot", "Toes")


@dataclass(frozen=True)
class Body:
    """Skeleton with the roles of its joints. joints: index by role. bones (J, 3): offsets, m."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    bones: Bones
    joints: Mapping[str, int]

    @cached_property
    def rest(self) -> Bones:
        """Return the positions (J, 3) at rest, m."""
        bones = self.bones.copy()
        for joint, parent in enumerate(self.parents[1:], start=1):
            bones[joint] += bones[parent]
        return bones

    def direction(self, upper: str, lower: str) -> Floats:
        """Return the unit vector (3,) at rest from the joint of a role to that of another."""
        bone = self.rest[self.joints[lower]] - self.rest[self.joints[upper]]
        return bone / max(float(np.linalg.norm(bone)), 1e-9)

    def length(self, upper: str, lower: str) -> float:
        """Return the distance at rest of the joints of two roles, m."""
        bone = self.rest[self.joints[lower]] - self.rest[self.joints[upper]]
        return float(np.linalg.norm(bone))

    @property
    def leg_length(self) -> float:
        """Return the mean length of both legs from hip to ankle, m."""
        return 0.5 * sum(
            self.length(side + "UpperLeg", side + "LowerLeg")
            + self.length(side + "LowerLeg", side + "Foot")
            for side in SIDES
        )

    @property
    def leg_bones(self) -> list[float]:
        """Return the lengths of the bones of both legs and feet, m."""
        chains = [
            [side + segment for segment in LEG if side + segment in self.joints] for side in SIDES
        ]
        return [self.length(*pair) for chain in chains for pair in pairwise(chain)]

    @property
    def facing(self) -> float:
        """Return the direction in which the body faces at rest, rad, to the left of +Z."""
        left, right = (self.rest[self.joints[side + "UpperLeg"]] for side in SIDES)
        return facing_of(left - right)

    @cached_property
    def spine(self) -> "Chain":
        """Return the joints of the trunk above the hips, up to those that carry arms or neck."""
        start = self.joints["hips"]
        top = self._parent("neck") or self._parent("head")
        spine_joints = [self.joints.get(role) for role in ("spine", "chest", "upperChest")]
        marks = [joint for joint in (*spine_joints, top) if joint is not None]
        paths = [self._between(start, joint) for joint in marks]
        longest = max(paths, key=len, default=())
        return Chain(longest, _places(self.bones, longest))

    @cached_property
    def neck(self) -> "Chain":
        """Return the joints of the neck, from its own to the one below the head."""
        first, head = self.joints.get("neck"), self.joints.get("head")
        if first is None:
            return Chain((), np.zeros(0))
        inner = () if head is None else self._between(first, self.parents[head])
        chain = (first, *inner)
        return Chain(chain, _places(self.bones, chain))

    def _parent(self, role: str) -> int | None:
        joint = self.joints.get(role)
        return None if joint is None else self.parents[joint]

    def _between(self, above: int, joint: int) -> tuple[int, ...]:
        """Return the joints below one down to another; none if it is not below."""
        path = joint_chain(self.parents, joint)
        return path[path.index(above) + 1 :] if above in path else ()


@dataclass(frozen=True)
class Chain:
    """Joints one below the other. shares (n,): of the chain at each, 0 to 1."""

    joints: tuple[int, ...]
    shares: Annotated[Floats, "chain"]


def _places(bones: Bones, joints: tuple[int, ...]) -> Annotated[Floats, "chain"]:
    """Return the places (n,) of joints along their chain by length; 1 for a single one."""
    if len(joints) < 2:
        return np.ones(len(joints))
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(bones[list(joints[1:])], axis=-1))])
    if lengths[-1] < 1e-6:
        return np.linspace(0.0, 1.0, len(joints))
    return lengths / lengths[-1]


def body_of_motion(skeleton: Skeleton, bones: Bones, roles: Mapping[str, str]) -> Body:
    """Return the body of a motion's skeleton with bones (J, 3), m, of the motion.

    roles: joint by role; recognised by the names without any. Raises InvalidField for a body
    without hips and two legs.
    """
    joint_roles = roles or joint_recognition.roles_of(skeleton.names, skeleton.parents)
    joints = {role: skeleton.names.index(body_bones) for role, body_bones in joint_roles.items()}
    missing = [role for role in NEEDED if role not in joints]
    if missing:
        raise InvalidField(
            FIELD,
            f"given, but this model has no joint for {', '.join(missing)}: expected a body with "
            "hips and two legs, by [roles] of its recipe or by the names of its joints",
        )
    body_bones = bones.copy()
    body_bones[0] = 0.0
    return Body(skeleton.names, skeleton.parents, body_bones, joints)


FOLDED = np.radians(155.0)
"""Bend up to which any limb may fold, rad."""


def _hinge(turns: Annotated[Floats, "frames 2 4"], above: Vector, below: Vector) -> Hinge | None:
    """Return the hinge of a limb in its poses, with a range from straight to folded.

    turns: orientations of its upper and middle joint. above, below: bones (3,) at rest, m.
    """
    bent = quat.mul(quat.conj(turns[:, 0]), turns[:, 1])
    bones = (np.tile(bone, (len(bent), 1)) for bone in (above, below))
    hinge = hinges.measure(0, bent, *bones)
    if hinge is None:
        return None
    low = (min(hinge.low[0], 0.0), *hinge.low[1:])
    return replace(hinge, low=low, high=(max(hinge.high[0], float(FOLDED)), *hinge.high[1:]))


@dataclass(frozen=True)
class PosedBody:
    """Poses of a body.

    rotations (F, J, 4): local to the parents. roots (F, 3), positions (F, J, 3), m. orientations
    (F, J, 4): in the world.
    """

    body: Body
    rotations: Rotations
    roots: RootPath
    positions: Annotated[Floats, "frames joints 3"]
    orientations: Annotated[Floats, "frames joints 4"]

    @classmethod
    def of_rotations(cls, body: Body, rotations: Rotations, roots: RootPath) -> Self:
        """Return poses with the positions and orientations of their joints."""
        translations = skeleton.translations(body.bones, roots)
        world = skeleton.forward_kinematics(body.parents, rotations, translations)
        return cls(body, rotations, roots, *world)

    def moved(self, shift: RootPath) -> Self:
        """Return poses whose root is moved by (F, 3), m."""
        positions = self.positions + shift[:, None]
        return replace(self, roots=self.roots + shift, positions=positions)

    def of_role(self, role: str) -> RootPath:
        """Return the positions (F, 3), m, of the joint of a role."""
        return self.positions[:, self.body.joints[role]]

    def limb(self, roles: tuple[str, ...]) -> tuple[Limb, LimbPoses]:
        """Return the limb of joints of roles, and its poses; joints between them do not turn."""
        role_joints = [self.body.joints[role] for role in roles]
        joints = (self.body.parents[role_joints[0]], *role_joints)
        rest = self.body.rest[list(joints)]
        bones = np.diff(rest, axis=0, prepend=rest[:1])
        parents = tuple(range(-1, len(joints) - 1))
        positions, turns = self.positions[:, list(joints)], self.orientations[:, list(joints)]
        limb = Limb(
            role_joints[0],
            role_joints[1],
            role_joints[2],
            role_joints[-1],
            _hinge(turns[:, 1:3], bones[2], bones[3]),
        )
        return limb, LimbPoses(joints, parents, bones, positions, turns)
