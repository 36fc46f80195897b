"""Body of a skeleton that is not built like a person: round-ended tubes along its bones.

Each chain of bones is a closed tube; where it leaves another one it begins inside of it. Bones are
as thick as what they carry: by the length of all bones beyond them.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from posefield.common.units import Floats
from posefield.encode.body.body_plan import PointTree
from posefield.encode.body.bone_chain import BoneChain, ChainPlace
from posefield.encode.body.mesh_builder import MeshBuilder

SIDES = 8
CARRIED, THINNEST, THICKEST = 0.075, 0.008, 0.085
"""Radius as a share of the root of what a bone carries times the size; bounds beside the size."""
STOUT = 0.42
"""Largest radius as a share of the length of a chain of bones."""
SPACING = 0.5
"""Shares of a bone between whose ends rings lie."""
CAP = ((-0.85, 0.45), (-0.45, 0.85))
"""Rings of a round end: how far before it, and how wide, beside the radius."""


def build(mesh: MeshBuilder, tree: PointTree) -> None:
    """Add tubes along all bones of a tree."""
    size = body_size(tree.places)
    carried = _carried(tree)
    for path in _paths(tree, carried):
        chain = tree.chain(path)
        add_tube(mesh, chain, _radii(chain, path, tree, carried, size))


def body_size(places: Floats) -> float:
    """Return the largest extent of joints and tips (P, 3), m; one metre if they coincide."""
    size = float(np.ptp(places, axis=0).max())
    return size if size > 0 else 1.0


def add_tube(mesh: MeshBuilder, chain: BoneChain, radii: Floats) -> None:
    """Add a closed tube with round ends along a chain; radii (K,): at its points, m."""
    axes = _frames(chain.points)
    rings = [mesh.add_ring(*ring) for ring in _tube_rings(chain, radii, axes)]
    for lower, upper in pairwise(rings):
        mesh.join(lower, upper)
    along = np.diff(chain.points, axis=0)
    first, last = (arm / max(float(np.linalg.norm(arm)), 1e-12) for arm in (along[0], along[-1]))
    tip = mesh.add(chain.points[-1] + radii[-1] * last, chain, chain.at(np.inf))
    mesh.close(rings[-1], tip)
    start = mesh.add(chain.points[0] - radii[0] * first, chain, chain.at(0.0))
    mesh.close(rings[0][::-1], start)


def _paths(tree: PointTree, carried: Floats) -> Iterator[list[int]]:
    """Yield paths from the root or from a point of an earlier path, heaviest first."""
    children: dict[int, list[int]] = {}
    for point, parent in enumerate(tree.above):
        children.setdefault(parent, []).append(point)
    open_paths = [[0]]
    while open_paths:
        path = open_paths.pop(0)
        while found := sorted(children.get(path[-1], []), key=lambda p: (-carried[p], p)):
            open_paths += [[path[-1], other] for other in found[1:]]
            path.append(found[0])
        yield path


def _carried(tree: PointTree) -> Floats:
    """Return the length (J + E,) of each point's bone and of all beyond it, m."""
    above = np.array(tree.above)
    arms = tree.places - tree.places[np.maximum(above, 0)]
    found = np.linalg.norm(arms, axis=-1)
    order = [p for p in range(len(above)) if p >= tree.joints]
    for point in (*order, *range(tree.joints - 1, 0, -1)):
        found[above[point]] += found[point]
    return found


def _radii(
    chain: BoneChain, path: Sequence[int], tree: PointTree, carried: Floats, size: float
) -> Floats:
    """Return the radius (K,) of a tube at each point of its chain, m."""
    held = np.array([carried[anchor] for anchor in chain.anchors])
    if len(path) > 1 and tree.above[path[0]] >= 0:
        # A branch is as thick at its start as its first bone.
        held[0] = held[1]
    thick = CARRIED * np.sqrt(held * size)
    stout = STOUT * float(chain.marks[-1])
    return np.clip(np.minimum(thick, stout), THINNEST * size, THICKEST * size)


def _tube_rings(
    chain: BoneChain, radii: Floats, axes: Floats
) -> Iterator[tuple[Floats, BoneChain, ChainPlace]]:
    turn = 2.0 * np.pi * np.arange(SIDES) / SIDES
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    marks = chain.marks
    along = np.diff(chain.points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-12)
    for back, wide in CAP:
        middle = chain.points[0] + back * radii[0] * along[0]
        yield middle + wide * radii[0] * circle @ axes[0], chain, chain.at(0.0)
    for segment in range(len(along)):
        shares = (0.0, SPACING) if segment else (0.0, 0.5 * SPACING, SPACING)
        for share in shares:
            middle = chain.points[segment] + share * (
                chain.points[segment + 1] - chain.points[segment]
            )
            radius = (1 - share) * radii[segment] + share * radii[segment + 1]
            mark = marks[segment] + share * (marks[segment + 1] - marks[segment])
            yield middle + radius * circle @ axes[segment + (share > 0)], chain, chain.at(mark)
    yield chain.points[-1] + radii[-1] * circle @ axes[-1], chain, chain.at(np.inf)
    for back, wide in reversed(CAP):
        middle = chain.points[-1] - back * radii[-1] * along[-1]
        yield middle + wide * radii[-1] * circle @ axes[-1], chain, chain.at(np.inf)


def _frames(points: Floats) -> Floats:
    """Return two unit vectors (K, 2, 3) across a polyline at each of its points.

    Each is the one before, turned as little as may be, so that a tube does not twist.
    """
    arms = np.diff(points, axis=0)
    arms /= np.maximum(np.linalg.norm(arms, axis=-1, keepdims=True), 1e-12)
    ahead = np.concatenate([arms[:1], arms[:-1] + arms[1:], arms[-1:]])
    found, first = [], np.eye(3)[int(np.argmin(np.abs(arms[0])))]
    for way, arm in zip(ahead, np.concatenate([arms[:1], arms]), strict=True):
        length = np.linalg.norm(way)
        along = way / length if length > 1e-6 else arm
        across = first - (first @ along) * along
        if np.linalg.norm(across) < 1e-6:
            across = np.eye(3)[int(np.argmin(np.abs(along)))]
            across = across - (across @ along) * along
        first = across / np.linalg.norm(across)
        found.append(np.stack([first, np.cross(along, first)]))
    return np.array(found)
