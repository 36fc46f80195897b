"""Joints of a glTF document: those of its skins, else the tree of animated nodes; its rig."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from posefield.common.array_shapes import Bones
from posefield.common.errors import MotionFileError
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.rigs import gltf_document
from posefield.rigs.gltf_document import GltfDocument
from posefield.rigs.rest_joints import MAX_JOINTS, OuterTransform, RestJoints

EIGHTH = float(np.cos(np.pi / 8))
"""Product of two quaternions that are turned against each other by an eighth of a turn."""


@dataclass(frozen=True)
class GltfJoints:
    """Joints as nodes of a document, parents first.

    nodes: index of each joint's node. parents: of the joints. outer: nodes from the scene's root to
    the first joint's parent. rest_rotations (J, 4): local to the parent at rest, the first in the
    file's world; of the bind pose where the file has one.
    """

    nodes: tuple[int, ...]
    parents: tuple[int, ...]
    names: tuple[str, ...]
    outer: tuple[int, ...]
    rest_rotations: Floats
    notes: tuple[str, ...]


def node_transform(document: GltfDocument, index: int) -> OuterTransform:
    """Return the transform of a node; MotionFileError for a matrix that skews or mirrors."""
    node = document.parts.nodes[index]
    if node.matrix is not None and list(node.matrix) != np.eye(4).ravel().tolist():
        return _of_matrix(document, index, np.array(node.matrix, float).reshape(4, 4).T)
    x, y, z, w = map(float, node.rotation or (0, 0, 0, 1))
    turn = np.array([w, x, y, z])
    if not np.linalg.norm(turn) > 0.0:
        raise document.error(f"node {index} has rotation 0, expected a unit quaternion")
    place = np.array(node.translation or (0, 0, 0), float)
    return OuterTransform(quat.normalize(turn), place, np.array(node.scale or (1, 1, 1), float))


def _of_matrix(document: GltfDocument, index: int, matrix: Floats) -> OuterTransform:
    sizes = np.linalg.norm(matrix[:3, :3], axis=0)
    axes = matrix[:3, :3] / np.maximum(sizes, 1e-30)
    if np.abs(axes.T @ axes - np.eye(3)).max() > 1e-3 or np.linalg.det(axes) < 0.0:
        raise document.error(f"node {index} has a matrix that skews or mirrors, expected neither")
    return OuterTransform(quat.from_matrix(axes), matrix[:3, 3], sizes)


def joints_of(document: GltfDocument, animated: Iterable[int]) -> GltfJoints:
    """Return the joints of the file's one skeleton.

    animated: nodes of the animation. Raises MotionFileError for a file without a skeleton, with
    several, or with a tree that is none.
    """
    above = _parents(document)
    notes: tuple[str, ...] = ()
    if document.parts.skins:
        root, members = _skinned(document, above)
    else:
        root, members = _animated_tree(document, above, set(animated))
        notes = ("no skin: the tree of animated nodes was taken as the skeleton",)
    order = [node for node in _below(document, root) if node in members]
    if len(order) > MAX_JOINTS:
        raise document.error(f"found {len(order)} joints, expected at most {MAX_JOINTS}")
    places = {node: joint for joint, node in enumerate(order)}
    parents = (-1, *(places[above[node]] for node in order[1:]))
    names, unnamed = _names(document, order)
    if unnamed:
        notes += (f"{unnamed} joints without a name of their own were named after their nodes",)
    outer = tuple(reversed(_ancestors(above, root)[1:]))
    rest = _rest_rotations(document, order, parents, outer)
    return GltfJoints(tuple(order), parents, names, outer, rest, notes)


def rest_places(document: GltfDocument, joints: GltfJoints) -> Bones:
    """Return the translations (J, 3) at rest, local to the parent, the first in the file's world.

    They are in the units of the parent joint, whose scale the file may state.
    """
    found = np.stack([node_transform(document, node).translation for node in joints.nodes])
    for node in reversed(joints.outer):
        still = node_transform(document, node)
        found[0] = still.translation + quat.rotate(still.rotation, still.scale * found[0])
    return found


def _parents(document: GltfDocument) -> dict[int, int]:
    """Return the parent of each node that has one; MotionFileError for a circle or two parents."""
    above: dict[int, int] = {}
    count = len(document.parts.nodes)
    for parent, node in enumerate(document.parts.nodes):
        for child in node.children or ():
            if child in above or not 0 <= child < count:
                raise document.error(f"node {child} is no child of one node, expected a tree")
            above[child] = parent
    for node in range(count):
        seen = {node}
        while node in above:
            node = above[node]
            if node in seen:
                raise document.error(f"node {node} is its own ancestor, expected a tree")
            seen.add(node)
    return above


def _ancestors(above: dict[int, int], node: int) -> list[int]:
    """Return a node and its ancestors, the scene's root last."""
    found = [node]
    while found[-1] in above:
        found.append(above[found[-1]])
    return found


def _below(document: GltfDocument, root: int) -> list[int]:
    """Return a node and its descendants, parents first, in the order of the file."""
    found, ahead = [], [root]
    while ahead:
        node = ahead.pop()
        found.append(node)
        ahead += reversed(document.parts.nodes[node].children or [])
    return found


def _common_ancestor(above: dict[int, int], nodes: Sequence[int]) -> int | None:
    """Return the last node that is each of the nodes or an ancestor of it; None if none is."""
    chains = [list(reversed(_ancestors(above, node))) for node in nodes]
    common = None
    for level in zip(*chains, strict=False):
        if len(set(level)) > 1:
            break
        common = level[0]
    return common


def _skinned(document: GltfDocument, above: dict[int, int]) -> tuple[int, set[int]]:
    """Return the root of the joints of all skins, and the joints with the nodes between them."""
    groups: list[set[int]] = []
    for skin in document.parts.skins:
        own = set(skin.joints or ())
        if not own or not own <= set(range(len(document.parts.nodes))):
            raise document.error("found a skin without joints, expected some")
        root = _common_ancestor(above, sorted(own))
        tree = own if root is None else _between(above, own, root)
        joined = [group for group in groups if group & tree]
        groups = [group for group in groups if not group & tree] + [tree.union(*joined)]
    if len(groups) > 1:
        named = ", ".join(
            str(document.parts.nodes[min(group)].name or min(group)) for group in groups
        )
        raise document.error(
            f"found {len(groups)} skeletons ({named}), expected one: export each character alone"
        )
    root = _common_ancestor(above, sorted(groups[0]))
    if root is None:
        raise document.error("found joints without a common root, expected one tree")
    return root, _between(above, groups[0], root)


def _between(above: dict[int, int], nodes: set[int], root: int) -> set[int]:
    """Return the nodes with all nodes between them and the root."""
    found = {root}
    for node in nodes:
        while node not in found:
            found.add(node)
            node = above[node]
    return found


def _animated_tree(
    document: GltfDocument, above: dict[int, int], animated: set[int]
) -> tuple[int, set[int]]:
    """Return the root of the animated nodes, and all nodes below it that draw nothing."""
    root = _common_ancestor(above, sorted(animated)) if animated else None
    if root is None:
        raise document.error("found no skin and no tree of animated nodes, expected a skeleton")
    members = set()
    for node in _below(document, root):
        parts = document.parts.nodes[node]
        if (node == root or above[node] in members) and parts.mesh is None and parts.camera is None:
            members.add(node)
    if len(members) < 2:
        raise document.error(
            f"found an animation of node {document.parts.nodes[root].name!r} without a skeleton, "
            "expected a skin or a tree of nodes"
        )
    return root, members


def _names(document: GltfDocument, nodes: Sequence[int]) -> tuple[tuple[str, ...], int]:
    """Return a name for each joint, and how many have none of their own."""
    names: list[str] = []
    unnamed = 0
    for node in nodes:
        name = document.parts.nodes[node].name
        if not name or name in names:
            unnamed += 1
            name = f"{name or 'joint'}_{node}"
        names.append(name)
    if len(set(names)) < len(names):
        raise document.error("found joints of one name, expected a name for each")
    return tuple(names), unnamed


def _rest_rotations(
    document: GltfDocument, nodes: Sequence[int], parents: Sequence[int], outer: Sequence[int]
) -> Floats:
    """Return the rotations (J, 4) at rest, of the bind pose for joints of a skin."""
    own = np.stack([node_transform(document, node).rotation for node in nodes])
    for node in reversed(outer):
        own[0] = quat.mul(node_transform(document, node).rotation, own[0])
    bound = _bind_orientations(document)
    world = own.copy()
    for joint, node in enumerate(nodes):
        if joint:
            world[joint] = quat.mul(world[parents[joint]], own[joint])
        if node in bound:
            world[joint] = bound[node]
    local = world.copy()
    local[1:] = quat.mul(quat.conj(world[list(parents[1:])]), world[1:])
    # Exporters differ on the frame of bind matrices, but not on turns between joints: the first
    # joint keeps the turn of its node where the bind pose is turned by an eighth or more.
    if abs(float(np.sum(own[0] * world[0]))) < EIGHTH:
        local[0] = own[0]
    return local


def _bind_orientations(document: GltfDocument) -> dict[int, Any]:
    """Return the orientation of each joint that has an inverse bind matrix, by its node."""
    found: dict[int, Any] = {}
    for skin in document.parts.skins:
        if skin.inverseBindMatrices is None:
            continue
        inverse = gltf_document.numbers(document, skin.inverseBindMatrices, "MAT4")
        if len(inverse) < len(skin.joints):
            raise document.error(f"found {len(inverse)} bind matrices of {len(skin.joints)} joints")
        for node, matrix in zip(skin.joints, inverse.reshape(-1, 4, 4), strict=False):
            axes = matrix[:3, :3].T / np.maximum(np.linalg.norm(matrix[:3, :3].T, axis=0), 1e-30)
            if np.abs(axes.T @ axes - np.eye(3)).max() < 1e-2 and np.linalg.det(axes) > 0.0:
                found.setdefault(node, quat.conj(quat.from_matrix(axes)))
    return found


MAX_BYTES = 1_000_000_000
"""Limit of a file or buffer."""


def read(
    path: Path, source: str
) -> tuple[RestJoints, tuple[str, ...], tuple[int, ...], tuple[str, ...]]:
    """Return the joints of the skins of a .glb or .gltf file, their nodes, the skins and notes.

    source: name of the file in messages. Raises MotionFileError for a file without a skin, with
    several skeletons, and for animated nodes above the skeleton or animated scales.
    """

    def beside(name: str) -> bytes:
        parts = PurePosixPath(name).parts
        if not parts or parts[0] == "/" or ".." in parts:
            raise MotionFileError(source, f"refers to {name!r}, expected a path below its folder")
        return _content(path.parent / name)

    document = gltf_document.load(_content(path), source, beside)
    if not document.parts.skins:
        raise document.error("found no skin, expected a character whose mesh is bound to joints")
    joints = joints_of(document, ())
    _refuse_animated(document, joints)
    local = [node_transform(document, node) for node in joints.nodes]
    outer = OuterTransform(quat.IDENTITY, np.zeros(3), np.ones(3))
    for node in reversed(joints.outer):
        outer = outer.inside(node_transform(document, node))
    turns = joints.rest_rotations.copy()
    # The reader gives the first joint's rotation in the world.
    turns[0] = quat.mul(quat.conj(outer.rotation), turns[0])
    rest = RestJoints(
        source,
        joints.names,
        joints.parents,
        turns,
        np.stack([own.translation for own in local]),
        np.stack([own.scale for own in local]),
        outer,
        1.0,
        "y",
    )
    skins = tuple(range(len(document.parts.skins)))
    return rest, tuple(map(str, joints.nodes)), skins, joints.notes


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as fault:
        raise MotionFileError(path, f"cannot be read: {fault.strerror}") from fault
    if len(content) > MAX_BYTES:
        raise MotionFileError(path, f"found more than {MAX_BYTES} bytes, expected at most these")
    return content


def _refuse_animated(document: GltfDocument, joints: GltfJoints) -> None:
    """Raise MotionFileError for curves that would remain beside the new motion.

    Curves of rotations and translations of joints are replaced.
    """
    for animation in document.parts.animations:
        for channel in animation.channels:
            node, part = channel.target.node, channel.target.path
            outer = node in joints.outer and part != "weights"
            if outer or (node in joints.nodes and part == "scale"):
                name = document.parts.nodes[node].name or node
                raise document.error(
                    f"animation {animation.name!r} changes the {part} of {name!r}, expected none "
                    "above the skeleton and no animated scale: export the character alone"
                )
