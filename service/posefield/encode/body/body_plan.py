"""Plan of a body: whether a skeleton is built like a person, and its chains of bones.

The form decides, not the names of the joints: so a model has the same body whatever its joints are
called, and skeletons without roles have one too.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.encode.body import bone_chain
from posefield.encode.body.bone_chain import BoneChain
from posefield.motion.skeleton import Skeleton

UP = np.array([0.0, 1.0, 0.0])
LEG_LENGTH = 0.85
"""Length of the leg from hip to ankle, m, of a person for whom all other measures are given."""
TURN = 0.7
"""Cosine of the angle between shin and foot below which the foot turns off."""
LONGEST_LOWER = 1.15
"""Longest forearm or shin, beside the bone above it."""


@dataclass(frozen=True)
class PointTree:
    """Joints and tips of a skeleton at rest.

    joints: J. above (J + E,): parent of each. places (J + E, 3): m.
    """

    joints: int
    above: tuple[int, ...]
    places: Floats

    def path(self, point: int) -> tuple[int, ...]:
        """Return the points from the root to a point."""
        found = [point]
        while self.above[found[0]] >= 0:
            found.insert(0, self.above[found[0]])
        return tuple(found)

    def leaves(self) -> tuple[int, ...]:
        """Return the points without a child."""
        held = set(self.above)
        return tuple(point for point in range(len(self.above)) if point not in held)

    def chain(self, path: Sequence[int]) -> BoneChain:
        """Return the chain of bones along a path."""
        return bone_chain.chain(path, self.places, self.joints)


@dataclass(frozen=True)
class Limb:
    """An arm or a leg: chain from the trunk, and the points at its root, middle and end.

    root, middle, end: shoulder, elbow and wrist or hip, knee and ankle, as indices of the chain.
    """

    chain: BoneChain
    root: int
    middle: int
    end: int

    def point(self, index: int) -> Floats:
        """Return a point of the chain (3,), m."""
        found: Floats = self.chain.points[index]
        return found


@dataclass(frozen=True)
class PersonPlan:
    """Parts of a person. left first; side, front: unit vectors to the left and ahead.

    head: index, in the chain of the trunk, of the joint below the head. scale: size beside a
    person whose leg is LEG_LENGTH long. others: chains of bones that no person has, such as a tail.
    """

    trunk: BoneChain
    head: int
    legs: tuple[Limb, Limb]
    arms: tuple[Limb, Limb]
    side: Floats
    front: Floats
    scale: float
    others: tuple[BoneChain, ...]


def point_tree(skeleton: Skeleton) -> PointTree:
    """Return joints and tips of a skeleton in its rest pose."""
    rest = skeleton.at_rest(skeleton.offsets)
    tips = rest[list(skeleton.tip_joints)] + skeleton.tip_offsets
    above = (*skeleton.parents, *skeleton.tip_joints)
    return PointTree(len(skeleton), above, np.concatenate([rest, tips]))


def person(tree: PointTree) -> PersonPlan | None:
    """Return the parts of a person; None if the skeleton is not built like one.

    It is if the head is the highest leaf, the feet are the lowest on either side, the hands reach
    furthest from the trunk on either side, both legs part below both arms, and each limb has two
    long bones.
    """
    leaves = tree.leaves()
    if len(leaves) < 5:
        return None
    feet, hands, head = _outermost(tree, leaves)
    if len({*feet, *hands, head}) < 5:
        return None
    paths = {point: tree.path(point) for point in (*feet, *hands, head)}
    pelvis, chest = _fork(paths[feet[0]], paths[feet[1]]), _fork(*(paths[hand] for hand in hands))
    trunk = paths[head]
    if pelvis not in trunk or chest not in trunk or trunk.index(chest) <= trunk.index(pelvis):
        return None
    legs = [_limb(tree, paths[foot], pelvis) for foot in feet]
    arms = [_limb(tree, paths[hand], chest) for hand in hands]
    if None in (*legs, *arms):
        return None
    return _checked(
        tree,
        trunk[trunk.index(pelvis) :],
        chest,
        tuple(limb for limb in (*legs, *arms) if limb),
        paths,
    )


def _outermost(
    tree: PointTree, leaves: Sequence[int]
) -> tuple[tuple[int, int], tuple[int, int], int]:
    """Return the leaves that would be feet, hands and head of a person."""
    at = tree.places
    head = max(leaves, key=lambda leaf: (at[leaf, 1], -leaf))
    rest = [leaf for leaf in leaves if leaf != head]
    lowest = min(at[leaf, 1] for leaf in rest)
    height = at[head, 1] - lowest
    low = [leaf for leaf in rest if at[leaf, 1] < lowest + 0.1 * height] or rest
    high = [leaf for leaf in rest if leaf not in low] or rest
    feet, hands = (_pair(tree, some) for some in (low, high))
    return feet, hands, head


def _pair(tree: PointTree, leaves: Sequence[int]) -> tuple[int, int]:
    """Return the leaves furthest to either side, along the direction in which they spread most."""
    at = tree.places[list(leaves)][:, [0, 2]]
    axis = int(np.argmax(np.ptp(at, axis=0)))
    order = np.argsort(at[:, axis], kind="stable")
    return leaves[int(order[-1])], leaves[int(order[0])]


def _fork(first: Sequence[int], second: Sequence[int]) -> int:
    """Return the last point that two paths share."""
    shared = [a for a, b in zip(first, second, strict=False) if a == b]
    return shared[-1]


def _limb(tree: PointTree, path: Sequence[int], start: int) -> Limb | None:
    """Return the limb along a path from a point of the trunk; None without two long bones.

    They are the bone and what follows it, up to its end, whose shorter one is the longest.
    """
    chain = tree.chain(path[path.index(start) :])
    jointed = len(chain.points) - chain.tipped
    best, found = 0.0, None
    for root in range(jointed - 2):
        upper = float(np.linalg.norm(chain.points[root + 1] - chain.points[root]))
        end = _lower_end(chain.points[root + 1 : jointed], upper) + root + 1
        lower = float(np.linalg.norm(chain.points[end] - chain.points[root + 1]))
        if min(upper, lower) > best:
            best, found = min(upper, lower), Limb(chain, root, root + 1, end)
    return found


def _lower_end(points: Floats, upper: float) -> int:
    """Return the index of the wrist or ankle among the joints from elbow or knee on.

    The wrist is the last one not further away than the upper bone is long; at the ankle, the
    foot turns off.
    """
    for at in range(1, len(points) - 1):
        here, after = points[at] - points[0], points[at + 1] - points[at]
        turn = float(here @ after) / float(np.linalg.norm(here) * np.linalg.norm(after))
        long = float(np.linalg.norm(points[at + 1] - points[0]))
        if turn < TURN or long > LONGEST_LOWER * upper:
            return at
    return len(points) - 1


def _checked(
    tree: PointTree,
    trunk: Sequence[int],
    chest: int,
    limbs: tuple[Limb, ...],
    paths: dict[int, tuple[int, ...]],
) -> PersonPlan | None:
    """Return the plan of the parts if their proportions are those of a person."""
    legs, arms = limbs[:2], limbs[2:]
    length = float(np.mean([_length(leg) for leg in legs]))
    hips, shoulders = (
        np.mean([limb.point(limb.root) for limb in pair], axis=0) for pair in (legs, arms)
    )
    ankles = np.mean([leg.point(leg.end) for leg in legs], axis=0)
    rise = tree.places[trunk[-1], 1] - shoulders[1]
    upright = shoulders[1] - hips[1] > 0.3 * length and hips[1] - ankles[1] > 0.7 * length
    if not upright or rise < 0.08 * length or not all(0.3 * length < _length(a) for a in arms):
        return None
    side, front = _directions(legs)
    if (legs[0].point(legs[0].root) - legs[1].point(legs[1].root)) @ side < 0:
        legs = legs[::-1]
    if (arms[0].point(arms[0].root) - arms[1].point(arms[1].root)) @ side < 0:
        arms = arms[::-1]
    chain = tree.chain(trunk)
    used = {point for path in paths.values() for point in path}
    beyond = (limb.chain.anchors[limb.middle + 1 :] for limb in arms + legs)
    ends = {point for points in beyond for point in points} | {trunk[-1]}
    others = tuple(_other_chains(tree, used, ends, 0.12 * length))
    head = len(chain.points) - (2 if chain.tipped else 1)
    return PersonPlan(
        chain,
        head,
        (legs[0], legs[1]),
        (arms[0], arms[1]),
        side,
        front,
        length / LEG_LENGTH,
        others,
    )


def _length(limb: Limb) -> float:
    root, middle, end = (limb.point(i) for i in (limb.root, limb.middle, limb.end))
    return float(np.linalg.norm(middle - root) + np.linalg.norm(end - middle))


def _directions(legs: Sequence[Limb]) -> tuple[Floats, Floats]:
    """Return left and ahead: hips lie to either side, and toes point ahead, or +Z is ahead."""
    across = legs[0].point(legs[0].root) - legs[1].point(legs[1].root)
    toes = sum((leg.chain.points[-1] - leg.point(leg.end) for leg in legs), np.zeros(3))
    across[1] = 0.0
    side = across / np.linalg.norm(across)
    front = np.cross(side, UP)
    ahead = float(toes @ front)
    if ahead < 0 or (abs(ahead) < 0.01 and front[2] < 0):
        side, front = -side, -front
    return side, front


def _other_chains(
    tree: PointTree, used: set[int], ends: set[int], shortest: float
) -> Iterator[BoneChain]:
    """Yield chains of bones that leave those used, but for fingers, toes and the face."""
    for leaf in tree.leaves():
        path = tree.path(leaf)
        if leaf in used or ends & set(path):
            continue
        start = max(at for at, point in enumerate(path) if point in used)
        chain = tree.chain(path[start:])
        if chain.marks[-1] > shortest:
            used |= set(path)
            yield chain
