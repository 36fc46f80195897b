"""Floor on which feet stand: a plane in the frame of a clip."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Struct

from posefield.common.frame_groups import FrameGroups
from posefield.common.units import UP, Booleans, Floats
from posefield.motion import quat


class Floor(Struct, frozen=True, forbid_unknown_fields=True):
    """Plane over x and z in the frame of a clip.

    height: at the origin, m. slope_x, slope_z: rise for each metre along the axes.
    """

    height: float
    slope_x: float
    slope_z: float

    @property
    def is_level(self) -> bool:
        """Return whether the floor has no slope."""
        return self.slope == 0.0

    @property
    def slope(self) -> float:
        """Return the rise for each metre in the steepest direction."""
        return float(np.hypot(self.slope_x, self.slope_z))

    @property
    def tilt(self) -> Annotated[Floats, "4"]:
        """Return the rotation by the smallest angle from the vertical to the floor's normal."""
        normal = np.array([-self.slope_x, 1.0, -self.slope_z])
        normal /= np.linalg.norm(normal)
        turn = np.concatenate([[1.0 + normal @ UP], np.cross(UP, normal)])
        rotation: Floats = turn / np.linalg.norm(turn)
        return rotation

    def heights(self, points: Annotated[Floats, "*batch 3"]) -> Annotated[Floats, "*batch"]:
        """Return the heights (...), m, of the floor below or above points (..., 3), m."""
        heights: Floats = (
            self.height + self.slope_x * points[..., 0] + self.slope_z * points[..., 2]
        )
        return heights

    def tilted(self, vectors: Annotated[Floats, "*batch 3"]) -> Annotated[Floats, "*batch 3"]:
        """Return vectors (..., 3) turned as the floor is tilted."""
        return quat.rotate(np.broadcast_to(self.tilt, (*vectors.shape[:-1], 4)), vectors)


def at_height(height: float) -> Floor:
    """Return the level floor at a height, m."""
    return Floor(height, 0.0, 0.0)


LEVEL_FLOOR = at_height(0.0)
"""Floor at height 0, on which motions are captured."""


@dataclass(frozen=True)
class Floors:
    """Floors of several motions, whose frames (N,) lie one after another."""

    floors: Sequence[Floor]
    groups: FrameGroups

    @property
    def sloped(self) -> Annotated[Booleans, "frames"]:
        """Return whether the floor of each frame (N,) has a slope."""
        return np.array([not floor.is_level for floor in self.floors])[self.groups.group]

    @property
    def tilts(self) -> Annotated[Floats, "frames 4"]:
        """Return the rotation from the vertical to the floor's normal at each frame (N, 4)."""
        return np.array([floor.tilt for floor in self.floors])[self.groups.group]

    def heights(self, points: Annotated[Floats, "frames 3"]) -> Annotated[Floats, "frames"]:
        """Return the heights (N,), m, of the floors below or above points (N, 3), m."""
        if all(floor == LEVEL_FLOOR for floor in self.floors):
            return np.zeros(len(points))
        groups = zip(self.floors, self.groups.split(points), strict=True)
        return np.concatenate([floor.heights(positions) for floor, positions in groups])

    def tilted(self, vectors: Annotated[Floats, "frames 3"]) -> Annotated[Floats, "frames 3"]:
        """Return vectors (N, 3) turned as the floors are tilted; level floors turn none."""
        if all(floor.is_level for floor in self.floors):
            return vectors
        turned = quat.rotate(self.tilts, vectors)
        return np.where(self.sloped[:, None], turned, vectors)
