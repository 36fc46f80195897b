"""Mannequin of a skeleton: a person where it is built like one, else tubes along its bones."""

import numpy as np

from posefield.common.units import Floats
from posefield.encode.body import (
    body_plan,
    limb_shape,
    skin_weights,
    skinned_mesh,
    trunk_shape,
    tube_body,
)
from posefield.encode.body.body_plan import PersonPlan
from posefield.encode.body.mesh_builder import MeshBuilder
from posefield.encode.body.skinned_mesh import Integers, SkinnedMesh
from posefield.motion.skeleton import Skeleton

TAIL = 0.03
"""Radius, m, at the start of bones that no person has."""


def mannequin(skeleton: Skeleton) -> SkinnedMesh:
    """Return the mannequin of a skeleton; equal skeletons have equal ones."""
    tree = body_plan.point_tree(skeleton)
    mesh, plan = MeshBuilder(), body_plan.person(tree)
    if plan is None:
        tube_body.build(mesh, tree)
    else:
        build_person(mesh, plan)
    return finish(mesh, len(skeleton))


def build_person(mesh: MeshBuilder, plan: PersonPlan) -> None:
    """Add a person, and tubes along bones that no person has."""
    trunk = trunk_shape.build(mesh, plan)
    for leg, left in zip(plan.legs, (True, False), strict=True):
        limb_shape.build_leg(mesh, plan, leg, trunk_shape.leg_loop(trunk, left))
    for arm, left in zip(plan.arms, (True, False), strict=True):
        limb_shape.build_arm(mesh, plan, arm, trunk_shape.arm_loop(trunk, left))
    for chain in plan.others:
        shares = chain.marks / chain.marks[-1]
        tube_body.add_tube(mesh, chain, plan.scale * TAIL * (1.0 - 0.7 * shares))


def finish(mesh: MeshBuilder, joints: int) -> SkinnedMesh:
    """Return the mesh that was built, with normals and weights of its points."""
    mesh.drop_unused()
    points: Floats = np.array(mesh.points)
    counts = np.array([len(face) for face in mesh.faces], np.int32)
    corners = np.array([point for face in mesh.faces for point in face], np.int32)
    cut = skinned_mesh.triangles(counts, corners)
    shares = np.array([place.share for place in mesh.places])
    chosen, weights = skin_weights.weights(mesh, joints)
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
