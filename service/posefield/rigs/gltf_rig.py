"""glTF documents: JSON as typed objects of pygltflib, arrays in buffers, joints and the rig.

Joints are those of the skins, else the tree of animated nodes.
"""

import struct
import urllib.parse
import urllib.request
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
import numpy.typing as npt
import pygltflib

from posefield.common.errors import MotionFileError
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.rigs import rest_joints
from posefield.rigs.rest_joints import MAX_JOINTS, JointTree, RestJoints, Transform

IGNORED_EXTENSIONS = (
    *("KHR_mesh_quantization", "KHR_materials", "KHR_texture", "EXT_texture", "KHR_lights"),
    *("EXT_lights", "KHR_xmp", "KHR_node_", "MSFT_", "EXT_mesh_", "KHR_draco", "KHR_audio"),
    *("KHR_physics", "KHR_collision", "KHR_rigid", "KHR_implicit_shapes", "OMI_", "MOZ_", "VRM"),
)
"""Beginnings of required extensions that leave joints and animations as they are, or are read."""

MAX_DEPTH = 2000
"""Limit of nodes in one another, of which bones are at most half."""

ReadNeighbour = Callable[[str], bytes]
"""Function that returns the content of a file beside the document; MotionError if there is none."""


@dataclass(frozen=True)
class GltfDocument:
    """A document.

    source: the file's name. gltf: as pygltflib has it. read_neighbour: reads other files. unread:
    required extensions that may change the parts of the document that have them.
    """

    source: str
    gltf: Any
    read_neighbour: ReadNeighbour
    unread: frozenset[str]

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def expect_plain(self, name: str, *objects: Any) -> None:
        """Raise MotionFileError if a required extension may change parts that are needed."""
        for element in objects:
            for extension in sorted(self.unread & (element.extensions or {}).keys()):
                raise self.error(
                    f"{name} requires the extension {extension}, which may change the skeleton or "
                    "its animation: export without it"
                )

    @cached_property
    def above(self) -> dict[int, int]:
        """Return the parent of each node that has one; MotionFileError unless they are trees."""
        parents: dict[int, int] = {}
        count = len(self.gltf.nodes)
        for parent, node in enumerate(self.gltf.nodes):
            for child in node.children or ():
                if child in parents or not 0 <= child < count:
                    raise self.error(f"node {child} is no child of one node, expected a tree")
                parents[child] = parent
        ended: set[int] = set()
        for node in range(count):
            path, ancestor = {node}, node
            while ancestor in parents and ancestor not in ended:
                ancestor = parents[ancestor]
                if ancestor in path:
                    raise self.error(f"node {ancestor} is its own ancestor, expected a tree")
                path.add(ancestor)
            ended |= path
        return parents

    def ancestors(self, node: int) -> list[int]:
        """Return a node and its ancestors, the scene's root last."""
        path = [node]
        while path[-1] in self.above:
            path.append(self.above[path[-1]])
            if len(path) > MAX_DEPTH:
                raise self.error(f"node {node} lies below more than {MAX_DEPTH} others")
        return path

    def below(self, root: int) -> list[int]:
        """Return a node and its descendants, parents first, in the order of the file."""
        nodes, pending = [], [root]
        while pending:
            node = pending.pop()
            nodes.append(node)
            pending += reversed(self.gltf.nodes[node].children or [])
        return nodes

    def common_ancestor(self, nodes: Iterable[int]) -> int | None:
        """Return the last node that is each of the nodes or an ancestor of it, if there is one."""
        shared: list[int] | None = None
        for path in map(self.ancestors, nodes):
            ancestors = set(path)
            shared = path if shared is None else [node for node in shared if node in ancestors]
        return shared[0] if shared else None

    def node_name(self, node: int) -> str:
        """Return the name of a node for messages."""
        return str(self.gltf.nodes[node].name or node)

    def buffer(self, index: int) -> bytes:
        """Return the bytes of a buffer; MotionFileError if they are missing or too few."""
        buffer = self.gltf.buffers[index]
        if buffer.uri is None and index > 0:
            raise self.error(f"buffer {index} has no content, expected a URI: export uncompressed")
        content = self.gltf.binary_blob() if buffer.uri is None else self._resource(buffer.uri)
        content = content or b""
        if len(content) < buffer.byteLength:
            raise self.error(
                f"buffer {index} has {len(content)} bytes, expected {buffer.byteLength}: "
                "the file is not whole"
            )
        return content

    def _resource(self, uri: str) -> bytes:
        if not uri.startswith("data:"):
            return self.read_neighbour(urllib.parse.unquote(uri))
        with urllib.request.urlopen(uri) as response:
            content: bytes = response.read()
            return content


def load(content: bytes, source: str, read_neighbour: ReadNeighbour) -> GltfDocument:
    """Return the document of a .glb or .gltf file.

    Raises MotionFileError for a broken container, and for JSON that is no glTF 2.0.
    """
    form = pygltflib.GLTF2
    with warnings.catch_warnings():
        # It warns of what it fills in for fields that are null or missing.
        warnings.simplefilter("ignore")
        try:
            is_binary = content[:4] == b"glTF"
            read = form.load_from_bytes if is_binary else form.gltf_from_json
            document = read(content if is_binary else content.decode())
        except (ValueError, RecursionError, OSError, ArithmeticError, struct.error) as fault:
            raise MotionFileError(source, f"not glTF: {fault}") from fault
    version = str(document.asset.version)
    if version.partition(".")[0] != "2":
        raise MotionFileError(source, f"found version {version!r} of glTF, expected 2.0")
    required = map(str, document.extensionsRequired or ())
    unread = frozenset(name for name in required if not name.startswith(IGNORED_EXTENSIONS))
    return GltfDocument(source, document, read_neighbour, unread)


COMPONENTS: dict[int, npt.DTypeLike] = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
"""Types of numbers by their code, little endian."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MAX_NUMBERS = 20_000_000
"""Limit of an accessor's numbers: 11 hours of a joint's rotations at 120 frames a second."""


def numbers(document: GltfDocument, index: int, kind: str) -> Floats:
    """Return the values of an accessor as (count, width) doubles; normalized integers as shares.

    kind: its type, such as "VEC3". Raises MotionFileError for another type, for values outside
    their buffer, and for numbers that are not finite.
    """
    accessor = _item(document, document.gltf.accessors, index, "accessor")
    document.expect_plain(f"accessor {index}", accessor)
    if accessor.type != kind or accessor.componentType not in COMPONENTS:
        raise document.error(
            f"accessor {index} has type {str(accessor.type)[:9]} of {accessor.componentType}, "
            f"expected {kind}"
        )
    dtype, width = np.dtype(COMPONENTS[accessor.componentType]).newbyteorder("<"), WIDTHS[kind]
    if not 0 < accessor.count * width <= MAX_NUMBERS:
        raise document.error(
            f"accessor {index} has {accessor.count} values, expected 1 to {MAX_NUMBERS // width}"
        )
    shape = (accessor.count, width)
    if accessor.bufferView is None:
        raw = np.zeros(shape, dtype)
    else:
        raw = _view(document, accessor.bufferView, accessor.byteOffset or 0, dtype, shape)
    if accessor.sparse is not None:
        raw = _with_sparse(document, raw, accessor.sparse, index)
    values = _shares(raw) if accessor.normalized else raw.astype(np.float64)
    if not np.all(np.isfinite(values)):
        raise document.error(f"accessor {index} has numbers that are not finite")
    return values


def _item(document: GltfDocument, elements: Any, index: int, name: str) -> Any:
    """Return an item of a list; MotionFileError if the list is shorter."""
    if not isinstance(index, int) or not 0 <= index < len(elements):
        raise document.error(f"names {name} {index}, but has {len(elements)}")
    return elements[index]


def _view(
    document: GltfDocument, index: int, offset: int, dtype: np.dtype[Any], shape: tuple[int, int]
) -> npt.NDArray[Any]:
    """Return (count, width) numbers from a place in a buffer view."""
    view = _item(document, document.gltf.bufferViews, index, "buffer view")
    _item(document, document.gltf.buffers, view.buffer, "buffer")
    document.expect_plain(f"buffer view {index}", view, document.gltf.buffers[view.buffer])
    content = document.buffer(view.buffer)
    count, width = shape
    size = width * dtype.itemsize
    stride = view.byteStride or size
    start = (view.byteOffset or 0) + offset
    end = start + (count - 1) * stride + size
    last = min(len(content), (view.byteOffset or 0) + view.byteLength)
    if start < 0 or stride < size or end > last:
        raise document.error(
            f"buffer view {index} ends at byte {last}, expected {count} values up to byte {end}"
        )
    return np.ndarray(shape, dtype, content, start, (stride, dtype.itemsize))


def _with_sparse(
    document: GltfDocument, raw: npt.NDArray[Any], sparse: Any, index: int
) -> npt.NDArray[Any]:
    """Return values with those that a sparse accessor replaces."""
    if sparse.indices.componentType not in (5121, 5123, 5125):
        raise document.error(f"accessor {index} has indices of {sparse.indices.componentType}")
    kind = np.dtype(COMPONENTS[sparse.indices.componentType]).newbyteorder("<")
    indices = sparse.indices
    rows = _view(document, indices.bufferView, indices.byteOffset or 0, kind, (sparse.count, 1))[
        :, 0
    ]
    shape = (sparse.count, raw.shape[1])
    sparse_values = sparse.values
    values = _view(
        document, sparse_values.bufferView, sparse_values.byteOffset or 0, raw.dtype, shape
    )
    if rows.max() >= len(raw):
        raise document.error(f"accessor {index} replaces value {rows.max()} of {len(raw)}")
    replaced = raw.copy()
    replaced[rows] = values
    return replaced


def _shares(raw: npt.NDArray[Any]) -> Floats:
    """Return normalized integers as numbers from -1 or 0 to 1."""
    if raw.dtype.kind == "f":
        return raw.astype(np.float64)
    largest = float(np.iinfo(raw.dtype).max)
    return np.maximum(raw.astype(np.float64) / largest, -1.0)


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
    node = document.gltf.nodes[index]
    fields = (node.matrix, node.rotation, node.translation, node.scale)
    if not np.all(np.isfinite([number for numbers in fields for number in numbers or ()])):
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
    """Return nodes, parents first, as joints. alternatives: skeletons that are left out."""
    if len(order) > MAX_JOINTS:
        raise document.error(f"found {len(order)} joints, expected at most {MAX_JOINTS}")
    tree, notes = joint_tree(document, order), list[str]()
    if alternatives:
        names = ", ".join(document.node_name(other[0]) for other in alternatives)
        notes.append(f"skeleton {tree.label} was read: {names} left out")
    unnamed = len({*tree.names} - {document.gltf.nodes[node].name for node in order})
    if unnamed:
        notes.append(f"{unnamed} joints without a name of their own were named after their nodes")
    outer = tuple(document.ancestors(order[0])[:0:-1])
    for node in (*outer, *order):
        document.expect_plain(f"node {document.node_name(node)}", document.gltf.nodes[node])
    if document.unread:
        names = ", ".join(sorted(document.unread))
        notes.append(f"the required {names} was not read: no joint and no animation has it")
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
    if len(document.gltf.skins) > MAX_JOINTS:
        raise document.error(f"found {len(document.gltf.skins)} skins, expected {MAX_JOINTS}")
    for skin in document.gltf.skins:
        joints = set(skin.joints or ())
        if not 0 < len(joints) <= MAX_JOINTS or not joints <= set(range(len(document.gltf.nodes))):
            raise document.error(
                f"found a skin of {len(joints)} joints, expected 1 to {MAX_JOINTS} of its nodes"
            )
        tree = _between(document, joints)
        overlapping = [group for group in groups if group & tree]
        groups = [group for group in groups if not group & tree] + [tree.union(*overlapping)]
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
        name = document.gltf.nodes[node].name
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
    for skin in document.gltf.skins:
        if skin.inverseBindMatrices is None or not joints.keys() & skin.joints:
            continue
        document.expect_plain("the skin", skin)
        inverse = numbers(document, skin.inverseBindMatrices, "MAT4")
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

    source: name of the file in messages. joint_names: of the skeleton that is meant. Raises
    MotionFileError for a file without a skin, and with several skeletons.
    """

    def read_neighbour(name: str) -> bytes:
        # A backslash or a drive leads out of the folder on Windows.
        inner = PureWindowsPath(name)
        if not inner.parts or inner.anchor or ".." in inner.parts:
            raise MotionFileError(source, f"refers to {name!r}, expected a path below its folder")
        try:
            return (path.parent / name).read_bytes()
        except OSError as fault:
            raise MotionFileError(source, f"no buffer {name!r}: {fault.strerror}") from fault

    document = load(path.read_bytes(), source, read_neighbour)
    if not document.gltf.skins:
        raise document.error("found no skin, expected a character whose mesh is bound to joints")
    groups = skeletons(document)
    trees = [joint_tree(document, group) for group in groups]
    group = groups[rest_joints.one_skeleton(source, trees, joint_names)]
    joints = joints_of(document, group, [other for other in groups if other is not group])
    outer = outer_transform(document, joints.outer)
    arrays = *joints.tree[1:], *joints.rest
    rest = RestJoints(source, *arrays, outer, 1.0, "y")
    return rest, tuple(map(str, joints.nodes)), joints.notes
