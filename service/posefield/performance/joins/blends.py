"""Blends of two passages at a cut, by which positions and velocities go on without a jump.

"dead": the passage before goes on from the cut with velocities that decay, and fades into the one
after (dead blending, Holden 2023). "hermite": the difference at the cut fades by a cubic Hermite
curve. "cut": no blend. The root's place, its height and its rotation are blended as the joints are.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np

from posefield.common.array_shapes import Frames
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.blend import smoothstep
from posefield.performance.joins.cut_search import Cut
from posefield.performance.passages.passage import RATE, Passage, concatenate

Blend = Literal["dead", "hermite", "cut"]
SECONDS: dict[Blend, float] = {"dead": 0.5, "hermite": 0.3, "cut": 0.0}
"""Usual durations of blends, s."""
HALF_LIFE = 0.08
"""Time in which velocities of the passage before halve in a dead blend, s."""

Turns = Annotated[Floats, "frames joints 4"]
Vectors = Annotated[Floats, "frames joints 3"]


def join(
    before: Passage, after: Passage, cut: Cut, kind: Blend, seconds: float | None = None
) -> Passage:
    """Return a passage that goes on into another, which lies where the cut says.

    Frame `cut.exit` of the passage is frame `cut.entry` of the one after. seconds: of the blend;
    the usual ones if not given.
    """
    return concatenate(before.part(0, cut.exit), entered(before, after, cut, kind, seconds))


def entered(
    before: Passage, after: Passage, cut: Cut, kind: Blend, seconds: float | None = None
) -> Passage:
    """Return the passage after a cut, from the cut on, with the blend.

    seconds: a blend ends with the passage after if that is shorter. Contacts and phases are those
    of the passage after. Variances are mixed, with the distance at the cut:
    s² = s_A² (1 - a) + s_B² a + d² a (1 - a), where a is the share of the passage after.
    """
    found = after.part(cut.entry, len(after))
    seconds = SECONDS[kind] if seconds is None else seconds
    frames = min(round(seconds * RATE), len(found) - 1)
    if kind == "cut" or frames < 1:
        return found
    times = np.arange(frames) / RATE
    shares = smoothstep(times * RATE / frames)
    fade = _dead if kind == "dead" else _hermite
    own, other = _moments(before, cut.exit), _moments(after, cut.entry)
    turns = found.rotations[:frames]
    rotations, roots = found.rotations.copy(), found.roots.copy()
    rotations[:frames], roots[:frames] = fade(own, other, times, shares, turns, roots[:frames])
    variance = np.square(before.sigmas[cut.exit]) * (1.0 - shares)
    variance = variance + np.square(found.sigmas[:frames]) * shares
    variance = variance + cut.distance**2 * shares * (1.0 - shares)
    sigmas = np.concatenate([np.sqrt(variance), found.sigmas[frames:]])
    return replace(found, rotations=rotations, roots=roots, sigmas=sigmas)


@dataclass(frozen=True)
class _Moment:
    """Pose and velocities of a frame.

    turns: rotations (J, 4). spins: velocities (J, 3), rad/s, in the axes of the parents. root: (3,)
    m. way: its velocity (3,), m/s.
    """

    turns: Annotated[Floats, "joints 4"]
    spins: Annotated[Floats, "joints 3"]
    root: Annotated[Floats, "3"]
    way: Annotated[Floats, "3"]

    def at(self, time: float) -> tuple[Annotated[Floats, "joints 4"], Annotated[Floats, "3"]]:
        """Return rotations (J, 4) and root (3,), m, of even motion at a time from the frame, s."""
        return quat.mul(quat.exp(time * self.spins), self.turns), self.root + time * self.way


def _moments(passage: Passage, frame: int) -> _Moment:
    """Return a frame with its velocities: central differences, or of one side at an end."""
    earlier, later = max(frame - 1, 0), min(frame + 1, len(passage) - 1)
    time = max(later - earlier, 1) / RATE
    turned = quat.mul(passage.rotations[later], quat.conj(passage.rotations[earlier]))
    way = (passage.roots[later] - passage.roots[earlier]) / time
    return _Moment(passage.rotations[frame], quat.log(turned) / time, passage.roots[frame], way)


def _dead(
    own: _Moment, other: _Moment, times: Frames, shares: Frames, turns: Turns, roots: Any
) -> tuple[Turns, Annotated[Floats, "frames 3"]]:
    """Return the frames of a dead blend: the passage before, that fades into the one after.

    At the cut the share of the passage after is zero, and so is its slope: the velocity is that of
    the passage before.
    """
    rate = np.log(2.0) / HALF_LIFE
    gone = -np.expm1(-rate * times) / rate
    source = quat.mul(quat.exp(gone[:, None, None] * own.spins), own.turns)
    offsets = _continuous_log(quat.mul(source, quat.conj(turns)))
    left = (1.0 - shares)[:, None]
    path = roots + left * (own.root + gone[:, None] * own.way - roots)
    return quat.mul(quat.exp(left[..., None] * offsets), turns), path


def _hermite(
    own: _Moment, other: _Moment, times: Frames, shares: Frames, turns: Turns, roots: Any
) -> tuple[Turns, Annotated[Floats, "frames 3"]]:
    """Return the frames of a Hermite blend: an offset that fades from its place and velocity."""
    whole = len(times) / RATE
    share = times / whole
    place = 1.0 - smoothstep(share)
    slope = whole * share * np.square(1.0 - share)
    step = 1.0 / RATE
    around = [
        quat.mul(own.at(time)[0], quat.conj(other.at(time)[0])) for time in (-step, 0.0, step)
    ]
    first, offset, last = _continuous_log(np.stack(around), start=1)
    speed = (last - first) / (2.0 * step)
    turned = place[:, None, None] * offset + slope[:, None, None] * speed
    path = roots + place[:, None] * (own.root - other.root)
    path = path + slope[:, None] * (own.way - other.way)
    return quat.mul(quat.exp(turned), turns), path


def _continuous_log(q: Turns, start: int = 0) -> Vectors:
    """Return rotation vectors (F, J, 3), rad, that do not jump from frame to frame.

    Those of the frame `start` are the shortest; others may be longer than half a turn.
    """
    near = quat.unroll(q)
    near = near * np.where(near[start, :, :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(near[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, near[..., :1])
    return np.where(sine < 1e-12, 2.0, angle / np.maximum(sine, 1e-12)) * near[..., 1:]
