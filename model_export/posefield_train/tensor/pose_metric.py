"""Metric of pose space: the distance that joints move for a change of each degree of freedom.

A pose vector mixes metres and radians, and a hip moves more of the body than a wrist. The Gram
matrix JᵀJ of the forward kinematics' Jacobian J, averaged over the family's poses, turns distances
between pose vectors into distances between joint positions, so that least squares minimizes those.

JᵀJ is the mass matrix of a body with a unit mass at every joint, and is computed as such by
composite rigid bodies (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6.2), with
motions and forces as six numbers about the origin. The Jacobian is never formed.
"""

from typing import Annotated

import numpy as np

from posefield.common.array_shapes import JointWeights
from posefield.common.units import Floats
from posefield.motion import quat, skeleton

# Radius of a sphere at every joint, m, so that rotations about a bone have a cost.
SHELL_RADIUS = 0.03
# Poses over which the metric is averaged: 40 times as many change the truncation error by less than
# half a percent, on the procedural family and on real motion.
SAMPLED_POSES = 50
# Least eigenvalue of the metric, as a share of the largest.
FLOOR = 1e-6


def gram(
    parents: tuple[int, ...],
    rotations: Annotated[Floats, "poses joints 4"],
    jacobians: Annotated[Floats, "poses joints 3 3"],
    translations: Annotated[Floats, "poses joints 3"],
    joint_weights: JointWeights,
) -> Annotated[Floats, "3+joints*3 3+joints*3"]:
    """Return the mean over poses of JᵀJ (D, D), D = 3 + 3 J, in m² per squared unit.

    rotations: local (P, J, 4). jacobians: right Jacobians (P, J, 3, 3) of their numbers.
    translations: local (P, J, 3), m. joint_weights: mass (J,) of each joint.
    """
    positions, orientations = skeleton.forward_kinematics(parents, rotations, translations)
    below = skeleton.descendant_matrix(parents)
    motions = _motions(positions, _axes(orientations, jacobians))
    forces = _forces(motions, positions, joint_weights, below)
    poses = len(positions)
    products = np.tensordot(motions, forces, axes=([0, 2], [0, 2])) / poses
    # A force acts on its own joint and on ancestors; the other half follows by symmetry.
    acts = np.kron(np.pad(below, ((1, 0), (1, 0)), constant_values=1.0), np.ones((3, 3)))
    upper = products * np.triu(acts)
    return upper + np.triu(upper, k=1).T


def _axes(
    orientations: Annotated[Floats, "poses joints 4"],
    jacobians: Annotated[Floats, "poses joints 3 3"],
) -> Annotated[Floats, "poses joints 3 3"]:
    """Return the world axis (P, J, 3 numbers, 3) of each number of a rotation."""
    turned = quat.to_matrix(orientations) @ jacobians
    return np.swapaxes(turned, -1, -2)


def _motions(
    positions: Annotated[Floats, "poses joints 3"], axes: Annotated[Floats, "poses joints 3 3"]
) -> Annotated[Floats, "poses 3+joints*3 6"]:
    """Return the motion (P, 3 + 3 J, 6) of each degree of freedom.

    It is the angular velocity and the velocity at the origin.
    """
    poses, joints = positions.shape[:2]
    motions = np.zeros((poses, 3 + 3 * joints, 6))
    motions[:, :3, 3:] = np.eye(3)
    motions[:, 3:, :3] = axes.reshape(poses, -1, 3)
    motions[:, 3:, 3:] = quat.cross(positions[:, :, None], axes).reshape(poses, -1, 3)
    return motions


def _forces(
    motions: Annotated[Floats, "poses dof 6"],
    positions: Annotated[Floats, "poses joints 3"],
    mass: JointWeights,
    below: Annotated[Floats, "joints joints"],
) -> Annotated[Floats, "poses dof 6"]:
    """Return the moment about the origin and the force (P, 3 + 3 J, 6) that each motion needs.

    The joint and its descendants move as one rigid body.
    """
    moments = mass[:, None] * positions
    second = moments[..., :, None] * positions[..., None, :]
    size = np.trace(second, axis1=-2, axis2=-1) + 2.0 / 3.0 * SHELL_RADIUS**2 * mass
    inertia = size[..., None, None] * np.eye(3) - second
    carried = np.vstack([below[:1], below])
    mass_below = np.repeat(carried @ mass, 3)[:, None]
    first = np.repeat(np.einsum("jk,pkc->pjc", carried, moments), 3, axis=1)
    turning = np.repeat(np.einsum("jk,pkcd->pjcd", carried, inertia, optimize=True), 3, axis=1)
    spin, drift = motions[..., :3], motions[..., 3:]
    force = quat.cross(spin, first) + mass_below * drift
    moment = np.einsum("pdcx,pdx->pdc", turning, spin) + quat.cross(first, drift)
    return np.concatenate([moment, force], axis=-1)


def whitening(
    gram: Annotated[Floats, "dof dof"],
) -> tuple[Annotated[Floats, "dof dof"], Annotated[Floats, "dof dof"]]:
    """Return the square root (D, D) of a Gram matrix and its inverse.

    Eigenvalues below FLOOR times the largest are raised to it.
    """
    if not len(gram):
        return gram, gram
    values, vectors = np.linalg.eigh(gram)
    roots = np.sqrt(np.maximum(values, FLOOR * values[-1]))
    return (vectors * roots) @ vectors.T, (vectors / roots) @ vectors.T
