"""Search of the frames at which one passage goes on into another, and of where the other lies.

The cost of a pair of frames is that of Kovar and Gleicher (2002): squared distances of the joints
and of their velocities, after the rigid motion over the floor that makes them least. With points
of the floor as complex numbers that motion is in closed form (Procrustes), for all pairs at once.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from posefield.common.units import UP, Floats
from posefield.feet.contact_estimates import DECIMALS, STANDING
from posefield.feet.footsteps import Character
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import skeleton
from posefield.performance.passages.passage import RATE, FloorMotion, Passage

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
    turns, gaps = _best_motions(sums) if motion is None else _given(left, right, motion)
    costs = _costs(sums, turns, gaps) / left.floor.shape[1]
    place = int(np.argmin(np.round(costs / GRAIN)))
    row, column = divmod(place, len(entries))
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
    moved = skeleton.translations(character.bones, passage.roots[begin:end])
    return skeleton.positions(character.parents, passage.rotations[begin:end], moved)


def _poses(character: Character, passage: Passage, frames: range) -> _Poses:
    """Return the poses of frames with their velocities: central differences, or of one side."""
    begin, end = max(frames[0] - 1, 0), min(frames[-1] + 2, len(passage))
    found = positions(character, passage, begin, end)
    own = np.array(frames) - begin
    earlier, later = np.maximum(own - 1, 0), np.minimum(own + 1, end - begin - 1)
    time = np.maximum(later - earlier, 1)[:, None, None] / RATE
    velocities = (found[later] - found[earlier]) / time * VELOCITY_TIME
    places = found[own]
    floor, roots = floor_plane.project(places), floor_plane.project(passage.roots[frames])
    extra = np.zeros(floor.shape)
    standing = np.round(passage.contacts[frames], DECIMALS) > STANDING
    for leg, stands in zip(character.legs, standing.T, strict=True):
        extra[:, leg.tip] = np.sqrt(FOOT_WEIGHT - 1.0) * stands
    flow, climb = floor_plane.project(velocities), velocities @ UP
    return _Poses(roots, floor - roots[:, None], places @ UP, flow, climb, extra)


def _best_motions(sums: "_Sums") -> tuple[PairVectors, PairVectors]:
    """Return turns (E, B) and gaps (E, B) of the roots that make the cost of each pair least."""
    found = sums.products - sums.left * np.conj(sums.right) / sums.weights
    size = np.abs(found)
    turns = np.where(size > 0.0, found / np.maximum(size, 1e-300), 1.0)
    return turns, (sums.left - turns * sums.right) / sums.weights


def _given(left: _Poses, right: _Poses, motion: FloorMotion) -> tuple[PairVectors, PairVectors]:
    """Return the turns and gaps (E, B) of one floor motion."""
    turn = np.exp(1j * motion.turn)
    gaps = (turn * right.roots + motion.shift)[None] - left.roots[:, None]
    return np.full(gaps.shape, turn), gaps


def _costs(sums: "_Sums", turns: PairVectors, gaps: PairVectors) -> PairValues:
    """Return the costs (E, B), m², of pairs under floor motions, summed over the joints."""
    apart = sums.squares - 2.0 * (np.conj(turns) * sums.products).real
    apart += sums.weights * np.square(np.abs(gaps))
    apart -= 2.0 * (np.conj(gaps) * (sums.left - turns * sums.right)).real
    found: Floats = np.maximum(apart, 0.0)
    return found


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
    own, other = (np.square(np.abs(side.floor)) + np.square(side.heights) for side in (left, right))
    moving = [
        np.sum(np.square(np.abs(side.flow)) + np.square(side.climb), axis=1)
        for side in (left, right)
    ]
    squares = left.weigh(own) @ right.weigh(ones[1]).T + left.weigh(ones[0]) @ right.weigh(other).T
    products = left.weigh(left.floor) @ right.weigh(right.floor).conj().T
    return _Sums(
        left.weigh(ones[0]) @ right.weigh(ones[1]).T,
        left.weigh(left.floor) @ right.weigh(ones[1]).T,
        left.weigh(ones[0]) @ right.weigh(right.floor).T,
        products + left.flow @ right.flow.conj().T,
        squares + moving[0][:, None] + moving[1] - 2.0 * upright,
    )
