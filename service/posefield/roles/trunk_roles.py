"""Roles of the trunk: hips, spine, chest, neck and head, by the tree and by names."""

from collections.abc import Sequence
from dataclasses import dataclass

from posefield.roles.joint_words import HIPS, JointWord
from posefield.roles.limb_alignment import LimbJoint

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
        found = []
        while joint >= 0:
            found.append(joint)
            joint = self.parents[joint]
        return found[::-1]

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
        found = [
            joint
            for joint, word in enumerate(self.words)
            if not (word.side or word.is_helper or word.is_digit) and word.key in keys
        ]
        return min(found, key=lambda joint: not self.words[joint].is_exact, default=None)


def trunk_roles(tree: Tree, upper_legs: Sequence[int], arms: Sequence[int]) -> dict[str, LimbJoint]:
    """Return the joints of the trunk by role.

    upper_legs, arms: the first joints of the legs and of the arms; fewer than two of each tell
    nothing of the tree.
    """
    chest = tree.common(arms) if len(arms) == 2 else None
    head = tree.first(frozenset({"head"}))
    neck = _named_neck(tree, head)
    if head is None and neck is None and chest is not None:
        neck, head = _unnamed_neck(tree, chest)
        found = {"neck": LimbJoint(neck, ONE_OF_MANY)} if neck is not None else {}
        found |= {"head": LimbJoint(head, ONE_OF_MANY)} if head is not None else {}
    else:
        found = {"neck": LimbJoint(neck, NAMED)} if neck is not None else {}
        found |= {"head": LimbJoint(head, NAMED)} if head is not None else {}
    top = next((joint for joint in (neck, head, chest) if joint is not None), None)
    hips = _hips(tree, upper_legs, top)
    if hips is None:
        return found
    found = {"hips": hips} | found
    return found | _spine(tree, hips, top, top if neck is None and head is None else None)


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
        named = tree.first(HIPS)
        return None if named is None else LimbJoint(named, BY_TREE)
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
    sure = min(hips.confidence, NAMED)
    if len(chain) == 1:
        role = "chest" if tree.words[chain[0]].key in CHESTS else "spine"
        return {role: LimbJoint(chain[0], sure)}
    if len(chain) < 3:
        return {
            role: LimbJoint(joint, sure)
            for role, joint in zip(("spine", "chest"), chain, strict=False)
        }
    middle = sure if len(chain) == 3 else min(sure, ONE_OF_MANY)
    return {
        "spine": LimbJoint(chain[0], sure),
        "chest": LimbJoint(chain[len(chain) // 2], middle),
        "upperChest": LimbJoint(chain[-1], sure),
    }
