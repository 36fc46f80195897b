"""Joins of two passages: the frames at which one goes on into the other, and the blend there.

The cost of a pair of frames is that of Kovar and Gleicher (2002): squared distances of the joints
and of their velocities, after the rigid motion over the floor that makes them least. With points
of the floor as complex numbers that motion is in closed form (Procrustes), for all pairs at once.

By a blend positions and velocities go on without a jump. "dead": the passage before goes on from
the cut with velocities that decay, and fades into the one after (dead blending, Holden 2023).
"hermite": the difference at the cut fades by a cubic Hermite curve. "cut": no blend. The root's
place, its height and its rotation are blended as the joints are.
"""

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt

from posefield.common.units import UP, Floats, Frames
from posefield.feet.footsteps import Character
from posefield.feet.stance_rows import DECIMALS, STANDING
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import quat, skeleton
from posefield.motion.quat import smoothstep
from posefield.performance.passage import RATE, FloorMotion, Passage, concatenate

VELOCITY_TIME = 0.15
"""Time by which velocities are multiplied to compare them with distances, s."""
FOOT_WEIGHT = 30.0
"""Weight of a foot that stands on both sides, over that of other joints."""
# Costs are compared to this, m², so that two machines cut at the same frames.
GRAIN = 1e-9

Numbers = npt.NDArray[Any]
PairValues = Annotated[Floats, "exits entries"]
PairVectors = Annotated[FloorVectors, "exits entries"]


@dataclass(frozen=True)
class Cut:
    """Frames of two passages that are one frame of their join.

    exit: of the passage before. entry: of that after. motion: over the floor, of the passage after.
    cost: m². distance: RMS over the joints, m.
    """

    exit: int
    entry: int
    motion: FloorMotion
    cost: float
    distance: float


@dataclass(frozen=True)
class _Poses:
    """Poses from which, or into which, a motion goes on, each about its own root.

    roots: over the floor (N,). floor, heights: of the joints (N, J). flow, climb: their velocities
    times `VELOCITY_TIME` (N, J), m. extra: roots of the additional weights of joints of feet that
    stand (N, J).
    """

    roots: Annotated[FloorVectors, "poses"]
    floor: Annotated[FloorVectors, "poses joints"]
    heights: Annotated[Floats, "poses joints"]
    flow: Annotated[FloorVectors, "poses joints"]
    climb: Annotated[Floats, "poses joints"]
    extra: Annotated[Floats, "poses joints"]

    def weigh(self, values: Numbers) -> Numbers:
        """Return values (N, J) whose products (N, 2 J) with those of another side have weights.

        A joint's product is counted once, and again by its additional weight if it has one on both
        sides.
        """
        return np.concatenate([values, values * self.extra], axis=1)


def find_cut(
    character: Character,
    before: Passage,
    after: Passage,
    exits: range,
    entries: range,
    motion: FloorMotion | None = None,
) -> Cut:
    """Return the best cut between frames `exits` of one passage and `entries` of another.

    Columns of contacts are those of the character's legs. motion: over the floor, of the passage
    after, if it is given; each pair has its own best one if not. Pairs of equal cost: the earlier
    exit, then the earlier entry. Raises ValueError without frames to search.
    """
    if not len(exits) or not len(entries):
        raise ValueError(f"{len(exits)} exits and {len(entries)} entries, expected one or more")
    left, right = _poses(character, before, exits), _poses(character, after, entries)
    sums = _sums(left, right)
    if motion is None:
        products = sums.products - sums.left * np.conj(sums.right) / sums.weights
        size = np.abs(products)
        turns = np.where(size > 0.0, products / np.maximum(size, 1e-300), 1.0)
        gaps = (sums.left - turns * sums.right) / sums.weights
    else:
        factor = np.exp(1j * motion.turn)
        gaps = (factor * right.roots + motion.shift)[None] - left.roots[:, None]
        turns = np.full(gaps.shape, factor)
    costs = _costs(sums, turns, gaps) / left.floor.shape[1]
    best = int(np.argmin(np.round(costs / GRAIN)))
    row, column = divmod(best, len(entries))
    turn, gap = complex(turns[row, column]), complex(gaps[row, column])
    if motion is None:
        # The gap is that of the roots; the shift also undoes what the turn does to the root.
        shift = left.roots[row] + gap - turn * right.roots[column]
        motion = FloorMotion(float(np.angle(turn)), complex(shift))
    away = np.abs(left.floor[row] - turn * right.floor[column] - gap)
    away = np.hypot(away, left.heights[row] - right.heights[column])
    distance = float(np.sqrt(np.mean(np.square(away))))
    return Cut(exits[row], entries[column], motion, float(costs[row, column]), distance)


def positions(
    character: Character, passage: Passage, begin: int, end: int
) -> Annotated[Floats, "frames joints 3"]:
    """Return the joint positions (F, J, 3), m, of frames `begin` until before `end`."""
    translations = skeleton.translations(character.bones, passage.roots[begin:end])
    return skeleton.positions(character.parents, passage.rotations[begin:end], translations)


def _poses(character: Character, passage: Passage, frames: range) -> _Poses:
    """Return the poses of frames with their velocities: central differences, or of one side."""
    begin, end = max(frames[0] - 1, 0), min(frames[-1] + 2, len(passage))
    points = positions(character, passage, begin, end)
    rows = np.array(frames) - begin
    earlier, later = np.maximum(rows - 1, 0), np.minimum(rows + 1, end - begin - 1)
    time = np.maximum(later - earlier, 1)[:, None, None] / RATE
    velocities = (points[later] - points[earlier]) / time * VELOCITY_TIME
    centres = points[rows]
    floor, roots = floor_plane.project(centres), floor_plane.project(passage.roots[frames])
    extra = np.zeros(floor.shape)
    standing = np.round(passage.contacts[frames], DECIMALS) > STANDING
    for leg, stands in zip(character.legs, standing.T, strict=True):
        extra[:, leg.tip] = np.sqrt(FOOT_WEIGHT - 1.0) * stands
    flow, climb = floor_plane.project(velocities), velocities @ UP
    return _Poses(roots, floor - roots[:, None], centres @ UP, flow, climb, extra)


def _costs(sums: "_Sums", turns: PairVectors, gaps: PairVectors) -> PairValues:
    """Return the costs (E, B), m², of pairs under floor motions, summed over the joints."""
    squares = sums.squares - 2.0 * (np.conj(turns) * sums.products).real
    squares += sums.weights * np.square(np.abs(gaps))
    squares -= 2.0 * (np.conj(gaps) * (sums.left - turns * sums.right)).real
    costs: Floats = np.maximum(squares, 0.0)
    return costs


@dataclass(frozen=True)
class _Sums:
    """Weighted sums over the joints of pairs (E, B), with the velocities where they act.

    weights: of the points. left, right: of the points. products: of the points of the left by the
    conjugates of those of the right. squares: of what a floor motion leaves as it is, m².
    """

    weights: PairValues
    left: PairVectors
    right: PairVectors
    products: PairVectors
    squares: PairValues


def _sums(left: _Poses, right: _Poses) -> _Sums:
    """Return the sums of all pairs, each by one product of matrices."""
    ones = [np.ones(side.floor.shape) for side in (left, right)]
    # Heights and climbs do not depend on the motion: their products belong to the squares.
    upright = left.weigh(left.heights) @ right.weigh(right.heights).T
    upright += left.climb @ right.climb.T
    left_squares, right_squares = (
        np.square(np.abs(side.floor)) + np.square(side.heights) for side in (left, right)
    )
    moving = [
        np.sum(np.square(np.abs(side.flow)) + np.square(side.climb), axis=1)
        for side in (left, right)
    ]
    squares = (
        left.weigh(left_squares) @ right.weigh(ones[1]).T
        + left.weigh(ones[0]) @ right.weigh(right_squares).T
    )
    products = left.weigh(left.floor) @ right.weigh(right.floor).conj().T
    return _Sums(
        left.weigh(ones[0]) @ right.weigh(ones[1]).T,
        left.weigh(left.floor) @ right.weigh(ones[1]).T,
        left.weigh(ones[0]) @ right.weigh(right.floor).T,
        products + left.flow @ right.flow.conj().T,
        squares + moving[0][:, None] + moving[1] - 2.0 * upright,
    )


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
    passage = after.part(cut.entry, len(after))
    seconds = SECONDS[kind] if seconds is None else seconds
    frames = min(round(seconds * RATE), len(passage) - 1)
    if kind == "cut" or frames < 1:
        return passage
    times = np.arange(frames) / RATE
    shares = smoothstep(times * RATE / frames)
    fade = _dead if kind == "dead" else _hermite
    moment_before, moment_after = _moments(before, cut.exit), _moments(after, cut.entry)
    turns = passage.rotations[:frames]
    rotations, roots = passage.rotations.copy(), passage.roots.copy()
    rotations[:frames], roots[:frames] = fade(
        moment_before, moment_after, times, shares, turns, roots[:frames]
    )
    variance = np.square(before.sigmas[cut.exit]) * (1.0 - shares)
    variance = variance + np.square(passage.sigmas[:frames]) * shares
    variance = variance + cut.distance**2 * shares * (1.0 - shares)
    sigmas = np.concatenate([np.sqrt(variance), passage.sigmas[frames:]])
    return replace(passage, rotations=rotations, roots=roots, sigmas=sigmas)


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
    velocity = (passage.roots[later] - passage.roots[earlier]) / time
    return _Moment(
        passage.rotations[frame], quat.log(turned) / time, passage.roots[frame], velocity
    )


def _dead(
    source_moment: _Moment,
    target_moment: _Moment,
    times: Frames,
    shares: Frames,
    turns: Turns,
    roots: Any,
) -> tuple[Turns, Annotated[Floats, "frames 3"]]:
    """Return the frames of a dead blend: the passage before, that fades into the one after.

    At the cut the share of the passage after is zero, and so is its slope: the velocity is that of
    the passage before.
    """
    rate = np.log(2.0) / HALF_LIFE
    gone = -np.expm1(-rate * times) / rate
    source = quat.mul(quat.exp(gone[:, None, None] * source_moment.spins), source_moment.turns)
    offsets = _continuous_log(quat.mul(source, quat.conj(turns)))
    left = (1.0 - shares)[:, None]
    path = roots + left * (source_moment.root + gone[:, None] * source_moment.way - roots)
    return quat.mul(quat.exp(left[..., None] * offsets), turns), path


def _hermite(
    source_moment: _Moment,
    target_moment: _Moment,
    times: Frames,
    shares: Frames,
    turns: Turns,
    roots: Any,
) -> tuple[Turns, Annotated[Floats, "frames 3"]]:
    """Return the frames of a Hermite blend: an offset that fades from its place and velocity."""
    seconds = len(times) / RATE
    share = times / seconds
    fade = 1.0 - smoothstep(share)
    slope = seconds * share * np.square(1.0 - share)
    step = 1.0 / RATE
    around = [
        quat.mul(source_moment.at(time)[0], quat.conj(target_moment.at(time)[0]))
        for time in (-step, 0.0, step)
    ]
    first, offset, last = _continuous_log(np.stack(around), start=1)
    speed = (last - first) / (2.0 * step)
    turned = fade[:, None, None] * offset + slope[:, None, None] * speed
    path = roots + fade[:, None] * (source_moment.root - target_moment.root)
    path = path + slope[:, None] * (source_moment.way - target_moment.way)
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
