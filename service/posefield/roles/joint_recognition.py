"""Roles of joints by their names and the tree, with a confidence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from posefield.motion.joint_roles import ROLES
from posefield.roles.joint_words import joint_words
from posefield.roles.limb_alignment import ARM, LEG, LimbJoint, align_limb
from posefield.roles.trunk_roles import Tree, trunk_roles

LOWEST_CONFIDENCE = 0.8
"""Confidence below which a role has to be confirmed in the recipe."""
SIDES = ("left", "right")
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
    limbs = {f"{side}{role}": one for side in SIDES for role, one in _limbs(tree, side).items()}
    legs = [limbs[f"{side}UpperLeg"].joint for side in SIDES if f"{side}UpperLeg" in limbs]
    arms = [
        next(limbs[side + role].joint for role in ARM[:2] if side + role in limbs)
        for side in SIDES
        if {f"{side}Shoulder", f"{side}UpperArm"} & limbs.keys()
    ]
    trunk = trunk_roles(tree, legs, arms)
    guesses = {role: _guess(names, one) for role, one in (trunk | limbs).items()}
    return {role: _compared(role, guesses[role], limbs, tree) for role in ROLES if role in guesses}


def _limbs(tree: Tree, side: str) -> dict[str, LimbJoint]:
    """Return the joints of the arm and of the leg of a side, by role without the side."""
    leaves = set(range(len(tree.parents))) - set(tree.parents)
    paths = [
        [joint for joint in tree.path(leaf) if tree.words[joint].side == side]
        for leaf in sorted(leaves)
    ]
    return align_limb(paths, tree.words, ARM) | align_limb(paths, tree.words, LEG)


def _guess(names: Sequence[str], one: LimbJoint) -> RoleGuess:
    reasons: tuple[str, ...] = ()
    if one.confidence < LOWEST_CONFIDENCE:
        reasons = ("other joints fit as well, or the tree contradicts the name",)
    return RoleGuess(names[one.joint], one.confidence, reasons)


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
