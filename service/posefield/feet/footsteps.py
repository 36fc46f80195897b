"""Plan of the feet of one motion: where each foot stands, and how low the pelvis must be.

The plan lies on a grid of equal steps of time over the whole motion, so that it does not depend on
the frames that a question asks for. `foot_placement` applies it to frames.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Bones, Frames, RootPath, Rotations
from posefield.common.units import UP, Booleans, Floats
from posefield.feet import ball_path, contact_estimates, leads, limbs, pelvis, stances
from posefield.feet.ball_path import Footsteps
from posefield.feet.leads import Led
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stances import UNEVEN, Cycle, FootPath, Interval
from posefield.motion.foot_contacts import FootContact
from posefield.question.floor import LEVEL_FLOOR, Floor

# Rounds in which stances are shortened whose leg does not reach.
ROUNDS = 4
# On a slope the feet of a step differ in height: the pelvis is lowered by this length times the
# slope more, m.
STEP = 0.4


@dataclass(frozen=True)
class Character:
    """Skeleton and limbs of a character.

    parents: of the joints. bones: offsets (J, 3), m. legs: of the feet that are planted. kept:
    limbs whose ends keep their predicted paths while they are led there, such as the arm of a hand
    with an exact target.
    fixed: whether the pelvis keeps its height above the floor. raised: whether a fixed one follows
    the floor nevertheless.
    """

    parents: tuple[int, ...]
    bones: Bones
    legs: tuple[Limb, ...]
    kept: tuple[Limb, ...] = ()
    fixed: bool = False
    raised: bool = False

    @property
    def limbs(self) -> tuple[Limb, ...]:
        """Return the legs, and the limbs that are kept."""
        return self.legs + self.kept


@dataclass(frozen=True)
class SampledMotion:
    """Poses of a whole motion at equal steps of time.

    rotations: (F, J, 4). roots: (F, 3), m. rate: frames a second. cycle: floor motion of a cycle,
    whose last frame is missing, as it is the first one of the next; None for other motions.
    walking: whether it walks in each frame (F,); None for a motion that is no walk.
    """

    rotations: Rotations
    roots: RootPath
    rate: float
    cycle: Cycle | None = None
    walking: Annotated[Booleans, "frames"] | None = None


@dataclass(frozen=True)
class FeetPlan:
    """Plan of the feet over the frames of a grid.

    rate: of the grid, frames a second. cycle: as of the motion. steps: of each leg. changes: of the
    path of each foot (K, F, 3), m. lowered: how much the root is lowered (F,), m. followed: the
    part of it that follows the floor (F,), m; the rest is the pelvis. grounded: how much a
    character that floats was lowered to the level on which it was captured, m. poses: predicted, of
    the limbs. led: what keeps its predicted path, and when. floor: on which the feet stand.
    unreached: legs, by place, none of whose stances reaches it.
    """

    character: Character
    rate: float
    cycle: Cycle | None
    steps: tuple[Footsteps, ...]
    changes: Annotated[Floats, "feet frames 3"]
    lowered: Frames
    followed: Frames
    grounded: float
    poses: LimbPoses
    led: Led
    floor: Floor = LEVEL_FLOOR
    unreached: tuple[int, ...] = ()


def plan_feet(
    character: Character,
    motion: SampledMotion,
    contacts: Sequence[FootContact] = (),
    likely: Annotated[Floats, "frames feet"] | None = None,
    floor: Floor = LEVEL_FLOOR,
    led: Led | None = None,
) -> FeetPlan:
    """Return where the feet of a motion stand, and how low its pelvis must be for that.

    Any motion may be planned, also one that is joined of several. contacts: statistics of each
    leg's foot, with the probabilities `likely` (F, K) of its contacts; both are estimated from the
    motion if they are not given. floor: on which the feet stand. The steps are those of a floor at
    height 0, moved to it. A cycle does not climb: its floor must be level. led: what keeps its
    predicted path; the kept limbs all the time if not given. A foot is led over a level floor only.
    """
    poses = limbs.evaluate_poses(
        character.parents, character.bones, character.limbs, motion.rotations, motion.roots
    )
    paths = [
        FootPath(poses.position(leg.tip), motion.rate, motion.cycle, motion.walking)
        for leg in character.legs
    ]
    if likely is None:
        down = contact_estimates.from_motion(paths)
        known = [
            contact_estimates.statistics(leg.tip, path, own)
            for leg, path, own in zip(character.legs, paths, down, strict=True)
        ]
    else:
        down, known = contact_estimates.from_probabilities(paths, likely), list(contacts)
    led = led or leads.always(len(paths), len(character.kept), len(motion.roots))
    room = led.room(poses, character.limbs)
    above = contact_estimates.heights_above(paths, down, known)
    grounded = _grounded(above, room, character)
    # The ground first: the whole character stands as high as its feet do.
    feet = [
        _GroundedFoot(
            replace(path, positions=path.positions - grounded * UP),
            replace(foot, height=foot.height + float(np.clip(own - grounded, -UNEVEN, UNEVEN))),
            leads.goals(path, exact),
        )
        for path, foot, own, exact in zip(paths, known, above, led.feet, strict=True)
    ]
    found = [_stances(own, foot) for own, foot in zip(down, feet, strict=True)]
    followed = _follow(floor, grounded, motion, room, character)
    body = _GroundedBody(poses, character, floor, grounded, followed, room[1])
    steps, lowered = _reachable_steps(body, feet, found)
    changes = np.array(
        [own.positions - path.positions for own, path in zip(steps, paths, strict=True)]
    ).reshape(-1, *motion.roots.shape)
    return FeetPlan(
        character,
        motion.rate,
        motion.cycle,
        tuple(steps),
        changes,
        followed + lowered,
        followed,
        grounded,
        poses,
        led,
        floor,
        _unreached(floor, found, steps),
    )


@dataclass(frozen=True)
class _GroundedFoot:
    """A foot of a character that stands on the floor.

    contact: with its own height, m. goal: where the foot is led (F, 3), m, as of `leads.goals`.
    """

    path: FootPath
    contact: FootContact
    goal: RootPath


@dataclass(frozen=True)
class _GroundedBody:
    """Character on a floor.

    grounded: how much it is lowered to the level on which it was captured, m. followed: the same,
    and how its root follows the floor (F,), m. below: how far the predicted root may be lowered
    (F,), m.
    """

    poses: LimbPoses
    character: Character
    floor: Floor
    grounded: float
    followed: Frames
    below: Frames


def _stances(down: Sequence[Interval], foot: _GroundedFoot) -> list[Interval]:
    """Return the stances of a foot whose swings are as captured ones, or where it is led."""
    found = stances.discipline(down, foot.path, foot.contact)
    return leads.lead_stances(found, foot.path, foot.contact, foot.goal)


def _reachable_steps(
    body: _GroundedBody, feet: Sequence[_GroundedFoot], found: Sequence[list[Interval]]
) -> tuple[list[Footsteps], Frames]:
    """Return the steps of the feet, and how much the pelvis is lowered for them (F,), m.

    Stances whose leg does not reach are shortened.
    """
    count, legs = len(body.poses.positions), body.character.legs
    deepest = pelvis.MOST + STEP * body.floor.slope
    most = np.clip(body.below - body.followed, 0.0, deepest)
    if body.character.fixed:
        most = np.zeros(count)
    planned = [
        _plan_foot(body, leg, foot, own) for leg, foot, own in zip(legs, feet, found, strict=True)
    ]
    for _ in range(ROUNDS):
        shorter = [
            stances.shortened(own, pelvis.beyond(foot.need, most), path.path)
            for own, foot, path in zip(found, planned, feet, strict=True)
        ]
        if shorter == found:
            break
        planned = [
            known if new == old else _plan_foot(body, leg, foot, new)
            for known, leg, foot, old, new in zip(planned, legs, feet, found, shorter, strict=True)
        ]
        found = shorter
    rate = feet[0].path.rate if feet else 1.0
    cyclic = bool(feet and feet[0].path.cycle)
    needs = [foot.need for foot in planned]
    return [foot.steps for foot in planned], pelvis.lower(needs, most, rate, cyclic)


@dataclass(frozen=True)
class _PlannedFoot:
    """Steps of a foot, and how much lower its leg needs the pelvis to be (F,), m."""

    steps: Footsteps
    need: Frames


def _plan_foot(
    body: _GroundedBody, leg: Limb, foot: _GroundedFoot, found: list[Interval]
) -> _PlannedFoot:
    """Return the steps of a foot that stands in the intervals `found`."""
    poses = body.poses
    steps = ball_path.plan_path(foot.path, found, foot.contact, foot.goal)
    steps = steps.on_floor(body.floor)
    target = poses.position(leg.lower) - body.grounded * UP + steps.positions - foot.path.positions
    if not body.floor.is_level:
        arm = poses.position(leg.tip) - poses.position(leg.lower)
        target = target + arm - body.floor.tilted(arm)
    return _PlannedFoot(steps, pelvis.need(poses, leg, target, body.followed))


def _unreached(
    floor: Floor, found: Sequence[list[Interval]], steps: Sequence[Footsteps]
) -> tuple[int, ...]:
    """Return the legs, by place, that stood as predicted, but do not on a given floor."""
    if floor == LEVEL_FLOOR:
        return ()
    return tuple(leg for leg, own in enumerate(steps) if found[leg] and not own.stances)


def _grounded(above: Sequence[float], room: tuple[Frames, Frames], character: Character) -> float:
    """Return how far a character is lowered to the ground, m: it floats, or sinks, by its feet.

    Feet may be uneven, and limbs that keep their ends must reach them.
    """
    if character.fixed or not above:
        return 0.0
    mean = float(np.mean(above))
    up, down = room
    wanted = float(np.sign(mean) * max(abs(mean) - UNEVEN, 0.0))
    return float(np.clip(wanted, -up.min(), down.min()))


def _follow(
    floor: Floor,
    grounded: float,
    motion: SampledMotion,
    room: tuple[Frames, Frames],
    character: Character,
) -> Frames:
    """Return how much the root is lowered so that it follows the floor (F,), m.

    Limbs that keep their ends must reach them; the legs make up for the rest.
    """
    wanted = grounded - floor.heights(motion.roots)
    if character.fixed and not character.raised:
        return np.zeros(len(wanted))
    up, down = room
    cyclic = motion.cycle is not None
    high = pelvis.cover(np.maximum(-wanted - up, 0.0), motion.rate, cyclic)
    low = pelvis.cover(np.maximum(wanted - down, 0.0), motion.rate, cyclic)
    found: Frames = wanted + high - low
    return found
