"""Motions of a user's character as binary glTF 2.0: an animation alone, of nodes by their names.

glTF cannot refer to the skin of another file. Engines and three.js bind the animation to the user's
own file by the names of its nodes, whose local transforms it holds.
"""

from typing import Any

import numpy as np

from posefield.common.units import Floats, Singles
from posefield.encode import glb
from posefield.encode.glb import GlbBuffer
from posefield.motion import quat
from posefield.question.results import SampledClip
from posefield.rigs.rest_joints import RestJoints

CONSTANT_TOLERANCE = 1e-9
"""Largest variation of a joint's translation, in units of the file, that is taken as constant."""
OUTER = "Armature"


def animation_glb(answer: SampledClip, rest: RestJoints) -> bytes:
    """Return the file: nodes of the joints in the rest pose of the file, and their animation.

    A node above them has the transform from the space of the root joint to the world, unless it
    is the identity.
    """
    store = GlbBuffer()
    document = {
        "asset": glb.asset(answer.trust.facts()),
        "scene": 0,
        **_nodes(rest),
        "animations": [_animation(store, answer, rest)],
    }
    return glb.container(document, store)


def _nodes(rest: RestJoints) -> dict[str, Any]:
    """Return the scene and its nodes; node j is joint j."""
    nodes: list[dict[str, Any]] = [
        {"name": name, "rotation": turn, "translation": place} | _scale(size)
        for name, turn, place, size in zip(
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
        nodes.append({"name": _free_name(rest.names), **outer, "children": [0]})
    return {"scenes": [{"nodes": [root]}], "nodes": nodes}


def _free_name(taken: tuple[str, ...]) -> str:
    found = OUTER
    while found in taken:
        found += "_"
    return found


def _outer_node(rest: RestJoints) -> dict[str, Any]:
    """Return the transform above the root joint; nothing for the identity."""
    outer = rest.outer
    found = _scale(outer.scale)
    if not np.isclose(abs(outer.rotation[0]), 1.0):
        found["rotation"] = outer.rotation[[1, 2, 3, 0]].tolist()
    if not np.allclose(outer.translation, 0.0):
        found["translation"] = outer.translation.tolist()
    return found


def _scale(size: Floats) -> dict[str, Any]:
    return {} if np.allclose(size, 1.0) else {"scale": size.tolist()}


def _animation(store: GlbBuffer, answer: SampledClip, rest: RestJoints) -> dict[str, Any]:
    """Return channels of all rotations, and of the translations that are not those of the rest."""
    clip = answer.clip
    rotations = quat.unroll(quat.normalize(rest.file_rotations(clip.rotations)))
    translations = rest.file_translations(clip.translations)
    when = store.add_bounded(_as_float32(np.arange(len(clip)) / clip.rate), "SCALAR")
    turns = _as_float32(np.moveaxis(rotations, 1, 0)[..., [1, 2, 3, 0]])
    spread = np.abs(translations - rest.translations).max(axis=(0, 2))
    moved = [0, *(np.flatnonzero(spread[1:] > CONSTANT_TOLERANCE) + 1).tolist()]
    paths = _as_float32(np.moveaxis(translations[:, moved], 1, 0))
    outputs = [
        *((joint, "rotation", store.add(own, "VEC4")) for joint, own in enumerate(turns)),
        *(
            (joint, "translation", store.add(own, "VEC3"))
            for joint, own in zip(moved, paths, strict=True)
        ),
    ]
    return {
        "name": "clip",
        "samplers": [{"input": when, "output": output} for _, _, output in outputs],
        "channels": [
            {"sampler": index, "target": {"node": joint, "path": path}}
            for index, (joint, path, _) in enumerate(outputs)
        ],
    }


def _as_float32(values: Floats) -> Singles:
    return np.ascontiguousarray(values, dtype=np.float32)
