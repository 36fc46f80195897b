"""A robot's bodies and hinges, and their poses.

Files of robots, and this package, have Z up; a robot that faces straight ahead faces +X.
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np

from posefield.common.units import Floats, Frames, RootPath
from posefield.motion import quat

HingeAngles = Annotated[Floats, "frames hinges"]
BodyPositions = Annotated[Floats, "frames bodies 3"]
BodyRotations = Annotated[Floats, "frames bodies 4"]
UNLIMITED = 1e6
"""Angle, rad, that stands for none."""
Order = Literal["depth", "breadth"]
"""Order of bodies and hinges in a file: depth first as MuJoCo's, or breadth first as PhysX's."""


@dataclass(frozen=True)
class Foot:
    """A foot: index of its body, and points (P, 3) of its surface in the body's frame, m."""

    body: int
    points: Annotated[Floats, "points 3"]


@dataclass(frozen=True, eq=False)
class Robot:
    """Bodies on a floating base, joined by hinges.

    bodies: names (B), depth first, the base first. parents: of each; -1 for the base. offsets
    (B, 3), m, and turns (B, 4): of a body at rest in its parent's frame; the base's height at rest
    is its offset. hinges: names (H), depth first. hinge_bodies: the body that each turns. axes,
    anchors (H, 3): unit axes and points on them in the body's frame, m. ranges (H, 2): least and
    largest angle, rad; -UNLIMITED and UNLIMITED without a limit. feet: empty if they are not known.
    """

    name: str
    bodies: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Annotated[Floats, "bodies 3"] = field(repr=False)
    turns: Annotated[Floats, "bodies 4"] = field(repr=False)
    hinges: tuple[str, ...]
    hinge_bodies: tuple[int, ...]
    axes: Annotated[Floats, "hinges 3"] = field(repr=False)
    anchors: Annotated[Floats, "hinges 3"] = field(repr=False)
    ranges: Annotated[Floats, "hinges 2"] = field(repr=False)
    feet: tuple[Foot, ...] = field(default=(), repr=False)

    def body_order(self, order: Order) -> list[int]:
        """Return the indices of the bodies in an order."""
        if order == "depth":
            return list(range(len(self.bodies)))
        # Siblings keep the order of the robot's file.
        queue = [0]
        for body in queue:
            queue += [child for child, parent in enumerate(self.parents) if parent == body]
        return queue

    def hinge_order(self, order: Order) -> list[int]:
        """Return the indices of the hinges in an order."""
        places = {body: place for place, body in enumerate(self.body_order(order))}
        return sorted(range(len(self.hinges)), key=lambda hinge: places[self.hinge_bodies[hinge]])

    def body_poses(
        self,
        base_path: RootPath,
        base_rotations: Annotated[Floats, "frames 4"],
        angles: HingeAngles,
    ) -> tuple[BodyPositions, BodyRotations]:
        """Return the positions (F, B, 3), m, and rotations (F, B, 4) of the bodies in the world.

        base_path (F, 3), m, base_rotations (F, 4) in the world; angles (F, H), rad.
        """
        positions = np.empty((len(angles), len(self.bodies), 3))
        rotations = np.empty((len(angles), len(self.bodies), 4))
        positions[:, 0], rotations[:, 0] = base_path, base_rotations
        for body, parent in enumerate(self.parents):
            if body:
                turn = rotations[:, parent]
                positions[:, body] = positions[:, parent] + quat.rotate(turn, self.offsets[body])
                rotations[:, body] = quat.mul(turn, self.turns[body])
            for hinge in np.flatnonzero(np.array(self.hinge_bodies) == body):
                fixed = quat.rotate(rotations[:, body], self.anchors[hinge])
                turn = quat.from_axis_angle(self.axes[hinge], angles[:, hinge])
                rotations[:, body] = quat.mul(rotations[:, body], turn)
                # A hinge beside the body's origin moves the origin on a circle.
                positions[:, body] += fixed - quat.rotate(rotations[:, body], self.anchors[hinge])
        return positions, rotations

    def foot_points(
        self, positions: BodyPositions, rotations: BodyRotations
    ) -> list[Annotated[Floats, "frames points 3"]]:
        """Return the points (F, P, 3), m, of each foot in the world."""
        return [
            positions[:, foot.body, None] + quat.rotate(rotations[:, foot.body, None], foot.points)
            for foot in self.feet
        ]


def upright(rotations: Annotated[Floats, "frames 4"]) -> Frames:
    """Return the vertical component (F,) of the base's own vertical axis: 1 for upright."""
    return 1.0 - 2.0 * (rotations[:, 1] ** 2 + rotations[:, 2] ** 2)


def velocities(values: Floats, rate: float) -> Floats:
    """Return central differences of values (F, ...) a second."""
    return np.asarray(np.gradient(values, axis=0) * rate)


def angular_velocities(rotations: Annotated[Floats, "frames *bodies 4"], rate: float) -> Floats:
    """Return angular velocities (F, ..., 3), rad/s, in the world, of rotations (F, ..., 4)."""
    steps = quat.log(quat.mul(rotations[1:], quat.conj(rotations[:-1]))) * rate
    # A frame has the mean of the steps before and after it.
    return np.concatenate([steps[:1], 0.5 * (steps[1:] + steps[:-1]), steps[-1:]])
