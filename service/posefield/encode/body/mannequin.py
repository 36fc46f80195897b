"""Mannequin of a skeleton: a person where it is built like one, else tubes along its bones."""

import numpy as np

from posefield.common.units import Floats
from posefield.encode.body import (
    body_plan,
    hip_weights,
    limb_shape,
    skinned_mesh,
    trunk_shape,
    tube_body,
)
from posefield.encode.body.body_plan import PersonPlan
from posefield.encode.body.bone_chain import BoneChain
from posefield.encode.body.mesh_builder import MeshBuilder
from posefield.encode.body.skinned_mesh import FULL_WEIGHT, Bytes, Integers, SkinnedMesh
from posefield.motion.skeleton import Skeleton

INFLUENCES = 4
ROUNDS, PULL = 5, 0.5
"""Rounds of smoothing of the skin weights, and share of the neighbours' mean in each round."""
TAIL = 0.03
"""Radius, m, at the start of bones that no person has."""


def mannequin(skeleton: Skeleton) -> SkinnedMesh:
    """Return the mannequin of a skeleton; equal skeletons have equal ones."""
    tree = body_plan.point_tree(skeleton)
    mesh, plan = MeshBuilder(), body_plan.person(tree)
    if plan is None:
        tube_body.build(mesh, tree)
        mesh.drop_unused()
        return finish(mesh, along_chains(mesh, len(skeleton)))
    trunk = build_person(mesh, plan)
    mesh.drop_unused()
    weights = along_chains(mesh, len(skeleton))
    hip_weights.set_weights(weights, mesh, plan, trunk)
    return finish(mesh, weights)


def build_person(mesh: MeshBuilder, plan: PersonPlan) -> BoneChain:
    """Add a person, and tubes along bones that no person has; return the chain of the trunk."""
    trunk = trunk_shape.build(mesh, plan)
    for leg, left in zip(plan.legs, (True, False), strict=True):
        limb_shape.build_leg(mesh, plan, leg, trunk_shape.leg_loop(trunk, left))
    for arm, left in zip(plan.arms, (True, False), strict=True):
        limb_shape.build_arm(mesh, plan, arm, trunk_shape.arm_loop(trunk, left))
    for chain in plan.others:
        shares = chain.marks / chain.marks[-1]
        tube_body.add_tube(mesh, chain, plan.scale * TAIL * (1.0 - 0.7 * shares))
    return trunk.chain


def finish(mesh: MeshBuilder, given: Floats) -> SkinnedMesh:
    """Return the mesh that was built, with normals; given (P, J): weights, not yet smooth."""
    points: Floats = np.array(mesh.points)
    counts = np.array([len(face) for face in mesh.faces], np.int32)
    corners = np.array([point for face in mesh.faces for point in face], np.int32)
    cut = skinned_mesh.triangles(counts, corners)
    shares = np.array([place.share for place in mesh.places])
    chosen, weights = _weights(mesh, given)
    return SkinnedMesh(
        points.astype(np.float32),
        skinned_mesh.vertex_normals(points, cut),
        *skinned_mesh.distinct_places(_anchors(mesh), shares),
        chosen,
        weights,
        counts,
        corners,
        np.zeros(len(points), np.int32),
    )


def _anchors(mesh: MeshBuilder) -> Integers:
    pairs = [
        chain.anchors[place.segment : place.segment + 2]
        for chain, place in zip(mesh.chains, mesh.places, strict=True)
    ]
    return np.array(pairs, np.int32)


def _weights(mesh: MeshBuilder, given: Floats) -> tuple[Integers, Bytes]:
    """Return the joints (P, 4) that move each point, heaviest first, and their weights.

    The weights of a point sum to FULL_WEIGHT. given (P, J): they are smoothed over the mesh, so
    that they are continuous where two chains of bones meet.
    """
    joints, smooth = given.shape[1], _smoothed(mesh, given)
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


def along_chains(mesh: MeshBuilder, joints: int) -> Floats:
    """Return the weights (P, J) that each point has along its chain of bones."""
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
