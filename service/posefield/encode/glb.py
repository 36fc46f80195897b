"""Clips as binary glTF 2.0: joint nodes, a body mesh skinned to them, and an animation.

glTF is always in metres, seconds and quaternions x y z w, with Y up. Joints keep their names, which
may be any text in glTF.
"""

from typing import Any

import numpy as np

from posefield.common.units import Floats, Singles
from posefield.encode import glb_buffer, glb_character
from posefield.encode.character import character
from posefield.encode.files import file_convention
from posefield.encode.files.file_convention import METRES, Convention
from posefield.encode.glb_buffer import GlbBuffer
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.question.results import SampledClip

CONSTANT_TOLERANCE = 1e-9
"""Largest variation, m, of a joint's translation that is taken as constant."""


def glb(answer: SampledClip, said: Convention) -> bytes:
    """Return the glTF file of one clip, with the provenance in `asset.extras.posefield`.

    Raises InvalidField for a convention other than metres with Y up.
    """
    file_convention.check_convention(said, METRES, "glb")
    clip, store = answer.clip, GlbBuffer()
    rig = character.rig(clip.skeleton, said.body)
    resting = character.rest_pose(rig, clip.translations[:1])
    parts = glb_character.character_parts(store, resting)
    if clip.curves is not None:
        parts = glb_character.with_curves(parts, store, clip.curves)
    document = {
        "asset": glb_buffer.asset(answer.trust.facts()),
        **parts,
        "animations": [_animation(store, clip)],
    }
    return glb_buffer.container(document, store)


def _animation(store: GlbBuffer, clip: Clip) -> dict[str, Any]:
    """Return channels of all rotations, of translations that are not constant, and of curves."""
    when = store.add_bounded(_as_float32(np.arange(len(clip)) / clip.rate), "SCALAR")
    # Readers interpolate between neighbours, which must lie in one hemisphere.
    turns = _as_float32(np.moveaxis(quat.unroll(clip.rotations), 1, 0)[..., [1, 2, 3, 0]])
    spread = np.ptp(clip.translations[:, 1:], axis=0).max(axis=-1, initial=0.0)
    moved = [0, *(np.flatnonzero(spread > CONSTANT_TOLERANCE) + 1).tolist()]
    paths = _as_float32(np.moveaxis(clip.translations[:, moved], 1, 0))
    outputs = [
        *((joint, "rotation", o) for joint, o in enumerate(_tracks(store, turns, "VEC4"))),
        *zip(moved, ["translation"] * len(moved), _tracks(store, paths, "VEC3"), strict=True),
    ]
    if clip.curves is not None:
        # The node of the mesh follows those of the joints.
        weights = store.add(_as_float32(clip.curves.values).reshape(-1), "SCALAR")
        outputs.append((len(clip.skeleton), "weights", weights))
    return {
        "name": "clip",
        "samplers": [{"input": when, "output": output} for _, _, output in outputs],
        "channels": [
            {"sampler": index, "target": {"node": joint, "path": path}}
            for index, (joint, path, _) in enumerate(outputs)
        ],
    }


def _tracks(store: GlbBuffer, tracks: Singles, kind: str) -> list[int]:
    """Return one accessor for the frames of each joint, (J, F, ...), all in one view."""
    view, size = store.view(tracks.tobytes()), tracks[0].nbytes
    return [
        store.accessor(own, kind, view, byteOffset=joint * size) for joint, own in enumerate(tracks)
    ]


def _as_float32(values: Floats | Singles) -> Singles:
    return np.ascontiguousarray(values, dtype=np.float32)
