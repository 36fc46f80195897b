"""Many walkers over time: first where each is, in which phase and with which controls, then poses.

Planning is cheap, and made for all characters and frames at once. Posing is asked for whichever
pairs of character and frame are wanted.
"""

from dataclasses import dataclass, replace

import numpy as np

from service.motion.conventions import Floats, Indices, Singles
from service.synthesis.walk import plane, stride
from service.synthesis.walk.gait import Gait
from service.synthesis.walk.paths import STEP, Paths
from service.synthesis.walk.plane import Plane
from service.synthesis.walk.stride import Strides


@dataclass(frozen=True)
class Plan:
    """What N characters do at F frames of a rate, all but their poses.

    controls (N, F, d), who (N,): performers by place on the card or -1, phases (N, F): of the
    cycle, in [0, 1). places (N, F), headings (N, F), rad: of the frames that go along with them.
    """

    controls: Floats
    who: Indices
    phases: Floats
    places: Plane
    headings: Floats
    rate: float

    @property
    def roots(self) -> Floats:
        """Points (N, F, 3), m, on the floor under the characters."""
        return plane.at_height(self.places, np.zeros(self.places.shape))


def roam(
    gait: Gait, controls: Floats, who: Indices, phases: Floats, starts: tuple[Plane, Floats],
    rate: float,
) -> Plan:
    """Plan of controls (N, F, d): the way is what the model makes of them.

    phases (N,), starts: places (N,) and headings (N,), rad, at the first frame.
    """
    own = _strides(gait, controls, who)
    turns, ways = (_steps(pace / own.durations, rate) for pace in (own.turns, own.ways))
    headings = starts[1][:, None] + _summed(turns)
    steps = plane.facing(headings[:, :-1]) * plane.arc(ways, turns)
    places = starts[0][:, None] + _summed(steps)
    return Plan(controls, who, _phases(own, phases, rate), places, headings, rate)


def follow(gait: Gait, paths: Paths, who: Indices, phases: Floats, frames: int, rate: float) -> Plan:
    """Plan of paths: each character goes along its own at the speed that the model makes of the
    controls, turned as the path is.

    phases (N,): of the cycle, at the first frame.
    """
    known = paths.speeds.shape
    everyone = np.repeat(who, known[1])
    turning = (paths.speeds * paths.bends).ravel()
    wanted = gait.controls(paths.speeds.ravel(), turning, everyone)
    labels = stride.labels(gait.session, everyone)
    speeds = stride.strides(gait.session, wanted, labels).speeds.reshape(known)
    gone = _gone(speeds, frames, rate)
    controls = paths.along(wanted.reshape(*known, -1), gone)
    own = _strides(gait, controls, who)
    places, tangents = paths.at(gone)
    return Plan(controls, who, _phases(own, phases, rate), places, tangents - own.drifts, rate)


def _strides(gait: Gait, controls: Floats, who: Indices) -> Strides:
    """Cycles whose fields are (N, F), of controls (N, F, d)."""
    frames = controls.shape[:2]
    labels = stride.labels(gait.session, np.repeat(who, frames[1]))
    own = stride.strides(gait.session, controls.reshape(-1, controls.shape[2]), labels)
    return Strides(*(value.reshape(frames) for value in vars(own).values()))


def _steps(paces: Floats, rate: float) -> Floats:
    """What is done between frames (N, F - 1) at paces (N, F) a second, by the trapezoidal rule."""
    return 0.5 * (paces[:, 1:] + paces[:, :-1]) / rate


def _summed(steps: Floats) -> Floats:
    return np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))


def _phases(own: Strides, first: Floats, rate: float) -> Floats:
    return (first[:, None] + _summed(_steps(1.0 / own.durations, rate))) % 1.0


def _gone(speeds: Floats, frames: int, rate: float) -> Floats:
    """Metres (N, F) gone along ways at whose known places one has speeds (N, K)."""
    arrived = _summed(0.5 * STEP * (1.0 / speeds[:, 1:] + 1.0 / speeds[:, :-1]))
    # One interpolation for all: each row's times come after those of the row before.
    apart = np.arange(len(speeds))[:, None] * (2.0 * arrived.max())
    ways = np.tile(STEP * np.arange(speeds.shape[1]), len(speeds))
    when = np.arange(frames) / rate
    return np.interp((when + apart).ravel(), (arrived + apart).ravel(), ways).reshape(-1, frames)
