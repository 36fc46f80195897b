"""Motions of segments on the floor at one frame rate, and poses of one skeleton for another."""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.errors import MotionError
from posefield.common.units import UP, Bones, Floats, RootPath, Rotations
from posefield.common.value_cache import ValueCache
from posefield.feet import limbs
from posefield.feet.footsteps import Character
from posefield.feet.limbs import LimbPoses
from posefield.locomotion import floor_plane
from posefield.motion import quat, skeleton
from posefield.motion.skeleton import Skeleton

RATE = 60.0
"""Frames a second at which performances are planned and joined, whatever their frame rate is."""


@dataclass(frozen=True)
class FloorMotion:
    """Rigid motion over the floor: a turn about +Y, rad, then a shift, m.

    shift: forward is its real part, left its imaginary part, as in `floor_plane`.
    """

    turn: float = 0.0
    shift: complex = 0j

    def place(self, points: Annotated[Floats, "*batch 3"]) -> Annotated[Floats, "*batch 3"]:
        """Return the moved points (..., 3), m."""
        floor = floor_plane.project(points) * np.exp(1j * self.turn) + self.shift
        return floor_plane.at_height(floor, points[..., 1])

    def after(self, first: "FloorMotion") -> "FloorMotion":
        """Return the motion that is `first`, then this one."""
        return FloorMotion(
            self.turn + first.turn, complex(np.exp(1j * self.turn) * first.shift + self.shift)
        )

    def inverse(self) -> "FloorMotion":
        """Return the motion back."""
        return FloorMotion(-self.turn, complex(-np.exp(-1j * self.turn) * self.shift))


@dataclass(frozen=True)
class Passage:
    """Motion of one segment at `RATE` frames a second.

    rotations: (F, J, 4), local to the parents, wxyz. roots: (F, 3), m. contacts: probabilities
    (F, K) that the feet of the performance touch the ground. sigmas: (F,), m. phases: of the cycle
    (F,), in [0, 1); None for motions without one.
    """

    rotations: Rotations
    roots: RootPath
    contacts: Annotated[Floats, "frames feet"]
    sigmas: Annotated[Floats, "frames"]
    phases: Annotated[Floats, "frames"] | None = None

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.roots)

    def heading(self, frame: int = 0) -> float:
        """Return the heading of the root in a frame, rad."""
        return float(quat.twist(self.rotations[frame, 0], UP))

    def limbs(self, body: Character, joints: Sequence[int]) -> LimbPoses:
        """Return the poses of joints of a body and of those above them."""
        return limbs.evaluate_joints(body.parents, body.bones, joints, self.rotations, self.roots)

    def placed(self, by: FloorMotion) -> "Passage":
        """Return the passage moved over the floor."""
        turned = floor_plane.turn_roots(self.rotations, np.full(len(self), by.turn))
        return replace(self, rotations=turned, roots=by.place(self.roots))

    def part(self, begin: int, end: int) -> "Passage":
        """Return the frames from `begin` until before `end`."""
        rows = slice(begin, end)
        phases = None if self.phases is None else self.phases[rows]
        return Passage(
            self.rotations[rows], self.roots[rows], self.contacts[rows], self.sigmas[rows], phases
        )


def concatenate(*passages: Passage) -> Passage:
    """Return passages one after another; with phases if all have them."""
    phases = [passage.phases for passage in passages if passage.phases is not None]
    return Passage(
        np.concatenate([passage.rotations for passage in passages]),
        np.concatenate([passage.roots for passage in passages]),
        np.concatenate([passage.contacts for passage in passages]),
        np.concatenate([passage.sigmas for passage in passages]),
        np.concatenate(phases) if len(phases) == len(passages) else None,
    )


MOST_APART = np.radians(20.0)
"""Largest angle between the same bone of two rest poses, rad."""
# A shorter bone has no direction, m.
SHORTEST_BONE = 1e-3
# Directions of bones leave a joint's twist open; this weight, m², of no turn decides it.
NO_TURN = 1e-6
# Smaller angles are rounding, rad.
LEAST_ANGLE = 1e-9
# Pairs of skeletons that are kept: a match takes as long as a second of poses.
KEPT_MATCHES = 64


class SkeletonsDiffer(MotionError):
    """Two skeletons that are not one tree of joints with nearly the same rest pose."""


@dataclass(frozen=True)
class SkeletonMatch:
    """Turns that make poses of one skeleton poses of another.

    parents: of both. turns: (J, 4), from the axes of the target's joints to those of the source's.
    notes: in words, how the skeletons differ.
    """

    parents: tuple[int, ...]
    turns: Annotated[Floats, "joints 4"]
    notes: tuple[str, ...] = ()

    def rotations(
        self, source: Annotated[Floats, "*poses joints 4"]
    ) -> Annotated[Floats, "*poses joints 4"]:
        """Return local rotations (..., J, 4) of the target whose bones point as in the source."""
        if np.all(self.turns == quat.IDENTITY):
            return source
        turned = quat.mul(source, self.turns)
        above = self.turns[list(self.parents[1:])]
        rest = quat.mul(quat.conj(above), turned[..., 1:, :])
        return np.concatenate([turned[..., :1, :], rest], axis=-2)


def match_skeletons(source: Skeleton, target: Skeleton, feet: Sequence[int] = ()) -> SkeletonMatch:
    """Return what turns poses of one skeleton into poses of another of the same tree.

    Joints are matched by their place in the tree. feet: joints that contact the ground. A foot from
    its ankle on turns as in the source from the rest pose, in which soles are flat: its bones slope
    as much as its ankle is high. Matches of the latest pairs are kept. Raises SkeletonsDiffer for
    another number of joints, another parent, or rest poses more than 20 degrees apart.
    """
    key = _value(source), _value(target), tuple(feet)
    return _matches.find(key, lambda: _match(source, target, feet))


_matches: ValueCache[Hashable, SkeletonMatch] = ValueCache(KEPT_MATCHES)


def _value(joints_of: Skeleton) -> Hashable:
    """Return what two equal skeletons have in common."""
    numbers = joints_of.offsets.tobytes(), joints_of.tip_offsets.tobytes()
    return joints_of.names, joints_of.parents, joints_of.tip_joints, numbers


def _match(source: Skeleton, target: Skeleton, feet: Sequence[int]) -> SkeletonMatch:
    _expect_one_tree(source, target)
    turns = np.tile(quat.IDENTITY, (len(source), 1))
    flat = _soles(target, feet)
    angles = np.zeros(len(source))
    for joint, parent in enumerate(source.parents):
        arms = [_directions(side, joint, source, target) for side in (source, target)]
        if not len(arms[0]):
            # A joint without bones turns with its parent.
            turns[joint] = turns[parent] if joint and joint not in flat else quat.IDENTITY
            continue
        across = np.linalg.norm(np.cross(arms[0], arms[1]), axis=-1)
        angles[joint] = np.arctan2(across, np.sum(arms[0] * arms[1], axis=-1)).max()
        if angles[joint] > LEAST_ANGLE and joint not in flat:
            turns[joint] = _turn(*arms)
    _expect_near(source, target, angles)
    turns.flags.writeable = False
    return SkeletonMatch(source.parents, turns, tuple(_notes(source, target, angles)))


def scale_heights(roots: RootPath, share: float) -> RootPath:
    """Return roots (F, 3), m, at heights times the share of leg lengths; paths stay as they are."""
    scaled: RootPath = roots * np.array([1.0, share, 1.0])
    return scaled


def leg_share(parents: tuple[int, ...], source: Bones, target: Bones, feet: Sequence[int]) -> float:
    """Return the leg length of bones (J, 3), m, over that of the source's; 1 without feet.

    A leg's length is that of the bones from the root to the foot.
    """
    if not feet:
        return 1.0
    chains = [skeleton.joint_chain(parents, foot)[1:] for foot in feet]
    long = [
        sum(float(np.linalg.norm(bones[list(chain)], axis=-1).sum()) for chain in chains)
        for bones in (target, source)
    ]
    return long[0] / long[1]


def _soles(target: Skeleton, feet: Sequence[int]) -> set[int]:
    """Return the joints of feet: the ends of the legs, and what they carry."""
    below = skeleton.descendant_matrix(target.parents)
    joints: set[int] = set()
    for foot in feet:
        leg = limbs.find_limb(target.parents, target.offsets, foot)
        joints.update(np.flatnonzero(below[foot if leg is None else leg.lower]).tolist())
    return joints


def _expect_one_tree(source: Skeleton, target: Skeleton) -> None:
    if len(source) != len(target):
        raise SkeletonsDiffer(f"{len(source)} joints, expected {len(target)}")
    for joint, (parent, expected) in enumerate(zip(source.parents, target.parents, strict=True)):
        if parent != expected:
            raise SkeletonsDiffer(
                f"joint {joint}, {source.names[joint]!r}, is a child of "
                f"{source.names[parent]!r}, expected as {target.names[joint]!r} of "
                f"{target.names[expected]!r}: joint {expected}"
            )


def _expect_near(source: Skeleton, target: Skeleton, angles: Annotated[Floats, "joints"]) -> None:
    joint = int(np.argmax(angles))
    if angles[joint] > MOST_APART:
        raise SkeletonsDiffer(
            f"a bone at joint {joint}, {source.names[joint]!r}, points"
            f" {np.degrees(angles[joint]):.0f} degrees away from that at {target.names[joint]!r} in"
            f" the rest poses, expected at most {np.degrees(MOST_APART):.0f}"
        )


def _notes(
    source: Skeleton, target: Skeleton, angles: Annotated[Floats, "joints"]
) -> Iterator[str]:
    pairs = [pair for pair in zip(source.names, target.names, strict=True) if pair[0] != pair[1]]
    if pairs:
        yield (
            f"{len(pairs)} of {len(source)} joints have other names, such as {pairs[0][0]!r} for"
            f" {pairs[0][1]!r}: joints are matched by their place in the tree"
        )
    if angles.max() > LEAST_ANGLE:
        yield (
            f"the rest poses differ by {np.degrees(angles.max()):.1f} degrees at most: bones point"
            " as in the source, but for those of feet, which are flat where they are in the source"
        )


def _directions(
    side: Skeleton, joint: int, source: Skeleton, target: Skeleton
) -> Annotated[Floats, "bones 3"]:
    """Return the bones of a joint (B, 3), m, that have a length in both skeletons.

    They lead to its children, or to its end sites where these are as many in both.
    """
    children = [child for child, parent in enumerate(side.parents) if parent == joint]
    both = [np.linalg.norm(compared.offsets[children], axis=-1) for compared in (source, target)]
    arms: Floats = side.offsets[children][np.min(both, axis=0) > SHORTEST_BONE]
    if len(arms):
        return arms
    tips = [
        compared.tip_offsets[np.array(compared.tip_joints) == joint]
        for compared in (source, target)
    ]
    if len(tips[0]) != len(tips[1]) or not len(tips[0]):
        return np.zeros((0, 3))
    long = np.min([np.linalg.norm(compared, axis=-1) for compared in tips], axis=0) > SHORTEST_BONE
    directions: Floats = side.tip_offsets[np.array(side.tip_joints) == joint][long]
    return directions


def _turn(
    source: Annotated[Floats, "bones 3"], target: Annotated[Floats, "bones 3"]
) -> Annotated[Floats, "4"]:
    """Return the rotation (4,) that brings bones of the target onto those of the source.

    Of one bone the smallest; of several that of least squares (Wahba's problem, by the singular
    value decomposition of Markley 1988).
    """
    if len(source) == 1:
        return limbs.shortest_turn(target[0], source[0])
    left, _, right = np.linalg.svd(source.T @ target + NO_TURN * np.eye(3))
    sign = np.sign(np.linalg.det(left) * np.linalg.det(right))
    return quat.from_matrix(left @ np.diag([1.0, 1.0, sign]) @ right)
