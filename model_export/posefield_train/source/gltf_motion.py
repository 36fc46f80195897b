"""Motion of a glTF file: one of its animations, sampled at its keys or at a given rate."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from posefield.common.units import Floats, Positions, Rotations
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield.rigs import gltf_rig, rest_joints
from posefield.rigs.gltf_rig import GltfDocument, GltfJoints, ReadNeighbour
from posefield.rigs.rest_joints import SCALE_TOLERANCE, Transform
from posefield.roles import joint_recognition
from posefield_train.source import motion_file
from posefield_train.source.motion_file import MotionFile, ReadOptions, UnevenKeys

PARTS = {"rotation": "VEC4", "translation": "VEC3", "scale": "VEC3"}
"""Parts of a node's transform, in the order of Transform, with the types of their values."""
KINDS = {**PARTS, "weights": "SCALAR"}
MAX_KEYS = 20_000_000
"""Limit of all keys of an animation; an accessor without a buffer takes no bytes of the file."""
SAME_TIME = 1e-5
"""Largest difference of keys, s, that are of one frame: float32 holds 100 s to 8e-6."""


@dataclass(frozen=True)
class Track:
    """Curve of one part of a node's transform, or of the weights of its mesh.

    values (K, k), of rotations w x y z; tangents_in, tangents_out alike for cubic splines.
    """

    times: Floats
    values: Floats
    interpolation: str
    is_rotation: bool
    tangents_in: Floats | None = None
    tangents_out: Floats | None = None

    def at(self, times: Floats) -> Floats:
        """Return the values at times; before and after the keys those of the end keys."""
        keys = self.times
        when = np.clip(times, keys[0], keys[-1])
        last = np.maximum(np.searchsorted(keys, when + SAME_TIME, side="right") - 1, 0)
        following = np.minimum(last + 1, len(keys) - 1)
        span = keys[following] - keys[last]
        share = np.where(span > 0.0, (when - keys[last]) / np.where(span > 0.0, span, 1.0), 0.0)
        share = np.clip(share, 0.0, 1.0)
        first, second = self.values[last], self.values[following]
        if self.interpolation == "STEP":
            return first
        if self.tangents_in is not None and self.tangents_out is not None:
            leaving = span[:, None] * self.tangents_out[last]
            arriving = span[:, None] * self.tangents_in[following]
            s = share[:, None]
            # Hermite's cubic; those of SciPy have one tangent for both sides of a key.
            return np.asarray(
                (2 * s**3 - 3 * s**2 + 1) * first
                + (s**3 - 2 * s**2 + s) * leaving
                + (3 * s**2 - 2 * s**3) * second
                + (s**3 - s**2) * arriving
            )
        if self.is_rotation:
            return quat.slerp(quat.normalize(first), quat.normalize(second), share)
        return first + share[:, None] * (second - first)


Tracks = Mapping[tuple[int, str], Track]
"""Curves by node and part."""


def _read_tracks(document: GltfDocument, animation: Any) -> Tracks:
    tracks: dict[tuple[int, str], Track] = {}
    keys = 0
    for channel in animation.channels:
        node, path = channel.target.node, channel.target.path
        document.expect_plain("an animation", channel.target)
        if node is None or path not in KINDS:
            continue
        if (node, path) in tracks or not 0 <= node < len(document.gltf.nodes):
            raise document.error(f"found the {path} of node {node} twice, expected one curve each")
        if not 0 <= channel.sampler < len(animation.samplers):
            raise document.error(f"names sampler {channel.sampler}, expected one of its own")
        sampler = animation.samplers[channel.sampler]
        document.expect_plain("an animation", animation, channel, sampler)
        tracks[node, path] = _track(document, sampler, path)
        keys += len(tracks[node, path].times)
        if keys > MAX_KEYS:
            raise document.error(f"found {keys} keys or more, expected at most {MAX_KEYS}")
    return tracks


def _track(document: GltfDocument, sampler: Any, path: str) -> Track:
    times = gltf_rig.numbers(document, sampler.input, "SCALAR")[:, 0]
    values = gltf_rig.numbers(document, sampler.output, KINDS[path])
    is_rotation = path == "rotation"
    if is_rotation:
        values = values[:, [3, 0, 1, 2]]
    kind = sampler.interpolation or "LINEAR"
    if kind not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise document.error(f"found interpolation {str(kind)[:20]!r}, expected one of glTF 2.0")
    values_per_key = 3 if kind == "CUBICSPLINE" else 1
    count = values_per_key * len(times)
    if path == "weights" and len(values) % count == 0:
        values = values.reshape(count, -1)
    if len(values) != count or np.any(np.diff(times) <= 0.0):
        raise document.error(
            f"found {len(times)} keys and {len(values)} values, expected {values_per_key} values "
            "for each of increasing times"
        )
    if kind == "CUBICSPLINE":
        before, values, after = values.reshape(len(times), 3, -1).swapaxes(0, 1)
        return Track(times, values, kind, is_rotation, before, after)
    return Track(times, values, kind, is_rotation)


MAX_POSES = 10_000_000
"""Limit of frames times joints, as for BVH."""


def read(
    content: bytes, source: str, read_neighbour: ReadNeighbour, options: ReadOptions
) -> MotionFile:
    """Return the motion of a .glb or .gltf file, in metres with Y up, as the format says.

    Raises MotionFileError for a file that is none, that has no skeleton, no animation or several
    without one chosen, and for keys that are no frames.
    """
    # pygltflib checks no types, so that wrong ones are found where they are used.
    wrong = TypeError, AttributeError, LookupError, ValueError, ArithmeticError
    with rest_joints.naming_faults(source, *wrong):
        return _read(content, source, read_neighbour, options)


def _read(
    content: bytes, source: str, read_neighbour: ReadNeighbour, options: ReadOptions
) -> MotionFile:
    document = gltf_rig.load(content, source, read_neighbour)
    name, animation, notes = _chosen(document, options.animation)
    curves = _read_tracks(document, animation)
    joints = _joints(document, curves, options.skeleton)
    motion_file.expect_skeleton(source, joints.tree, options)
    moving = {*joints.nodes, *joints.outer}
    tracks = {key: curves[key] for key in curves if key[0] in moving and key[1] in PARTS}
    if not tracks:
        raise document.error(f"animation {name!r} moves no joint, expected one of the skeleton")
    try:
        keys = np.unique(np.concatenate([track.times for track in tracks.values()]))
        # Keys of one frame count once.
        keys = keys[np.concatenate([[True], np.diff(keys) > SAME_TIME])]
        times, rate, evidence = motion_file.sample_times(keys, options.rate)
    except UnevenKeys as fault:
        raise document.error(f"animation {name!r}: {fault}") from fault
    if len(times) * len(joints.nodes) > MAX_POSES:
        raise document.error(
            f"found {len(times)} frames of {len(joints.nodes)} joints, expected at most "
            f"{MAX_POSES} poses of a joint"
        )
    skeleton, rotations, translations, joint_notes = _plain(document, joints, tracks, times)
    weights = _weights(document, curves, times)
    return MotionFile(
        source,
        "glTF",
        skeleton,
        rotations,
        translations,
        rate,
        evidence,
        metres_per_unit=1.0,
        up="y",
        notes=(*notes, *joints.notes, *joint_notes, *motion_file.curve_notes(weights)),
        curves=weights,
    )


def _chosen(document: GltfDocument, requested: str | None) -> tuple[str, Any, list[str]]:
    """Return name and animation of the one that is wanted, or moves the skeleton; and notes."""
    animations = document.gltf.animations
    if not animations:
        raise document.error("found no animation, a skeleton or mesh without motion, expected one")
    names = [candidate.name or f"animation_{index}" for index, candidate in enumerate(animations)]
    if requested is not None:
        chosen = motion_file.choice(names, requested)
        if chosen is None:
            listed = ", ".join(map(repr, names[:20]))
            raise document.error(
                f"found the animations {listed}, expected one {requested!r}, or a number from 1"
            )
        return names[chosen], animations[chosen], []
    candidates = _of_skeletons(document) if len(animations) > 1 else [0]
    if len(candidates) > 1:
        listed = ", ".join(f"{index + 1} {names[index]!r}" for index in candidates[:20])
        raise document.error(
            f"found {len(candidates)} animations ({listed}), expected one: export each to a file "
            "of its own, or give name or number of one (--animation, the column clips.animation)"
        )
    name = names[candidates[0]]
    unused = [repr(other) for index, other in enumerate(names) if index != candidates[0]]
    note = f"animation {name!r} moves the skeleton: {', '.join(unused[:20])} left out"
    return name, animations[candidates[0]], [note] if unused else []


def _of_skeletons(document: GltfDocument) -> list[int]:
    """Return the animations that move joints of skins, without skins those of several nodes.

    Of these only those that change over time, and that move a person, where some do. All if there
    is none: Blender exports those of cameras and helpers alike.
    """
    joints = {node for skin in document.gltf.skins for node in skin.joints}
    animations = document.gltf.animations
    indices = []
    for index, animation in enumerate(animations):
        nodes = {channel.target.node for channel in animation.channels}
        indices += [index] if nodes & joints or (not joints and len(nodes) > 1) else []
    if len(indices) > 1:
        curves = {index: _read_tracks(document, animations[index]) for index in indices}
        indices = [index for index in indices if _changing(curves[index])] or indices
    if len(indices) > 1:
        trees = {index: _joints(document, curves[index], None).tree for index in indices}
        is_person = joint_recognition.is_person
        indices = [index for index in indices if is_person(*trees[index][1:])] or indices
    return indices or list(range(len(animations)))


def _joints(document: GltfDocument, curves: Tracks, requested: str | None) -> GltfJoints:
    """Return the joints that curves move, or those with a name that is wanted."""
    groups = gltf_rig.skeletons(document)
    animated = {node for node, path in curves if path in PARTS}
    candidates = next(
        (members for members in _moved(document, groups, curves, animated) if members), []
    )
    if not candidates:
        return _animated_tree(document, animated)
    trees = [gltf_rig.joint_tree(document, members) for members in candidates]
    members = candidates[rest_joints.one_skeleton(document.source, trees, {requested or ""})]
    return gltf_rig.joints_of(
        document, members, [other for other in groups if other is not members]
    )


def _moved(
    document: GltfDocument, groups: Sequence[list[int]], curves: Tracks, animated: set[int]
) -> Iterator[list[list[int]]]:
    """Yield the skeletons of skins that curves change, that have curves, or that move as a whole.

    animated: nodes with curves.
    """
    for nodes in (_changing(curves), animated):
        yield [members for members in groups if nodes.intersection(members)]
    yield [members for members in groups if animated <= {*document.ancestors(members[0])}]


def _animated_tree(document: GltfDocument, animated: set[int]) -> GltfJoints:
    """Return the animated nodes and all below their common ancestor that draw nothing."""
    root = document.common_ancestor(sorted(animated))
    if root is None:
        raise document.error("found no skin and no tree of animated nodes, expected a skeleton")
    members: list[int] = []
    for node in document.below(root):
        drawn, above = document.gltf.nodes[node], document.above.get(node)
        if (node == root or above in members) and drawn.mesh is None and drawn.camera is None:
            members.append(node)
    if len(members) < 2:
        raise document.error(
            f"found an animation of node {document.gltf.nodes[root].name!r} without a skeleton, "
            "expected a skin or a tree of nodes"
        )
    joints = gltf_rig.joints_of(document, members)
    note = "no skin: the tree of animated nodes was taken as the skeleton"
    return replace(joints, notes=(note, *joints.notes))


def _changing(curves: Tracks) -> set[int]:
    return {
        node
        for (node, path), track in curves.items()
        if path in PARTS and np.ptp(track.values, axis=0).max() > SCALE_TOLERANCE
    }


def _weights(document: GltfDocument, curves: Tracks, times: Floats) -> Mapping[str, Floats]:
    """Return the weights (F,) of morph targets by name; those of one name and values once."""
    weights: dict[str, Floats] = {}
    for (node, path), track in curves.items():
        mesh = document.gltf.nodes[node].mesh
        if path != "weights" or mesh is None:
            continue
        stated = (document.gltf.meshes[mesh].extras or {}).get("targetNames") or []
        for index, values in enumerate(track.at(times).T):
            name = str(stated[index]) if index < len(stated) else f"weight_{index}"
            if name in weights and not np.array_equal(weights[name], values):
                name = f"{document.node_name(node)}.{name}"
            weights[name] = values
    return weights


def _plain(
    document: GltfDocument, joints: GltfJoints, tracks: Tracks, times: Floats
) -> tuple[Skeleton, Rotations, Positions, tuple[str, ...]]:
    """Return the joints at the given times as rest_joints.plain_motion does."""
    nodes = [_sampled(document, node, tracks, times) for node in joints.nodes]
    motion = Transform(*(np.stack(components, axis=1) for components in zip(*nodes, strict=True)))
    for node in reversed(joints.outer):
        motion = motion.root_inside(_sampled(document, node, tracks, times))
    rest = joints.rest.root_inside(gltf_rig.outer_transform(document, joints.outer))
    return rest_joints.plain_motion(document.source, joints.tree, rest, motion)


def _sampled(document: GltfDocument, node: int, tracks: Tracks, times: Floats) -> Transform:
    still = gltf_rig.node_transform(document, node)
    turns, translations, scales = (
        tracks[node, path].at(times) if (node, path) in tracks else np.tile(rest, (len(times), 1))
        for path, rest in zip(PARTS, still, strict=True)
    )
    lengths = np.linalg.norm(turns, axis=-1, keepdims=True)
    if np.any(lengths < 0.5):
        raise document.error(f"node {node} has rotations of length {lengths.min():.3g}, expected 1")
    return Transform(turns / lengths, translations, scales).unmirrored()
