"""Reference motion of a robot as a file holds it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from posefield.common.errors import MotionFileError, did_you_mean
from posefield.common.units import Floats, RootPath
from posefield.motion import quat
from posefield.robots.robot import BodyPositions, BodyRotations, HingeAngles, Robot

NORM_TOLERANCE = 1e-3
"""Deviation from a unit quaternion's norm that digits cut off explain."""
LIMIT_TOLERANCE = np.radians(0.1)
"""Angle beyond a limit that rounding explains."""


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """Frames of a robot's base and hinges, Z up.

    source: the file's name. format: name of a row of the table of formats. base_path (F, 3), m;
    base_rotations (F, 4); angles (F, H), rad. rate: frames a second. hinges: names of the columns
    of angles; empty if the file has none and no robot was given. loops: whether the file says that
    the motion repeats; None if it says nothing. evidence: how each convention was known, by what
    it is of.
    """

    source: str
    format: str
    base_path: RootPath = field(repr=False)
    base_rotations: Annotated[Floats, "frames 4"] = field(repr=False)
    angles: HingeAngles = field(repr=False)
    rate: float
    hinges: tuple[str, ...] = ()
    loops: bool | None = None
    evidence: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.angles)

    @property
    def duration(self) -> float:
        """Return the seconds from the first frame to the last."""
        return (len(self) - 1) / self.rate

    def error(self, message: str) -> MotionFileError:
        """Return an error that names the file."""
        return MotionFileError(self.source, message)

    def checked(self) -> "RobotMotion":
        """Return the motion with unit quaternions of continuous sign.

        Raises MotionFileError for fewer than two frames, numbers that are not finite, and
        quaternions that are not of unit norm.
        """
        if len(self) < 2:
            raise self.error(f"found {len(self)} frame, expected two or more")
        columns = {
            "base position": self.base_path,
            "base quaternion": self.base_rotations,
            "joint angle": self.angles,
        }
        for name, values in columns.items():
            if not np.isfinite(values).all():
                frame, column = np.argwhere(~np.isfinite(values))[0]
                raise self.error(
                    f"{name} {column + 1} of frame {frame} is {values[frame, column]}, "
                    "expected a finite number"
                )
        norms = np.linalg.norm(self.base_rotations, axis=-1)
        frame = int(np.argmax(np.abs(norms - 1.0)))
        if abs(norms[frame] - 1.0) > NORM_TOLERANCE:
            raise self.error(
                f"the base quaternion of frame {frame} has norm {norms[frame]:.4g}, expected 1"
            )
        rotations = quat.unroll(quat.normalize(self.base_rotations))
        return replace(self, base_rotations=rotations)

    def on(self, robot: Robot) -> "RobotMotion":
        """Return the motion with its hinges in the robot's order.

        Raises MotionFileError if the hinges are not those of the robot.
        """
        if not self.hinges:
            if self.angles.shape[1] != len(robot.hinges):
                raise self.error(
                    f"found {self.angles.shape[1]} joint angles a frame, expected the "
                    f"{len(robot.hinges)} of {robot.name}"
                )
            return replace(self, hinges=robot.hinges)
        unknown = [name for name in self.hinges if name not in robot.hinges]
        missing = [name for name in robot.hinges if name not in self.hinges]
        if unknown or missing:
            name = (unknown or missing)[0]
            hint = did_you_mean(name, robot.hinges if unknown else self.hinges)
            where = f"is none of {robot.name}" if unknown else f"of {robot.name} is not in the file"
            raise self.error(
                f"joint {name!r} {where}{hint}: found {len(self.hinges)} joints, expected its "
                f"{len(robot.hinges)}"
            )
        angles = self.angles[:, [self.hinges.index(name) for name in robot.hinges]]
        return replace(self, angles=angles, hinges=robot.hinges)

    def beyond_limits(self, robot: Robot) -> HingeAngles:
        """Return by how much each hinge is beyond its limits (F, H), rad; negative within them."""
        low, high = robot.ranges.T
        return np.asarray(np.maximum(low - self.angles, self.angles - high))

    def body_poses(self, robot: Robot) -> tuple[BodyPositions, BodyRotations]:
        """Return the positions (F, B, 3), m, and rotations (F, B, 4) of the robot's bodies."""
        return robot.body_poses(self.base_path, self.base_rotations, self.angles)
