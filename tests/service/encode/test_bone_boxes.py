from dataclasses import dataclass

import numpy as np
import pytest

from posefield.encode.body import bone_boxes
from posefield.motion.skeleton import Skeleton


def made(skeleton):
    bones = bone_boxes.bones(skeleton)
    boxes = bone_boxes.bone_boxes(skeleton, bones, skeleton.offsets)
    points, normals = bone_boxes.points_and_normals(boxes)
    counts, corners = bone_boxes.faces(bones)
    joints = bones.joints.tolist()
    return Drawn(joints, bones.tints.tolist(), boxes, points, normals, counts, corners)


@dataclass
class Drawn:
    joints: list
    tints: list
    boxes: bone_boxes.BoneBoxes
    points: np.ndarray
    normals: np.ndarray
    face_counts: np.ndarray
    face_points: np.ndarray


def chain(*offsets, tips=()):
    count = len(offsets)
    joints = tuple(joint for joint, _ in tips)
    arms = np.array([arm for _, arm in tips], float).reshape(-1, 3)
    names = tuple(f"j{i}" for i in range(count))
    return Skeleton(names, tuple(range(-1, count - 1)), np.array(offsets, float), joints, arms)


@pytest.fixture
def person(walk):
    return walk.clip.skeleton


def faces(mesh):
    return np.split(mesh.face_points, np.cumsum(mesh.face_counts)[:-1])


def test_no_two_points_coincide(person):
    mesh = made(person)
    points = mesh.points.astype(np.float32)
    assert len(np.unique(points, axis=0)) == len(points)


def test_every_box_is_closed(person):
    mesh = made(person)
    edges = {(a, b) for face in faces(mesh) for a, b in zip(face, np.roll(face, -1), strict=True)}
    assert len(edges) == len(mesh.face_points)
    assert edges == {(b, a) for a, b in edges}


def test_faces_and_normals_look_outwards(person):
    mesh = made(person)
    centres = np.repeat(mesh.boxes.starts + mesh.boxes.arms / 2, bone_boxes.POINTS_PER_BOX, axis=0)
    assert np.all(np.sum(mesh.normals * (mesh.points - centres), axis=-1) > 0)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=-1), 1.0)
    for face in faces(mesh):
        a, b, c = mesh.points[face[:3]]
        assert np.cross(b - a, c - a) @ (a - centres[face[0]]) > 1e-12


def test_a_bone_without_length_gets_no_box():
    mesh = made(chain((0, 1, 0), (0, 0, 0), (0, 0.5, 0), tips=[(2, (0, 0.3, 0))]))
    assert mesh.joints == [1, 2]


def test_a_joint_where_nothing_follows_gets_a_stub():
    mesh = made(chain((0, 1, 0), (0, 0.5, 0), tips=[(1, (0, 0, 0))]))
    assert mesh.joints == [0, 1]
    np.testing.assert_allclose(mesh.boxes.starts[1] + mesh.boxes.arms[1] / 2, [0, 1.5, 0])
    assert np.ptp(mesh.points[bone_boxes.POINTS_PER_BOX :], axis=0).max() < 0.1


def test_a_single_joint_has_a_body():
    mesh = made(chain((0, 0, 0)))
    assert len(mesh.points) == bone_boxes.POINTS_PER_BOX


def test_boxes_in_one_place_are_drawn_once():
    parents, offsets = (-1, 0, 0), np.array([(0, 1, 0), (0, 0.5, 0), (0, 0.5, 0)])
    mesh = made(Skeleton(("a", "b", "c"), parents, offsets, (), np.empty((0, 3))))
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)
    assert mesh.joints == [0, 1]


def test_sides_are_told_apart_by_their_place(person):
    mesh = made(person)
    tints = dict(zip(mesh.joints, mesh.tints, strict=True))
    assert (tints[3], tints[7], tints[11]) != (0, 0, 0)
    assert (tints[2], tints[7], tints[11]) == (0, 1, 2)


def test_many_bodies_are_the_same_as_one_by_one(person):
    """To the bit, and the same boxes whatever the bones of a clip."""
    rng = np.random.default_rng(2)
    offsets = person.offsets * rng.uniform(0.5, 1.5, (9, len(person), 1))
    offsets[3, 5] = 0.0
    bones = bone_boxes.bones(person)
    many = bone_boxes.points_and_normals(bone_boxes.bone_boxes(person, bones, offsets))
    for index, own in enumerate(offsets):
        alone = bone_boxes.points_and_normals(bone_boxes.bone_boxes(person, bones, own))
        for values, value in zip(many, alone, strict=True):
            np.testing.assert_array_equal(values[index], value)


def test_a_bone_that_has_no_length_in_one_clip_keeps_its_box(person):
    offsets = person.offsets.copy()
    offsets[5] = 0.0
    points, normals = bone_boxes.points_and_normals(
        bone_boxes.bone_boxes(person, bone_boxes.bones(person), offsets)
    )
    assert points.shape == made(person).points.shape
    assert np.all(np.isfinite(points))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0)
