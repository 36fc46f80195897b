"""Skeleton: a tree of joints, and its forward kinematics."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np

from posefield.common.bounded_types import Index, Name, Parent
from posefield.common.units import UP, Bones, Floats, Indices
from posefield.motion import quat

# Poses that are computed at once: their planes take 7 MB for 31 joints.
POSES_PER_BLOCK = 2000
FEW_POSES = 128
"""Poses up to which all joints of one depth are computed at once: most of their time is that of
calling NumPy, and a tree has fewer depths than joints."""
# Components of b, and of -b after them, in the terms of a product a b, which are those of w, x, y
# and z of a in this order.
TERMS = np.array([[0, 1, 2, 3], [5, 0, 7, 2], [6, 3, 0, 5], [7, 6, 1, 0]])


@dataclass(frozen=True)
class Skeleton:
    """Joints in an order with parents first, their rest offsets, and the end sites.

    names: one per joint, unique. parents (J,): index of each joint's parent, -1 for the root, which
    comes first; a parent always precedes its children. offsets (J, 3): rest translation from the
    parent, m. tip_joints (E,): the joint of each end site. tip_offsets (E, 3): translation of each
    end site from its joint, m. In the rest pose every rotation is the identity.
    """

    names: tuple[Name, ...]
    parents: tuple[Parent, ...]
    offsets: Bones
    tip_joints: tuple[Index, ...]
    tip_offsets: Annotated[Floats, "tips 3"]

    def __post_init__(self) -> None:
        count = len(self.names)
        if not count or len(self.parents) != count or self.offsets.shape != (count, 3):
            raise ValueError(
                f"{count} names, {len(self.parents)} parents, offsets {self.offsets.shape}"
            )
        if len(set(self.names)) != count:
            raise ValueError("joint names must be unique")
        if self.parents[0] != -1 or any(not 0 <= p < j for j, p in enumerate(self.parents[1:], 1)):
            raise ValueError("the root comes first and every parent before its children")
        if self.tip_offsets.shape != (len(self.tip_joints), 3):
            raise ValueError(f"{len(self.tip_joints)} tips, offsets {self.tip_offsets.shape}")
        if max(self.tip_joints, default=0) >= count:
            raise ValueError(f"a tip at joint {max(self.tip_joints)}, expected 0 to {count - 1}")

    @cached_property
    def tips(self) -> dict[int, tuple[float, float, float]]:
        """Return the translation of a joint's end site, m, by joint."""
        offsets = [(x, y, z) for x, y, z in self.tip_offsets.tolist()]
        return dict(zip(self.tip_joints, offsets, strict=True))

    def __len__(self) -> int:
        return len(self.names)

    def at_rest(
        self, offsets: Annotated[Floats, "*poses joints 3"]
    ) -> Annotated[Floats, "*poses joints 3"]:
        """Return the joint positions (..., J, 3) in the rest pose with offsets (..., J, 3), m."""
        positions = offsets.copy()
        for joint, parent in enumerate(self.parents[1:], 1):
            positions[..., joint, :] += positions[..., parent, :]
        return positions

    def same_tree(self, other: "Skeleton") -> bool:
        """Return whether both have the same joint names and parents, whatever their offsets."""
        return self.names == other.names and self.parents == other.parents


def translations(
    offsets: Annotated[Floats, "*#batch joints 3"], root_path: Annotated[Floats, "*batch frames 3"]
) -> Annotated[Floats, "*batch frames joints 3"]:
    """Return local translations (..., T, J, 3) of constant bone offsets and a moving root.

    offsets: (..., J, 3). root_path: (..., T, 3).
    """
    local = np.empty((*root_path.shape[:-1], *offsets.shape[-2:]))
    local[:] = offsets[..., None, :, :]
    local[..., 0, :] = root_path
    return local


def forward_kinematics(
    parents: tuple[int, ...],
    rotations: Annotated[Floats, "*#poses joints 4"],
    translations: Annotated[Floats, "*#poses joints 3"],
) -> tuple[Annotated[Floats, "*poses joints 3"], Annotated[Floats, "*poses joints 4"]]:
    """Return joint positions (..., J, 3) and orientations (..., J, 4) in the character's frame.

    rotations (..., J, 4) and translations (..., J, 3) are local to the parent and broadcast against
    each other.
    """
    lead = np.broadcast_shapes(rotations.shape[:-2], translations.shape[:-2])
    poses, joints = math.prod(lead), len(parents)
    if poses <= FEW_POSES:
        world, turns = _accumulate_levels(parents, lead, rotations, translations)
    else:
        world, turns = np.empty((joints, 3, poses)), np.empty((joints, 4, poses))
        for block, block_turns, block_arms in _blocks(lead, rotations, translations):
            world[..., block], turns[..., block] = _accumulate(
                parents, block_turns, block_arms, frozenset(range(joints))
            )
    placed, turned = (planes.transpose(2, 0, 1) for planes in (world, turns))
    return placed.reshape(*lead, joints, 3), turned.reshape(*lead, joints, 4)


def positions(
    parents: tuple[int, ...],
    rotations: Annotated[Floats, "*#poses joints 4"],
    translations: Annotated[Floats, "*#poses joints 3"],
) -> Annotated[Floats, "*poses joints 3"]:
    """Return the joint positions (..., J, 3) alone; arguments as for `forward_kinematics`."""
    lead = np.broadcast_shapes(rotations.shape[:-2], translations.shape[:-2])
    if math.prod(lead) <= FEW_POSES:
        world = _accumulate_levels(parents, lead, rotations, translations)[0]
    else:
        world = np.empty((len(parents), 3, math.prod(lead)))
        for block, block_turns, block_arms in _blocks(lead, rotations, translations):
            world[..., block] = position_planes(parents, block_turns, block_arms)
    return world.transpose(2, 0, 1).reshape(*lead, len(parents), 3)


def position_planes(
    parents: tuple[int, ...],
    rotations: Annotated[Floats, "joints 4 *poses"],
    translations: Annotated[Floats, "joints 3 *#poses"] | Sequence[Annotated[Floats, "3 ..."]],
) -> Annotated[Floats, "joints 3 *poses"]:
    """Return joint positions (J, 3, ...), one contiguous array per joint and component.

    rotations (J, 4, ...) and J translations (3, ...), which broadcast against the former, are local
    to the parent.
    """
    return _accumulate(parents, rotations, translations, frozenset(parents))[0]


def _blocks(
    lead: tuple[int, ...], rotations: Floats, translations: Floats
) -> Iterator[tuple[slice, Floats, Floats]]:
    """Yield slices of the poses with their rotations (J, 4, P) and translations (J, 3, P)."""
    arrays = (np.broadcast_to(v, (*lead, *v.shape[-2:])) for v in (rotations, translations))
    turns, arms = (v.reshape(-1, *v.shape[-2:]).transpose(1, 2, 0) for v in arrays)
    for start in range(0, turns.shape[-1], POSES_PER_BLOCK):
        block = slice(start, start + POSES_PER_BLOCK)
        first, second = (np.asarray(v[..., block], float, "C") for v in (turns, arms))
        yield block, first, second


def _accumulate(
    parents: tuple[int, ...],
    rotations: Annotated[Floats, "joints 4 *poses"],
    translations: Annotated[Floats, "joints 3 *#poses"] | Sequence[Annotated[Floats, "3 ..."]],
    turning: frozenset[int],
) -> tuple[Annotated[Floats, "joints 3 *poses"], Annotated[Floats, "joints 4 *poses"]]:
    """Return joint positions (J, 3, ...), and orientations (J, 4, ...) of the joints `turning`."""
    lead = rotations.shape[2:]
    world, turns = np.empty((len(parents), 3, *lead)), np.empty((len(parents), 4, *lead))
    world[0], turns[0] = translations[0], rotations[0]
    for joint, parent in enumerate(parents[1:], start=1):
        quat.rotate_planes(turns[parent], translations[joint], out=world[joint])
        world[joint] += world[parent]
        if joint in turning:
            quat.product_planes(turns[parent], rotations[joint], out=turns[joint])
    return world, turns


class TreeLevels(NamedTuple):
    """Levels of a tree without its root.

    levels: of the joints of one depth, their rows in the order of the levels, and the row of the
    parent of each. order: joints by level. ranks: rows of the joints.
    """

    levels: tuple[tuple[slice, Indices], ...]
    order: Indices
    ranks: Indices


@lru_cache(64)
def tree_levels(parents: tuple[int, ...]) -> TreeLevels:
    """Return the levels of a tree, whose parents precede their children."""
    depths = [0] * len(parents)
    for joint, parent in enumerate(parents[1:], start=1):
        depths[joint] = depths[parent] + 1
    order = np.argsort(depths, kind="stable")
    ranks = np.argsort(order)
    level_ends = np.cumsum(np.bincount(depths))
    levels = [
        (slice(int(begin), int(end)), ranks[np.array(parents)[order[begin:end]]])
        for begin, end in pairwise(level_ends)
    ]
    return TreeLevels(tuple(levels), order, ranks)


def _accumulate_levels(
    parents: tuple[int, ...], lead: tuple[int, ...], rotations: Floats, translations: Floats
) -> tuple[Annotated[Floats, "joints 3 poses"], Annotated[Floats, "joints 4 poses"]]:
    """Return joint positions (J, 3, P) and orientations (J, 4, P) of few poses.

    The same operations in the same order as in `quat`, so that results are bitwise equal; a
    quaternion has x and y once more at its end, so that its cyclic permutations are slices.
    """
    tree, count = tree_levels(parents), math.prod(lead)
    arrays = (np.broadcast_to(v, (*lead, *v.shape[-2:])) for v in (rotations, translations))
    rotations, translations = (v.reshape(-1, *v.shape[-2:]) for v in arrays)
    sorted_rotations = rotations.transpose(2, 1, 0)[:, tree.order]
    arms = translations.transpose(2, 1, 0)[:, tree.order]
    arms = np.concatenate([arms, arms[:2]])
    terms = np.concatenate([sorted_rotations, -sorted_rotations])[TERMS]
    world, turns = np.empty((3, len(parents), count)), np.empty((6, len(parents), count))
    world[:, 0], turns[:4, 0], turns[4:, 0] = (
        arms[:3, 0],
        sorted_rotations[:, 0],
        sorted_rotations[1:3, 0],
    )
    for rows, parent_rows in tree.levels:
        above = turns[:, parent_rows]
        placed = _rotated(above, arms[:, rows])
        placed += world[:, parent_rows]
        world[:, rows] = placed
        turned = above[0] * terms[0, :, rows]
        for component in (1, 2, 3):
            turned += above[component] * terms[component, :, rows]
        turns[:4, rows], turns[4:, rows] = turned, turned[1:3]
    # Sums over an array depend on its layout, which is therefore that of larger numbers of poses.
    placed = np.ascontiguousarray(world[:, tree.ranks].swapaxes(0, 1))
    return placed, np.ascontiguousarray(turns[:4, tree.ranks].swapaxes(0, 1))


def _rotated(
    q: Annotated[Floats, "6 joints poses"], v: Annotated[Floats, "5 joints poses"]
) -> Annotated[Floats, "3 joints poses"]:
    """Return vectors (3, ...), with x and y again at their end, turned by quaternions."""
    yzx, zxy = q[2:5], q[3:6]
    across = np.empty(v.shape)
    np.multiply(2.0, yzx * v[2:] - zxy * v[1:4], out=across[:3])
    across[3:] = across[:2]
    rotated = v[:3] + q[0] * across[:3]
    rotated += yzx * across[2:] - zxy * across[1:4]
    return np.asarray(rotated)


@lru_cache(1024)
def joint_chain(parents: tuple[int, ...], joint: int) -> tuple[int, ...]:
    """Return the joints from the root to a joint, each the parent of the next."""
    chain = [joint]
    while parents[chain[-1]] >= 0:
        chain.append(parents[chain[-1]])
    return tuple(reversed(chain))


def descendant_matrix(parents: tuple[int, ...]) -> Annotated[Floats, "joints joints"]:
    """Return the matrix (J, J) with 1 where the column's joint is the row's or a descendant."""
    below = np.eye(len(parents))
    for joint in range(len(parents) - 1, 0, -1):
        below[parents[joint]] += below[joint]
    return below


def add_travel(
    rotations: Annotated[Floats, "*poses joints 4"],
    roots: Annotated[Floats, "*poses 3"],
    travel: Annotated[Floats, "*poses 3"],
) -> tuple[Annotated[Floats, "*poses joints 4"], Annotated[Floats, "*poses 3"]]:
    """Return rotations (..., J, 4) and root positions (..., 3), m, moved by a travel (..., 3).

    travel: to the left and ahead, m, and change of heading, rad.
    """
    turned = rotations.copy()
    turned[..., 0, :] = quat.mul(quat.from_axis_angle(UP, travel[..., 2]), rotations[..., 0, :])
    return turned, moved_roots(roots, travel)


def moved_roots(
    roots: Annotated[Floats, "*poses 3"], travel: Annotated[Floats, "*poses 3"]
) -> Annotated[Floats, "*poses 3"]:
    """Return root positions (..., 3), m, moved by a travel over the floor in (..., 3)."""
    paths = roots.copy()
    paths[..., [0, 2]] += travel[..., :2]
    return paths
