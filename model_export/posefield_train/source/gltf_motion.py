"""Motion of a glTF file: one of its animations, sampled at its keys or at a given rate."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.rigs import gltf_document, gltf_rig, rest_joints
from posefield.rigs.gltf_document import Beside, GltfDocument
from posefield.rigs.gltf_rig import GltfJoints
from posefield.rigs.rest_joints import PosedJoints
from posefield_train.source import motion_file
from posefield_train.source.motion_file import MotionFile, ReadOptions, UnevenKeys

MAX_POSES = 10_000_000
"""Limit of frames times joints, as for BVH."""
MAX_KEYS = 2 * MAX_POSES
"""Limit of all keys of an animation; an accessor without a buffer takes no bytes of the file."""
KINDS = {"rotation": "VEC4", "translation": "VEC3", "scale": "VEC3"}
SAME_TIME = 1e-5
"""Largest difference of keys, s, that are of one frame: float32 holds 100 s to 8e-6."""


@dataclass(frozen=True)
class Track:
    """Curve of one part of a node's transform.

    values (K, k), of rotations w x y z; tangents_in, tangents_out alike for cubic splines.
    """

    times: Floats
    values: Floats
    interpolation: str
    tangents_in: Floats | None = None
    tangents_out: Floats | None = None


Tracks = dict[tuple[int, str], Track]
"""Curves by node and part."""


def read(content: bytes, source: str, beside: Beside, options: ReadOptions) -> MotionFile:
    """Return the motion of a .glb or .gltf file, in metres with Y up, as the format says.

    Raises MotionFileError for a file that is none, that has no skeleton, no animation or several
    without a name chosen, and for keys that are no frames.
    """
    # pygltflib checks no types, so that wrong ones are found where they are used.
    with rest_joints.naming_faults(source, TypeError, AttributeError, LookupError, ValueError):
        return _read(content, source, beside, options)


def _read(content: bytes, source: str, beside: Beside, options: ReadOptions) -> MotionFile:
    document = gltf_document.load(content, source, beside)
    name, animation = _chosen(document, options.animation)
    tracks = _tracks(document, animation)
    joints = gltf_rig.joints_of(document, {node for node, _ in tracks})
    moving = {*joints.nodes, *joints.outer}
    tracks = {key: track for key, track in tracks.items() if key[0] in moving}
    if not tracks:
        raise document.error(f"animation {name!r} moves no joint, expected one of the skeleton")
    try:
        keys = np.unique(np.concatenate([track.times for track in tracks.values()]))
        # Keys of one frame count once.
        keys = keys[np.concatenate([[True], np.diff(keys) > SAME_TIME])]
        found = motion_file.sample_times(keys, options.rate)
    except UnevenKeys as fault:
        raise document.error(f"animation {name!r}: {fault}") from fault
    if len(found.times) * len(joints.nodes) > MAX_POSES:
        raise document.error(
            f"found {len(found.times)} frames of {len(joints.nodes)} joints, expected at most "
            f"{MAX_POSES} poses of a joint"
        )
    plain = rest_joints.plain_motion(_posed(document, joints, tracks, found.times))
    return MotionFile(
        source,
        "glTF",
        plain.skeleton,
        plain.rotations,
        plain.translations,
        found.rate,
        found.evidence,
        metres_per_unit=1.0,
        up="y",
        notes=joints.notes,
    )


def _chosen(document: GltfDocument, wanted: str | None) -> tuple[str, Any]:
    """Return the one animation, or that of a name."""
    animations = _of_skeletons(document)
    names = [own.name or f"animation_{index}" for index, own in enumerate(animations)]
    if not document.parts.animations:
        raise document.error("found no animation, a skeleton or mesh without motion, expected one")
    listed = ", ".join(map(repr, names[:20]))
    if wanted is None and len(animations) > 1:
        raise document.error(
            f"found {len(animations)} animations ({listed}), expected one: export each to a "
            "file of its own, or name one in the column clips.animation"
        )
    if wanted is not None and names.count(wanted) != 1:
        raise document.error(f"found the animations {listed}, expected one {wanted!r}")
    index = 0 if wanted is None else names.index(wanted)
    return names[index], animations[index]


def _of_skeletons(document: GltfDocument) -> list[Any]:
    """Return the animations that move joints of skins, without skins those of several nodes.

    All animations if there is none: Blender exports those of cameras and helpers alike.
    """
    joints = {node for skin in document.parts.skins for node in skin.joints}
    found = []
    for own in document.parts.animations:
        moved = {channel.target.node for channel in own.channels}
        found += [own] if moved & joints or (not joints and len(moved) > 1) else []
    return found or document.parts.animations


def _tracks(document: GltfDocument, animation: Any) -> Tracks:
    """Return the curves of rotations, translations and scales of an animation."""
    found: Tracks = {}
    keys = 0
    for channel in animation.channels:
        node, part = channel.target.node, channel.target.path
        if node is None or part not in KINDS:
            continue
        if (node, part) in found or not 0 <= node < len(document.parts.nodes):
            raise document.error(f"found the {part} of node {node} twice, expected one curve each")
        if not 0 <= channel.sampler < len(animation.samplers):
            raise document.error(f"names sampler {channel.sampler}, expected one of its own")
        found[node, part] = _track(document, animation.samplers[channel.sampler], part)
        keys += len(found[node, part].times)
        if keys > MAX_KEYS:
            raise document.error(f"found {keys} keys or more, expected at most {MAX_KEYS}")
    return found


def _track(document: GltfDocument, sampler: Any, part: str) -> Track:
    times = gltf_document.numbers(document, sampler.input, "SCALAR")[:, 0]
    values = gltf_document.numbers(document, sampler.output, KINDS[part])
    if part == "rotation":
        values = values[:, [3, 0, 1, 2]]
    kind = sampler.interpolation or "LINEAR"
    if kind not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise document.error(f"found interpolation {kind!r}, expected one of glTF 2.0")
    parts = 3 if kind == "CUBICSPLINE" else 1
    if len(values) != parts * len(times) or np.any(np.diff(times) <= 0.0):
        raise document.error(
            f"found {len(times)} keys and {len(values)} values, expected {parts} values for each "
            "of increasing times"
        )
    if kind == "CUBICSPLINE":
        before, values, after = values.reshape(len(times), 3, -1).swapaxes(0, 1)
        return Track(times, values, kind, before, after)
    return Track(times, values, kind)


def _posed(
    document: GltfDocument, joints: GltfJoints, tracks: Tracks, times: Floats
) -> PosedJoints:
    """Return the joints with their transforms at the given times; the root's in the world."""
    nodes = [_sampled(document, node, tracks, times) for node in joints.nodes]
    turns, places, scales = (np.stack(own, axis=1) for own in zip(*nodes, strict=True))
    for node in reversed(joints.outer):
        turn, place, scale = _sampled(document, node, tracks, times)
        places[:, 0] = place + quat.rotate(turn, scale * places[:, 0])
        turns[:, 0] = quat.mul(turn, turns[:, 0])
        scales[:, 0] *= scale
    return PosedJoints(
        document.source,
        joints.names,
        joints.parents,
        joints.rest_rotations,
        gltf_rig.rest_places(document, joints),
        turns,
        places,
        scales,
    )


def _sampled(
    document: GltfDocument, node: int, tracks: Tracks, times: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return rotation (F, 4), translation (F, 3) and scale (F, 3) of a node."""
    still = gltf_rig.node_transform(document, node)
    found = []
    for part, rest in zip(KINDS, (still.rotation, still.translation, still.scale), strict=True):
        track = tracks.get((node, part))
        found.append(np.tile(rest, (len(times), 1)) if track is None else _values(track, times))
    turns, places, scales = found
    lengths = np.linalg.norm(turns, axis=-1, keepdims=True)
    if np.any(lengths < 0.5):
        raise document.error(f"node {node} has rotations of length {lengths.min():.3g}, expected 1")
    return turns / lengths, places, scales


def _values(track: Track, times: Floats) -> Floats:
    """Return the values of a curve at times; before and after its keys those of the end keys."""
    keys = track.times
    when = np.clip(times, keys[0], keys[-1])
    last = np.maximum(np.searchsorted(keys, when + SAME_TIME, side="right") - 1, 0)
    following = np.minimum(last + 1, len(keys) - 1)
    span = keys[following] - keys[last]
    share = np.where(span > 0.0, (when - keys[last]) / np.where(span > 0.0, span, 1.0), 0.0)
    share = np.clip(share, 0.0, 1.0)
    first, second = track.values[last], track.values[following]
    if track.interpolation == "STEP":
        return first
    if track.tangents_in is not None and track.tangents_out is not None:
        leaving, arriving = track.tangents_out[last], track.tangents_in[following]
        return _hermite((first, span[:, None] * leaving, second, span[:, None] * arriving), share)
    if track.values.shape[1] == 4:
        return quat.slerp(quat.normalize(first), quat.normalize(second), share)
    return first + share[:, None] * (second - first)


def _hermite(ends: Sequence[Floats], share: Floats) -> Floats:
    """Return the cubic (F, k) through two values with two tangents, at shares (F,) of its way."""
    first, leaving, second, arriving = ends
    s = share[:, None]
    return np.asarray(
        (2 * s**3 - 3 * s**2 + 1) * first
        + (s**3 - 2 * s**2 + s) * leaving
        + (3 * s**2 - 2 * s**3) * second
        + (s**3 - s**2) * arriving
    )
