"""Errors with which a finished walk follows its plan, as means over one cycle."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from posefield.common.array_shapes import RootPath, Rotations
from posefield.common.units import Floats
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import quat
from posefield.performance.passages.passage import RATE
from posefield.performance.walks.walk_segment import WalkPlan


@dataclass(frozen=True)
class PathErrors:
    """Root mean squares of the errors of a walk, each error a mean over one cycle of phase.

    lateral, along: of the root across and along the path, m. heading: of the direction of travel,
    rad. facing: of the root's heading relative to the path about its own mean, rad. speed: m/s.
    cycles: number of whole cycles; without one, all errors are zero.
    """

    lateral: float
    along: float
    heading: float
    facing: float
    speed: float
    cycles: float


def measure(plan: WalkPlan, roots: RootPath, rotations: Rotations) -> PathErrors:
    """Return the errors of a finished motion of F frames against its plan.

    roots: (F, 3), m, and rotations: (F, J, 4), in the plan's place.
    """
    cycles = float(plan.phases[-1] - plan.phases[0])
    if cycles < 1.0:
        return PathErrors(0.0, 0.0, 0.0, 0.0, 0.0, cycles)
    centres, tangents = plan.path.at(plan.distances)
    own = floor_plane.project(roots)
    off = _means(plan.phases, (own - centres) * np.exp(-1j * tangents))
    travel = _travel(plan, own)
    asked = _travel(plan, centres)
    facing = _means(plan.phases, np.unwrap(_headings(rotations)) - tangents)
    return PathErrors(
        _rms(off.imag),
        _rms(off.real),
        _rms(np.angle(travel / asked)),
        _rms(facing - facing.mean()),
        _rms(np.abs(travel) - np.abs(asked)),
        cycles,
    )


def _travel(
    plan: WalkPlan, places: Annotated[FloorVectors, "frames"]
) -> Annotated[FloorVectors, "means"]:
    """Return velocities (M,) from one cycle's beginning to its end, m/s."""
    begins, ends, times = _cycles(plan.phases)
    at = np.arange(len(places))
    moved = np.interp(ends, at, places) - np.interp(begins, at, places)
    return np.asarray(moved / times)


def _means(
    phases: Annotated[Floats, "frames"], values: Annotated[Floats | FloorVectors, "frames"]
) -> Annotated[Any, "means"]:
    """Return the means (M,) of values over one cycle of phase that begins at each frame."""
    begins, ends, _ = _cycles(phases)
    steps = 0.5 * (values[1:] + values[:-1]) * np.diff(phases)
    sums, at = np.pad(np.cumsum(steps), (1, 0)), np.arange(len(values))
    return np.asarray(np.interp(ends, at, sums) - np.interp(begins, at, sums))


def _cycles(
    phases: Annotated[Floats, "frames"],
) -> tuple[Annotated[Floats, "means"], Annotated[Floats, "means"], Annotated[Floats, "means"]]:
    """Return frames (M,) at which cycles begin and end, and their durations, s."""
    begins = np.flatnonzero(phases <= phases[-1] - 1.0)
    ends = np.interp(phases[begins] + 1.0, phases, np.arange(len(phases)))
    return begins.astype(float), ends, (ends - begins) / RATE


def _headings(rotations: Rotations) -> Annotated[Floats, "frames"]:
    """Return the headings (F,), rad, to which the roots turn the direction z."""
    forward = quat.rotate(rotations[:, 0], np.array([0.0, 0.0, 1.0]))
    return np.angle(floor_plane.project(forward))


def _rms(values: Annotated[Floats, "means"]) -> float:
    return float(np.sqrt(np.mean(values**2)))
