"""Joints of a skeleton by role, and the chains of its spine and neck."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

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


def role_joints(own: Skeleton, stated: StatedRoles) -> RoleJoints:
    """Return the joints of a skeleton by role.

    stated: joints of the recipe, which count more than those that are recognised. Raises
    TopologyError for a lacking role, and for joints that are not below each other as roles are.
    """
    found = _indices(own, stated)
    hips, head = found["hips"], found["head"]
    path = skeleton.joint_chain(own.parents, head)
    if hips not in path:
        raise TopologyError(
            f"joint {own.names[head]!r} (head) is not below {own.names[hips]!r} (hips)"
        )
    between = path[path.index(hips) + 1 : -1]
    limbs = {role: joint for role, joint in found.items() if role in LIMB_ROLES}
    split = _spine_length(own, between, found)
    if not split:
        raise TopologyError(
            f"no joint of the spine between {own.names[hips]!r} (hips) and "
            f"{own.names[head]!r} (head), expected one or more"
        )
    _expect_order(own, hips, limbs)
    spine, neck = (_without_repeats(own, part) for part in (between[:split], between[split:]))
    return RoleJoints(limbs, hips, spine, neck, head)


def _indices(own: Skeleton, stated: StatedRoles) -> dict[str, int]:
    """Return the joint of each role that is stated or sure; TopologyError if a needed one lacks."""
    guesses = joint_recognition.recognise(own.names, own.parents)
    said: dict[str, str] = {}
    for role, names in stated.items():
        there = [name for name in names if name in own.names]
        if len(there) > 1:
            raise TopologyError(f"skeleton.roles.{role}: found joints {there}, expected one")
        said |= {role: there[0]} if there else {}
    sure = joint_recognition.sure_roles(
        {role: one for role, one in guesses.items() if one.joint not in said.values()}
    )
    known = sure | said
    lacking = [role for role in NEEDED if role not in known]
    if lacking:
        told = [
            f"{role} ({guesses[role].joint}? {'; '.join(guesses[role].reasons)})"
            if role in guesses and guesses[role].reasons
            else role
            for role in lacking
        ]
        raise TopologyError(
            f"skeleton.topology: found no joint for {', '.join(told)}, expected one for each; "
            f"{STATEMENT.format(lacking[0])}"
        )
    return {role: own.names.index(known[role]) for role in ROLES if role in known}


def _spine_length(own: Skeleton, between: Sequence[int], found: Mapping[str, int]) -> int:
    """Return the number of joints between hips and head that belong to the spine."""
    neck = found.get("neck")
    # Of a body without a spine the joint that carries the arms is one.
    if neck in between[1:]:
        return between.index(neck)
    arms = [found.get(side + "Shoulder", found[side + "UpperArm"]) for side in SIDES]
    paths = [set(skeleton.joint_chain(own.parents, arm)) for arm in arms]
    return sum(joint in paths[0] & paths[1] for joint in between)


def _without_repeats(own: Skeleton, chain: Sequence[int]) -> tuple[int, ...]:
    """Return a chain without joints at the place of the next one, whose turns that one has too."""
    same = {a for a, b in pairwise(chain) if own.parents[b] == a and not own.offsets[b].any()}
    return tuple(joint for joint in chain if joint not in same)


def _expect_order(own: Skeleton, hips: int, limbs: Mapping[str, int]) -> None:
    """Raise TopologyError unless each joint of a limb is below the one before and the hips."""
    for limb in (ARM, LEG):
        for side in SIDES:
            above = ("hips", hips)
            for role in (side + name for name in limb if side + name in limbs):
                if above[1] not in skeleton.joint_chain(own.parents, limbs[role])[:-1]:
                    raise TopologyError(
                        f"joint {own.names[limbs[role]]!r} ({role}) is not below "
                        f"{own.names[above[1]]!r} ({above[0]}); {STATEMENT.format(role)}"
                    )
                above = (role, limbs[role])
