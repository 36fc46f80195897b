"""Curves of a glTF animation: keys of the transforms of nodes and of the weights of meshes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.rigs import gltf_document
from posefield.rigs.gltf_document import GltfDocument

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
            leaving, arriving = self.tangents_out[last], self.tangents_in[following]
            ends = (first, span[:, None] * leaving, second, span[:, None] * arriving)
            return _hermite(ends, share)
        if self.is_rotation:
            return quat.slerp(quat.normalize(first), quat.normalize(second), share)
        return first + share[:, None] * (second - first)


Tracks = Mapping[tuple[int, str], Track]
"""Curves by node and part."""


def _hermite(ends: Sequence[Floats], share: Floats) -> Annotated[Floats, "frames parts"]:
    """Return the cubic (F, k) through two values with two tangents, at shares (F,) of its way."""
    first, leaving, second, arriving = ends
    s = share[:, None]
    return np.asarray(
        (2 * s**3 - 3 * s**2 + 1) * first
        + (s**3 - 2 * s**2 + s) * leaving
        + (3 * s**2 - 2 * s**3) * second
        + (s**3 - s**2) * arriving
    )


def tracks(document: GltfDocument, animation: Any) -> Tracks:
    """Return the curves of an animation; MotionFileError for those that break the format."""
    found: dict[tuple[int, str], Track] = {}
    keys = 0
    for channel in animation.channels:
        node, part = channel.target.node, channel.target.path
        document.expect_plain("an animation", channel.target)
        if node is None or part not in KINDS:
            continue
        if (node, part) in found or not 0 <= node < len(document.parts.nodes):
            raise document.error(f"found the {part} of node {node} twice, expected one curve each")
        if not 0 <= channel.sampler < len(animation.samplers):
            raise document.error(f"names sampler {channel.sampler}, expected one of its own")
        sampler = animation.samplers[channel.sampler]
        document.expect_plain("an animation", animation, channel, sampler)
        found[node, part] = _track(document, sampler, part)
        keys += len(found[node, part].times)
        if keys > MAX_KEYS:
            raise document.error(f"found {keys} keys or more, expected at most {MAX_KEYS}")
    return found


def _track(document: GltfDocument, sampler: Any, part: str) -> Track:
    times = gltf_document.numbers(document, sampler.input, "SCALAR")[:, 0]
    values = gltf_document.numbers(document, sampler.output, KINDS[part])
    is_rotation = part == "rotation"
    if is_rotation:
        values = values[:, [3, 0, 1, 2]]
    kind = sampler.interpolation or "LINEAR"
    if kind not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise document.error(f"found interpolation {str(kind)[:20]!r}, expected one of glTF 2.0")
    parts = 3 if kind == "CUBICSPLINE" else 1
    count = parts * len(times)
    if part == "weights" and len(values) % count == 0:
        values = values.reshape(count, -1)
    if len(values) != count or np.any(np.diff(times) <= 0.0):
        raise document.error(
            f"found {len(times)} keys and {len(values)} values, expected {parts} values for each "
            "of increasing times"
        )
    if kind == "CUBICSPLINE":
        before, values, after = values.reshape(len(times), 3, -1).swapaxes(0, 1)
        return Track(times, values, kind, is_rotation, before, after)
    return Track(times, values, kind, is_rotation)
