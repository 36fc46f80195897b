"""The metric of pose space: how far joints move when a degree of freedom does.

A pose vector mixes metres and radians, and a hip turns more body than a wrist. The Gram matrix JᵀJ
of the forward kinematics' Jacobian J, averaged over the family's own poses, is what makes distances
between pose vectors distances between bodies, so that least squares means what the eye sees.

JᵀJ is the mass matrix of a body that carries a unit mass at every joint, so it is computed as one:
by composite rigid bodies (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6.2), with
motions and forces as six numbers about the origin. No Jacobian is ever formed.
"""

import numpy as np

from service.motion import quat, skeleton
from service.motion.conventions import Floats

# Every joint carries a sphere of skin of this radius, so that a turn about a bone counts too, m.
SHELL = 0.03
# Poses over which the metric is averaged: 40 times as many change the truncation error by less than
# half a percent, on the procedural family and on real motion.
POSES = 50
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
    translations (P, J, 3) local, m. joint_weights (J,): the mass of each joint.
    """
    positions, orientations = skeleton.forward(parents, rotations, translations)
    below = skeleton.descendants(parents)
    motions = _motions(positions, _axes(orientations, vectors))
    forces = _forces(motions, positions, joint_weights, below)
    poses = len(positions)
    products = np.tensordot(motions, forces, axes=([0, 2], [0, 2])) / poses
    # A force acts on the joint that it comes from and on those above it; the rest is symmetry.
    acts = np.kron(np.pad(below, ((1, 0), (1, 0)), constant_values=1.0), np.ones((3, 3)))
    upper = products * np.triu(acts)
    return upper + np.triu(upper, k=1).T


def _axes(orientations: Floats, vectors: Floats) -> Floats:
    """World axis (P, J, 3 numbers, 3) about which each number of a rotation vector turns."""
    turned = quat.to_matrix(orientations) @ quat.right_jacobian(vectors)
    return np.swapaxes(turned, -1, -2)


def _motions(positions: Floats, axes: Floats) -> Floats:
    """Angular velocity and velocity at the origin (P, 3 + 3 J, 6) of each degree of freedom."""
    poses, joints = positions.shape[:2]
    motions = np.zeros((poses, 3 + 3 * joints, 6))
    motions[:, :3, 3:] = np.eye(3)
    motions[:, 3:, :3] = axes.reshape(poses, -1, 3)
    motions[:, 3:, 3:] = quat.cross(positions[:, :, None], axes).reshape(poses, -1, 3)
    return motions


def _forces(motions: Floats, positions: Floats, mass: Floats, below: Floats) -> Floats:
    """Moment about the origin and force (P, 3 + 3 J, 6) that each motion needs.

    What moves is all that hangs below the joint, as one rigid body.
    """
    moments = mass[:, None] * positions
    second = moments[..., :, None] * positions[..., None, :]
    size = np.trace(second, axis1=-2, axis2=-1) + 2.0 / 3.0 * SHELL**2 * mass
    inertia = size[..., None, None] * np.eye(3) - second
    carried = np.vstack([below[:1], below])
    mass_below = np.repeat(carried @ mass, 3)[:, None]
    first = np.repeat(np.einsum("jk,pkc->pjc", carried, moments), 3, axis=1)
    turning = np.repeat(np.einsum("jk,pkcd->pjcd", carried, inertia, optimize=True), 3, axis=1)
    spin, drift = motions[..., :3], motions[..., 3:]
    force = quat.cross(spin, first) + mass_below * drift
    moment = np.einsum("pdcx,pdx->pdc", turning, spin) + quat.cross(first, drift)
    return np.concatenate([moment, force], axis=-1)


def whitening(gram: Floats) -> tuple[Floats, Floats]:
    """Square root (D, D) of a Gram matrix and its inverse, tiny directions held at the floor."""
    values, vectors = np.linalg.eigh(gram)
    roots = np.sqrt(np.maximum(values, FLOOR * values[-1]))
    return (vectors * roots) @ vectors.T, (vectors / roots) @ vectors.T
