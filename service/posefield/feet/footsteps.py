"""Plan of the feet of one motion: where each foot stands, and how low the pelvis must be.

The plan lies on a grid of equal steps of time over the whole motion, so that it does not depend on
the frames that a question asks for. `foot_placement` applies it to frames.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Bones, Frames, RootPath, Rotations
from posefield.common.units import UP, Floats
from posefield.feet import ball_path, contact_estimates, limbs, pelvis, stances, two_bone
from posefield.feet.ball_path import Footsteps
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stances import Cycle, FootPath, Interval
from posefield.motion.foot_contacts import FootContact

# Rounds in which stances are shortened whose leg does not reach.
ROUNDS = 4
# A foot may stand this much higher or lower than captured feet do, m: soles differ.
UNEVEN = 0.01


@dataclass(frozen=True)
class Character:
    """Skeleton and limbs of a character.

    parents: of the joints. bones: offsets (J, 3), m. legs: of the feet that are planted. kept: limbs
    whose ends keep their predicted paths, such as the arm of a hand with an exact target. fixed:
    whether the root keeps its height.
    """

    parents: tuple[int, ...]
    bones: Bones
    legs: tuple[Limb, ...]
    kept: tuple[Limb, ...] = ()
    fixed: bool = False

    @property
    def limbs(self) -> tuple[Limb, ...]:
        """Return the legs, and the limbs that are kept."""
        return self.legs + self.kept


@dataclass(frozen=True)
class SampledMotion:
    """Poses of a whole motion at equal steps of time.

    rotations: (F, J, 4). roots: (F, 3), m. rate: frames a second. cycle: floor motion of a cycle,
    whose last frame is missing, as it is the first one of the next; None for other motions.
    """

    rotations: Rotations
    roots: RootPath
    rate: float
    cycle: Cycle | None = None


@dataclass(frozen=True)
class FeetPlan:
    """Plan of the feet over the frames of a grid.

    rate: of the grid, frames a second. cycle: as of the motion. steps: of each leg. changes: of the
    path of each foot (K, F, 3), m. lowered: how much the root is lowered (F,), m, with what brings
    the character to the floor. grounded: the latter, m.
    """

    character: Character
    rate: float
    cycle: Cycle | None
    steps: tuple[Footsteps, ...]
    changes: Annotated[Floats, "feet frames 3"]
    lowered: Frames
    grounded: float


def plan_feet(
    character: Character,
    motion: SampledMotion,
    contacts: Sequence[FootContact] = (),
    likely: Annotated[Floats, "frames feet"] | None = None,
    floor: float = 0.0,
) -> FeetPlan:
    """Return where the feet of a motion stand, and how low its pelvis must be for that.

    Any motion may be planned, also one that is joined of several. contacts: statistics of each
    leg's foot, with the probabilities `likely` (F, K) of its contacts; both are estimated from the
    motion if they are not given. floor: height of the floor, m.
    """
    poses = limbs.evaluate_poses(
        character.parents, character.bones, character.limbs, motion.rotations, motion.roots
    )
    paths = [FootPath(poses.position(leg.tip), motion.rate, motion.cycle) for leg in character.legs]
    down = _contacts(paths, likely)
    known = list(contacts) if likely is not None else _statistics(character, paths, down)
    above = _heights_above(paths, down, known, floor)
    sunk = 0.0 if character.fixed else _sunk(above)
    heights = [
        floor + foot.height + float(np.clip(own - sunk, -UNEVEN, UNEVEN))
        for foot, own in zip(known, above, strict=True)
    ]
    # The ground first: the whole character stands as high as its feet do.
    raised = [replace(path, positions=path.positions - sunk * UP) for path in paths]
    known = [replace(foot, height=own) for foot, own in zip(known, heights, strict=True)]
    found = [
        stances.discipline(own, path, foot)
        for own, path, foot in zip(down, raised, known, strict=True)
    ]
    most = _room(poses, character, sunk)
    for _ in range(ROUNDS):
        steps = [
            ball_path.plan_path(path, own, foot)
            for path, own, foot in zip(raised, found, known, strict=True)
        ]
        needs = _needs(poses, character, paths, steps, sunk)
        shorter = [
            _shortened(own, need > most, motion) for own, need in zip(found, needs, strict=True)
        ]
        if shorter == found:
            break
        found = shorter
    changes = np.array(
        [own.positions - path.positions for own, path in zip(steps, paths, strict=True)]
    )
    lowered = sunk + _lowered(needs, most, motion)
    return FeetPlan(
        character,
        motion.rate,
        motion.cycle,
        tuple(steps),
        changes.reshape(-1, *motion.roots.shape),
        lowered,
        sunk,
    )


def _contacts(
    paths: Sequence[FootPath], likely: Annotated[Floats, "frames feet"] | None
) -> list[list[Interval]]:
    """Return the contacts of each foot, before discipline."""
    found = []
    for foot, path in enumerate(paths):
        if likely is None:
            down = contact_estimates.detect(path)
        else:
            down = np.round(likely[:, foot], stances.DECIMALS) > stances.STANDING
        found.append(stances.tidy(down, path.rate, path.cycle is not None))
    return found


def _statistics(
    character: Character, paths: Sequence[FootPath], down: Sequence[Sequence[Interval]]
) -> list[FootContact]:
    return [
        contact_estimates.describe(leg.tip, path, own)
        for leg, path, own in zip(character.legs, paths, down, strict=True)
    ]


def _heights_above(
    paths: Sequence[FootPath],
    down: Sequence[Sequence[Interval]],
    known: Sequence[FootContact],
    floor: float,
) -> list[float]:
    """Return how much higher each foot stands than captured feet do, by its median, m."""
    found = []
    for path, own, foot in zip(paths, down, known, strict=True):
        standing = path.heights[stances.mask(own, len(path))]
        found.append(float(np.median(standing)) - foot.height - floor if len(standing) else 0.0)
    return found


def _sunk(above: Sequence[float]) -> float:
    """Return how far a character floats or sinks, m, beyond the unevenness of feet."""
    mean = float(np.mean(above)) if above else 0.0
    return float(np.sign(mean) * max(abs(mean) - UNEVEN, 0.0))


def _room(poses: LimbPoses, character: Character, sunk: float) -> Frames:
    """Return how much the pelvis may be lowered (F,), m, beside what the character floats."""
    count = len(poses.positions)
    if character.fixed:
        return np.zeros(count)
    most = np.full(count, pelvis.MOST)
    for limb in character.kept:
        firm = two_bone.firm_reach(poses, limb)
        most = np.minimum(
            most, pelvis.room(poses.position(limb.upper), poses.position(limb.lower), firm) - sunk
        )
    return np.maximum(most, 0.0)


def _needs(
    poses: LimbPoses,
    character: Character,
    paths: Sequence[FootPath],
    steps: Sequence[Footsteps],
    sunk: float,
) -> list[Frames]:
    """Return how much each leg needs the pelvis to be lowered (F,), m."""
    found = []
    for leg, path, own in zip(character.legs, paths, steps, strict=True):
        target = poses.position(leg.lower) + own.positions - path.positions
        firm = two_bone.firm_reach(poses, leg)
        found.append(pelvis.need(poses.position(leg.upper) - sunk * UP, target, firm))
    return found


def _shortened(
    found: Sequence[Interval], beyond: Annotated[np.ndarray, "frames"], motion: SampledMotion
) -> list[Interval]:
    """Return the stances without the frames in which the leg does not reach."""
    count, cyclic = len(beyond), motion.cycle is not None
    shorter = []
    for stance in found:
        kept = ~beyond[np.arange(stance.begin, stance.end) % count]
        parts = stances.runs(kept, False)
        longest = max(parts, key=len, default=Interval(0, 0))
        if len(longest) >= stances.SHORTEST_CONTACT * motion.rate:
            begin = stance.begin + longest.begin
            moved = begin // count * count if cyclic else 0
            shorter.append(Interval(begin - moved, stance.begin + longest.end - moved))
    return sorted(shorter, key=lambda own: own.begin)


def _lowered(needs: Sequence[Frames], most: Frames, motion: SampledMotion) -> Frames:
    """Return how much the pelvis is lowered (F,), m, smoothly, as far as there is room."""
    cyclic = motion.cycle is not None
    wanted = np.minimum(np.max([np.zeros(len(most)), *needs], axis=0), most)
    smooth = pelvis.smooth_cover(wanted, motion.rate, cyclic)
    excess = pelvis.smooth_cover(np.maximum(smooth - most, 0.0), motion.rate, cyclic)
    return np.maximum(smooth - excess, 0.0)
