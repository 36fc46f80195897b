"""Roles of joints by their names, the tree and the shape of the body, with a confidence.

A rest pose that stands on its soles follows from them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.units import Floats
from posefield.motion.joint_roles import ROLES
from posefield.motion.skeleton import Skeleton
from posefield.roles.joint_words import (
    ARM,
    HIPS,
    LEG,
    JointWord,
    LimbJoint,
    align_limb,
    joint_words,
)

ROOTS = frozenset({"root", "spinebase"})
CHESTS = frozenset({"chest", "thorax", "ribcage", "ribs", "rib"})
NAMED, BY_TREE, ONE_OF_MANY, UNCLEAR = 1.0, 0.85, 0.8, 0.6
"""Confidence by evidence: name and tree agree, the tree alone, one of several joints of a chain,
and evidence that contradicts itself."""


@dataclass(frozen=True)
class Tree:
    """Joints by index. parents (J,): -1 for the root."""

    parents: tuple[int, ...]
    words: tuple[JointWord, ...]

    def path(self, joint: int) -> list[int]:
        """Return the joints from the root to a joint."""
        path = []
        while joint >= 0:
            path.append(joint)
            joint = self.parents[joint]
        return path[::-1]

    def common(self, joints: Sequence[int]) -> int:
        """Return the last common ancestor of joints; each counts as its own ancestor."""
        paths = [self.path(joint) for joint in joints]
        shared = -1
        for level in zip(*paths, strict=False):
            if len(set(level)) > 1:
                break
            shared = level[0]
        return shared

    def first(self, keys: frozenset[str]) -> int | None:
        """Return the first joint on no side with one of the names; None without one.

        A name of other words too counts if no name is exact.
        """
        joints = [
            joint
            for joint, word in enumerate(self.words)
            if not (word.side or word.is_helper or word.is_digit) and word.key in keys
        ]
        return min(joints, key=lambda joint: not self.words[joint].is_exact, default=None)


def trunk_roles(tree: Tree, upper_legs: Sequence[int], arms: Sequence[int]) -> dict[str, LimbJoint]:
    """Return the joints of the trunk by role.

    upper_legs, arms: the first joints of the legs and of the arms; fewer than two of each tell
    nothing of the tree.
    """
    chest = tree.common(arms) if len(arms) == 2 else None
    head = tree.first(frozenset({"head"}))
    neck, confidence = _named_neck(tree, head), NAMED
    if head is None and neck is None and chest is not None:
        (neck, head), confidence = _unnamed_neck(tree, chest), ONE_OF_MANY
    roles = {"neck": LimbJoint(neck, confidence)} if neck is not None else {}
    roles |= {"head": LimbJoint(head, confidence)} if head is not None else {}
    top = next((joint for joint in (neck, head, chest) if joint is not None), None)
    hips = _hips(tree, upper_legs, top)
    if hips is None:
        return roles
    roles = {"hips": hips} | roles
    return roles | _spine(tree, hips, top, top if neck is None and head is None else None)


def _named_neck(tree: Tree, head: int | None) -> int | None:
    """Return the first neck below the head, or anywhere without a head; None without one."""
    within = range(len(tree.parents)) if head is None else tree.path(head)
    for joint in within:
        word = tree.words[joint]
        if not word.side and word.key.replace("lower", "").startswith("neck"):
            return joint
    return None


def _unnamed_neck(tree: Tree, chest: int) -> tuple[int | None, int | None]:
    """Return neck and head of a chain above the arms whose joints bear the chest's name."""
    chain = [chest]
    while True:
        following = [
            joint
            for joint, parent in enumerate(tree.parents)
            if parent == chain[-1]
            and tree.words[joint].key == tree.words[chest].key
            and not tree.words[joint].side
        ]
        if len(following) != 1:
            break
        chain += following
    above = chain[1:]
    return (above[0], above[-1]) if len(above) > 1 else (None, None)


def _hips(tree: Tree, upper_legs: Sequence[int], top: int | None) -> LimbJoint | None:
    """Return the joint from which legs and spine part, or its ancestor that is named as hips."""
    if len(upper_legs) < 2:
        hips = tree.first(HIPS)
        return None if hips is None else LimbJoint(hips, BY_TREE)
    parting = tree.common([*upper_legs, *([] if top is None else [top])])
    if parting < 0:
        return None
    for joint in reversed(tree.path(parting)):
        if tree.words[joint].key in HIPS and not tree.words[joint].side:
            return LimbJoint(joint, NAMED)
    below = tree.words[tree.common(upper_legs)]
    if below.key in HIPS and not below.side:
        return LimbJoint(parting, UNCLEAR)
    if tree.words[parting].key in ROOTS and tree.words[parting].is_exact:
        return LimbJoint(parting, NAMED)
    between = [
        joint
        for leg in upper_legs
        for joint in tree.path(leg)[:-1]
        if joint != parting and parting in tree.path(joint)
    ]
    # Between the parting and a leg only joints of the leg's side may stand.
    is_clear = all(tree.words[joint].side for joint in between) and top is not None
    return LimbJoint(parting, BY_TREE if is_clear else UNCLEAR)


def _spine(tree: Tree, hips: LimbJoint, top: int | None, last: int | None) -> dict[str, LimbJoint]:
    """Return spine, chest and upperChest: joints between the hips and the top, or up to `last`."""
    if top is None or hips.joint not in tree.path(top):
        return {}
    path = tree.path(top)
    chain = [
        joint
        for joint in path[path.index(hips.joint) + 1 :]
        if (joint != top or joint == last) and not tree.words[joint].is_helper
    ]
    confidence = min(hips.confidence, NAMED)
    if len(chain) == 1:
        role = "chest" if tree.words[chain[0]].key in CHESTS else "spine"
        return {role: LimbJoint(chain[0], confidence)}
    if len(chain) < 3:
        return {
            role: LimbJoint(joint, confidence)
            for role, joint in zip(("spine", "chest"), chain, strict=False)
        }
    middle = confidence if len(chain) == 3 else min(confidence, ONE_OF_MANY)
    return {
        "spine": LimbJoint(chain[0], confidence),
        "chest": LimbJoint(chain[len(chain) // 2], middle),
        "upperChest": LimbJoint(chain[-1], confidence),
    }


SIDES = ("left", "right")
NEEDED = ("hips", *(side + part for side in SIDES for part in ("UpperLeg", "LowerLeg", "Foot")))
"""Roles of a person without which nothing is retargeted."""
LOWEST_CONFIDENCE = 0.8
"""Confidence below which a role has to be confirmed in the recipe."""
ONE_SIDE, OTHER_WORDS = 0.7, 0.75
"""Factors of the confidence of a role on one side only, and of two that are named differently."""


@dataclass(frozen=True)
class RoleGuess:
    """A joint that seems to have a role.

    confidence: 0 to 1. reasons: what lowers it; empty where nothing does.
    """

    joint: str
    confidence: float
    reasons: tuple[str, ...] = ()

    @property
    def is_sure(self) -> bool:
        """Return whether the role needs no confirmation."""
        return self.confidence >= LOWEST_CONFIDENCE

    def lowered(self, factor: float, reason: str) -> "RoleGuess":
        """Return the guess with a smaller confidence, for a reason."""
        return RoleGuess(self.joint, self.confidence * factor, (*self.reasons, reason))


def roles_of(names: Sequence[str], parents: Sequence[int]) -> dict[str, str]:
    """Return the joints that have a role without doubt, by role.

    names, parents: of the joints; the parent of the root is -1.
    """
    return sure_roles(recognise(names, parents))


def sure_roles(guesses: Mapping[str, RoleGuess]) -> dict[str, str]:
    """Return the joint of each role that needs no confirmation."""
    return {role: guess.joint for role, guess in guesses.items() if guess.is_sure}


def recognise(names: Sequence[str], parents: Sequence[int]) -> dict[str, RoleGuess]:
    """Return the joints that seem to have a role, by role, in the order of ROLES.

    names, parents: of the joints; the parent of the root is -1. Joints of a limb have their role by
    words and order, those of the trunk by the place of the limbs.
    """
    tree = Tree(tuple(parents), joint_words(names))
    limbs = {
        f"{side}{role}": limb_joint
        for side in SIDES
        for role, limb_joint in _limbs(tree, side).items()
    }
    legs = [limbs[f"{side}UpperLeg"].joint for side in SIDES if f"{side}UpperLeg" in limbs]
    arms = [
        next(limbs[side + role].joint for role in ARM[:2] if side + role in limbs)
        for side in SIDES
        if {f"{side}Shoulder", f"{side}UpperArm"} & limbs.keys()
    ]
    trunk = trunk_roles(tree, legs, arms)
    guesses = {role: _guess(names, limb_joint) for role, limb_joint in (trunk | limbs).items()}
    return {role: _compared(role, guesses[role], limbs, tree) for role in ROLES if role in guesses}


def is_person(names: Sequence[str], parents: Sequence[int]) -> bool:
    """Return whether joints seem to have hips and two legs."""
    return recognise(names, parents).keys() >= set(NEEDED)


def _limbs(tree: Tree, side: str) -> dict[str, LimbJoint]:
    """Return the joints of the arm and of the leg of a side, by role without the side."""
    leaves = set(range(len(tree.parents))) - set(tree.parents)
    paths = [
        [joint for joint in tree.path(leaf) if tree.words[joint].side == side]
        for leaf in sorted(leaves)
    ]
    return align_limb(paths, tree.words, ARM) | align_limb(paths, tree.words, LEG)


def _guess(names: Sequence[str], limb_joint: LimbJoint) -> RoleGuess:
    reasons: tuple[str, ...] = ()
    if limb_joint.confidence < LOWEST_CONFIDENCE:
        reasons = ("other joints fit as well, or the tree contradicts the name",)
    return RoleGuess(names[limb_joint.joint], limb_joint.confidence, reasons)


def _compared(role: str, guess: RoleGuess, limbs: Mapping[str, LimbJoint], tree: Tree) -> RoleGuess:
    """Return the guess with the confidence that the other side leaves it."""
    if role not in limbs:
        return guess
    side, other = ("left", "right") if role.startswith("left") else ("right", "left")
    counterpart = limbs.get(other + role.removeprefix(side))
    if counterpart is None:
        return guess.lowered(ONE_SIDE, f"the {other} side has no such joint")
    if tree.words[counterpart.joint].key != tree.words[limbs[role].joint].key:
        return guess.lowered(OTHER_WORDS, f"the joint of the {other} side has another name")
    return guess


BONES = (
    ("UpperArm", "LowerArm"),
    ("LowerArm", "Hand"),
    ("UpperLeg", "LowerLeg"),
    ("LowerLeg", "Foot"),
)
LARGEST_RATIO = 1.2
"""Largest ratio of the lengths of a bone on both sides."""
LEAST_ANGLE = 120.0
"""Least angle, degrees, between the legs and the trunk of a body that stands; 90 of a quadruped."""
POSES_SHARE = 90
"""Percentile of the poses that counts, since a body may bend or lie in some of them."""
UNEVEN, SWAPPED, LEVEL = 0.75, 0.5, 0.7
"""Factors of the confidence for each contradiction."""

Guesses = Mapping[str, RoleGuess]


def check_shape(guesses: Guesses, names: Sequence[str], positions: Floats) -> dict[str, RoleGuess]:
    """Return the guesses with the confidence that poses of the body leave them.

    names (J,): of the joints. positions (F, J, 3): in any unit and axes, right-handed.
    """
    index = {name: joint for joint, name in enumerate(names)}
    positions_of_roles = {role: positions[:, index[guess.joint]] for role, guess in guesses.items()}
    checked = dict(guesses)
    for upper, lower in BONES:
        _check_lengths(checked, positions_of_roles, upper, lower)
    if _is_swapped(positions_of_roles):
        sided = [role for role in checked if role.startswith(SIDES)]
        _lower(checked, sided, SWAPPED, "the joints named left lie on the right of the feet")
    angle = _trunk_angle(positions_of_roles)
    if angle is not None and angle < LEAST_ANGLE:
        reason = f"the trunk stands {angle:.0f} degrees from the legs, as a quadruped's"
        _lower(checked, list(checked), LEVEL, reason)
    return checked


def _lower(guesses: dict[str, RoleGuess], roles: Sequence[str], factor: float, reason: str) -> None:
    for role in roles:
        guesses[role] = guesses[role].lowered(factor, reason)


def _check_lengths(
    guesses: dict[str, RoleGuess], positions: Mapping[str, Floats], upper: str, lower: str
) -> None:
    """Lower the confidence of a bone that has no length, or differs from the other side's."""
    bones = [(side + upper, side + lower) for side in SIDES]
    if not all({first, second} <= positions.keys() for first, second in bones):
        return
    left, right = (
        float(np.median(np.linalg.norm(positions[first] - positions[second], axis=-1)))
        for first, second in bones
    )
    if max(left, right) > LARGEST_RATIO * min(left, right) or max(left, right) == 0.0:
        reason = f"the bones to it are {left:.3g} and {right:.3g} units long, left and right"
        _lower(guesses, [second for _, second in bones], UNEVEN, reason)


def _is_swapped(positions: Mapping[str, Floats]) -> bool:
    """Return whether the left leg is on the right of where the toes point in most poses."""
    needed = [side + role for side in SIDES for role in ("UpperLeg", "Foot", "Toes")]
    if not {*needed, "head"} <= positions.keys():
        return False
    feet = 0.5 * (positions["leftFoot"] + positions["rightFoot"])
    forward = 0.5 * (positions["leftToes"] + positions["rightToes"]) - feet
    left = np.cross(positions["head"] - feet, forward)
    across = positions["leftUpperLeg"] - positions["rightUpperLeg"]
    return bool(np.median(np.sum(left * across, axis=-1)) < 0.0)


def _trunk_angle(positions: Mapping[str, Floats]) -> float | None:
    """Return the angle between legs and trunk, degrees, in most poses at least; None if unknown."""
    top = next(
        (positions[role] for role in ("neck", "upperChest", "chest") if role in positions), None
    )
    if top is None or not {"hips", "leftFoot", "rightFoot"} <= positions.keys():
        return None
    down = 0.5 * (positions["leftFoot"] + positions["rightFoot"]) - positions["hips"]
    trunk = top - positions["hips"]
    lengths = np.linalg.norm(down, axis=-1) * np.linalg.norm(trunk, axis=-1)
    cosines = np.sum(down * trunk, axis=-1) / np.maximum(lengths, 1e-12)
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    return float(np.percentile(angles, POSES_SHARE))


SOLE, ANKLE = 0.028, 0.089
"""Height of the toe joint above the sole, and of the ankle of a foot without toes, per leg length;
as in the mannequin's feet."""


def standing(skeleton: Skeleton) -> Skeleton:
    """Return the skeleton with its root above the origin, and its rest pose on the floor.

    The lowest joint, end site or sole is at the height 0. Engines scale motions by the root's.
    """
    offsets = skeleton.offsets.copy()
    offsets[0] = 0.0
    positions = skeleton.at_rest(offsets)
    tips = positions[list(skeleton.tip_joints)] + skeleton.tip_offsets
    heights = [*positions[:, 1].tolist(), *tips[:, 1].tolist()]
    roles = roles_of(skeleton.names, skeleton.parents)
    index = {role: skeleton.names.index(name) for role, name in roles.items()}
    for side in ("left", "right"):
        leg = [index.get(side + segment, -1) for segment in ("UpperLeg", "LowerLeg", "Foot")]
        if -1 in leg:
            continue
        length = float(np.linalg.norm(np.diff(positions[leg], axis=0), axis=1).sum())
        toes = index.get(f"{side}Toes")
        if toes is not None:
            heights.append(float(positions[toes, 1]) - SOLE * length)
        elif leg[2] not in (*skeleton.parents, *skeleton.tip_joints):
            heights.append(float(positions[leg[2], 1]) - ANKLE * length)
    offsets[0, 1] = -min(heights)
    return replace(skeleton, offsets=offsets)
