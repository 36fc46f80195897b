"""Tests of the pose-space metric against forward kinematics."""

import numpy as np
import pytest

from posefield.motion import quat, skeleton
from posefield.motion.quat import CHARTS
from posefield_train.tensor import motion_tensor

PARENTS = (-1, 0, 1, 2, 1, 4)
JOINTS, POSES = 6, 5
# Central differences with a step of 1e-5 are good to its square.
TOLERANCE = 1e-8


@pytest.fixture(params=CHARTS)
def chart(request):
    return CHARTS[request.param]


@pytest.fixture
def family(rng, chart):
    """The chart, means (J, 4), numbers (P, J, 3), and translations (P, J, 3) of performers."""
    means = quat.normalize(rng.normal(size=(JOINTS, 4)))
    return (
        chart,
        means,
        0.8 * rng.normal(size=(POSES, JOINTS, 3)),
        rng.normal(size=(POSES, JOINTS, 3)),
    )


@pytest.fixture
def weights(rng):
    return rng.uniform(0.5, 2.0, JOINTS)


def skin(chart, means, numbers, bones):
    """Six points (J * 6, 3) on the sphere of skin around every joint, in one pose."""
    rotations = quat.mul(means, chart.quaternions(numbers[3:].reshape(-1, 3)))
    translations = np.vstack([numbers[:3], bones[1:]])
    positions, orientations = skeleton.forward_kinematics(PARENTS, rotations, translations)
    axes = motion_tensor.SHELL_RADIUS * np.vstack([np.eye(3), -np.eye(3)])
    return (positions[:, None] + quat.rotate(orientations[:, None], axes)).reshape(-1, 3)


def by_differences(chart, means, vectors, translations, weights):
    """Mean over poses of JᵀJ, with the derivative of every number by central differences."""
    total, step = 0.0, 1e-5
    for vector, bones in zip(vectors, translations, strict=True):
        numbers = np.concatenate([bones[0], vector.ravel()])
        columns = []
        for index in range(len(numbers)):
            moved = step * np.eye(len(numbers))[index]
            ahead, behind = (skin(chart, means, numbers + s * moved, bones) for s in (1, -1))
            columns.append((ahead - behind) / (2.0 * step))
        jacobian = np.stack(columns)
        # Each sphere's mass is spread over its six points.
        masses = np.repeat(weights / 6.0, 6)
        total = total + np.einsum("apx,bpx,p->ab", jacobian, jacobian, masses)
    return total / len(vectors)


def gram(chart, means, vectors, translations, weights):
    rotations = quat.mul(means, chart.quaternions(vectors))
    jacobians = chart.right_jacobian(vectors)
    return motion_tensor.gram(PARENTS, rotations, jacobians, translations, weights)


def test_gram_matrix_is_that_of_finite_differences(family, weights):
    expected = by_differences(*family, weights)
    scale = np.max(np.abs(expected))
    assert np.max(np.abs(gram(*family, weights) - expected)) < TOLERANCE * scale
    assert np.max(np.abs(gram(*family, np.ones(JOINTS)) - expected)) > 1e-2 * scale
    chart, means, vectors, translations = family
    flat = np.tile(np.eye(3), (POSES, JOINTS, 1, 1))
    no_curvature = motion_tensor.gram(
        PARENTS, quat.mul(means, chart.quaternions(vectors)), flat, translations, weights
    )
    assert np.max(np.abs(no_curvature - expected)) > 1e-2 * scale


def test_tiny_and_vanishing_vectors_are_no_special_case(family, weights):
    chart, means, vectors, translations = family
    for size in (0.0, 1e-9, 9e-5, 1.1e-4):
        small = size * vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        expected = by_differences(chart, means, small, translations, weights)
        found = gram(chart, means, small, translations, weights)
        assert np.max(np.abs(found - expected)) < TOLERANCE * np.max(np.abs(expected))


def test_whitening_is_the_square_root_and_its_inverse(family, weights):
    found = gram(*family, weights)
    root, inverse = motion_tensor.whitening(found)
    assert np.linalg.eigvalsh(found)[0] > motion_tensor.FLOOR * np.linalg.eigvalsh(found)[-1]
    assert np.max(np.abs(root @ root.T - found)) < 1e-12 * np.max(found)
    assert np.max(np.abs(root @ inverse - np.eye(len(found)))) < 1e-10
    assert np.max(np.abs(root - root.T)) < 1e-12 * np.max(root)
    assert np.max(np.abs(np.diag(np.sqrt(np.diagonal(found))) ** 2 - found)) > 1e-2


def test_direction_that_moves_nothing_is_held_at_the_floor(rng):
    basis = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    root, inverse = motion_tensor.whitening((basis * [4.0, 1.0, 1e-9, 0.0]) @ basis.T)
    values = np.sort(np.linalg.eigvalsh(root))
    assert np.allclose(values, [2e-3, 2e-3, 1.0, 2.0], rtol=1e-9)
    assert np.max(np.abs(root @ inverse - np.eye(4))) < 1e-10
