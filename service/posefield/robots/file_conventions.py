"""Conventions that files of reference motions do not state, told by their numbers.

Nothing is guessed: where two readings are possible, the evidence of the numbers decides and is
told, or the user is asked.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np

from posefield.common.errors import MotionFileError
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.robots.robot import BodyPositions, HingeAngles, Order, Robot, upright
from posefield.robots.robot_motion import RobotMotion

QuaternionOrder = Literal["wxyz", "xyzw"]
MATCH = 0.01
"""Largest mean distance of bodies, m, from those of the file for an order of joints."""
UPRIGHT = 0.5
"""Least vertical component of the base's own vertical axis of a robot that does not lie."""
WITHIN, WITHIN_NOT = 0.95, 0.1
"""Shares of angles: within the limits as degrees at least, and beyond them as radians."""
NEAR_FLOOR, LOW_SHARES = 0.15, (0.5, 0.9)
"""Height of the lowest sole, in heights of the robot, of one that stands or steps; shares of frames
of those that do not as they are, and do in other axes."""
MOST_HIGH, MOST_DEEP = 1.5, 0.5
"""Height and depth of the lowest sole in all frames, in heights of the robot, that are told."""
UP_TURN = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(0.5 * np.pi))
"""Turn of a world with Y up to one with Z up."""

Content = Mapping[str, Any]
"""Fields of a file by name; the numbers of a CSV file are the field "rows"."""
Poses = tuple[Floats, Floats, Floats]


@dataclass(frozen=True)
class Conventions:
    """Statements of a user on files; None for what the files have to tell.

    rate: frames a second. quaternions: order of the base's numbers. order: of unnamed joints.
    degrees: whether angles are given in degrees.
    """

    robot: Robot | None = None
    rate: float | None = None
    quaternions: QuaternionOrder | None = None
    order: Order | None = None
    degrees: bool = False


@dataclass(frozen=True)
class File:
    """Content of a file, its name, and what the user states of it."""

    source: str
    content: Content
    conventions: Conventions

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def array(self, name: str, *shape: int | None) -> Floats:
        """Return a field as numbers of a shape, in which None stands for any size."""
        if name not in self.content:
            raise self.error(f"lacks the field {name!r}, expected numbers")
        try:
            values = np.asarray(self.content[name], dtype=float)
        except (TypeError, ValueError):
            raise self.error(f"field {name!r} holds no numbers") from None
        fits = len(shape) == values.ndim and all(
            size in (None, axis) for size, axis in zip(shape, values.shape, strict=True)
        )
        if not fits:
            sizes = ", ".join("any" if size is None else str(size) for size in shape)
            raise self.error(f"field {name!r} has the shape {values.shape}, expected ({sizes})")
        return values

    def rate(self, stated: float | None, where: str) -> tuple[float, str]:
        """Return frames a second and how they are known: by the user or by the file."""
        if self.conventions.rate:
            return self.conventions.rate, "--rate"
        if stated is None:
            raise self.error(f"states no frame rate{where}: say --rate, frames a second")
        if not (np.isfinite(stated) and stated > 0):
            raise self.error(f"states {stated} frames a second, expected a positive number")
        return float(stated), "the file"

    def names(self, field: str) -> tuple[str, ...]:
        """Return the names in a field."""
        return tuple(str(name) for name in np.asarray(self.content[field]).ravel())

    def motion(
        self,
        name: str,
        poses: Poses,
        rate: tuple[float, str],
        joints: str,
        quaternions: str,
        **facts: Any,
    ) -> RobotMotion:
        """Return the motion of a format.

        poses: base positions (F, 3), m, rotations (F, 4), angles (F, H), rad. rate: as `rate`
        returns it. joints, quaternions: how they were known. facts: further fields.
        """
        evidence = {"joints": joints, "quaternions": quaternions, "rate": rate[1]}
        return RobotMotion(self.source, name, *poses, rate[0], evidence=evidence, **facts)


def wxyz(values: Annotated[Floats, "frames 4"], order: QuaternionOrder) -> Floats:
    return values if order == "wxyz" else values[:, [3, 0, 1, 2]]


def tell_quaternions(
    file: File, path: Floats, values: Annotated[Floats, "frames 4"], angles: HingeAngles
) -> tuple[Floats, str]:
    """Return base rotations, and how the order of their numbers was known.

    A robot stands: if one reading alone is upright in all frames, it is the right one. Otherwise
    the soles tell, which lie level on the floor in the right one. Turned by half a turn about the
    vertical, a robot is upright either way; then the user is asked.
    """
    if file.conventions.quaternions:
        return wxyz(values, file.conventions.quaternions), "--quaternions"
    orders: tuple[QuaternionOrder, ...] = ("wxyz", "xyzw")
    readings = {order: wxyz(values, order) for order in orders}
    lowest = {order: float(upright(readings[order]).min()) for order in orders}
    standing = [order for order in orders if lowest[order] > UPRIGHT]
    if len(standing) == 1:
        order, other = standing[0], orders[orders.index(standing[0]) - 1]
        told = f"{order}: upright in all frames ({lowest[order]:.2f}; {other}: {lowest[other]:.2f})"
        return readings[order], told
    robot = file.conventions.robot
    if robot and robot.feet and angles.shape[1] == len(robot.hinges):
        tilts = {order: _sole_tilt(robot, path, readings[order], angles) for order in orders}
        order = min(orders, key=tilts.__getitem__)
        other = orders[orders.index(order) - 1]
        if tilts[order] < 0.5 * tilts[other]:
            lengths = f"{100 * tilts[order]:.1f} cm; {other}: {100 * tilts[other]:.1f} cm"
            return readings[order], f"{order}: standing soles are level within {lengths}"
    raise file.error(
        "the base's quaternions can be read as w x y z and as x y z w: say --quaternions wxyz "
        "(Kimodo, MuJoCo) or --quaternions xyzw (Unitree, LAFAN1); robot.quaternions in a recipe"
    )


def _sole_tilt(robot: Robot, path: Floats, rotations: Floats, angles: HingeAngles) -> float:
    """Return the mean difference of heights within the lower foot's sole, m."""
    positions, turns = robot.body_poses(path, rotations, angles)
    heights = [points[..., 2] for points in robot.foot_points(positions, turns)]
    extents = np.stack([np.ptp(height, axis=1) for height in heights])
    lower = np.argmin([height.min(axis=1) for height in heights], axis=0)
    return float(np.take_along_axis(extents, lower[None], axis=0).mean())


def expect_radians(motion: RobotMotion, conventions: Conventions) -> None:
    """Raise MotionFileError for angles that are beyond a turn, and within the limits as degrees."""
    robot = conventions.robot
    farthest = float(np.abs(motion.angles).max(initial=0.0))
    if robot is None or conventions.degrees or farthest < 2.0 * np.pi:
        return
    as_degrees = replace(motion, angles=np.radians(motion.angles)).beyond_limits(robot)
    if (as_degrees < 0.0).mean() > WITHIN and (
        motion.beyond_limits(robot) > 0.0
    ).mean() > WITHIN_NOT:
        raise motion.error(
            f"angles reach {farthest:.3g} rad, and lie within the limits of {robot.name} if they "
            "are degrees: expected radians, or --degrees"
        )


def expect_floor(motion: RobotMotion, robot: Robot) -> None:
    """Raise MotionFileError for a robot that is never near the floor: another unit or up axis."""
    if not robot.feet:
        return
    path, rotations = motion.base_path, motion.base_rotations

    def lowest_soles(path: Floats, rotations: Floats, angles: HingeAngles) -> Floats:
        soles = robot.foot_points(*robot.body_poses(path, rotations, angles))
        return np.asarray(np.min([points[..., 2].min(axis=1) for points in soles], axis=0))

    still = np.zeros((1, 3)), quat.IDENTITY[None], np.zeros((1, motion.angles.shape[1]))
    tall = float(robot.body_poses(*still)[0][..., 2].max() - lowest_soles(*still)[0])
    lowest = lowest_soles(path, rotations, motion.angles)
    expected = "expected metres with Z up and the floor at 0"
    if lowest.min() > MOST_HIGH * tall or lowest.max() < -MOST_DEEP * tall:
        raise motion.error(
            f"the lowest sole is {lowest.min():.2f} to {lowest.max():.2f} m high, and "
            f"{robot.name} is {tall:.2f} m tall: {expected}"
        )
    share = (np.abs(lowest) < NEAR_FLOOR * tall).mean()
    readings = {
        "Y up": (quat.rotate(UP_TURN, path), quat.mul(UP_TURN, rotations)),
        "Y up and swapped axes": (path[:, [2, 0, 1]], rotations[:, [0, 3, 1, 2]]),
        "the path's Y up": (path[:, [2, 0, 1]], rotations),
    }
    for axes, reading in readings.items() if share < LOW_SHARES[0] else ():
        near = (np.abs(lowest_soles(*reading, motion.angles)) < NEAR_FLOOR * tall).mean()
        if near > LOW_SHARES[1]:
            raise motion.error(
                f"the lowest sole is near the floor in {share:.0%} of the frames, and in "
                f"{near:.0%} of them if the file has {axes}: {expected}"
            )


def tell_order(
    file: File, angles: HingeAngles, bodies: BodyPositions, turns: Annotated[Floats, "frames 4"]
) -> tuple[HingeAngles, str]:
    """Return angles depth first, and how the order of the unnamed joints was known.

    The order is the one in which the robot's own kinematics gives the bodies of the file.
    """
    robot, stated = file.conventions.robot, file.conventions.order
    if robot is None:
        if stated:
            raise file.error("--order needs the robot whose joints are meant: say --robot")
        return angles, "unknown without --robot: depth first (mjlab) or breadth first (BeyondMimic)"
    if angles.shape[1] != len(robot.hinges) or bodies.shape[1] != len(robot.bodies):
        raise file.error(
            f"found {angles.shape[1]} joints and {bodies.shape[1]} bodies, expected the "
            f"{len(robot.hinges)} and {len(robot.bodies)} of {robot.name}"
        )
    orders: tuple[Order, ...] = ("depth", "breadth")
    readings = {order: angles[:, np.argsort(robot.hinge_order(order))] for order in orders}
    if stated:
        return readings[stated], "--order"
    distances = {}
    for order in orders:
        positions, _ = robot.body_poses(bodies[:, 0], turns, readings[order])
        gaps = bodies - positions[:, robot.body_order(order)]
        distances[order] = float(np.linalg.norm(gaps, axis=-1).mean())
    order = min(orders, key=distances.__getitem__)
    other = orders[orders.index(order) - 1]
    gaps_told = f"{1000 * distances[order]:.2g} mm; {other} first: {1000 * distances[other]:.2g} mm"
    if distances[order] > MATCH:
        raise file.error(
            f"its bodies are those of {robot.name} in neither order ({order} first: {gaps_told}): "
            "expected a file of this robot"
        )
    return readings[order], f"{order} first: its bodies lie within {gaps_told}"
