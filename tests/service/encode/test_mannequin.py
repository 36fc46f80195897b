"""Tests of the mannequin: a closed skin, its normals and weights, on people and on others."""

import hashlib
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import conftest
import numpy as np
import pytest

from posefield.encode.body import body_plan, mannequin, skinned_mesh
from posefield.encode.formats import CLIP_ENCODERS, METRES
from posefield.motion.skeleton import Skeleton

LARGEST_BODY = 60_000
"""Bytes by which a body may enlarge a binary file."""


def skeleton(joints, tips):
    """A skeleton of (name, parent, offset) and of (joint, offset)."""
    names, parents, offsets = zip(*joints, strict=True)
    held = tuple(joint for joint, _ in tips)
    arms = np.array([arm for _, arm in tips], float).reshape(-1, 3)
    return Skeleton(names, parents, np.array(offsets, float), held, arms)


def dog():
    """A quadruped that looks along +Z, with a tail."""
    legs = [
        ("FrontLeft", 2, (0.09, -0.08, 0.05)),
        ("FrontRight", 2, (-0.09, -0.08, 0.05)),
        ("BackLeft", 0, (0.09, -0.06, -0.05)),
        ("BackRight", 0, (-0.09, -0.06, -0.05)),
    ]
    joints = [
        ("Pelvis", -1, (0.0, 0.55, 0.0)),
        ("Spine", 0, (0.0, 0.02, 0.25)),
        ("Chest", 1, (0.0, 0.0, 0.25)),
        ("Neck", 2, (0.0, 0.1, 0.15)),
        ("Head", 3, (0.0, 0.08, 0.1)),
        ("Tail", 0, (0.0, 0.03, -0.12)),
        ("TailEnd", 5, (0.0, -0.05, -0.2)),
    ]
    for name, parent, offset in legs:
        top = len(joints)
        joints += [(f"{name}Upper", parent, offset), (f"{name}Lower", top, (0, -0.2, -0.03))]
        joints.append((f"{name}Paw", top + 1, (0, -0.2, 0.03)))
    paws = [at for at, (name, _, _) in enumerate(joints) if name.endswith("Paw")]
    tips = [(4, (0, -0.02, 0.15)), (6, (0, -0.1, -0.1)), *((paw, (0, 0, 0.07)) for paw in paws)]
    return skeleton(joints, tips)


def star(seed):
    """A random tree of joints, some of which coincide."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 20))
    parents = (-1, *(int(rng.integers(0, joint)) for joint in range(1, count)))
    offsets = rng.uniform(-0.4, 0.4, (count, 3)) * rng.integers(0, 2, (count, 1))
    return Skeleton(
        tuple(f"j{joint}" for joint in range(count)), parents, offsets, (), np.empty((0, 3))
    )


BODIES = {"person": conftest.person(), "dog": dog(), **{f"star{s}": star(s) for s in range(8)}}


@pytest.fixture(params=BODIES)
def body(request):
    found = BODIES[request.param]
    return found, mannequin.mannequin(found)


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


def pieces(mesh):
    """The number of separate skins."""
    label = np.arange(len(mesh.points))
    for _ in range(len(label)):
        before = label.copy()
        for a, b in (edges(mesh).T, edges(mesh).T[::-1]):
            np.minimum.at(label, a, label[b])
        if np.array_equal(before, label):
            return len(np.unique(label))
    raise AssertionError("no end")


def test_a_skin_is_closed_and_looks_outwards(body):
    _, mesh = body
    assert closed(mesh)
    assert volume(mesh) > 0
    assert set(mesh.corners.tolist()) == set(range(len(mesh.points)))


def test_a_missing_face_would_be_seen():
    mesh = mannequin.mannequin(BODIES["person"])
    torn = replace(mesh, counts=mesh.counts[:-1], corners=mesh.corners[: -mesh.counts[-1]])
    assert not closed(torn)


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


def test_neighbours_on_a_person_are_moved_nearly_alike():
    """No seam: weights differ little along each edge, also where limbs meet the trunk."""
    found = BODIES["person"]
    mesh = mannequin.mannequin(found)
    every = np.zeros((len(mesh.points), len(found)))
    np.add.at(every, (np.arange(len(every))[:, None], mesh.joints), mesh.weights / 255.0)
    apart = np.abs(every[edges(mesh)[:, 0]] - every[edges(mesh)[:, 1]]).sum(axis=1) / 2
    assert apart.max() < 0.6
    stiff = np.eye(len(found))[every.argmax(axis=1)]
    assert np.abs(stiff[edges(mesh)[:, 0]] - stiff[edges(mesh)[:, 1]]).sum(axis=1).max() == 2


def test_a_person_has_one_skin_as_large_as_a_person():
    plan = body_plan.person(body_plan.point_tree(BODIES["person"]))
    mesh = mannequin.mannequin(BODIES["person"])
    assert plan is not None and pieces(mesh) == 1
    assert 0.03 < volume(mesh) < 0.12


def test_a_person_looks_ahead_and_is_as_wide_on_both_sides():
    mesh = mannequin.mannequin(BODIES["person"])
    head = mesh.points[mesh.points[:, 1] > 1.45]
    middle = head.mean(axis=0)
    nose = head[np.argmax(head[:, 2])]
    assert abs(nose[0] - middle[0]) < 0.01
    assert nose[2] - middle[2] > 0.1 > middle[2] - head[:, 2].min() - 0.03
    assert mesh.points[:, 0].max() - 0.02 == pytest.approx(0.02 - mesh.points[:, 0].min(), abs=0.01)


def test_soles_are_flat_and_below_the_toes():
    person = BODIES["person"]
    mesh = mannequin.mannequin(person)
    tree = body_plan.point_tree(person)
    for side in (1, -1):
        foot = mesh.points[mesh.points[:, 0] * side > 0.02 * side]
        lowest = foot[:, 1].min()
        assert np.sum(foot[:, 1] < lowest + 1e-4) >= 10
        assert tree.places[-2, 1] - 0.03 < lowest < tree.places[-2, 1]


@pytest.mark.parametrize("turned", ["names", "shifted"])
def test_the_form_decides_and_not_the_names_or_the_place(turned):
    person = BODIES["person"]
    plain = mannequin.mannequin(person)
    if turned == "names":
        other = replace(person, names=tuple(f"x{at}" for at in range(len(person))))
        np.testing.assert_array_equal(mannequin.mannequin(other).points, plain.points)
    else:
        offsets = person.offsets.copy()
        offsets[0] += (1.0, 0.25, -2.0)
        found = mannequin.mannequin(replace(person, offsets=offsets))
        expected = plain.points + np.array([1.0, 0.25, -2.0])
        np.testing.assert_allclose(found.points, expected, atol=1e-5)


def test_a_person_who_faces_away_is_turned_with_all_points():
    person = BODIES["person"]
    half_turn = np.array([-1.0, 1.0, -1.0])
    away = replace(
        person, offsets=person.offsets * half_turn, tip_offsets=person.tip_offsets * half_turn
    )
    ours, theirs = (mannequin.mannequin(each).points for each in (person, away))
    for points in (ours, theirs):
        assert len(points) == len(ours)
    order = [np.lexsort(np.round(p, 4).T) for p in (ours * half_turn, theirs)]
    np.testing.assert_allclose(
        (ours * half_turn)[order[0]].mean(axis=0), theirs[order[1]].mean(axis=0), atol=1e-4
    )


def test_a_dog_is_no_person_and_has_a_body():
    tree = body_plan.point_tree(dog())
    assert body_plan.person(tree) is None
    mesh = mannequin.mannequin(dog())
    assert 0.005 < volume(mesh) < 0.1
    # No bone is without skin around it.
    for joint in tree.places:
        assert np.linalg.norm(mesh.points - joint, axis=-1).min() < 0.12


def test_longer_bones_stretch_the_skin_with_them():
    person = BODIES["person"]
    mesh = mannequin.mannequin(person)
    moved = np.zeros((1, len(person) + len(person.tip_joints), 3))
    assert np.array_equal(mesh.points_at(mesh.places.displacements(moved))[0], mesh.points)
    moved[:] = (0.1, 0.2, 0.3)
    found = mesh.points_at(mesh.places.displacements(moved))[0]
    np.testing.assert_allclose(
        found - mesh.points, np.tile((0.1, 0.2, 0.3), (len(found), 1)), atol=1e-6
    )


@pytest.mark.parametrize("extension", ["usdc", "glb"])
def test_a_body_takes_at_most_so_many_bytes(walk, extension):
    sizes = {
        kind: len(CLIP_ENCODERS[extension].encode(walk, replace(METRES, body=kind)))
        for kind in ("none", "mannequin", "bones")
    }
    assert 10_000 < sizes["mannequin"] - sizes["none"] < LARGEST_BODY
    assert sizes["none"] < sizes["bones"] < sizes["mannequin"]


PRINT_DIGEST = """
import sys, hashlib
sys.path.insert(0, sys.argv[1])
import test_mannequin
print(test_mannequin.digest())
"""


def digest():
    found = hashlib.sha256()
    for each in BODIES.values():
        mesh = mannequin.mannequin(each)
        for values in (mesh.points, mesh.normals, mesh.joints, mesh.weights, mesh.corners):
            found.update(values.tobytes())
    return found.hexdigest()


@pytest.mark.system
def test_other_processes_make_the_same_bodies():
    folder = str(Path(__file__).parent)
    said = subprocess.run(
        [sys.executable, "-c", PRINT_DIGEST, folder], capture_output=True, text=True, check=True
    )
    assert said.stdout.strip() == digest()
