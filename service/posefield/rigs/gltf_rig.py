"""Joints of a glTF document: those of its skins, else the tree of animated nodes; its rig."""

from collections.abc import Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath

import numpy as np

from posefield.common.errors import MotionFileError
from posefield.motion import quat
from posefield.rigs import gltf_document, rest_joints
from posefield.rigs.gltf_document import GltfDocument
from posefield.rigs.rest_joints import MAX_JOINTS, JointTree, RestJoints, Transform


@dataclass(frozen=True)
class GltfJoints:
    """Joints as nodes of a document, parents first.

    nodes: index of each joint's node. outer: nodes from the scene's root to the first joint's
    parent. rest (J, ...): local to the parent at rest; of the bind pose where the file has one.
    """

    nodes: tuple[int, ...]
    tree: JointTree
    outer: tuple[int, ...]
    rest: Transform
    notes: tuple[str, ...]


def node_transform(document: GltfDocument, index: int) -> Transform:
    """Return the transform of a node; MotionFileError for a matrix that skews or mirrors."""
    node = document.parts.nodes[index]
    stated = (node.matrix, node.rotation, node.translation, node.scale)
    if not np.all(np.isfinite([number for numbers in stated for number in numbers or ()])):
        raise document.error(f"node {index} has numbers that are not finite")
    if node.matrix is not None and list(node.matrix) != np.eye(4).ravel().tolist():
        return rest_joints.of_matrix(np.array(node.matrix, float).reshape(4, 4), f"node {index}")
    x, y, z, w = map(float, node.rotation or (0, 0, 0, 1))
    turn = np.array([w, x, y, z])
    if not np.linalg.norm(turn) > 0.0:
        raise document.error(f"node {index} has rotation 0, expected a unit quaternion")
    translation = np.array(node.translation or (0, 0, 0), float)
    size = np.array(node.scale or (1, 1, 1), float)
    return Transform(quat.normalize(turn), translation, size).unmirrored()


def joints_of(
    document: GltfDocument, order: Sequence[int], alternatives: Sequence[Sequence[int]] = ()
) -> GltfJoints:
    """Return nodes, parents first, as joints. others: skeletons that are left out."""
    if len(order) > MAX_JOINTS:
        raise document.error(f"found {len(order)} joints, expected at most {MAX_JOINTS}")
    tree, notes = joint_tree(document, order), list[str]()
    if alternatives:
        listed = ", ".join(document.node_name(other[0]) for other in alternatives)
        notes.append(f"skeleton {tree.label} was read: {listed} left out")
    unnamed = len({*tree.names} - {document.parts.nodes[node].name for node in order})
    if unnamed:
        notes.append(f"{unnamed} joints without a name of their own were named after their nodes")
    outer = tuple(document.ancestors(order[0])[:0:-1])
    for node in (*outer, *order):
        document.expect_plain(f"node {document.node_name(node)}", document.parts.nodes[node])
    if document.unread:
        listed = ", ".join(sorted(document.unread))
        notes.append(f"the required {listed} was not read: no joint and no animation has it")
    local = rest_joints.stacked([node_transform(document, node) for node in order])
    bind = _bind_pose(document, {node: joint for joint, node in enumerate(order)})
    rest = rest_joints.bound_rest(local, tree.parents, outer_transform(document, outer), bind)
    return GltfJoints(tuple(order), tree, outer, rest, tuple(notes))


def outer_transform(document: GltfDocument, outer: Sequence[int]) -> Transform:
    """Return the transform of nodes, the scene's root first, from the last one to the world."""
    transform = rest_joints.WORLD
    for node in reversed(outer):
        transform = transform.inside(node_transform(document, node))
    return transform


def skeletons(document: GltfDocument) -> list[list[int]]:
    """Return the joints, parents first, of the skeletons of skins, with the nodes between them."""
    groups: list[set[int]] = []
    if len(document.parts.skins) > MAX_JOINTS:
        raise document.error(f"found {len(document.parts.skins)} skins, expected {MAX_JOINTS}")
    for skin in document.parts.skins:
        joints = set(skin.joints or ())
        if not 0 < len(joints) <= MAX_JOINTS or not joints <= set(range(len(document.parts.nodes))):
            raise document.error(
                f"found a skin of {len(joints)} joints, expected 1 to {MAX_JOINTS} of its nodes"
            )
        tree = _between(document, joints)
        joined = [group for group in groups if group & tree]
        groups = [group for group in groups if not group & tree] + [tree.union(*joined)]
    trees = [_between(document, group) for group in groups]
    roots = [[node for node in tree if document.above.get(node) not in tree] for tree in trees]
    if any(len(root_nodes) > 1 for root_nodes in roots):
        raise document.error("found joints without a common root, expected one tree")
    return [
        [node for node in document.below(root) if node in tree]
        for (root,), tree in zip(roots, trees, strict=True)
    ]


def joint_tree(document: GltfDocument, order: Sequence[int]) -> JointTree:
    """Return names and parents of nodes, parents first; names are those of nodes or unique ones."""
    joint_of_node = {node: joint for joint, node in enumerate(order)}
    names: dict[str, int] = {}
    for node in order:
        name = document.parts.nodes[node].name
        names.setdefault(f"{name or 'joint'}_{node}" if not name or name in names else name, node)
    if len(names) < len(order):
        raise document.error("found joints of one name, expected a name for each")
    parents = (-1, *(joint_of_node[document.above[node]] for node in order[1:]))
    return JointTree(document.node_name(order[0]), tuple(names), parents)


def _between(document: GltfDocument, nodes: set[int]) -> set[int]:
    """Return nodes with all nodes between them and the last one above all, if there is one."""
    root = document.common_ancestor(sorted(nodes))
    between = set(nodes if root is None else [root])
    for node in nodes:
        while node not in between:
            between.add(node)
            node = document.above[node]
    return between


def _bind_pose(document: GltfDocument, joints: Mapping[int, int]) -> dict[int, Transform]:
    """Return orientation and place of each joint that has an inverse bind matrix.

    joints: by node.
    """
    binds: dict[int, Transform] = {}
    for skin in document.parts.skins:
        if skin.inverseBindMatrices is None or not joints.keys() & skin.joints:
            continue
        document.expect_plain("the skin", skin)
        inverse = gltf_document.numbers(document, skin.inverseBindMatrices, "MAT4")
        if len(inverse) < len(skin.joints):
            raise document.error(f"found {len(inverse)} bind matrices of {len(skin.joints)} joints")
        for node, matrix in zip(skin.joints, inverse.reshape(-1, 4, 4), strict=False):
            with suppress(ValueError):
                transform = rest_joints.of_matrix(matrix, node, skew=1e-2)
                binds.setdefault(joints.get(node, -1), rest_joints.WORLD.below(transform))
    return binds


def read(
    path: Path, source: str, joint_names: Set[str]
) -> tuple[RestJoints, tuple[str, ...], tuple[str, ...]]:
    """Return the joints of the skin of a .glb or .gltf file, their nodes, and notes.

    source: name of the file in messages. named: joints of the skeleton that is meant. Raises
    MotionFileError for a file without a skin, and with several skeletons.
    """

    def beside(name: str) -> bytes:
        # A backslash or a drive leads out of the folder on Windows.
        inner = PureWindowsPath(name)
        if not inner.parts or inner.anchor or ".." in inner.parts:
            raise MotionFileError(source, f"refers to {name!r}, expected a path below its folder")
        try:
            return (path.parent / name).read_bytes()
        except OSError as fault:
            raise MotionFileError(source, f"no buffer {name!r}: {fault.strerror}") from fault

    document = gltf_document.load(path.read_bytes(), source, beside)
    if not document.parts.skins:
        raise document.error("found no skin, expected a character whose mesh is bound to joints")
    groups = skeletons(document)
    trees = [joint_tree(document, group) for group in groups]
    group = groups[rest_joints.one_skeleton(source, trees, joint_names)]
    joints = joints_of(document, group, [other for other in groups if other is not group])
    outer = outer_transform(document, joints.outer)
    arrays = *joints.tree[1:], *joints.rest
    rest = RestJoints(source, *arrays, outer, 1.0, "y")
    return rest, tuple(map(str, joints.nodes)), joints.notes
