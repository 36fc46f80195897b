"""Motions of segments at one frame rate, and rigid motions over the floor that place them."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import RootPath, Rotations
from posefield.common.units import UP, Floats
from posefield.locomotion import floor_plane
from posefield.motion import quat

RATE = 60.0
"""Frames a second at which performances are planned and joined, whatever their frame rate is."""


@dataclass(frozen=True)
class FloorMotion:
    """Rigid motion over the floor: a turn about +Y, rad, then a shift, m.

    shift: forward is its real part, left its imaginary part, as in `floor_plane`.
    """

    turn: float = 0.0
    shift: complex = 0j

    def place(self, points: Annotated[Floats, "*batch 3"]) -> Annotated[Floats, "*batch 3"]:
        """Return the moved points (..., 3), m."""
        found = floor_plane.project(points) * np.exp(1j * self.turn) + self.shift
        return floor_plane.at_height(found, points[..., 1])

    def after(self, first: "FloorMotion") -> "FloorMotion":
        """Return the motion that is `first`, then this one."""
        return FloorMotion(
            self.turn + first.turn, complex(np.exp(1j * self.turn) * first.shift + self.shift)
        )

    def inverse(self) -> "FloorMotion":
        """Return the motion back."""
        return FloorMotion(-self.turn, complex(-np.exp(-1j * self.turn) * self.shift))


@dataclass(frozen=True)
class Passage:
    """Motion of one segment at `RATE` frames a second.

    rotations: (F, J, 4), local to the parents, wxyz. roots: (F, 3), m. contacts: probabilities
    (F, K) that the feet of the performance touch the ground. sigmas: (F,), m. phases: of the cycle
    (F,), in [0, 1); None for motions without one.
    """

    rotations: Rotations
    roots: RootPath
    contacts: Annotated[Floats, "frames feet"]
    sigmas: Annotated[Floats, "frames"]
    phases: Annotated[Floats, "frames"] | None = None

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.roots)

    def heading(self, frame: int = 0) -> float:
        """Return the heading of the root in a frame, rad."""
        return float(quat.twist(self.rotations[frame, 0], UP))

    def placed(self, by: FloorMotion) -> "Passage":
        """Return the passage moved over the floor."""
        turned = floor_plane.turn_roots(self.rotations, np.full(len(self), by.turn))
        return replace(self, rotations=turned, roots=by.place(self.roots))

    def part(self, begin: int, end: int) -> "Passage":
        """Return the frames from `begin` until before `end`."""
        rows = slice(begin, end)
        phases = None if self.phases is None else self.phases[rows]
        return Passage(
            self.rotations[rows], self.roots[rows], self.contacts[rows], self.sigmas[rows], phases
        )


def concatenate(*parts: Passage) -> Passage:
    """Return passages one after another; with phases if all have them."""
    phases = [part.phases for part in parts if part.phases is not None]
    return Passage(
        np.concatenate([part.rotations for part in parts]),
        np.concatenate([part.roots for part in parts]),
        np.concatenate([part.contacts for part in parts]),
        np.concatenate([part.sigmas for part in parts]),
        np.concatenate(phases) if len(phases) == len(parts) else None,
    )
