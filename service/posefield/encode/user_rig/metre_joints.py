"""Joints of a user's file in metres with Y up, for formats other than the file's own."""

from typing import Annotated

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.rigs.joints.rest_joints import OuterTransform, RestJoints

WORLD = OuterTransform(quat.IDENTITY, np.zeros(3), np.ones(3))


def in_metres(rest: RestJoints) -> RestJoints:
    """Return the joints with the same axes in a world of metres with Y up, without scales."""
    joints, parents = rest.skeleton, list(rest.parents[1:])
    above = np.concatenate([quat.IDENTITY[None], rest.orientations[parents]])
    return RestJoints(
        rest.source,
        rest.names,
        rest.parents,
        quat.normalize(quat.mul(quat.conj(above), rest.orientations)),
        quat.rotate(quat.conj(above), joints.offsets),
        np.ones((len(rest.names), 3)),
        WORLD,
        1.0,
        "y",
    )


def matrices(
    rotations: Annotated[Floats, "*batch joints 4"],
    translations: Annotated[Floats, "*batch joints 3"],
) -> Annotated[Floats, "*batch joints 4 4"]:
    """Return matrices (..., 4, 4) for row vectors, as in USD."""
    made = np.zeros((*rotations.shape[:-1], 4, 4))
    made[..., :3, :3] = np.swapaxes(quat.to_matrix(rotations), -1, -2)
    made[..., 3, :3] = translations
    made[..., 3, 3] = 1.0
    return made
