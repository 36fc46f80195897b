"""Clips and characters as binary glTF 2.0: joint nodes, a body mesh skinned to them, animation.

glTF is always in metres, seconds and quaternions x y z w, with Y up. Joints keep their names, which
may be any text in glTF.

In the file of a character at rest, two attributes beyond those of glTF let a reader fit the body to
bones of other lengths, as the files of clips do: each point moves by (1 - _SHARE) of the
displacement of the first joint of _ANCHORS, and _SHARE of the second's. The mesh `BodyCoarse` has
fewer triangles on the same points, for characters seen from afar; no node draws it.
"""

import re
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import orjson

from posefield.common.units import Floats, Singles
from posefield.encode import character, skinned_mesh
from posefield.encode.character import CharacterRig, Convention, RestPose
from posefield.encode.skinned_mesh import SkinnedMesh
from posefield.motion import joint_roles, quat
from posefield.motion.clip import Clip
from posefield.motion.curves import CurveValues
from posefield.motion.skeleton import Skeleton
from posefield.question.results import SampledClip
from posefield.rigs.rest_joints import RestJoints

MAGIC, VERSION, TEXT, BINARY = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
VERTICES, CORNERS = 34962, 34963
"""Targets of buffer views, by their OpenGL constants."""
COMPONENTS = {"f4": 5126, "u1": 5121, "u2": 5123, "u4": 5125}


@dataclass(frozen=True)
class GlbBuffer:
    """Binary buffer under construction, with its views and accessors."""

    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    chunks: list[bytes] = field(default_factory=list)

    def view(self, content: bytes, **properties: Any) -> int:
        """Return the index of a new view of bytes, padded to a multiple of four.

        properties: further ones of the view.
        """
        last = self.views[-1] if self.views else {"byteOffset": 0, "byteLength": 0}
        start = last["byteOffset"] + _padded_length(last["byteLength"])
        length = len(content)
        self.views.append({"buffer": 0, "byteOffset": start, "byteLength": length, **properties})
        self.chunks.append(content.ljust(_padded_length(length), b"\0"))
        return len(self.views) - 1

    def accessor(self, array: npt.NDArray[Any], kind: str, view: int, **properties: Any) -> int:
        """Return the index of a new accessor with one element per row of the array.

        kind: glTF type such as "VEC3". properties: further ones of the accessor.
        """
        component = COMPONENTS[array.dtype.str[1:]]
        accessor = {
            "bufferView": view,
            "componentType": component,
            "count": len(array),
            "type": kind,
        }
        self.accessors.append(accessor | properties)
        return len(self.accessors) - 1

    def zeros(self, count: int) -> int:
        """Return the index of an accessor of vectors (count, 3) that are zero, without numbers."""
        bounds = {"min": [0.0, 0.0, 0.0], "max": [0.0, 0.0, 0.0]}
        component = COMPONENTS["f4"]
        self.accessors.append({"componentType": component, "count": count, "type": "VEC3"} | bounds)
        return len(self.accessors) - 1

    def add(self, array: npt.NDArray[Any], kind: str, **properties: Any) -> int:
        """Return the index of an accessor of a whole array; properties: of its view."""
        return self.accessor(array, kind, self.view(array.tobytes(), **properties))

    def add_bounded(self, array: npt.NDArray[Any], kind: str, **properties: Any) -> int:
        """Return the index of an accessor of a whole array, with minimum and maximum.

        glTF requires them for positions and times. properties: of its view.
        """
        flat = array.reshape(len(array), -1)
        bounds = {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        return self.accessor(array, kind, self.view(array.tobytes(), **properties), **bounds)


def smallest_index_type(count: int) -> type[np.unsignedinteger[Any]]:
    """Return the smallest unsigned type for `count` values; glTF reserves the largest one."""
    kinds = (np.uint8, np.uint16, np.uint32)
    return next(kind for kind in kinds if count <= np.iinfo(kind).max)


def asset(facts: dict[str, Any]) -> dict[str, Any]:
    """Return the asset of a document; facts: provenance, stored in `extras.posefield`."""
    return {"version": "2.0", "generator": "posefield", "extras": {"posefield": facts}}


def container(document: dict[str, Any], store: GlbBuffer) -> bytes:
    """Return the file of a document and its buffer."""
    binary = b"".join(store.chunks)
    content = {
        "bufferViews": store.views,
        "accessors": store.accessors,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = orjson.dumps(document | content)
    text = text.ljust(_padded_length(len(text)))
    total = 12 + 8 + len(text) + 8 + len(binary)
    return b"".join(
        (
            struct.pack("<3L", MAGIC, VERSION, total),
            struct.pack("<2L", len(text), TEXT),
            text,
            struct.pack("<2L", len(binary), BINARY),
            binary,
        )
    )


def _padded_length(length: int) -> int:
    return length + -length % 4


Bytes = npt.NDArray[np.uint8]


def character_parts(store: GlbBuffer, resting: RestPose) -> dict[str, Any]:
    """Return scene, nodes, mesh, material and skin of one character in the rest pose.

    The node of joint j is node j, and the body's node is the last one.
    """
    offsets = resting.offsets[0]
    nodes = _joints(resting.rig.skeleton, offsets)
    scene_nodes = [0]
    if resting.rig.body is not None:
        scene_nodes.append(len(nodes))
        nodes.append({"name": "Body", "mesh": 0, "skin": 0})
    return {
        "scene": 0,
        "scenes": [{"nodes": scene_nodes}],
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
    properties = {"baseColorFactor": [*skinned_mesh.SKIN, 1.0]} if plain else {}
    surface = {**properties, "metallicFactor": 0.0, "roughnessFactor": skinned_mesh.ROUGHNESS}
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
    joints = np.pad(mesh.joints, missing).astype(smallest_index_type(len(rig.skeleton)))
    cut = skinned_mesh.triangles(mesh.counts, mesh.corners).reshape(-1)
    colors, tints = None, skinned_mesh.colours(mesh)
    if len(tints) > 1:
        colors = np.full((len(mesh.tints), 4), 255, np.uint8)
        colors[:, :3] = np.round(255 * tints[mesh.tints])
    return MeshArrays(
        joints,
        np.pad(mesh.weights, missing),
        cut.astype(smallest_index_type(len(mesh.points))),
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


def with_curves(document: dict[str, Any], store: GlbBuffer, curves: CurveValues) -> dict[str, Any]:
    """Return the parts of a character with a morph target for each curve.

    The node of the mesh with the targets follows those of the joints.
    """
    if "meshes" in document:
        return {**document, "meshes": [_with_targets(store, document["meshes"][0], curves)]}
    # A mesh for the curves of a file without a body: one triangle without area.
    points = store.add_bounded(np.zeros((3, 3), np.float32), "VEC3", target=VERTICES)
    mesh = {"name": "Curves", "primitives": [{"attributes": {"POSITION": points}}]}
    carrier = _with_targets(store, mesh, curves)
    nodes = [*document["nodes"], {"name": carrier["name"], "mesh": 0}]
    scene = {"nodes": [0, len(nodes) - 1]}
    return {**document, "scenes": [scene], "nodes": nodes, "meshes": [carrier]}


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


CONSTANT_TOLERANCE = 1e-9
"""Largest variation of a joint's translation, in units of the file, that is taken as constant."""
MOST_NAME = 80
"""Most characters of an animation's name before its checksum."""


def glb(answer: SampledClip, convention: Convention) -> bytes:
    """Return the glTF file of one clip, with the provenance in `asset.extras.posefield`."""
    store = GlbBuffer()
    rig, clip = character.rig_and_clip(answer.clip, convention.body)
    resting = character.rest_pose(rig, clip.translations[:1])
    document = character_parts(store, resting)
    if clip.curves is not None:
        document = with_curves(document, store, clip.curves)
    return container(document | animation(store, answer, clip, resting.offsets[0]), store)


def animation(store: GlbBuffer, answer: SampledClip, clip: Clip, rest: Floats) -> dict[str, Any]:
    """Return the asset of a result, and the animation of a clip in the space of its nodes.

    It has channels of all rotations, of translations other than at rest (J, 3), and of curves.
    """
    times = store.add_bounded(_as_float32(np.arange(len(clip)) / clip.rate), "SCALAR")
    # Readers interpolate between neighbours, which must lie in one hemisphere.
    turns = _as_float32(np.moveaxis(quat.unroll(clip.rotations), 1, 0)[..., [1, 2, 3, 0]])
    travel = np.abs(clip.translations - rest).max(axis=(0, 2))
    moving = [0, *(np.flatnonzero(travel[1:] > CONSTANT_TOLERANCE) + 1).tolist()]
    paths = _as_float32(np.moveaxis(clip.translations[:, moving], 1, 0))
    outputs = [
        *((joint, "rotation", o) for joint, o in enumerate(_tracks(store, turns, "VEC4"))),
        *zip(moving, ["translation"] * len(moving), _tracks(store, paths, "VEC3"), strict=True),
    ]
    if clip.curves is not None:
        # The node of the mesh follows those of the joints.
        weights = store.add(_as_float32(clip.curves.values).reshape(-1), "SCALAR")
        outputs.append((len(clip.skeleton), "weights", weights))
    facts = answer.trust.facts()
    document = {
        "name": _animation_name(facts, store),
        "samplers": [{"input": times, "output": output} for _, _, output in outputs],
        "channels": [
            {"sampler": index, "target": {"node": joint, "path": path}}
            for index, (joint, path, _) in enumerate(outputs)
        ],
    }
    return {"asset": asset(facts), "animations": [document]}


def _animation_name(facts: Mapping[str, Any], store: GlbBuffer) -> str:
    """Return model and controls, and a checksum of all numbers: engines merge equal names."""
    models = [facts["model"]] if "model" in facts else facts["models"]
    words = [model.partition("@")[0] for model in models]
    words += [f"{name}{value:.4g}" for name, value in facts.get("controls", {}).items()]
    name = re.sub(r"[^\w.-]+", "_", "_".join(words))[:MOST_NAME]
    return f"{name}_{zlib.crc32(b''.join(store.chunks)):08x}"


def _tracks(store: GlbBuffer, tracks: Singles, kind: str) -> list[int]:
    """Return one accessor for the frames of each joint, (J, F, ...), all in one view."""
    view, size = store.view(tracks.tobytes()), tracks[0].nbytes
    return [
        store.accessor(track, kind, view, byteOffset=joint * size)
        for joint, track in enumerate(tracks)
    ]


def _as_float32(values: Floats | Singles) -> Singles:
    return np.ascontiguousarray(values, dtype=np.float32)


def character_glb(skeleton: Skeleton, identity: str) -> bytes:
    """Return the file of a skeleton's character; identity: of the model, stored in the file."""
    return _character_glb(character.rig(skeleton), identity)


@lru_cache(maxsize=64)
def _character_glb(rig: CharacterRig, identity: str) -> bytes:
    mesh, store = rig.body, GlbBuffer()
    assert mesh is not None
    resting = character.rest_pose(rig, rig.skeleton.offsets[None])
    document = character_parts(store, resting)
    (body,) = document["meshes"]
    (primitive,) = body["primitives"]
    primitive["attributes"] |= _anchors(store, rig.skeleton, mesh)
    corners = mesh.coarse.reshape(-1).astype(smallest_index_type(len(mesh.points)))
    coarse = primitive | {"indices": store.add(corners, "SCALAR", target=CORNERS)}
    document["meshes"].append({"name": "BodyCoarse", "primitives": [coarse]})
    return container({"asset": asset({"model": identity}), **document}, store)


def _anchors(store: GlbBuffer, skeleton: Skeleton, mesh: SkinnedMesh) -> dict[str, int]:
    """Return the attributes by which points follow joints at rest; tips move with their joints."""
    moving = np.array([*range(len(skeleton)), *skeleton.tip_joints])
    anchors: npt.NDArray[Any] = moving[mesh.bone_places.anchors][mesh.place_of_point].astype(
        np.uint16
    )
    shares = mesh.bone_places.shares[mesh.place_of_point].astype(np.float32)
    return {
        "_ANCHORS": store.add(anchors, "VEC2", target=VERTICES),
        "_SHARE": store.add(shares, "SCALAR", target=VERTICES),
    }


OUTER = "Armature"
"""Name of the node above the joints of a user's character."""


def rig_animation(answer: SampledClip, rest: RestJoints) -> bytes:
    """Return the glTF file of a motion of a user's character, without its skin.

    glTF cannot refer to the skin of another file. Engines and three.js bind an animation to the
    user's own file by the names of its nodes: those of the joints in its rest pose, whose local
    transforms it holds.

    A node above them has the transform from the space of the root joint to the world, unless it
    is the identity.
    """
    store = GlbBuffer()
    clip = replace(
        answer.clip,
        rotations=quat.normalize(rest.file_rotations(answer.clip.rotations)),
        translations=rest.file_translations(answer.clip.translations),
        curves=None,
    )
    motion = animation(store, answer, clip, rest.translations)
    return container({"scene": 0, **_rig_nodes(rest), **motion}, store)


def _rig_nodes(rest: RestJoints) -> dict[str, Any]:
    """Return the scene and its nodes; node j is joint j."""
    nodes: list[dict[str, Any]] = [
        {"name": name, "rotation": turn, "translation": translation} | _scale(size)
        for name, turn, translation, size in zip(
            rest.names,
            rest.rotations[:, [1, 2, 3, 0]].tolist(),
            rest.translations.tolist(),
            rest.scales,
            strict=True,
        )
    ]
    for joint, parent in enumerate(rest.parents[1:], start=1):
        nodes[parent].setdefault("children", []).append(joint)
    outer = _outer_node(rest)
    root = 0
    if outer:
        root = len(nodes)
        name = joint_roles.free_name(OUTER, set(rest.names))
        nodes.append({"name": name, **outer, "children": [0]})
    return {"scenes": [{"nodes": [root]}], "nodes": nodes}


def _outer_node(rest: RestJoints) -> dict[str, Any]:
    """Return the transform above the root joint; nothing for the identity."""
    outer = rest.outer
    node = _scale(outer.scale)
    if not np.isclose(abs(outer.rotation[0]), 1.0):
        node["rotation"] = outer.rotation[[1, 2, 3, 0]].tolist()
    if not np.allclose(outer.translation, 0.0):
        node["translation"] = outer.translation.tolist()
    return node


def _scale(size: Floats) -> dict[str, Any]:
    return {} if np.allclose(size, 1.0) else {"scale": size.tolist()}
