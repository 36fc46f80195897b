"""Tests of bodies: a closed skin, its normals and weights, on people and on other skeletons."""

from dataclasses import replace

import conftest
import numpy as np
import pytest

from posefield.encode import skinned_mesh
from posefield.encode.mannequin import mannequin
from posefield.encode.skinned_mesh import bones_body
from posefield.inference import session
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton, forward_kinematics
from posefield.registry import model_registry

"""Bytes by which a body may enlarge a binary file."""
BENT = np.radians(110.0)
"""As deep as the thighs of people who put something down on the floor."""


def star(seed):
    """A random tree of joints, some of which coincide."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 20))
    parents = (-1, *(int(rng.integers(0, joint)) for joint in range(1, count)))
    offsets = rng.uniform(-0.4, 0.4, (count, 3)) * rng.integers(0, 2, (count, 1))
    return Skeleton(
        tuple(f"j{joint}" for joint in range(count)), parents, offsets, (), np.empty((0, 3))
    )


def shipped(name):
    return session.load(model_registry.SHIPPED_FOLDER / f"{name}.onnx").card.skeleton


def a_pose():
    """A person whose arms hang half-way down."""
    person = conftest.person()
    offsets, half = person.offsets.copy(), np.sqrt(0.5)
    offsets[[15, 16]] = offsets[[15, 16]] @ [[half, -half, 0], [half, half, 0], [0, 0, 1]]
    offsets[[18, 19]] = offsets[[18, 19]] @ [[half, half, 0], [-half, half, 0], [0, 0, 1]]
    return replace(person, offsets=offsets)


PEOPLE = {
    "person": conftest.person,
    "arms down": a_pose,
    "cmu_walk": lambda: shipped("cmu_walk"),
    "hdm05_grab_high": lambda: shipped("hdm05_grab_high"),
}


@pytest.fixture(params=PEOPLE)
def body(request):
    found = PEOPLE[request.param]()
    return found, mannequin(found)


@pytest.fixture
def person():
    return conftest.person()


def triangles(mesh):
    return skinned_mesh.triangles(mesh.counts, mesh.corners)


def edges(mesh):
    cut = triangles(mesh)
    return np.concatenate([cut[:, [0, 1]], cut[:, [1, 2]], cut[:, [2, 0]]])


def closed(mesh):
    """Return whether each edge belongs to two faces, in opposite directions."""
    there = {tuple(edge) for edge in edges(mesh).tolist()}
    return len(there) == len(edges(mesh)) and there == {(b, a) for a, b in there}


def volume(mesh):
    a, b, c = (mesh.points[triangles(mesh)[:, corner]].astype(float) for corner in range(3))
    return float(np.sum(a * np.cross(b, c))) / 6.0


def test_a_skin_is_closed_and_as_large_as_a_person(body):
    _, mesh = body
    assert closed(mesh)
    assert 0.03 < volume(mesh) < 0.12
    assert set(mesh.corners.tolist()) == set(range(len(mesh.points)))


def test_a_missing_face_would_be_seen(person):
    mesh = mannequin(person)
    torn = replace(mesh, counts=mesh.counts[:-1], corners=mesh.corners[: -mesh.counts[-1]])
    assert not closed(torn)


@pytest.mark.parametrize("seed", range(4))
def test_a_tree_without_roles_has_boxes_along_its_bones(seed):
    tree = star(seed)
    assert mannequin(tree) is None
    mesh = bones_body(tree)
    assert closed(mesh) and volume(mesh) > 0
    assert np.array_equal(mesh.coarse, triangles(mesh))
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=-1), 1.0, atol=1e-6)
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)


def test_normals_are_units_and_lie_on_the_outer_side_of_their_faces(body):
    _, mesh = body
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=-1), 1.0, atol=1e-6)
    cut = triangles(mesh)
    a, b, c = (mesh.points[cut[:, corner]].astype(float) for corner in range(3))
    along = np.sum(np.cross(b - a, c - a)[:, None] * mesh.normals[cut], axis=-1)
    assert np.mean(along >= 0) > 0.97


def test_weights_sum_to_one_and_name_joints(body):
    found, mesh = body
    assert np.all(mesh.weights.sum(axis=1, dtype=int) == skinned_mesh.FULL_WEIGHT)
    assert mesh.joints.min() >= 0 and mesh.joints.max() < len(found)
    assert np.all(mesh.joints[mesh.weights == 0] == 0)


def dense(found, mesh):
    every = np.zeros((len(mesh.points), len(found)))
    np.add.at(every, (np.arange(len(every))[:, None], mesh.joints), mesh.weights / 255.0)
    return every


def posed(found, mesh, turns):
    """The points with some joints turned by rotation vectors, rad."""
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(found), 1))
    for joint, turn in turns.items():
        rotations[0, joint] = quat.exp(np.array(turn))
    places, turned = forward_kinematics(found.parents, rotations, found.offsets[None])
    bind, points = found.at_rest(found.offsets), np.zeros(mesh.points.shape)
    for joints, weights in zip(mesh.joints.T, mesh.weights.T, strict=True):
        moved = quat.rotate(turned[0, joints], mesh.points - bind[joints])
        points += (weights / skinned_mesh.FULL_WEIGHT)[:, None] * (places[0, joints] + moved)
    return points


def test_knees_and_elbows_bend_and_the_rest_stays(person):
    mesh = mannequin(person)
    bent = posed(person, mesh, {8: (BENT, 0.0, 0.0), 15: (0.0, -BENT, 0.0)})
    every, moved = dense(person, mesh), np.linalg.norm(bent - mesh.points, axis=-1)
    assert moved[every[:, 9] > 0.9].min() > 0.3 and moved[every[:, 16] > 0.9].min() > 0.2
    assert moved[every[:, [8, 9, 15, 16]].sum(axis=1) == 0.0].max() < 1e-6
    assert volume(replace(mesh, points=bent)) > 0.85 * volume(mesh)


@pytest.mark.parametrize("missing", ["roles", "form"])
def test_a_rig_without_the_roles_or_the_form_of_a_person_has_no_mannequin(missing, person):
    if missing == "roles":
        other = replace(person, names=tuple(f"x{at}" for at in range(len(person))))
    else:
        other = replace(person, offsets=person.offsets[:, [0, 2, 1]])
    assert mannequin(person) is not None and mannequin(other) is None
