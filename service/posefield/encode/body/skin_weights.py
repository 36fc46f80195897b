"""Weights of the joints that move each point of a body."""

import numpy as np

from posefield.common.units import Floats
from posefield.encode.body.mesh_builder import MeshBuilder
from posefield.encode.body.skinned_mesh import FULL_WEIGHT, Bytes, Integers

INFLUENCES = 4
ROUNDS, PULL = 5, 0.5
"""How often each point's weights move to the mean of its neighbours', and by what share."""


def weights(mesh: MeshBuilder, joints: int) -> tuple[Integers, Bytes]:
    """Return the joints (P, 4) that move each point, heaviest first, and their weights.

    The weights of a point sum to FULL_WEIGHT; those along chains of bones are smoothed over the
    mesh, so that they are continuous where two chains meet.
    """
    smooth = _smoothed(mesh, _along_chains(mesh, joints))
    chosen = np.argsort(-smooth, axis=1, kind="stable")[:, :INFLUENCES].astype(np.int32)
    if joints < INFLUENCES:
        chosen = np.pad(chosen, ((0, 0), (0, INFLUENCES - joints)))
    heavy = np.take_along_axis(smooth, chosen, axis=1)
    heavy[:, joints:] = 0.0
    heavy /= heavy.sum(axis=1, keepdims=True)
    whole = np.floor(FULL_WEIGHT * heavy + 1e-9).astype(np.int64)
    whole[:, 0] += FULL_WEIGHT - whole.sum(axis=1)
    chosen[whole == 0] = 0
    return chosen, whole.astype(np.uint8)


def _along_chains(mesh: MeshBuilder, joints: int) -> Floats:
    found = np.zeros((len(mesh.points), joints))
    for point, (chain, place) in enumerate(zip(mesh.chains, mesh.places, strict=True)):
        for joint, share in chain.weights(place).items():
            found[point, joint] += share
    return found


def _smoothed(mesh: MeshBuilder, given: Floats) -> Floats:
    edges = {
        (min(a, b), max(a, b))
        for face in mesh.faces
        for a, b in zip(face, (*face[1:], face[0]), strict=True)
    }
    ends = np.array(sorted(edges))
    degree = np.bincount(ends.reshape(-1), minlength=len(given)).astype(float)[:, None]
    found = given
    for _ in range(ROUNDS):
        summed = np.zeros_like(found)
        np.add.at(summed, ends[:, 0], found[ends[:, 1]])
        np.add.at(summed, ends[:, 1], found[ends[:, 0]])
        found = (1.0 - PULL) * found + PULL * summed / np.maximum(degree, 1.0)
    return found
