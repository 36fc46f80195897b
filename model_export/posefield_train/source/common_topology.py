"""Topology that skeletons have in common: joints by role, and the longest common chains."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from posefield.common.units import Floats
from posefield.motion import skeleton
from posefield.motion.joint_roles import ROLES
from posefield.motion.skeleton import Skeleton
from posefield.roles import joint_recognition

SIDES = joint_recognition.SIDES
ARM = ("Shoulder", "UpperArm", "LowerArm", "Hand")
LEG = ("UpperLeg", "LowerLeg", "Foot", "Toes")
LIMB_ROLES = tuple(side + role for limb in (LEG, ARM) for side in SIDES for role in limb)
OPTIONAL = ("Shoulder", "Toes")
"""Roles of limbs that a skeleton may lack."""
NEEDED = (
    "hips",
    "head",
    *(role for role in LIMB_ROLES if not role.endswith(OPTIONAL)),
)
"""Roles that every skeleton of a family has to have."""
STATEMENT = "state them in the recipe, such as [skeleton.roles] {} = 'JOINT'"

StatedRoles = Mapping[str, Sequence[str]]
"""Joints by role, of which each file has at most one."""


class TopologyError(ValueError):
    """Clips that cannot be brought onto one topology; clip: index of a clip that shows it."""

    def __init__(self, message: str, clip: int = 0) -> None:
        super().__init__(message)
        self.clip = clip


@dataclass(frozen=True)
class RoleJoints:
    """Joints of a skeleton, by index.

    limbs: by role, without the trunk. hips, head: index. spine: from the first above the hips to
    the one that carries neck and arms. neck: from there to the one below the head; may be empty.
    """

    limbs: Mapping[str, int]
    hips: int
    spine: tuple[int, ...]
    neck: tuple[int, ...]
    head: int

    @property
    def kept(self) -> set[int]:
        """Return all of these joints."""
        return {*self.limbs.values(), self.hips, *self.spine, *self.neck, self.head}


def role_joints(joints: Skeleton, stated: StatedRoles) -> RoleJoints:
    """Return the joints of a skeleton by role.

    stated: joints of the recipe, which count more than those that are recognised. Raises
    TopologyError for a lacking role, and for joints that are not below each other as roles are.
    """
    indices = _indices(joints, stated)
    hips, head = indices["hips"], indices["head"]
    path = skeleton.joint_chain(joints.parents, head)
    if hips not in path:
        raise TopologyError(
            f"joint {joints.names[head]!r} (head) is not below {joints.names[hips]!r} (hips)"
        )
    between = path[path.index(hips) + 1 : -1]
    limbs = {role: joint for role, joint in indices.items() if role in LIMB_ROLES}
    split = _spine_length(joints, between, indices)
    if not split:
        raise TopologyError(
            f"no joint of the spine between {joints.names[hips]!r} (hips) and "
            f"{joints.names[head]!r} (head), expected one or more"
        )
    _expect_order(joints, hips, limbs)
    # Without joints at the position of the next one, whose turns that one has too.
    repeats = {
        a
        for segment in (between[:split], between[split:])
        for a, b in pairwise(segment)
        if joints.parents[b] == a and not joints.offsets[b].any()
    }
    spine = tuple(joint for joint in between[:split] if joint not in repeats)
    neck = tuple(joint for joint in between[split:] if joint not in repeats)
    return RoleJoints(limbs, hips, spine, neck, head)


def _indices(joints: Skeleton, stated: StatedRoles) -> dict[str, int]:
    """Return the joint of each role that is stated or sure; TopologyError if a needed one lacks."""
    guesses = joint_recognition.recognise(joints.names, joints.parents)
    stated_joints: dict[str, str] = {}
    for role, names in stated.items():
        there = [name for name in names if name in joints.names]
        if len(there) > 1:
            raise TopologyError(f"skeleton.roles.{role}: found joints {there}, expected one")
        stated_joints |= {role: there[0]} if there else {}
    sure = joint_recognition.sure_roles(
        {role: one for role, one in guesses.items() if one.joint not in stated_joints.values()}
    )
    by_role = sure | stated_joints
    lacking = [role for role in NEEDED if role not in by_role]
    if lacking:
        descriptions = [
            f"{role} ({guesses[role].joint}? {'; '.join(guesses[role].reasons)})"
            if role in guesses and guesses[role].reasons
            else role
            for role in lacking
        ]
        raise TopologyError(
            f"skeleton.topology: found no joint for {', '.join(descriptions)}, expected one for "
            f"each; {STATEMENT.format(lacking[0])}"
        )
    return {role: joints.names.index(by_role[role]) for role in ROLES if role in by_role}


def _spine_length(joints: Skeleton, between: Sequence[int], indices: Mapping[str, int]) -> int:
    neck = indices.get("neck")
    # Of a body without a spine the joint that carries the arms is one.
    if neck in between[1:]:
        return between.index(neck)
    arms = [indices.get(side + "Shoulder", indices[side + "UpperArm"]) for side in SIDES]
    paths = [set(skeleton.joint_chain(joints.parents, arm)) for arm in arms]
    return sum(joint in paths[0] & paths[1] for joint in between)


def _expect_order(joints: Skeleton, hips: int, limbs: Mapping[str, int]) -> None:
    """Raise TopologyError unless each joint of a limb is below the one before and the hips."""
    for limb in (ARM, LEG):
        for side in SIDES:
            above = ("hips", hips)
            for role in (side + name for name in limb if side + name in limbs):
                if above[1] not in skeleton.joint_chain(joints.parents, limbs[role])[:-1]:
                    raise TopologyError(
                        f"joint {joints.names[limbs[role]]!r} ({role}) is not below "
                        f"{joints.names[above[1]]!r} ({above[0]}); {STATEMENT.format(role)}"
                    )
                above = (role, limbs[role])


@dataclass(frozen=True)
class Topology:
    """Joints of a family. names, parents: as of a skeleton. spine, neck: number of joints."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    spine: int
    neck: int

    def index(self, name: str) -> int:
        """Return the index of a joint."""
        return self.names.index(name)

    @property
    def trunk(self) -> tuple[str, ...]:
        """Return the joints of spine and neck and the head, upwards."""
        return (*numbered("spine", self.spine), *numbered("neck", self.neck), "head")


@dataclass(frozen=True)
class JointPoint:
    """Place of a joint of the topology in a skeleton.

    It lies on the bone from `joint` to `following`, at a share of it, and turns with `joint`.
    """

    joint: int
    following: int
    share: float = 0.0


def numbered(name: str, count: int) -> tuple[str, ...]:
    """Return the names of a chain's joints, such as spine1 and spine2."""
    return tuple(f"{name}{number}" for number in range(1, count + 1))


def common_topology(bodies: Sequence[RoleJoints]) -> Topology:
    """Return the topology of roles that all bodies have, with the longest common chains."""
    spine, neck = (
        min(len(getattr(body, chain_name)) for body in bodies) for chain_name in ("spine", "neck")
    )
    shared = set.intersection(*(set(body.limbs) for body in bodies))
    links: list[tuple[str, str]] = [("hips", "")]
    for side in SIDES:
        links += _links("hips", [side + role for role in LEG if side + role in shared])
    chain = numbered("spine", spine)
    links += _links("hips", chain)
    links += _links(chain[-1], [*numbered("neck", neck), "head"])
    for side in SIDES:
        links += _links(chain[-1], [side + role for role in ARM if side + role in shared])
    names = tuple(name for name, _ in links)
    parents = tuple(names.index(parent) if parent else -1 for _, parent in links)
    return Topology(names, parents, spine, neck)


def _links(first: str, names: Sequence[str]) -> list[tuple[str, str]]:
    return list(zip(names, (first, *names), strict=False))


def model_roles(names: Sequence[str]) -> dict[str, str]:
    """Return the joint of each role among the joints of a topology, for the names of other tools.

    names: some of its joints; others may have been dropped.
    """
    chain = [name for name in names if name.startswith("spine")]
    trunk = dict(zip(("spine", "chest"), chain, strict=False))
    if len(chain) > 2:
        trunk = {"spine": chain[0], "chest": chain[len(chain) // 2], "upperChest": chain[-1]}
    by_role = {role: role for role in ROLES if role in names} | trunk
    if "neck1" in names:
        by_role["neck"] = "neck1"
    return {role: by_role[role] for role in ROLES if role in by_role}


def joint_points(
    bodies: Sequence[RoleJoints], lengths: Sequence[Floats], topology: Topology
) -> list[dict[str, JointPoint]]:
    """Return the place of each joint of the topology in each body, by name.

    lengths: of the bones that lead to each joint (J,), m. First and last joint of a chain are
    joints of every body: the first moves with the joint below the chain, the last carries what
    follows. Those between are at the same share of the length in all bodies, that of the bodies
    with no more joints than the family, which keep theirs.
    """
    counts = topology.spine, topology.neck + 1
    chains = [(body.spine, (*body.neck, body.head)) for body in bodies]
    shares = [
        np.median(
            [
                _shares(body_chains[number], bones)
                for body_chains, bones in zip(chains, lengths, strict=True)
                if len(body_chains[number]) == counts[number]
            ],
            axis=0,
        )
        for number in (0, 1)
    ]
    names = numbered("spine", topology.spine), (*numbered("neck", topology.neck), "head")
    bodies_points = []
    for body, body_chains, bones in zip(bodies, chains, lengths, strict=True):
        limbs = {role: joint for role, joint in body.limbs.items() if role in topology.names}
        points = {name: JointPoint(at, at) for name, at in {"hips": body.hips, **limbs}.items()}
        for number in (0, 1):
            placed = _sample(body_chains[number], bones, shares[number])
            points |= dict(zip(names[number], placed, strict=True))
        bodies_points.append({name: points[name] for name in topology.names})
    return bodies_points


def _shares(chain: Sequence[int], bones: Floats) -> Floats:
    along = np.concatenate([[0.0], np.cumsum(bones[list(chain[1:])])])
    return np.asarray(along / along[-1] if along[-1] > 0.0 else np.linspace(0.0, 1.0, len(along)))


def _sample(chain: Sequence[int], bones: Floats, shares: Floats) -> list[JointPoint]:
    """Return the points of a chain at shares of its length; its own joints if it has as many."""
    if len(chain) == len(shares):
        return [JointPoint(joint, joint) for joint in chain]
    if len(shares) == 1:
        return [JointPoint(chain[-1], chain[-1])]
    chain_shares = _shares(chain, bones)
    points = [JointPoint(chain[0], chain[0])]
    for share in shares[1:-1]:
        at = int(np.clip(np.searchsorted(chain_shares, share, side="right") - 1, 0, len(chain) - 2))
        along = (
            float((share - chain_shares[at]) / (chain_shares[at + 1] - chain_shares[at]))
            if chain_shares[at + 1] > chain_shares[at]
            else 0.0
        )
        points.append(JointPoint(chain[at], chain[at + 1], along))
    return [*points, JointPoint(chain[-1], chain[-1])]
