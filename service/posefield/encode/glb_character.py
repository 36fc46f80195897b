"""Character in binary glTF 2.0: joint nodes, the body mesh skinned to them, and curves."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats
from posefield.encode import glb_buffer
from posefield.encode.body import skinned_mesh
from posefield.encode.body.skinned_mesh import SkinnedMesh
from posefield.encode.character.character import CharacterRig, RestPose
from posefield.encode.glb_buffer import CORNERS, VERTICES, GlbBuffer
from posefield.motion.curves import CurveValues
from posefield.motion.skeleton import Skeleton

Bytes = npt.NDArray[np.uint8]


def character_parts(store: GlbBuffer, resting: RestPose) -> dict[str, Any]:
    """Return scene, nodes, mesh, material and skin of one character in the rest pose.

    The node of joint j is node j, and the body's node is the last one.
    """
    offsets = resting.offsets[0]
    nodes = _joints(resting.rig.skeleton, offsets)
    drawn = [0]
    if resting.rig.body is not None:
        drawn.append(len(nodes))
        nodes.append({"name": "Body", "mesh": 0, "skin": 0})
    return {
        "scene": 0,
        "scenes": [{"nodes": drawn}],
        "nodes": nodes,
        **_body(store, resting),
    }


def _joints(skeleton: Skeleton, offsets: Floats) -> list[dict[str, Any]]:
    """Return the nodes of the joints in the rest pose."""
    nodes: list[dict[str, Any]] = [
        {"name": name, "translation": offset}
        for name, offset in zip(skeleton.names, offsets.tolist(), strict=True)
    ]
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        nodes[parent].setdefault("children", []).append(joint)
    return nodes


def _body(store: GlbBuffer, resting: RestPose) -> dict[str, Any]:
    """Return mesh, material and skin; nothing for a rig without a body."""
    mesh = resting.rig.body
    if mesh is None:
        return {}
    rest = resting.rig.skeleton.at_rest(resting.offsets[0])
    return {
        "meshes": [{"name": "Body", "primitives": [_primitive(store, resting, mesh)]}],
        "materials": [_material(_mesh_arrays(resting.rig).colors is None)],
        "skins": [_skin(store, rest)],
    }


def _material(plain: bool) -> dict[str, Any]:
    """Return the material; plain: whether it has a colour of its own, instead of the points'."""
    own = {"baseColorFactor": [*skinned_mesh.SKIN, 1.0]} if plain else {}
    surface = {**own, "metallicFactor": 0.0, "roughnessFactor": skinned_mesh.ROUGHNESS}
    return {"name": "Body", "pbrMetallicRoughness": surface}


def _primitive(store: GlbBuffer, resting: RestPose, mesh: SkinnedMesh) -> dict[str, Any]:
    fixed = _mesh_arrays(resting.rig)
    attributes = {
        "POSITION": store.add_bounded(resting.points[0], "VEC3", target=VERTICES),
        "NORMAL": store.add(mesh.normals, "VEC3", target=VERTICES),
        "JOINTS_0": store.add(fixed.joints, "VEC4", target=VERTICES),
        "WEIGHTS_0": _normalized_bytes(store, fixed.weights),
    }
    if fixed.colors is not None:
        attributes["COLOR_0"] = _normalized_bytes(store, fixed.colors)
    return {
        "attributes": attributes,
        "indices": store.add(fixed.corners, "SCALAR", target=CORNERS),
        "material": 0,
    }


@dataclass(frozen=True)
class MeshArrays:
    """Arrays of a body mesh that are equal for all bone offsets of a rig.

    joints, weights: of the points (P, 4). corners: of the triangles (3 T,). colors: of the points
    (P, 4); None if the material has the colour.
    """

    joints: npt.NDArray[Any]
    weights: Bytes
    corners: npt.NDArray[Any]
    colors: Bytes | None


@lru_cache(maxsize=64)
def _mesh_arrays(rig: CharacterRig) -> MeshArrays:
    mesh = rig.body
    assert mesh is not None
    missing = ((0, 0), (0, 4 - mesh.joints.shape[1]))
    joints = np.pad(mesh.joints, missing).astype(glb_buffer.smallest_index_type(len(rig.skeleton)))
    cut = skinned_mesh.triangles(mesh.counts, mesh.corners).reshape(-1)
    colors, shown = None, skinned_mesh.colours(mesh)
    if len(shown) > 1:
        colors = np.full((len(mesh.tints), 4), 255, np.uint8)
        colors[:, :3] = np.round(255 * shown[mesh.tints])
    return MeshArrays(
        joints,
        np.pad(mesh.weights, missing),
        cut.astype(glb_buffer.smallest_index_type(len(mesh.points))),
        colors,
    )


def _normalized_bytes(store: GlbBuffer, values: Bytes) -> int:
    view = store.view(values.tobytes(), target=VERTICES)
    return store.accessor(values, "VEC4", view, normalized=True)


def _skin(store: GlbBuffer, rest: Floats) -> dict[str, Any]:
    # Column-major matrices: the last column translates.
    inverse = np.tile(np.eye(4, dtype=np.float32), (len(rest), 1, 1))
    inverse[:, 3, :3] = -rest
    bound = store.add(inverse, "MAT4")
    return {"inverseBindMatrices": bound, "joints": list(range(len(rest))), "skeleton": 0}


def with_curves(parts: dict[str, Any], store: GlbBuffer, curves: CurveValues) -> dict[str, Any]:
    """Return the parts of a character with a morph target for each curve.

    The node of the mesh with the targets follows those of the joints.
    """
    if "meshes" in parts:
        return {**parts, "meshes": [_with_targets(store, parts["meshes"][0], curves)]}
    carrier = _carrier(store, curves)
    nodes = [*parts["nodes"], {"name": carrier["name"], "mesh": 0}]
    scene = {"nodes": [0, len(nodes) - 1]}
    return {**parts, "scenes": [scene], "nodes": nodes, "meshes": [carrier]}


def _carrier(store: GlbBuffer, curves: CurveValues) -> dict[str, Any]:
    """Return a mesh for the curves of a file without a body: one triangle without area."""
    points = store.add_bounded(np.zeros((3, 3), np.float32), "VEC3", target=VERTICES)
    mesh = {"name": "Curves", "primitives": [{"attributes": {"POSITION": points}}]}
    return _with_targets(store, mesh, curves)


def _with_targets(store: GlbBuffer, mesh: dict[str, Any], curves: CurveValues) -> dict[str, Any]:
    """Return a mesh with a morph target for each curve, named as its readers expect.

    The targets move no point: they carry the weights to readers, in which they can be modelled. All
    share one accessor, whose numbers are zeros because it has no buffer view.
    """
    (primitive,) = mesh["primitives"]
    still = store.zeros(store.accessors[primitive["attributes"]["POSITION"]]["count"])
    targets = [{"POSITION": still}] * len(curves.curves)
    return {
        **mesh,
        "primitives": [{**primitive, "targets": targets}],
        "weights": curves.values[0].tolist(),
        "extras": {"targetNames": curves.names},
    }
