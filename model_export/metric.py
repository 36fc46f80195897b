"""The metric of pose space: how far joints move when a degree of freedom does.

A pose vector mixes metres and radians, and a hip turns more body than a wrist. The Gram matrix of
the forward kinematics' Jacobian, averaged over the family's own poses, is what makes distances
between pose vectors distances between bodies, so that least squares means what the eye sees.
"""

import numpy as np

from service.motion import quat, skeleton
from service.motion.conventions import Floats

# Every joint carries a sphere of skin of this radius, so that a turn about a bone counts too, m.
SHELL = 0.03
# Poses over which the metric is averaged: it is flat in their number far below this.
POSES = 200
# Directions that move almost nothing weigh no less than this share of the heaviest.
FLOOR = 1e-6


def gram(
    parents: tuple[int, ...],
    rotations: Floats,
    vectors: Floats,
    translations: Floats,
    joint_weights: Floats,
) -> Floats:
    """Mean over poses of JᵀJ (D, D), D = 3 + 3 J, m² for a unit of each degree of freedom.

    rotations (P, J, 4) local, vectors (P, J, 3) the same as rotation vectors about the means,
    translations (P, J, 3) local, m. joint_weights (J,): importance of each joint's position.
    """
    positions, orientations = skeleton.forward(parents, rotations, translations)
    axes = _axes(orientations, vectors)
    below = skeleton.descendants(parents)
    moved = _displacements(axes, positions, below) * np.sqrt(joint_weights)[:, None]
    poses, joints = positions.shape[:2]
    flat = moved.reshape(poses, 3 + 3 * joints, -1)
    total = np.einsum("pdx,pex->de", flat, flat, optimize=True)
    total[3:, 3:] += 2.0 / 3.0 * SHELL**2 * _turns(axes, (below * joint_weights) @ below.T)
    return total / poses


def _axes(orientations: Floats, vectors: Floats) -> Floats:
    """World axis (P, J, 3 numbers, 3) about which each number of a rotation vector turns."""
    turned = quat.to_matrix(orientations) @ _right_jacobian(vectors)
    return np.swapaxes(turned, -1, -2)


def _right_jacobian(v: Floats) -> Floats:
    """Matrix (..., 3, 3) with exp(v + dv) = exp(v) exp(J dv) to first order (Chirikjian 2011)."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    safe = np.maximum(angle, 1e-4)
    cross = np.cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2)
    first = np.where(angle < 1e-4, 0.5, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(angle < 1e-4, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    return np.eye(3) - first * cross + second * cross @ cross


def _displacements(axes: Floats, positions: Floats, below: Floats) -> Floats:
    """What a unit of each degree of freedom does to each joint (P, 3 + 3 J, J, 3), m."""
    poses, joints = positions.shape[:2]
    moved = np.zeros((poses, 3 + 3 * joints, joints, 3))
    moved[:, :3] = np.eye(3)[:, None]
    levers = (positions[:, None] - positions[:, :, None]) * below[..., None]
    turned = np.cross(axes[:, :, :, None], levers[:, :, None])
    moved[:, 3:] = turned.reshape(poses, 3 * joints, joints, 3)
    return moved


def _turns(axes: Floats, shared: Floats) -> Floats:
    """Sum over poses of the dot products of axes, by how many joints both of them carry."""
    flat = axes.reshape(len(axes), -1, 3)
    return np.einsum("pdx,pex->de", flat, flat) * np.kron(shared, np.ones((3, 3)))


def whitening(gram: Floats) -> tuple[Floats, Floats]:
    """Square root (D, D) of a Gram matrix and its inverse, tiny directions held at the floor."""
    values, vectors = np.linalg.eigh(gram)
    roots = np.sqrt(np.maximum(values, FLOOR * values[-1]))
    return (vectors * roots) @ vectors.T, (vectors / roots) @ vectors.T
