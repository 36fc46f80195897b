"""Tests of the hips of a mannequin: the seat stretches evenly where both thighs are lifted."""

import conftest
import numpy as np
import pytest

from posefield.encode.body import body_plan, mannequin, skinned_mesh
from posefield.encode.body.mesh_builder import MeshBuilder
from posefield.motion import quat
from posefield.motion.skeleton import forward_kinematics

LIFTED = np.radians(110.0)
"""As deep as the lowest pose of people who put something down on the floor."""


@pytest.fixture(scope="module")
def person():
    return conftest.person()


@pytest.fixture(scope="module")
def plan(person):
    return body_plan.person(body_plan.point_tree(person))


def along_chains_alone(person, plan):
    """The mannequin with weights that know no front and back."""
    mesh = MeshBuilder()
    mannequin.build_person(mesh, plan)
    mesh.drop_unused()
    return mannequin.finish(mesh, mannequin.along_chains(mesh, len(person)))


def crouching(person, plan, mesh):
    """The points of a person whose thighs are both lifted ahead."""
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(person), 1))
    for leg in plan.legs:
        turn = [np.cos(LIFTED / 2), -np.sin(LIFTED / 2), 0.0, 0.0]
        rotations[0, leg.chain.joints[leg.root]] = turn
    places, turns = forward_kinematics(person.parents, rotations, person.offsets[None])
    bind = person.at_rest(person.offsets)
    found = np.zeros(mesh.points.shape)
    for joints, weights in zip(mesh.joints.T, mesh.weights.T, strict=True):
        moved = quat.rotate(turns[0, joints], mesh.points - bind[joints])
        found += (weights / skinned_mesh.FULL_WEIGHT)[:, None] * (places[0, joints] + moved)
    return found


def crosses(points, cut):
    """Normals of triangles, as long as twice their areas."""
    a, b, c = (points[cut[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def stretch_of_seat(person, plan, mesh):
    """By how much the triangles behind the hips grow, and the sharpest fold, degrees."""
    cut = skinned_mesh.triangles(mesh.counts, mesh.corners)
    hip = plan.legs[0].point(plan.legs[0].root)
    off = mesh.points[cut].mean(axis=1) - hip
    seat = cut[(np.abs(off[:, 1]) < 0.2) & (off[:, 2] < -0.02) & (np.abs(off[:, 0] + 0.1) < 0.3)]
    rest, posed = (
        crosses(p.astype(float), seat) for p in (mesh.points, crouching(person, plan, mesh))
    )
    grown = np.linalg.norm(posed, axis=-1) / np.linalg.norm(rest, axis=-1)
    units = posed / np.linalg.norm(posed, axis=-1, keepdims=True)
    edges = {}
    for at, (a, b, c) in enumerate(seat.tolist()):
        for edge in ((a, b), (b, c), (c, a)):
            edges.setdefault(frozenset(edge), []).append(at)
    shared = np.array([pair for pair in edges.values() if len(pair) == 2])
    cosines = np.sum(units[shared[:, 0]] * units[shared[:, 1]], axis=-1)
    return grown.max(), np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).max()


def test_the_seat_of_a_crouching_person_stretches_evenly(person, plan):
    grown, fold = stretch_of_seat(person, plan, mannequin.mannequin(person))
    assert grown < 1.9
    assert fold < 70.0


def test_weights_along_the_bones_alone_would_tear_and_fold_it(person, plan):
    grown, fold = stretch_of_seat(person, plan, along_chains_alone(person, plan))
    assert grown > 2.3
    assert fold > 80.0


def test_both_thighs_move_as_much_of_the_skin(person, plan):
    mesh = mannequin.mannequin(person)
    moved = [
        int(mesh.weights[mesh.joints == leg.chain.joints[leg.root]].sum()) for leg in plan.legs
    ]
    assert moved[0] == pytest.approx(moved[1], rel=0.02)
    above = mesh.points[:, 1] > plan.legs[0].point(plan.legs[0].root)[1] + 0.15
    thighs = np.isin(mesh.joints, [leg.chain.joints[leg.root] for leg in plan.legs])
    by_thighs = np.where(thighs, mesh.weights, 0).sum(axis=1)
    assert by_thighs[above].max() < 0.1 * skinned_mesh.FULL_WEIGHT < by_thighs[~above].max()
