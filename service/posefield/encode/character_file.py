"""Character at rest as binary glTF 2.0: joints and the body of all files, without motion.

Two attributes beyond those of glTF let a reader fit the body to bones of other lengths, as the
files of clips do: each point moves by (1 - _SHARE) of the displacement of the first joint of
_ANCHORS, and _SHARE of the second's. The mesh `BodyCoarse` has fewer triangles on the same points,
for characters seen from afar; no node draws it.
"""

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from posefield.encode import glb
from posefield.encode.body.skinned_mesh import SkinnedMesh
from posefield.encode.character import character
from posefield.encode.character.character import CharacterRig
from posefield.encode.glb import CORNERS, VERTICES, GlbBuffer
from posefield.motion.skeleton import Skeleton


def character_glb(skeleton: Skeleton, identity: str) -> bytes:
    """Return the file of a skeleton's character; identity: of the model, stored in the file."""
    return _character_glb(character.rig(skeleton), identity)


@lru_cache(maxsize=64)
def _character_glb(rig: CharacterRig, identity: str) -> bytes:
    mesh, store = rig.body, GlbBuffer()
    assert mesh is not None
    resting = character.rest_pose(rig, rig.skeleton.offsets[None])
    parts = glb.character_parts(store, resting)
    (body,) = parts["meshes"]
    (primitive,) = body["primitives"]
    primitive["attributes"] |= _anchors(store, rig.skeleton, mesh)
    coarse = primitive | {"indices": _coarse_corners(store, mesh)}
    parts["meshes"].append({"name": "BodyCoarse", "primitives": [coarse]})
    return glb.container({"asset": glb.asset({"model": identity}), **parts}, store)


def _anchors(store: GlbBuffer, skeleton: Skeleton, mesh: SkinnedMesh) -> dict[str, int]:
    """Return the attributes by which points follow joints at rest; tips move with their joints."""
    moving = np.array([*range(len(skeleton)), *skeleton.tip_joints])
    anchors: npt.NDArray[Any] = moving[mesh.places.anchors][mesh.place].astype(np.uint16)
    shares = mesh.places.shares[mesh.place].astype(np.float32)
    return {
        "_ANCHORS": store.add(anchors, "VEC2", target=VERTICES),
        "_SHARE": store.add(shares, "SCALAR", target=VERTICES),
    }


def _coarse_corners(store: GlbBuffer, mesh: SkinnedMesh) -> int:
    kind = glb.smallest_index_type(len(mesh.points))
    corners = mesh.coarse.reshape(-1).astype(kind)
    return store.add(corners, "SCALAR", target=CORNERS)
