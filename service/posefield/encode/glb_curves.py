"""Curves in binary glTF 2.0: morph targets of the body, or of a mesh of their own without one."""

from typing import Any

import numpy as np

from posefield.encode.glb_buffer import VERTICES, GlbBuffer
from posefield.motion.curves import CurveValues


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
    """Return a mesh of one triangle without area, which carries curves where there is no body."""
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
